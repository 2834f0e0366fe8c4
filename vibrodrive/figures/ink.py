"""Ink of a spot of a diagram as a function of the number of recorded values on this spot. Needs no Matplotlib."""

import math

import numpy as np

FAINTEST = 0.3  # ink of a spot visited once: dark enough for a poor printer
LINES = 16  # motions up to this period are drawn in full ink


def ink_of(counts: np.ndarray, values: int) -> np.ndarray:
    """Return the ink, 0 to 1, of spots that have `counts` values each, if the motion has `values` recorded values.

    A periodic motion has its values on few spots, which have full ink. An irregular motion has its values on many
    spots, which are grey, so that the diagram shows their density instead of a black area.
    """
    full = math.log(max(values / LINES, math.e))
    ink = FAINTEST + (1 - FAINTEST) * np.log(np.maximum(counts, 1.0)) / full
    return np.where(counts > 0, np.minimum(ink, 1.0), 0.0)
