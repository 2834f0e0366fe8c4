"""Groups of kernel arguments: settings and outputs.

An output group that is not needed is None. Numba removes branches for an argument that is None, but not for a field
that is None. So each group contains arrays that are needed together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from vibrodrive.jit.compile import inline

if TYPE_CHECKING:
    from vibrodrive.model.names import Settings


class Extent(NamedTuple):
    """Length of a motion, and limit of its cost. The unit of cost is the cost of one switch.

    transient, periods : number of excitation periods before the record, and of the record
    budget : largest cost of one excitation period
    """

    transient: int
    periods: int
    budget: int


def numbers_of(settings: Settings, lanes: int) -> np.ndarray:
    """Return (transient, periods, budget, lanes), int64 (4,); `lanes` is the number of lanes to use."""
    s = settings
    return np.array([s.transient, s.periods, s.budget, lanes], np.int64)


@inline
def extent_of(numbers):
    """Return the extent of motions from the result of `numbers_of`."""
    return Extent(numbers[0], numbers[1], numbers[2])


class Outcome(NamedTuple):
    """Results of each motion.

    status int8 (n,), margin float64 (n,): status, and smallest margin of a decision
    counts int64 (n, 5): number of switches into each state in the record
    work float64 (n,): number of evaluations of switching functions
    """

    status: np.ndarray
    margin: np.ndarray
    counts: np.ndarray
    work: np.ndarray


class Recorder(NamedTuple):
    """Summaries, and the memory that their computation needs (history.py, summary.py).

    history float64 (LANES, APART, 6): memory for switches
    totals float64 (LANES, TOTALS): memory for totals; (LANES, 0) if no summaries are computed
    summary float64 (n, OUT): summary of each motion
    grid : whether the method uses a grid
    """

    history: np.ndarray
    totals: np.ndarray
    summary: np.ndarray
    grid: bool


class Log(NamedTuple):
    """Switches of one motion: rows SWITCH (cap,), and stored int64 (1,), the number of rows that all switches need."""

    rows: np.ndarray
    stored: np.ndarray


class Errors(NamedTuple):
    """Output arrays for bounds of errors.

    section float64 (n, periods, 2): bounds for ξ and ξ' at each section point; (n, 1, 2): largest bounds of the record
    until float64 (n,): first period in which a decision may be wrong; inf if all decisions are certain
    rows float64 (cap, 3): bounds for time, ξ and ξ' at each switch of one motion
    """

    section: np.ndarray
    until: np.ndarray
    rows: np.ndarray | None = None


class Switch(NamedTuple):
    """Recorded data of a switch: the states before and after it, and ξ and ξ' just before it."""

    before: int
    after: int
    x: float
    v: float
