"""Figures of orbits: bifurcations with unstable branches, multipliers, and the impact-phase map with a cobweb.

The impact-phase map gives the phase of the next impact as a function of the phase of an impact. A branch is one orbit
over an interval of A without a bifurcation. Its multiplier is the derivative of the map over all impacts of a period.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from vibrodrive.figures.bifurcation import full_range, quantity_index
from vibrodrive.figures.conditions import conditions, of_sweep
from vibrodrive.figures.looks import INK
from vibrodrive.figures.style import equation, explain, label_axes, letter, look, name_axes, new, note, number, styled
from vibrodrive.model.bifurcations import BIFURCATIONS
from vibrodrive.model.drawing import Style, Width
from vibrodrive.model.results import Results
from vibrodrive.periodic.bifurcations import Bifurcation
from vibrodrive.periodic.family import Branch, Family, section, traces
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import Orbit

CURVE_POINTS = 400
CROWDED = 8  # with at least this many bifurcations, a second panel shows the range of A where they are dense
DENSE = 0.6  # the second panel shows the shortest range of A with this share of all bifurcations


@styled
def bifurcation_diagram(
    found: Family,
    brute: Results | None = None,
    quantity: str = "dxi",
    section_phase: float = 0.0,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw the section values of every orbit over A. Stable orbits are solid lines, unstable orbits dashed lines.

    If there are many bifurcations, a second panel shows the range of A where they are dense.

    Parameters
    ----------
    found : Family
        attribute `family` of a loaded file of `vibrodrive orbits` over A.
    brute : Results, optional
        sweep with A as its only axis, at the same section phase; drawn in grey below the orbits.
    quantity : str
        "dxi" or "xi".
    section_phase : float
        phase φ_s of the section in rad.

    Raises
    ------
    ValueError
        if the quantity is neither "dxi" nor "xi".

    Examples
    --------
    >>> import vibrodrive as vd
    >>> found = vd.load("orbits.h5", kind="orbits").family  # made by `vibrodrive orbits` over A
    >>> figure = vd.plot.orbits(found, quantity="xi")
    >>> figure.axes[0].get_xlabel()
    '$A$'
    """
    column = quantity_index(quantity)

    def values(orbit: Orbit) -> np.ndarray:
        return section(orbit, section_phase)[:, column]

    ranges = views(found)
    fig, axes = new(len(ranges), 1, height=0.9 + 3.6 * len(ranges))
    curves = [(branch, traces(branch, values)) for branch in found.branches()]
    heights = [values(b.orbit) if len(b.orbit.phases) else np.empty(0) for b in found.bifurcations]
    key: list[Artist] = []
    for k, (ax, (low, high)) in enumerate(zip(axes[:, 0], ranges, strict=True)):
        seen = [y[_within(branch.A, low, high)] for branch, y in curves]
        if brute is not None:
            within = _within(brute.axes["A"], low, high)
            there = np.asarray(brute.section)[within][..., column]
            at = np.repeat(brute.axes["A"][within], there.shape[-1])
            dots: dict[str, Any] = {"marker": ".", "ls": "none", "mew": 0, "color": look().support}
            ax.plot(at, there.reshape(-1), ms=1.8, rasterized=True, zorder=1, **dots)
            known = {n: value for n, value in of_sweep(brute).items() if n not in ("A", "B", "eps", "method")}
            simulated = f"simulated: {', '.join(conditions(known, section=False))}"
            key = [Line2D([], [], ms=5, label=simulated, **dots)]
            seen.append(there)
        for branch, y in curves:
            _curve(ax, branch, y)
        _marks(ax, found.bifurcations, heights, _view(ax, ranges, k))
        ax.set_ylim(*full_range(seen, 0.05))
        name_axes(ax, "A" if k == len(ranges) - 1 else None, quantity)
    said = [equation("B", found.B), equation("section_phase", section_phase), f"periods up to {found.max_period}"]
    note(axes[0, 0], said)
    explain(fig, key)
    return fig


def views(found: Family) -> list[tuple[float, float]]:
    """Return the range of A of each panel: all A and, if there are many bifurcations, the part where they are dense."""
    whole = (float(found.A[0]), float(found.A[-1]))
    at = np.sort([b.A for b in found.bifurcations])
    if len(at) < CROWDED:
        return [whole]
    several = math.ceil(DENSE * len(at))
    spans = at[several - 1 :] - at[: len(at) - several + 1]
    k = int(spans.argmin())
    margin = 0.12 * float(spans[k])
    low, high = at[k] - margin, at[k + several - 1] + margin
    inside = at[_within(at, low - 0.5 * margin, high + 0.5 * margin)]  # so that no mark is at the edge of a panel
    low, high = min(low, inside[0] - 0.5 * margin), max(high, inside[-1] + 0.5 * margin)
    return [whole, (max(whole[0], float(low)), min(whole[1], float(high)))]


def _view(ax: Axes, ranges: Sequence[tuple[float, float]], k: int) -> list[tuple[float, float]]:
    """Set the range of panel k, shade the range of panel k + 1, and return the ranges in which panel k shows marks."""
    low, high = ranges[k]
    ax.set_xlim(low, high)
    if len(ranges) == 1:
        return [(low, high)]
    letter(ax, k)
    if k == len(ranges) - 1:
        return [(low, high)]
    closer = ranges[k + 1]
    ax.axvspan(*closer, color="0.9", lw=0, zorder=0, label=f"bifurcations: see {chr(ord('b') + k)})")
    return [(low, closer[0]), (closer[1], high)]


def _within(values: np.ndarray, low: float, high: float) -> np.ndarray:
    return (values >= low) & (values <= high)


@styled
def multiplier_diagram(
    found: Family,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw the multiplier of every orbit over A, on a scale that is logarithmic beyond ±1.

    An orbit with a rest has the multiplier 0. If there are many bifurcations, a second panel shows the range of A where
    they are dense.

    Parameters
    ----------
    found : Family
        attribute `family` of a loaded file of `vibrodrive orbits` over A.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> found = vd.load("orbits.h5", kind="orbits").family  # made by `vibrodrive orbits` over A
    >>> figure = vd.plot.multipliers(found)
    >>> figure.axes[0].get_ylabel()
    'multiplier'
    """
    ranges = views(found)
    fig, axes = new(len(ranges), 1, height=0.9 + 2.8 * len(ranges), sharey=True)
    curves = [(branch, traces(branch, lambda o: np.array([o.multiplier]))) for branch in found.branches()]
    sides = [(b.multiplier_below, b.multiplier_above) for b in found.bifurcations]
    heights = [np.array([next((m for m in s if m == m), math.nan)]) for s in sides]
    for k, ax in enumerate(axes[:, 0]):
        for level in (-1.0, 0.0, 1.0):
            ax.axhline(level, color=look().support, lw=0.6, zorder=1)  # drawn above the shaded range of `_view`
        for branch, y in curves:
            _curve(ax, branch, y)
        _marks(ax, found.bifurcations, heights, _view(ax, ranges, k))
        ax.set_yscale("symlog", linthresh=1.0, linscale=1.5)
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"${number(value)}$"))
        name_axes(ax, "A" if k == len(ranges) - 1 else None, None)
        label_axes(ax, None, "multiplier")
    note(axes[0, 0], [equation("B", found.B), f"periods up to {found.max_period}"])
    explain(fig)
    return fig


@styled
def cobweb(
    A: float,
    B: float = 0.1,
    orbit: Orbit | None = None,
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
        excitation amplitude, dimensionless.
    B : float
        tan α / μ, dimensionless.
    orbit : Orbit, optional
        orbit from `vd.orbits` at the same A and B; without it there is no cobweb. The cobweb of an orbit with one
        impact is a point.

    Raises
    ------
    TypeError, ValueError
        if A or B is not a number or is out of range.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> orbit = vd.orbits(2.62, max_period=2)[-1]
    >>> figure = vd.plot.cobweb(2.62, orbit=orbit)
    >>> figure.axes[0].get_legend_handles_labels()[1][-2:]
    ['cobweb of an orbit', 'impacts of the orbit']
    """
    system = ImpactMap(A, B)
    fig, axes = new(1, 1, height=4.6, width=4.8)
    ax = axes[0, 0]
    turn = 2.0 * math.pi
    ax.plot([0, turn], [0, turn], color=look().support, lw=0.6, label="next phase = phase")
    edges = [0.0, *system.breakpoints.tolist(), turn]
    for a, b in itertools.pairwise(edges):
        # near a grazing the map has the slope of a square root, so the points are denser at the ends of a branch
        inner = 0.5 * (a + b) - 0.5 * (b - a) * np.cos(np.linspace(0, math.pi, CURVE_POINTS))
        phi = np.clip(inner, math.nextafter(a, b), math.nextafter(b, a))
        image = system(phi).phase
        image[1:][np.abs(np.diff(image)) > math.pi] = math.nan  # where the phase wraps around
        ax.plot(phi, image, color=look().main, lw=1.0, label="phase of the next impact")
    for point in system.breakpoints.tolist():
        ax.axvline(point, color=look().support, lw=0.5, ls=":", label="breakpoint of the map")
    if orbit is not None:
        path = np.repeat(np.append(orbit.phases, orbit.phases[0]), 2)
        ax.plot(path[:-1], path[1:], color=look().other, lw=0.7, ls="--", label="cobweb of an orbit")
        ax.plot(orbit.phases, np.roll(orbit.phases, -1), "o", ms=3.5, color=look().other, label="impacts of the orbit")
    ax.set(xlim=(0, turn), ylim=(0, turn), aspect="equal")
    label_axes(ax, r"$\varphi_i$", r"$\varphi_{i+1}$", upright=16.0)
    note(ax, [equation("A", A), equation("B", B)])
    explain(fig)
    return fig


def _curve(ax: Axes, branch: Branch, columns: np.ndarray) -> None:
    """Draw the curves of one branch over its A (`columns`, as from `traces`), dashed if the branch is unstable."""
    if branch.unstable:
        drawn: dict[str, Any] = {"color": look().other, "ls": (0, (4, 2)), "lw": 0.6, "label": "unstable orbit"}
    else:
        drawn = {"color": look().main, "ls": "-", "lw": 1.1, "label": "stable orbit"}
    ax.plot(branch.A, columns, zorder=2, **drawn)


def _marks(
    ax: Axes, found: Sequence[Bifurcation], heights: Sequence[np.ndarray], where: Sequence[tuple[float, float]]
) -> None:
    """Mark the bifurcations in the ranges `where` of A with the marker of their kind, at each of their `heights`."""
    for name, kind in BIFURCATIONS.items():
        points = [
            (b.A, y)
            for b, ys in zip(found, heights, strict=True)
            for y in ys
            if b.kind == name and any(low <= b.A <= high for low, high in where)
        ]
        if points:
            face = INK if kind.marker == "|" else "white"
            mark: dict[str, Any] = {"ms": 3.8, "mfc": face, "mec": INK, "mew": 0.7}
            ax.plot(*zip(*points, strict=True), kind.marker, **mark, label=kind.label, zorder=3)
