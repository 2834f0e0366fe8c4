"""The memory of a trajectory under way: one lane of a structure of arrays.

`LANES` trajectories advance together, as a batch. Quantity `Q` of lane `i` is `w[Q + i]` (float64) or `k[Q + i]`
(int64): one flat array each with constant offsets, so that the compiler sees that rows never overlap and vectorises.
"""

from __future__ import annotations

import math

import numpy as np

LANES = 64
"""Wide enough to hide latency, small enough for the rows to stay in the first-level cache (72 × 101 × 8 B = 58 kB,
of which a search touches a quarter; the last eight rows belong to single trajectories alone)."""

STRIDE = LANES + 8
"""From one row to the next. Rows a page apart would be taken for the same place when one is written and the other read
soon after; like this that is each 64th, not each eighth."""

ROWS_W = 109
ROWS_K = 36

LINE = 64
"""Bytes of a line of the cache."""

(
    # what the trajectory is given; AF = A ε η² is the acceleration amplitude of the
    # disturbance, INVERSE = 1/η (or 0 without one)
    A, B, AF, ETA, INVERSE, FRAC, DTAU, TOL, PHI0, SECTION, SIN_S, COS_S,
    # the ends of a wait at ε = 0: phase and A cos φ where H rises to 1, and where it falls to -1
    PHI_UP, P_UP, PHI_DOWN, P_DOWN,
    # the segment under way: where it began (φ = PHI + LOW, LOW below the last bit of PHI; X_OFF, V_OFF
    # bound what rounding has done to ξ and ξ' there, LATE to the instant at which a wait ended) ...
    PHI, LOW, THETA, X0, V0, A0, X_OFF, V_OFF, LATE,
    # ... and its closed form, eqs. (4), (5), (9) relative to that instant (see motion.py)
    L, P, Q, PF, QF,
    # the gap ξ as a shape, watched while the mass slides down
    XD2, XC1, XC2, XALF, XBEF, WATCHED_GAP, FALL_TOLERANCE,
    # the switching function searched, as a shape, and the bounds of its derivatives (see first_zero.py); where the end
    # of a wait is known beforehand only SIG is set, the side of S4
    C0, D1, D2, C1, C2, AL, BE, ALF, BEF, BASE, SIG,
    M3, M2_SLOW, FAST_AMPLITUDE, SPAN, SPAN0, NOISE,
    # the search: cursor, the other side's cursor, last cursor with ξ >= 0, its end, what it met, the closest
    # it came to a tangency, its cost so far and at the last switch
    CURSOR, OTHER, LAST_NONNEGATIVE, LIMIT, OUTCOME, DIP_NUMERATOR, DIP_DENOMINATOR, WORK, WORK_BOOKED,
    # on a grid: the function's values at the cursor and at the grid point before, NaN where it was not looked at
    VALUE, BEFORE,
    # the refinement of its zero: bracket, the last three points with the values at two of them, how far it has come,
    # its evaluations (see muller.py)
    LOWER, UPPER, OLDER, OLDER_VALUE, OLD, OLD_VALUE, NEWEST, REFINEMENT, EVALUATED,
    # a search at ε = 0: its mode, its bracket, and the last slides: phase at their start, how long they took and
    # by how much longer a later one does (see undisturbed.py)
    SEARCH_MODE, LO, HI, BEGAN_UP, LASTED_UP, RATE_UP, BEGAN_DOWN, LASTED_DOWN, RATE_DOWN,
    # time left to the end of the record, smallest margin so far
    LEFT, MARGIN,
    # the section point on the way to the switch
    POINT_X, POINT_V,
    # where a motion at ε = 0 may come back to: what decides what follows, and its cost so far (see recurrence.py)
    REFERENCE_PHI, _, _, _, _, _, _, _, REFERENCE_WORK,
    # where a batch of switches has come to, and the last main impact at the reference (see record.py)
    END_PHI, END_GAP, END_SPEED, REFERENCE_IMPACT_PHI, REFERENCE_IMPACT_SPEED,
    # what the segment under way is off by from its start on, and from which period on that is not known
    # (see certainty.py)
    V_SHARE, X_SHARE, V_MORE, X_MORE, SHIFT, BEGUN_LATE, BEGUN_JUMP, CERTAIN_UNTIL,
) = (STRIDE * row for row in range(ROWS_W))  # fmt: skip

(
    STATE, PERIOD, PERIOD0, GRID, SEARCH, POINT, SECTIONS, COUNTED, COUNT, STATUS,
    # what a batch of switches (switch_*.py) has left to do, and the number of the section point before the next switch
    LEFT_OVER, SLOT,
    # at the reference: period, section points written; departures since, and how many at most (see recurrence.py)
    REFERENCE_PERIOD, REFERENCE_SECTIONS, SINCE, WINDOW,
    # switches so far into each of the five states, in the order of `State`, and how many there were at the reference
    SWITCHES, _, _, _, _, REFERENCE_SWITCHES, _, _, _, _,
    # what has ended in a batch of switches, and when; main impacts written, and at the reference (record.py)
    ENDED, END_PERIOD, IMPACTS, REFERENCE_IMPACTS, REFERENCE_IMPACT_PERIOD,
    # where it keeps its switches, which, how many, of which added to its totals, and at the reference (history.py)
    HISTORY_SLOT, HISTORY_KEEPS, HISTORY_COUNT, HISTORY_ADDED, REFERENCE_HISTORY,
) = (STRIDE * row for row in range(ROWS_K))  # fmt: skip


def new_lanes(threads: int) -> tuple[np.ndarray, np.ndarray]:
    """Memory (w, k) for the lanes of each thread: [thread, 0] the lanes, [thread, 1] tables and lists."""
    shapes = ((threads, 2, ROWS_W * STRIDE), float), ((threads, 2, ROWS_K * STRIDE), np.int64)
    w, k = (_at_cache_line(np.zeros(math.prod(shape) + LINE // 8, kind), shape) for shape, kind in shapes)
    return w, k


def _at_cache_line(memory: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """An array in `memory` that begins where a line of the cache does: a register is then read from one, not two."""
    first = -memory.ctypes.data % LINE // 8
    return memory[first : first + math.prod(shape)].reshape(shape)
