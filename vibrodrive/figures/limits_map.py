"""The limit k₂ in ε over two axes as a map."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vibrodrive.figures.colours import paint
from vibrodrive.figures.conditions import named
from vibrodrive.figures.limits import shared_by
from vibrodrive.figures.map import LABELS, apart, draw_map
from vibrodrive.figures.style import explain, note, styled
from vibrodrive.model.choices import Status
from vibrodrive.model.drawing import K2, MAP, Style, Width
from vibrodrive.model.parameters import bad
from vibrodrive.stability.limits import Limits


@styled
def limits_map(
    found: Limits,
    limits: tuple[float, float] | None = None,
    *,
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
) -> Figure:
    """Map of the limit k₂ in ε over the two axes of a file of limits, in the order of the file.

    `limits` is the range of the colours, as of `map`. Raises ValueError for one axis only, and for limits of starts.
    """
    if len(found.axes) != 2 or ("eps", "certified") not in found.curves:
        raise ValueError(bad("kind", MAP, "left out: a map is of limits in ε over two axes"))
    c = found.curves.index(("eps", "certified"))
    status = np.where(found.done[c], Status.OK, Status.NOT_COMPUTED)
    values = found.values[c]
    painted = paint(K2, values, status, limits)
    x, y = found.axes
    fig, ax = draw_map(found.axes, x, y, painted, values, named(found.quantity, LABELS[K2]))
    note(ax, shared_by(found), side="left")
    explain(fig, apart(painted))
    return fig
