"""Phase and time curves of trajectories, drawn from their closed form with every switch in its place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrodrive.figures.bifurcation import quantity_index
from vibrodrive.figures.conditions import STATUS_WORDS, conditions
from vibrodrive.figures.passes import draw_passes, passes_key
from vibrodrive.figures.style import (
    INCHES,
    explain,
    in_given_axes,
    letter,
    look,
    name_axes,
    narrow,
    new,
    note,
    periods_ticks,
    styled,
)
from vibrodrive.model.choices import Status
from vibrodrive.model.drawing import Style, Width
from vibrodrive.model.parameters import bad
from vibrodrive.model.states import State

CURVES = ("phase", "time", "velocity", "section")

LINE = 40
"""A motion of so many periods at most is drawn as a line, a longer one as the density of its passes"""

CYCLE = 160
"""unless it repeats: of its switches no more than so many differ."""

FIRST = 10
"""Periods that a curve over time shows by default."""

FAST = 40
"""Points in each period of the disturbance: less, and its peaks are missed."""

JUMP = "jump of $\\xi\\mathrm{′}$"


class Motion(Protocol):
    """What a figure needs of a Trajectory."""

    @property
    def switches(self) -> np.ndarray: ...

    @property
    def section(self) -> np.ndarray: ...

    @property
    def arguments(self) -> dict[str, Any]: ...

    @property
    def status(self) -> int: ...

    def sample(self, points_per_period: int, /) -> Any: ...


class Curve(NamedTuple):
    """A motion as lines: NaN where it jumps; `jumps` (n, 2, 3) holds τ, ξ, ξ' before and after each jump."""

    tau: np.ndarray
    xi: np.ndarray
    dxi: np.ndarray
    jumps: np.ndarray


def curve(trajectory: Motion, points_per_period: int = 400) -> Curve:
    """Samples of a trajectory with every switch put between them, so that corners are corners.

    At an impact ξ' jumps to 0; on a fixed grid so does whatever the late switch has overshot.
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
    rows = rows[np.argsort(rows[:, 0], kind="stable")]  # a sample at the time of a switch follows it
    jumps = np.stack([before, after], axis=1)[jumped]
    return Curve(rows[:, 0], rows[:, 1], rows[:, 2], jumps)


@styled
def phase_curve(
    source: Any,
    titles: Sequence[str] | None = None,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
) -> Figure:
    """Phase curves ξ' over ξ, a panel for each trajectory, all to one scale.

    Where a motion keeps coming to other places, ink says how many of its periods pass through a spot. Jumps are thin
    and grey.

    Parameters
    ----------
    source : Trajectory or sequence of them
        of `simulate`.
    titles : sequence of str, optional
        one for each trajectory, above its panel.

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
    rows, cols = (len(motions), 1) if narrow() else (1, len(motions))
    height = 3.2 if alone else 3.4 * rows if narrow() else 2.9
    fig, axes = new(rows, cols, height=height, width=5.0 if alone else INCHES["double"], sharex=True, sharey=True)
    key: dict[str, Any] = {}
    for k, (motion, ax) in enumerate(zip(motions, axes.ravel(), strict=True)):
        key |= draw_phase(ax, motion)
        if not alone:
            letter(ax, k, titles[k] if titles else "")
        elif titles:
            ax.set_title(titles[0], loc="left")
        if not in_given_axes():
            ax.label_outer()
    note(axes[0, -1], shared_by(motions))
    explain(fig, list(key.values()))
    return fig


def draw_phase(ax: Axes, motion: Motion, points_per_period: int = 400) -> dict[str, Any]:
    """One phase curve into given axes; returns the key to its ink, by its words, empty for a line."""
    key: dict[str, Any] = {}
    switches = np.stack([motion.switches[name] for name in ("phase", "xi", "dxi")], axis=1)
    different = len(np.unique(np.round(switches, 6), axis=0))
    many = len(motion.section) > LINE and different > CYCLE
    if many:
        fast = round(FAST * motion.arguments["eta"]) if motion.arguments["eps"] > 0.0 else 0
        drawn = curve(motion, max(points_per_period, fast))
        draw_passes(ax, drawn.tau, drawn.xi, drawn.dxi)
        key = {str(handle.get_label()): handle for handle in passes_key(len(motion.section))}
    else:
        drawn = first(curve(motion, points_per_period), max(1, different))
        ax.plot(drawn.xi, drawn.dxi, color=look().main)
    ax.plot(*_joined(drawn.jumps[:, :, 1:]), color=look().support, lw=0.25 if many else 0.5, zorder=0.5, label=JUMP)
    ax.axhline(0.0, color=look().support, lw=0.4, zorder=0.5)
    name_axes(ax, "xi", "dxi")
    return key


def first(drawn: Curve, periods: int) -> Curve:
    """A curve as far as so many periods from its beginning."""
    end = drawn.tau[0] + 2 * math.pi * periods + 1e-9
    kept = drawn.tau <= end
    return Curve(drawn.tau[kept], drawn.xi[kept], drawn.dxi[kept], drawn.jumps[drawn.jumps[:, 0, 0] <= end])


@styled
def time_curve(
    source: Any,
    quantity: str = "xi",
    titles: Sequence[str] | None = None,
    excitation: bool = True,
    shown: int | None = FIRST,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
) -> Figure:
    """ξ or ξ' over τ, counted in excitation periods; several trajectories get colours and line styles of their own.

    `quantity` is "xi" or "dxi", `titles` name the trajectories in the legend, and `excitation` adds sin τ, as the paper
    does. `shown` periods are drawn from the first recorded one, all if None. Raises ValueError for an unknown quantity.
    """
    motions = as_motions(source)
    fig, axes = new(1, 1, height=2.8)
    ax = axes[0, 0]
    draw_time(ax, motions, quantity, titles, excitation, shown=shown)
    note(ax, [*shared_by(motions), *_part(motions, shown)])
    explain(fig)
    return fig


def draw_time(
    ax: Axes,
    motions: Sequence[Motion],
    quantity: str = "xi",
    titles: Sequence[str] | None = None,
    excitation: bool = True,
    points_per_period: int = 400,
    shown: int | None = None,
) -> None:
    """Time curves of one quantity into given axes."""
    column = 1 + quantity_index(quantity)
    low, high = math.inf, -math.inf
    for k, motion in enumerate(motions):
        drawn = curve(motion, points_per_period)
        if shown is not None:
            drawn = first(drawn, shown)
        low, high = min(low, drawn.tau[0]), max(high, drawn.tau[-1])
        colour, pattern = look().lines[k % len(look().lines)]
        line: dict[str, Any] = {"color": colour, "ls": pattern}
        ax.plot(drawn.tau, drawn[column], **line, label=titles[k] if titles else None)
        ax.plot(*_joined(drawn.jumps[:, :, [0, column]]), **line, lw=0.5)
    if excitation:
        fine = np.linspace(low, high, max(2, round((high - low) * 30)))
        ax.plot(fine, np.sin(fine), color=look().support, lw=0.7, zorder=0, label=r"$\sin\tau$")
    ax.axhline(0.0, color=look().support, lw=0.4, zorder=0)
    periods_ticks(ax, low, high)
    name_axes(ax, None, quantity)


@styled
def trajectory_figure(
    trajectory: Motion,
    curves: Sequence[str] = ("phase", "time"),
    points_per_period: int = 400,
    shown: int | None = FIRST,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
) -> Figure:
    """One motion as curves in rows below each other.

    `curves` has a panel each of CURVES; `shown` periods are drawn over time, all if None. Raises ValueError for an
    unknown curve.
    """
    for name in curves:
        if name not in CURVES:
            raise ValueError(bad("curves", name, "one of " + ", ".join(CURVES)))
    tall = [1.5 if name in ("phase", "section") else 1.0 for name in curves]
    fig, axes = new(len(curves), 1, height=0.5 + 2.2 * sum(tall), height_ratios=tall)
    key: dict[str, Any] = {}
    for k, (name, ax) in enumerate(zip(curves, axes[:, 0], strict=True)):
        if len(curves) > 1:
            letter(ax, k)
        if name == "phase":
            key |= draw_phase(ax, trajectory, points_per_period)
        elif name == "section":
            ax.plot(*np.asarray(trajectory.section).T, ".", ms=2, mew=0)
            name_axes(ax, "xi", "dxi")
        else:
            quantity = "xi" if name == "time" else "dxi"
            draw_time(ax, [trajectory], quantity, points_per_period=points_per_period, shown=shown)
        shared = shared_by([trajectory], section="section" in curves) if k == 0 else []
        part = _part([trajectory], shown) if name in ("time", "velocity") else []
        note(ax, [*shared, *part])
    explain(fig, list(key.values()))
    return fig


def shared_by(motions: Sequence[Motion], section: bool = False) -> list[str]:
    """What all motions have in common, and which of them did not simply go well."""
    known = motions[0].arguments
    apart = [n for n in known if any(m.arguments[n] != known[n] for m in motions)]
    common = {n: value for n, value in known.items() if n not in apart}
    statuses = [STATUS_WORDS[Status(m.status)] for m in motions if m.status != Status.OK]
    return conditions(common, apart, section=section) + list(dict.fromkeys(statuses))


def _part(motions: Sequence[Motion], shown: int | None) -> list[str]:
    """Says that there are more periods than are shown, if so."""
    most = max(len(m.section) for m in motions)
    return [f"first {shown} of {most} periods shown"] if shown is not None and shown < most else []


def as_motions(source: Any) -> list[Motion]:
    """One trajectory or a sequence of them, as a list."""
    return [source] if hasattr(source, "sample") else list(source)


def _joined(pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Segments (n, 2, 2) as one broken line: abscissae and ordinates with NaN between the segments."""
    broken = np.concatenate([pairs, np.full((len(pairs), 1, 2), np.nan)], axis=1).reshape(-1, 2)
    return broken[:, 0], broken[:, 1]
