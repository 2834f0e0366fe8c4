"""Figure of limits of stability over one axis, for one sweep or for several with the same axis.

The limit k₂ is the least disturbance that destroys the structure of a motion, the repeated pattern of its impacts
(stability/limit.py). k₂ in ε and k₂ in Δτ differ by decades; their velocity amplitudes V, which are k₂(ε)ηA and k₂(Δτ),
have similar sizes, so that limits of both sorts share one ordinate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from vibrodrive.figures.conditions import conditions, of_sweep
from vibrodrive.figures.style import explain, label_axes, look, new, note, styled, symbol
from vibrodrive.model.choices import Method, Status
from vibrodrive.model.drawing import Style, Width
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.records import LIMIT
from vibrodrive.model.results import Results

NAMES = {"eps": r"$k_2(\varepsilon)\,\eta A$", "dtau": r"$k_2(\Delta\tau)$"}
METHODS = {
    Method.CERTIFIED: "certified", Method.FIXED: "switches on the grid", Method.MULLER: "Muller",
}  # fmt: skip
BAND = "from the first loss to the last value kept"
MISSING = {Status.NO_ORBIT: "no periodic motion", Status.TOO_SHORT: "record too short", Status.BUDGET: "out of budget"}
WIDE = 0.035  # a range of the axis with one period has a label if it is at least this share of the abscissa
MARKED = 60  # a curve with at most this many values has marks
APART = 5.0  # an abscissa of η is logarithmic if the ratio of its ends is larger than this


@styled
def limits_figure(
    results: Results | Sequence[Results],
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw the limits k₂ over one axis as velocity amplitudes, as bands from the first loss to the last value kept.

    A limit is missing where the undisturbed motion has no period, or where no value tried destroys the structure. A
    band has no height where the structure is lost at all values above the first loss.

    Parameters
    ----------
    results : Results, or sequence of Results
        sweeps with the record "limit" over one axis, which all of them share: for example in ε, and in Δτ with the
        methods "fixed" and "muller".

    Raises
    ------
    ValueError
        for another record, for another number of axes than one, or for different axes.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> axis = {"A": [1.5, 2.0, 2.5], "record": "limit", "transient": 50, "periods": 50}
    >>> figure = vd.plot.limits([vd.sweep(**axis), vd.sweep(**axis, method="fixed")])
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
    ('$A$', '$V$')
    """
    several = [results] if isinstance(results, Results) else list(results)
    x, values = _axis(several)
    fig, axes = new(1, 1, height=4.2)
    ax = axes[0, 0]
    bands = [_band(ax, one, c, x) for c, one in enumerate(several)]
    _logarithmic(ax, np.array([_known(one, values) for one in several for values in _ends(one)]), (1e-3, 1.0))
    _plain_numbers(ax.yaxis, *ax.get_ylim())
    label_axes(ax, None, "$V$", upright=9)
    _name_periods(ax, values, np.max([one.orbit_period for one in several], axis=0))
    _abscissa(ax, x, values)
    apart = {x, "eps", "dtau", "method"}
    known = {name: value for name, value in of_sweep(several[0]).items() if name not in apart}
    note(ax, [*conditions(known, apart, section=False), _gaps(several)], above=True)
    explain(fig, [*filter(None, bands)])
    return fig


def _axis(several: Sequence[Results]) -> tuple[str, np.ndarray]:
    """Return the name and the values of the axis that all results share. Raises ValueError."""
    for one in several:
        if LIMIT not in one.record:
            raise ValueError(bad("record", ", ".join(one.record), f'"{LIMIT}"'))
        if len(one.axes) != 1:
            raise ValueError(bad_axes(one.axes, "one axis (limits over two axes are drawn as a map)"))
    ((x, values),) = several[0].axes.items()
    for one in several[1:]:
        if list(one.axes) != [x] or not np.array_equal(one.axes[x], values):
            raise ValueError(bad_axes(one.axes, f"{x} with the same values in all results"))
    return x, values


def _known(one: Results, values: np.ndarray) -> np.ndarray:
    """Return values in the unit of V, NaN where no limit > 0 was found."""
    with np.errstate(invalid="ignore"):
        scaled = values * (one.velocity / one.k2)
        return np.where(np.isfinite(one.k2) & (one.k2 > 0.0) & (scaled > 0.0), scaled, np.nan)


def _ends(one: Results) -> tuple[np.ndarray, np.ndarray]:
    return one.k2, np.maximum(one.k2, one.last_kept)


def _band(ax: Axes, one: Results, number: int, x: str) -> Patch | None:
    """Draw k₂ as a line and the band above it. Return the legend entry of the band."""
    first, end = (_known(one, values) for values in _ends(one))
    label = f"{NAMES[one.plan.sought]}, {METHODS[Method(one.settings.method)]}"
    _line(ax, one.axes[x], first, number, label)
    if not (end > first).any():
        return None
    order = np.argsort(one.axes[x])
    tone, colour = look().bands[number % len(look().bands)], look().lines[number % len(look().lines)][0]
    ax.fill_between(one.axes[x][order], first[order], end[order], color=tone, lw=0)
    ax.plot(one.axes[x][order], end[order], color=colour, lw=0.25)
    return Patch(fc=tone, label=f"{label.split(', ')[-1]}: {BAND}")


def _line(ax: Axes, x: np.ndarray, values: np.ndarray, number: int, name: str) -> None:
    order = np.argsort(x)
    colour, pattern = look().lines[number % len(look().lines)]
    # without clipping, so that the marks at the ends are complete
    marked: dict[str, Any] = {"marker": "o", "markersize": 2.2, "clip_on": False} if len(x) <= MARKED else {}
    ax.plot(x[order], values[order], ls=pattern, color=colour, lw=0.9, label=name, **marked)


def _plain_numbers(axis: Axis, low: float, high: float) -> None:
    """Label 0.2, 0.5, 1, … on a logarithmic axis shorter than two decades, and only decades on a longer axis."""
    if high < 100 * low:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def _logarithmic(ax: Axes, values: np.ndarray, blank: tuple[float, float]) -> None:
    """Set a logarithmic ordinate for the positive values, or with the range `blank` if no value is positive."""
    seen = values[np.isfinite(values) & (values > 0)]
    low, high = (seen.min(), seen.max()) if len(seen) else blank
    margin = 1.1 * (high / low) ** 0.04
    # the range is set before the scale, because Matplotlib finds no usable range for values that are all equal
    ax.set_ylim(low / margin, high * margin)
    ax.set_yscale("log")
    ax.tick_params(which="minor", direction="in", right=True)


def _abscissa(ax: Axes, x: str, values: np.ndarray) -> None:
    low, high = values.min(), values.max()
    if x == "eta" and high > APART * low:
        ax.set_xscale("log")
    ax.set_xlim((low, high) if low < high else (low - 0.5, high + 0.5))
    ax.set_xlabel(symbol(x))


def _gaps(several: Sequence[Results]) -> str:
    """Return a phrase with the reasons why computed points are not drawn."""
    there = [
        text for status, text in MISSING.items() if any((np.asarray(one.status) == status).any() for one in several)
    ]
    there += ["no limit found"] if any(np.isposinf(one.k2).any() for one in several) else []
    return f"missing points: {', '.join(there)}" if there else ""


def _name_periods(ax: Axes, values: np.ndarray, n: np.ndarray) -> None:
    """Write the period n of the orbit above each wide range of the axis in which this period is constant."""
    order = np.argsort(values)
    values, n = values[order], n[order]
    span = np.ptp(values) or 1.0
    edges = np.flatnonzero(np.diff(n)) + 1
    for stretch in np.split(np.arange(len(n)), edges):
        low, high = values[stretch[0]], values[stretch[-1]]
        if n[stretch[0]] > 0 and high - low >= WIDE * span:
            place: dict[str, Any] = {"transform": ax.get_xaxis_transform(), "ha": "center", "va": "bottom"}
            ax.text((low + high) / 2, 1.015, f"$n = {n[stretch[0]]}$", fontsize=8, **place)
        if stretch[0]:
            between = (values[stretch[0] - 1] + low) / 2
            ax.axvline(between, color="0.75", lw=0.4, zorder=0, label="the period $n$ of the motion changes")
