"""What comes out of a sweep, block by block."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Block(NamedTuple):
    """A finished block: `section` float64 (points, periods, 2), `status` int8, `margin` float64,
    `switches` int64 (points, 5): switches into each State within the recorded window."""

    index: int  # type: ignore[assignment]  # hides tuple.index, which is not used on a block
    start: int
    stop: int
    section: np.ndarray
    status: np.ndarray
    margin: np.ndarray
    switches: np.ndarray
