"""Lines in a plane: curves of bifurcations, as a figure or over a map, and the limit k₂ over a map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path as LinePath
from matplotlib.transforms import Bbox

from vibrodrive.figures.conditions import named
from vibrodrive.figures.looks import INK
from vibrodrive.figures.style import as_shown, explain, look, name_axes, new, note, styled
from vibrodrive.model.bifurcations import BIFURCATIONS
from vibrodrive.model.drawing import Style, Width
from vibrodrive.model.physical import amplitude_axis, incline_axis, with_A_and_B

if TYPE_CHECKING:
    from vibrodrive.periodic.curve import Curve
    from vibrodrive.stability.limits import Limits

HALO = 0.7
NUMBERED = "numbers on curves: period of the orbit"
PLACES = (0.62, 0.5, 0.74, 0.38, 0.86)  # shares of the visible length of a curve at which its period is written
AMPLITUDES, INCLINES = ("A", "a0", "omega0"), ("B", "mu", "alpha")  # axes that determine A; axes that determine B
POINTS = 400
SAME = 1e-12  # largest relative difference of two parameters that count as equal
DISTURBANCES = ("eps", "dtau")


class Line(NamedTuple):
    """Curve of bifurcations in a plane with any axes. `across` and `up` are its coordinates, float64 (points,) each."""

    kind: str
    period: int
    across: np.ndarray
    up: np.ndarray


@styled
def draw_lines(ax: Axes, lines: Sequence[Line]) -> None:
    """Draw curves over a plane whose limits are set, each with the period of its orbit."""
    known: set[str] = set()
    limits = ax.get_xlim(), ax.get_ylim()
    for k, line in enumerate(lines):
        kind = BIFURCATIONS[line.kind]
        colour = kind.colour if look().coloured else kind.ink
        # draw all halos first, so that no halo hides a line
        halo: dict[str, Any] = {"lw": kind.width + 2 * HALO, "color": "white", "alpha": 0.7, "solid_capstyle": "butt"}
        ax.plot(line.across, line.up, "-", zorder=4, **halo)
        shown = line.kind not in known and _in_view(ax, line)
        style: dict[str, Any] = {"ls": kind.dashes, "lw": kind.width, "color": colour}
        ax.plot(line.across, line.up, **style, zorder=5, label=kind.label if shown else "_")
        if shown:
            known.add(line.kind)
        ax.set(xlim=limits[0], ylim=limits[1])
        if line.kind != "onset":
            points = np.column_stack([line.across, line.up])
            _write_period(ax, line.period, points, PLACES[k % len(PLACES)], colour)


def _in_view(ax: Axes, line: Line) -> bool:
    points = ax.transScale.transform(np.column_stack([line.across, line.up]))
    view = ax.transScale.transform(np.transpose((ax.get_xlim(), ax.get_ylim())))
    return len(points) > 0 and LinePath(points).intersects_bbox(Bbox(view), filled=False)


def _write_period(ax: Axes, period: int, points: np.ndarray, share: float, color: str) -> None:
    """Write the period on the curve (points, 2), at the given share of its visible length."""
    low, high = np.transpose((ax.get_xlim(), ax.get_ylim()))
    seen = points[((points >= low) & (points <= high)).all(axis=1)]
    if len(seen) < 2:
        return
    way = np.append(0.0, np.cumsum(np.hypot(*np.diff(ax.transData.transform(seen), axis=0).T)))
    left, up = (float(np.interp(share * way[-1], way, column)) for column in seen.T)
    box = {"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none"}
    ax.text(left, up, str(period), color=color, fontsize=7, ha="center", va="center", zorder=6, bbox=box)


@styled
def curves_figure(
    curves: Sequence[Curve],
    A: tuple[float, float],
    B: tuple[float, float],
    max_period: int,
    meets: Sequence[tuple[float, float]] = (),
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw curves of bifurcations in the plane (A, B), each with the period of its orbit.

    Parameters
    ----------
    curves : sequence of Curve
        from `vd.curves`.
    A, B : (float, float)
        ranges shown.
    max_period : int
        longest period of the orbits in the search; a note in the figure names this period.
    meets : sequence of (A, B)
        points where curves meet; the figure marks them.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> ranges = {"A": (2.5, 2.7), "B": (0.09, 0.11), "max_period": 1}
    >>> figure = vd.plot.curves(vd.curves(**ranges, num=2), **ranges)
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
    ('$A$', '$B$')
    """
    fig, axes = new(1, 1, height=4.6)
    ax = axes[0, 0]
    ax.set(xlim=A, ylim=B)
    draw_lines(ax, [Line(c.kind, c.period, c.A, c.B) for c in curves])
    if meets:
        ax.plot(*zip(*meets, strict=True), "o", ms=3.5, mfc="white", mec=INK, mew=0.8, zorder=7, label="curves meet")
    name_axes(ax, "A", "B")
    note(ax, f"{NUMBERED}, up to {max_period}")
    explain(fig)
    return fig


def placed(curves: Sequence[Curve], results: Any, x: str, y: str | None) -> list[Line]:
    """Return curves over A and B as lines in the plane of the axes x and y of results, in the units of figures.

    If one axis determines B, each point of a curve is one point of the plane. If B is constant, a curve gives one line
    for each A at which the curve has this B. Over the frequency Ω0 such a line is a0 = const/Ω0². Raises ValueError if
    the map has no second axis, if no axis determines A, or if no curve reaches a constant B.
    """
    up = next((name for name in (y, x) if name in AMPLITUDES), None)
    if y is None or up is None:
        axes = ", ".join(name for name in (x, y) if name)
        raise ValueError(f"curves: must be left out, because curves are over A and B, but this map is over {axes}")
    along = x if up == y else y
    known = _shared(results, x, y)
    if along not in INCLINES and not any(c.B.min() <= known["B"] <= c.B.max() for c in curves):
        raise ValueError(f"curves: must reach B = {known['B']:g}, the value of the map, but none does")
    lines = []
    for curve in curves:
        for A, v in _pieces(curve, along, results.axes[along], known):
            u = amplitude_axis(up, A, known | {along: v})
            drawn = {up: as_shown(up, u), along: as_shown(along, v)}
            lines.append(Line(curve.kind, curve.period, drawn[x], drawn[y]))
    return lines


def _shared(results: Any, x: str, y: str) -> dict[str, Any]:
    """Return the parameters and scene common to all points of a map. An axis that is not drawn has its first value."""
    undrawn = {name: float(values[0]) for name, values in results.axes.items() if name not in (x, y)}
    return with_A_and_B({**results.scalars, **undrawn})


def _pieces(curve: Curve, along: str, values: np.ndarray, known: Mapping[str, Any]) -> list[tuple[Any, np.ndarray]]:
    """Return the lines of a curve, each as values of A and the corresponding values of the axis `along`."""
    if along in INCLINES:
        off_level = curve.B > 0.0  # at B = 0, μ is infinite
        return [(curve.A[off_level], incline_axis(along, curve.B[off_level], known))]
    ends = np.linspace(values.min(), values.max(), POINTS)
    return [(np.full(POINTS, A), ends) for A in curve.at(known["B"])]


def draw_limit(ax: Axes, found: Limits, results: Any, x: str, y: str | None) -> None:
    """Draw the limits k₂ of a file as a line over a map.

    The axes of the map must be the axis of the file and the disturbance. Raises ValueError if the axis, the disturbance
    or the parameters of the limits are not those of the map.
    """
    disturbance = next((name for name in DISTURBANCES if name in (x, y)), None)
    curve = (disturbance, results.settings.method_name)
    other = x if y == disturbance else y
    if y is None or other is None or curve not in found.curves or list(found.axes) != [other]:
        has = f"over {', '.join(found.axes)} in {', '.join(f'{d} ({m})' for d, m in found.curves)}"
        needed = f"over one axis and in one disturbance, and these must be the axes of the map, {x} and {y}"
        raise ValueError(f"limits = {has}: must be {needed}")
    shared = _shared(results, x, y)
    for name, value in found.fixed.items():
        if name in shared and not np.isclose(value, shared[name], rtol=SAME, atol=0.0):
            raise ValueError(
                f"limits for {name} = {value:g}: must be for {name} = {shared[name]:g}, the value of the map"
            )
    k2, along = found.known()[found.curves.index(curve)], found.axes[other]
    points = (along, k2) if x == other else (k2, along)
    view = {"xlim": ax.get_xlim(), "ylim": ax.get_ylim()}
    ax.plot(*points, color="white", lw=1.4 + 2 * HALO, zorder=4, label="_")
    does = "leaves only one motion" if found.quantity == "ku" else "breaks the structure"
    label = named(found.quantity, f"limit $k_2$: the least disturbance that {does}")
    ax.plot(*points, color=INK, lw=1.4, zorder=5, label=label)
    ax.set(**view)
