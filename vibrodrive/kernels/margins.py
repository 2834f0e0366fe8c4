"""How close a trajectory's decisions came to going the other way, and which of them rounding could have turned.

A decision's distance from its opposite is ξ at a reversal in the air; the depth below 0 of the free flight's next
reversal at an impact; ||H| - 1| where H decides in the air and |H - 1| at the obstacle, which carries
H < -1; and how far a switching function stayed from a zero it did not have, or passed one it did (a
tangency). `margin` is the smallest of them. Below the rounding of the distance itself the trajectory
is TOO_CLOSE to call: it goes on, but the other branch would be as good. Both are said of each switch from the state
it starts from; what that state is off by is carried along in certainty.py, where it is asked for.
"""

from __future__ import annotations

from vibrodrive.jit.branchless import choose, fma
from vibrodrive.jit.compile import inline
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import NEVER_LEAVES, OK, S4, TOO_CLOSE

ROUNDING = 2.0**-49
"""Eight units in the last place: a distance below this share of the terms it is a difference of may be nothing."""

SUSPECT = 1e-4
"""Distances in H and ξ' above this share of their terms are never within rounding, and their bound is not worth
its cost."""


@inline
def suspect(w, i):
    """Distances in H and ξ' of the segment under way above this are never within rounding."""
    return SUSPECT * (magnitude_scale(w, i) + abs(w[r.V0 + i]))


@inline
def set_margin(w, i, where, margin):
    """The smallest distance of a decision from its opposite, so far; it judges nothing, being beyond rounding."""
    w[r.MARGIN + i] = choose(where, margin, w[r.MARGIN + i])


@inline
def record_margin(w, k, i, distance, bound):
    """A decision was taken `distance` away from its opposite; `bound` is the rounding of that distance."""
    if distance < w[r.MARGIN + i]:
        w[r.MARGIN + i] = distance
    if distance <= bound and k[r.STATUS + i] == OK:
        k[r.STATUS + i] = TOO_CLOSE


@inline
def gap_rounding(w, i, h):
    """How far rounding can have put ξ off at h after the last switch.

    What the start was off by, and the rounding of what has been added up since: little, where little time passed.
    """
    return gap_rounding_beside(w, i, h, fma(w[r.V_OFF + i], h, w[r.X_OFF + i]))


@inline
def gap_rounding_beside(w, i, h, off):
    """The same where what the start was off by makes `off` at h."""
    eta, inverse = w[r.ETA + i], w[r.INVERSE + i]
    second, third = start_terms(w, i)
    sums = fma(fma(fma(third, h, second), h, abs(w[r.V0 + i])), h, abs(w[r.X0 + i]))
    near = fma(ROUNDING, sums, off)
    far = far_rounding(w, i, h, off, w[r.AF + i] * inverse, inverse)
    return choose((1.0 + eta) * h < 0.7, near, far)


@inline
def start_terms(w, i):
    """What ξ'' at the start of a segment and its derivative are made of.

    Where a stick or rest has just ended ξ'' is known to be 0; elsewhere, with ξ' ≠ 0, it may round to that. Under a
    disturbance rounding puts that instant off by LATE, and H' there by H'' times as much.
    """
    eta = w[r.ETA + i]
    rate = w[r.A + i] + w[r.AF + i] * eta
    second = choose((w[r.A0 + i] == 0.0) & (w[r.V0 + i] == 0.0), 0.0, magnitude_scale(w, i))
    return second, fma(w[r.LATE + i], fma(w[r.AF + i] * eta, eta, w[r.A + i]), rate)


@inline
def far_rounding(w, i, h, off, fast, inverse):
    """`gap_rounding` where h is not small; `fast` = A ε η, the amplitude of the disturbance in ξ'."""
    pull = abs(w[r.XC2 + i]) + 1.0 + w[r.B + i]
    speed = abs(w[r.V0 + i]) + w[r.A + i] + fast
    sums = fma(fma(pull, h, speed), h, abs(w[r.X0 + i]) + w[r.A + i])
    return fma(ROUNDING, fma(fast, inverse, sums), off)


@inline
def velocity_rounding(w, i, h):
    """How far rounding can have put ξ' off at h after the last switch."""
    return velocity_rounding_beside(w, i, h, w[r.V_OFF + i])


@inline
def velocity_rounding_beside(w, i, h, off):
    """The same where the start was off by `off`."""
    eta = w[r.ETA + i]
    if (1.0 + eta) * h < 0.7:
        second, third = start_terms(w, i)
        sums = abs(w[r.V0 + i]) + (second + third * h) * h
    else:
        fast = w[r.AF + i] / eta if eta > 0.0 else 0.0
        sums = abs(w[r.V0 + i]) + (abs(w[r.L + i]) + 1.0 + w[r.B + i]) * h + w[r.A + i] + fast
    return off + ROUNDING * sums


@inline
def magnitude_scale(w, i):
    """What H and ξ' are made of."""
    return 1.0 + w[r.A + i] + w[r.AF + i] + w[r.B + i]


@inline
def record_margin_of_force(w, k, i, distance, late):
    """A decision by H, at a switch that rounding can delay by ROUNDING * late."""
    slope = abs(w[r.P + i] + w[r.ETA + i] * w[r.PF + i])
    record_margin(w, k, i, distance, ROUNDING * (magnitude_scale(w, i) + slope * late))


@inline
def record_margin_of_start(w, k, i, v, force):
    """A motion starts with ξ' = v: where H rounds to ±1, ξ'' may oppose a tiny v and turn it at once.

    With |ξ''| < δ, the rounding of H, ξ' falls by δ²/2|H'| at most before H' prevails, or about δ² over the square root
    of δ |H''| where H' is as small.
    """
    slope = w[r.P + i] + w[r.ETA + i] * w[r.PF + i]
    bend = w[r.A + i] + w[r.AF + i] * w[r.ETA + i] * w[r.ETA + i]
    off = ROUNDING * magnitude_scale(w, i)
    if abs(abs(force) - 1.0) <= off and v * v * (slope * slope + 3.0 * off * bend) <= 16.0 * off * off * off * off:
        record_margin(w, k, i, abs(v), abs(v))


@inline
def record_margin_of_reversal(w, k, i, h, force, acceleration):
    """A slide has ended in the air after h: ||H| - 1| decides. A zero of ξ' is late by its error over ξ''."""
    distance = abs(abs(force) - 1.0)
    if distance < suspect(w, i):
        late = velocity_rounding(w, i, h) / (ROUNDING * abs(acceleration) + 1e-300)
        record_margin_of_force(w, k, i, distance, TWO_PI + h + late)
    else:
        record_margin(w, k, i, distance, 0.0)


@inline
def record_margin_of_impact(w, k, i, h, force, v):
    """An impact with speed v after h: |H - 1| decides. A zero of ξ is late by its error over ξ'."""
    distance = abs(force - 1.0)
    if distance < SUSPECT * magnitude_scale(w, i):
        late = gap_rounding(w, i, h) / (ROUNDING * abs(v) + 1e-300)
        record_margin_of_force(w, k, i, distance, TWO_PI + h + late)
    else:
        record_margin(w, k, i, distance, 0.0)


@inline
def clear_tangency(w, i):
    """A state begins: no tangency has been met yet."""
    w[r.DIP_DENOMINATOR + i] = 0.0


@inline
def record_margin_of_tangency(w, k, i, h):
    """The closest the switching function came to 0, or past it, without or before its zero (first_zero.py)."""
    under = w[r.DIP_DENOMINATOR + i]
    if under > 0.0:
        near = w[r.DIP_NUMERATOR + i] / under
        if near < w[r.MARGIN + i] or near < suspect(w, i):
            force = k[r.SEARCH + i] >= S4
            record_margin(w, k, i, near, ROUNDING * magnitude_scale(w, i) if force else velocity_rounding(w, i, h))


@inline
def wait_end_distance(w, i, down):
    """A wait at ε = 0 ends: how far H goes past its boundary, and how far it stayed from the other."""
    distance = abs(w[r.A + i] - 1.0 - w[r.B + i])
    below = abs(w[r.A + i] - abs(1.0 - w[r.B + i]))
    return choose(down & (below < distance), below, distance)


@inline
def record_margin_of_rest(w, k, i, sticking):
    """A wait without end: H never reaches a boundary, by this much."""
    reach = w[r.A + i] + w[r.AF + i]
    distance = abs(1.0 + w[r.B + i] - reach)
    if sticking:
        below = abs(abs(1.0 - w[r.B + i]) - reach)
        distance = below if below < distance else distance
    record_margin(w, k, i, distance, ROUNDING * magnitude_scale(w, i))
    if k[r.STATUS + i] == OK:
        k[r.STATUS + i] = NEVER_LEAVES
