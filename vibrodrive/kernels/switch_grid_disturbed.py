"""The ordinary switch on a grid with a disturbance, in all lanes at once: what scanning and `event.py` do.

The fixed path switches at the grid point behind the zero, eq. (10). Muller's first refines the zero, in all lanes
abreast (muller.py). Where ξ has fallen below 0 the impact is looked for; where Muller's method sees that only at the
refined zero of ξ', it is left to `event.py`.
"""

from __future__ import annotations

from vibrodrive.jit.branchless import choose, full, wide
from vibrodrive.jit.compile import inline_each, part_each
from vibrodrive.kernels import first_zero, margins, motion, muller, switch, take_over
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import BOTH, DONE, FALLEN, KEEP_SWITCH, NOTHING, S1, S2, UNUSUAL, ZERO


@inline_each("fixed")
def apply_switch_on_grid_disturbed(w, k, i, fixed, extent):
    """Take lane i, whose scan has met something, over the switch; or leave it to `event.py`. `fixed` is a literal."""
    met, which, cursor = w[r.OUTCOME + i], k[r.SEARCH + i], w[r.CURSOR + i]
    falling = which == S2
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
        there = motion.propagate_on_grid(w, k, i, h, k[r.GRID + i] + int(cursor))
    else:
        gap = which == S1
        aside, busy = met == FALLEN, (met == NOTHING) | muller.under_way(w, i)
        ended, h, evaluations = muller.refined(w, i, high)
        there = motion.propagate_disturbed(w, k, i, h)
    force = motion.adhesive_force(w, i, there.q, there.qf)

    # ordinary is what lies before the next section point but one, within the budget, and is clearly decided
    work = w[r.WORK + i] + evaluations
    ahead = take_over.look_ahead(w, k, i, h, work, extent)
    event, suspect = choose(gap, S1, which), margins.SUSPECT * (margins.magnitude_scale(w, i) + abs(w[r.V0 + i]))
    to, nearest, decided = take_over.decide_clearly(w, i, event, force, w[r.MARGIN + i], suspect)
    over = ended & ahead.within & decided
    if not fixed:
        over &= (there.x > 0.0) | (not falling)
    taken = take_over.Taken(over, event, to, force, margins.gap_rounding(w, i, h))
    _, left, recorded = take_over.take_over(w, k, i, True, True, taken, there, 0.0, ahead, extent)
    switch.leave_over(k, i, choose(over, choose(recorded, KEEP_SWITCH, DONE), choose(aside | busy, DONE, UNUSUAL)))
    w[r.WORK + i] = choose(over, work, w[r.WORK + i])
    if fixed:
        motion.commit_grid(k, i, over, k[r.GRID + i] + int(cursor))
    margins.set_margin(w, i, over, nearest)

    # and what ends it
    goal = choose(aside, S1, switch.terminating_function(to))
    limit = motion.grid_steps(w, i, left)
    search = first_zero.search_shape(w, i, goal, choose(aside, high, limit * w[r.DTAU + i]))
    begin_at = choose(switch.waits(to), 1.0, first_zero.first_grid_point(search, w[r.DTAU + i], limit))
    cursor = choose(aside, above + choose(apart | (above == 0.0), 1.0, 0.0), begin_at)
    first_zero.set_limit(w, i, over, limit)
    first_zero.set_search(w, k, i, over | aside, goal, search, cursor)
    first_zero.unknown_values(w, i, aside)
    first_zero.start_on_grid(w, i, over, goal)


@part_each("fixed")
def apply_switches_on_grid_disturbed(w, k, n, fixed, extent):
    """Take those of the lanes 0..n-1 that can be over the switch at the end of their scan, ε > 0.

    Returns how many are left to `event.py`.
    """
    wide()
    if not fixed:
        muller.refine_abreast(w, n)
    for i in range(full(n)):
        apply_switch_on_grid_disturbed(w, k, i, fixed, extent)
    return take_over.count_unusual(k, n)
