"""A finished block of a sweep, and blocks as results."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from vibrodrive.model.plan import Plan
from vibrodrive.model.results import Results


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


def gather(plan: Plan, blocks: Iterable[Block], tell: Callable[[Block], None] = lambda block: None) -> Results:
    """Return all blocks of a plan as results in memory, and call `tell` after each block.

    Raises TooLarge (a ValueError) if they do not fit.
    """
    results = Results.new(plan)
    for b in blocks:
        arrays = {"status": b.status, "margin": b.margin, "switches": b.switches, **b.records}
        results.put(b.start, b.stop, arrays if b.section is None else arrays | {"section": b.section})
        tell(b)
    return results
