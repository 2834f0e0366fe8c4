"""Ink (darkness, 0 to 1) of a spot of a diagram as a function of the number of recorded values in the spot. This module
needs no Matplotlib."""

import math

import numpy as np

FAINTEST = 0.3  # ink of a spot visited once: dark enough for a poor printer
LINES = 16  # motions up to this period are drawn in full ink


def ink_of(counts: np.ndarray, values: int) -> np.ndarray:
    """Return the ink, 0 to 1, of spots that have `counts` values each, if the motion has `values` recorded values.

    The values of a periodic motion are in few spots, which have full ink. The values of an irregular motion are in many
    spots, which are grey. So an area of irregular motions is not black, but shows the density of the values.
    """
    full = math.log(max(values / LINES, math.e))
    ink = FAINTEST + (1 - FAINTEST) * np.log(np.maximum(counts, 1.0)) / full
    return np.where(counts > 0, np.minimum(ink, 1.0), 0.0)


SAME = 1e-11  # values whose difference is at most this share of their size may differ only by rounding


def range_around(low: float, high: float, share: float = 0.0) -> tuple[float, float]:
    """Return the range of a scale for values from `low` to `high`, with a share of its length added at both ends.

    Values that may differ only by rounding are one value, in the middle of the range.
    """
    size = max(abs(low), abs(high))
    room = share * (high - low) if high - low > SAME * size else 0.5 * size or 0.5
    return low - room, high + room
