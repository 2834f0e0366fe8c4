"""Ink of a spot of a diagram, by the number of recorded values on it. This module does not import Matplotlib."""

from __future__ import annotations

import math

import numpy as np

FAINTEST = 0.3  # ink of a spot visited once: dark enough for a poor printer
LINES = 16  # motions up to this period are drawn in full ink


def ink_of(counts: np.ndarray, values: int) -> np.ndarray:
    """Return the ink, 0 to 1, of spots with `counts` of the recorded values of a motion, of which there are `values`.

    A periodic motion has its values on few spots, in full ink. An irregular motion has them on many spots, in grey, so
    that the diagram shows their density instead of a black area.
    """
    full = math.log(max(values / LINES, math.e))
    ink = FAINTEST + (1 - FAINTEST) * np.log(np.maximum(counts, 1.0)) / full
    return np.where(counts > 0, np.minimum(ink, 1.0), 0.0)
