"""The search for a limit: which disturbances to try next, given which were kept.

A search is a generator: it yields the disturbances to be tried and is sent back, for each, whether the structure was
kept. So the disturbances requested by many searches can be computed together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import NamedTuple

import numpy as np

from vibrodrive.model.parameters import bad

INTERIOR = 7  # values between two neighbours of the grid in a round of bisection, which are computed together
ROUNDS = 2  # of bisection: they narrow a step of the grid 64-fold
BEYOND = 2.0  # multiple of the last value kept up to which the search goes on before nothing more is held to be kept


class Grid(NamedTuple):
    """The values of a disturbance that are tried."""

    value: Callable[[int], float]
    decade: int  # indices per factor of ten
    floor: float
    top: float
    batch: int  # values requested at a time: enough to keep all cores busy, few beyond what is needed


def _geometric(k: int) -> float:
    return 1e-6 * 1.15**k


def _round_values(k: int) -> float:
    """…, 0.001, 0.0011, …, 0.0099, 0.01, 0.011, …: two digits, as one would choose a step."""
    return float(f"{10 + k % 90}e{k // 90 - 4}")


GRIDS = {
    "eps": Grid(_geometric, 16, 1e-12, 1.0, 4),  # a narrow edge needs no finer grid than 1.15
    "dtau": Grid(_round_values, 90, 1e-8, 2 * math.pi, 16),  # isolated losses do
}


def check_disturbance(disturbance: object) -> str:
    """Return a name in GRIDS. Raises TypeError or ValueError for anything else."""
    if not isinstance(disturbance, str) or disturbance not in GRIDS:
        kind = ValueError if isinstance(disturbance, str) else TypeError
        raise kind(bad("disturbance", disturbance, "one of " + ", ".join(GRIDS)))
    return disturbance


BandSearch = Generator[np.ndarray, np.ndarray, "Band"]


class Band(NamedTuple):
    """The first value lost, the largest kept below it, the last kept; what of the values between is kept."""

    lost: float
    kept_below: float
    last_kept: float
    share_kept: float
    searched_to: float


def search_band(grid: Grid) -> BandSearch:
    """Yield disturbances, be sent whether each was kept, until both ends of the band are known."""
    first = 0
    while not (yield np.array([grid.value(first)]))[0]:
        if grid.value(first) <= grid.floor:
            return Band(grid.value(first), 0.0, 0.0, 0.0, grid.value(first))
        first -= 2 * grid.decade
    kept = {first: True}
    loss: int | None = None
    last = first  # of two neighbours kept
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
    """Narrow (kept, lost) around the first loss between them."""
    for _ in range(ROUNDS):
        inner = np.geomspace(low, high, INTERIOR + 2)[1:-1]
        kept = yield inner
        ends = [low, *inner.tolist(), high]
        lost = [k for k in range(1, len(ends)) if k == len(ends) - 1 or not kept[k - 1]]
        low, high = ends[lost[0] - 1], ends[lost[0]]
    return low, high
