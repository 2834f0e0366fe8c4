"""The ordinary switch with a disturbance, certified, in all lanes at once: as switch_undisturbed.py, for ε > 0.

The section point on the way to a switch is written before the motion that leads there is given up.
"""

from __future__ import annotations

from vibrodrive.jit.branchless import choose, wide
from vibrodrive.jit.compile import inline, part
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import DONE, FALLEN, KEEP_SWITCH, NOTHING, S1, S2, S4, UNUSUAL, ZERO
from vibrodrive.kernels.first_zero import LEAST_GAP, first_cursor
from vibrodrive.kernels.impacts import note_end
from vibrodrive.kernels.lane import full
from vibrodrive.kernels.margins import (
    SUSPECT,
    gap_rounding,
    magnitude_scale,
    set_margin,
)
from vibrodrive.kernels.motion import adhesive_force, longest, on_boundary, propagate_disturbed, time_between
from vibrodrive.kernels.record import write_point
from vibrodrive.kernels.switch import (
    STEEP_COST,
    begin,
    can_leave,
    commit_cost,
    commit_points,
    commit_segment,
    commit_segment_fast,
    commit_state,
    commit_time,
    commit_time_fast,
    count_switch,
    decide,
    direction,
    in_record,
    leave_over,
    mark_point_ahead,
    number_in_period,
    point_on_the_way,
    section_due,
    smaller,
    terminating_function,
    waits,
)
from vibrodrive.kernels.switching import search_shape, set_limit, set_search


@part
def mark_points(w, k, n, transient, periods):
    """The number of the section point on the way to what each of the lanes 0..n-1 has met; `periods` where none is.

    The cursor is a time, or on a grid a number of steps.
    """
    wide()
    for i in range(full(n)):
        slot = k[r.SECTIONS + i]
        due = section_due(w, k, i, slot, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], transient)
        passed = (w[r.OUTCOME + i] != NOTHING) & (due <= w[r.CURSOR + i] * w[r.DTAU + i]) & (slot < periods)
        mark_point_ahead(k, i, choose(passed, slot, periods))


@part
def write_ahead(w, k, n, transient, section):
    """Write the section points on the way in the lanes 0..n-1, before the motion that leads there is given up.

    Whether the switch at its end is taken is not known yet: if it is not, the right point is written over this one.
    """
    for i in range(n):
        slot = k[r.SLOT + i]
        if slot < section.shape[1]:
            hs = section_due(w, k, i, slot, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], transient)
            write_point(w, k, i, slot, hs, section)


@inline
def apply_switch_disturbed(w, k, i, transient, periods, budget):
    """Take lane i, which stands at the end of its search, over the switch; or leave it to `event.py`."""
    met = w[r.OUTCOME + i]
    h, which = w[r.CURSOR + i], k[r.SEARCH + i]
    gap, falling, waited = which == S1, which == S2, which >= S4
    period, phi, low = k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i]
    margin, usual = w[r.MARGIN + i], magnitude_scale(w, i)
    level = choose(w[r.SIG + i] > 0.0, -1.0, 1.0)
    there, late = on_boundary(w, i, waited, propagate_disturbed(w, k, i, h), level, h)
    x0, v0 = w[r.X0 + i], w[r.V0 + i]
    x = choose(waited, x0, there.x)
    force = adhesive_force(w, i, there.q, there.qf)
    suspect = SUSPECT * (usual + abs(v0))

    # the closest the search came to a zero that was none
    under, over_under = w[r.DIP_DENOMINATOR + i], w[r.DIP_NUMERATOR + i]
    touched = under > 0.0
    near = choose(touched, over_under, 1.0) / choose(touched, under, 1.0)
    clear = (not touched) | (near >= suspect)
    margin = choose(touched, smaller(near, margin), margin)

    # S2 ends below the obstacle: there was an impact before, look for it
    off = gap_rounding(w, i, h)
    aside = clear & falling & (x < -off) & ((met == ZERO) | (met == FALLEN)) & (x0 >= LEAST_GAP)
    margin_aside = choose(met == ZERO, smaller(-x, margin), margin)

    # the section point on the way, which has been written ahead, and what the period may cost
    slot = k[r.SECTIONS + i]
    _, _, one = point_on_the_way(w, k, i, slot, period, phi, low, h, transient, periods)
    point = k[r.SLOT + i] < periods
    cost = number_in_period(k, i)
    over = clear & (met == ZERO) & (h <= w[r.LEFT + i]) & one
    over &= (w[r.WORK + i] - w[r.WORK_BOOKED + i] < STEEP_COST) & (cost < budget)
    over &= gap | waited | (x > choose(falling, off, 0.0))

    # decide
    period1 = period + int(there.turned)
    end = k[r.PERIOD0 + i] + transient + periods
    left = time_between(period1, there.phi, there.low, end, w[r.PHI0 + i])
    to = decide(which, w[r.SIG + i], force)
    distance = abs(choose(gap, force, abs(force)) - 1.0)
    over &= waited | (distance >= suspect)
    nearest = choose(waited, margin, smaller(distance, choose(falling, smaller(x, margin), margin)))
    over &= can_leave(w, i, to) | (not waits(to))
    recorded = over & in_record(w, k, i, period1, there.phi, transient)

    # what begins there, from rest
    s, inverse = direction(to), w[r.INVERSE + i]
    segment = begin(
        s, choose(gap, 0.0, x), 0.0, force, waited, False,
        w[r.B + i], inverse, there.p, there.q, there.pf, there.qf,
    )  # fmt: skip
    done = choose(recorded, KEEP_SWITCH, DONE)
    leave_over(k, i, choose(over | aside | (met == NOTHING), done, UNUSUAL))
    note_end(w, k, i, which, period1, there.phi, x, there.v)
    commit_points(k, i, over & point, slot + 1)
    commit_state(k, i, over, to)
    commit_time(w, k, i, over, period1, there.phi, there.low, left, there.p, there.q)
    commit_segment(w, i, over, segment, choose(gap, 0.0, choose(waited, w[r.X_OFF + i], off)), 0.0)
    commit_segment_fast(w, i, over, segment)
    commit_time_fast(w, i, over, there.theta, there.pf, there.qf, late)
    commit_cost(w, k, i, over, period, cost)
    count_switch(k, i, recorded, gap, to)
    set_margin(w, i, over | aside, choose(over, nearest, margin_aside))

    # and what ends it
    goal = choose(aside, S1, terminating_function(to))
    limit = choose(aside, h, smaller(left, longest(w, i)))
    search = search_shape(w, i, goal, limit)
    cursor = choose(over, choose(s != 0.0, first_cursor(search, limit), 0.0), w[r.LAST_NONNEGATIVE + i])
    set_limit(w, i, over | aside, limit)
    set_search(w, k, i, over | aside, goal, search, cursor)


@part
def apply_switches_disturbed(w, k, n, transient, periods, budget):
    """Take those of the lanes 0..n-1 that can be over the switch at the end of their search, ε > 0.

    Returns how many are left to `event.py`.
    """
    wide()
    left = 0
    for i in range(full(n)):
        apply_switch_disturbed(w, k, i, transient, periods, budget)
        left += choose((i < n) & (k[r.LEFT_OVER + i] == UNUSUAL), 1, 0)
    return left
