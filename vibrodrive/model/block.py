"""A finished block of a sweep."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np


class Block(NamedTuple):
    """Results of the points `start` to `stop` - 1 of a plan, arrays with one entry for each of these n points.

    index : number of the block (`Plan.blocks`).
    section : float64 (n, periods, 2), or None if it is not recorded.
    status : int8 (n,).
    margin : float64 (n,).
    switches : int64 (n, 5), number of switches into each State within the recorded periods.
    raised : for each point at which a function of the record raised an exception, a text with both.
    records : all other arrays that the plan records, by the names in model/records.py.
    """

    index: int  # type: ignore[assignment]  # hides tuple.index, which is not used on a block
    start: int
    stop: int
    section: np.ndarray | None
    status: np.ndarray
    margin: np.ndarray
    switches: np.ndarray
    records: Mapping[str, np.ndarray] = MappingProxyType({})
    raised: tuple[str, ...] = ()
