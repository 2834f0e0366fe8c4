"""Ordinary certified switches at ε = 0 in all lanes of a batch, without branches.

A switch is ordinary if rounding cannot change its decision, it is within the record and the budget, and at most one
section point precedes it (engine.py).

`event.py` applies all other switches. Both modules evaluate the same formulas (switch.py) in the same order, so the
bits of a trajectory do not depend on the module that applied a switch. `kernels/__init__.py` explains the terms.
"""

from typing import NamedTuple

from vibrodrive.jit.branchless import choose, whole
from vibrodrive.jit.compile import inline
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import codes, margins, motion, switch, take_over, undisturbed
from vibrodrive.kernels import lane as r


class Wait(NamedTuple):
    """A wait after a switch, with a known end.

    ends : true if the wait certainly ends in the record and the budget, with at most one section point before its end
    margin : margin of the end of the wait
    period, phi : time of the end
    down : true if sliding down follows, false if sliding up follows
    point : true if a section point precedes the end
    cost : cost of the period in which the wait begins, including the switch at its end
    """

    ends: bool
    margin: float
    period: int
    phi: float
    down: bool
    point: bool
    cost: int


@inline
def following_wait(w, k, i, to, period, phi, slot, ahead, extent):
    """Return the wait in state `to` that begins at (period, phi). The next section point has the number `slot`."""
    h, phase, later, down = undisturbed.wait_end(w, i, to, phi)
    _, point, one = switch.next_section_point(w, k, i, slot, period, phi, 0.0, h, extent)
    cost, margin = 1 + choose(k[r.PERIOD + i] == period, ahead.cost, 0), margins.wait_end_distance(w, i, down)
    clear = margin > margins.ROUNDING * margins.magnitude_scale(w, i)
    lasting = switch.can_leave(w, i, to) & (h <= switch.time_left(w, k, i, period, phi, 0.0, extent)) & one & clear
    return Wait((cost < extent.budget) & lasting, margin, period + choose(later, 1, 0), phase, down, point, cost)


@inline
def apply_switch_undisturbed(w, k, i, extent):
    """If the switch found in lane i is ordinary, apply it and begin the next search. Otherwise `event.py` applies it.

    After an impact ξ = ξ' = 0, eq. (7).
    """
    met = w[r.OUTCOME + i] != codes.NOTHING
    h, which = w[r.CURSOR + i], k[r.SEARCH + i]
    gap, falling, rising = which == codes.S1, which == codes.S2, which == codes.S3
    period, phi = k[r.PERIOD + i], w[r.PHI + i]
    margin, usual = w[r.MARGIN + i], margins.magnitude_scale(w, i)
    there = motion.propagate_undisturbed(w, i, h)
    x, phi1 = there.x, there.phi
    force = there.q - w[r.B + i]
    known = met & (w[r.SEARCH_MODE + i] == codes.BRACKETED) & (h >= motion.FAR) & (w[r.V0 + i] == 0.0)
    known &= (phi1 >= 0.0) & (phi1 < TWO_PI)

    # aside: ξ < 0 at the end of the slide, so the impact before this end is searched for
    off = margins.far_rounding(w, i, h, w[r.X_OFF + i], 0.0, 0.0)
    aside = known & falling & (x < -off)
    below = switch.smaller(-x, margin)
    guess_below = undisturbed.gap_guess(w[r.X0 + i], x, h)

    # section point before the switch, and budget
    slot, ahead = k[r.SECTIONS + i], take_over.preceding_events(w, k, i, h, w[r.WORK + i], extent)
    switch.set_next_point(w, k, i, slot, *motion.section_at(w, i, ahead.due))
    over = known & ahead.within & (gap | (x > choose(falling, off, 0.0)))

    period1 = period + whole(there.turned)
    to = switch.decide_after_slide(gap, force)
    distance = take_over.distance_of(gap, force)
    over &= distance >= margins.SUSPECT * usual
    nearest = switch.smaller(distance, choose(falling, switch.smaller(x, margin), margin))
    recorded = switch.in_record(w, k, i, period1, phi1, extent.transient)

    # if a wait follows, the lane is advanced to the end of this wait
    waiting = switch.waits(to)
    passed = slot + choose(ahead.point, 1, 0)
    wait = following_wait(w, k, i, to, period1, phi1, passed, ahead, extent)
    down, point1 = wait.down, waiting & wait.point
    over &= wait.ends | (not waiting)
    nearest = choose(waiting, switch.smaller(wait.margin, nearest), nearest)
    cost1 = choose(waiting, wait.cost, ahead.cost)
    period2, phi2 = choose(waiting, wait.period, period1), choose(waiting, wait.phi, phi1)
    recorded1 = waiting & switch.in_record(w, k, i, period2, phi2, extent.transient)

    # the next slide begins at rest
    up = choose(waiting, not down, to == codes.UP)
    s = choose(up, 1.0, -1.0)
    over &= 1.0 + s * w[r.B + i] >= undisturbed.LEAST_FALL
    down_p, up_p = w[r.P_DOWN + i], w[r.P_UP + i]
    force2 = choose(waiting, choose(down, -1.0, 1.0), force)
    p2 = choose(waiting, choose(down, down_p, up_p), there.p)
    q2 = choose(waiting, w[r.B + i] + force2, there.q)
    field = motion.Field(p2, q2, 0.0, 0.0)
    segment = switch.begin(s, choose(gap, 0.0, x), 0.0, force2, waiting, False, w[r.B + i], 0.0, field)
    rate = undisturbed.rate_of(w[r.A0 + i], force - choose(rising, 1.0, -1.0))
    rested = over & (to == codes.REST)
    undisturbed.keep_guesses(w, i, over & rising, (over | aside) & falling, rested, phi, h, rate)
    lo, hi, fall, guess = undisturbed.bracket(w, i, s, phi2, p2, segment.slope)

    # if the mass leaves the obstacle, its state may equal an earlier state, the reference (recurrence.py)
    left_obstacle = over & gap
    look = take_over.is_due(w, k, i, left_obstacle, phi2) | (left_obstacle & rested)
    more = choose(point1, codes.WRITE_POINT, codes.DONE) + choose(look, codes.CHECK_RECURRENCE, codes.DONE)
    kept = recorded | recorded1 | (k[r.HISTORY_KEEPS + i] == codes.ALL)
    more += choose(kept, codes.KEEP_SWITCH, codes.DONE)
    switch.set_remaining_work(k, i, choose(over, more, choose(aside | (not met), codes.DONE, codes.UNUSUAL)))

    switch.note_end(w, k, i, which, period1, phi1, x, there.v)
    left = switch.time_left(w, k, i, period2, phi2, 0.0, extent)
    next_state = choose(up, codes.UP, codes.DOWN)
    switch.commit_state(k, i, over, next_state)
    switch.commit_time(w, k, i, over, period2, phi2, 0.0, left, p2, q2)
    switch.commit_segment(w, i, over, segment, choose(gap, 0.0, off), 0.0)
    switch.commit_cost(w, k, i, over, choose(waiting, period1, period), cost1)
    switch.count_switch(k, i, over & recorded, gap, to)
    switch.count_switch(k, i, over & recorded1, False, next_state)
    switch.commit_points(k, i, over, passed + choose(point1, 1, 0))
    margins.set_margin(w, i, over | aside, choose(over, switch.smaller(fall, nearest), below))
    goal, cursor = choose(over, choose(up, codes.S3, codes.S2), codes.S1), choose(over, guess, guess_below)
    undisturbed.set_bracket(w, k, i, over | aside, goal, choose(over, lo, 0.0), choose(over, hi, h), cursor)
