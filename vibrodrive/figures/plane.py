"""Lines over a map: exact bifurcations, joined at neighbouring values of B, and the limit k₂."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path as LinePath
from matplotlib.transforms import Bbox

from vibrodrive.figures.bifurcations import BIFURCATIONS, BifurcationKind
from vibrodrive.figures.looks import INK
from vibrodrive.figures.sheet import Sheet, drawn_on
from vibrodrive.figures.texts import as_shown, conditions
from vibrodrive.model import records
from vibrodrive.model.names import SCENE
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import AMPLITUDES, INCLINES, amplitude_axis, incline_axis, with_A_and_B
from vibrodrive.model.results import Results
from vibrodrive.model.variables import POINT
from vibrodrive.store.tables import ENDING, read_table

if TYPE_CHECKING:
    from vibrodrive.model.plan import Plan
    from vibrodrive.periodic.bifurcations import Bifurcation

LIMIT = BifurcationKind("limit $k_2$: the least disturbance that breaks the structure", "", "-", 1.4, INK, INK)
HALO = 0.7
NUMBERED = "numbers on lines: period of the orbit"
PLACES = (0.62, 0.5, 0.74, 0.38, 0.86)  # shares of the visible length of a curve at which its period is written
POINTS = 400
SAME = 1e-12  # largest relative difference of two parameters that count as equal
STEEPEST = 16.0  # largest change of A, in units of the change of B, between joined bifurcations


class Exact(NamedTuple):
    """One exact bifurcation: its kind, the period and the number of impacts of its orbit, and its A and B."""

    kind: str
    period: int
    impacts: int
    A: float
    B: float

    @classmethod
    def of(cls, bifurcation: Bifurcation) -> Exact:
        return cls(bifurcation.kind, bifurcation.orbit.period, bifurcation.orbit.impacts, bifurcation.A, bifurcation.B)


OVER = (
    'limits (record = "limit" over one axis), bifurcations, a file of either (.h5; .csv, a table of `vibrodrive orbits '
    "CONFIG -o FILE.csv`), this table of pandas, or a list of these"
)


def read_lines(over: Any) -> list[Any]:
    """Return the limits (Results) and bifurcations (Exact) to be drawn over a map. Raises ValueError with one sentence
    for anything else than OVER."""
    if over is None or (isinstance(over, list | tuple) and not isinstance(over, Exact)):
        return [line for item in over or () for line in read_lines(item)]
    if isinstance(over, str | os.PathLike):
        from vibrodrive.store.load import check_path, load  # needs HDF5

        path = check_path(over)
        items: Any = read_table(path) if path.suffix.lower() == ENDING else [load(path)]
        over = str(path)
    else:
        items = over.to_dict("records") if hasattr(over, "to_dict") else [over]
    try:
        return [line for item in items for line in _line(item)]
    except (AttributeError, KeyError, TypeError, ValueError):
        raise ValueError(bad("over", over, OVER)) from None


def _line(item: Any) -> Iterator[Any]:
    if isinstance(item, Mapping):  # a row of a table, which also has the orbits
        if item["kind"] in BIFURCATIONS:
            period, impacts = int(item["period"]), int(item["impacts"])
            yield Exact(item["kind"], period, impacts, float(item["A"]), float(item["B"]))
    elif not isinstance(item, Results):
        yield item if isinstance(item, Exact) else Exact.of(item)
    elif records.LIMIT in item.record:
        yield item
    else:
        raise ValueError(item.record)


class Line(NamedTuple):
    """Bifurcations, or limits, as a line in a plane with any axes: the coordinates `across` and `up` are float64
    (points,) each. `kind` is a key of BIFURCATIONS, and `period` that of the orbit; "" and 0 for limits."""

    kind: str
    period: int
    across: np.ndarray
    up: np.ndarray


def draw_lines(sheet: Sheet, ax: Axes, lines: Sequence[Line]) -> None:
    """Draw lines over a plane whose limits are set, bifurcations with the period of their orbit."""
    labelled: set[str] = set()
    view: dict[str, Any] = {"xlim": ax.get_xlim(), "ylim": ax.get_ylim()}
    for k, line in enumerate(lines):
        kind = BIFURCATIONS.get(line.kind, LIMIT)
        colour = kind.colour if sheet.look.coloured else kind.ink
        # draw all halos first, so that no halo hides a line
        halo: dict[str, Any] = {"alpha": 0.7, "solid_capstyle": "butt"} if line.kind else {}
        ax.plot(line.across, line.up, "-", lw=kind.width + 2 * HALO, color="white", zorder=4, **halo)
        shown = line.kind not in labelled and (not line.kind or _in_view(ax, line))
        style: dict[str, Any] = {"ls": kind.dashes, "lw": kind.width, "color": colour}
        ax.plot(line.across, line.up, **style, zorder=5, label=kind.label if shown else "_")
        if shown:
            labelled.add(line.kind)
        ax.set(**view)
        if line.period and line.kind != "onset":
            points = np.column_stack([line.across, line.up])
            _write_period(ax, line.period, points, PLACES[k % len(PLACES)], colour)


def _in_view(ax: Axes, line: Line) -> bool:
    points = ax.transScale.transform(np.column_stack([line.across, line.up]))
    view = ax.transScale.transform(np.transpose((ax.get_xlim(), ax.get_ylim())))
    return len(points) > 0 and LinePath(points).intersects_bbox(Bbox(view), filled=False)


def _write_period(ax: Axes, period: int, points: np.ndarray, share: float, color: str) -> None:
    """Write the period on the curve (points, 2), at the given share of its visible length."""
    low, high = np.transpose((ax.get_xlim(), ax.get_ylim()))
    seen = points[((points >= low) & (points <= high)).all(axis=1)]
    if len(seen) < 2:
        return
    way = np.append(0.0, np.cumsum(np.hypot(*np.diff(ax.transData.transform(seen), axis=0).T)))
    left, up = (float(np.interp(share * way[-1], way, column)) for column in seen.T)
    box = {"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none"}
    ax.text(left, up, str(period), color=color, fontsize=7, ha="center", va="center", zorder=6, bbox=box)


def plane_figure(bifurcations: Sequence[Bifurcation], plan: Plan, max_period: int, **look: Any) -> Figure:
    """Draw bifurcations over the two axes of a plan as lines, each with the period of its orbit."""
    x, y = sorted(plan.axes, key=lambda name: name in INCLINES)
    lines = placed([Exact.of(b) for b in bifurcations], plan, x, y)
    with drawn_on(**look) as sheet:
        fig, axes = sheet.new(height=4.6)
        ax = axes[0, 0]
        if lines:
            across, up = (np.concatenate([line[k] for line in lines]) for k in (2, 3))
            ax.set(xlim=(across.min(), across.max()), ylim=(up.min(), up.max()))
        draw_lines(sheet, ax, lines)
        sheet.name(ax, x, y)
        machine = {name: value for name, value in plan.scalars.items() if name in SCENE}
        sheet.note(ax, [*conditions(machine, section=False), f"{NUMBERED}, up to {max_period}"])
    return fig


def placed(over: Sequence[Any], plan: Plan, x: str, y: str | None) -> list[Line]:
    """Return what is `over` a map as lines in the plane of its axes x and y, in the units of figures: bifurcations, and
    then the limits k₂ of results over one axis.

    If one axis determines B, the bifurcations at neighbouring values of B are joined. If B is constant, each
    bifurcation at this B gives one line: over the frequency Ω0, for example, a0 = const/Ω0². Raises ValueError if no
    axis of the map determines A, if there are no bifurcations at a constant B, and for limits of other axes, of another
    method or with another parameter.
    """
    exact = [item for item in over if isinstance(item, Exact)]
    lines = _placed(exact, plan, x, y) if exact else []
    return lines + [_limit(item, plan, x, y) for item in over if not isinstance(item, Exact)]


def _placed(exact: Sequence[Exact], plan: Plan, x: str, y: str | None) -> list[Line]:
    up = next((name for name in (y, x) if name in AMPLITUDES), None)
    if y is None or up is None or (POINT in (x, y) and not {*plan.together}.isdisjoint(("B", *AMPLITUDES, *SCENE))):
        axes = ", ".join(name for name in (x, y) if name)
        raise ValueError(
            f"over = bifurcations: must be left out, because A is not given by the axes of this map, {axes}"
        )
    along = x if up == y else y
    shared, values = _shared(plan, x, y), plan.axes[along]
    if along in INCLINES:
        lines = joined([b for b in exact if b.B > 0.0 or along != "mu"])  # at B = 0, μ is infinite
        places = [(line[0], *np.array([(b.A, b.B) for b in line]).T) for line in lines]
        pieces = [(b, A, incline_axis(along, B, shared)) for b, A, B in places]
    else:
        ends = np.linspace(values.min(), values.max(), POINTS)
        pieces = [(b, np.full(POINTS, b.A), ends) for b in exact if math.isclose(b.B, shared["B"], rel_tol=SAME)]
    shown = []
    for b, A, values in pieces:
        drawn = {up: as_shown(up, amplitude_axis(up, A, shared | {along: values})), along: as_shown(along, values)}
        shown.append(Line(b.kind, b.period, drawn[x], drawn[y]))
    return shown if shown or along in INCLINES else _refuse_other(shared["B"])


def upright(over: Sequence[Any], plan: Plan, x: str, index: Mapping[str, int], ends: tuple[float, float]) -> list[Line]:
    """Return the bifurcations of one panel of a diagram over the axis x as upright lines, in the units of figures.

    `index` gives the value of each other axis in the panel, `ends` are the ends of the ordinate. Raises ValueError if x
    does not determine A, or if there are no bifurcations at the B of the panel.
    """
    if any(isinstance(b, Results) for b in over):
        raise ValueError("over = limits: must be left out for a diagram, because limits are drawn over a map")
    if x not in AMPLITUDES or x not in plan.axes:
        raise ValueError(f"over = bifurcations: must be left out, because A is not given by the axis {x} alone")
    shared = _at(plan, index)
    exact, heights = [b for b in over if math.isclose(b.B, shared["B"], rel_tol=SAME)], np.linspace(*ends, POINTS)
    places = [(b, np.full(POINTS, as_shown(x, amplitude_axis(x, b.A, shared)))) for b in exact]
    return [Line(b.kind, b.period, across, heights) for b, across in places] or _refuse_other(shared["B"])


def _shared(plan: Plan, x: str, y: str | None) -> dict[str, Any]:
    """Return the parameters and scene common to all points of a map. An axis that is not drawn has its first value."""
    return _at(plan, {name: 0 for name in plan.axes if name not in (x, y)})


def _at(plan: Plan, index: Mapping[str, int]) -> dict[str, Any]:
    """Return the parameters and scene common to all points at indices of axes, with the A and B that follow."""
    values = plan.at(index).items()
    return with_A_and_B({name: float(value) for name, value in values if np.ndim(value) == 0})


def _refuse_other(B: float) -> NoReturn:
    raise ValueError(f"over = bifurcations: must contain B = {B:.17g}, the value of the figure, but do not")


def joined(bifurcations: Sequence[Exact]) -> list[list[Exact]]:
    """Join bifurcations of one kind of one orbit at neighbouring values of B to lines.

    Two bifurcations are joined if each is the nearest to the other in A, and if A changes at most STEEPEST times as
    much as B. A curve that turns in B has two branches, which end where they meet.
    """
    rows: dict[float, list[Exact]] = {}
    for b in bifurcations:
        rows.setdefault(b.B, []).append(b)
    lines: list[list[Exact]] = []
    open_lines: list[list[Exact]] = []
    for B in sorted(rows):
        going = []
        for b in rows[B]:
            alike = [line for line in open_lines if _same(line[-1], b)]
            line = min(alike, key=lambda line: abs(line[-1].A - b.A), default=[])
            if not (line and b is _nearest(line[-1], rows[B]) and abs(line[-1].A - b.A) <= STEEPEST * (B - line[-1].B)):
                line = []
                lines.append(line)
            line.append(b)
            going.append(line)
        open_lines = going
    return lines


def _nearest(last: Exact, row: Sequence[Exact]) -> Exact:
    return min((b for b in row if _same(last, b)), key=lambda b: abs(last.A - b.A))


def _same(a: Exact, b: Exact) -> bool:
    return a[:3] == b[:3]


def _limit(limits: Results, plan: Plan, x: str, y: str | None) -> Line:
    (axis,) = limits.axes if len(limits.axes) == 1 else ("",)
    disturbance = limits.plan.sought
    if y is None or {axis, disturbance} != {x, y} or limits.settings.method != plan.settings.method:
        has = f"over {', '.join(limits.axes)} in {disturbance} ({limits.settings.method_name})"
        needed = f"over one axis and in one disturbance, and these must be the axes of the map, {x} and {y}"
        raise ValueError(f"limits = {has}: must be {needed}, with the same method")
    shared = _shared(plan, x, y)
    for name, value in limits.scalars.items():
        if name in shared and name != disturbance and not np.isclose(value, shared[name], SAME, 0.0, equal_nan=True):
            raise ValueError(
                f"limits for {name} = {value:g}: must be for {name} = {shared[name]:g}, the value of the map"
            )
    k2 = np.where(np.isfinite(limits.k2) & (limits.k2 > 0), limits.k2, np.nan)
    along = as_shown(axis, limits.axes[axis])
    return Line("", 0, *((along, k2) if x == axis else (k2, along)))
