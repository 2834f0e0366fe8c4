"""Fig. 2: the scheme of states, drawn from the table of transitions that the kernels follow."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from vibrodrive.figures.style import INK, new, styled
from vibrodrive.model.states import TRANSITIONS, State

BOXES = {
    State.UP: ((0.0, 2.0), "sliding up\n" + r"$\xi\mathrm{′} > 0$"),
    State.STICK: ((5.0, 2.0), "sticking\n" + r"$\xi\mathrm{′} = 0,\ \xi > 0$"),
    State.DOWN: ((5.0, 0.0), "sliding down\n" + r"$\xi\mathrm{′} < 0$"),
    State.IMPACT: ((2.5, 0.0), "impact\n" + r"$\xi = 0$"),
    State.REST: ((0.0, 0.0), "interruption\n" + r"at the obstacle"),
}
"""Where each state stands, and what it is called. The simplest solution runs round the outside."""

HALF = (0.62, 0.3)
"""Half the width and height of a box."""

Point = tuple[float, float]

SHIFT = 0.13
"""Arrows that go both ways run this far beside each other."""


@styled
def scheme(path: Collection[tuple[State, State]]) -> Figure:
    """The five states and the changes between them; those in `path` (before, after) are thick."""
    fig, axes = new(1, 1, height=3.1)
    ax = axes[0, 0]
    ax.set_axis_off()
    ax.set_xlim(-0.75, 6.3)
    ax.set_ylim(-0.42, 2.42)
    for centre, name in BOXES.values():
        ax.text(
            *centre, name, ha="center", va="center", fontsize=9.5, linespacing=1.35,
            bbox={"boxstyle": "square,pad=0", "fc": "none", "ec": "none"},
        )  # fmt: skip
        ax.add_patch(_box(centre))
    both = {(before, after) for before, _, _, after in TRANSITIONS}
    for before, function, decision, after in TRANSITIONS:
        _arrow(ax, before, after, (after, before) in both, (before, after) in path)
        _label(ax, before, after, (after, before) in both, function, decision)
    return fig


def _box(centre: Point) -> Rectangle:
    return Rectangle((centre[0] - HALF[0], centre[1] - HALF[1]), 2 * HALF[0], 2 * HALF[1], fill=False, lw=0.8, ec=INK)


def _ends(before: State, after: State, paired: bool) -> tuple[Point, Point]:
    """Where an arrow leaves one box and enters the other; one of a pair runs to the left of its direction."""
    (x0, y0), (x1, y1) = BOXES[before][0], BOXES[after][0]
    dx, dy = x1 - x0, y1 - y0
    length = math.hypot(dx, dy)
    ox, oy = (-SHIFT * dy / length, SHIFT * dx / length) if paired else (0.0, 0.0)
    start, end = _rim(ox, oy, dx, dy), _rim(ox, oy, -dx, -dy)
    return (x0 + start[0], y0 + start[1]), (x1 + end[0], y1 + end[1])


def _rim(ox: float, oy: float, dx: float, dy: float) -> Point:
    """Where a ray from (ox, oy) inside a box leaves it, relative to its centre."""
    steps = [(math.copysign(h, d) - o) / d for h, d, o in ((HALF[0], dx, ox), (HALF[1], dy, oy)) if d]
    return ox + min(steps) * dx, oy + min(steps) * dy


def _arrow(ax: Axes, before: State, after: State, paired: bool, thick: bool) -> None:
    start, end = _ends(before, after, paired)
    style = {"arrowstyle": "-|>", "lw": 2.2 if thick else 0.8, "color": INK, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", end, start, arrowprops=style | {"mutation_scale": 12 if thick else 9})


def _label(ax: Axes, before: State, after: State, paired: bool, function: str, decision: str) -> None:
    """The switching condition and the decision: beside an upright or level arrow, on a slanting one."""
    (x0, y0), (x1, y1) = _ends(before, after, paired)
    text = ", ".join(part for part in (_condition(function), _decision(decision)) if part)
    where: dict[str, Any] = {"fontsize": 8.5}
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    if abs(x1 - x0) < 1e-9:
        right = paired and y1 < y0
        ax.text(x + (0.1 if right else -0.1), y, text, ha="left" if right else "right", va="center", **where)
    elif abs(y1 - y0) < 1e-9:
        above = not paired or x1 > x0
        ax.text(x, y + (0.07 if above else -0.07), text, ha="center", va="bottom" if above else "top", **where)
    else:
        paper = {"fc": "white", "ec": "none", "pad": 1.5}
        x, y = x0 + 0.36 * (x1 - x0), y0 + 0.36 * (y1 - y0)
        ax.text(x, y, text, ha="center", va="center", bbox=paper, **where)


def _condition(function: str) -> str:
    return f"$S_{function[1]} = 0$" if function else ""


def _decision(decision: str) -> str:
    if not decision:
        return ""
    return "$" + decision.replace("<=", r"\leq") + "$"
