"""Maps as images, in the colours of the package's figures."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vibrodrive.explorer.image import palette_of
from vibrodrive.explorer.work import STRIDES, Level


class Plane(NamedTuple):
    """Image of a map: palette indices uint16 (rows, columns) with y upwards, palette as for the canvas of a page, and
    legend of the colours as HTML."""

    cells: np.ndarray
    palette: np.ndarray
    legend: str


def painted(level: Level, quantity: str, limits: tuple[float, float] | None = None) -> Plane:
    """Return the image of a quantity, with coarse cells where points are missing. `limits`: see `map_figure`."""
    from matplotlib.colors import LogNorm, to_hex, to_rgb  # imported here so that the page does not wait for it

    from vibrodrive.figures.colours import SHADES, paint
    from vibrodrive.figures.map import recorded

    part = level.sweep if level.sketch is None or level.sweep.done.any() else level.sketch
    results = part.results[0]
    values, status = recorded(results, quantity), results.status
    shape = status.shape
    source = _nearest(part.done.reshape(shape))
    values, status = (whole.reshape(-1)[source].reshape(shape) for whole in (values, status))
    found = paint(quantity, values, status, limits)
    hexadecimal = [to_hex(colour) for colour in found.colours]
    names = [*zip(hexadecimal, found.labels, strict=False), *((to_hex(c), name) for name, c in found.apart)]
    if not found.labels:
        low, high = (float(found.norm.inverse(share)) for share in (0.0, 1.0))
        spaced = "logarithmically to " if isinstance(found.norm, LogNorm) else "to "
        less = [(hexadecimal[SHADES], "less")] if found.extend in ("min", "both") else []
        more = [(hexadecimal[SHADES + 1], "more")] if found.extend in ("max", "both") else []
        ends = [(hexadecimal[0], f"{low:.4g}"), (hexadecimal[SHADES - 1], f"{spaced}{high:.4g}")]
        names = [*less, *ends, *more, *names]
    legend = " ".join(f"<span style='background:{c};border:1px solid #888'>&emsp;</span> {name}" for c, name in names)
    colours = palette_of(255 * np.array([to_rgb(colour) for colour in found.colours]))
    return Plane(found.cells.filled(0).T.astype(np.uint16), colours, legend)


def _nearest(done: np.ndarray) -> np.ndarray:
    """Return for each point of a plane the computed point that it copies: int64 indices (flat).

    A missing point copies the computed point at or before it, along both axes, on the finest possible grid of STRIDES.
    """
    rows, columns = np.indices(done.shape)
    source = np.arange(done.size).reshape(done.shape)
    there = done.copy()
    for stride in sorted(STRIDES):
        coarse = rows - rows % stride, columns - columns % stride
        better = ~there & done[coarse]
        source[better] = (coarse[0] * done.shape[1] + coarse[1])[better]
        there |= better
    return source.reshape(-1)
