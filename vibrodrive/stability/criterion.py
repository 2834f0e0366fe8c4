"""Criteria on disturbed motions as text: "impacts", "word" or "rho < x", or several of them joined by "and".

"impacts" is defined in main_impacts.py, "word" in structure.py. In a criterion "rho" is the distance of a motion from
the orbit as a curve (orbit_curve.py), not the distance of section points (structure.py). evaluate.py computes the
motions.
"""

import math
import re
from typing import NamedTuple

from vibrodrive.model.parameters import bad

IMPACTS, WORD = "impacts", "word"
ALLOWED = f'"{IMPACTS}", "{WORD}", "rho < x" (x > 0), or several of them joined by "and"'
NEAR = re.compile(r"rho\s*<\s*(\S+)")


class Criterion(NamedTuple):
    """Criterion on disturbed motions.

    text : the criterion as written.
    names : attributes of a Structure (structure.py) that must be true.
    k3 : the distance of the motion from the orbit as a curve must be below this value; inf for no such condition.
    """

    text: str
    names: tuple[str, ...]
    k3: float = math.inf

    @property
    def needs_switches(self) -> bool:
        """True if the criterion needs all switches of a motion, not only its main impacts and section points."""
        return "word" in self.names or math.isfinite(self.k3)


def parse_criterion(text: str | Criterion) -> Criterion:
    """Parse a criterion on disturbed motions. A Criterion is returned unchanged.

    Raises TypeError or ValueError for an invalid text. The message is one sentence with the allowed forms.
    """
    if isinstance(text, Criterion):
        return text
    if not isinstance(text, str):
        raise TypeError(bad("criterion", text, f"a string: {ALLOWED}"))
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
