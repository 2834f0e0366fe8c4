"""Text about results and loaded files: a line (the repr), a table for notebooks, and the lines of `vibrodrive info`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from vibrodrive.model.kinds import FILES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Lines = list[tuple[str, str]]
"""Name and text of each line; a name may occur again."""


class Described:
    """A short repr, and a table where a notebook shows the object, both made from `_described`."""

    def _described(self) -> dict[str, str]:
        """A few words for each row of the table: "of" and "computed" begin the line, the others follow in it."""
        raise NotImplementedError

    def _more(self) -> dict[str, str]:
        """Further rows, of the table alone."""
        return {}

    def __repr__(self) -> str:
        d = self._described()
        parts = [text for name, text in d.items() if text and name not in ("of", "computed")]
        return f"<{type(self).__name__} of {d['of']}, {d['computed']}: {'; '.join(parts)}>"

    def _repr_html_(self) -> str:
        rows = {"title": getattr(self, "title", ""), **self._described(), **self._more()}
        return _table(type(self).__name__, rows.items())


class Stored:
    """The contents of a result file. Its repr, its table in a notebook and the lines of `info` are made from `facts`.

    A class overrides `lines` where these read badly.
    """

    file_kind: ClassVar[str]
    title: str

    @property
    def computed(self) -> float:
        """Share that is computed, 0 to 1."""
        return 1.0

    def facts(self) -> dict[str, Any]:
        """Return what it holds by name, of types that JSON knows (NaN and inf among the numbers)."""
        raise NotImplementedError

    def lines(self) -> Lines:
        """Return the facts in words."""
        return words(self.facts())

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """Draw it.

        Parameters
        ----------
        ax : matplotlib Axes or sequence of them, optional
            where to draw, one for each panel; a new figure unless given.

        Returns
        -------
        Figure
            which shows itself in a notebook; `savefig` writes it.
        """
        return self._drawn(ax=ax)

    def _drawn(self, **options: Any) -> Figure:
        raise NotImplementedError

    def __repr__(self) -> str:
        said = "; ".join(text for _, text in self.lines())
        return f"<{type(self).__name__} of {FILES[self.file_kind].holds}, {share_computed(self.computed)}: {said}>"

    def _repr_html_(self) -> str:
        return _table(type(self).__name__, [("title", self.title), *self.lines()])


def _table(caption: str, rows: Iterable[tuple[str, str]]) -> str:
    cells = [f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows if text]
    return f"<table><caption>{caption}</caption>{''.join(cells)}</table>"


LABELS = {"axes": "axis", "ranges": "range", "parameters": "fixed"}
"""Names of lines where they are not those of the facts."""


def words(facts: Mapping[str, Any]) -> Lines:
    """Return facts as lines: a line for each entry of what nests, one line for anything else."""
    found = []
    for name, value in facts.items():
        label = LABELS.get(name, name.replace("_", " "))
        if isinstance(value, Mapping) and any(isinstance(v, Mapping | list) for v in value.values()):
            entries = {key: _text(v) for key, v in value.items()}
            found += [(label, f"{key}{'' if text[0] == '=' else ':'} {text}") for key, text in entries.items()]
        else:
            found.append((label, _text(value)))
    return found


def _text(value: Any) -> str:
    if isinstance(value, Mapping):
        if value.keys() == {"first", "last", "num"}:
            return f"= {value['first']:g} to {value['last']:g}, {value['num']} values"
        return ", ".join(f"{v} {k}" if isinstance(v, int) else f"{k} = {v:g}" for k, v in value.items())
    if isinstance(value, list):
        return f"= {value[0]:g} to {value[1]:g}"
    return f"{value:g}" if isinstance(value, float) else str(value)


def axis_facts(values: np.ndarray) -> dict[str, Any]:
    """Facts of an axis: its first and last value, and how many there are."""
    return {"first": float(values[0]), "last": float(values[-1]), "num": len(values)}


def span(name: str, values: np.ndarray) -> str:
    """“A 3…3.25 (100)”."""
    return f"{name} {values[0]:g}" + (f"…{values[-1]:g} ({len(values)})" if len(values) > 1 else "")


def share_computed(share: float) -> str:
    """“computed”, or how much of it is."""
    return "computed" if share == 1 else f"{100 * share:.1f} % computed"


def numbers(fixed: Mapping[str, float]) -> str:
    """“B = 0.1, eta = 101”, without what is not known."""
    return ", ".join(f"{name} = {value:g}" for name, value in fixed.items() if value == value)
