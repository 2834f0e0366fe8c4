"""Maps: a quantity of every motion of a sweep, as a colour in the plane of two axes; over one axis, as marks.

Every cell is a number into a table of colours, for classes (periods, gaps, statuses) as for continuous quantities:
what lies outside the scale (a motion that rests, one without this quantity) has a colour of its own, and a point that
is not computed has none, so that the hatched ground shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm, Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from vibrodrive.figures.bifurcation import SHARED, conditions, is_geometric
from vibrodrive.figures.plane import draw_curves
from vibrodrive.figures.style import equation, name_axes, new, note, styled
from vibrodrive.model.drawing import IMPACT_POWER, MAP, choose_drawing
from vibrodrive.model.parameters import Status, bad
from vibrodrive.model.physical import Physical, power
from vibrodrive.model.records import SUMMARIES
from vibrodrive.model.states import State

PALETTE = (
    "#eff427",
    "#16e9ea",
    "#fca579",
    "#ac92fa",
    "#e76317",
    "#06846c",
    "#6042da",
    "#7c3502",
    "#5b057a",
    "#1f1f1f",
)
"""Of classes. Each is darker than the one before by about a tenth of the way from white to black, so that their order
survives a copy in grey; and they stay apart for the colour-blind."""

CLASSES = 8
"""So many periods, cycles of gaps or sequences have a colour of their own; OTHER and NONE are the last two."""

OTHER, NONE = PALETTE[CLASSES:]

APART = "white"
"""What rests for ever, or is exactly 0 where the scale is logarithmic: lighter than all of PALETTE and the scale."""

RESTS = "#e8c95a"
"""What rests, on the diverging scale, whose middle is white."""

LACKING = "#d0d0d0"
"""A point that is computed, and has no such value."""

SHADES = 512
"""Steps of a continuous scale."""

DECADES = 2.0
"""A positive quantity that spans more is drawn over its logarithm."""

PLAIN_STATES = 12
"""The number of a sequence is resolved into so many states at most; longer ones are known by their number."""

STATUSES = {
    Status.OK: ("ok", "#f2f2f2"),
    Status.NEVER_LEAVES: ("never leaves", PALETTE[1]),
    Status.TOO_CLOSE: ("too close", PALETTE[4]),
    Status.BUDGET: ("out of budget", PALETTE[8]),
}
"""Name and colour of each status of a point that is computed."""

LABELS = {
    "status": "status",
    "margin": "how close the closest decision came",
    IMPACT_POWER: "power of the impacts in W",
    **{q.name: q.meaning.split(";")[0].split(", 0:")[0] for q in SUMMARIES},
    "gaps": "whole periods between main impacts",
    "sequence": "cycle of states: Up, Down, Stick, Rest, Impact",
    "period": "period of the motion",
    "energy": r"energy of the impacts $\sum\xi\mathrm{′}^2/2$ a period",
    "momentum": r"momentum of the impacts $\sum|\xi\mathrm{′}|$ a period",
    "lyapunov": "Lyapunov exponent a period",
}
"""What a colour bar, or the ordinate over one axis, says."""

WIDTH = 4.7
"""Width of a map in inches: scaled to one column of a page, its letters are still read."""

LINE = 62
"""Letters in a line of the note above a map."""


class Painted(NamedTuple):
    """Colours of `cells`: numbers into `colours` (n, 4), masked where nothing is computed.

    Of classes, `labels` names the first colours; of a continuous quantity `labels` is empty and `norm` says where each
    of the first SHADES lies. `apart` has names and colours of what is outside the scale.
    """

    cells: np.ma.MaskedArray
    colours: np.ndarray
    labels: tuple[str, ...]
    norm: Normalize
    apart: tuple[tuple[str, str], ...]


@styled
def map_figure(
    results: Any,
    quantity: str = "period",
    x: str | None = None,
    y: str | None = None,
    curves: Sequence[Any] | None = None,
    limits: tuple[float, float] | None = None,
) -> Figure:
    """Map of a quantity over two axes of a sweep; over its only axis, its values.

    Parameters
    ----------
    results : Results
        at least one axis. Of more than two the longest ones are drawn; the others stand at their first value, which
        is named.
    quantity : str
        one of a summary, or "status", "margin"; "impact_power" for `energy` in W, where a scene with a mass is known.
    x, y : str, optional
        the axes drawn to the right and upwards; of the two longest ones the first and the second unless given.
    curves : sequence, optional
        of `vd.curves`, drawn over a map of A and B.
    limits : (float, float), optional
        range of the colours of a continuous quantity; all values unless given.

    Raises
    ------
    ValueError
        for an unknown quantity or axis, for what was not recorded, and where there is no axis.
    """
    _, quantity = choose_drawing(results, MAP, quantity)
    names = list(results.axes)
    x, y = _plane(results.axes, x, y)
    index = tuple(slice(None) if n in (x, y) else 0 for n in names)
    status = np.asarray(results.status)[index]
    painted = _paint(quantity, _values(results, quantity)[index], status, limits)
    fig, axes = new(1, 1, width=WIDTH, height=3.7)
    ax = axes[0, 0]
    if y is None:
        _draw_line(ax, painted, results.axes[x], quantity)
        name_axes(ax, x, None)
    else:
        turned = names.index(x) < names.index(y)
        _draw_cells(ax, painted, results.axes[x], results.axes[y], turned)
        name_axes(ax, x, y)
        _add_bar(fig, ax, painted, quantity)
    _say(ax, results, (x, y), quantity, status)
    if curves and {x, y} != {"A", "B"}:
        raise ValueError(bad("curves", f"{len(curves)} curves", f"left out: they are of A and B, and this is {x}, {y}"))
    if curves:
        draw_curves(ax, curves, x=x, legend=False)
    _add_legend(fig, painted, cells=y is not None)
    return fig


def _plane(axes: dict[str, np.ndarray], x: str | None, y: str | None) -> tuple[str, str | None]:
    """The names of the axes drawn to the right and upwards. Raises ValueError."""
    names = list(axes)
    for key, name in (("x", x), ("y", y)):
        if name is not None and name not in names:
            raise ValueError(bad(key, name, "one of the axes " + ", ".join(names)))
    if x is not None and x == y:
        raise ValueError(bad("y", y, f"another axis than x = {x!r}"))
    free = sorted((n for n in names if n not in (x, y)), key=lambda n: -len(axes[n]))
    needed = free[: min(2, len(names)) - (x is not None) - (y is not None)]
    rest = [n for n in names if n in needed]  # in the order of the sweep
    if x is None:
        x = rest.pop(0) if rest else y
    if y is None and rest:
        y = rest.pop(0)
    assert x is not None
    return x, None if x == y else y


def _values(results: Any, quantity: str) -> np.ndarray:
    """The quantity over all axes: float64, NaN where there is none; int64 of gaps and sequences, -1 there."""
    if quantity == IMPACT_POWER:
        names = list(results.axes)
        along = np.meshgrid(*results.axes.values(), indexing="ij", sparse=True)
        known = {"g": Physical.g, **results.scalars, **dict(zip(names, along, strict=True))}
        shape = tuple(len(a) for a in results.axes.values())
        scene = (np.broadcast_to(known[n], shape).ravel() for n in ("omega0", "mu", "alpha", "mass", "g"))
        return power(np.asarray(results.energy, float).ravel(), *scene).reshape(shape)
    values = np.asarray(getattr(results, quantity))
    return values.astype(np.int64) if values.dtype.kind == "i" else values.astype(float)


def _paint(quantity: str, values: np.ndarray, status: np.ndarray, limits: tuple[float, float] | None) -> Painted:
    """Colours of the values of all points."""
    done = status != Status.NOT_COMPUTED
    if quantity in _CLASSIFY:
        if limits is not None:
            raise ValueError(bad("limits", limits, f"left out: {quantity} has classes, no range"))
        kind, labels, colours = _CLASSIFY[quantity](values, done)
        norm: Normalize = BoundaryNorm(np.arange(len(labels) + 1) - 0.5, len(labels))
        apart: list[tuple[str, str]] = []
        rests = status == Status.NEVER_LEAVES
        if quantity != "status" and rests.any():  # the period of a rest is 1, but it is no such motion
            apart.append(("rests", APART))
            kind = np.where(rests, len(colours), kind)
            colours = [*colours, to_rgba(APART)]
    else:
        kind, norm, shades, apart = _shade(quantity, np.where(done, values, np.nan), limits)
        labels, colours = [], [*shades, *(to_rgba(colour) for _, colour in apart)]
    lacking = done & (kind < 0)
    if lacking.any():
        apart.append(("no such value", LACKING))
        kind = np.where(lacking, len(colours), kind)
        colours = [*colours, to_rgba(LACKING)]
    table = np.array([to_rgba(c) for c in colours])
    return Painted(np.ma.masked_array(kind, ~done), table, tuple(labels), norm, tuple(apart))


Classes = tuple[np.ndarray, list[str], list[Any]]
"""Number of the class of each point (-1: none), names and colours of the classes."""


def _periods(values: np.ndarray, done: np.ndarray) -> Classes:
    kind = np.where(values < 1, np.where(values == 0, CLASSES + 1, -1), np.minimum(values - 1, CLASSES))
    return kind, [*map(str, range(1, CLASSES + 1)), "more", "none"], list(PALETTE)


def _cycles(values: np.ndarray, done: np.ndarray, name: Any) -> Classes:
    """The most frequent values, the largest area first, and all the others; 0 is none."""
    found, counts = np.unique(values[done & (values > 0)], return_counts=True)
    order = np.argsort(-counts, kind="stable")[:CLASSES]
    shown = found[order]
    place = np.full(len(found), len(shown))
    place[order] = np.arange(len(shown))
    labels, colours = [name(v) for v in shown.tolist()], list(PALETTE[: len(shown)])
    if len(found) > len(shown):
        labels.append("other")
        colours.append(OTHER)
    kind = np.full(values.shape, -1)
    some = values > 0
    kind[some & done] = place[np.searchsorted(found, values[some & done])]
    kind[values == 0] = len(labels)
    return kind, [*labels, "none"], [*colours, NONE]


def _statuses(values: np.ndarray, done: np.ndarray) -> Classes:
    kind = np.full(values.shape, -1)
    for k, status in enumerate(STATUSES):
        kind[values == status] = k
    return kind, [label for label, _ in STATUSES.values()], [colour for _, colour in STATUSES.values()]


def digits(number: int) -> str:
    """A number of gaps as a cycle: 122 -> "1, 2, 2"."""
    return ", ".join(str(number))


def states(number: int) -> str:
    """A number of a sequence as the first letters of its states: 53 -> "UDI"; its own digits where it is a long one."""
    found: list[int] = []
    left = number
    while left and len(found) <= PLAIN_STATES:
        left, state = divmod(left, 6)
        found.append(state - 1)
    if left or -1 in found:
        return str(number)
    return "".join(State(s).name[0] for s in found[::-1])


_CLASSIFY: dict[str, Any] = {
    "period": _periods,
    "gaps": lambda values, done: _cycles(values, done, digits),
    "sequence": lambda values, done: _cycles(values, done, states),
    "status": _statuses,
}


def _shade(
    quantity: str, values: np.ndarray, limits: tuple[float, float] | None
) -> tuple[np.ndarray, Normalize, np.ndarray, list[tuple[str, str]]]:
    """Number of the shade of each value (SHADES: set apart, -1: none), the scale, its shades, and what is set apart."""
    finite = values[np.isfinite(values)]
    positive = finite[finite > 0]
    name, shades, colour, outside = "", "cividis", APART, values == -np.inf
    if quantity == "lyapunov":
        name, shades, colour = "rests", "RdBu_r", RESTS
        most = float(np.abs(finite).max(initial=0.0)) or 1.0
        norm = Normalize(*(limits or (-most, most)))
    elif positive.size and finite.min() >= 0 and np.log10(positive.max() / positive.min()) > DECADES:
        name, outside = "0", values == 0
        norm = LogNorm(*(limits if limits and limits[0] > 0 else (positive.min(), positive.max())))
    else:
        low, high = limits or (finite.min(initial=np.inf), finite.max(initial=-np.inf))
        norm = Normalize(*((low, high) if low < high else (low - 0.5, low + 0.5) if finite.size else (0.0, 1.0)))
    kind = np.full(values.shape, -1)
    inside = np.isfinite(values) & ~outside
    share = np.asarray(norm(np.clip(values[inside], norm.vmin, norm.vmax)), float)
    kind[inside] = np.minimum(share * SHADES, SHADES - 1).astype(int)
    kind[outside] = SHADES
    apart = [(name, colour)] if outside.any() else []
    return kind, norm, mpl.colormaps[shades](np.linspace(0, 1, SHADES)), apart


def edges(values: np.ndarray) -> np.ndarray:
    """Borders of the cells of ascending values (n,): n + 1 of them, half-way between values as the axis is drawn."""
    u = np.log10(values) if is_geometric(values) else values
    if u[-1] == u[0]:
        return np.linspace(u[0] - 0.5, u[0] + 0.5, len(u) + 1)
    inner = (u[1:] + u[:-1]) / 2
    borders = np.concatenate([[u[0] - (inner[0] - u[0])], inner, [u[-1] + (u[-1] - inner[-1])]])
    return 10.0**borders if is_geometric(values) else borders


def _draw_cells(ax: Axes, painted: Painted, x: np.ndarray, y: np.ndarray, turned: bool) -> None:
    across, up = np.argsort(x, kind="stable"), np.argsort(y, kind="stable")
    index = (painted.cells.T if turned else painted.cells)[up][:, across]
    ax.patch.set(facecolor="white", edgecolor="0.6", hatch="//////", linewidth=0)
    ax.pcolormesh(
        edges(x[across]),
        edges(y[up]),
        index,
        cmap=ListedColormap(painted.colours),
        vmin=-0.5,
        vmax=len(painted.colours) - 0.5,
        rasterized=True,
    )
    for values, axis in ((x[across], "x"), (y[up], "y")):
        if is_geometric(values):
            ax.set(**{f"{axis}scale": "log"})
        ax.set(**{f"{axis}lim": edges(values)[[0, -1]]})
    ax.tick_params(which="both", direction="out", top=False, right=False)  # on colours, ticks inside are not seen


def _draw_line(ax: Axes, painted: Painted, x: np.ndarray, quantity: str) -> None:
    """Marks over the only axis: classes on rungs, a continuous quantity on its scale."""
    order = np.argsort(x, kind="stable")
    kind, n = painted.cells[order], len(painted.labels)
    if n:
        ax.plot(x[order], np.ma.masked_where(kind >= n, kind), ".", ms=3, mew=0)
        ax.set_yticks(range(n), painted.labels)
        ax.set_ylim(-0.5, n - 0.5)
    else:
        level = painted.norm.inverse((np.ma.masked_where(kind >= SHADES, kind) + 0.5) / SHADES)
        ax.plot(x[order], level, ".", ms=3, mew=0)
        ax.set_yscale("log" if isinstance(painted.norm, LogNorm) else "linear")
    if is_geometric(x[order]):
        ax.set_xscale("log")
    ax.set_ylabel(LABELS[quantity])


def _add_bar(fig: Figure, ax: Axes, painted: Painted, quantity: str) -> None:
    shown = painted.colours[: len(painted.labels) or SHADES]
    bar = fig.colorbar(ScalarMappable(painted.norm, ListedColormap(shown)), ax=ax)
    bar.set_label(LABELS[quantity], size=10)
    if painted.labels:
        bar.set_ticks(range(len(painted.labels)), labels=painted.labels)
        small = max(map(len, painted.labels)) > 12
        bar.ax.tick_params(which="both", length=0, labelsize=7 if small else 9)


def _say(ax: Axes, results: Any, drawn: tuple[str | None, ...], quantity: str, status: np.ndarray) -> None:
    """What holds for all points, and how many are not as the others."""
    names = ["A", *SHARED, *(["mass"] if quantity == IMPACT_POWER else [])]
    if "eps" in results.axes or results.scalars.get("eps", 0.0) > 0:
        names.append("eta")
    fixed = [n for n in results.axes if n not in drawn]
    said = [equation(n, results.axes[n][0]) + _of(len(results.axes[n])) for n in fixed]
    lines = [*said, *conditions(results, results.axes, names).split(", ")]
    counts = {"not computed": int((status == Status.NOT_COMPUTED).sum())}
    if quantity != "status":
        counts |= {name: int((status == s).sum()) for s, (name, _) in STATUSES.items() if s != Status.OK}
    told = [f"{name}: {count}" for name, count in counts.items() if count]
    if told:
        told[0] = f"of {status.size} points {told[0]}"
    note(ax, "\n".join(_wrapped(part) for part in (lines, told) if part))


def _of(count: int) -> str:
    return f" (first of {count})" if count > 1 else ""


def _wrapped(parts: Sequence[str]) -> str:
    """Parts of a sentence in lines of about LINE letters; the marks of mathtext are no letters."""
    lines, length = [""], 0
    for part in parts:
        letters = sum(c not in r"$\{}" for c in part)
        if lines[-1] and length + letters > LINE:
            lines[-1] += ","
            lines.append(part)
            length = letters
        else:
            lines[-1] += f", {part}" if lines[-1] else part
            length += letters + 2
    return "\n".join(lines)


def _add_legend(fig: Figure, painted: Painted, cells: bool) -> None:
    """Below the figure: the curves drawn over it, and what is set apart."""
    handles: list[Any] = [line for ax in fig.axes for line in ax.lines if not str(line.get_label()).startswith("_")]
    if cells:
        handles += [Patch(fc=colour, ec="0.4", lw=0.5, label=name) for name, colour in painted.apart]
        if np.ma.getmaskarray(painted.cells).any():
            handles.append(Patch(fc="white", ec="0.6", hatch="//////", lw=0, label="not computed"))
    if handles:
        fig.legend(handles=handles, loc="outside lower center", ncols=min(3, len(handles)))
