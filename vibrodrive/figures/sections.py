"""Section points of motions: bifurcation diagrams, with all recorded values over a swept parameter, and Poincaré
sections."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure

from vibrodrive.figures.drawing import Drawing, check_swept, choose_drawing
from vibrodrive.figures.image import density
from vibrodrive.figures.ink import FAINTEST, range_around
from vibrodrive.figures.plane import NUMBERED, draw_lines, read_lines, upright
from vibrodrive.figures.sheet import Sheet, as_list, drawn_on
from vibrodrive.figures.style import INCHES
from vibrodrive.figures.texts import (
    as_shown,
    choice,
    computed,
    conditions_of,
    place_of,
    rest_phrases,
    shared_by,
    some,
    status_phrases,
    symbol,
)
from vibrodrive.model.choices import Status
from vibrodrive.model.figure import BIFURCATION, Style, Width, documented
from vibrodrive.model.parameters import bad, real_array
from vibrodrive.model.physical import Measure
from vibrodrive.model.quantities import SECTIONS

if TYPE_CHECKING:
    from vibrodrive.batch.trajectory import Trajectory

COORDINATES = tuple(q.name for q in SECTIONS)
FEW = 64  # a section with at most this many different points has larger dots, so that they can be counted

MARKS = {Status.NEVER_LEAVES: ".", Status.TOO_CLOSE: "x", Status.BUDGET: "v"}


@documented
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
    check_swept(results)
    drawing = choose_drawing(results, BIFURCATION, quantity, x=x, limits=limits, cmap=cmap)
    with drawn_on(ax, style, width, notes, cmap) as sheet:
        return draw_bifurcation(sheet, results, drawing, read_lines(over))


def draw_bifurcation(sheet: Sheet, results: Any, drawing: Drawing, over: Sequence[Any] = ()) -> Figure:
    """Draw a bifurcation diagram with the lines `over` it (`read_lines`)."""
    x, quantity, unit = drawing.x, drawing.row.name, results.measure(drawing.row.name)
    recorded = (
        results.section[..., COORDINATES.index(quantity)] if quantity in COORDINATES else getattr(results, quantity)
    )
    visited, limits = unit.shown_of(np.asarray(recorded)), unit.ends(drawing.limits)
    names, dimension = list(results.axes), x if x in results.axes else results.plan.variables[x].dimension
    across = names.index(dimension)
    section = np.moveaxis(visited, across, -2)
    status = np.moveaxis(np.asarray(results.status), across, -1)
    done = computed(status)
    values = as_shown(x, results.axes[x] if x in results.axes else results.points[x])
    other_axes = [n for n in names if n != dimension]
    panels = list(np.ndindex(section.shape[:-2]))
    rows = some(panels)
    places = [dict(zip(other_axes, index, strict=True)) for index in rows]
    titles = [place_of(results, at) for at in places]
    shared = conditions_of(results)
    chosen = choice(len(rows), len(panels), "values of " + ", ".join(map(symbol, other_axes)))
    reach = limits or full_range([section[index][done[index]] for index in rows])  # common to all panels
    grid: dict[str, Any] = {"height": min(9.0, 0.7 + 2.5 * len(rows)), "sharex": True, "sharey": True}
    fig, axes = sheet.new(len(rows), 1, shows=[(x, quantity)] * len(rows), phrases=shared, **grid)
    grey = False
    for k, (index, ax) in enumerate(zip(rows, axes[:, 0], strict=True)):
        shown = np.where(done[index][:, None], section[index], np.nan)
        inks = density(ax, values, shown, reach, sheet.look.density)
        if limits is not None:
            ax.set_ylim(limits)
        mark_statuses(sheet, ax, values, status[index])
        sheet.name(ax, x, None)
        sheet.name_quantities(ax, None, unit)
        draw_lines(sheet, ax, upright(over, results.plan, x, places[k], ax.get_ylim()) if over else ())
        if len(rows) > 1:
            sheet.letter(ax, k, titles[k])
        rests = rest_phrases(section[index], status[index]) if quantity == "dxi" else []
        keys = [f"{_brighter(sheet.look.density)}: more values"] * (inks and not grey) + [NUMBERED] * bool(
            over and not k
        )
        grey = grey or inks
        sheet.note(ax, [*([] if k else [*shared, *chosen]), *rests, *status_phrases(status[index]), *keys])
    return fig


def measures(source: Any) -> list[Measure]:
    """Return the conversions of ξ and ξ' of a Results or a Trajectory."""
    return [source.measure(name) for name in COORDINATES]


def coordinates(source: Any, section: np.ndarray) -> np.ndarray:
    """Return section points (…, 2) of a Results or a Trajectory in the units of figures."""
    return np.stack([unit.shown_of(section[..., k]) for k, unit in enumerate(measures(source))], axis=-1)


def _brighter(cmap: Colormap) -> str:
    """Return how the colours of full ink differ from those of the least ink: "darker" or "lighter"."""
    luminance = cmap([FAINTEST, 1.0]) @ (0.2126, 0.7152, 0.0722, 0.0) + 1.0 - cmap([FAINTEST, 1.0])[:, 3]
    return "darker" if luminance[1] < luminance[0] else "lighter"


def mark_statuses(sheet: Sheet, ax: Axes, x: np.ndarray, status: np.ndarray) -> None:
    """Draw a mark at the upper edge of the panel at each `x` (n,) whose status is a key of MARKS."""
    for value, marker in MARKS.items():
        marked = x[status == value]
        if len(marked):
            height = np.full(len(marked), 0.975)
            colour = sheet.look.support if value == Status.NEVER_LEAVES else sheet.look.other
            mark: dict[str, Any] = {"ms": 4, "mew": 0.6, "color": colour, "mfc": "none", "label": value.words}
            ax.plot(marked, height, marker, transform=ax.get_xaxis_transform(), **mark)


def full_range(values: Sequence[np.ndarray], margin: float = 0.04) -> tuple[float, float]:
    """Return the range of all finite values, enlarged at both ends by `margin` times its length."""
    seen = [v[np.isfinite(v)] for v in values]
    low = min((v.min() for v in seen if v.size), default=-1.0)
    high = max((v.max() for v in seen if v.size), default=1.0)
    return range_around(low, high, margin)


@documented
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
    source = source if hasattr(source, "record") else as_motions(source, results=True)
    with drawn_on(ax, style, width, notes) as sheet:
        return draw_sections(sheet, source, titles, reference)


def draw_sections(
    sheet: Sheet, source: Any, titles: Sequence[str] | None = None, reference: np.ndarray | None = None
) -> Figure:
    """Draw the sections of a Results or of a list of trajectories."""
    allowed = "section points, ξ and ξ' in a row, as from motion.section"
    marks = np.empty((0, 2)) if reference is None else real_array("reference", reference, allowed)
    if marks.ndim != 2 or marks.shape[1] != 2:
        raise ValueError(bad("reference", reference, allowed))
    sections, circled, named, shared, further = (_of_results if hasattr(source, "axes") else _of_motions)(source, marks)
    asked, count = titles is not None, len(sections)
    titles = named if titles is None else check_titles(titles, count)
    cols = count if sheet.given else {1: 1, 2: 2, 4: 2}.get(count, 2 if sheet.narrow else 3)
    rows = math.ceil(count / cols)
    inches, height = (4.6, 3.6) if cols == 1 else (INCHES["double"], 0.6 + rows * (2.5 if cols == 2 else 2.2))
    shows = [("xi", "dxi")] * (rows * cols)
    fig, axes = sheet.new(
        rows, cols, width=inches, height=height, sharex=True, sharey=True, shows=shows, phrases=shared
    )
    flat, units = axes.ravel(), measures(source if hasattr(source, "axes") else source[0])
    for k, (section, ax) in enumerate(zip(sections, flat, strict=False)):
        points = np.unique(np.round(section[np.isfinite(section).all(axis=1)], 9), axis=0)
        dots: dict[str, Any] = {"ms": 3.5 if len(points) <= FEW else 1.2, "mew": 0, "color": sheet.look.main}
        ax.plot(points[:, 0], points[:, 1], ".", **dots, rasterized=len(points) > 5000)
        if reference is not None:
            circles = {"ms": 7, "mfc": "none", "mec": sheet.look.other, "mew": 0.6, "label": "undisturbed orbit"}
            ax.plot(*circled[k].T, "o", **circles)
        sheet.letter(ax, k if count > 1 else None, titles[k], asked)
        if not sheet.given:
            ax.margins(0.12)
            ax.tick_params(labelbottom=k >= count - cols)
        sheet.name_quantities(ax, *units)
    for ax in flat[count:]:
        ax.set_axis_off()
    sheet.note(axes[0, -1], [*shared, *further])
    return fig


_Sections = tuple[list[np.ndarray], list[np.ndarray], list[str], list[str], list[str]]
"""Sections and circles around the points of the reference, in the units of figures, titles of the panels, the
conditions common to all sections, and further phrases."""


def _of_motions(motions: Sequence[Trajectory], marks: np.ndarray) -> _Sections:
    sections = [coordinates(m, np.asarray(m.section)) for m in motions]
    circled = [coordinates(m, marks) for m in motions]
    rests = rest_phrases(*_rests(sections, [m.status for m in motions]))
    return sections, circled, [""] * len(motions), shared_by(motions, section=True), rests


def _of_results(results: Any, marks: np.ndarray) -> _Sections:
    section, status = coordinates(results, np.asarray(results.section)), np.asarray(results.status)
    circled = coordinates(results, np.broadcast_to(marks, (*status.shape, *marks.shape)))
    done, points = computed(status), list(np.ndindex(status.shape))
    shown = some(points)
    titles = [place_of(results, dict(zip(results.axes, index, strict=True))) for index in shown]
    sections = [np.where(done[index], section[index], np.nan) for index in shown]
    rests = rest_phrases(*_rests(sections, [status[index] for index in shown]))
    further = [*choice(len(shown), len(points), "points"), *rests, *status_phrases(status)]
    return sections, [circled[index] for index in shown], titles, conditions_of(results), further


def _rests(sections: Sequence[np.ndarray], status: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ' of all section points, and the status of the motion of each."""
    return np.concatenate([s[:, 1] for s in sections]), np.repeat(status, [len(s) for s in sections])


def check_titles(titles: Sequence[str], panels: int) -> Sequence[str]:
    """Return the titles. Raises ValueError if there is not one for each panel."""
    if np.ndim(titles) != 1 or len(titles) != panels:
        raise ValueError(bad("titles", titles, f"a list of {panels}, one for each panel"))
    return titles


def as_motions(source: Any, results: bool = False) -> list[Trajectory]:
    """Return one trajectory or a sequence of trajectories as a list; without their scenes unless all have one."""
    motions = as_list("source", source, "arguments", f"{'Results, ' * results}a Trajectory, or a sequence of them")
    alike = all(m.scene is not None for m in motions)
    return [m if alike or m.scene is None else m.dimensionless() for m in motions]
