"""Bifurcations as curves in the plane (A, B): on their own, or over a map that is drawn there already."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path as LinePath
from matplotlib.transforms import Bbox

from vibrodrive.figures.looks import INK
from vibrodrive.figures.style import explain, look, name_axes, new, note, styled
from vibrodrive.model.bifurcations import BIFURCATIONS
from vibrodrive.model.drawing import Style, Width

if TYPE_CHECKING:
    from vibrodrive.periodic.curves import Curve

HALO = 0.7
NUMBERED = "numbers on curves: period of the orbit"

PLACES = (0.62, 0.5, 0.74, 0.38, 0.86)


class Line(NamedTuple):
    """A curve of bifurcations as points of a plane (points,), whatever its axes are."""

    kind: str
    period: int
    across: np.ndarray
    up: np.ndarray


@styled
def draw_lines(ax: Axes, lines: Sequence[Line]) -> None:
    """Draw curves into a plane whose limits are set, over whatever is there, with the period of its orbit on each."""
    named: set[str] = set()
    limits = ax.get_xlim(), ax.get_ylim()
    for k, line in enumerate(lines):
        kind = BIFURCATIONS[line.kind]
        colour = kind.colour if look().coloured else kind.ink
        # the halos of all lie below the lines of all
        halo: dict[str, Any] = {"lw": kind.width + 2 * HALO, "color": "white", "alpha": 0.7, "solid_capstyle": "butt"}
        ax.plot(line.across, line.up, "-", zorder=4, **halo)
        shown = line.kind not in named and _in_view(ax, line)
        style: dict[str, Any] = {"ls": kind.dashes, "lw": kind.width, "color": colour}
        ax.plot(line.across, line.up, **style, zorder=5, label=kind.label if shown else "_")
        if shown:
            named.add(line.kind)
        ax.set(xlim=limits[0], ylim=limits[1])
        if line.kind != "onset":
            points = np.column_stack([line.across, line.up])
            _write_period(ax, line.period, points, PLACES[k % len(PLACES)], colour)


def _in_view(ax: Axes, line: Line) -> bool:
    """Whether any part of a curve lies within the limits of the axes."""
    points = ax.transScale.transform(np.column_stack([line.across, line.up]))
    view = ax.transScale.transform(np.transpose((ax.get_xlim(), ax.get_ylim())))
    return len(points) > 0 and LinePath(points).intersects_bbox(Bbox(view), filled=False)


def _write_period(ax: Axes, period: int, points: np.ndarray, share: float, color: str) -> None:
    """The period, at a share of the length of the curve (points, 2) as it is seen."""
    low, high = np.transpose((ax.get_xlim(), ax.get_ylim()))
    seen = points[((points >= low) & (points <= high)).all(axis=1)]
    if len(seen) < 2:
        return
    way = np.append(0.0, np.cumsum(np.hypot(*np.diff(ax.transData.transform(seen), axis=0).T)))
    left, up = (float(np.interp(share * way[-1], way, column)) for column in seen.T)
    box = {"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none"}
    ax.text(left, up, str(period), color=color, fontsize=7, ha="center", va="center", zorder=6, bbox=box)


@styled
def curves_figure(
    curves: Sequence[Curve],
    A: tuple[float, float],
    B: tuple[float, float],
    max_period: int,
    meets: Sequence[tuple[float, float]] = (),
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
) -> Figure:
    """Curves in the plane (A, B), each with the period of its orbit; the points where two meet are marked.

    Parameters
    ----------
    curves : sequence of Curve
        as from `vd.curves`.
    A, B : (float, float)
        ranges shown.
    max_period : int
        longest period that was sought, for the note.
    meets : sequence of (A, B)
        points where curves meet.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> ranges = {"A": (2.5, 2.7), "B": (0.09, 0.11), "max_period": 1}
    >>> figure = vd.plot.curves(vd.curves(**ranges, num=2), **ranges)
    >>> figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()
    ('$A$', '$B$')
    """
    fig, axes = new(1, 1, height=4.6)
    ax = axes[0, 0]
    ax.set(xlim=A, ylim=B)
    draw_lines(ax, [Line(c.kind, c.period, c.A, c.B) for c in curves])
    if meets:
        ax.plot(*zip(*meets, strict=True), "o", ms=3.5, mfc="white", mec=INK, mew=0.8, zorder=7, label="curves meet")
    name_axes(ax, "A", "B")
    note(ax, f"{NUMBERED}, up to {max_period}")
    explain(fig)
    return fig
