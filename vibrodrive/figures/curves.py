"""Phase curves and time curves of trajectories, computed from the closed form, with every switch as a point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from vibrodrive.figures.sections import COORDINATES, as_motions, check_titles, coordinates, measures
from vibrodrive.figures.sheet import Sheet, drawn_on
from vibrodrive.figures.texts import shared_by
from vibrodrive.model.figure import CURVES, Style, Width, check_curves, documented
from vibrodrive.model.parameters import bad, check_count
from vibrodrive.model.states import State

if TYPE_CHECKING:
    from vibrodrive.batch.trajectory import Trajectory

OVER_TIME = ("time", "velocity")

LINE, CYCLE = 40, 160
"""A motion is drawn as a line if its record has at most LINE periods, or at most CYCLE different switches because the
motion repeats. The periods of any other motion are faint lines, so that a place is darker if more of them pass it."""

POINTS = 400  # samples per excitation period
FIRST = 10  # periods that a time curve shows by default
FAINT = 0.1  # least opacity of the line of one period of an irregular motion
FAST = 10  # points per period of the disturbance; fewer points would miss its maxima
JUMP = "jump of $\\xi\\mathrm{′}$"


class Curve(NamedTuple):
    """Samples of a motion, float64 (n,) each, with NaN at its jumps. `jumps`, float64 (m, 2, 3), contains τ, ξ, ξ'
    before and after each jump."""

    tau: np.ndarray
    xi: np.ndarray
    dxi: np.ndarray
    jumps: np.ndarray


def curve(trajectory: Trajectory, points_per_period: int = POINTS) -> Curve:
    """Return samples of a trajectory together with its switches, so that the corners of the curve are exact.

    At an impact ξ' jumps to 0. The method "fixed" finds a switch late. Then the coordinate that is 0 at the exact
    switch, ξ or ξ', has another value and jumps to 0.
    """
    sample = trajectory.sample(points_per_period)
    switches = trajectory.switches
    tau = 2 * math.pi * switches["period"] + switches["phase"]
    landed = np.isin(switches["after"], (State.IMPACT, State.REST))
    before = np.stack([tau, switches["xi"], switches["dxi"]], axis=1)
    after = np.stack([tau, np.where(landed, 0.0, switches["xi"]), np.zeros(tau.size)], axis=1)
    jumped = np.abs(before - after).max(axis=1) > 1e-9
    gap = np.stack([np.where(jumped, tau, np.inf), *np.full((2, tau.size), np.nan)], axis=1)
    corners = np.stack([before, gap, after], axis=1).reshape(-1, 3)
    corners = corners[np.isfinite(corners[:, 0])]
    rows = np.concatenate([corners, np.stack([sample.tau, sample.xi, sample.dxi], axis=1)])
    rows = rows[np.argsort(rows[:, 0], kind="stable")]  # a sample at the time of a switch follows the switch
    jumps = np.stack([before, after], axis=1)[jumped]
    return Curve(rows[:, 0], rows[:, 1], rows[:, 2], jumps)


@documented
def phase_curve(
    source: Any,
    titles: Sequence[str] | None = None,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw phase curves ξ' over ξ, with one panel for each trajectory and the same ranges in all panels.

    A place of an irregular motion is the darker, the more periods pass it. Jumps of the velocity are dotted grey lines.

    Parameters
    ----------
    source : Trajectory or sequence of trajectories
        from `simulate`.
    titles : sequence of str, optional
        titles of the panels, one for each trajectory.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> motions = [vd.simulate(1.5, eps=eps, transient=10, periods=2) for eps in (0.0, 5e-4)]
    >>> figure = vd.plot.phase_curve(motions, titles=["undisturbed", "disturbed"])
    >>> len(figure.axes)
    2
    """
    motions = as_motions(source)
    alone = len(motions) == 1
    with drawn_on(ax, style, width, notes) as sheet:
        rows, cols = (len(motions), 1) if sheet.narrow else (1, len(motions))
        height = 3.2 if alone else 3.4 * rows if sheet.narrow else 2.9
        options: dict[str, Any] = {"width": 5.0} if alone else {}
        if titles is not None:
            check_titles(titles, len(motions))
        shared = shared_by(motions)
        grid: dict[str, Any] = {"height": height, "sharex": True, "sharey": True, **options}
        fig, axes = sheet.new(rows, cols, shows=[("xi", "dxi")] * len(motions), phrases=shared, **grid)
        for k, (motion, ax) in enumerate(zip(motions, axes.ravel(), strict=True)):
            draw_phase(sheet, ax, motion)
            sheet.letter(ax, None if alone else k, titles[k] if titles else "", asked=titles is not None)
        sheet.note(axes[0, -1], shared)
        return fig


def draw_phase(sheet: Sheet, ax: Axes, motion: Trajectory) -> None:
    """Draw one phase curve."""
    switches = np.stack([motion.switches[name] for name in ("phase", "xi", "dxi")], axis=1)
    different = len(np.unique(np.round(switches, 6), axis=0))
    many = len(motion.section) > LINE and different > CYCLE
    if many:
        fast = round(FAST * motion.arguments["eta"]) if motion.arguments["eps"] > 0.0 else 0
        drawn = _shown(motion, curve(motion, max(POINTS, fast)))
        period = np.floor((drawn.tau - drawn.tau[0]) / (2.0 * math.pi) + 1e-9)
        lines = np.split(np.stack([drawn.xi, drawn.dxi], axis=1), np.flatnonzero(np.diff(period)) + 1)
        faint = max(FAINT, len(lines) ** -0.5)
        ax.add_collection(
            LineCollection(lines, color=sheet.look.main, alpha=faint, lw=0.4, zorder=0.4, rasterized=True)
        )
        ax.autoscale_view()
    else:
        drawn = _shown(motion, first(curve(motion), max(1, different)))
        ax.plot(drawn.xi, drawn.dxi, color=sheet.look.main)
    thin: dict[str, Any] = {"color": sheet.look.support, "lw": 0.25 if many else 0.7, "ls": ":", "zorder": 0.5}
    x, v = measures(motion)
    ax.plot(*_joined(drawn.jumps[:, :, 1:]), **thin, label=v.words(JUMP))
    ax.axhline(0.0, color=sheet.look.support, lw=0.4, zorder=0.5)
    sheet.name_quantities(ax, x, v)


def _shown(motion: Trajectory, drawn: Curve) -> Curve:
    """Return ξ and ξ' of a curve in the units of figures."""
    x, v = (unit.shown_of(1.0) for unit in measures(motion))
    return Curve(drawn.tau, drawn.xi * x, drawn.dxi * v, drawn.jumps * (1.0, x, v))


def first(drawn: Curve, periods: int) -> Curve:
    """Return the first `periods` periods of a curve."""
    end = drawn.tau[0] + 2 * math.pi * periods + 1e-9
    inside = drawn.tau <= end
    return Curve(drawn.tau[inside], drawn.xi[inside], drawn.dxi[inside], drawn.jumps[drawn.jumps[:, 0, 0] <= end])


def draw_time(sheet: Sheet, ax: Axes, motion: Trajectory, quantity: str, shown: int | None) -> None:
    """Draw ξ or ξ' over τ, and sin τ, with τ counted in excitation periods or, with a scene, over the time in ms.

    Only the first `shown` periods are drawn, or all periods if `shown` is None.
    """
    column = 1 + COORDINATES.index(quantity)
    drawn = _shown(motion, curve(motion))
    drawn = drawn if shown is None else first(drawn, shown)
    low, high = drawn.tau[[0, -1]]
    clock = motion.measure("tau")
    begin, unit = (0.0, 1.0) if clock.si == "1" else (low, clock.shown_of(1.0))
    ax.plot((drawn.tau - begin) * unit, drawn[column], color=sheet.look.main)
    across, up = _joined(drawn.jumps[:, :, [0, column]])
    ax.plot((across - begin) * unit, up, color=sheet.look.main, lw=0.5)
    fine = np.linspace(low, high, max(2, round((high - low) * 30)))
    name, height = r"$\sin\tau$", 1.0
    if clock.si != "1":
        name, height = "excitation, not to scale", np.nanmax(np.abs(drawn[column]))
    ax.plot((fine - begin) * unit, height * np.sin(fine), color=sheet.look.support, lw=0.7, zorder=0, label=name)
    ax.axhline(0.0, color=sheet.look.support, lw=0.4, zorder=0)
    if clock.si == "1":
        periods_ticks(sheet, ax, low, high)
    else:
        ax.set_xlim(0.0, (high - low) * unit)
        ax.set_xlabel(clock.label("time") + " from the beginning of the record")
    sheet.name_quantities(ax, None, motion.measure(quantity))


def trajectory_figure(
    trajectory: Trajectory,
    curves: Sequence[str] = ("phase", "time"),
    shown: int | None = FIRST,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw one motion, with one panel for each of `curves`. `Trajectory.plot` describes the arguments."""
    check_curves("curves", curves)
    if shown is not None:
        check_count("shown", shown, 1)
    if shown not in (None, FIRST) and not set(OVER_TIME) & set(curves):
        raise ValueError(bad("shown", shown, "left out, because no curve over time is drawn"))
    tall = [1.5 if name in ("phase", "section") else 1.0 for name in curves]
    common = shared_by([trajectory], section="section" in curves)
    shows = [CURVES[name] for name in curves]
    with drawn_on(ax, style, width, notes) as sheet:
        fig, axes = sheet.new(
            len(curves), 1, height=0.5 + 2.2 * sum(tall), height_ratios=tall, shows=shows, phrases=common
        )
        periods = len(trajectory.section)
        for k, (name, ax) in enumerate(zip(curves, axes[:, 0], strict=True)):
            if len(curves) > 1:
                sheet.letter(ax, k)
            if name == "phase":
                draw_phase(sheet, ax, trajectory)
            elif name == "section":
                ax.plot(*coordinates(trajectory, trajectory.section).T, ".", ms=2, mew=0, color=sheet.look.main)
                sheet.name_quantities(ax, *measures(trajectory))
            else:
                quantity = "xi" if name == "time" else "dxi"
                draw_time(sheet, ax, trajectory, quantity, shown)
            shared = [] if k else common
            if name in OVER_TIME and shown is not None and shown < periods:
                shared = [*shared, f"first {shown} of {periods} periods shown"]
            sheet.note(ax, shared)
        return fig


def _joined(pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (abscissae, ordinates) of n segments (n, 2, 2) as one line, broken by NaN between the segments."""
    broken = np.concatenate([pairs, np.full((len(pairs), 1, 2), np.nan)], axis=1).reshape(-1, 2)
    return broken[:, 0], broken[:, 1]


def periods_ticks(sheet: Sheet, ax: Axes, low: float, high: float) -> None:
    """Set a τ axis from `low` to `high`, with ticks that count excitation periods 2π from the first period shown."""
    own_axes = not sheet.given
    if not own_axes:
        low, high = ax.dataLim.intervalx  # of all motions in the user's axes, whose first periods may differ
    first = math.floor(low / (2 * math.pi) + 1e-9)
    count = max(1, round((high - low) / (2 * math.pi)))
    origin = first if own_axes else 0
    round_numbers = MaxNLocator(nbins=12 if own_axes and not sheet.narrow else 6, steps=[1, 2, 5, 10], integer=True)
    shown = np.asarray(round_numbers.tick_values(first - origin, first - origin + count))
    shown = shown[(shown >= first - origin) & (shown <= first - origin + count)]
    ax.set_xticks((origin + shown) * 2 * math.pi, [f"{k:.0f}" for k in shown])
    if own_axes:
        ax.set_xlim(low, high)
    start = rf" - {origin}" if origin else ""
    sheet.label(ax, rf"$\tau/2\pi{start}$", None)
