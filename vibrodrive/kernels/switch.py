"""Rules at a switch: the decision, the start of the next state, the cost. Each formula exists only here.

`event.py` applies any switch, in one lane. The `switch_*` modules apply ordinary switches (engine.py) in all lanes of a
batch. Both evaluate these formulas in the same order, so the bits of a trajectory do not depend on the module that
applied a switch. If the argument `where` is false, lane i is not changed: `where` is a mask in loops over lanes, and
True for a single lane. `kernels/__init__.py` explains the terms.
"""

from vibrodrive.jit.branchless import choose, put
from vibrodrive.jit.compile import inline
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import motion, release
from vibrodrive.kernels.codes import DOWN, IMPACT, REST, S1, S2, S3, S4, S5, STICK, UP, WRITE_POINT

SEARCH_PRICE = 1e-2
"""Cost of one evaluation in a search, in the unit of the cost of a switch. It is a part of the cost of a period, which
the budget limits."""

STEEP_COST = 1.0 / SEARCH_PRICE  # number of evaluations that cost as much of the budget as one switch


@inline
def decide_after_slide(impact, force):
    """Return the state after a slide, Fig. 2, where H = `force`; `impact` is true if the slide ends in an impact.

    A slide that ends in the air exactly where ξ' = 0 cannot be followed by a slide in the same direction. With method
    `fixed` the switch is late, so such a slide may follow; the mass then continues from rest (§5). At the obstacle the
    mass rests for H <= 1, because the obstacle supports the mass against any force towards the obstacle.
    """
    in_air = choose(force > 1.0, UP, choose(force < -1.0, DOWN, STICK))
    return choose(impact, choose(force > 1.0, UP, REST), in_air)


@inline
def decide(which, side, force):
    """Return the state after the zero of switching function `which`, where H = `force`.

    If which = S4, `side` > 0 means that sticking ends because 1 + H = 0.
    """
    leave = choose((which == S4) & (side > 0.0), DOWN, UP)
    return choose(which >= S4, leave, decide_after_slide(which == S1, force))


@inline
def waits(state):
    """Return whether `state` is a wait: sticking or resting."""
    return (state == STICK) | (state == REST)


@inline
def direction(state):
    """Return s of eqs. (4), (5): +1 for sliding up, -1 for sliding down, 0 for a wait."""
    return choose(state == UP, 1.0, choose(state == DOWN, -1.0, 0.0))


@inline
def begin(s, x, v, force, at_boundary, on_grid, b, inverse, field):
    """Return the segment of direction s (0: a wait) that begins with ξ = x and ξ' = v, eq. (6), where H = `force`.

    b = B and inverse = 1/η (0 without a disturbance). `field` is the excitation at the start. The segment begins with
    ξ'' = H - s, eq. (1), and continues by eqs. (4), (5).

    A slide from rest cannot begin with an acceleration against its direction. It begins with exactly ξ'' = 0 in two
    cases. In the first case a certified wait precedes it, whose end is at H = ±1 by definition (`at_boundary`). In the
    second case the computed ξ'' has the wrong sign. The cause is rounding or, on a grid (`on_grid`), the tolerance of
    Muller's method at the end of the wait.

    In both cases the slope L is changed by the same difference as ξ''. L is not changed for a certified motion with a
    disturbance, where this difference is the rounding error of A ε η². This error may be large, and L is multiplied by
    h²/2.
    """
    from_rest = v == 0.0
    a0 = force - s
    a0 = choose(from_rest & (at_boundary | (a0 * s < 0.0)), 0.0, a0)
    slope = choose(from_rest & (on_grid | (inverse == 0.0)), a0 - field.q - field.qf, -(b + s))
    square = inverse * inverse
    return motion.Segment(
        x, v, a0, slope, 0.5 * a0, v + (field.p + field.pf * inverse), 0.5 * slope,
        -field.pf * square, field.qf * square,
    )  # fmt: skip


@inline
def commit_segment(w, i, where, segment, x_off, v_off):
    """Set the segment of lane i; `x_off` and `v_off` bound the rounding errors of ξ and ξ' at its beginning."""
    put(w, r.X0 + i, where, segment.x)
    put(w, r.V0 + i, where, segment.v)
    put(w, r.V_OFF + i, where, v_off)
    put(w, r.X_OFF + i, where, x_off)
    put(w, r.A0 + i, where, segment.a0)
    put(w, r.L + i, where, segment.slope)
    put(w, r.XD2 + i, where, segment.xd2)
    put(w, r.XC2 + i, where, segment.xc2)
    put(w, r.XC1 + i, where, segment.xc1)


@inline
def commit_wait(w, k, i, to, x, x_off):
    """Begin a wait with a known end in lane i, at ξ = x."""
    k[r.STATE + i] = to
    w[r.X0 + i] = x
    w[r.X_OFF + i] = x_off
    w[r.V_OFF + i] = 0.0


@inline
def commit_segment_fast(w, i, where, segment):
    """Set the coefficients of the fast part of the segment of lane i."""
    put(w, r.XALF + i, where, segment.xalf)
    put(w, r.XBEF + i, where, segment.xbef)


@inline
def commit_state(k, i, where, to):
    """Set the state of lane i to `to`."""
    put(k, r.STATE + i, where, to)


@inline
def commit_time_fast(w, i, where, theta, pf, qf, late):
    """Set θ, AF cos θ = pf and AF sin θ = qf of lane i, and LATE of the end of a wait (motion.py)."""
    put(w, r.THETA + i, where, theta)
    put(w, r.PF + i, where, pf)
    put(w, r.QF + i, where, qf)
    put(w, r.LATE + i, where, late)


@inline
def commit_time(w, k, i, where, period, phi, low, left, p, q):
    """Set the time of lane i to (period, φ + low), the excitation A cos φ = p, A sin φ = q, and the time to the end."""
    put(k, r.PERIOD + i, where, period)
    put(w, r.PHI + i, where, phi)
    put(w, r.LOW + i, where, low)
    put(w, r.LEFT + i, where, left)
    put(w, r.P + i, where, p)
    put(w, r.Q + i, where, q)


@inline
def commit_cost(w, k, i, where, counted, cost):
    """Set the cost of period `counted` to `cost`, which includes the present switch and all evaluations so far."""
    put(w, r.WORK_BOOKED + i, where, w[r.WORK + i])
    put(k, r.COUNTED + i, where, counted)
    put(k, r.COUNT + i, where, cost)


@inline
def commit_departure(k, i, where):
    """Count a departure. Return the number of departures since the reference (recurrence.py) was set."""
    since = k[r.SINCE + i] + choose(where, 1, 0)
    k[r.SINCE + i] = since
    return since


@inline
def number_in_period(k, i):
    """Return the cost of the present period so far plus 1, the cost of the present switch."""
    return 1 + choose(k[r.COUNTED + i] == k[r.PERIOD + i], k[r.COUNT + i], 0)


@inline
def smaller(a, b):
    return choose(a < b, a, b)


@inline
def terminating_function(state):
    """Return the switching function whose first zero ends a state. For DOWN, S2 is searched before S1."""
    return choose(state == UP, S3, choose(state == DOWN, S2, choose(state == STICK, S4, S5)))


@inline
def can_leave(w, i, state):
    """Return whether H can reach a value at which the wait `state` ends: 1 or, if sticking, also -1."""
    return release.can_end(state, w[r.A + i] + w[r.AF + i], w[r.B + i])


SECTION_MARGIN = 1e-9
"""Time by which the second section point after the last switch must be later than the next switch. If this is not so,
`event.py` applies the switch, and determines whether the point or the switch is earlier."""


@inline
def in_record(w, k, i, period, phi, transient):
    """Return whether (period, φ) is after the transient. Without a transient the result is always true."""
    n = period - k[r.PERIOD0 + i]
    return (n > transient) | ((n == transient) & (phi > w[r.PHI0 + i])) | (transient == 0)


@inline
def section_due(w, k, i, count, period, phi, low, transient):
    """Return the time from (period, φ + low) to section point number `count` of the record, at τ = φ_s + 2πk."""
    first = k[r.PERIOD0 + i] + transient + choose(w[r.SECTION + i] > w[r.PHI0 + i], 0, 1)
    return motion.time_between(period, phi, low, first + count, w[r.SECTION + i])


@inline
def next_section_point(w, k, i, slot, period, phi, low, h, extent):
    """Return (due, passed, one) for section point number `slot` and a switch at the time h after (period, φ + low).

    due : time from (period, φ + low) to the point
    passed : true if the point is recorded and not after the switch
    one : true if the point after this point is certainly after the switch
    """
    due = section_due(w, k, i, slot, period, phi, low, extent.transient)
    return due, (due <= h) & (slot < extent.periods), due + TWO_PI > h + SECTION_MARGIN


@inline
def time_left(w, k, i, period, phi, low, extent):
    """Return the time from (period, φ + low) to the end of the record."""
    end = k[r.PERIOD0 + i] + extent.transient + extent.periods
    return motion.time_between(period, phi, low, end, w[r.PHI0 + i])


@inline
def mark_next_point(k, i, slot):
    """Set the number of the section point that precedes the next switch."""
    k[r.SLOT + i] = slot


@inline
def set_next_point(w, k, i, slot, x, v):
    """Store section point number `slot`, (x, v), which precedes the next switch. `write_points` writes it later."""
    mark_next_point(k, i, slot)
    w[r.POINT_X + i] = x
    w[r.POINT_V + i] = v


@inline
def commit_points(k, i, where, count):
    """Set the number of section points of lane i, including those that `write_points` will write."""
    put(k, r.SECTIONS + i, where, count)


@inline
def set_remaining_work(k, i, what):
    """Set the work that remains in lane i after a batch of switches (codes.py: DONE, UNUSUAL, …)."""
    k[r.LEFT_OVER + i] = what


@inline
def note_end(w, k, i, which, period, phi, x, v):
    """Store the end of a state in lane i, where the switching function `which` is zero.

    `keep_switch` (history.py) and `keep_impact` (record.py) use these values. If a wait with a known end follows, the
    same batch of switches also advances the lane to the end of this wait.
    """
    k[r.ENDED + i] = which
    k[r.END_PERIOD + i] = period
    w[r.END_PHI + i] = phi
    w[r.END_GAP + i] = x
    w[r.END_SPEED + i] = -v


@inline
def add_count(k, i, to, more):
    """Count `more` switches into state `to`."""
    k[r.SWITCHES + to * r.STRIDE + i] += more


@inline
def count_into(k, i, to):
    """Count a switch into state `to`."""
    add_count(k, i, to, 1)


@inline
def count_switch(k, i, recorded, impact, to):
    """Count a switch into state `to` if `recorded`, and the impact before it if `impact`."""
    k[r.SWITCHES + IMPACT * r.STRIDE + i] += choose(recorded & impact, 1, 0)
    k[r.SWITCHES + UP * r.STRIDE + i] += choose(recorded & (to == UP), 1, 0)
    k[r.SWITCHES + DOWN * r.STRIDE + i] += choose(recorded & (to == DOWN), 1, 0)
    k[r.SWITCHES + STICK * r.STRIDE + i] += choose(recorded & (to == STICK), 1, 0)
    k[r.SWITCHES + REST * r.STRIDE + i] += choose(recorded & (to == REST), 1, 0)


@inline
def has_rows(section, summary):
    """Return whether section points are recorded: `section` then has a row for each point, otherwise only one row."""
    return section.shape[0] == summary.shape[0]


@inline
def section_row(k, i, section):
    """Return the index of the row of `section` for the point of lane i."""
    return min(k[r.POINT + i], section.shape[0] - 1)


@inline
def write_points(w, k, i, section):
    """Write the section points of a switch that a batch has applied: one before it, and one in a wait after it.

    If no section point precedes the switch, wrong values are written, because a branch costs more. The correct point
    overwrites these values later.
    """
    row, slot = section_row(k, i, section), k[r.SLOT + i]
    if slot < section.shape[1]:
        section[row, slot, 0] = w[r.POINT_X + i]
        section[row, slot, 1] = w[r.POINT_V + i]
    if k[r.LEFT_OVER + i] & WRITE_POINT:
        slot = k[r.SECTIONS + i] - 1
        section[row, slot, 0] = w[r.X0 + i]
        section[row, slot, 1] = 0.0
