"""Memory of the trajectories of a batch: one lane for each, in a structure of arrays.

`LANES` trajectories advance together, as a batch. Quantity `Q` of lane `i` is `w[Q + i]` (float64) or `k[Q + i]`
(int64). The values of one quantity in all lanes are a row. Because the arrays are flat and the offsets constant, the
compiler knows that rows never overlap, and vectorises. `kernels/__init__.py` explains the terms.
"""

import ctypes
from typing import Any

import numpy as np

LANES = 64
"""Number of lanes. It is large enough to hide latency, and so small that the rows of a search remain in the first-level
cache. All rows of `w` take 72 × 110 × 8 B = 63 kB, of which a search uses a quarter to a third. Only single
trajectories use the last nine rows."""

STRIDE = LANES + 8
"""Distance between successive rows. If two rows are a multiple of a page apart, a read of one row is slow after a write
to the other, because the processor confuses their addresses. With STRIDE only every 64th row is a multiple of a page
away from a given row. With LANES as the distance it would be every eighth row."""

ROWS_W = 110
ROWS_K = 36

LINE = 64  # length of a cache line, in bytes

(
    # parameters of the trajectory. AF = A ε η² is the acceleration amplitude of the disturbance. INVERSE is 1/η, or 0
    # without a disturbance. FRAC is the fractional part of η. DTAU is 1 without a grid. PHI0 is the phase of the start,
    # SECTION is φ_s. SIN_S and COS_S are A sin φ_s and A cos φ_s
    A, B, AF, ETA, INVERSE, FRAC, DTAU, TOL, PHI0, SECTION, SIN_S, COS_S,
    # the ends of waits at ε = 0: phase φ at which H rises to 1, and A cos φ there; the same for H falling to -1
    PHI_UP, P_UP, PHI_DOWN, P_DOWN,
    # start of the present segment: φ = PHI + LOW, with LOW below the last bit of PHI. X_OFF and V_OFF bound the
    # rounding errors of ξ and ξ' at this start. ROUNDING * LATE bounds the rounding error of the end of a wait
    PHI, LOW, THETA, X0, V0, A0, X_OFF, V_OFF, LATE,
    # closed form of the present segment, eqs. (4), (5), (9), with the time counted from its start. motion.py explains
    # these letters and the term shape
    L, P, Q, PF, QF,
    # ξ as a shape. The search during a slide down also computes ξ: it begins with ξ = WATCHED_GAP, and the search ends
    # if ξ < -FALL_TOLERANCE. In other searches both numbers are infinite
    XD2, XC1, XC2, XALF, XBEF, WATCHED_GAP, FALL_TOLERANCE,
    # switching function of the search as a shape, and bounds of its derivatives (see first_zero.py). For a wait with a
    # known end only SIG is set: 1 if H falls to -1 at the end, -1 if H rises to 1
    C0, D1, D2, C1, C2, AL, BE, ALF, BEF, BASE, SIG,
    M3, M2_SLOW, FAST_AMPLITUDE, SPAN, SPAN0, NOISE,
    # search: cursor; cursor of the other side of S4; last cursor with ξ >= 0; limit; outcome; closest tangency as a
    # fraction; numbers of evaluations of the trajectory, so far and at the last switch
    CURSOR, OTHER, LAST_NONNEGATIVE, LIMIT, OUTCOME, DIP_NUMERATOR, DIP_DENOMINATOR, WORK, WORK_BOOKED,
    # on a grid: values of the function at the cursor and at the grid point before, NaN if they are not evaluated
    VALUE, BEFORE,
    # refinement of a zero on a grid: bracket; the last three points, and the values at two of these points; stage;
    # number of evaluations (see muller.py)
    LOWER, UPPER, OLDER, OLDER_VALUE, OLD, OLD_VALUE, NEWEST, REFINEMENT, EVALUATED,
    # search at ε = 0: mode and bracket; for the last slides up and down the phase at the start, the duration, and the
    # derivative of the duration with respect to this phase (see undisturbed.py)
    SEARCH_MODE, LO, HI, BEGAN_UP, LASTED_UP, RATE_UP, BEGAN_DOWN, LASTED_DOWN, RATE_DOWN,
    # time from the last switch to the end of the record; smallest margin so far
    LEFT, MARGIN,
    # section point that precedes the next switch
    POINT_X, POINT_V,
    # reference: an earlier state with which the state of a motion at ε = 0 is compared (see recurrence.py). The eight
    # quantities DECISIVE, and the number of evaluations up to the reference
    REFERENCE_PHI, _, _, _, _, _, _, _, REFERENCE_WORK,
    # end of a state in a batch of switches (`note_end` in switch.py); last main impact before the reference (record.py)
    END_PHI, END_GAP, END_SPEED, REFERENCE_IMPACT_PHI, REFERENCE_IMPACT_SPEED,
    # errors of the present segment, and the first period without known bounds of errors (see certainty.py)
    V_SHARE, X_SHARE, V_MORE, X_MORE, SHIFT, BENT, BEGUN_LATE, BEGUN_JUMP, CERTAIN_UNTIL,
) = (STRIDE * row for row in range(ROWS_W))  # fmt: skip

(
    # state; excitation period of the last switch, and of the start; number of the grid point of the last switch (method
    # `fixed`); switching function of the search; row of the point; number of section points written; period whose cost
    # is counted, and this cost; status
    STATE, PERIOD, PERIOD0, GRID, SEARCH, POINT, SECTIONS, COUNTED, COUNT, STATUS,
    # work that remains after a batch of switches (codes.py); number of the section point that precedes the next switch
    LEFT_OVER, SLOT,
    # period of the reference, and number of section points up to the reference; number of departures since the
    # reference, and number of departures after which the reference is replaced (see recurrence.py)
    REFERENCE_PERIOD, REFERENCE_SECTIONS, SINCE, WINDOW,
    # number of switches into each of the five states, in the order of `State`: so far, and up to the reference
    SWITCHES, _, _, _, _, REFERENCE_SWITCHES, _, _, _, _,
    # ENDED, END_PERIOD: number of the switching function that ended a state in a batch of switches, and the excitation
    # period in which the state ended. IMPACTS, REFERENCE_IMPACTS: number of main impacts written so far, and up to the
    # reference. REFERENCE_IMPACT_PERIOD: excitation period of the last main impact before the reference (record.py)
    ENDED, END_PERIOD, IMPACTS, REFERENCE_IMPACTS, REFERENCE_IMPACT_PERIOD,
    # stored switches (history.py): slot of the lane; which switches are stored (codes.py); their number; number of
    # those that are already added to the totals; number up to the reference
    HISTORY_SLOT, HISTORY_KEEPS, HISTORY_COUNT, HISTORY_ADDED, REFERENCE_HISTORY,
) = (STRIDE * row for row in range(ROWS_K))  # fmt: skip


_NO_BYTES = ctypes.c_char * 0


def address_of(array: Any) -> int:
    """Return the address of a contiguous, writable NumPy array, in a third of the time of `array.ctypes.data`."""
    return ctypes.addressof(_NO_BYTES.from_buffer(array))


def new_lanes(threads: int, motions: int = LANES) -> tuple[np.ndarray, np.ndarray]:
    """Return (w, k), float64 and int64: [thread, 0] is memory of lanes, and k[thread, 1] of a list of lanes.

    Only the lanes that this number of motions may use, in full registers, are set to 0. To set all of them would take
    longer than a short motion.
    """
    n_w, n_k = threads * ROWS_W, threads * 2 * ROWS_K
    memory = np.empty((n_w + n_k) * STRIDE + LINE // 8)
    first = -address_of(memory) % LINE // 8  # at a cache line, so each vector register loads one line
    rows = memory[first : first + (n_w + n_k) * STRIDE].reshape(-1, STRIDE)
    rows[:, : (motions + 7) & -8] = 0.0
    return rows[:n_w].reshape(threads, 1, -1), rows[n_w:].view(np.int64).reshape(threads, 2, -1)


def clear(w: np.ndarray, k: np.ndarray, motions: int) -> None:
    """Set the lanes in the memory of one thread to 0 that `new_lanes` sets to 0."""
    w.reshape(-1, STRIDE)[:, : (motions + 7) & -8] = 0.0
    k.reshape(-1, STRIDE)[:, : (motions + 7) & -8] = 0
