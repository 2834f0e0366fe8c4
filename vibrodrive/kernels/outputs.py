"""What kernels are asked for and what they write, in groups that are one argument each.

What is not wanted is None as a whole: Numba leaves out the branches of an argument that is None, not those of a field
that is None. So a group holds what is wanted together.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Extent(NamedTuple):
    """How long a motion is followed, and what a period of it may cost.

    transient, periods : excitation periods left out, and recorded
    budget : switches that one period may hold
    price : what an evaluation of a search costs of that, in switches
    """

    transient: int
    periods: int
    budget: int
    price: float


class Outcome(NamedTuple):
    """What each motion ends with: status int8 (n,), margin float64 (n,), counts int64 (n, 5), work float64 (n,)."""

    status: np.ndarray
    margin: np.ndarray
    counts: np.ndarray
    work: np.ndarray


class Recorder(NamedTuple):
    """Memory for summaries, and the summaries.

    history float64 (LANES, ROWS, 6), totals float64 (LANES, TOTALS), or (LANES, 0) where no summary is wanted
    summary float64 (n, OUT)
    """

    history: np.ndarray
    totals: np.ndarray
    summary: np.ndarray


class Log(NamedTuple):
    """The switches of one motion: rows SWITCH (cap,) and how many there were, stored int64 (1,)."""

    rows: np.ndarray
    stored: np.ndarray


class Errors(NamedTuple):
    """Where bounds of errors are written.

    section float64 (n, periods, 2): of ξ and ξ' at each section point; (n, 1, 2): the largest of the record
    until float64 (n,): the period from which on nothing is certain; inf where all is
    rows float64 (cap, 3): of each switch (time, ξ, ξ'); of one motion
    """

    section: np.ndarray
    until: np.ndarray
    rows: np.ndarray | None = None


class Switch(NamedTuple):
    """A switch as it is written: the states before and after it, ξ and ξ' just before it."""

    before: int
    after: int
    x: float
    v: float
