"""What must be kept, as a text: of a disturbed motion "impacts", "gaps", "order", "word" or "rho < x", joined by "and".

Two more stand alone: "solution" (of a disturbed start: it ends on the same solution, k₁) and "several" (of several
starts: their motions do not all become one, k_u).

What each means stands in structure.py (`keeps`); of "impacts" and "gaps", in main_impacts.py; "rho" is the distance
from the orbit as a curve here (orbit_curve.py), not that of section points. The motions are computed in evaluate.py.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from vibrodrive.model.parameters import bad

STRUCTURE = ("impacts", "gaps", "order", "word")
"""Answers of structure.Structure."""

SOLUTION, SEVERAL = "solution", "several"

ALLOWED = (
    '"impacts", "gaps", "order", "word", "rho < x" (x > 0), some of them joined by "and"; or alone "several", or '
    '"solution", of starts'
)

NEAR = re.compile(r"rho\s*<\s*(\S+)")


class Criterion(NamedTuple):
    """names: of STRUCTURE; k3: the distance from the orbit as a curve must stay below it (orbit_curve.py)."""

    text: str
    names: tuple[str, ...]
    k3: float = math.inf

    @property
    def needs_switches(self) -> bool:
        """Whether the main impacts and the section do not tell."""
        return "word" in self.names or math.isfinite(self.k3)


def parse_criterion(text: str) -> Criterion:
    """Read a criterion on disturbed motions. Raises ValueError with one sentence."""
    names, k3 = [], math.inf
    for part in re.split(r"\s+and\s+", text.strip()):
        near = NEAR.fullmatch(part)
        if near is not None:
            k3 = min(k3, _positive(text, near[1]))
        elif part in STRUCTURE:
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
