"""Figure of a sweep, by its record or by the kind that the user wants."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vibrodrive.figures.curves import phase_curve, trajectory_figure
from vibrodrive.figures.limits import limits_figure
from vibrodrive.figures.map import map_figure
from vibrodrive.figures.plane import read_lines
from vibrodrive.figures.sections import bifurcation, poincare
from vibrodrive.model.drawing import BANDS, BIFURCATION, MAP, choose_drawing
from vibrodrive.model.parameters import bad

__all__ = ["bifurcation", "from_results", "map_figure", "phase_curve", "poincare", "trajectory_figure"]


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
    **look: Any,
) -> Figure:
    """Draw a sweep. `choose_drawing` chooses the kind of the figure.

    The arguments are those of `Results.plot`, and `undisturbed` of `map_figure`; `look` contains ax, style, width and
    notes.
    """
    kind, quantity = choose_drawing(results, kind, quantity, x=x, y=y, limits=limits, cmap=cmap)
    if kind == MAP:
        return map_figure(results, quantity, x, y, over, limits, undisturbed, cmap, **look)
    if kind == BIFURCATION:
        return bifurcation(results, quantity, x, limits, cmap, over, **look)
    if read_lines(over):
        raise ValueError(bad("kind", kind, f"{MAP} or {BIFURCATION}, over which lines are drawn"))
    return limits_figure(results, **look) if kind == BANDS else poincare(results, **look)
