"""Maps as images, in the colours of the package's figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vibrodrive.explorer.image import palette_of
from vibrodrive.explorer.work import STRIDES, Level

if TYPE_CHECKING:
    from matplotlib.colors import Normalize


class Key(NamedTuple):
    """Key of colours, "#rrggbb": `swatches` with a name each, and a `scale` with numbers at shares of its length."""

    swatches: Sequence[tuple[str, str]] = ()
    scale: Sequence[str] = ()
    numbers: Sequence[tuple[float, str]] = ()

    def html(self) -> str:
        """Return the key for a page: the scale with its numbers, and the swatches."""
        bar = "".join(f"<span style='left:{100 * share:.1f}%'>{number}</span>" for share, number in self.numbers)
        if self.scale:
            bar = f"<span class='bar'><i style='--scale:{','.join(self.scale[::8])}'></i>{bar}</span>"
        swatch = "<span class='colours swatch' style='background:{}'></span> {}"
        return bar + " ".join(swatch.format(colour, name) for colour, name in self.swatches)


def round_numbers(norm: Normalize) -> list[tuple[float, str]]:
    """Return round numbers of a scale (1, 2 or 5 times a power of ten), each with its share of the length."""
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import Locator, LogLocator, MaxNLocator

    low, high = (float(norm.inverse(end)) for end in (0.0, 1.0))
    few: Locator = MaxNLocator(6, steps=[1, 2, 5, 10])
    if isinstance(norm, LogNorm):
        few = LogLocator(subs=(1.0, 2.0, 5.0) if high < 1e3 * low else (1.0,))
    return [(float(norm(v)), f"{v:.4g}") for v in few.tick_values(low, high) if low <= v <= high]


def painted(
    level: Level, quantity: str, limits: tuple[float, float] | None = None
) -> tuple[np.ndarray, np.ndarray, Key]:
    """Return the image of a quantity, with coarse cells where points are missing; its palette, and its key.

    The image has palette indices uint16 (rows, columns), with y upwards. `limits`: see `map_figure`.
    """
    from matplotlib.colors import to_hex, to_rgb  # imported here so that the page does not wait for it

    from vibrodrive.figures.colours import SHADES, paint
    from vibrodrive.figures.map import recorded

    part = level.sweep if level.sketch is None or level.sweep.done.any() else level.sketch
    results = part.results[0]
    values, status = recorded(results, quantity), results.status
    shape = status.shape
    source = _nearest(part.done.reshape(shape))
    values, status = (whole.reshape(-1)[source].reshape(shape) for whole in (values, status))
    found = paint(quantity, values, status, limits)
    colours = [to_hex(colour) for colour in found.colours]
    swatches = [*zip(colours, found.labels, strict=False), *((to_hex(c), name) for name, c in found.apart)]
    scale, numbers = [], []
    if not found.labels:
        scale = colours[:SHADES]
        numbers = round_numbers(found.norm)
        ends = (("max", "more", SHADES + 1), ("min", "less", SHADES))
        swatches = [(colours[k], name) for end, name, k in ends if found.extend in (end, "both")] + swatches
    palette = palette_of(255 * np.array([to_rgb(colour) for colour in found.colours]))
    return found.cells.filled(0).T.astype(np.uint16), palette, Key(swatches, scale, numbers)


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
