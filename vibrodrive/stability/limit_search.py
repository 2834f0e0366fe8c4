"""The search for a limit: choice of the next disturbances from the results of the previous ones.

A search is a generator. It yields disturbances to try. For each disturbance the search receives True if the
structure was *kept*, and False if the structure was *lost*. So the motions of many searches can be computed together.
"""

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from vibrodrive.model.spacing import geometric

INTERIOR = 7  # values that one round of bisection tries between two neighbouring values of the grid
ROUNDS = 2  # rounds of bisection; two rounds divide a step of the grid by 64
PAIR = 2  # least number of values of a round requested together; one at a time takes more sweeps, of few motions each
NEAR = 5  # the share kept at a value is that of this value and of so many neighbours on each side
BEYOND = 2.0  # the search ends at this multiple of `last_kept` or, if it is larger, of the first value lost


class Grid(NamedTuple):
    """Grid of the values of a disturbance that are tried: `value(k)` for integers k, from `floor` to `top`."""

    value: Callable[[int], float]
    decade: int  # number of values in a factor of ten, about
    floor: float
    top: float
    batch: int  # number of values after which the search decides whether to go on


GRIDS = {
    # one narrow edge: a ratio of 1.15 is enough. The last bits of a power of floats depend on the machine
    "eps": Grid(lambda k: 1e-6 * float(Fraction(1.15) ** k), 16, 1e-12, 1.0, 4),
    # isolated losses: the grid is finer, …, 0.0099, 0.01, 0.011, …, of two digits, like a step chosen by hand
    "dtau": Grid(lambda k: float(f"{10 + k % 90}e{k // 90 - 4}"), 90, 1e-8, 2 * math.pi, 16),
}


BandSearch = Generator[np.ndarray, np.ndarray, "Band"]


class Band(NamedTuple):
    """Band of a limit, in which some values are lost and others kept (limit.py).

    lost : first value lost; inf if no value up to `searched_to` is lost.
    kept_below : largest value found below `lost` that is kept; 0 if there is none.
    last_kept : largest value of the grid kept together with its lower neighbour; `kept_below` if that is larger.
    share_kept : share of the grid values between `lost` and `last_kept` that are kept, 0 to 1.
    searched_to : largest value tried.
    half_kept : largest value kept at which the share kept is at least a half; `kept_below` if that is larger.
    kept_at : for each value of the grid that was tried, in ascending order, True if it is kept.
    """

    lost: float
    kept_below: float
    last_kept: float
    share_kept: float
    searched_to: float
    half_kept: float
    kept_at: dict[float, bool]


def share_kept(kept_at: Mapping[float, bool]) -> np.ndarray:
    """Return the share kept at each value of `kept_at`, 0 to 1: of this value and of NEAR neighbours on each side.

    Values below those tried count as kept, values above as lost.
    """
    around = np.pad(np.array([*kept_at.values()], dtype=float), NEAR, constant_values=(1.0, 0.0))
    return np.convolve(around, np.ones(2 * NEAR + 1), "valid") / (2 * NEAR + 1)


def search_band(grid: Grid, ahead: Callable[[], int] = lambda: 1, begin: float = 0.0) -> BandSearch:
    """Yield disturbances, receive True for each that is kept, and return the band when both ends are known.

    The search requests together those values that it will probably need: until a value is lost the next `ahead()`
    values of the grid, and then so many of a round of bisection. So a search can fill the lanes of a kernel that other
    searches leave empty. This changes the number of requests, and not the result.

    The first value tried is one of the grid below `begin`, up to which all values should be kept; by default it is
    value 0. If it is lost, smaller values are tried.
    """
    value = grid.value
    tried: dict[float, bool] = {}
    first = begun = _index(grid, begin)
    while not (
        yield from _ask(tried, [value(first)], _up_to(grid, begun + 1, begun + ahead() - 1) if first == begun else [])
    )[0]:
        if value(first) <= grid.floor:
            return Band(value(first), 0.0, 0.0, 0.0, value(first), 0.0, {value(first): False})
        first -= 2 * grid.decade
    loss: int | None = None
    last = first  # index of the largest value that is kept together with its lower neighbour
    top = first
    while value(top + 1) <= grid.top:
        if loss is not None and value(top) > BEYOND * value(max(last, loss)):
            break
        needed = _up_to(grid, top + 1, top + grid.batch)
        lost = loss or next((top + 1 + i for i, x in enumerate(needed) if tried.get(x) is False), None)
        if lost is None:
            likely = _up_to(grid, top + 1, top + ahead())
        else:
            end = top
            while value(end) <= BEYOND * value(max(last, lost)):
                end += grid.batch
            likely = [*_up_to(grid, top + 1, end), *_between(value(lost - 1), value(lost))[: max(PAIR, ahead())]]
        for k, kept in enumerate((yield from _ask(tried, needed, likely)), top + 1):
            if not kept and loss is None:
                loss = k
            if kept and tried[value(k - 1)]:
                last = k
        top += len(needed)
    kept_at = {value(k): tried[value(k)] for k in range(first, top + 1)}
    if loss is None:
        return Band(math.inf, value(top), value(top), 0.0, value(top), value(top), kept_at)
    often = (x for x, share in zip(kept_at, share_kept(kept_at), strict=True) if kept_at[x] and share >= 0.5)
    half = max(often, default=0.0)
    low, high = yield from _bisect(tried, value(loss - 1), value(loss), ahead)
    last_kept, share = low, 0.0
    if last > loss:
        last_kept, share = value(last), float(np.mean([tried[value(k)] for k in range(loss, last + 1)]))
    return Band(high, low, last_kept, share, value(top), max(low, half), kept_at)


def _ask(
    tried: dict[float, bool], needed: Sequence[float], likely: Sequence[float] = ()
) -> Generator[np.ndarray, np.ndarray, list[bool]]:
    """Return for each value of `needed` whether it is kept.

    If one of them was not `tried` yet, it is requested together with the values that are `likely` to be needed next.
    """
    if any(x not in tried for x in needed):
        values = [x for x in dict.fromkeys([*needed, *likely]) if x not in tried]
        tried.update(zip(values, map(bool, (yield np.array(values))), strict=True))
    return [tried[x] for x in needed]


def _index(grid: Grid, most: float) -> int:
    """Return the number >= 0 of a value of a grid that is at most `most`, or 0.

    It is a multiple of `batch`, so that a search ends at the same value wherever it begins.
    """
    k = 0
    while grid.value(k + grid.batch) <= most:
        k += grid.batch
    return k


def _up_to(grid: Grid, start: int, stop: int) -> list[float]:
    """Return the values `start` to `stop` of a grid, without those above its top."""
    return [x for k in range(start, stop + 1) if (x := grid.value(k)) <= grid.top]


def _between(low: float, high: float) -> list[float]:
    """Return the values that one round of bisection tries between two values."""
    return geometric(low, high, INTERIOR + 2)[1:-1].tolist()


def _bisect(
    tried: dict[float, bool], low: float, high: float, ahead: Callable[[], int]
) -> Generator[np.ndarray, np.ndarray, tuple[float, float]]:
    """Return (kept, lost): two close values between `low`, which is kept, and `high`, which is lost.

    `lost` is the smallest value tried that is lost, and `kept` the value tried below it. Each round tries its values in
    ascending order until one is lost, so that few motions are computed that have no effect on the result.
    """
    for _ in range(ROUNDS):
        inner = _between(low, high)
        for k, x in enumerate(inner):
            if not (yield from _ask(tried, [x], inner[k : k + max(PAIR, ahead())]))[0]:
                high = x
                break
            low = x
    return low, high
