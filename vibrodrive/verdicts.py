"""Verdicts on claims of the paper and on checks of an installation.

A claim or a check is a function with an id and a title. Its result is a Judged. The verdicts are written as the objects
of a JSON file and as the rows of a table in a Markdown page.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from vibrodrive.model.plain import plain
from vibrodrive.store.draft import drafted
from vibrodrive.store.place import make_directory


class NotApplicable(ValueError):
    """A claim, check or figure does not apply to this configuration or machine; the message is the reason."""


@dataclass(frozen=True)
class Judged:
    """A claim or check with its verdict.

    text : the result, or the reason why there is no verdict.
    record : further entries of the object of this claim or check in the JSON file, in order.
    rows : rows of this claim or check in the Markdown table, each a list of cells.
    """

    id: str
    title: str
    verdict: StrEnum
    text: str
    record: Mapping[str, Any]
    rows: Sequence[Sequence[str]]

    def document(self) -> dict[str, Any]:
        """Return the object of this claim or check in the JSON file."""
        return {"id": self.id, **plain(self.record), "verdict": str(self.verdict)}


def counts(judged: Sequence[Judged], noun: str, verdicts: Iterable[StrEnum]) -> str:
    """Return one line with the number of each verdict, such as `Number of checks: 12 (holds: 10, …)`."""
    numbers = [f"{v}: {sum(j.verdict is v for j in judged)}" for v in verdicts]
    return f"Number of {noun}: {len(judged)} ({', '.join(numbers)})"


def table(head: Sequence[str], judged: Sequence[Judged]) -> list[str]:
    """Return the lines of a Markdown table with the rows of each claim or check."""
    rows = [[cell.replace("|", r"\|") for cell in row] for j in judged for row in j.rows]
    return [_row(head), "|" + "---|" * len(head), *map(_row, rows)]


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def write(folder: Path, name: str, document: Mapping[str, Any], page: Sequence[str]) -> list[Path]:
    """Write NAME.json and NAME.md into a directory, created if missing; return their paths. Raises OSError."""
    texts = {
        "json": json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        "md": "\n".join(page) + "\n",
    }
    make_directory(folder)
    paths = [folder / f"{name}.{ending}" for ending in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        with drafted(path) as draft:
            draft.write_text(text, encoding="utf-8")
    return paths
