"""Figure of limits of stability over one axis, for one sweep or for several with the same axis.

The limit k₂ is the least disturbance that destroys the structure of a motion, the repeated pattern of its impacts
(stability/limit.py). k₂ in ε and k₂ in Δτ differ by decades; their velocity amplitudes V, which are k₂(ε)ηA and k₂(Δτ),
have similar sizes, so that limits of both sorts share one ordinate.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrodrive.figures.image import is_geometric, keep_range
from vibrodrive.figures.sheet import LETTER, Sheet, as_list, drawn_on, length
from vibrodrive.figures.texts import as_shown, conditions, damaged, of_sweep
from vibrodrive.model.choices import Method, Status
from vibrodrive.model.figure import Style, Width, documented
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.records import LIMIT
from vibrodrive.model.results import Results

NAMES = {"eps": r"$k_2(\varepsilon)\,\eta A$", "dtau": r"$k_2(\Delta\tau)$"}
METHODS = {
    Method.CERTIFIED: "certified", Method.FIXED: "switches on the grid", Method.MULLER: "Muller",
}  # fmt: skip
BAND = "from the first loss on, at least half of the values kept"
MISSING = (Status.NO_ORBIT, Status.TOO_SHORT, Status.BUDGET, Status.NOT_COMPUTED)
SIZE = 8  # size in points of the periods above the axes
ROWS = 4  # largest number of rows of these periods
MARKED = 60  # a curve with at most this many values has marks


@documented
def limits_figure(
    results: Results | Sequence[Results],
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw the limits k₂ over one axis as bands from the first loss to `half_kept`, as velocity amplitudes, in m/s with
    a scene.

    In the band at least half of the values around any value are kept; single values above it may be kept. A limit is
    missing where the undisturbed motion has no period, or where no value tried destroys the structure.

    Parameters
    ----------
    results : Results, or sequence of Results
        sweeps with the record "limit" over one axis, which all of them share: for example in ε, and in Δτ with the
        methods "fixed" and "muller".

    Raises
    ------
    ValueError
        for another record, for another number of axes than one, or for different axes.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> axis = {"A": [1.5, 2.0, 2.5], "record": "limit", "transient": 50, "periods": 50}
    >>> figure = vd.plot.limits([vd.sweep(**axis), vd.sweep(**axis, method="fixed")])
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
    ('$A$', 'limit as a velocity $V$')
    """
    several = as_list("results", results, "plan", "Results, or a sequence of them")
    for item in several:
        check_limits(item, several[0])
    with drawn_on(ax, style, width, notes) as sheet:
        return draw_bands(sheet, several)


def draw_bands(sheet: Sheet, several: Sequence[Results]) -> Figure:
    """Draw limits over one axis, which all results have."""
    ((x, values),) = several[0].axes.items()
    if len({results.measure("velocity").si for results in several}) > 1:
        several = [results.dimensionless() for results in several]
    unit = several[0].measure("velocity")
    fig, axes = sheet.new(height=4.2)
    ax = axes[0, 0]
    ax.set(xscale="log" if is_geometric(np.sort(values)) else "linear", yscale="log")
    order = np.argsort(values)
    along = as_shown(x, values[order])
    for number, results in enumerate(several):
        first, last = (results.measure("velocity").shown_of(values)[order] for values in _ends(results))
        name = f"{NAMES[results.plan.sought]}, {METHODS[Method(results.settings.method)]}"
        _draw(sheet, ax, along, (first, last), number, name)
    ax.margins(x=0.0)
    keep_range(ax, along)
    rows = _name_periods(ax, along, np.max([results.orbit_period for results in several], axis=0)[order])
    apart = {x, "eps", "dtau", "method"}
    common = {name: value for name, value in of_sweep(several[0]).items() if name not in apart}
    phrases = [*conditions(common, apart, section=False), _gaps(several), *damaged(*several)]
    sheet.name(ax, x, None)
    sheet.label(ax, None, unit.label("limit as a velocity $V$"))
    sheet.note(ax, phrases, above=rows)
    return fig


def check_limits(results: Results, first: Results) -> None:
    """Raise ValueError if results are not limits over one axis, or if this is not the axis of the first results."""
    if LIMIT not in results.record:
        raise ValueError(bad("record", ", ".join(results.record), f'"{LIMIT}"'))
    if len(results.axes) != 1:
        raise ValueError(bad_axes(results.axes, "one axis (limits over two axes are drawn as a map)"))
    (x,) = first.axes
    if list(results.axes) != [x] or not np.array_equal(results.axes[x], first.axes[x]):
        raise ValueError(bad_axes(results.axes, f"{x} with the same values in all results"))


def _ends(results: Results) -> list[np.ndarray]:
    """Return the first loss and `half_kept` as velocities, NaN where no limit > 0 was found."""
    with np.errstate(invalid="ignore", divide="ignore"):
        positive = np.isfinite(results.k2) & (results.k2 > 0.0)
        scale = np.where(positive, results.velocity / results.k2, np.nan)
        return [scale * results.k2, scale * np.maximum(results.k2, results.half_kept)]


def _draw(sheet: Sheet, ax: Axes, x: np.ndarray, ends: tuple[np.ndarray, np.ndarray], number: int, name: str) -> None:
    """Draw the limits of one result as a line, and the band above it."""
    (first, last), look = ends, sheet.look
    colour, pattern = look.lines[number % len(look.lines)]
    marked: dict[str, Any] = {"marker": "o", "markersize": 2.2} if len(x) <= MARKED else {}
    ax.plot(x, first, ls=pattern, color=colour, lw=0.9, label=name, **marked)
    if (last > first).any():
        ax.fill_between(x, first, last, color=look.bands[number % len(look.bands)], lw=0, label=BAND)
        ax.plot(x, last, color=colour, lw=0.25)


def _gaps(several: Sequence[Results]) -> str:
    """Return a phrase with the reasons why points are not drawn, and their numbers."""
    counts = {s.words: sum(int((results.status == s).sum()) for results in several) for s in MISSING}
    counts["no limit found"] = sum(int(np.isposinf(results.k2).sum()) for results in several)
    texts = [f"{text} ({count})" for text, count in counts.items() if count]
    return f"missing points: {', '.join(texts)}" if texts else ""


def _name_periods(ax: Axes, x: np.ndarray, n: np.ndarray) -> int:
    """Write the period n of the orbit above each range of the ascending x in which this period is constant, and return
    the number of rows that narrow ranges need. Beyond ROWS rows the periods overlap."""
    letter = LETTER * SIZE * ax.figure.dpi / 72 / ax.get_window_extent().width  # as a share of the abscissa
    share = ax.transAxes.inverted().transform(ax.get_xaxis_transform().transform([(at, 0.0) for at in x]))[:, 0]
    ends: list[float] = []  # right end of the last period in each row
    for stretch in np.split(np.arange(len(n)), np.flatnonzero(np.diff(n)) + 1):
        first, period, (low, high) = stretch[0], n[stretch[0]], share[stretch[[0, -1]]]
        if period > 0:
            text = f"$n = {period}$" if high - low > 6 * letter else str(period)
            middle, half = 0.5 * (low + high), 0.5 * letter * (length(text) + 1)
            row = next((k for k, end in enumerate(ends) if end <= middle - half), min(len(ends), ROWS - 1))
            ends[row : row + 1] = [middle + half]
            place: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "center"}
            ax.annotate(text, (middle, 1.0), (0.0, 3.0 + 1.2 * SIZE * row), fontsize=SIZE, **place)
        if first:
            ax.axvline(x[first - 1 : first + 1].mean(), color="0.75", lw=0.4, zorder=0, label="another period $n$")
    return len(ends)
