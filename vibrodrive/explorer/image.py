"""Picture of a view: a diagram or a map as an image, whose pixels are indices into a palette, its key and its statuses.

Each column of a diagram is a point of the sweep. The rows divide the range of the ordinate evenly. A point that is not
yet computed copies a computed one (`_nearest`). Maps have the colours of the package's figures. A level (work.py) is
the computed part of a sweep, with a sketch for missing points or without.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import vibrodrive as vd
from vibrodrive.explorer.controls import title_of
from vibrodrive.explorer.density import darken
from vibrodrive.explorer.view import MAP, PICTURE_ROWS, SPAN, Y_SPAN, View
from vibrodrive.explorer.work import STRIDES, Level
from vibrodrive.figures.ink import ink_of, range_around
from vibrodrive.model import choices, names, records

SHADES = 64
"""Number of shades of a scale. A pixel of shade 0 is blank, all others have ink. The shades of `difference` are
three scales, for the pixels with ink in both images, only in the chosen image, and only in the certified image."""

ONLY_CHOSEN, ONLY_CERTIFIED = SHADES, 2 * SHADES
TURN = 2.0 * np.pi
MARGIN = 0.04  # share of the range of the values that is added at both ends of the ordinate


def values_of(results: vd.Results, quantity: str) -> np.ndarray:
    """Return the recorded values of a quantity, with a scene in SI units: float64 (columns, values), NaN if missing."""
    found = results.measure(quantity).of(records.values_of(results, records.QUANTITIES[quantity]))
    lacking = np.isin(results.status, (choices.Status.NOT_COMPUTED, choices.Status.BUDGET))
    return np.where(lacking[:, None], np.nan, found) if lacking.any() else found


def fitting_range(level: Level, quantity: str) -> tuple[float, float]:
    """Return (low, high), the range of all values with a margin, or (-1, 1) if there are no values."""
    part = level.sketch if level.sketch is not None and not level.sweep.done.any() else level.sweep
    values = np.concatenate([values_of(results, quantity)[part.done].ravel() for results in part.results])
    values = values[np.isfinite(values)]
    if not values.size:
        return -1.0, 1.0
    if _is_phase(quantity):  # the values begin after the widest gap on the circle
        values = np.sort(values)
        gap = int(np.argmax(np.diff(values, append=values[0] + TURN)))
        values = np.array([values[gap + 1] - TURN if gap + 1 < len(values) else values[0], values[gap]])
    return range_around(float(values.min()), float(values.max()), MARGIN)


def _is_phase(quantity: str) -> bool:
    return records.QUANTITIES[quantity].unit == "rad"


def _values_above(low: float, results: vd.Results, quantity: str) -> np.ndarray:
    """Return the values of `values_of`, phases in the turn that begins at `low`."""
    values = values_of(results, quantity)
    return low + (values - low) % TURN if _is_phase(quantity) else values


def palette_of(colours: np.ndarray) -> np.ndarray:
    """Convert colours, float64 (n, 3) with red, green, blue from 0 to 255, to the pixels of a canvas, uint32 (n,)."""
    red, green, blue = np.rint(colours.T).astype(np.uint32)
    return 255 << 24 | blue << 16 | green << 8 | red


def shades_of(values: np.ndarray, columns: np.ndarray, low: float, high: float, image: np.ndarray) -> None:
    """Draw values (n, k) into n columns of an image uint8 (rows, columns), as shades 0 to SHADES - 1.

    `columns` contains the indices of these columns. The rows divide the range from `low` to `high` evenly.
    """
    k = values.shape[1]
    table = np.ceil(ink_of(np.arange(k + 1), k) * (SHADES - 1)).astype(np.uint8)
    darken(np.ascontiguousarray(values), columns, low, high, table, np.empty(len(image), np.int64), image)


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
    done = there = level.sweep.done
    parts = [(level.sweep, np.flatnonzero(done))]
    if level.sketch is not None:
        there = done | level.sketch.done
        parts.append((level.sketch, np.flatnonzero(there & ~done)))
    out = []
    for k in range(len(level.sweep.results)):
        image = np.empty((rows, len(done)), np.uint8)
        for part, columns in parts:
            shades_of(_values_above(low, part.results[k], quantity)[columns], columns, low, high, image)
        out.append(image if there.all() else image[:, _nearest(there[:, None])])
    return out


def painted(
    level: Level, quantity: str, limits: tuple[float, float] | None = None
) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """Return the image of a quantity, its palette and its key. A missing point has the colour of a computed point.

    The image contains palette indices, uint16 (rows, columns), with y upwards. For `limits` see `map_figure`. The key
    has `swatches` (colour of CSS, name), the colours of a `scale`, and its `ends` (low, high, whether logarithmic).
    """
    from matplotlib.colors import LogNorm, to_hex, to_rgb  # imported here so that the page appears sooner

    from vibrodrive.figures import colours

    part = level.sweep if level.sketch is None or level.sweep.done.any() else level.sketch
    results = part.results[0]
    values = records.values_of(results, records.QUANTITIES[quantity])
    values = values.astype(np.int64 if values.dtype.kind == "i" else float)
    values, status = results.measure(quantity).of(values), results.status
    shape = status.shape
    source = _nearest(part.done.reshape(shape))
    values, status = (whole.reshape(-1)[source].reshape(shape) for whole in (values, status))
    found = colours.paint(records.QUANTITIES[quantity], values, status, limits)
    inks = [to_hex(colour) for colour in found.colours]
    labels = [label.replace("none up to", "none found up to") for label in found.labels]  # in the periods of the map
    swatches = [*zip(inks, labels, strict=False), *((to_hex(c), name) for name, c in found.apart)]
    scale = [] if found.labels else inks[: colours.SHADES : 8]
    if scale:
        beyond = (("max", "more", colours.SHADES + 1), ("min", "less", colours.SHADES))
        swatches = [(inks[k], name) for end, name, k in beyond if found.extend in (end, "both")] + swatches
    palette = palette_of(255 * np.array([to_rgb(colour) for colour in found.colours]))
    ends = float(found.norm.vmin or 0.0), float(found.norm.vmax or 1.0), isinstance(found.norm, LogNorm)
    key = {"swatches": swatches, "scale": scale, "ends": ends}
    return found.cells.filled(0).T.astype(np.uint16), palette, key


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


COUNTED = (choices.Status.TOO_CLOSE, choices.Status.BUDGET, choices.Status.NEVER_LEAVES)
NARROWEST = 0.03  # least width of a span of equal periods, as a share of the window


def picture_of(view: View, level: Level, height: int = PICTURE_ROWS) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return (head, arrays) of the picture of the computed part of a view. `height` is the number of rows of a diagram.

    The arrays are the image, with y upwards, and its palette (empty for a diagram, whose shades the page colours). The
    head has the title; how much is computed; the place of the image in coordinates of the axes, which are decimal
    logarithms along a logarithmic axis; whether the ordinate has the range of the values (`fit`); the number of motions
    with each status of COUNTED (`counts`), and in a diagram their columns (`odd`); and the `spans` of equal periods.
    """
    columns, rows = view.grid
    left, right = edges(view, SPAN, columns)
    status = level.sweep.results[0].status
    where = {s.words: np.flatnonzero(status == s) for s in COUNTED} if level.complete else {}
    where = {words: points for words, points in where.items() if len(points)}
    head: dict[str, Any] = {"x": left, "dw": right - left, "map": view.mode == MAP, "fit": False, "empty": False}
    head |= {"counts": {words: len(points) for words, points in where.items()}, "odd": {}, "spans": []}
    head |= dict(zip(("title", "conditions"), title_of(view), strict=True)) | {"complete": level.complete}
    head |= {"share": level.share, "left": level.left, "count": level.sweep.done.size}
    if view.mode == MAP:
        low, high = edges(view, Y_SPAN, rows)
        image, palette, key = painted(level, view.shade, view.limits)
        return {**head, "y": low, "dh": high - low, "key": key}, {"image": image, "palette": palette}
    swatches, low, high = [], view.bottom, view.top
    if view.limits is None:
        head["fit"], (low, high) = True, fitting_range(level, view.quantity)
    image, *certified = pictures(level, view.quantity, low, high, height)
    if certified:
        image = difference(image, *certified)
        swatches = [("var(--ink)", "both"), ("var(--down)", f"{view.method} only"), ("var(--up)", "certified only")]
    elif level.complete and view.barred:
        moving = np.where(status == choices.Status.NEVER_LEAVES, -1, level.sweep.results[0].period)
        head["spans"] = spans_of(moving, left, right)
    head |= {"y": low, "dh": high - low, "empty": not image.any()}
    head["key"] = {"swatches": swatches, "scale": [], "ends": (0.0, 1.0, False)}
    head["odd"] = {words: points.tolist() for words, points in where.items()}
    return head, {"image": image, "palette": np.empty(0, np.uint32)}


def spans_of(period: np.ndarray, left: float, right: float) -> list[tuple[float, float, int]]:
    """Return (left end, right end, period) of each wide span of columns with one period, 0 for none,
    and without a span for a negative one. The columns, int (n,), divide the range from `left` to `right` evenly.
    """
    ends = np.concatenate([[0], np.flatnonzero(np.diff(period)) + 1, [len(period)]])
    place = left + (right - left) * ends / len(period)
    runs = zip(place[:-1].tolist(), place[1:].tolist(), period[ends[:-1]].tolist(), strict=True)
    return [run for run in runs if run[1] - run[0] >= NARROWEST * (right - left) and run[2] >= 0]


def place(values: Any, scale: str) -> Any:
    """Return the coordinates at which values of an axis are drawn: their decimal logarithms if its scale is LOG."""
    return np.log10(values) if scale == names.LOG else values


def edges(view: View, keys: tuple[str, str, str], count: int) -> tuple[float, float]:
    """Return the outer edges of the first and last cell of an axis. Each value is the centre of its cell."""
    low, high, scale = (getattr(view, key) for key in keys)
    first, last = float(place(low, scale)), float(place(high, scale))
    half = 0.5 * (last - first) / (count - 1)
    return first - half, last + half
