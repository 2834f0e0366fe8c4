"""The ordinary switch on a grid with a disturbance, in all lanes at once: what scanning and `event.py` do.

The fixed path switches at the grid point behind the zero, eq. (10). Muller's first refines the zero, in all lanes
abreast (muller.py). Where ξ has fallen below 0 the impact is looked for; where Muller's method sees that only at the
refined zero of ξ', it is left to `event.py`.
"""

from __future__ import annotations

from vibrodrive.jit.branchless import choose, wide
from vibrodrive.jit.compile import inline_each, part_each
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import BOTH, DONE, FALLEN, KEEP_SWITCH, NOTHING, S1, S2, S4, UNUSUAL, ZERO
from vibrodrive.kernels.first_zero import first_grid_point
from vibrodrive.kernels.impacts import note_end
from vibrodrive.kernels.lane import full
from vibrodrive.kernels.margins import SUSPECT, gap_rounding, magnitude_scale, set_margin
from vibrodrive.kernels.motion import (
    adhesive_force,
    commit_grid,
    grid_steps,
    propagate_disturbed,
    propagate_on_grid,
    time_between,
)
from vibrodrive.kernels.muller import refine_abreast, refined, under_way
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
    number_in_period,
    point_on_the_way,
    smaller,
    terminating_function,
    waits,
)
from vibrodrive.kernels.switching import search_shape, set_limit, set_search, start_on_grid, unknown_values


@inline_each("fixed")
def apply_switch_on_grid_disturbed(w, k, i, fixed, transient, periods, budget):
    """Take lane i, whose scan has met something, over the switch; or leave it to `event.py`. `fixed` is a literal."""
    met, which, cursor = w[r.OUTCOME + i], k[r.SEARCH + i], w[r.CURSOR + i]
    falling, waited = which == S2, which >= S4
    period, phi, low = k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i]
    margin, usual = w[r.MARGIN + i], magnitude_scale(w, i)
    high = cursor * w[r.DTAU + i]

    # ξ fell below 0 in a stretch free of other switches: look for the first such grid point, which may be this one.
    # Then Muller's method has the one before looked at as well, unless that is where the slide began
    above = w[r.LAST_NONNEGATIVE + i]
    apart = cursor - above > 1.0

    if fixed:
        gap = (which == S1) | (met == FALLEN) | (met == BOTH)
        aside, busy = (met == FALLEN) & apart, met == NOTHING
        h, evaluations = high, 0.0
        ended = ((met == ZERO) | (met == BOTH) | (met == FALLEN)) & (not aside)
        there = propagate_on_grid(w, k, i, h, k[r.GRID + i] + int(cursor))
    else:
        gap = which == S1
        aside, busy = met == FALLEN, (met == NOTHING) | under_way(w, i)
        ended, h, evaluations = refined(w, i, high)
        there = propagate_disturbed(w, k, i, h)
    x = choose(waited, w[r.X0 + i], there.x)
    force = adhesive_force(w, i, there.q, there.qf)

    # the section point on the way, which has been written ahead, and what the period may cost
    slot = k[r.SECTIONS + i]
    _, point, one = point_on_the_way(w, k, i, slot, period, phi, low, h, transient, periods)
    cost = number_in_period(k, i)
    work = w[r.WORK + i] + evaluations
    over = ended & (h <= w[r.LEFT + i]) & one & (work - w[r.WORK_BOOKED + i] < STEEP_COST) & (cost < budget)
    if not fixed:
        over &= (x > 0.0) | (not falling)

    # decide
    period1 = period + int(there.turned)
    end = k[r.PERIOD0 + i] + transient + periods
    left = time_between(period1, there.phi, there.low, end, w[r.PHI0 + i])
    event = choose(gap, S1, which)
    to = decide(event, w[r.SIG + i], force)
    distance = abs(choose(gap, force, abs(force)) - 1.0)
    over &= waited | (distance >= SUSPECT * (usual + abs(w[r.V0 + i])))
    nearest = choose(waited, margin, smaller(distance, margin))
    over &= can_leave(w, i, to) | (not waits(to))
    recorded = over & in_record(w, k, i, period1, there.phi, transient)

    # what begins there, from rest
    segment = begin(
        direction(to), choose(gap, 0.0, x), 0.0, force, False, True,
        w[r.B + i], w[r.INVERSE + i], there.p, there.q, there.pf, there.qf,
    )  # fmt: skip
    off = choose(gap, 0.0, choose(waited, w[r.X_OFF + i], gap_rounding(w, i, h)))
    leave_over(k, i, choose(over, choose(recorded, KEEP_SWITCH, DONE), choose(aside | busy, DONE, UNUSUAL)))
    note_end(w, k, i, event, period1, there.phi, x, there.v)
    w[r.WORK + i] = choose(over, work, w[r.WORK + i])
    commit_points(k, i, over & point, slot + 1)
    commit_state(k, i, over, to)
    commit_time(w, k, i, over, period1, there.phi, there.low, left, there.p, there.q)
    if fixed:
        commit_grid(k, i, over, k[r.GRID + i] + int(cursor))
    commit_segment(w, i, over, segment, off, 0.0)
    commit_segment_fast(w, i, over, segment)
    commit_time_fast(w, i, over, there.theta, there.pf, there.qf, 0.0)
    commit_cost(w, k, i, over, period, cost)
    count_switch(k, i, recorded, gap, to)
    set_margin(w, i, over, nearest)

    # and what ends it
    goal = choose(aside, S1, terminating_function(to))
    limit = grid_steps(w, i, left)
    search = search_shape(w, i, goal, choose(aside, high, limit * w[r.DTAU + i]))
    begin_at = choose(waits(to), 1.0, first_grid_point(search, w[r.DTAU + i], limit))
    cursor = choose(aside, above + choose(apart | (above == 0.0), 1.0, 0.0), begin_at)
    set_limit(w, i, over, limit)
    set_search(w, k, i, over | aside, goal, search, cursor)
    unknown_values(w, i, aside)
    start_on_grid(w, i, over, goal)


@part_each("fixed")
def apply_switches_on_grid_disturbed(w, k, n, fixed, transient, periods, budget):
    """Take those of the lanes 0..n-1 that can be over the switch at the end of their scan, ε > 0.

    Returns how many are left to `event.py`.
    """
    wide()
    if not fixed:
        refine_abreast(w, n)
    left = 0
    for i in range(full(n)):
        apply_switch_on_grid_disturbed(w, k, i, fixed, transient, periods, budget)
        left += choose((i < n) & (k[r.LEFT_OVER + i] == UNUSUAL), 1, 0)
    return left
