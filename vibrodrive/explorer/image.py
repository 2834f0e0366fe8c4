"""Diagrams and maps as images: each pixel is an index into a palette.

Each column of a diagram is a point of the sweep. The rows divide the range of the ordinate evenly. A column that is not
yet computed repeats the last computed column to its left. Maps have the colours of the package's figures. A level
(work.py) is the computed part of a sweep, with a sketch for missing points or without.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vibrodrive.explorer.density import paint
from vibrodrive.explorer.view import PICTURE_ROWS
from vibrodrive.explorer.work import STRIDES, Level
from vibrodrive.figures.ink import ink_of
from vibrodrive.model.choices import Status
from vibrodrive.model.results import Results

if TYPE_CHECKING:
    from matplotlib.colors import Normalize

SHADES = 64
"""Number of shades of a scale. A pixel of shade 0 is blank, all others have ink. The palette of `difference` consists
of three scales, for the pixels with ink in both images, only in the chosen image, and only in the certified image."""

ONLY_CHOSEN, ONLY_CERTIFIED = SHADES, 2 * SHADES
INKS = ((0, 0, 0), (213, 94, 0), (0, 114, 178))
MARGIN = 0.04  # share of the range of the values that is added at both ends of the ordinate


def values_of(results: Results, quantity: str) -> np.ndarray:
    """Return the recorded values of a quantity, with a scene in SI units: float64 (columns, values), NaN if missing."""
    if quantity in ("xi", "dxi"):
        found = results.section[..., ("xi", "dxi").index(quantity)]
    else:
        found = getattr(results, quantity)
    found = results.measure(quantity).of(found)
    lacking = np.isin(results.status, (Status.NOT_COMPUTED, Status.BUDGET))
    return np.where(lacking[:, None], np.nan, found) if lacking.any() else found


def fitting_range(level: Level, quantity: str) -> tuple[float, float]:
    """Return (low, high), the range of all values with a margin, or (-1, 1) if there are no values."""
    part = level.sketch if level.sketch is not None and not level.sweep.done.any() else level.sweep
    ends = []
    for results in part.results:
        values = values_of(results, quantity)[part.done]
        values = values[np.isfinite(values)]
        if values.size:
            ends += [float(values.min()), float(values.max())]
    if not ends:
        return -1.0, 1.0
    low, high = min(ends), max(ends)
    margin = MARGIN * (high - low) or 0.5
    return low - margin, high + margin


def palette_of(colours: np.ndarray) -> np.ndarray:
    """Convert colours, float64 (n, 3) with red, green, blue from 0 to 255, to the pixels of a canvas, uint32 (n,)."""
    red, green, blue = np.rint(colours.T).astype(np.uint32)
    return 255 << 24 | blue << 16 | green << 8 | red


def ink_palette() -> np.ndarray:
    """Return the concatenated scales from white to each of INKS."""
    share = np.arange(SHADES)[:, None] / (SHADES - 1)
    return palette_of(np.concatenate([255 + share * (np.array(ink) - 255) for ink in INKS]))


def shades_of(values: np.ndarray, columns: np.ndarray, low: float, high: float, image: np.ndarray) -> None:
    """Draw values (n, k) into n columns of an image uint8 (rows, columns), as shades 0 to SHADES - 1.

    `columns` contains the indices of these columns. The rows divide the range from `low` to `high` evenly.
    """
    k = values.shape[1]
    table = np.ceil(ink_of(np.arange(k + 1), k) * (SHADES - 1)).astype(np.uint8)
    paint(np.ascontiguousarray(values), columns, low, high, table, np.empty(len(image), np.int64), image)


def _near(there: np.ndarray) -> np.ndarray:
    """Add to `there` (bool, rows by columns) the pixels above and below: rounding may move a value to the next row."""
    out = there.copy()
    out[1:] |= there[:-1]
    out[:-1] |= there[1:]
    return out


def difference(chosen: np.ndarray, certified: np.ndarray) -> np.ndarray:
    """Merge two images of shades. The scale of a pixel shows which of the images have ink there: the first, the second,
    or both."""
    alone = (chosen > 0) & ~_near(certified > 0)
    missing = (certified > 0) & ~_near(chosen > 0)
    out = np.maximum(chosen, certified)
    out[alone] = chosen[alone] + ONLY_CHOSEN
    out[missing] = certified[missing] + ONLY_CERTIFIED
    return out


def pictures(level: Level, quantity: str, low: float, high: float, rows: int = PICTURE_ROWS) -> list[np.ndarray]:
    """Return for each method of the level one image uint8 (rows, columns) of the values from `low` to `high`."""
    done, rest = level.sweep.done, None
    there = done
    if level.sketch is not None:
        rest = np.flatnonzero(level.sketch.done & ~done)
        there = done | level.sketch.done
    out = []
    for k, results in enumerate(level.sweep.results):
        image = np.empty((rows, len(done)), np.uint8)
        if level.sketch is not None and rest is not None:
            shades_of(values_of(level.sketch.results[k], quantity)[rest], rest, low, high, image)
        now = np.flatnonzero(done)
        shades_of(values_of(results, quantity)[now], now, low, high, image)
        out.append(image if there.all() else image[:, _repeated(there)])
    return out


def _repeated(there: np.ndarray) -> np.ndarray:
    """Return for each column the last available column at or before it. If there is none, return the first available
    column."""
    at = np.maximum.accumulate(np.where(there, np.arange(len(there)), -1))
    return np.where(at < 0, np.argmax(there), at)


class Key(NamedTuple):
    """Key to the colours of a picture: `swatches` (colour "#rrggbb", name), the colours of the `scale`, and `numbers`
    (share of the length of the scale, number)."""

    swatches: Sequence[tuple[str, str]] = ()
    scale: Sequence[str] = ()
    numbers: Sequence[tuple[float, str]] = ()

    def html(self) -> str:
        """Return the key for a page: the scale with its numbers, and the swatches."""
        bar = "".join(f"<span style='left:{100 * share:.1f}%'>{number}</span>" for share, number in self.numbers)
        if self.scale:
            bar = f"<span class='bar'><i style='--scale:{','.join(self.scale[::8])}'></i>{bar}</span>"
        swatch = "<span class='entry'><span class='colours swatch' style='background:{}'></span> {}</span>"
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
    """Return the image of a quantity, its palette and its key. A missing point has the colour of a computed point.

    The image contains palette indices, uint16 (rows, columns), with y upwards. For `limits` see `map_figure`.
    """
    from matplotlib.colors import to_hex, to_rgb  # imported here so that the page appears sooner

    from vibrodrive.figures.colours import SHADES, paint
    from vibrodrive.figures.map import recorded

    part = level.sweep if level.sketch is None or level.sweep.done.any() else level.sketch
    results = part.results[0]
    values, status = results.measure(quantity).of(recorded(results, quantity)), results.status
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
