"""What results, and loaded files of other kinds, say of themselves: in a line, and as a table in a notebook."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

import numpy as np


class Described:
    """A short repr, and a table where a notebook shows the object, both of what `_described` tells."""

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
        cells = [f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows.items() if text]
        return f"<table><caption>{type(self).__name__}</caption>{''.join(cells)}</table>"


def span(name: str, values: np.ndarray) -> str:
    """“A 3…3.25 (100)”."""
    return f"{name} {values[0]:g}" + (f"…{values[-1]:g} ({len(values)})" if len(values) > 1 else "")


def share_computed(share: float) -> str:
    """“computed”, or how much of it is."""
    return "computed" if share == 1 else f"{100 * share:.1f} % computed"


def numbers(fixed: Mapping[str, float]) -> str:
    """“B = 0.1, eta = 101”, without what is not known."""
    return ", ".join(f"{name} = {value:g}" for name, value in fixed.items() if value == value)
