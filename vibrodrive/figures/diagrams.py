"""Diagrams of a Results or a Trajectory as Matplotlib figures; no window is opened. Quantities are dimensionless and
have the symbols of the paper or, with a scene, are in SI units.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vibrodrive.figures.bifurcation import bifurcation, computed, coordinates, name_quantities, place_of
from vibrodrive.figures.conditions import choice, conditions, of_sweep, rest_phrases, some, status_phrases
from vibrodrive.figures.curves import as_motions, check_titles, phase_curve, shared_by, trajectory_figure
from vibrodrive.figures.limits import limits_figure
from vibrodrive.figures.map import map_figure
from vibrodrive.figures.plane import read_lines
from vibrodrive.figures.style import INCHES, explain, given_axes, letter, look, narrow, new, note, styled
from vibrodrive.model.drawing import BANDS, BIFURCATION, MAP, Style, Width, choose_drawing
from vibrodrive.model.parameters import bad

__all__ = ["bifurcation", "from_results", "map_figure", "phase_curve", "poincare", "trajectory_figure"]

FEW = 64  # a section with at most this many different points has larger dots, so that they can be counted


@styled
def poincare(
    source: Any,
    titles: Sequence[str] | None = None,
    reference: np.ndarray | None = None,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw Poincaré sections ξ' over ξ, with one panel for each motion and the same ranges in all panels.

    Parameters
    ----------
    source : Results, Trajectory or a sequence of trajectories
        motions to draw. If a Results has more than six points, six evenly spaced points are drawn.
    titles : sequence of str, optional
        titles of the panels. By default a panel of a Results has the values of the axes as its title.
    reference : float64 (n, 2), optional
        dimensionless section points of the undisturbed orbit, drawn as open circles.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> motions = [vd.simulate(3.04, eps=eps, transient=100, periods=20) for eps in (0.0, 1e-4)]
    >>> figure = vd.plot.poincare(motions, ["undisturbed", "disturbed"], reference=motions[0].section[:2])
    >>> len(figure.axes)
    2
    """
    sections, circled, named, shared, more = _sections(source, reference)
    alike = source if hasattr(source, "axes") else as_motions(source)[0]
    asked = titles is not None
    titles = named if titles is None else check_titles(titles, len(sections))
    cols = {1: 1, 2: 2, 4: 2}.get(len(sections), 2 if narrow() else 3)
    cols = len(sections) if given_axes() else cols
    rows = math.ceil(len(sections) / cols)
    inches, height = (4.6, 3.6) if cols == 1 else (INCHES["double"], 0.6 + rows * (2.5 if cols == 2 else 2.2))
    shows = [("xi", "dxi")] * (rows * cols)
    fig, axes = new(rows, cols, width=inches, height=height, sharex=True, sharey=True, shows=shows, said=shared)
    flat = axes.ravel()
    for k, (section, ax) in enumerate(zip(sections, flat, strict=False)):
        points = np.unique(np.round(section[np.isfinite(section).all(axis=1)], 9), axis=0)
        size = 3.5 if len(points) <= FEW else 1.2
        ax.plot(points[:, 0], points[:, 1], ".", ms=size, mew=0, color=look().main, rasterized=len(points) > 5000)
        if reference is not None:
            circles = {"ms": 7, "mfc": "none", "mec": look().other, "mew": 0.6, "label": "undisturbed orbit"}
            ax.plot(*circled[k].T, "o", **circles)
        letter(ax, k if len(sections) > 1 else None, titles[k], asked)
        if not given_axes():
            ax.margins(0.12)
            ax.tick_params(labelbottom=k >= len(sections) - cols)
        name_quantities(ax, alike, "xi", "dxi")
    for ax in flat[len(sections) :]:
        ax.set_axis_off()
    note(axes[0, -1], [*shared, *more])
    explain(fig)
    return fig


@styled
def from_results(
    results: Any,
    kind: str | None = None,
    quantity: str | None = None,
    x: str | None = None,
    y: str | None = None,
    limits: tuple[float, float] | None = None,
    cmap: Any = None,
    over: Any = None,
    undisturbed: np.ndarray | None = None,
) -> Figure:
    """Draw a sweep. `choose_drawing` chooses the kind of the figure.

    The arguments are those of `Results.plot`, and `undisturbed` of `map_figure`.
    """
    kind, quantity = choose_drawing(results, kind, quantity, x=x, y=y, limits=limits, cmap=cmap)
    if kind == MAP:
        return map_figure(results, quantity, x, y, over, limits, undisturbed, cmap)
    if kind == BIFURCATION:
        return bifurcation(results, quantity, x, limits, cmap, over)
    if read_lines(over):
        raise ValueError(bad("kind", kind, f"{MAP} or {BIFURCATION}, over which lines are drawn"))
    return limits_figure(results) if kind == BANDS else poincare(results)


def _sections(
    source: Any, reference: np.ndarray | None
) -> tuple[list[np.ndarray], list[np.ndarray], list[str], list[str], list[str]]:
    """Return the sections and the reference of each, in the units of figures, their titles, the conditions common to
    all sections, and further phrases."""
    marks = np.empty((0, 2)) if reference is None else np.asarray(reference)
    if not hasattr(source, "axes"):
        motions = as_motions(source)
        sections = [coordinates(m, np.asarray(m.section)) for m in motions]
        circled = [coordinates(m, marks) for m in motions]
        rests = _rests(sections, [m.status for m in motions])
        return sections, circled, [""] * len(motions), shared_by(motions, section=True), rests
    section, done = coordinates(source, np.asarray(source.section)), computed(source.status)
    around = coordinates(source, np.broadcast_to(marks, (*done.shape, *marks.shape)))
    points = list(np.ndindex(section.shape[:-2]))
    shown = some(points)
    titles = [place_of(source, dict(zip(source.axes, index, strict=True))) for index in shown]
    status = np.asarray(source.status)
    sections = [np.where(done[index], section[index], np.nan) for index in shown]
    rests = _rests(sections, [status[index] for index in shown])
    more = [*choice(len(shown), len(points), "points"), *rests, *status_phrases(status)]
    return sections, [around[index] for index in shown], titles, conditions(of_sweep(source), source.axes), more


def _rests(sections: Sequence[np.ndarray], status: Sequence[Any]) -> list[str]:
    """Return the phrase for the share of section points at which the mass rests."""
    return rest_phrases(np.concatenate([s[:, 1] for s in sections]), np.repeat(status, [len(s) for s in sections]))
