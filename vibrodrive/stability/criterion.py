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
        if part in (IMPACTS, WORD):
            names.append(part)
            continue
        near = NEAR.fullmatch(part)
        try:
            distance = float(near[1]) if near else math.nan
        except ValueError:
            distance = math.nan
        if not 0.0 < distance < math.inf:
            raise ValueError(bad("criterion", text, ALLOWED))
        k3 = min(k3, distance)
    return Criterion(text, tuple(names), k3)
