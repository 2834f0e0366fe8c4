"""Start of the trajectory of a point in a lane: parameters, initial values, first search.

`kernels/__init__.py` explains the terms.
"""

import math

from vibrodrive.jit.compile import formula, part, part_each
from vibrodrive.jit.trig import TWO_PI, TWO_PI_LOW, turns
from vibrodrive.kernels import certainty, event, history, margins, motion, record, recurrence, release, switch
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import CERTIFIED, DOWN, INFINITY, NONE_BEGUN, OF_THE_RECORD, OK, S1, S2, UP
from vibrodrive.kernels.outputs import Switch

LAST_PHASE = math.nextafter(TWO_PI, 0.0)  # largest phase at which a motion can start


@formula
def fast_amplitude(a, eps, eta):
    """Return A ε η², the amplitude of the disturbance in H and ξ'', eq. (9). Python code may call this with arrays."""
    return a * eps * eta * eta


@part
def set_parameters(w, k, i, points, row, method):
    """Set the parameters of the point `points[row]` in lane i, its start in time, and the ends of waits at ε = 0."""
    a, b, eps, eta = points[row, 0], points[row, 1], points[row, 2], points[row, 3]
    amplitude = fast_amplitude(a, eps, eta)
    fast = amplitude > 0.0
    w[r.A + i] = a
    w[r.B + i] = b
    w[r.AF + i] = amplitude if fast else 0.0
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
    w[r.COS_S + i], w[r.SIN_S + i] = motion.excitation(a, phi, 0.0)
    n, phi, low = turns(points[row, 8], 0.0)
    if points[row, 8] < 0.0 and phi == 0.0 and n == 0.0:
        # the start is before phase 0 by less than the last bit of φ, so a section point at phase 0 is after the start
        n, phi, low = -1.0, LAST_PHASE, low + ((TWO_PI - LAST_PHASE) + TWO_PI_LOW)
    w[r.PHI + i] = phi
    w[r.LOW + i] = low
    w[r.PHI0 + i] = phi
    k[r.PERIOD + i] = int(n)
    k[r.PERIOD0 + i] = int(n)
    w[r.PHI_UP + i] = 0.0
    w[r.P_UP + i] = 0.0
    if a - 1.0 - b > 0.0:
        w[r.PHI_UP + i], w[r.P_UP + i] = release.release_up(a, b)
    w[r.PHI_DOWN + i] = 0.0
    w[r.P_DOWN + i] = 0.0
    if a > abs(1.0 - b):
        w[r.PHI_DOWN + i], w[r.P_DOWN + i] = release.release_down(a, b)


@part_each("method")
def load(w, k, i, points, row, method, extent, section, log, errors):
    """Begin the trajectory of the point `points[row]` in lane i. Return False if the mass never moves."""
    set_parameters(w, k, i, points, row, method)
    for row_k in (r.GRID, r.SECTIONS, r.COUNT, r.SEARCH, r.IMPACTS):
        k[row_k + i] = 0
    for to in range(5):
        k[r.SWITCHES + to * r.STRIDE + i] = 0
    k[r.COUNTED + i] = k[r.PERIOD + i]
    k[r.POINT + i] = row
    k[r.STATUS + i] = OK
    recurrence.clear_reference(w, k, i)
    history.clear_history(k, i, OF_THE_RECORD)
    w[r.WORK + i] = 0.0
    w[r.WORK_BOOKED + i] = 0.0
    w[r.REFINEMENT + i] = NONE_BEGUN
    margins.set_margin(w, i, True, INFINITY)
    p, q, theta, pf, qf = motion.evaluate_excitation(w, i, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i])
    left = float(extent.transient + extent.periods) * TWO_PI
    switch.commit_time(w, k, i, True, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], left, p, q)
    switch.commit_time_fast(w, i, True, theta, pf, qf, 0.0)
    force = motion.adhesive_force(w, i, q, qf)
    x, v = points[row, 6], points[row, 7]
    w[r.X0 + i] = x
    if v != 0.0:
        state = UP if v > 0.0 else DOWN
        margins.record_margin_of_start(w, k, i, v, force)
    else:
        state = switch.decide(S2 if x > 0.0 else S1, 0.0, force)
        distance = abs(abs(force) - 1.0) if x > 0.0 else abs(force - 1.0)
        margins.record_margin_of_force(w, k, i, distance, TWO_PI)
    switch.commit_state(k, i, True, state)
    if log is not None:
        log.stored[0] = 1
        record.write_row(w, k, i, 0, Switch(state, state, x, v), log.rows)
    if errors is not None:
        certainty.start_errors(w, k, i)
    if switch.waits(state) and not switch.can_leave(w, i, state):
        event.finish_at_rest(w, k, i, extent.transient, section, errors)
        return False
    event.begin_state(w, k, i, state, event.Start(x, v, 0.0, 0.0), force, False, method)
    return True
