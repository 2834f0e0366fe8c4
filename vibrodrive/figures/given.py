"""Axes that the user gives as `ax`. They keep his style: only data are drawn, in the next colour of their cycle, and
several results with the same quantities share one Axes."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterable, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgba
from matplotlib.lines import Line2D

from vibrodrive.figures.looks import LOOKS, ramp
from vibrodrive.model.drawing import Style
from vibrodrive.model.parameters import bad

LETTER = 0.45  # mean width of a letter, in units of its size

Shows = tuple[str, str] | None
"""Names of the quantities to the right and upwards in a panel; None for a panel that cannot show several results."""


class Mark(Line2D):
    """Legend entry of one result in the user's axes, without data. The next result in these axes reads from it what is
    shown there, and the phrases that describe the result."""

    def __init__(self, colour: str, shows: Shows, said: Sequence[str]) -> None:
        super().__init__([], [], color=colour, marker="s", ls="none", label="_")
        self.shows, self.said = shows, said


class Given:
    """The user's axes during one call of a drawing function.

    `notes` is True if he wants notes, and `said` contains for each of the axes the phrases of these notes.
    """

    def __init__(self, axes: Any, style: Style | None, notes: bool) -> None:
        self.axes = list(np.array(axes, dtype=object).reshape(-1))
        self.style, self.notes, self.look = style, notes, LOOKS[style or "screen"]
        self.said: dict[Axes, list[str]] = {}

    def take(self, count: int, shows: Sequence[Shows], said: Sequence[str]) -> None:
        """Check the axes for `count` panels, mark them with `shows` and `said`, and choose the colours of the data.

        Raises ValueError, before any change, if the axes do not suit.
        """
        if not all(isinstance(ax, Axes) for ax in self.axes) or not len(self.axes) == len(set(self.axes)) == count:
            allowed = "one Axes" if count == 1 else f"{count} different Axes, one for each panel"
            raise ValueError(bad("ax", self.axes[0] if len(self.axes) == 1 else self.axes, allowed))
        panels = list(zip(self.axes, shows or [None] * count, strict=True))
        for ax, names in panels:
            for known in marks_of(ax):
                if names is None or known.shows is None:
                    raise ValueError(bad("ax", ax, "Axes without a result, because two such figures hide each other"))
                if known.shows != names:
                    needed = f"Axes without a result or with {names[1]} over {names[0]}"
                    raise ValueError(bad("ax", ax, f"{needed}, but it shows {known.shows[1]} over {known.shows[0]}"))
        colour = self._next_colour()
        for ax, names in panels:
            ax.add_line(Mark(colour, names, said))
            self.said[ax] = []
        contrast = self.look.other if self.style else to_hex(self.axes[0].xaxis.label.get_color())
        lines = ((colour, "-"), *self.look.lines[1:])
        clear = (*to_rgba(colour)[:3], 0.0)  # spots without ink show what is below them
        self.look = self.look._replace(main=colour, other=contrast, lines=lines, density=ramp(clear, colour))

    def _next_colour(self) -> str:
        """Return the next colour of the cycle of the axes or, if there is one, of `style`."""
        if self.style is None:
            probes = [ax.plot([], [])[0] for ax in self.axes]  # the public way to a colour of the cycle
            for probe in probes:
                probe.remove()
            return to_hex(probes[0].get_color())
        colours = list(dict.fromkeys(colour for colour, _ in self.look.lines))
        used = len(marks_of(self.axes[0]))
        if used >= len(colours):
            raise ValueError(bad("style", self.style, f"left out, because it has colours for {used} results only"))
        return colours[used]

    def explain(self, more: Sequence[Artist]) -> None:
        """Draw a legend, with the notes as its title, in each of the axes if notes are wanted or several results are
        shown. `more` are further entries in the last of the axes."""
        for ax in self.axes:
            apart = _tell_apart(marks_of(ax))
            if not self.notes and not apart:
                continue
            title = None
            named = named_in([ax])
            if self.notes:
                named |= {str(handle.get_label()): handle for handle in more if ax is self.axes[-1]}
                shared = [phrase for phrase in self.said[ax] if phrase not in apart]
                points = 72 * ax.get_window_extent().width / ax.figure.dpi
                title = in_lines(shared, int(0.9 * points / (LETTER * mpl.rcParams["font.size"]))) or None
            if named or title:
                ax.legend(list(named.values()), list(named), title=title)


def marks_of(ax: Axes) -> list[Mark]:
    """Return the marks of the results that axes show."""
    return [line for line in ax.lines if isinstance(line, Mark)]


def _tell_apart(marks: Sequence[Mark]) -> list[str]:
    """Label several marks, each with the phrases that not all of them have, and return the labels and these phrases."""
    if len(marks) < 2:
        return []
    common = set.intersection(*(set(mark.said) for mark in marks))
    phrases = [[phrase for phrase in mark.said if phrase not in common] for mark in marks]
    labels = [", ".join(own) for own in phrases]
    labels = [label if labels.count(label) == 1 else f"{label or 'result'} ({k})" for k, label in enumerate(labels, 1)]
    for mark, label in zip(marks, labels, strict=True):
        mark.set_label(label)
    return labels + [phrase for own in phrases for phrase in own]


def named_in(axes: Sequence[Axes]) -> dict[str, Artist]:
    """Return the artists of axes that have a label, by label."""
    named: dict[str, Artist] = {}
    for ax in axes:
        named |= dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    return named


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


def label_share(ax: Axes) -> float:
    """Return the extent of the label of the ordinate, or of a colour bar, as a share of the height of its axes."""
    return ax.yaxis.label.get_window_extent().height / ax.get_window_extent().height


def fit_label(ax: Axes) -> None:
    """Break the label of the ordinate, or of a colour bar, into lines that are not longer than its axes."""
    ax.yaxis.label.set_text(in_short_lines(ax.get_ylabel(), math.ceil(label_share(ax))))


def in_short_lines(text: str, count: int) -> str:
    """Break a text into at most `count` lines that are as short as possible."""
    if count < 2:
        return text
    broken = (in_lines(text.split(), letters, " ") for letters in itertools.count(length(text) // count))
    return next(lines for lines in broken if lines.count("\n") < count)


def length(text: str) -> int:
    """Return the number of letters of a text; a command of mathtext counts as one."""
    return len(re.sub(r"\\[a-zA-Z]+", "x", re.sub("[${}^_]", "", text)))
