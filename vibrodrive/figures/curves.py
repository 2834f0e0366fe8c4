"""Phase and time curves of trajectories, drawn from their closed form with every switch in its place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from vibrodrive.figures.bifurcation import quantity_index
from vibrodrive.figures.style import (
    GREY,
    INK,
    LINES,
    WIDTH,
    equation,
    letter,
    name_axes,
    new,
    periods_ticks,
    styled,
)
from vibrodrive.model.parameters import bad
from vibrodrive.model.states import State


class Motion(Protocol):
    """What a figure needs of a Trajectory."""

    @property
    def switches(self) -> np.ndarray: ...

    @property
    def section(self) -> np.ndarray: ...

    @property
    def arguments(self) -> dict[str, Any]: ...

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
def phase_curve(source: Any, titles: Sequence[str] | None = None) -> Figure:
    """Phase curves ξ' over ξ, a panel for each trajectory, all to one scale. Jumps are thin and grey."""
    motions = as_motions(source)
    alone = len(motions) == 1
    fig, axes = new(1, len(motions), height=3.2 if alone else 2.9, width=4.6 if alone else WIDTH,
                    sharex=True, sharey=True)  # fmt: skip
    for k, (motion, ax) in enumerate(zip(motions, axes[0], strict=True)):
        draw_phase(ax, motion)
        if not alone:
            letter(ax, k, titles[k] if titles else "")
        elif titles:
            ax.set_title(titles[0], loc="left")
        ax.label_outer()
    return fig


def draw_phase(ax: Axes, motion: Motion, points_per_period: int = 400) -> None:
    """One phase curve into given axes. Many periods on top of each other get thin lines."""
    drawn = curve(motion, points_per_period)
    many = len(motion.section) > 40
    ax.plot(drawn.xi, drawn.dxi, color=INK, lw=0.25 if many else 0.8, rasterized=many)
    ax.plot(*_joined(drawn.jumps[:, :, 1:]), color=GREY, lw=0.25 if many else 0.5, zorder=1, rasterized=many)
    ax.axhline(0.0, color=GREY, lw=0.4, zorder=0)
    name_axes(ax, "xi", "dxi")


@styled
def time_curve(
    source: Any, quantity: str = "xi", titles: Sequence[str] | None = None, excitation: bool = True
) -> Figure:
    """ξ or ξ' over τ, counted in excitation periods; several trajectories get line styles of their own.

    `excitation` adds sin τ, as the paper does. Raises ValueError for an unknown quantity.
    """
    fig, axes = new(1, 1, height=2.6)
    draw_time(axes[0, 0], as_motions(source), quantity, titles, excitation)
    return fig


def draw_time(
    ax: Axes,
    motions: Sequence[Motion],
    quantity: str = "xi",
    titles: Sequence[str] | None = None,
    excitation: bool = True,
    points_per_period: int = 400,
) -> None:
    """Time curves of one quantity into given axes."""
    column = 1 + quantity_index(quantity)
    low, high = math.inf, -math.inf
    for k, motion in enumerate(motions):
        drawn = curve(motion, points_per_period)
        low, high = min(low, drawn.tau[0]), max(high, drawn.tau[-1])
        style = LINES[k % len(LINES)]
        ax.plot(drawn.tau, drawn[column], style, label=titles[k] if titles else None)
        ax.plot(*_joined(drawn.jumps[:, :, [0, column]]), style, lw=0.5)
    if excitation:
        fine = np.linspace(low, high, max(2, round((high - low) * 30)))
        ax.plot(fine, np.sin(fine), color=GREY, lw=0.7, zorder=0, label=r"$\sin\tau$")
    ax.axhline(0.0, color=GREY, lw=0.4, zorder=0)
    periods_ticks(ax, low, high)
    name_axes(ax, None, quantity)
    if excitation or titles:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(motions) + 1, borderpad=0.2)


def time_displacement(source: Any, titles: Sequence[str] | None = None) -> Figure:
    """ξ over τ with the excitation sin τ overlaid."""
    return time_curve(source, "xi", titles)


@styled
def trajectory_figure(
    trajectory: Motion, curves: Sequence[str] = ("phase", "time"), points_per_period: int = 400
) -> Figure:
    """A row for each of `curves`: "phase" ξ'(ξ), "time" ξ(τ), "velocity" ξ'(τ), "section".

    Raises
    ------
    ValueError
        for an unknown curve.
    """
    known = ("phase", "time", "velocity", "section")
    for name in curves:
        if name not in known:
            raise ValueError(bad("curves", name, "one of " + ", ".join(known)))
    tall = [1.5 if name in ("phase", "section") else 1.0 for name in curves]
    fig, axes = new(len(curves), 1, height=2.2 * sum(tall), height_ratios=tall)
    for name, ax in zip(curves, axes[:, 0], strict=True):
        if name == "phase":
            draw_phase(ax, trajectory, points_per_period)
        elif name == "section":
            ax.plot(*np.asarray(trajectory.section).T, ".", ms=2, mew=0)
            name_axes(ax, "xi", "dxi")
        else:
            quantity = "xi" if name == "time" else "dxi"
            draw_time(ax, [trajectory], quantity, points_per_period=points_per_period)
    shown = [equation(n, trajectory.arguments[n]) for n in ("A", "B", "eps")]
    axes[0, 0].set_title(", ".join(shown), loc="left")
    return fig


def as_motions(source: Any) -> list[Motion]:
    """One trajectory or a sequence of them, as a list."""
    return [source] if hasattr(source, "sample") else list(source)


def _joined(pairs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Segments (n, 2, 2) as one broken line: abscissae and ordinates with NaN between the segments."""
    broken = np.concatenate([pairs, np.full((len(pairs), 1, 2), np.nan)], axis=1).reshape(-1, 2)
    return broken[:, 0], broken[:, 1]
