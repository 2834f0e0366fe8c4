"""Tables as plain text: CSV in UTF-8 with a line of names, which pandas and spreadsheets read without an argument.

The names of quantities are those of `column` in model/physical.py.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from vibrodrive.errors import ConfigError
from vibrodrive.model.parameters import bad
from vibrodrive.store.draft import drafted

if TYPE_CHECKING:
    import numpy as np

ENDING = ".csv"


def write_table(path: Path, names: Iterable[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table. Numbers are written so that they read back the same. An older file is replaced at the end."""
    with drafted(path) as draft, open(draft, "w", encoding="utf-8", newline="") as file:
        write_lines(file, names, rows)


def write_lines(file: TextIO, names: Iterable[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write the lines of a table."""
    table = csv.writer(file, lineterminator="\n")
    table.writerow(names)
    table.writerows(rows)


def rows_of(columns: Mapping[str, np.ndarray]) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of a table of columns."""
    few = 1 << 14  # as lists, all rows would take ten times the memory of the columns
    for start in range(0, len(next(iter(columns.values()))), few):
        yield from zip(*(values[start : start + few].tolist() for values in columns.values()), strict=True)


def read_table(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table, by the names of its columns.

    Raises OSError, and ConfigError for a file that is no table.
    """
    return [row for _, row in numbered_rows(path)]


def numbered_rows(path: Path) -> list[tuple[int, dict[str, str]]]:
    """Return the rows of a table with the numbers of their lines. Empty lines, and comments after #, are left out."""
    lines: list[tuple[int, list[str]]] = []
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:  # spreadsheets begin a file with a byte order mark
            reader = csv.reader(file)
            lines += [(reader.line_num, cells) for cells in reader if cells and not cells[0].lstrip().startswith("#")]
    except (UnicodeDecodeError, csv.Error):
        lines = []
    if not lines:
        raise ConfigError(f"{path}: must be a table (CSV in UTF-8)")
    names = [name.strip() for name in lines[0][1]]
    if len(names) == 1 and (separator := re.search(r"[;\t ]", names[0])):
        raise ConfigError(f"{path}: {bad('separator', separator[0], 'a comma')}")
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise ConfigError(f"{path}: {bad('columns', ', '.join(names), f'different names, but {twice} is there twice')}")
    for number, cells in lines[1:]:
        if len(cells) != len(names):
            allowed = f"{len(names)} cells, as in the first line"
            raise ConfigError(f"{path}: {bad(f'line {number}', ','.join(cells), allowed)}")
    return [(number, dict(zip(names, cells, strict=True))) for number, cells in lines[1:]]
