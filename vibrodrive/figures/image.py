"""Images in which thin structures stay visible, with linear or logarithmic axes. A spot is a cell of the image of a
diagram. A spot that contains more values is darker. This darkness, 0 to 1, is the *ink* of the spot (ink.py)."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, ListedColormap, LogNorm, Normalize
from matplotlib.image import AxesImage

from vibrodrive.figures.colours import SHADES, Painted
from vibrodrive.figures.ink import ink_of

PANEL_ROWS = 420
PANEL_COLUMNS = (1500, 8000)  # least and largest number of columns of an image
REACH = (3, 12)
"""Least and largest number of columns filled on each side of a value of the parameter. Between these bounds it is a
quarter of the number of columns from one value to the next."""

MARGIN = 0.03
FINEST = 4000  # largest number of columns, and of rows, of the image of cells with unequal widths
AT_ONCE = 4096  # number of values of x processed together, to limit the memory


def density(ax: Axes, x: np.ndarray, values: np.ndarray, limits: tuple[float, float], cmap: Colormap) -> bool:
    """Draw `values` (n, k) over `x` (n,) as an image of their ink. Return True if the ink of its spots differs.

    `ink_of` computes the ink of a spot from the number of the k values in the spot. If several x share a column of the
    image, each spot has the largest of their inks. `limits` is the range of the ordinate.
    """
    order = np.argsort(x)
    if not ax.images and is_geometric(x[order]):
        ax.set_xscale("log")
    logarithmic = ax.get_xscale() == "log"
    if logarithmic:
        order = order[x[order] > 0]
    u = np.log10(x[order]) if logarithmic else x[order]
    values = values[order]
    low, high = limits
    start, stop = (u[0], u[-1]) if u[-1] > u[0] else (u[0] - 0.5, u[0] + 0.5)
    reach = int(np.clip(PANEL_COLUMNS[0] / (4 * len(u)), *REACH))
    if len(u) < PANEL_COLUMNS[0] / reach:
        margin = min(MARGIN, 0.5 / len(u)) * (stop - start)
        start, stop = start - margin, stop + margin
    pixel = np.linspace(start, stop, int(np.clip(len(u), *PANEL_COLUMNS)))
    step = pixel[1] - pixel[0]
    column = np.rint((u - start) / step).astype(int)
    image = np.zeros((len(pixel), PANEL_ROWS))
    for first in range(0, len(u), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        ink, columns = _ink(values[part], low, high), column[part]
        begins = np.flatnonzero(np.diff(columns, prepend=-1))
        filled = columns[begins]
        image[filled] = np.maximum(image[filled], np.maximum.reduceat(ink, begins))
    nearest = np.searchsorted((u[1:] + u[:-1]) / 2, pixel)
    shown = column[nearest]
    shown[column] = column
    image = np.where((np.abs(pixel - u[nearest]) > reach * step)[:, None], 0.0, image[shown]).T
    add_image(FullestImage(ax, (start, stop, low, high), cmap, Normalize(0, 1)), np.ma.masked_equal(image, 0.0))
    return bool(((image > 0) & (image < 1)).any())


def _ink(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """Return the ink of each spot, 0 to 1: float64 (n, PANEL_ROWS) for `values` (n, k)."""
    row = np.floor((values - low) / (high - low) * PANEL_ROWS)
    inside = (row >= 0) & (row < PANEL_ROWS)
    number = np.broadcast_to(np.arange(len(values))[:, None], row.shape)
    counts = np.zeros((len(values), PANEL_ROWS))
    np.add.at(counts, (number[inside], row[inside].astype(int)), 1.0)
    ink = ink_of(counts, values.shape[1])
    ink[:, 1:] = np.maximum(ink[:, 1:], ink[:, :-1])  # a line with a height of one row would be too thin
    return ink


def add_image(drawn: FullestImage, values: np.ndarray) -> None:
    """Draw `values` as an image with its first row at the bottom, and enlarge the ranges of its axes to contain it."""
    ax: Any = drawn.axes
    drawn.set_data(values)
    drawn.set_clip_path(ax.patch)
    ax.add_image(drawn)
    corners = ax.transScale.inverted().transform(np.reshape(drawn.get_extent(), (2, 2)).T)
    drawn.sticky_edges.x[:], drawn.sticky_edges.y[:] = corners.T.tolist()
    ax.update_datalim(corners)
    ax.autoscale_view()


class FullestImage(AxesImage):
    """Image that shows in each pixel the largest of the values > 0 that fall on it.

    The nearest value would drop isolated marks, and an average would make them invisible. `extent` is (left, right,
    bottom, top), in decimal logarithms along a logarithmic axis.
    """

    def __init__(self, ax: Axes, extent: Any, cmap: Colormap, norm: Normalize) -> None:
        # other interpolations would spread a mark over more pixels
        how: dict[str, Any] = {"cmap": cmap, "norm": norm, "origin": "lower", "interpolation": "nearest"}
        super().__init__(ax, extent=extent, transform=ax.transLimits + ax.transAxes, **how)

    def make_image(self, renderer: Any, magnification: float = 1.0, unsampled: bool = False) -> Any:
        image: Any = self.get_array()
        box = self.get_window_extent(renderer)
        try:
            self.set_data(self.reduced(image, (int(box.height * magnification), int(box.width * magnification))))
            return super().make_image(renderer, magnification, unsampled)
        finally:
            self.set_data(image)

    def reduced(self, image: Any, shape: tuple[int, int]) -> np.ndarray:
        """Return an image, a masked array, with at most this number of rows and columns."""
        return np.ma.masked_equal(pooled(image.filled(0.0), shape), 0.0)


def pooled(image: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the maxima of neighbouring rows and columns, so that at most the numbers in `shape` remain."""
    for axis, count in enumerate(shape):
        n, count = image.shape[axis], max(1, count)
        image = image if n <= count else np.maximum.reduceat(image, np.arange(count) * n // count, axis)
    return image


def keep_range(ax: Axes, x: np.ndarray) -> None:
    """Make the abscissa contain all values of an axis, also those at which nothing is drawn."""
    ax.update_datalim(np.column_stack([x, x]), updatey=False)
    ax.autoscale_view()


def is_geometric(x: np.ndarray) -> bool:
    """Return True if ascending values have a constant ratio and span a factor of 5 or more (for a logarithmic axis)."""
    if len(x) < 3 or x[0] <= 0 or x[-1] / x[0] < 5:
        return False
    steps = np.diff(np.log10(x))
    return bool(np.ptp(steps) <= 1e-3 * steps.mean())


def borders_of(values: np.ndarray) -> np.ndarray:
    """Return the borders of cells around n ascending values: float64 (n + 1,).

    If the spacing is geometric, the borders are decimal logarithms.
    """
    u = np.log10(values) if is_geometric(values) else values
    if u[-1] == u[0]:
        return np.linspace(u[0] - 0.5, u[0] + 0.5, len(u) + 1)
    inner = (u[1:] + u[:-1]) / 2
    return np.concatenate([[u[0] - (inner[0] - u[0])], inner, [u[-1] + (u[-1] - inner[-1])]])


class RarestImage(FullestImage):
    """Image of a map: each pixel shows the cell that has the rarest colour. A masked cell has the colour `kind` of the
    table `colours`, and none if `kind` is -1; the other cells have the colours of their values."""

    def __init__(self, ax: Axes, extent: Any, painted: Painted, kind: np.ndarray) -> None:
        table = painted.colours
        under, over = (table[SHADES : SHADES + 2]) if not painted.labels else (None, None)
        shades = ListedColormap(table[: len(painted.labels) or SHADES]).with_extremes(under=under, over=over)
        super().__init__(ax, extent, shades, painted.norm)
        self.kind, self.colours = kind, (255 * table).round().astype(np.uint8)
        rank = np.argsort(np.argsort(-painted.counts, kind="stable")) + 1
        self.rank = np.append(rank, 0)  # cells not computed have the lowest rank, so any other cell hides them

    def reduced(self, image: Any, shape: tuple[int, int]) -> np.ndarray:
        size = self.kind.size
        cell = pooled(self.rank[self.kind] * size + np.arange(size).reshape(self.kind.shape), shape) % size
        values, kind = image.reshape(-1)[cell], self.kind.reshape(-1)[cell]
        shown = self.to_rgba(values, bytes=True)
        apart = np.ma.getmaskarray(values) & (kind >= 0)
        shown[apart] = self.colours[kind[apart]]
        return shown


def draw_cells(
    ax: Axes, painted: Painted, x: np.ndarray, y: np.ndarray, values: np.ndarray, kind: np.ndarray
) -> RarestImage:
    """Draw cells (y, x) as an image, with their values or, for classes, the numbers of these."""
    extent: Any = []
    for along, axis, k in ((x, "x", 1), (y, "y", 0)):
        order = np.argsort(along, kind="stable")
        extent += borders_of(along[order])[[0, -1]].tolist()
        ax.set(**{f"{axis}scale": "log" if is_geometric(along[order]) else "linear"})
        values, kind = (np.take(cells, order[_evenly(along[order])], axis=k) for cells in (values, kind))
    values = kind if painted.labels else values
    outside = (kind < 0) | (kind >= painted.first_apart) | (isinstance(painted.norm, LogNorm) & (values <= 0))
    drawn = RarestImage(ax, extent, painted, kind)
    add_image(drawn, np.ma.masked_array(values, outside))
    return drawn


def _evenly(values: np.ndarray) -> np.ndarray:
    """Divide the image into columns of equal width, and return for each column the index of the cell that it shows."""
    borders = borders_of(values)
    span = borders[-1] - borders[0]
    count = int(np.clip(round(span / max(np.diff(borders).min(), span / FINEST)), len(values), FINEST))
    if count <= len(values):
        return np.arange(len(values))
    centres = borders[0] + span * (np.arange(count) + 0.5) / count
    return np.searchsorted(borders[1:-1], centres)
