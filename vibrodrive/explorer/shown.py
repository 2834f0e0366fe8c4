"""Picture of a view for the page and for files, with its title, its key and its status line."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vibrodrive.explorer.controls import symbol, unit
from vibrodrive.explorer.image import INKS, Key, difference, fitting_range, ink_palette, painted, pictures
from vibrodrive.explorer.view import DIFFERENCE, PICTURE_ROWS, SI, SPAN, Y_SPAN, View
from vibrodrive.explorer.work import Level
from vibrodrive.model.choices import Status
from vibrodrive.model.drawing import MAP
from vibrodrive.model.names import LOG

INK = ink_palette()
DOTS = ("#000000", "values that occur often"), ("#b3b3b3", "values that occur rarely")

STATUS_WORDS = {
    Status.TOO_CLOSE: "undecided by rounding",
    Status.BUDGET: "stopped by their budget of switches",
    Status.NEVER_LEAVES: "that rest for ever",
}


class Picture(NamedTuple):
    """Images of a view, one for each diagram, with y upwards; their common palette, place and key.

    The place is that of the lower left corner (x, y), with the width dw and the height dh, in coordinates of the axes.
    Along a logarithmic axis the coordinates are decimal logarithms. If `fit` is True, the ordinate has the range of the
    values. `odd` maps each text of STATUS_WORDS to the columns of a diagram with this status.
    """

    images: list[np.ndarray]
    palette: np.ndarray
    x: float
    dw: float
    y: float
    dh: float
    fit: bool
    key: Key
    odd: dict[str, list[int]]


def picture_of(view: View, level: Level, height: int = PICTURE_ROWS) -> Picture:
    """Return the picture of the computed part of a view. `height` is the number of rows of a diagram."""
    columns, rows = view.grid
    left, right = _edges(view, SPAN, columns)
    fit, odd = False, {}
    if view.mode == MAP:
        low, high = _edges(view, Y_SPAN, rows)
        cells, palette, key = painted(level, view.shade, view.limits)
        images = [cells]
    else:
        palette, key, low, high = INK, Key(DOTS), view.bottom, view.top
        fit = low != low
        if fit:
            low, high = fitting_range(level, view.quantity)
        images = pictures(level, view.quantity, low, high, height)
        if view.compared and view.compare == DIFFERENCE:
            images = [difference(*images)]
            names = "both methods", f"{view.method} only", "certified only"
            key = Key([(f"#{r:02x}{g:02x}{b:02x}", name) for (r, g, b), name in zip(INKS, names, strict=True)])
        status = level.sweep.results[0].status
        odd = {words: np.flatnonzero(status == s).tolist() for s, words in STATUS_WORDS.items()}
    return Picture(images, palette, left, right - left, low, high - low, fit, key, {k: v for k, v in odd.items() if v})


def counted(level: Level, odd: dict[str, list[int]]) -> str:
    """Return as HTML the number of motions, and the number of motions with each status other than OK.

    If `odd` contains the columns of such motions, their number is a button."""
    status = level.sweep.results[0].status
    counts = {words: int((status == s).sum()) for s, words in STATUS_WORDS.items()}
    said = {words: f"{count} {words}" for words, count in counts.items() if count}
    button = '<button class="odd" data-odd="{}" title="Show such a motion, or the next such motion">{}</button>'
    return ", ".join([f"{status.size} motions", *(button.format(*i) if i[0] in odd else i[1] for i in said.items())])


def title_of(view: View) -> tuple[str, str]:
    """Return (title of the picture, conditions common to all its motions)."""
    shown = symbol(view.shade if view.mode == MAP else view.quantity, si=view.scene == SI)
    over = f"{shown} over {' and '.join(map(symbol, view.axes))}"
    given = [name for name in view.machine if name != "g" or view.g != View.g] if view.scene == SI else ["A", "B"]
    given += ["eps"]
    given += ["eta"] if "eps" in view.axes or view.eps > 0.0 else []
    given += ["dtau"] if view.method != "certified" else []
    given += [name for name in ("section_phase", "xi0", "dxi0", "tau0") if getattr(view, name)]
    given = [name for name in given if name not in view.axes]
    values = [f"{symbol(name, False)} = {getattr(view, name):.6g} {unit(name)}".rstrip() for name in given]
    periods = f"periods {view.transient + 1} to {view.transient + view.periods}"
    return over, ", ".join([*values, view.method, periods])


def place(values: Any, scale: str) -> Any:
    """Return the coordinates at which values of an axis are drawn: their decimal logarithms if its scale is LOG."""
    return np.log10(values) if scale == LOG else values


def _edges(view: View, names: tuple[str, str, str], count: int) -> tuple[float, float]:
    """Return the outer edges of the first and last cell of an axis. Each value is the centre of its cell."""
    low, high, scale = (getattr(view, name) for name in names)
    first, last = float(place(low, scale)), float(place(high, scale))
    half = 0.5 * (last - first) / (count - 1)
    return first - half, last + half
