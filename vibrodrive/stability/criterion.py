"""Criteria on disturbed motions: "impacts" (main_impacts.py), "word" (structure.py), or both joined by "and"."""

import re
from typing import NamedTuple

from vibrodrive.model.parameters import bad

IMPACTS, WORD = "impacts", "word"
ALLOWED = f'"{IMPACTS}", "{WORD}", or both joined by "and"'


class Criterion(NamedTuple):
    """Criterion on disturbed motions.

    text : the criterion as written.
    names : attributes of a Structure (structure.py) that must be true.
    """

    text: str
    names: tuple[str, ...]

    @property
    def needs_switches(self) -> bool:
        """True if the criterion needs all switches of a motion, not only its main impacts and section points."""
        return WORD in self.names


def parse_criterion(text: str | Criterion) -> Criterion:
    """Parse a criterion on disturbed motions. A Criterion is returned unchanged.

    Raises TypeError or ValueError for an invalid text. The message is one sentence with the allowed forms.
    """
    if isinstance(text, Criterion):
        return text
    if not isinstance(text, str):
        raise TypeError(bad("criterion", text, f"a string: {ALLOWED}"))
    names = tuple(re.split(r"\s+and\s+", text.strip()))
    if not set(names) <= {IMPACTS, WORD}:
        raise ValueError(bad("criterion", text, ALLOWED))
    return Criterion(text, names)
