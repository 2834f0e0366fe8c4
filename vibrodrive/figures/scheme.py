"""Fig. 2: states and transitions, drawn from the table of transitions that the kernels use."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from vibrodrive.figures.looks import INK
from vibrodrive.figures.style import explain, in_drawings, look, new, styled
from vibrodrive.model.drawing import Style, Width
from vibrodrive.model.states import TRANSITIONS, State

BOXES = {
    State.UP: ((0.0, 2.0), "sliding up\n" + r"$\xi\mathrm{′} > 0$"),
    State.STICK: ((5.0, 2.0), "sticking\n" + r"$\xi\mathrm{′} = 0,\ \xi > 0$"),
    State.DOWN: ((5.0, 0.0), "sliding down\n" + r"$\xi\mathrm{′} < 0$"),
    State.IMPACT: ((2.5, 0.0), "impact\n" + r"$\xi = 0$"),
    State.REST: ((0.0, 0.0), "interruption\n" + r"at the obstacle"),
}

HALF = (0.62, 0.3)  # half the width and half the height of a box
THICK = 2.2
SHIFT = 0.13  # shift of each arrow of a pair in opposite directions
Point = tuple[float, float]

SLANTING: dict[tuple[State, State], tuple[Point, Point]] = {
    (State.UP, State.DOWN): ((0.62, 1.76), (4.38, 0.275)),
    (State.DOWN, State.UP): ((4.38, 0.06), (0.34, 1.7)),
    (State.IMPACT, State.UP): ((2.2, 0.3), (0.17, 1.7)),
}


@styled
def scheme(
    path: Collection[tuple[State, State]],
    named: str = "path of a motion",
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
) -> Figure:
    """Draw the five states and the transitions between them. Transitions that occur in a motion have thick arrows.

    Parameters
    ----------
    path : collection of (before, after)
        transitions of the motion, as pairs of `State`.
    named : str
        label of these transitions in the legend.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> switches = vd.simulate(1.5, transient=10, periods=1).switches
    >>> path = set(zip(switches["before"].tolist(), switches["after"].tolist()))
    >>> figure = vd.plot.scheme(path, "A = 1.5")
    >>> len(path)
    5
    """
    fig, axes = new(1, 1, height=3.4)
    ax = axes[0, 0]
    ax.set_axis_off()
    ax.set_xlim(-0.75, 6.3)
    ax.set_ylim(-0.42, 2.42)
    for centre, name in BOXES.values():
        ax.text(
            *centre, name, ha="center", va="center", fontsize=in_drawings(), linespacing=1.35,
            bbox={"boxstyle": "square,pad=0", "fc": "none", "ec": "none"},
        )  # fmt: skip
        corner = centre[0] - HALF[0], centre[1] - HALF[1]
        ax.add_patch(Rectangle(corner, 2 * HALF[0], 2 * HALF[1], fill=False, lw=0.8, ec=INK))
    both = {(before, after) for before, _, _, after in TRANSITIONS}
    for before, function, decision, after in TRANSITIONS:
        _arrow(ax, before, after, (after, before) in both, (before, after) in path)
        _label(ax, before, after, (after, before) in both, function, decision)
    explain(fig, [Line2D([], [], color=look().main, lw=THICK, label=named)] if path else [])
    return fig


def _ends(before: State, after: State, paired: bool) -> tuple[Point, Point]:
    """Return the ends of an arrow between two boxes. An arrow of a pair is shifted to the left of its direction."""
    if (before, after) in SLANTING:
        return SLANTING[before, after]
    (x0, y0), (x1, y1) = BOXES[before][0], BOXES[after][0]
    right, up = np.sign(x1 - x0), np.sign(y1 - y0)
    ox, oy = (-SHIFT * up, SHIFT * right) if paired else (0.0, 0.0)
    dx, dy = HALF[0] * right, HALF[1] * up
    return (x0 + dx + ox, y0 + dy + oy), (x1 - dx + ox, y1 - dy + oy)


def _arrow(ax: Axes, before: State, after: State, paired: bool, thick: bool) -> None:
    start, end = _ends(before, after, paired)
    width, colour = (THICK, look().main) if thick else (0.8, INK)
    style = {"arrowstyle": "-|>", "lw": width, "color": colour, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", end, start, arrowprops=style | {"mutation_scale": 12 if thick else 9})


def _label(ax: Axes, before: State, after: State, paired: bool, function: str, decision: str) -> None:
    """Write the switching condition and the decision on a slanting arrow, or beside an arrow that is not slanting."""
    (x0, y0), (x1, y1) = _ends(before, after, paired)
    parts = [f"S_{function[1]} = 0"] if function else []
    parts += [decision.replace("<=", r"\leq")] if decision else []
    text = ", ".join(f"${part}$" for part in parts)
    where: dict[str, Any] = {"fontsize": 0.9 * in_drawings()}
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
        slope = math.degrees(math.atan((y1 - y0) / (x1 - x0)))
        turned: dict[str, Any] = {"rotation": slope, "rotation_mode": "anchor", "transform_rotates_text": True}
        ax.text(x, y, text, ha="center", va="center", bbox=paper, **where, **turned)
