"""Maps: a quantity of every motion of a sweep, as colours over two axes or as marks over one axis.

colours.py defines the colours. Points that are not computed are hatched. If several cells share a pixel, the pixel
shows the cell whose colour is the rarest on the map. So thin structures remain complete, and the size of the file
depends on the number of pixels of the figure, not on the number of cells.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import FixedFormatter, FixedLocator

from vibrodrive.figures.colours import SHADES, Painted, paint
from vibrodrive.figures.drawing import Drawing, check_swept, choose_drawing
from vibrodrive.figures.image import RarestImage, draw_cells, is_geometric, keep_range
from vibrodrive.figures.ink import SAME, range_around
from vibrodrive.figures.looks import HATCHED
from vibrodrive.figures.plane import NUMBERED, draw_lines, placed, read_lines
from vibrodrive.figures.sheet import Sheet, drawn_on, fit_label, in_short_lines
from vibrodrive.figures.texts import as_shown, conditions_of, number, place_of, rest_phrases, status_phrases
from vibrodrive.model.above import above
from vibrodrive.model.choices import UNSEEN
from vibrodrive.model.described import counted
from vibrodrive.model.figure import MAP, Style, Width, documented
from vibrodrive.model.names import NAMES
from vibrodrive.model.parameters import bad
from vibrodrive.model.quantities import KEPT, LAST, LIMITS, Quantity

WIDTH = 4.7
CLASS = 34  # largest number of letters in a line of the name of a class
TALLER = 0.6


@documented
def map_figure(
    results: Any,
    quantity: str = "period",
    x: str | None = None,
    y: str | None = None,
    over: Any = (),
    limits: tuple[float, float] | None = None,
    undisturbed: np.ndarray | None = None,
    cmap: str | Colormap | None = None,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw a map of a quantity over two axes of a sweep. If the sweep has only one axis, draw the values over this
    axis.

    Parameters
    ----------
    results : Results
        sweep with at least one axis. If it has more than two axes, the map shows the motions at the first value of each
        axis that is not drawn, and the figure names these values.
    quantity : str
        a quantity of the summary, "status" or "margin"; with a scene it is in SI units. "impact_power" is the quantity
        `energy` as a power in W, or in W/kg without a mass. "kept" shows whether `gaps`, the numbers of periods between
        main impacts, are those of the undisturbed motion.
    x, y : str, optional
        axes to the right and upwards; by default the two longest axes, in the order of the sweep.
    over : list of Bifurcation, or Results with the record "limit", or a file, a table or a list of these, optional
        lines over the map. Bifurcations are those of `vd.bifurcations` at several B, or of the table that
        `vibrodrive orbits` writes, as a file or as a DataFrame. They are joined at neighbouring values of B; the axes
        of the map must be A and B, or axes of a scene that determine A and B. Limits over one axis, also of a result
        file, need a map over this axis and ε or Δτ.
    limits : (float, float), optional
        range of the colours of a continuous quantity, with a scene in SI units; by default the range of all values,
        without the lowest or highest 0.5 % of at least 1000 values if these would hide the others. Values below and
        above the range have their own colours, which the ends of the colour bar show. The text above the map gives the
        least and the largest value and their points.
    undisturbed : int array, optional
        `gaps` of the undisturbed motions for "kept"; by default they are computed. The dimensions of the array are the
        axes of the sweep; along ε and Δτ its length is 1.
    cmap : str or Colormap, optional
        colour map of Matplotlib for the values or the classes; by default that of `style`. A Colormap, unlike a name,
        also determines the colours of values beyond `limits`. The image has the values, or the numbers of the classes
        from 0, and `ax.images[0].set_cmap` changes its colours and those of the bar later.

    Raises
    ------
    ValueError
        if the quantity, an axis or the colour map is unknown, if the sweep has not recorded the quantity or has no
        axis, or if the axes of `over` are not those of the map.

    Examples
    --------
    >>> import numpy as np
    >>> import vibrodrive as vd
    >>> r = vd.sweep(A=np.linspace(1.5, 3.0, 6), B=[0.05, 0.1, 0.2], transient=50, periods=20, record=["summary"])
    >>> figure = vd.plot.map(r, "impacts", x="B", y="A")
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
    ('$B$', '$A$')
    """
    check_swept(results)
    drawing = choose_drawing(results, MAP, quantity, x=x, y=y, limits=limits, cmap=cmap)
    if undisturbed is not None and drawing.row is not KEPT:
        raise ValueError(bad("undisturbed", undisturbed, f"left out, because only the quantity {KEPT.name} needs it"))
    with drawn_on(ax, style, width, notes, cmap) as sheet:
        return draw_map(sheet, results, drawing, read_lines(over), undisturbed)


def draw_map(
    sheet: Sheet, results: Any, drawing: Drawing, over: Sequence[Any] = (), undisturbed: np.ndarray | None = None
) -> Figure:
    """Draw a map with the lines `over` it (`read_lines`)."""
    _, row, x, y, limits = drawing
    names = list(results.axes)
    index = tuple(slice(None) if n in (x, y) else 0 for n in names)
    unit = results.measure(row.name)
    values = (_kept(results, undisturbed) if row is KEPT else unit.shown_of(recorded(results, row)))[index]
    status = np.asarray(results.status)[index]  # after the values, which show what is damaged
    painted = paint(row, values, status, unit.ends(limits), sheet.look)
    phrases = conditions_of(results, (x, y), section=row in LAST)
    further = rest_phrases(values, status) if row is LAST[1] else []
    further += [] if row.classes else _extremes(results, values, painted, [n for n in names if n in (x, y)])
    further += [*(painted.phrases() if y is None or (row.classes and row.special) else []), *status_phrases(status)]
    lines = placed(over, results.plan, x, y)
    numbered = any(line.period for line in lines)
    alone = y is not None or row.classes  # such a figure hides others, or has its own ordinate
    shows = None if alone else (x, row.name)
    fig, panels = sheet.new(width=WIDTH, height=3.7 + (TALLER if numbered else 0.0), shows=[shows], phrases=phrases)
    disturbance = NAMES[results.plan.sought].mathtext
    words = f"limit $k_2$ in ${disturbance}$" if row.name == LIMITS[0].name else row.words
    ax, label = panels[0, 0], unit.label(words)
    across = as_shown(x, results.axes[x])
    if y is None:
        _draw_line(sheet, ax, painted, values, across, label)
    else:
        cells = [values, painted.cells.filled(-1)]
        cells = [cell.T for cell in cells] if names.index(x) < names.index(y) else cells
        drawn = draw_cells(ax, painted, across, as_shown(y, results.axes[y]), *cells)
        if painted.blank:
            ax.add_patch(Rectangle((0, 0), 1, 1, transform=ax.transAxes, zorder=-1, **HATCHED))
        if not sheet.given:
            ax.tick_params(which="both", direction="out", top=False, right=False)  # ticks inside would be invisible
        _add_bar(fig, drawn, painted, label)
    sheet.name(ax, x, y)
    sheet.note(ax, [*phrases, *further, *([NUMBERED] if numbered else [])], side="left" if y else "right")
    draw_lines(sheet, ax, lines)
    outside = [Patch(fc=colour, ec="0.4", lw=0.5, label=name) for name, colour in painted.apart if colour != "none"]
    blank = [Patch(**HATCHED, label=painted.blank)] if painted.blank else []
    sheet.keys += outside + blank if y is not None else []
    return fig


def _extremes(results: Any, values: np.ndarray, painted: Painted, names: Sequence[str]) -> list[str]:
    """Return the least and the largest value on the scale and beyond it as phrases, each with its point of the axes
    `names` or, if several points have it, with their number."""
    kind = painted.cells.filled(-1)
    points, phrases = np.argwhere((kind >= 0) & (kind < painted.first_apart)), []
    shown = values[tuple(points.T)]
    for word, value in (("least", shown.min()), ("largest", shown.max())) if shown.size else ():
        alike = points[np.isclose(shown, value, SAME, 0.0)]
        place = place_of(results, dict(zip(names, alike[0].tolist(), strict=True)))
        place = place if len(alike) == 1 else counted(len(alike), "point")
        phrases += [f"{word} ${number(float(f'{value:.4g}'))}$ at {place}"] * (len(alike) < len(shown))
    return phrases


def recorded(results: Any, row: Quantity) -> np.ndarray:
    """Return a quantity over all axes, dimensionless, as float64 with NaN for an undefined value or, for gaps and
    sequences, as int64 with -1."""
    if row in LAST:
        return np.asarray(results.section, float)[..., -1, LAST.index(row)]
    values = np.asarray(getattr(results, row.source or row.name))
    return values.astype(np.int64) if values.dtype.kind == "i" else values.astype(float)


def _kept(results: Any, undisturbed: np.ndarray | None) -> np.ndarray:
    """Return for each point 1 if its gaps equal those of the undisturbed motion, 0 if they differ, and -1 if the
    undisturbed motion has no gaps, or if a record is too short to show the gaps."""
    if undisturbed is None:
        undisturbed = above("the gaps of undisturbed motions")(results)
    gaps, reference = np.asarray(results.gaps), np.asarray(undisturbed)
    alike = reference.ndim == gaps.ndim and all(n in (1, m) for n, m in zip(reference.shape, gaps.shape, strict=True))
    if reference.dtype.kind != "i" or not alike:
        allowed = f"the gaps of the undisturbed motions for {KEPT.name}, as of vd.sweep(…, eps=[0.0], …).gaps"
        raise ValueError(bad("undisturbed", undisturbed, allowed))
    return np.where((reference > 0) & (gaps != UNSEEN), (gaps == reference).astype(np.int64), -1)


def _draw_line(sheet: Sheet, ax: Axes, painted: Painted, values: np.ndarray, x: np.ndarray, label: str) -> None:
    """Draw marks over the only axis. Each class, and each group without a class, has a separate level. A quantity
    without classes has a scale, arrows for values beyond its ends, and marks at the edge for points outside it."""
    order = np.argsort(x, kind="stable")
    x, values, kind = x[order], values[order], painted.cells[order].filled(-1)
    levels = [*painted.labels, *(name for name, _ in painted.apart)] if painted.labels else []
    shown = np.where((kind >= 0) & (kind < (len(levels) or SHADES)), kind if levels else values, np.nan)
    ax.plot(x, shown, ".", ms=3, mew=0, color=sheet.look.main)
    if levels:
        ax.set_yticks(range(len(levels)), _broken(levels))
        ax.set_ylim(-0.5, len(levels) - 0.5)
    else:
        if isinstance(painted.norm, LogNorm):
            ax.set_yscale("log")
        inside = values[(kind >= 0) & (kind < SHADES)]
        if inside.size:
            ax.update_datalim([(x[0], end) for end in range_around(inside.min(), inside.max())])
    beyond: Any = (("bottom", "v", "below", painted.norm.vmin), ("top", "^", "above", painted.norm.vmax))
    for k, (end, mark, side, value) in enumerate(beyond if not levels else (), SHADES):
        if (kind == k).any():
            edge, name = np.where(kind == k, value, np.nan), f"{side} the range"
            ax.plot(x, edge, mark, ms=4, mew=0, color=sheet.look.other, clip_on=False, label=name)
            ax.set_ylim(**{end: value})
    for k, (name, _) in enumerate(painted.apart if not levels else (), SHADES + len(beyond)):
        outside = kind == k
        low = bool((values[outside] <= 0).all())
        mark = "v" if low else "^" if np.isposinf(values[outside]).all() else "x"
        thin: dict[str, Any] = {"ms": 4, "mew": 0.6, "color": sheet.look.support, "mfc": "none", "label": name}
        at = np.full(outside.sum(), 0.025 if low else 0.975)
        ax.plot(x[outside], at, mark, transform=ax.get_xaxis_transform(), **thin)
    if is_geometric(x):
        ax.set_xscale("log")
    keep_range(ax, x)
    sheet.label(ax, None, label)


def _broken(labels: Sequence[str]) -> list[str]:
    """Break the names of classes into lines, so that they leave room for the map."""
    return [in_short_lines(label, math.ceil(len(label) / CLASS)) for label in labels]


def _add_bar(fig: Figure, drawn: RarestImage, painted: Painted, label: str) -> None:
    ticks: Any = [FixedLocator(range(len(painted.labels))), FixedFormatter(_broken(painted.labels))]
    ticks = dict(zip(("ticks", "format"), ticks, strict=True)) if painted.labels else {}  # `set_cmap` keeps them
    bar = fig.colorbar(drawn, ax=drawn.axes, extend=painted.extend, **ticks)
    bar.set_label(label, size=mpl.rcParams["font.size"])
    fit_label(bar.ax)
    if painted.labels:
        small = max(map(len, painted.labels)) > 13
        bar.ax.tick_params(which="both", length=0, labelsize=7 if small else mpl.rcParams["ytick.labelsize"])
