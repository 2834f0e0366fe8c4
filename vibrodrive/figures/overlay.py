"""What is drawn over a map: bifurcations of the undisturbed motion, and the limit up to which its structure is kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes

from vibrodrive.figures.conditions import named
from vibrodrive.figures.looks import INK
from vibrodrive.figures.plane import HALO, Line
from vibrodrive.figures.style import as_shown
from vibrodrive.model.choices import Method
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import amplitude_axis, incline_axis, with_A_and_B

if TYPE_CHECKING:
    from vibrodrive.periodic.curves import Curve
    from vibrodrive.stability.limits import Limits

AMPLITUDES, INCLINES = ("A", "a0", "omega0"), ("B", "mu", "alpha")
"""Axes from which A follows, and those from which B does."""

POINTS = 400

SAME = 1e-12
"""Relative difference up to which two parameters are the same."""

DISTURBANCES = ("eps", "dtau")


def placed(curves: Sequence[Curve], results: Any, x: str, y: str | None) -> list[Line]:
    """Curves over A and B as lines in the plane of the axes x and y of results, in the units that figures show.

    Where B follows from an axis, each point of a curve is a point there. Where B is one value, each A at which a curve
    passes it is a line: over the frequency Ω0, a0 = const/Ω0².

    Raises
    ------
    ValueError
        if A does not follow from one of the axes, or if no curve reaches the B of the map.
    """
    up = next((name for name in (y, x) if name in AMPLITUDES), None)
    if y is None or up is None:
        axes = ", ".join(name for name in (x, y) if name)
        raise ValueError(bad("curves", f"{len(curves)} curves", f"left out: they are of A and B, and this is {axes}"))
    along = x if up == y else y
    known = _shared(results, x, y)
    if along not in INCLINES and not any(c.B.min() <= known["B"] <= c.B.max() for c in curves):
        raise ValueError(bad("curves", f"{len(curves)} curves", f"curves that reach B = {known['B']:g}"))
    lines = []
    for curve in curves:
        for A, v in _pieces(curve, along, results.axes[along], known):
            u = amplitude_axis(up, A, known | {along: v})
            drawn = {up: as_shown(up, u), along: as_shown(along, v)}
            lines.append(Line(curve.kind, curve.period, drawn[x], drawn[y]))
    return lines


def _shared(results: Any, x: str, y: str) -> dict[str, Any]:
    """Parameters and scene of all points of a map; of an axis that is not drawn its first value."""
    undrawn = {name: float(values[0]) for name, values in results.axes.items() if name not in (x, y)}
    return with_A_and_B({**results.scalars, **undrawn})


def _pieces(curve: Curve, along: str, values: np.ndarray, known: Mapping[str, Any]) -> list[tuple[Any, np.ndarray]]:
    """The A of a curve, and where that is on the axis `along`."""
    if along in INCLINES:
        off_level = curve.B > 0.0  # μ is infinite there
        return [(curve.A[off_level], incline_axis(along, curve.B[off_level], known))]
    ends = np.linspace(values.min(), values.max(), POINTS)
    return [(np.full(POINTS, A), ends) for A in curve.at(known["B"])]


def draw_limit(ax: Axes, found: Limits, results: Any, x: str, y: str | None) -> None:
    """The limit k₂ over the axis of a file of limits as a line in a map of that axis and the disturbance.

    Raises
    ------
    ValueError
        for limits over another axis, in another disturbance or of other parameters than those of the map.
    """
    disturbance = next((name for name in DISTURBANCES if name in (x, y)), None)
    curve = (disturbance, Method(results.settings.method).name.lower())
    other = x if y == disturbance else y
    if y is None or other is None or curve not in found.curves or list(found.axes) != [other]:
        has = f"over {', '.join(found.axes)} in {', '.join(f'{d} ({m})' for d, m in found.curves)}"
        needed = f"limits over one axis and in the disturbance that are those of the map, {x} and {y}"
        raise ValueError(bad("limits", has, needed))
    shared = _shared(results, x, y)
    for name, value in found.fixed.items():
        if name in shared and not np.isclose(value, shared[name], rtol=SAME, atol=0.0):
            raise ValueError(bad("limits", f"{name} = {value:g}", f"of {name} = {shared[name]:g}, as the map"))
    k2, along = found.known()[found.curves.index(curve)], found.axes[other]
    points = (along, k2) if x == other else (k2, along)
    kept = (ax.get_xlim(), ax.get_ylim())
    ax.plot(*points, color="white", lw=1.4 + 2 * HALO, zorder=4, label="_")
    does = "leaves one motion" if found.quantity == "ku" else "breaks it"
    label = named(found.quantity, f"limit $k_2$: the least disturbance that {does}")
    ax.plot(*points, color=INK, lw=1.4, zorder=5, label=label)
    ax.set(xlim=kept[0], ylim=kept[1])
