"""Figures of limits of stability over A, B or η: the limits in ε and Δτ, their velocity amplitudes, and their ratio.

The limit k₂ is the least disturbance that destroys the structure of a motion, the repeated pattern of its impacts
(vibrodrive.stability). The limit k₁ is the least error of the start that leads to another solution. The limit k_u is
the least disturbance at which the motions from all starts become one motion.

k₂(ε) and k₂(Δτ) differ by decades. The velocity amplitudes V, which are k₂(ε)ηA and k₂(Δτ), have similar sizes. A
separate panel shows the ratio of the two amplitudes. If the ratio is near 1, the physical and the numerical disturbance
have the same effect. Limits of Muller's method are not compared. With this method a switch is either found accurately
or missed, but never late by up to Δτ.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from vibrodrive.figures.bifurcation import density
from vibrodrive.figures.colours import paint
from vibrodrive.figures.conditions import choice, conditions, named, some
from vibrodrive.figures.map import LABELS, draw_map, legend_entries
from vibrodrive.figures.style import equation, explain, label_axes, letter, look, name_axes, new, note, styled, symbol
from vibrodrive.model.choices import Status
from vibrodrive.model.drawing import K2, MAP, Style, Width
from vibrodrive.model.parameters import bad
from vibrodrive.stability.limits import K1, KU, Limits

CURVE_LABELS = {
    ("eps", "certified"): r"$k_2(\varepsilon)$",
    ("dtau", "fixed"): r"$k_2(\Delta\tau)$, switches on the grid",
    ("dtau", "muller"): r"$k_2(\Delta\tau)$, Muller",
}
BAND, BAND_OF_SEVERAL = (
    "from the first loss to the last value kept",
    "from the first value with one motion to the last value with several motions",
)
VELOCITY = {"eps": r"$V = k_2(\varepsilon)\,\eta A$", "dtau": r"$V = k_2(\Delta\tau)$"}
RATIO = r"$k_2(\Delta\tau)\;/\;k_2(\varepsilon)\,\eta A$"
WIDE = 0.035  # a range of A with one period has a label if it is at least this share of the abscissa
MARKED = 60  # a curve with at most this many values has marks
APART = 5.0  # an abscissa of η is logarithmic if the ratio of its ends is larger than this


@styled
def limits_figure(
    found: Limits,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw the limits in ε and in Δτ as velocity amplitudes over the axis, and below them the ratio of the two
    amplitudes.

    If A is the only axis, there are two more panels. The top panel shows the values of ε and Δτ themselves, as bands
    from the first loss k₂ to the last value at which the structure is kept. The bottom panel shows the bifurcation
    diagram of the undisturbed motion.

    If there are two axes, the longer axis is the abscissa, and each value of the shorter axis has a line. At most six
    evenly spaced values of the shorter axis are drawn. Limits of Muller's method are not drawn.

    A limit is missing where the undisturbed motion has no period, or where no tried disturbance destroys the structure.
    A ratio is missing where the limit in ε or the limit in Δτ is missing. A band has no height where the structure is
    lost at all values above the first loss.

    Parameters
    ----------
    found : Limits
        from `load`, for a file of `vibrodrive limits`.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> found = vd.load("limits.h5", kind="limits")  # made by `vibrodrive limits` over B
    >>> figure = vd.plot.limits(found)
    >>> figure.axes[1].get_ylabel()
    'ratio'
    """
    if found.quantity == K1:
        return _starts(found)
    if len(found.axes) == 2:
        return _over_two(found)
    (x,) = found.axes
    return _over_A(found) if x == "A" else _over_one(found, x)


@styled
def limits_map(found: Limits, limits: tuple[float, float] | None = None, *, ax: Any = None) -> Figure:
    """Draw a map of k₂ in ε over the two axes of a file of limits. `limits` is the range of the colours.

    Raises ValueError if the file has only one axis, or has no limits k₂ in ε.
    """
    if len(found.axes) != 2 or ("eps", "certified") not in found.curves:
        raise ValueError(bad("kind", MAP, "left out, because only limits in ε over two axes have a map"))
    c = found.curves.index(("eps", "certified"))
    values, status = found.values[c], np.where(found.done[c], Status.OK, Status.NOT_COMPUTED)
    painted = paint(K2, values, status, limits)
    x, y = found.axes
    fig, ax = draw_map(found.axes, x, y, painted, values, named(found.quantity, LABELS[K2]))
    note(ax, shared_by(found), side="left")
    explain(fig, legend_entries(painted))
    return fig


def _over_A(found: Limits) -> Figure:
    fig, axes = new(4, 1, height=9.2, sharex=True, height_ratios=[1.2, 1.0, 0.8, 1.0])
    top, velocity, ratio, bottom = axes[:, 0]
    bands = [_band(top, found, c) for c in range(len(found.curves))]
    _logarithmic(top, np.stack([found.known(), found.last()]), (1e-6, 1.0))
    _name_ordinate(top, named(found.quantity, "$k_2$"))
    _name_periods(top, found)
    letter(top, 0)
    note(top, [*shared_by(found), *_gaps(found, len(found.curves))], above=True)
    _velocities(velocity, found)
    letter(velocity, 1, named(found.quantity, ", ".join(VELOCITY.values())))
    _ratios(ratio, found)
    letter(ratio, 2, named(found.quantity, RATIO))
    key = _undisturbed(bottom, found, 3)
    explain(fig, [*filter(None, bands), *key])
    return fig


def _undisturbed(ax: Axes, found: Limits, panel: int) -> Sequence[Artist]:
    """Draw the bifurcation diagram of the undisturbed motion over A, and return the legend entries for its ink."""
    key: Sequence[Artist] = ()
    if found.fine is not None and found.diagram is not None:
        several = slice(None) if np.ptp(found.A) > 0 else slice(1)
        key = density(ax, found.fine[several], found.diagram[several])
    letter(ax, panel)
    note(ax, "undisturbed")
    name_axes(ax, None, "dxi")
    _abscissa(ax, "A", found.A)
    return key


def _starts(found: Limits) -> Figure:
    """Draw k₁ in each coordinate of the start over the axis.

    If A is the axis, a further panel shows the bifurcation diagram of the undisturbed motion.
    """
    ((x, values),) = found.axes.items()
    fig, axes = new(2, 1, height=5.2, sharex=True) if x == "A" else new(1, 1, height=3.5)
    ax = axes[0, 0]
    k1 = found.known()
    for c, (name, _) in enumerate(found.curves):
        _line(ax, values, k1[c], c, f"error of the start in {symbol(name)}")
    _logarithmic(ax, k1, (1e-3, 1.0))
    _name_ordinate(ax, "$k_1$")
    letter(ax, 0)
    note(ax, [*shared_by(found), *_gaps(found, len(found.curves))])
    key: Sequence[Artist] = ()
    if x == "A":
        key = _undisturbed(axes[1, 0], found, 1)
    else:
        _abscissa(ax, x, values)
    explain(fig, key)
    return fig


def _over_one(found: Limits, x: str) -> Figure:
    fig, axes = new(2, 1, height=5.0, sharex=True, height_ratios=[1.2, 1.0])
    top, bottom = axes[:, 0]
    _velocities(top, found)
    letter(top, 0, named(found.quantity, ", ".join(VELOCITY.values())))
    note(top, [*shared_by(found), *_gaps(found, 2)])
    _ratios(bottom, found)
    letter(bottom, 1, named(found.quantity, RATIO))
    _abscissa(bottom, x, found.axes[x])
    explain(fig)
    return fig


def _over_two(found: Limits) -> Figure:
    names = list(found.axes)
    x = max(names[::-1], key=lambda name: len(found.axes[name]))
    (other,) = set(names) - {x}
    V = np.moveaxis(found.known("velocity"), 1 + names.index(x), -1)
    ratio = np.moveaxis(found.ratio(), names.index(x), -1)
    panels = [(VELOCITY["eps"], V[0]), (VELOCITY["dtau"] + ", switches on the grid", V[1])]
    if x == "eta" and not any(len(np.unique(row[np.isfinite(row)])) > 1 for row in V[1]):  # at ε = 0, η has no effect
        del panels[1]
    fig, axes = new(len(panels) + 1, 1, height=1.2 + 2.1 * (len(panels) + 1), sharex=True)
    rows = list(range(len(found.axes[other])))
    shown = some(rows)
    for k, (ax, (title, values)) in enumerate(zip(axes[:, 0], [*panels, (RATIO, ratio)], strict=True)):
        for c, row in enumerate(shown):
            _line(ax, found.axes[x], values[row], c, equation(other, found.axes[other][row]))
        letter(ax, k, named(found.quantity, title))
        if k < len(panels):
            _amplitude(ax, values[shown], found.mm_s)
        else:
            _around_one(ax, values[shown])
    chosen = choice(len(shown), len(rows), f"values of {symbol(other)}")
    note(axes[0, 0], [*shared_by(found), *chosen, *_gaps(found, 2)])
    _abscissa(axes[-1, 0], x, found.axes[x])
    explain(fig)
    return fig


def _velocities(ax: Axes, found: Limits) -> None:
    """Draw the limits in ε and, with switches on the grid, in Δτ as velocity amplitudes over one axis."""
    V = found.known("velocity")[:2]
    (x,) = found.axes.values()
    for c, (values, curve) in enumerate(zip(V, found.curves, strict=False)):
        _line(ax, x, values, c, named(found.quantity, CURVE_LABELS[curve]))
    _amplitude(ax, V, found.mm_s)


def _ratios(ax: Axes, found: Limits) -> None:
    """Draw the ratio over one axis. A note gives the median and the range that contains 90 % of the values."""
    (x,) = found.axes.values()
    ratio = found.ratio()
    _line(ax, x, ratio, 0, "_ratio")
    _around_one(ax, ratio)
    known = ratio[np.isfinite(ratio)]
    if len(known):
        low, middle, high = np.quantile(known, (0.05, 0.5, 0.95))
        note(ax, f"median {middle:.2g}, 90 % between {low:.2g} and {high:.2g}")


def _line(ax: Axes, x: np.ndarray, values: np.ndarray, number: int, name: str) -> None:
    order = np.argsort(x)
    colour, pattern = look().lines[number % len(look().lines)]
    # without clipping, so that the marks at the ends are complete
    marked: dict[str, Any] = {"marker": "o", "markersize": 2.2, "clip_on": False} if len(x) <= MARKED else {}
    ax.plot(x[order], values[order], ls=pattern, color=colour, lw=0.9, label=name, **marked)


def _amplitude(ax: Axes, values: np.ndarray, mm_s: float | None) -> None:
    """Set a logarithmic ordinate for V. For a scene in SI units, add an ordinate in mm/s on the right."""
    _logarithmic(ax, values, (1e-3, 1.0))
    _plain_numbers(ax.yaxis, *ax.get_ylim())
    _name_ordinate(ax, "$V$")
    if mm_s is not None:
        ax.tick_params(which="both", right=False)
        second = ax.secondary_yaxis("right", functions=(lambda v: np.multiply(v, mm_s), lambda v: np.divide(v, mm_s)))
        _plain_numbers(second.yaxis, *ax.get_ylim())
        second.set_ylabel("$V$ in mm/s")


def _around_one(ax: Axes, ratio: np.ndarray) -> None:
    """Set a logarithmic ordinate whose range contains 1, and draw a line at 1."""
    seen = np.append(ratio[np.isfinite(ratio)], (0.4, 2.5))
    low, high = seen.min() / 1.15, seen.max() * 1.15
    ax.set_ylim(low, high)
    ax.set_yscale("log")
    ax.axhline(1.0, color=look().support, lw=0.6, zorder=0)
    ax.set_ylabel("ratio")
    _plain_numbers(ax.yaxis, low, high)


def _name_ordinate(ax: Axes, text: str) -> None:
    label_axes(ax, None, text, upright=9.0)


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


def shared_by(found: Limits) -> list[str]:
    """Return phrases: the common conditions, the criterion if not the default, the number of limits not computed."""
    apart = {*found.axes, "eps", "dtau", "method"}
    if found.quantity == K1:
        apart |= {"xi0", "dxi0", "tau0"}
    said = conditions({n: value for n, value in found.shared.items() if n not in apart}, apart)
    texts = {K1: "", KU: "at $k_u$ all starts end in one motion"}
    kept = "" if found.criterion == "impacts" else f"criterion: {found.criterion}"
    missing = int((~found.done).sum())
    left = f"{missing} of {found.done.size} limits not computed" if missing else ""
    return [*said, texts.get(found.quantity, kept), left]


def _gaps(found: Limits, curves: int) -> list[str]:
    """Return a phrase with the reasons why computed points of the first `curves` curves are not drawn."""
    k2, n, done = found.values[:curves], found.n[:curves], found.done[:curves]
    one = (k2 == 0) if found.quantity == KU else np.isposinf(k2) & (found.quantity == K1)
    reasons = {
        "one solution only": done & one,
        "no periodic motion": done & (n == 0),
        "several motions remain" if found.quantity == KU else "no limit found": done & np.isposinf(k2) & ~one,
    }
    there = [reason for reason, where in reasons.items() if where.any()]
    return [f"missing points: {', '.join(there)}"] if there else []


def _band(ax: Axes, found: Limits, c: int) -> Artist | None:
    """Draw a limit and, above it, the band in which the structure is kept at some values. Return the legend entry of
    the band."""
    label = named(found.quantity, CURVE_LABELS[found.curves[c]])
    first, last = found.known()[c], found.last()[c]
    end = np.where(last > first, last, first)
    tone, (colour, pattern) = look().bands[c], look().lines[c]
    ax.fill_between(found.A, first, end, color=tone, lw=0)
    ax.plot(found.A, end, color=colour, lw=0.25)
    ax.plot(found.A, first, pattern, color=colour, lw=0.9, label=label)
    if not (last > first).any():
        return None
    return Patch(fc=tone, label=f"{label.split(',')[-1].strip()}: {BAND_OF_SEVERAL if found.quantity == KU else BAND}")


def _name_periods(ax: Axes, found: Limits) -> None:
    """Write the period n of the orbit above each wide range of A in which this period is constant."""
    n = found.n.max(axis=0)
    span = np.ptp(found.A) or 1.0
    edges = np.flatnonzero(np.diff(n)) + 1
    for stretch in np.split(np.arange(len(n)), edges):
        low, high = found.A[stretch[0]], found.A[stretch[-1]]
        if n[stretch[0]] > 0 and high - low >= WIDE * span:
            place: dict[str, Any] = {"transform": ax.get_xaxis_transform(), "ha": "center", "va": "bottom"}
            ax.text((low + high) / 2, 1.015, f"$n = {n[stretch[0]]}$", fontsize=8, **place)
        if stretch[0]:
            between = (found.A[stretch[0] - 1] + low) / 2
            ax.axvline(between, color="0.75", lw=0.4, zorder=0, label="the period $n$ of the motion changes")
