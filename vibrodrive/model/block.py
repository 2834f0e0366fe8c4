"""A finished block of a sweep."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np


class Block(NamedTuple):
    """A finished block: `section` float64 (points, periods, 2) or None if it is not recorded; `status` int8; `margin`
    float64; `switches` int64 (points, 5), the switches into each State within the recorded window; `records`, the other
    arrays by their names (records.py)."""

    index: int  # type: ignore[assignment]  # hides tuple.index, which is not used on a block
    start: int
    stop: int
    section: np.ndarray | None
    status: np.ndarray
    margin: np.ndarray
    switches: np.ndarray
    records: Mapping[str, np.ndarray] = MappingProxyType({})
