"""The search for a limit: choice of the next disturbances from the results of the previous ones.

A search is a generator. It yields disturbances to try. For each disturbance the search receives True if the
structure was *kept*, and False if the structure was *lost*. So the motions of many searches can be computed together.
"""

import math
from collections.abc import Callable, Generator
from typing import NamedTuple

import numpy as np

INTERIOR = 7  # values that one round of bisection tries between two neighbouring values of the grid
ROUNDS = 2  # rounds of bisection; two rounds divide a step of the grid by 64
BEYOND = 2.0  # the search ends at this multiple of `last_kept` or, if it is larger, of the first value lost


class Grid(NamedTuple):
    """Grid of the values of a disturbance that are tried: `value(k)` for integers k, from `floor` to `top`."""

    value: Callable[[int], float]
    decade: int  # number of values in a factor of ten, about
    floor: float
    top: float
    batch: int  # values requested at a time: enough to use all cores, and few enough to waste little work


def _round_values(k: int) -> float:
    """Return value k of …, 0.001, 0.0011, …, 0.0099, 0.01, 0.011, …: two digits, like a step chosen by hand."""
    return float(f"{10 + k % 90}e{k // 90 - 4}")


GRIDS = {
    "eps": Grid(lambda k: 1e-6 * 1.15**k, 16, 1e-12, 1.0, 4),  # one narrow edge: a ratio of 1.15 is enough
    "dtau": Grid(_round_values, 90, 1e-8, 2 * math.pi, 16),  # isolated losses: the grid is finer
}


BandSearch = Generator[np.ndarray, np.ndarray, "Band"]


class Band(NamedTuple):
    """Band of a limit, from the first value lost to the last value kept (limit.py).

    lost : first value lost; inf if no value up to `searched_to` is lost.
    kept_below : largest value found below `lost` that is kept; 0 if there is none.
    last_kept : largest value of the grid kept together with its lower neighbour; `kept_below` if that is larger.
    share_kept : share of the grid values between `lost` and `last_kept` that are kept, 0 to 1.
    searched_to : largest value tried.
    """

    lost: float
    kept_below: float
    last_kept: float
    share_kept: float
    searched_to: float


def search_band(grid: Grid) -> BandSearch:
    """Yield disturbances, receive True for each that is kept, and return the band when both ends are known."""
    first = 0
    while not (yield np.array([grid.value(first)]))[0]:
        if grid.value(first) <= grid.floor:
            return Band(grid.value(first), 0.0, 0.0, 0.0, grid.value(first))
        first -= 2 * grid.decade
    kept = {first: True}
    loss: int | None = None
    last = first  # index of the largest value that is kept together with its lower neighbour
    top = first
    while grid.value(top + 1) <= grid.top:
        if loss is not None and grid.value(top) > BEYOND * grid.value(max(last, loss)):
            break
        requested = range(top + 1, top + 1 + grid.batch)
        inside = [k for k in requested if grid.value(k) <= grid.top]
        for k, answer in zip(inside, (yield np.array([grid.value(k) for k in inside])), strict=True):
            kept[k] = bool(answer)
            if not kept[k] and loss is None:
                loss = k
            if kept[k] and kept[k - 1]:
                last = k
        top = inside[-1]
    if loss is None:
        return Band(math.inf, grid.value(top), grid.value(top), 0.0, grid.value(top))
    low, high = yield from _bisect(grid.value(loss - 1), grid.value(loss))
    if last < loss:
        return Band(high, low, low, 0.0, grid.value(top))
    between = [kept[k] for k in range(loss, last + 1)]
    return Band(high, low, grid.value(last), float(np.mean(between)), grid.value(top))


def _bisect(low: float, high: float) -> Generator[np.ndarray, np.ndarray, tuple[float, float]]:
    """Return (kept, lost): two close values between `low`, which is kept, and `high`, which is lost.

    `lost` is the smallest value tried that is lost, and `kept` the largest value tried below it.
    """
    for _ in range(ROUNDS):
        inner = np.geomspace(low, high, INTERIOR + 2)[1:-1]
        kept = yield inner
        ends = [low, *inner.tolist(), high]
        lost = [k for k in range(1, len(ends)) if k == len(ends) - 1 or not kept[k - 1]]
        low, high = ends[lost[0] - 1], ends[lost[0]]
    return low, high
