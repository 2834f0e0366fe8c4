"""Figures of orbits: bifurcations with unstable branches, and the impact-phase map with a cobweb.

The impact-phase map gives the phase of the next impact as a function of the phase of an impact. A branch is one orbit
over an interval of A without a bifurcation.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from vibrodrive.figures.bifurcations import BIFURCATIONS
from vibrodrive.figures.looks import INK
from vibrodrive.figures.sections import full_range
from vibrodrive.figures.sheet import drawn_on
from vibrodrive.figures.texts import as_shown, conditions, equation, of_sweep
from vibrodrive.model.described import counted
from vibrodrive.model.figure import Style, Width, documented
from vibrodrive.model.keywords import takes
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import Scene, amplitude_axis, measure
from vibrodrive.model.plan import plan_motion
from vibrodrive.model.quantities import QUANTITIES
from vibrodrive.model.results import Results
from vibrodrive.periodic.family import Family, section, traces
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import Orbit

CURVE_POINTS = 400


def bifurcation_diagram(family: Family, brute: Results, **look: Any) -> Figure:
    """Draw ξ' at the section for every orbit, stable ones as solid and unstable ones as dashed lines, with the
    bifurcations as marks. The simulated motions `brute` are grey points below them: a sweep over an axis that gives A,
    which is the abscissa. They give the phase of the section, and the units."""
    ((x, swept),) = brute.axes.items()
    phase, unit = brute.scalars["section_phase"], brute.measure("dxi")

    def place(A: Any) -> Any:
        return as_shown(x, amplitude_axis(x, A, brute.scalars))

    def values(orbit: Orbit) -> np.ndarray:
        scalars = {**brute.scalars, x: amplitude_axis(x, orbit.A, brute.scalars)}
        return measure(QUANTITIES["dxi"], scalars, unit.si == "1").shown_of(section(orbit, phase)[:, 1])

    with drawn_on(**look) as sheet:
        fig, axes = sheet.new(height=4.5)
        ax = axes[0, 0]
        seen = [unit.shown_of(np.asarray(brute.section)[..., 1])]
        dots: dict[str, Any] = {"marker": ".", "ls": "none", "mew": 0, "color": sheet.look.support}
        across = np.repeat(as_shown(x, swept), seen[0].shape[-1])
        ax.plot(across, seen[0].reshape(-1), ms=1.8, rasterized=True, zorder=1, **dots)
        for branch in family.denser().branches():
            drawn: dict[str, Any] = {"color": sheet.look.main, "ls": "-", "lw": 1.1, "label": "stable orbit"}
            if branch.unstable:
                drawn = {"color": sheet.look.other, "ls": (0, (4, 2)), "lw": 0.6, "label": "unstable orbit"}
            seen.append(traces(branch, values))
            ax.plot(place(branch.A), seen[-1], zorder=2, **drawn)
        for name, kind in BIFURCATIONS.items():
            bifurcations = [b for b in family.bifurcations if b.kind == name and len(b.orbit.phases)]
            points = [(place(b.A), y) for b in bifurcations for y in values(b.orbit)]
            mark: dict[str, Any] = {"ms": 3.8, "mfc": INK if kind.marker == "|" else "white", "mew": 0.7}
            if points:
                ax.plot(*zip(*points, strict=True), kind.marker, **mark, mec=INK, label=kind.label, zorder=3)
        ax.set(xlim=place(family.A[[0, -1]]), ylim=full_range(seen, 0.05))
        sheet.name(ax, x, None)
        sheet.name_quantities(ax, None, unit)
        common = {n: value for n, value in of_sweep(brute).items() if n not in (x, "eps", "method")}
        sheet.note(ax, [f"orbits up to {counted(family.max_period, 'period')}", *conditions(common)])
        sheet.keys.append(Line2D([], [], ms=5, label="simulated", **dots))
        return fig


@takes()
@documented
def cobweb(
    written: Mapping[str, Any],
    /,
    A: float | None = None,
    B: float = 0.1,
    orbit: Orbit | None = None,
    scene: Scene | None = None,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw the impact-phase map with dotted lines at its breakpoints, and the cobweb of one of its orbits.

    Parameters
    ----------
    A : float
        excitation amplitude, dimensionless. Required without a scene.
    B : float
        tan α / μ, dimensionless.
    orbit : Orbit, optional
        orbit from `vd.orbits` at the same A and B; without it there is no cobweb. The cobweb of an orbit with one
        impact is a point.
    scene : Scene, optional
        machine in SI units, which gives A and B, as in `simulate`.

    Raises
    ------
    TypeError, ValueError
        if A or B is not a number or is out of range, or if the orbit is not one at A and B.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> orbit = vd.orbits(2.62, max_period=2)[-1]
    >>> figure = vd.plot.cobweb(2.62, orbit=orbit)
    >>> figure.axes[0].get_legend_handles_labels()[1][-2:]
    ['cobweb of an orbit', 'impacts of the orbit']
    """
    plan = plan_motion(written)
    system = ImpactMap(plan.scalars["A"], plan.scalars["B"])
    if orbit is not None and not (
        isinstance(orbit, Orbit) and np.allclose((orbit.A, orbit.B), (system.A, system.B), 1e-9)
    ):
        raise ValueError(bad("orbit", orbit, f"an Orbit of vd.orbits at A = {system.A:g}, B = {system.B:g}"))
    with drawn_on(ax, style, width, notes) as sheet:
        fig, axes = sheet.new(height=4.6, width=4.8)
        ax = axes[0, 0]
        turn = 2.0 * math.pi
        ax.plot([0, turn], [0, turn], color=sheet.look.support, lw=0.6, label="next phase = phase")
        edges = [0.0, *system.breakpoints.tolist(), turn]
        for a, b in itertools.pairwise(edges):
            # near a grazing the map has the slope of a square root, so the points are denser at the ends of a branch
            inner = 0.5 * (a + b) - 0.5 * (b - a) * np.cos(np.linspace(0, math.pi, CURVE_POINTS))
            phi = np.clip(inner, math.nextafter(a, b), math.nextafter(b, a))
            image = system(phi).phase
            image[1:][np.abs(np.diff(image)) > math.pi] = math.nan  # where the phase wraps around
            ax.plot(phi, image, color=sheet.look.main, lw=1.0, label="phase of the next impact")
        for point in system.breakpoints.tolist():
            ax.axvline(point, color=sheet.look.support, lw=0.5, ls=":", label="breakpoint of the map")
        if orbit is not None:
            path = np.repeat(np.append(orbit.phases, orbit.phases[0]), 2)
            ax.plot(path[:-1], path[1:], color=sheet.look.other, lw=0.7, ls="--", label="cobweb of an orbit")
            impacts: dict[str, Any] = {"ms": 3.5, "color": sheet.look.other, "label": "impacts of the orbit"}
            ax.plot(orbit.phases, np.roll(orbit.phases, -1), "o", **impacts)
        ax.set(xlim=(0, turn), ylim=(0, turn), aspect="equal")
        sheet.label(ax, r"$\varphi_i$", r"$\varphi_{i+1}$", upright=16.0)
        sheet.note(ax, [equation("A", system.A), equation("B", system.B)])
        return fig
