"""Orbits as diagrams: bifurcations with the unstable branches, the map with its cobweb, multipliers."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrodrive.figures.bifurcation import quantity_index
from vibrodrive.figures.style import INK, equation, name_axes, new, note, styled
from vibrodrive.model.results import Results
from vibrodrive.periodic.bifurcations import Bifurcation
from vibrodrive.periodic.family import Branch, Family, section, traces
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import Orbit

MARKS = {
    "onset": ("s", "onset"),
    "period doubling": ("o", "period doubling"),
    "fold": ("^", "fold"),
    "border": ("D", "border collision: a rest appears or vanishes"),
    "grazing": ("v", "grazing"),
    "stick": ("|", "stick appears or vanishes"),
}
"""Marker and name of each kind of bifurcation."""

BRUTE = "0.6"
"""Grey of what brute force finds: under the branches, not beside them."""

CURVE_POINTS = 400
"""Points of one branch of the map."""


@styled
def bifurcation_diagram(
    found: Family,
    brute: Results | None = None,
    quantity: str = "dxi",
    section_phase: float = 0.0,
    views: Sequence[tuple[float, float]] = (),
) -> Figure:
    """Section values of every orbit over A, stable ones drawn through, unstable ones dashed.

    Parameters
    ----------
    found : Family
    brute : Results, optional
        a sweep over A alone at the same section phase; drawn in grey underneath.
    quantity : str
        "dxi" or "xi".
    section_phase : float
        phase φ_s of the section.
    views : sequence of (float, float)
        ranges of A, a panel each; one panel for all unless given.

    Raises
    ------
    ValueError
        for an unknown quantity.
    """
    column = quantity_index(quantity)

    def values(orbit: Orbit) -> np.ndarray:
        return section(orbit, section_phase)[:, column]

    ranges = list(views) or [(float(found.A[0]), float(found.A[-1]))]
    fig, axes = new(len(ranges), 1, height=0.5 + 3.6 * len(ranges))
    curves = [(branch, traces(branch, values)) for branch in found.branches()]
    heights = [values(b.orbit) if len(b.orbit.phases) else np.empty(0) for b in found.bifurcations]
    for k, (ax, (low, high)) in enumerate(zip(axes[:, 0], ranges, strict=True)):
        seen = [y[_within(branch.A, low, high)] for branch, y in curves]
        if brute is not None:
            within = _within(brute.axes["A"], low, high)
            there = np.asarray(brute.section)[within][..., column]
            at = np.repeat(brute.axes["A"][within], there.shape[-1])
            ax.plot(at, there.reshape(-1), ".", ms=1.5, mew=0, color=BRUTE, rasterized=True, zorder=1)
            seen.append(there)
        for branch, y in curves:
            _curve(ax, branch, y)
        _marks(ax, found.bifurcations, heights, legend=k == 0)
        ax.set_xlim(low, high)
        ax.set_ylim(*_room(seen))
        name_axes(ax, "A" if k == len(ranges) - 1 else None, quantity)
    conditions = f"{equation('B', found.B)}, {equation('section_phase', section_phase)}"
    note(axes[0, 0], f"{conditions}, periods up to {found.max_period}")
    return fig


def _within(values: np.ndarray, low: float, high: float) -> np.ndarray:
    return (values >= low) & (values <= high)


def _room(values: Sequence[np.ndarray]) -> tuple[float, float]:
    """A range of the ordinate that holds all values, with a margin."""
    flat = np.concatenate([np.ravel(v) for v in values] or [np.zeros(1)])
    flat = flat[np.isfinite(flat)]
    low, high = (flat.min(), flat.max()) if flat.size else (-1.0, 1.0)
    margin = 0.05 * (high - low) or 0.5
    return low - margin, high + margin


@styled
def multiplier_diagram(found: Family) -> Figure:
    """The multiplier of every orbit over A, logarithmic beyond ±1; orbits that rest lie on 0."""
    fig, axes = new(1, 1, height=3.6)
    ax = axes[0, 0]
    for level in (-1.0, 0.0, 1.0):
        ax.axhline(level, color=BRUTE, lw=0.6, zorder=0)
    for branch in found.branches():
        _curve(ax, branch, traces(branch, lambda o: np.array([o.multiplier])))
    sides = [(b.multiplier_below, b.multiplier_above) for b in found.bifurcations]
    _marks(ax, found.bifurcations, [np.array([next((m for m in s if m == m), math.nan)]) for s in sides])
    ax.set_yscale("symlog", linthresh=1.0, linscale=1.5)
    ax.set_xlim(found.A[0], found.A[-1])
    name_axes(ax, "A", None)
    ax.set_ylabel("multiplier")
    note(ax, f"{equation('B', found.B)}, periods up to {found.max_period}")
    return fig


@styled
def cobweb(A: float, B: float = 0.1, orbit: Orbit | None = None) -> Figure:
    """The impact-phase map, its breakpoints dotted, with the cobweb of one of its orbits.

    Raises
    ------
    TypeError, ValueError
        if A or B is out of range.
    """
    system = ImpactMap(A, B)
    fig, axes = new(1, 1, height=4.6, width=4.8)
    ax = axes[0, 0]
    turn = 2.0 * math.pi
    ax.plot([0, turn], [0, turn], color=BRUTE, lw=0.6)
    edges = [0.0, *system.breakpoints.tolist(), turn]
    for a, b in itertools.pairwise(edges):
        # close to a grazing the map falls like a square root: points are denser at the ends
        inner = 0.5 * (a + b) - 0.5 * (b - a) * np.cos(np.linspace(0, math.pi, CURVE_POINTS))
        phi = np.clip(inner, math.nextafter(a, b), math.nextafter(b, a))
        image = system(phi).phase
        image[1:][np.abs(np.diff(image)) > math.pi] = math.nan  # where the phase wraps around
        ax.plot(phi, image, color=INK, lw=1.0)
    for point in system.breakpoints.tolist():
        ax.axvline(point, color=BRUTE, lw=0.5, ls=":")
    if orbit is not None:
        path = np.repeat(np.append(orbit.phases, orbit.phases[0]), 2)
        ax.plot(path[:-1], path[1:], color=INK, lw=0.7, ls="--")
        ax.plot(orbit.phases, np.roll(orbit.phases, -1), "o", ms=3.5, color=INK)
    ax.set(xlim=(0, turn), ylim=(0, turn), aspect="equal")
    ax.set_xlabel(r"$\varphi_i$")
    ax.set_ylabel(r"$\varphi_{i+1}$", rotation=0, labelpad=16, va="center")
    note(ax, f"{equation('A', A)}, {equation('B', B)}")
    return fig


def _curve(ax: Axes, branch: Branch, columns: np.ndarray) -> None:
    """The curves of one branch, dashed if it is unstable."""
    ax.plot(
        branch.A,
        columns,
        color=INK,
        zorder=2,
        ls=(0, (4, 2)) if branch.unstable else "-",
        lw=0.6 if branch.unstable else 1.1,
    )


def _marks(ax: Axes, found: Sequence[Bifurcation], heights: Sequence[np.ndarray], legend: bool = True) -> None:
    """Bifurcations by kind, with a legend of the kinds that occur."""
    for kind, (marker, text) in MARKS.items():
        points = [(b.A, y) for b, ys in zip(found, heights, strict=True) if b.kind == kind for y in ys]
        if points:
            face = INK if marker == "|" else "white"
            ax.plot(*zip(*points, strict=True), marker, ms=4.5, mfc=face, mec=INK, mew=0.8, label=text, zorder=3)
    if legend and ax.get_legend_handles_labels()[0]:
        ax.legend(loc="best", handletextpad=0.3)
