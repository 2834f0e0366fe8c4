"""Fig. 1: mass, vibrating incline and obstacle. Fig. 2: states and transitions, from a table.

Tests compare the table with the decisions of the kernels.
"""

import math
from collections.abc import Collection
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, Circle, Polygon, Rectangle

from vibrodrive import State
from vibrodrive.figures import sheet as sheets

TRANSITIONS = (
    # state, switching function, decision, next state
    (State.UP, "S3", "H < -1", State.DOWN),
    (State.UP, "S3", "|H| <= 1", State.STICK),
    (State.DOWN, "S1", "", State.IMPACT),
    (State.DOWN, "S2", "H > 1", State.UP),
    (State.DOWN, "S2", "|H| <= 1", State.STICK),
    (State.STICK, "S4", "H = 1", State.UP),
    (State.STICK, "S4", "H = -1", State.DOWN),
    (State.REST, "S5", "", State.UP),
    (State.IMPACT, "", "H > 1", State.UP),
    (State.IMPACT, "", "H <= 1", State.REST),
)
"""The arrows of Fig. 2. In kernels/switch.py, `terminating_function` implements the second column and `decide` the last
two columns. tests/kernels/test_scheme.py compares both functions with this table."""

INK = "black"
SIZE = 9.5  # of the letters, in points
Place = tuple[float, float]

# Fig. 1, from the description in §2. Positions are (s, n) with s up the incline and n normal to the incline.

ALPHA = 16.0
HEIGHT = 1.3
INCLINE, THICKNESS = (0.0, 10.4), 0.35
OBSTACLE = (0.5, 1.1)
MASS = (5.2, 7.2)
ROLLERS, RADIUS = (1.4, 5.0, 8.8), 0.16
GROUND = -THICKNESS - 2.0 * RADIUS
CORNER = (-0.9, GROUND)


def drawing(sheet: sheets.Sheet) -> Figure:
    """Draw mass, incline and obstacle. x, y, ξ' and F_H are positive in the direction of their arrows."""
    fig, axes = sheet.new(height=2.8)
    ax = axes[0, 0]
    ax.set_axis_off()
    ax.set_aspect("equal")
    ax.set_xlim(-0.8, 11.2)
    ax.set_ylim(-1.1, 4.3)
    _ground(ax)
    x, y = _turned(CORNER)
    reach, half = 4.2, math.radians(0.5 * ALPHA)
    ax.plot([x, x + 1.2 * reach], [y, y], color=INK, lw=0.5)
    ax.add_patch(Arc((x, y), 2 * reach, 2 * reach, theta1=0.0, theta2=ALPHA, lw=0.5, ec=INK))
    ax.text(x + 0.92 * reach * math.cos(half), y + 0.8 * reach * math.sin(half), r"$\alpha$", ha="center", va="center")
    _block(ax, INCLINE, (-THICKNESS, 0.0), fc="white")
    _block(ax, OBSTACLE, (0.0, HEIGHT), fc="0.8", hatch="/////")
    _block(ax, MASS, (0.0, HEIGHT), fc="0.93")
    _write(ax, (0.5 * (OBSTACLE[0] + OBSTACLE[1]), HEIGHT + 0.3), "obstacle")
    _arrow(ax, _turned((OBSTACLE[1], 1.0)), _turned((MASS[0], 1.0)), 0.8)
    _write(ax, (0.5 * (OBSTACLE[1] + MASS[0]), 1.27), r"gap $x$  ($\xi$)")
    _mass(ax)
    _arrow(ax, _turned((8.0, 0.75)), _turned((10.4, 0.75)), 1.6, "<|-|>")
    _write(ax, (9.2, 1.05), r"$y = a_0 \sin\,\Omega_0 t$")
    _write(ax, (10.65, 0.75), "+", rotation=0.0)
    return fig


def _turned(place: Place) -> tuple[float, float]:
    """Return the coordinates of (s, n) on the page."""
    c, s = math.cos(math.radians(ALPHA)), math.sin(math.radians(ALPHA))
    return place[0] * c - place[1] * s, place[0] * s + place[1] * c


def _block(ax: Axes, along: Place, across: Place, **look: Any) -> None:
    corners = [(along[0], across[0]), (along[1], across[0]), (along[1], across[1]), (along[0], across[1])]
    ax.add_patch(Polygon([_turned(corner) for corner in corners], ec=INK, lw=0.8, **look))


def _line(ax: Axes, start: Place, end: Place, width: float = 0.5) -> None:
    (x0, y0), (x1, y1) = _turned(start), _turned(end)
    ax.plot([x0, x1], [y0, y1], color=INK, lw=width)


def _arrow(ax: Axes, start: Place, end: Place, width: float, ends: str = "-|>", head: float = 10, **look: Any) -> None:
    """Draw an arrow from `start` to `end`, in coordinates of the page. `head` is the size of its head."""
    drawn = {"arrowstyle": ends, "lw": width, "color": INK, "shrinkA": 0, "shrinkB": 0, "mutation_scale": head}
    ax.annotate("", end, start, arrowprops=drawn | look)


def _write(ax: Axes, place: Place, text: str, rotation: float = ALPHA) -> None:
    ax.text(*_turned(place), text, ha="center", va="center", rotation=rotation, fontsize=SIZE)


def _ground(ax: Axes) -> None:
    """Draw the ground and the rollers on it."""
    start, end = CORNER[0], INCLINE[1] + 0.6
    _line(ax, (start, GROUND), (end, GROUND), 0.8)
    for k in range(3, round((end - start) / 0.25)):
        s = start + 0.25 * k
        _line(ax, (s + 0.2, GROUND), (s, GROUND - 0.2), 0.4)
    for s in ROLLERS:
        ax.add_patch(Circle(_turned((s, -THICKNESS - RADIUS)), RADIUS, fc="white", ec=INK, lw=0.8))


def _mass(ax: Axes) -> None:
    """Draw the mass, its weight, the friction on it, and the direction of ξ' > 0."""
    x, y = _turned((0.5 * (MASS[0] + MASS[1]), 0.5 * HEIGHT))
    ax.plot([x], [y], "o", ms=2.5, color=INK)
    _arrow(ax, (x, y), (x, y - 2.3), 0.8)
    ax.text(x + 0.12, y - 2.2, r"$mg$", ha="left", va="center")
    _write(ax, (MASS[1] - 0.45, 0.8), r"$m$", rotation=0.0)
    _write(ax, (MASS[1] + 0.72, 0.24), r"friction $\mu$")
    _arrow(ax, _turned((MASS[0], 0.09)), _turned((MASS[0] - 2.2, 0.09)), 1.6)
    _write(ax, (MASS[0] - 1.75, 0.47), r"adhesive force $F_H$  ($H$)")
    _arrow(ax, _turned((MASS[0] + 0.3, HEIGHT + 0.2)), _turned((MASS[1] - 0.3, HEIGHT + 0.2)), 0.8)
    _write(ax, (0.5 * (MASS[0] + MASS[1]), HEIGHT + 0.45), r"$\xi\mathrm{′} > 0$")


# Fig. 2

BOXES = {
    State.UP: ((0.0, 2.0), "sliding up\n" + r"$\xi\mathrm{′} > 0$"),
    State.STICK: ((5.0, 2.0), "sticking\n" + r"$\xi\mathrm{′} = 0,\ \xi > 0$"),
    State.DOWN: ((5.0, 0.0), "sliding down\n" + r"$\xi\mathrm{′} < 0$"),
    State.IMPACT: ((2.5, 0.0), "impact\n" + r"$\xi = 0$"),
    State.REST: ((0.0, 0.0), "resting\nat the obstacle"),
}

HALF = (0.62, 0.3)  # half the width and half the height of a box
THICK = 2.2
SHIFT = 0.13  # shift of each arrow of a pair in opposite directions

SLANTING: dict[tuple[State, State], tuple[Place, Place]] = {
    (State.UP, State.DOWN): ((0.62, 1.76), (4.38, 0.275)),
    (State.DOWN, State.UP): ((4.38, 0.06), (0.34, 1.7)),
    (State.IMPACT, State.UP): ((2.2, 0.3), (0.17, 1.7)),
}


def scheme(sheet: sheets.Sheet, path: Collection[tuple[int, int]], named: str) -> Figure:
    """Draw the five states and the transitions between them, with thick arrows for the transitions in `path`.

    path : pairs (before, after) of the transitions of a motion; `named` is their label in the legend.
    """
    fig, axes = sheet.new(height=3.4)
    ax = axes[0, 0]
    ax.set_axis_off()
    ax.set_xlim(-0.75, 6.3)
    ax.set_ylim(-0.42, 2.42)
    for centre, name in BOXES.values():
        ax.text(
            *centre, name, ha="center", va="center", fontsize=SIZE, linespacing=1.35,
            bbox={"boxstyle": "square,pad=0", "fc": "none", "ec": "none"},
        )  # fmt: skip
        corner = centre[0] - HALF[0], centre[1] - HALF[1]
        ax.add_patch(Rectangle(corner, 2 * HALF[0], 2 * HALF[1], fill=False, lw=0.8, ec=INK))
    both = {(before, after) for before, _, _, after in TRANSITIONS}
    for before, function, decision, after in TRANSITIONS:
        paired, thick = (after, before) in both, (before, after) in path
        drawn: dict[str, Any] = (
            {"width": THICK, "head": 12, "color": sheet.look.main} if thick else {"width": 0.8, "head": 9}
        )
        _arrow(ax, *_ends(before, after, paired), **drawn)
        _label(ax, before, after, paired, function, decision)
    sheet.keys += [Line2D([], [], color=sheet.look.main, lw=THICK, label=named)] if path else []
    return fig


def _ends(before: State, after: State, paired: bool) -> tuple[Place, Place]:
    """Return the ends of an arrow between two boxes. An arrow of a pair is shifted to the left of its direction."""
    if (before, after) in SLANTING:
        return SLANTING[before, after]
    (x0, y0), (x1, y1) = BOXES[before][0], BOXES[after][0]
    right, up = np.sign(x1 - x0), np.sign(y1 - y0)
    ox, oy = (-SHIFT * up, SHIFT * right) if paired else (0.0, 0.0)
    dx, dy = HALF[0] * right, HALF[1] * up
    return (x0 + dx + ox, y0 + dy + oy), (x1 - dx + ox, y1 - dy + oy)


def _label(ax: Axes, before: State, after: State, paired: bool, function: str, decision: str) -> None:
    """Write the switching condition and the decision beside an arrow."""
    (x0, y0), (x1, y1) = _ends(before, after, paired)
    parts = [f"S_{function[1]} = 0"] if function else []
    parts += [decision.replace("<=", r"\leq")] if decision else []
    text = ", ".join(f"${part}$" for part in parts)
    where: dict[str, Any] = {"fontsize": 0.9 * SIZE}
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    if abs(x1 - x0) < 1e-9:
        right = paired and y1 < y0
        ax.text(x + (0.1 if right else -0.1), y, text, ha="left" if right else "right", va="center", **where)
    elif abs(y1 - y0) < 1e-9:
        above = not paired or x1 > x0
        ax.text(x, y + (0.07 if above else -0.07), text, ha="center", va="bottom" if above else "top", **where)
    else:
        right = x1 > x0
        x, y = x0 + 0.3 * (x1 - x0), y0 + 0.3 * (y1 - y0)  # near the state that ends
        aside, up = (0.06, 0.02) if right else (-0.06, -0.02)
        ax.text(x + aside, y + up, text, ha="left" if right else "right", va="bottom" if right else "top", **where)
