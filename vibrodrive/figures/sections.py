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

from vibrodrive.figures.image import density
from vibrodrive.figures.ink import FAINTEST
from vibrodrive.figures.plane import NUMBERED, draw_lines, read_lines, upright
from vibrodrive.figures.sheet import Sheet, documented, drawn_on
from vibrodrive.figures.style import INCHES
from vibrodrive.figures.texts import (
    as_shown,
    choice,
    computed,
    conditions,
    of_sweep,
    place_of,
    rest_phrases,
    shared_by,
    some,
    status_phrases,
    symbol,
)
from vibrodrive.model.choices import Status
from vibrodrive.model.drawing import Style, Width, check_range
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.plan import POINT
from vibrodrive.model.quantities import SECTIONS, row_of
from vibrodrive.model.records import IMPACTS

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
    with drawn_on(ax, style, width, notes, cmap) as sheet:
        fig, axes = sheet.new(len(rows), 1, shows=[(x, quantity)] * len(rows), said=shared, **grid)
        grey = False
        for k, (index, ax) in enumerate(zip(rows, axes[:, 0], strict=True)):
            inks = density(
                ax, values, np.where(done[index][:, None], section[index], np.nan), reach, sheet.look.density
            )
            if limits is not None:
                ax.set_ylim(limits)
            mark_statuses(sheet, ax, values, status[index])
            sheet.name(ax, x, None)
            sheet.name_quantities(ax, results, None, quantity)
            at = dict(zip(rest, index, strict=True))
            draw_lines(sheet, ax, upright(marked, results, x, at, ax.get_ylim()) if marked else ())
            if len(rows) > 1:
                sheet.letter(ax, k, place_of(results, at))
            chosen = choice(len(rows), len(panels), "values of " + ", ".join(map(symbol, rest)))
            rests = rest_phrases(section[index], status[index]) if quantity == "dxi" else []
            keys = [f"{_brighter(sheet.look.density)}: more values"] * (inks and not grey)
            keys += [NUMBERED] * (k == 0 and len(marked) > 0)
            grey = grey or inks
            sheet.note(ax, [*([] if k else [*shared, *chosen]), *rests, *status_phrases(status[index]), *keys])
        sheet.explain(fig)
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


def _brighter(cmap: Colormap) -> str:
    """Return how the colours of full ink differ from those of the least ink: "darker" or "lighter"."""
    luminance = cmap([FAINTEST, 1.0]) @ (0.2126, 0.7152, 0.0722, 0.0) + 1.0 - cmap([FAINTEST, 1.0])[:, 3]
    return "darker" if luminance[1] < luminance[0] else "lighter"


def mark_statuses(sheet: Sheet, ax: Axes, x: np.ndarray, status: np.ndarray) -> None:
    """Draw a mark at the upper edge of the panel at each `x` (n,) whose status is a key of MARKS."""
    for value, marker in MARKS.items():
        there = x[status == value]
        if len(there):
            height = np.full(len(there), 0.975)
            colour = sheet.look.support if value == Status.NEVER_LEAVES else sheet.look.other
            mark: dict[str, Any] = {"ms": 4, "mew": 0.6, "color": colour, "mfc": "none", "label": value.words}
            ax.plot(there, height, marker, transform=ax.get_xaxis_transform(), **mark)


def full_range(values: Sequence[np.ndarray], margin: float = 0.04) -> tuple[float, float]:
    """Return the range of all finite values, enlarged at both ends by `margin` times its length."""
    seen = [v[np.isfinite(v)] for v in values]
    low = min((v.min() for v in seen if v.size), default=-1.0)
    high = max((v.max() for v in seen if v.size), default=1.0)
    room = margin * (high - low) or 0.5
    return low - room, high + room


def quantity_index(quantity: str) -> int:
    """Return the column of a quantity in the section, 0 for ξ and 1 for ξ'. Raises ValueError for another quantity."""
    if quantity not in COORDINATES:
        raise ValueError(bad("quantity", quantity, "one of " + ", ".join(COORDINATES)))
    return COORDINATES.index(quantity)


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
    sections, circled, named, shared, more = _sections(source, reference)
    alike = source if hasattr(source, "axes") else as_motions(source)[0]
    asked = titles is not None
    titles = named if titles is None else check_titles(titles, len(sections))
    with drawn_on(ax, style, width, notes) as sheet:
        cols = {1: 1, 2: 2, 4: 2}.get(len(sections), 2 if sheet.narrow else 3)
        cols = len(sections) if sheet.given else cols
        rows = math.ceil(len(sections) / cols)
        inches, height = (4.6, 3.6) if cols == 1 else (INCHES["double"], 0.6 + rows * (2.5 if cols == 2 else 2.2))
        shows = [("xi", "dxi")] * (rows * cols)
        fig, axes = sheet.new(
            rows, cols, width=inches, height=height, sharex=True, sharey=True, shows=shows, said=shared
        )
        flat = axes.ravel()
        for k, (section, ax) in enumerate(zip(sections, flat, strict=False)):
            points = np.unique(np.round(section[np.isfinite(section).all(axis=1)], 9), axis=0)
            size = 3.5 if len(points) <= FEW else 1.2
            ax.plot(
                points[:, 0], points[:, 1], ".", ms=size, mew=0, color=sheet.look.main, rasterized=len(points) > 5000
            )
            if reference is not None:
                circles = {"ms": 7, "mfc": "none", "mec": sheet.look.other, "mew": 0.6, "label": "undisturbed orbit"}
                ax.plot(*circled[k].T, "o", **circles)
            sheet.letter(ax, k if len(sections) > 1 else None, titles[k], asked)
            if not sheet.given:
                ax.margins(0.12)
                ax.tick_params(labelbottom=k >= len(sections) - cols)
            sheet.name_quantities(ax, alike, "xi", "dxi")
        for ax in flat[len(sections) :]:
            ax.set_axis_off()
        sheet.note(axes[0, -1], [*shared, *more])
        sheet.explain(fig)
        return fig


def _sections(
    source: Any, reference: np.ndarray | None
) -> tuple[list[np.ndarray], list[np.ndarray], list[str], list[str], list[str]]:
    """Return the sections and the reference of each, in the units of figures, their titles, the conditions common to
    all sections, and further phrases."""
    marks = np.empty((0, 2)) if reference is None else np.asarray(reference)
    if not hasattr(source, "axes"):
        motions = as_motions(source)
        sections = [coordinates(m, np.asarray(m.section)) for m in motions]
        circled = [coordinates(m, marks) for m in motions]
        rests = _rests(sections, [m.status for m in motions])
        return sections, circled, [""] * len(motions), shared_by(motions, section=True), rests
    section, done = coordinates(source, np.asarray(source.section)), computed(source.status)
    around = coordinates(source, np.broadcast_to(marks, (*done.shape, *marks.shape)))
    points = list(np.ndindex(section.shape[:-2]))
    shown = some(points)
    titles = [place_of(source, dict(zip(source.axes, index, strict=True))) for index in shown]
    status = np.asarray(source.status)
    sections = [np.where(done[index], section[index], np.nan) for index in shown]
    rests = _rests(sections, [status[index] for index in shown])
    more = [*choice(len(shown), len(points), "points"), *rests, *status_phrases(status)]
    return sections, [around[index] for index in shown], titles, conditions(of_sweep(source), source.axes), more


def _rests(sections: Sequence[np.ndarray], status: Sequence[Any]) -> list[str]:
    """Return the phrase for the share of section points at which the mass rests."""
    return rest_phrases(np.concatenate([s[:, 1] for s in sections]), np.repeat(status, [len(s) for s in sections]))


def check_titles(titles: Sequence[str], panels: int) -> Sequence[str]:
    """Return the titles. Raises ValueError if there is not one for each panel."""
    if isinstance(titles, str) or len(titles) != panels:
        raise ValueError(bad("titles", titles, f"a list of {panels}, one for each panel"))
    return titles


def as_motions(source: Any) -> list[Trajectory]:
    """Return one trajectory or a sequence of trajectories as a list; without their scenes unless all have one."""
    motions = [source] if hasattr(source, "sample") else list(source)
    alike = all(m.scene is not None for m in motions)
    return [m if alike or m.scene is None else m.dimensionless() for m in motions]
