"""Figure of a sweep, by its record or by the kind that the user wants."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from vibrodrive.figures.drawing import Drawing, choose_drawing
from vibrodrive.figures.limits import draw_bands
from vibrodrive.figures.map import draw_map, map_figure
from vibrodrive.figures.plane import read_lines
from vibrodrive.figures.sections import bifurcation, draw_bifurcation, draw_sections, poincare
from vibrodrive.figures.sheet import Sheet, drawn_on
from vibrodrive.model.figure import BANDS, BIFURCATION, MAP

__all__ = ["bifurcation", "draw", "from_results", "map_figure", "poincare"]


def from_results(
    results: Any, kind: str | None = None, quantity: str | None = None, *, over: Any = None, cmap: Any = None,
    ax: Any = None, style: Any = None, width: Any = None, notes: bool | None = None, **options: Any,
) -> Figure:  # fmt: skip
    """Draw a sweep. The arguments are those of `Results.plot`; `options` are x, y and limits."""
    lines = read_lines(over)
    drawing = choose_drawing(results, kind, quantity, cmap=cmap, over=lines or None, **options)
    with drawn_on(ax, style, width, notes, cmap) as sheet:
        return draw(sheet, drawing, [results], lines)


def draw(sheet: Sheet, drawing: Drawing, several: Sequence[Any], over: Sequence[Any] = ()) -> Figure:
    """Draw a sweep, or limits of several, with the lines `over` it."""
    results = several[0]
    if drawing.kind == MAP:
        return draw_map(sheet, results, drawing, over)
    if drawing.kind == BIFURCATION:
        return draw_bifurcation(sheet, results, drawing, over)
    return draw_bands(sheet, several) if drawing.kind == BANDS else draw_sections(sheet, results)
