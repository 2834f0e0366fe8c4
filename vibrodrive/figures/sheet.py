"""What a figure is drawn on: a new figure in a style and a width, or the axes that the user gives as `ax`.

A drawing function has the arguments `ax`, `style`, `width` and `notes` of `drawn_on`, which makes the Sheet that it
passes to the functions that it calls.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from typing import Any, Literal, cast

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import Colormap, to_hex, to_rgba
from matplotlib.figure import Figure
from matplotlib.layout_engine import LayoutEngine
from matplotlib.lines import Line2D

from vibrodrive.figures.looks import LOOKS, ramp
from vibrodrive.figures.style import INCHES, LETTERS, ShownFigure, drawn_as, save
from vibrodrive.figures.texts import SYMBOLS, UNITS, equation, name_of, symbol
from vibrodrive.model.figure import STYLES, WIDTHS, Style, Width
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import Measure

__all__ = ["Given", "Sheet", "drawn_on", "equation", "fit_label", "in_short_lines", "save", "symbol"]

MARGIN = 0.8  # width in inches of the labels beside the axes
BESIDE = 10  # width of a line in a legend and of the space around it, in letters
NOTE = 0.8  # size of a note relative to titles
LETTER = 0.45  # mean width of a letter, in units of its size

Shows = tuple[str, str] | None
"""Names of the quantities to the right and upwards in a panel; None for a panel that cannot show several results."""


class Sheet:
    """A new figure.

    Attributes
    ----------
    look : colours (looks.py).
    narrow : True for one column, where panels are below each other instead of side by side.
    given : True for axes of the user (Given).
    keys : entries of the legend in addition to those of the labels.
    """

    given = False
    fig: Figure | None = None

    def __init__(self, style: Style | None, width: Width | None, notes: bool | None, cmap: Any) -> None:
        self.style: Style = style or "screen"
        self.width: Width = width or "double"
        self.notes = notes is not False
        self.look = LOOKS[self.style].with_map(cmap)
        self.narrow = width == "single"
        self.keys: list[Artist] = []

    def new(
        self, rows: int = 1, cols: int = 1, *, height: float, width: float = INCHES["double"],
        shows: Sequence[Shows] = (), phrases: Sequence[str] = (), **options: Any,
    ) -> tuple[Any, np.ndarray]:  # fmt: skip
        """Return the Figure and its axes as an object array (rows, cols).

        `height` and `width` are in inches, for a figure of two columns. A figure of one column is narrower, and its
        height is multiplied by the root of the ratio of the widths, a compromise between equal shape and equal height.

        The axes of the user may show several results if each panel has the same quantities `shows`; the `phrases`
        then tell the results apart. Raises ValueError if there is not one Axes for each panel, or if these show
        something else.
        """
        inches = min(width, INCHES[self.width])
        self.fig = fig = ShownFigure(self.style, self.width, figsize=(inches, height * math.sqrt(inches / width)))
        return fig, fig.subplots(rows, cols, squeeze=False, **options)

    def name(self, ax: Axes, x: str | None, y: str | None) -> None:
        """Label the axes with the symbols of two quantities, with their units (None: no change)."""
        across, up = (None if name is None else name_of(name) for name in (x, y))
        self.label(ax, across, up, upright=0.0 if y in UNITS else 9.0)

    def label(self, ax: Axes, x: str | None, y: str | None, upright: float = 0.0) -> None:
        """Label the outer axes of a grid of panels with texts (None: no change).

        In a new figure, which makes room for it, the text of the ordinate is upright at the distance `upright` in
        points, unless this is 0. The user's axes keep the labels that they have.
        """
        turned: dict[str, Any] = {"rotation": 0, "labelpad": upright, "va": "center"}
        if x is not None and _is_outer(ax.xaxis, "bottom", "top") and not (self.given and ax.get_xlabel()):
            ax.set_xlabel(x)
        if y is not None and _is_outer(ax.yaxis, "left", "right") and not (self.given and ax.get_ylabel()):
            ax.set_ylabel(y, **(turned if upright and not self.given else {}))
            fit_label(ax)

    def name_quantities(self, ax: Axes, x: Measure | None, y: Measure | None) -> None:
        """Label the axes with two quantities (None: no change), by their symbols or, with a scene, by words and
        units."""
        for unit in (x, y):
            if unit is not None:
                plain = unit.row.name in SYMBOLS and unit.si == "1" and not unit.apart
                words = name_of(unit.row.name) if plain else unit.label(unit.row.words)
                self.label(ax, words if unit is x else None, words if unit is y else None, 9.0 if plain else 0.0)

    def letter(self, ax: Axes, index: int | None, text: str = "", asked: bool = False) -> None:
        """Write a), b), … (nothing for None) and `text` at the upper left of a panel.

        In the user's axes `text` belongs to the notes. It is the title there if the user has `asked` for it.
        """
        if asked or self.notes:
            name = "" if index is None else f"{chr(ord('a') + index)})"
            ax.set_title(f"{name} {text}".strip(), loc="left")

    def note(
        self, ax: Axes, text: str | Sequence[str], above: int = 0, *, side: Literal["left", "right"] = "right"
    ) -> None:
        """Write a note in small letters at the upper right of a panel.

        The note is `above` this number of lines of other text and, if both do not fit into one line, above the name of
        the panel. A sequence of phrases is wrapped between the phrases. `side` is "left" for a panel with a colour bar
        and without a name. In the user's axes the phrases become the title of the legend, if he wants notes.
        """
        if not self.notes:
            return
        size = NOTE * LETTERS[self.width][0]
        room = int(72 * (ax.figure.figure.get_figwidth() - MARGIN) / (LETTER * size))
        text = text if isinstance(text, str) else in_lines(text, room)
        cell, name = ax.get_subplotspec(), ax.get_title(loc="left")
        alone = cell is None or cell.get_gridspec().ncols == 1
        fits = not name or (alone and length(name) / NOTE + length(text.rsplit("\n", 1)[-1]) + BESIDE < room)
        ax.set_title(text + "\n" * (above or not fits) if text else text, loc=side, fontsize=size, color="0.35")

    def explain(self) -> None:
        """Draw a legend of all labels, each once, and of `keys`, below the figure, and break labels that are too long
        for the height that remains. `drawn_on` calls this when the figure is drawn.

        In the axes of the user the legend is in each of them, with the notes as its title, if he wants notes or if they
        show several results.
        """
        fig = cast(Figure, self.fig)
        named = named_in(fig.axes) | {str(handle.get_label()): handle for handle in self.keys}
        if named and self.notes:
            room = 72 * fig.get_figwidth() / (LETTER * LETTERS[self.width][2])
            columns = max(1, int(room / (BESIDE + max(map(length, named)))))
            fig.legend(list(named.values()), list(named), loc="outside lower center", ncols=columns, borderpad=0.2)
        cast(LayoutEngine, fig.get_layout_engine()).execute(fig)  # once more when drawn: only then the ticks are known
        for ax in fig.axes:
            fit_label(ax)


class Mark(Line2D):
    """Legend entry of one result in the user's axes, without data. The next result in these axes reads from it what is
    shown there, and the phrases that describe the result."""

    def __init__(self, colour: str, shows: Shows, phrases: Sequence[str]) -> None:
        super().__init__([], [], color=colour, marker="s", ls="none", label="_")
        self.shows, self.phrases = shows, phrases


class Given(Sheet):
    """The user's axes during one call of a drawing function. They keep his style: only data are drawn, in the next
    colour of their cycle, and several results with the same quantities share one Axes."""

    given = True

    def __init__(self, axes: Any, style: Style | None, notes: bool | None, cmap: Any) -> None:
        super().__init__(style, None, bool(notes), cmap)
        self.axes = list(np.array(axes, dtype=object).reshape(-1))
        self.own_style, self.cmap = style is not None, cmap
        self.phrases: dict[Axes, list[str]] = {}  # of the notes

    def new(
        self, rows: int = 1, cols: int = 1, *, shows: Sequence[Shows] = (), phrases: Sequence[str] = (), **_: Any
    ) -> tuple[Any, np.ndarray]:
        count = rows * cols
        if any(isinstance(getattr(ax, "figure", None), ShownFigure) for ax in self.axes):
            raise ValueError(bad("ax", self.axes[0], "Axes of a figure of yours, because this one has its own style"))
        if not all(isinstance(ax, Axes) for ax in self.axes) or not len(self.axes) == len(set(self.axes)) == count:
            allowed = "one Axes" if count == 1 else f"{count} different Axes, one for each panel"
            raise ValueError(bad("ax", self.axes[0] if len(self.axes) == 1 else self.axes, allowed))
        panels = list(zip(self.axes, shows or [None] * count, strict=True))
        for ax, names in panels:
            for mark in marks_of(ax):
                if names is None or mark.shows is None:
                    raise ValueError(bad("ax", ax, "Axes without a result, because two such figures hide each other"))
                if mark.shows != names:
                    needed = f"Axes without a result or with {names[1]} over {names[0]}"
                    raise ValueError(bad("ax", ax, f"{needed}, but it shows {mark.shows[1]} over {mark.shows[0]}"))
        colour = self._colour()
        for ax, names in panels:  # only now, so that a refusal changes nothing
            ax.add_line(Mark(colour, names, phrases))
            self.phrases[ax] = []
        contrast = self.look.other if self.own_style else to_hex(self.axes[0].xaxis.label.get_color())
        self.look = self.look._replace(main=colour, other=contrast, lines=((colour, "-"), *self.look.lines[1:]))
        if self.cmap is None:  # spots without ink show what is below them
            self.look = self.look._replace(density=ramp((*to_rgba(colour)[:3], 0.0), colour))
        self.fig = self.axes[0].figure
        return self.fig, np.array(self.axes, dtype=object).reshape(rows, cols)

    def _colour(self) -> str:
        """Return the next colour of the cycle of the axes or, if there is one, of `style`."""
        if self.cmap is not None:
            return to_hex(self.look.density(1.0))
        if not self.own_style:
            probes = [ax.plot([], [])[0] for ax in self.axes]  # the public way to a colour of the cycle
            for probe in probes:
                probe.remove()
            return to_hex(probes[0].get_color())
        colours = list(dict.fromkeys(colour for colour, _ in self.look.lines))
        used = len(marks_of(self.axes[0]))
        if used >= len(colours):
            raise ValueError(bad("style", self.style, f"left out, because it has colours for {used} results only"))
        return colours[used]

    def letter(self, ax: Axes, index: int | None, text: str = "", asked: bool = False) -> None:
        if asked:
            ax.set_title(text)
        else:
            self.phrases[ax] += [text] if text else []

    def note(self, ax: Axes, text: str | Sequence[str], above: int = 0, *, side: Any = "right") -> None:
        self.phrases[ax] += [text] if isinstance(text, str) else text

    def explain(self) -> None:
        for ax in self.axes:
            apart, named, title = _tell_apart(marks_of(ax)), named_in([ax]), None
            if self.notes:
                named |= {str(handle.get_label()): handle for handle in self.keys if ax is self.axes[-1]}
                shared = [phrase for phrase in self.phrases[ax] if phrase not in apart]
                points = 72 * ax.get_window_extent().width / ax.figure.dpi
                title = in_lines(shared, int(0.9 * points / (LETTER * mpl.rcParams["font.size"]))) or None
            if (self.notes or apart) and (named or title):
                ax.legend(list(named.values()), list(named), title=title)


def marks_of(ax: Axes) -> list[Mark]:
    """Return the marks of the results that axes show."""
    return [line for line in ax.lines if isinstance(line, Mark)]


def _tell_apart(marks: Sequence[Mark]) -> list[str]:
    """Label several marks, each with the phrases that not all of them have, and return the labels and these phrases."""
    if len(marks) < 2:
        return []
    common = set.intersection(*(set(mark.phrases) for mark in marks))
    differences = [[phrase for phrase in mark.phrases if phrase not in common] for mark in marks]
    labels = [", ".join(phrases) for phrases in differences]
    labels = [label if labels.count(label) == 1 else f"{label or 'result'} ({k})" for k, label in enumerate(labels, 1)]
    for mark, label in zip(marks, labels, strict=True):
        mark.set_label(label)
    return labels + [phrase for phrases in differences for phrase in phrases]


def named_in(axes: Sequence[Axes]) -> dict[str, Artist]:
    """Return the artists of axes that have a label, by label."""
    named: dict[str, Artist] = {}
    for ax in axes:
        named |= dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    return named


def fit_label(ax: Axes) -> None:
    """Break the label of the ordinate, or of a colour bar, into lines that are not longer than its axes."""
    share = ax.yaxis.label.get_window_extent().height / ax.get_window_extent().height
    ax.yaxis.label.set_text(in_short_lines(ax.get_ylabel(), math.ceil(share)))


def in_lines(phrases: Iterable[str], letters: int, between: str = ", ") -> str:
    """Join phrases, or words, in lines of at most `letters` letters."""
    lines = [""]
    for phrase in filter(None, phrases):
        longer = f"{lines[-1]}{between}{phrase}" if lines[-1] else phrase
        if lines[-1] and length(longer) > letters:
            lines[-1] += between.rstrip()
            lines.append(phrase)
        else:
            lines[-1] = longer
    return "\n".join(lines)


def in_short_lines(text: str, count: int) -> str:
    """Break a text into at most `count` lines that are as short as possible."""
    if count < 2:
        return text
    broken = (in_lines(text.split(), letters, " ") for letters in itertools.count(length(text) // count))
    return next(lines for lines in broken if lines.count("\n") < count)


def length(text: str) -> int:
    """Return the number of letters of a text; a command of mathtext counts as one."""
    return len(re.sub(r"\\[a-zA-Z]+", "x", re.sub("[${}^_]", "", text)))


def _is_outer(axis: Axis, *sides: str) -> bool:
    """Return False for an axis without tick labels, as between panels that share it."""
    shown = axis.get_tick_params()
    return any(shown.get(f"label{side}", side in ("bottom", "left")) for side in sides)


@contextmanager
def drawn_on(
    ax: Any = None,
    style: Style | None = None,
    width: Width | None = None,
    notes: bool | None = None,
    cmap: str | Colormap | None = None,
) -> Iterator[Sheet]:
    """Give the sheet for one figure. Within the block a new figure has the settings of its style and width, and those
    of the user stay in force for his axes. Raises ValueError for an unknown argument, and for `width` with `ax`."""
    for key, value, names in (("style", style, STYLES), ("width", width, WIDTHS)):
        if value is not None and value not in names:
            raise ValueError(bad(key, value, "one of " + ", ".join(names)))
    if notes not in (None, False, True):
        raise ValueError(bad("notes", notes, "True or False"))
    if ax is not None and width is not None:
        raise ValueError(bad("width", width, "left out with ax, because its figure has a width"))
    sheet = Sheet(style, width, notes, cmap) if ax is None else Given(ax, style, notes, cmap)
    with drawn_as(sheet.style, sheet.width) if ax is None else nullcontext():
        yield sheet
        if sheet.fig is not None:
            sheet.explain()


def as_list(key: str, value: Any, attribute: str, allowed: str) -> list[Any]:
    """Return one object with an attribute, or a sequence of such objects, as a list. Raises TypeError."""
    items = [value] if hasattr(value, attribute) else list(value) if isinstance(value, Iterable) else []
    if not items or not all(hasattr(item, attribute) for item in items):
        raise TypeError(bad(key, value, allowed))
    return items
