"""Text about results and loaded files: the repr, a table for notebooks, and the lines of `vibrodrive info`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

Lines = list[tuple[str, str]]  # name and text of each line; several lines may have the same name


def counted(n: int, noun: str, ending: str = "s") -> str:
    """Return “1 point”, “2 points” and so on."""
    return f"{n} {noun}{ending * (n != 1)}"


def span(name: str, values: np.ndarray) -> str:
    """Return the ends and the number of values of an axis as “A 3…3.25 (100)”."""
    return f"{name} {values[0]:g}" + (f"…{values[-1]:g} ({len(values)})" if len(values) > 1 else "")


def numbers(fixed: Mapping[str, float]) -> str:
    """Return “B = 0.1, eta = 101”, without values that are NaN."""
    return ", ".join(f"{name} = {value:g}" for name, value in fixed.items() if value == value)


def html_table(caption: str, rows: Iterable[tuple[str, str]]) -> str:
    """Return a table for notebooks with a row for each (name, text); rows without a text are left out."""
    cells = [f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows if text]
    return f"<table><caption>{caption}</caption>{''.join(cells)}</table>"
