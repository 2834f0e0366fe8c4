"""A point of a plan becomes a trajectory under way: its parameters, its start, its first search."""

from __future__ import annotations

import math

from vibrodrive.jit.compile import inline, part, part_each
from vibrodrive.jit.trig import TWO_PI, TWO_PI_LOW, turns
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.certainty import heed_status, start_errors
from vibrodrive.kernels.codes import (
    CERTIFIED,
    DOWN,
    INFINITY,
    NONE_BEGUN,
    OF_THE_RECORD,
    OK,
    S1,
    S2,
    UP,
)
from vibrodrive.kernels.event import begin_state, finish_at_rest
from vibrodrive.kernels.history import clear_history
from vibrodrive.kernels.lane import STRIDE
from vibrodrive.kernels.margins import record_margin_of_force, record_margin_of_start, set_margin
from vibrodrive.kernels.motion import adhesive_force, evaluate_excitation, excitation
from vibrodrive.kernels.record import write_row
from vibrodrive.kernels.recurrence import clear_reference
from vibrodrive.kernels.release import release_down, release_up
from vibrodrive.kernels.switch import can_leave, commit_state, commit_time, commit_time_fast, decide, waits

LAST_PHASE = math.nextafter(TWO_PI, 0.0)
"""The largest phase of a start."""


@part
def set_parameters(w, k, i, points, row, method):
    """The parameters of a point, its start in time, and the ends of its waits at ε = 0.

    AF = A ε η² is the amplitude of the disturbance in H and ξ'', from eq. (9).
    """
    a, b, eps, eta = points[row, 0], points[row, 1], points[row, 2], points[row, 3]
    fast = is_disturbed(points, row)
    w[r.A + i] = a
    w[r.B + i] = b
    w[r.AF + i] = a * eps * eta * eta if fast else 0.0
    w[r.ETA + i] = eta if fast else 0.0
    w[r.INVERSE + i] = 1.0 / eta if fast else 0.0
    w[r.FRAC + i] = eta - float(math.floor(eta)) if fast else 0.0
    w[r.DTAU + i] = points[row, 4] if method != CERTIFIED else 1.0
    w[r.TOL + i] = points[row, 5]
    w[r.PF + i] = 0.0
    w[r.QF + i] = 0.0
    w[r.X_OFF + i] = 0.0
    w[r.V_OFF + i] = 0.0
    w[r.LATE + i] = 0.0
    w[r.THETA + i] = 0.0
    _, phi, _ = turns(points[row, 9], 0.0)
    w[r.SECTION + i] = phi
    w[r.COS_S + i], w[r.SIN_S + i] = excitation(a, phi, 0.0)
    n, phi, low = turns(points[row, 8], 0.0)
    if points[row, 8] < 0.0 and phi == 0.0 and n == 0.0:
        # the section point at 0 is still ahead, by less than φ has bits for
        n, phi, low = -1.0, LAST_PHASE, low + ((TWO_PI - LAST_PHASE) + TWO_PI_LOW)
    w[r.PHI + i] = phi
    w[r.LOW + i] = low
    w[r.PHI0 + i] = phi
    k[r.PERIOD + i] = int(n)
    k[r.PERIOD0 + i] = int(n)
    w[r.PHI_UP + i] = 0.0
    w[r.P_UP + i] = 0.0
    if a - 1.0 - b > 0.0:
        w[r.PHI_UP + i], w[r.P_UP + i] = release_up(a, b)
    w[r.PHI_DOWN + i] = 0.0
    w[r.P_DOWN + i] = 0.0
    if a > abs(1.0 - b):
        w[r.PHI_DOWN + i], w[r.P_DOWN + i] = release_down(a, b)


@inline
def is_disturbed(points, row):
    """Whether the disturbance of a point is anything at all."""
    return points[row, 0] * points[row, 2] * points[row, 3] * points[row, 3] > 0.0


@part_each("method")
def load(
    w, k, i, points, row, method, transient, periods, section, rows, off, stored, errors
):  # fmt: skip
    """Put a point into lane i at its start. False when the trajectory ends before any search."""
    set_parameters(w, k, i, points, row, method)
    for row_k in (r.GRID, r.SECTIONS, r.COUNT, r.SEARCH, r.IMPACTS):
        k[row_k + i] = 0
    for to in range(5):
        k[r.SWITCHES + to * STRIDE + i] = 0
    k[r.COUNTED + i] = k[r.PERIOD + i]
    k[r.POINT + i] = row
    k[r.STATUS + i] = OK
    clear_reference(w, k, i)
    clear_history(k, i, OF_THE_RECORD)
    w[r.WORK + i] = 0.0
    w[r.WORK_BOOKED + i] = 0.0
    w[r.REFINEMENT + i] = NONE_BEGUN
    set_margin(w, i, True, INFINITY)
    p, q, theta, pf, qf = evaluate_excitation(w, i, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i])
    left = float(transient + periods) * TWO_PI
    commit_time(w, k, i, True, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], left, p, q)
    commit_time_fast(w, i, True, theta, pf, qf, 0.0)
    force = adhesive_force(w, i, q, qf)
    x, v = points[row, 6], points[row, 7]
    w[r.X0 + i] = x
    if v != 0.0:
        state = UP if v > 0.0 else DOWN
        record_margin_of_start(w, k, i, v, force)
    else:
        state = decide(S2 if x > 0.0 else S1, 0.0, force)
        distance = abs(abs(force) - 1.0) if x > 0.0 else abs(force - 1.0)
        record_margin_of_force(w, k, i, distance, TWO_PI)
    commit_state(k, i, True, state)
    if rows is not None:
        stored[0] = 1
        write_row(w, k, i, 0, state, state, x, v, rows)
    if errors is not None:
        start_errors(w, i)
        heed_status(w, k, i)
    if waits(state) and not can_leave(w, i, state):
        finish_at_rest(w, k, i, transient, section, errors)
        return False
    begin_state(w, k, i, state, x, v, force, False, 0.0, 0.0, method)
    return True
