"""Fig. 1: mass, vibrating incline and obstacle, drawn from the description in §2 of the paper.

Positions are (s, n) with s up the incline and n normal to the incline.
"""

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Polygon

from vibrodrive.figures.looks import INK
from vibrodrive.figures.style import in_drawings, new, styled

Place = tuple[float, float]

ALPHA = 16.0
HEIGHT = 1.3
INCLINE, THICKNESS = (0.0, 10.4), 0.35
OBSTACLE = (0.5, 1.1)
MASS = (5.2, 7.2)
ROLLERS, RADIUS = (1.4, 5.0, 8.8), 0.16
GROUND = -THICKNESS - 2.0 * RADIUS
CORNER = (-0.9, GROUND)


@styled
def drawing() -> Figure:
    """Draw mass, incline and obstacle. x, y, ξ' and F_H are positive in the direction of their arrows."""
    fig, axes = new(1, 1, height=2.8)
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


def _arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float], width: float, ends: str = "-|>") -> None:
    """Draw an arrow from `start` to `end`, in coordinates of the page."""
    look = {"arrowstyle": ends, "lw": width, "color": INK, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 10}
    ax.annotate("", end, start, arrowprops=look)


def _write(ax: Axes, place: Place, text: str, rotation: float = ALPHA) -> None:
    ax.text(*_turned(place), text, ha="center", va="center", rotation=rotation, fontsize=in_drawings())


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
