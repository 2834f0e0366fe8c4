"""Tables for notebooks."""

from collections.abc import Iterable
from html import escape


def html_table(caption: str, rows: Iterable[tuple[str, str]]) -> str:
    """Return a table with a row for each (name, text); rows without a text are left out."""
    cells = [f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows if text]
    return f"<table><caption>{caption}</caption>{''.join(cells)}</table>"
