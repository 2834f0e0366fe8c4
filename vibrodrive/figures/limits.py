"""The limits of stability above the bifurcation diagram they belong to, on one A axis."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrodrive.figures.bifurcation import density
from vibrodrive.figures.style import INK, letter, name_axes, new, note, styled
from vibrodrive.store.limits import CURVES, Limits

LOOKS = {
    ("eps", "certified"): ("-", "0.55", r"$k_2(\varepsilon)$"),
    ("dtau", "fixed"): ("--", "0.8", r"$k_2(\Delta\tau)$, switches on the grid"),
    ("dtau", "muller"): (":", "0.9", r"$k_2(\Delta\tau)$, Muller"),
}
"""Line style, tone of the band and name of each curve."""

WIDE = 0.035
"""A stretch of one period is labelled if it takes this share of the axis."""


@styled
def limits_figure(found: Limits) -> Figure:
    """Bands from the first loss k₂ to the last value kept, over A; below, the undisturbed motion's diagram.

    A band has no height where nothing is kept above the first loss; it is missing where the undisturbed motion has no
    period.
    """
    fig, axes = new(2, 1, height=6.4, sharex=True, height_ratios=[1.25, 1.0])
    top, bottom = axes[:, 0]
    for c, curve in enumerate(CURVES):
        _band(top, found, c, *LOOKS[curve])
    k2 = found.numbers["k2"]
    if not (found.done & np.isfinite(k2) & (k2 > 0)).any():  # nothing to draw, and so no range for the axis
        top.set_ylim(1e-6, 1.0)
    top.set_yscale("log")
    top.legend(loc="lower right", bbox_to_anchor=(1.0, 1.06), ncols=3, borderpad=0.2, columnspacing=1.4)
    top.tick_params(which="minor", direction="in", right=True)
    _name_periods(top, found)
    letter(top, 0)
    low, high = found.A.min(), found.A.max()
    some = slice(None) if low < high else slice(1)
    density(bottom, found.fine[some], found.diagram[some])
    letter(bottom, 1)
    missing = int((~found.done).sum())
    note(bottom, f"{missing} of {found.done.size} limits not computed" if missing else "undisturbed")
    name_axes(bottom, "A", "dxi")
    bottom.set_xlim((low, high) if low < high else (low - 0.5, high + 0.5))
    return fig


def _band(ax: Axes, found: Limits, c: int, style: str, tone: str, name: str) -> None:
    k2, last = found.numbers["k2"][c], found.numbers["last_kept"][c]
    known = found.done[c] & np.isfinite(k2) & (k2 > 0)
    first = np.where(known, k2, np.nan)
    end = np.where(known & (last > k2), last, first)
    ax.fill_between(found.A, first, end, color=tone, lw=0)
    ax.plot(found.A, end, color=INK, lw=0.25)
    ax.plot(found.A, first, style, color=INK, lw=0.9, label=name)


def _name_periods(ax: Axes, found: Limits) -> None:
    """The order n of the subharmonic above each longer stretch of it."""
    n = found.n.max(axis=0)
    span = np.ptp(found.A) or 1.0
    edges = np.flatnonzero(np.diff(n)) + 1
    for stretch in np.split(np.arange(len(n)), edges):
        low, high = found.A[stretch[0]], found.A[stretch[-1]]
        if n[stretch[0]] > 0 and high - low >= WIDE * span:
            ax.text(
                (low + high) / 2, 1.015, f"$n = {n[stretch[0]]}$", transform=ax.get_xaxis_transform(),
                ha="center", va="bottom", fontsize=8,
            )  # fmt: skip
        if stretch[0]:
            ax.axvline((found.A[stretch[0] - 1] + low) / 2, color="0.75", lw=0.3, zorder=0)
