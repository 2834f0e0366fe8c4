"""How dark a spot of a diagram is, by how many recorded values fall on it. No Matplotlib here."""

from __future__ import annotations

import math

import numpy as np

FAINTEST = 0.3  # ink of a spot visited once: dark enough for a poor printer
LINES = 16  # longest period of a motion drawn in full ink


def ink_of(counts: np.ndarray, values: int) -> np.ndarray:
    """Ink, 0 to 1, of spots with so many (`counts`) of a motion's recorded values (`values` in all).

    A periodic motion puts its values on a few spots: full ink. An irregular one spreads them: grey, so that its density
    shows instead of a black block.
    """
    full = math.log(max(values / LINES, math.e))
    ink = FAINTEST + (1 - FAINTEST) * np.log(np.maximum(counts, 1.0)) / full
    return np.where(counts > 0, np.minimum(ink, 1.0), 0.0)
