"""Bifurcation diagrams: all recorded section values over a swept parameter. A spot is a cell of the image of a diagram.
A spot that contains more values is darker. This darkness, 0 to 1, is the *ink* of the spot (ink.py)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from vibrodrive.figures.conditions import choice, conditions, of_sweep, rest_phrases, some, status_phrases
from vibrodrive.figures.ink import FAINTEST, ink_of
from vibrodrive.figures.plane import NUMBERED, draw_lines, read_lines, upright
from vibrodrive.figures.style import (
    as_shown,
    equation,
    explain,
    label_axes,
    letter,
    look,
    name_axes,
    new,
    note,
    styled,
    symbol,
)
from vibrodrive.model.choices import Status
from vibrodrive.model.drawing import Style, Width, check_range
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.plan import POINT
from vibrodrive.model.quantities import QUANTITIES, SECTIONS, row_of
from vibrodrive.model.records import IMPACTS

COORDINATES = tuple(q.name for q in SECTIONS)
PANEL_ROWS = 420
PANEL_COLUMNS = (1500, 8000)  # least and largest number of columns of an image
REACH = (3, 12)
"""Least and largest number of columns filled on each side of a value of the parameter. Between these bounds it is a
quarter of the number of columns from one value to the next."""

MARGIN = 0.03
AT_ONCE = 4096  # number of values of x processed together, to limit the memory

MARKS = {Status.NEVER_LEAVES: ".", Status.TOO_CLOSE: "x", Status.BUDGET: "v"}


@styled
def bifurcation(
    results: Any,
    quantity: str = "dxi",
    x: str | None = None,
    limits: tuple[float, float] | None = None,
    cmap: str | Colormap | None = None,
    over: Any = (),
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw a bifurcation diagram: every recorded section value over the swept parameter.

    Parameters
    ----------
    results : Results
        sweep with at least one axis. There is one panel for each combination of values of the axes other than `x`. At
        most six panels, evenly spaced, are drawn.
    quantity : str
        "dxi" or "xi" for a coordinate of the section points. "impact_phase" or "impact_speed" for the main impacts, if
        the sweep has recorded them. A main impact has no faster impact within half an excitation period of it.
    x : str, optional
        axis of the abscissa; by default the longest axis. It may also be one of the parameters that change together
        along the axis `point`.
    limits : (float, float), optional
        range of the ordinate, with a scene in SI units; by default the range of all values.
    cmap : str or Colormap, optional
        colour map of Matplotlib, from spots with few values to spots with many; by default that of `style`. Spots
        without values have no colour. `ax.images[0].set_cmap` changes it later.
    over : list of Bifurcation, or a file or a table of these, optional
        upright lines at these bifurcations (`vd.bifurcations`, at the B of each panel), with the period of the orbit.
        The abscissa must be A or, with a scene, a0, omega0 or frequency. For files and tables see `map`.

    Raises
    ------
    ValueError
        if the quantity, the axis or the colour map is unknown, or if the sweep has no axis or has not recorded main
        impacts.

    Examples
    --------
    >>> import numpy as np
    >>> import vibrodrive as vd
    >>> r = vd.sweep(A=np.linspace(3.0, 3.25, 20), eps=[0.0, 2e-4], transient=50, periods=20)
    >>> figure = vd.plot.bifurcation(r, quantity="xi", style="print")
    >>> len(figure.axes), figure.axes[1].get_xlabel()
    (2, '$A$')
    """
    check_range("limits", limits, row_of(results.quantities, quantity))
    marked = read_lines(over)
    unit = results.measure(quantity)
    visited, limits = unit.shown_of(_visited(results, quantity)), unit.ends(limits)
    names = list(results.axes)
    if not names:
        raise ValueError(bad_axes((), "at least one axis for a bifurcation diagram (for one motion, draw its section)"))
    if x is None:
        x = max(names, key=lambda n: len(results.axes[n]))
    elif x not in [*names, *results.points]:
        raise ValueError(bad("x", x, "one of the axes " + ", ".join([*names, *results.points])))
    dimension = POINT if x in results.points else x
    across = names.index(dimension)
    section = np.moveaxis(visited, across, -2)
    status = np.moveaxis(np.asarray(results.status), across, -1)
    done = computed(status)
    values = as_shown(x, results.points[x] if x in results.points else results.axes[x])
    rest = [n for n in names if n != dimension]
    panels = list(np.ndindex(section.shape[:-2]))
    rows = some(panels)
    reach = limits or full_range([section[index][done[index]] for index in rows])  # common to all panels
    shared = conditions(of_sweep(results), results.axes)
    grid: dict[str, Any] = {"height": min(9.0, 0.7 + 2.5 * len(rows)), "sharex": True, "sharey": True}
    fig, axes = new(len(rows), 1, shows=[(x, quantity)] * len(rows), said=shared, **grid)
    colours = look().with_map(cmap).density
    grey = False
    for k, (index, ax) in enumerate(zip(rows, axes[:, 0], strict=True)):
        inks = density(ax, values, np.where(done[index][:, None], section[index], np.nan), reach, colours)
        if limits is not None:
            ax.set_ylim(limits)
        mark_statuses(ax, values, status[index])
        name_axes(ax, x, None)
        name_quantities(ax, results, None, quantity)
        at = dict(zip(rest, index, strict=True))
        draw_lines(ax, upright(marked, results, x, at, ax.get_ylim()) if marked else ())
        if len(rows) > 1:
            letter(ax, k, place_of(results, at))
        chosen = choice(len(rows), len(panels), "values of " + ", ".join(map(symbol, rest)))
        rests = rest_phrases(section[index], status[index]) if quantity == "dxi" else []
        keys = [f"{_brighter(colours)}: more values"] * (inks and not grey) + [NUMBERED] * (k == 0 and len(marked) > 0)
        grey = grey or inks
        note(ax, [*([] if k else [*shared, *chosen]), *rests, *status_phrases(status[index]), *keys])
    explain(fig)
    return fig


def _visited(results: Any, quantity: str) -> np.ndarray:
    """Return the values of `quantity` in each motion, float64 (axes…, n).

    They are the values at the section points or, for a quantity of impacts, at the impacts. NaN fills the entries after
    the last impact.
    """
    if quantity in IMPACTS.diagrams:
        return np.asarray(getattr(results, quantity))
    return np.asarray(results.section)[..., quantity_index(quantity)]


def coordinates(source: Any, section: np.ndarray) -> np.ndarray:
    """Return section points (…, 2) of a Results or a Trajectory in the units of figures."""
    return np.stack([source.measure(n).shown_of(section[..., k]) for k, n in enumerate(COORDINATES)], axis=-1)


def name_quantities(ax: Axes, source: Any, x: str | None, y: str | None) -> None:
    """Label the axes with two quantities of a Results or a Trajectory (None: no change): by their symbols or, with a
    scene, by words and units."""
    for across, quantity in ((True, x), (False, y)):
        if quantity is None:
            continue
        unit = source.measure(quantity)
        if quantity in COORDINATES and unit.si == "1" and not unit.apart:
            name_axes(ax, *((quantity, None) if across else (None, quantity)))
        else:
            words = unit.label(QUANTITIES[quantity].words)
            label_axes(ax, *((words, None) if across else (None, words)))


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
        some = slice(first, first + AT_ONCE)
        ink, own = _ink(values[some], low, high), column[some]
        begins = np.flatnonzero(np.diff(own, prepend=-1))
        there = own[begins]
        image[there] = np.maximum(image[there], np.maximum.reduceat(ink, begins))
    nearest = np.searchsorted((u[1:] + u[:-1]) / 2, pixel)
    shown = column[nearest]
    shown[column] = column
    image = np.where((np.abs(pixel - u[nearest]) > reach * step)[:, None], 0.0, image[shown]).T
    add_image(FullestImage(ax, (start, stop, low, high), cmap, Normalize(0, 1)), np.ma.masked_equal(image, 0.0))
    return bool(((image > 0) & (image < 1)).any())


def _brighter(cmap: Colormap) -> str:
    """Return how the colours of full ink differ from those of the least ink: "darker" or "lighter"."""
    luminance = cmap([FAINTEST, 1.0]) @ (0.2126, 0.7152, 0.0722, 0.0) + 1.0 - cmap([FAINTEST, 1.0])[:, 3]
    return "darker" if luminance[1] < luminance[0] else "lighter"


def mark_statuses(ax: Axes, x: np.ndarray, status: np.ndarray) -> None:
    """Draw a mark at the upper edge of the panel at each `x` (n,) whose status is a key of MARKS."""
    for value, marker in MARKS.items():
        there = x[status == value]
        if len(there):
            height = np.full(len(there), 0.975)
            colour = look().support if value == Status.NEVER_LEAVES else look().other
            mark: dict[str, Any] = {"ms": 4, "mew": 0.6, "color": colour, "mfc": "none", "label": value.words}
            ax.plot(there, height, marker, transform=ax.get_xaxis_transform(), **mark)


def full_range(values: Sequence[np.ndarray], margin: float = 0.04) -> tuple[float, float]:
    """Return the range of all finite values, enlarged at both ends by `margin` times its length."""
    seen = [v[np.isfinite(v)] for v in values]
    low = min((v.min() for v in seen if v.size), default=-1.0)
    high = max((v.max() for v in seen if v.size), default=1.0)
    room = margin * (high - low) or 0.5
    return low - room, high + room


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
        whole: Any = self.get_array()
        box = self.get_window_extent(renderer)
        try:
            self.set_data(self.reduced(whole, (int(box.height * magnification), int(box.width * magnification))))
            return super().make_image(renderer, magnification, unsampled)
        finally:
            self.set_data(whole)

    def reduced(self, whole: Any, shape: tuple[int, int]) -> np.ndarray:
        """Return an image, a masked array, with at most this number of rows and columns."""
        return np.ma.masked_equal(pooled(whole.filled(0.0), shape), 0.0)


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


def place_of(results: Any, at: Mapping[str, int]) -> str:
    """Return the values of the axes at these indices as text. The axis `point` gives the values of its parameters."""
    values: dict[str, float] = {}
    for name, index in at.items():
        along = results.points if name == POINT else {name: results.axes[name]}
        values |= {parameter: array[index] for parameter, array in along.items()}
    return ", ".join(equation(name, value) for name, value in values.items())


def quantity_index(quantity: str) -> int:
    """Return the column of a quantity in the section, 0 for ξ and 1 for ξ'. Raises ValueError for another quantity."""
    if quantity not in COORDINATES:
        raise ValueError(bad("quantity", quantity, "one of " + ", ".join(COORDINATES)))
    return COORDINATES.index(quantity)


def computed(status: np.ndarray) -> np.ndarray:
    """Return True for each point that has a section. A point with the status TOO_CLOSE has the section of one of the
    possible motions."""
    return ~np.isin(status, (Status.NOT_COMPUTED, Status.BUDGET))
