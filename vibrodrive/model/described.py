"""Text about results and loaded files: the repr, a table for notebooks, and the lines of `vibrodrive info`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from vibrodrive.model.kinds import FILES
from vibrodrive.model.notebook import html_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Lines = list[tuple[str, str]]  # name and text of each line; several lines may have the same name


class Stored:
    """The contents of a result file. Its repr, its table for notebooks and the lines of `info` are made from `facts`.

    A subclass overrides `lines` to give a better text. `file_kind` is a key of FILES (model/kinds.py), and `title` is
    the title of the configuration.
    """

    file_kind: ClassVar[str]
    title: str

    @property
    def computed(self) -> float:
        """Computed share of the points, 0 to 1."""
        return 1.0

    def facts(self) -> dict[str, Any]:
        """Return the contents by name, in types of JSON (the numbers include NaN and inf)."""
        raise NotImplementedError

    def lines(self) -> Lines:
        """Return the facts as lines of text: (name, text) each."""
        return words(self.facts())

    def plot(self, *, ax: Axes | None = None) -> Figure:
        """Draw the contents.

        Parameters
        ----------
        ax : matplotlib Axes, or sequence of Axes with one for each panel, optional
            axes to draw into; by default those of a new figure.

        Returns
        -------
        Figure
            the figure. A notebook shows it, and its method `savefig` writes it to a file.
        """
        return self._drawn(ax=ax)

    def _drawn(self, **options: Any) -> Figure:
        raise NotImplementedError

    def __repr__(self) -> str:
        said = "; ".join(text for _, text in self.lines())
        return f"<{type(self).__name__} of {FILES[self.file_kind].holds}, {share_computed(self.computed)}: {said}>"

    def _repr_html_(self) -> str:
        return html_table(type(self).__name__, [("title", self.title), *self.lines()])


LABELS = {"axes": "axis", "ranges": "range", "parameters": "fixed"}
"""Labels of the lines of facts, if the label differs from the name of the fact."""


def words(facts: Mapping[str, Any]) -> Lines:
    """Return facts as lines, (name, text) each.

    A fact that is a mapping with lists or mappings in it gives one line for each of its entries. Any other fact gives
    one line.
    """
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
    """Return the first value, the last value and the number of values of an axis: `first`, `last` and `num`."""
    return {"first": float(values[0]), "last": float(values[-1]), "num": len(values)}


def span(name: str, values: np.ndarray) -> str:
    """Return the ends and the number of values of an axis as “A 3…3.25 (100)”."""
    return f"{name} {values[0]:g}" + (f"…{values[-1]:g} ({len(values)})" if len(values) > 1 else "")


def share_computed(share: float) -> str:
    """Return “computed”, or the computed share in per cent."""
    return "computed" if share == 1 else f"{100 * share:.1f} % computed"


def numbers(fixed: Mapping[str, float]) -> str:
    """Return “B = 0.1, eta = 101”, without values that are NaN."""
    return ", ".join(f"{name} = {value:g}" for name, value in fixed.items() if value == value)
