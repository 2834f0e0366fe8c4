"""What must be kept of a disturbed motion, as a text: "impacts", "word" or "rho < x", joined by "and".

What each means stands in structure.py (`keeps`); of "impacts", in main_impacts.py; "rho" is the distance from the
orbit as a curve here (orbit_curve.py), not that of section points. The motions are computed in evaluate.py.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from vibrodrive.model.parameters import bad

IMPACTS, WORD = "impacts", "word"
"""Those of the answers of structure.Structure that belong to the motion, and not to the place of the section."""

ALLOWED = f'"{IMPACTS}", "{WORD}", "rho < x" (x > 0), or some of them joined by "and"'

NEAR = re.compile(r"rho\s*<\s*(\S+)")


class Criterion(NamedTuple):
    """names: of the answers of a Structure; k3: what the distance from the orbit as a curve stays below."""

    text: str
    names: tuple[str, ...]
    k3: float = math.inf

    @property
    def needs_switches(self) -> bool:
        """Whether the main impacts and the section do not tell."""
        return "word" in self.names or math.isfinite(self.k3)


def parse_criterion(text: str | Criterion) -> Criterion:
    """Read a criterion on disturbed motions; a Criterion is returned as it is.

    Raises TypeError or ValueError with one sentence.
    """
    if isinstance(text, Criterion):
        return text
    if not isinstance(text, str):
        raise TypeError(bad("criterion", text, "a text"))
    names, k3 = [], math.inf
    for part in re.split(r"\s+and\s+", text.strip()):
        near = NEAR.fullmatch(part)
        if near is not None:
            k3 = min(k3, _positive(text, near[1]))
        elif part in (IMPACTS, WORD):
            names.append(part)
        else:
            raise ValueError(bad("criterion", text, ALLOWED))
    return Criterion(text, tuple(names), k3)


def _positive(text: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise ValueError(bad("criterion", text, ALLOWED))
    return value
