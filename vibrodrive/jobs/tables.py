"""Tables as plain text: CSV in UTF-8 with a line of names, which pandas and spreadsheets read without an argument.

The names of quantities are those of `column` in model/physical.py.
"""

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from vibrodrive.store.draft import drafted

ENDING = ".csv"


def write_table(path: Path, names: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table. Numbers are written so that they read back the same. An older file is replaced at the end."""
    try:
        with drafted(path) as draft, open(draft, "w", encoding="utf-8", newline="") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(names)
            table.writerows(rows)
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


def read_table(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table, by the names of its columns. Raises OSError, and ValueError for other bytes."""
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
