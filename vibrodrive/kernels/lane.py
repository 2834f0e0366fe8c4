"""Memory of the trajectories of a batch: one lane for each, in a structure of arrays.

`LANES` trajectories advance together, as a batch. Quantity `Q` of lane `i` is `w[Q + i]` (float64) or `k[Q + i]`
(int64). With two flat arrays and constant offsets the compiler sees that rows never overlap, and vectorises.
"""

from __future__ import annotations

import math

import numpy as np

LANES = 64
"""Number of lanes: enough to hide latency, and few enough for the rows to remain in the first-level cache (72 × 101 × 8
B = 58 kB, of which a search uses a quarter; only single trajectories use the last eight rows)."""

STRIDE = LANES + 8
"""Distance of rows. If two rows are a multiple of a page apart, the processor takes a read of one row for a read of the
other that has just been written, and waits. With this distance, only every 64th row is so far from a given row; with
LANES it would be every eighth."""

ROWS_W = 109
ROWS_K = 36

LINE = 64
"""Bytes of a cache line."""

(
    # parameters of the trajectory; AF = A ε η² is the acceleration amplitude of the disturbance, INVERSE = 1/η (or 0
    # without one)
    A, B, AF, ETA, INVERSE, FRAC, DTAU, TOL, PHI0, SECTION, SIN_S, COS_S,
    # the ends of a wait at ε = 0: phase and A cos φ where H rises to 1, and where it falls to -1
    PHI_UP, P_UP, PHI_DOWN, P_DOWN,
    # the present segment: its start (φ = PHI + LOW, LOW below the last bit of PHI; X_OFF, V_OFF bound the rounding
    # errors of ξ and ξ' there, ROUNDING * LATE that of the instant at which a wait ended) ...
    PHI, LOW, THETA, X0, V0, A0, X_OFF, V_OFF, LATE,
    # ... and its closed form, eqs. (4), (5), (9), with the time counted from the start of the segment (see motion.py)
    L, P, Q, PF, QF,
    # the gap ξ as a shape, watched while the mass slides down
    XD2, XC1, XC2, XALF, XBEF, WATCHED_GAP, FALL_TOLERANCE,
    # the switching function that is searched, as a shape, and the bounds of its derivatives (see first_zero.py); for a
    # wait with a known end only SIG is set: the side of S4 at which the wait ends
    C0, D1, D2, C1, C2, AL, BE, ALF, BEF, BASE, SIG,
    M3, M2_SLOW, FAST_AMPLITUDE, SPAN, SPAN0, NOISE,
    # the search: cursor, cursor of the other side of S4, last cursor with ξ >= 0, limit, outcome, closest tangency as a
    # fraction, number of evaluations of the trajectory so far and at the last switch
    CURSOR, OTHER, LAST_NONNEGATIVE, LIMIT, OUTCOME, DIP_NUMERATOR, DIP_DENOMINATOR, WORK, WORK_BOOKED,
    # on a grid: values of the function at the cursor and at the grid point before it, NaN if not evaluated
    VALUE, BEFORE,
    # the refinement of its zero: bracket, the last three points with the values at two of them, stage, evaluations
    # (see muller.py)
    LOWER, UPPER, OLDER, OLDER_VALUE, OLD, OLD_VALUE, NEWEST, REFINEMENT, EVALUATED,
    # a search at ε = 0: its mode, its bracket, and the last slides: phase at their start, duration, and derivative of
    # the duration with respect to that phase (see undisturbed.py)
    SEARCH_MODE, LO, HI, BEGAN_UP, LASTED_UP, RATE_UP, BEGAN_DOWN, LASTED_DOWN, RATE_DOWN,
    # time left to the end of the record, smallest margin so far
    LEFT, MARGIN,
    # the section point on the way to the switch
    POINT_X, POINT_V,
    # the reference: an earlier state with which the state of a motion at ε = 0 is compared (see recurrence.py). Its
    # quantities DECISIVE, and the number of evaluations up to it
    REFERENCE_PHI, _, _, _, _, _, _, _, REFERENCE_WORK,
    # the end of a state in a batch of switches; the last main impact before the reference (see record.py)
    END_PHI, END_GAP, END_SPEED, REFERENCE_IMPACT_PHI, REFERENCE_IMPACT_SPEED,
    # errors of the present segment, and the first period without known errors (see certainty.py)
    V_SHARE, X_SHARE, V_MORE, X_MORE, SHIFT, BEGUN_LATE, BEGUN_JUMP, CERTAIN_UNTIL,
) = (STRIDE * row for row in range(ROWS_W))  # fmt: skip

(
    STATE, PERIOD, PERIOD0, GRID, SEARCH, POINT, SECTIONS, COUNTED, COUNT, STATUS,
    # work left by a batch of switches (switch_*.py), and the number of the section point before the next switch
    LEFT_OVER, SLOT,
    # the period of the reference, and the number of section points written up to it; the number of times that the mass
    # has left the obstacle since the reference, and the number after which it is replaced (see recurrence.py)
    REFERENCE_PERIOD, REFERENCE_SECTIONS, SINCE, WINDOW,
    # number of switches into each of the five states, in the order of `State`: so far, and up to the reference
    SWITCHES, _, _, _, _, REFERENCE_SWITCHES, _, _, _, _,
    # ENDED, END_PERIOD: number of the switching function that ended a state in a batch of switches, and the excitation
    # period in which the state ended. IMPACTS, REFERENCE_IMPACTS: number of main impacts written so far, and up to the
    # reference. REFERENCE_IMPACT_PERIOD: excitation period of the last main impact before the reference (record.py)
    ENDED, END_PERIOD, IMPACTS, REFERENCE_IMPACTS, REFERENCE_IMPACT_PERIOD,
    # switches that the lane stores (history.py): its slot, the choice of the switches to store, their number, the
    # number of those that are already added to the totals, and the number up to the reference
    HISTORY_SLOT, HISTORY_KEEPS, HISTORY_COUNT, HISTORY_ADDED, REFERENCE_HISTORY,
) = (STRIDE * row for row in range(ROWS_K))  # fmt: skip


def new_lanes(threads: int) -> tuple[np.ndarray, np.ndarray]:
    """Return memory (w, k): in [thread, 0] the lanes of a thread, in [thread, 1] its tables and lists."""
    shapes = ((threads, 2, ROWS_W * STRIDE), float), ((threads, 2, ROWS_K * STRIDE), np.int64)
    w, k = (_at_cache_line(np.zeros(math.prod(shape) + LINE // 8, kind), shape) for shape, kind in shapes)
    return w, k


def _at_cache_line(memory: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    """Return an array in `memory` that begins at a cache line: a vector register is read from one line, not two."""
    first = -memory.ctypes.data % LINE // 8
    return memory[first : first + math.prod(shape)].reshape(shape)
