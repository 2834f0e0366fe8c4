"""Groups of kernel arguments: settings and outputs.

An output group that is not needed is None. Numba prunes branches on an argument that is None, but not on a field that
is None. So each group holds arrays that are needed together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vibrodrive.jit.compile import inline

if TYPE_CHECKING:
    from vibrodrive.model.names import Settings


class Extent(NamedTuple):
    """Length of a motion, and its cost limit.

    transient, periods : excitation periods before the record, and of the record
    budget : largest number of switches of one period
    price : share of the budget that one evaluation of a search costs, in switches
    """

    transient: int
    periods: int
    budget: int
    price: float


def numbers_of(settings: Settings, lanes: int) -> np.ndarray:
    """Return the settings that kernels read, and the number of lanes of a thread: int64 (5,)."""
    s = settings
    return np.array([s.transient, s.periods, s.budget, s.literal, lanes], np.int64)


@inline
def extent_of(numbers, price):
    """Return the length of motions from `numbers_of` their settings."""
    return Extent(numbers[0], numbers[1], numbers[2], price)


class Outcome(NamedTuple):
    """Results of each motion: status int8 (n,), margin float64 (n,), counts int64 (n, 5), work float64 (n,)."""

    status: np.ndarray
    margin: np.ndarray
    counts: np.ndarray
    work: np.ndarray


class Recorder(NamedTuple):
    """Memory for summaries, and the summaries.

    history float64 (LANES, APART, 6), totals float64 (LANES, TOTALS), or (LANES, 0) without summaries
    summary float64 (n, OUT)
    """

    history: np.ndarray
    totals: np.ndarray
    summary: np.ndarray


class Log(NamedTuple):
    """Switches of one motion: rows SWITCH (cap,), and stored int64 (1,), the number of rows for all of them."""

    rows: np.ndarray
    stored: np.ndarray


class Errors(NamedTuple):
    """Output arrays for bounds of errors.

    section float64 (n, periods, 2): bounds for ξ and ξ' at each section point; (n, 1, 2): largest bounds of the record
    until float64 (n,): first period in which a decision may be wrong; inf if all are certain
    rows float64 (cap, 3): bounds (time, ξ, ξ') for each switch of one motion
    """

    section: np.ndarray
    until: np.ndarray
    rows: np.ndarray | None = None


class Switch(NamedTuple):
    """A switch as it is written: the states before and after it, and ξ and ξ' just before it."""

    before: int
    after: int
    x: float
    v: float
