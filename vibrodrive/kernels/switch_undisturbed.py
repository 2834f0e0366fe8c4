"""The ordinary switch at ε = 0, certified, in all lanes at once: what `event.py` does, without branches.

Ordinary is a switch far from a change of decision, within the record and the budget, with no more than one section
point on the way. Everything else is left to `event.py`. Both take the same decisions by the same formulas (switch.py)
in the same order, so a trajectory's bits do not depend on which of them took a switch.
"""

from __future__ import annotations

from vibrodrive.jit.branchless import choose, wide
from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import (
    ALL,
    BRACKETED,
    CHECK_RECURRENCE,
    DONE,
    DOWN,
    KEEP_SWITCH,
    NOTHING,
    REST,
    S1,
    S2,
    S3,
    UNUSUAL,
    UP,
    WRITE_POINT,
)
from vibrodrive.kernels.impacts import note_end
from vibrodrive.kernels.lane import full
from vibrodrive.kernels.margins import (
    ROUNDING,
    SUSPECT,
    far_rounding,
    magnitude_scale,
    set_margin,
    wait_end_distance,
)
from vibrodrive.kernels.motion import FAR, propagate_undisturbed, section_at, time_between
from vibrodrive.kernels.switch import (
    STEEP_COST,
    begin,
    can_leave,
    commit_cost,
    commit_departure,
    commit_points,
    commit_segment,
    commit_state,
    commit_time,
    count_switch,
    decide_after_slide,
    in_record,
    leave_over,
    number_in_period,
    point_on_the_way,
    set_point_ahead,
    smaller,
    waits,
)
from vibrodrive.kernels.undisturbed import LEAST_FALL, bracket, gap_guess, keep_guesses, rate_of, set_bracket, wait_end


@inline
def apply_switch_undisturbed(w, k, i, transient, periods, budget):
    """Take lane i, which stands at the end of its search, over the switch; or leave it to `event.py`.

    An impact leaves ξ = ξ' = 0, eq. (7).
    """
    met = w[r.OUTCOME + i] != NOTHING
    h, which = w[r.CURSOR + i], k[r.SEARCH + i]
    gap, falling, rising = which == S1, which == S2, which == S3
    period, phi, low = k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i]
    margin, usual = w[r.MARGIN + i], magnitude_scale(w, i)
    there = propagate_undisturbed(w, i, h)
    x, phi1 = there.x, there.phi
    force = there.q - w[r.B + i]
    known = (
        met & (w[r.SEARCH_MODE + i] == BRACKETED) & (h >= FAR) & (phi1 >= 0.0) & (phi1 < TWO_PI) & (w[r.V0 + i] == 0.0)
    )

    # S2 ends below the obstacle: there was an impact before, look for it
    off = far_rounding(w, i, h, w[r.X_OFF + i], 0.0, 0.0)
    aside = known & falling & (x < -off)
    below = smaller(-x, margin)
    guess_below = gap_guess(w[r.X0 + i], x, h)

    # the section point on the way, and what the period may cost
    slot = k[r.SECTIONS + i]
    due, point, one = point_on_the_way(w, k, i, slot, period, phi, low, h, transient, periods)
    set_point_ahead(w, k, i, slot, *section_at(w, i, due))
    cost = number_in_period(k, i)
    over = known & (h <= w[r.LEFT + i]) & one & (w[r.WORK + i] - w[r.WORK_BOOKED + i] < STEEP_COST)
    over &= (gap | (x > choose(falling, off, 0.0))) & (cost < budget)

    # decide
    period1 = period + int(there.turned)
    end = k[r.PERIOD0 + i] + transient + periods
    to = decide_after_slide(gap, force)
    distance = abs(choose(gap, force, abs(force)) - 1.0)
    over &= distance >= SUSPECT * usual
    nearest = smaller(distance, choose(falling, smaller(x, margin), margin))
    recorded = in_record(w, k, i, period1, phi1, transient)

    # a wait, to its end
    waiting = waits(to)
    hw, phase, later, down = wait_end(w, i, to, phi1)
    passed = slot + choose(point, 1, 0)
    _, point1, one1 = point_on_the_way(w, k, i, passed, period1, phi1, 0.0, hw, transient, periods)
    point1 = waiting & point1
    cost1 = choose(waiting, 1 + choose(period == period1, cost, 0), cost)
    way_out = wait_end_distance(w, i, down)
    left1 = time_between(period1, phi1, 0.0, end, w[r.PHI0 + i])
    lasting = can_leave(w, i, to) & (hw <= left1) & one1 & (way_out > ROUNDING * usual)
    over &= ((cost1 < budget) & lasting) | (not waiting)
    nearest = choose(waiting, smaller(way_out, nearest), nearest)
    period2 = period1 + choose(waiting & later, 1, 0)
    phi2 = choose(waiting, phase, phi1)
    recorded1 = waiting & in_record(w, k, i, period2, phi2, transient)

    # the next slide, from rest
    up = choose(waiting, not down, to == UP)
    s = choose(up, 1.0, -1.0)
    over &= 1.0 + s * w[r.B + i] >= LEAST_FALL
    down_p, up_p = w[r.P_DOWN + i], w[r.P_UP + i]
    force2 = choose(waiting, choose(down, -1.0, 1.0), force)
    p2 = choose(waiting, choose(down, down_p, up_p), there.p)
    q2 = choose(waiting, w[r.B + i] + force2, there.q)
    segment = begin(s, choose(gap, 0.0, x), 0.0, force2, waiting, False, w[r.B + i], 0.0, p2, q2, 0.0, 0.0)
    rate = rate_of(w[r.A0 + i], force - choose(rising, 1.0, -1.0))
    rested = over & (to == REST)
    keep_guesses(w, i, over & rising, (over | aside) & falling, rested, phi, h, rate)
    lo, hi, fall, guess = bracket(w, i, s, phi2, p2, segment.slope)

    # away from the obstacle: is this where the motion has been before?
    left_obstacle = over & gap
    since = commit_departure(k, i, left_obstacle)
    look = left_obstacle & (rested | (phi2 == w[r.REFERENCE_PHI + i]) | (since >= k[r.WINDOW + i]))
    more = choose(point1, WRITE_POINT, DONE) + choose(look, CHECK_RECURRENCE, DONE)
    kept = recorded | recorded1 | (k[r.HISTORY_KEEPS + i] == ALL)
    more += choose(kept, KEEP_SWITCH, DONE)
    leave_over(k, i, choose(over, more, choose(aside | (not met), DONE, UNUSUAL)))

    note_end(w, k, i, which, period1, phi1, x, there.v)
    left = time_between(period2, phi2, 0.0, end, w[r.PHI0 + i])
    next_state = choose(up, UP, DOWN)
    commit_state(k, i, over, next_state)
    commit_time(w, k, i, over, period2, phi2, 0.0, left, p2, q2)
    commit_segment(w, i, over, segment, choose(gap, 0.0, off), 0.0)
    commit_cost(w, k, i, over, choose(waiting, period1, period), cost1)
    count_switch(k, i, over & recorded, gap, to)
    count_switch(k, i, over & recorded1, False, next_state)
    commit_points(k, i, over, passed + choose(point1, 1, 0))
    set_margin(w, i, over | aside, choose(over, smaller(fall, nearest), below))
    goal, cursor = choose(over, choose(up, S3, S2), S1), choose(over, guess, guess_below)
    set_bracket(w, k, i, over | aside, goal, choose(over, lo, 0.0), choose(over, hi, h), cursor)


@part
def apply_switches_undisturbed(w, k, n, transient, periods, budget):
    """Take those of the lanes 0..n-1 that can be over the switch at the end of their search, ε = 0.

    Returns how many are left to `event.py`.
    """
    wide()
    left = 0
    for i in range(full(n)):
        apply_switch_undisturbed(w, k, i, transient, periods, budget)
        left += choose((i < n) & (k[r.LEFT_OVER + i] == UNUSUAL), 1, 0)
    return left
