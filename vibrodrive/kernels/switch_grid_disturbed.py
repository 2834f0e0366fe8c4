"""Ordinary switches on a grid with a disturbance in all lanes of a batch, without branches.

A switch is ordinary if rounding cannot change its decision, it is within the record and the budget, and at most one
section point precedes it (engine.py).

The results equal those of `event.py`. The method `fixed` switches at the grid point after the zero, eq. (10). Muller's
method first refines the zero, in all lanes together (muller.py). If ξ < 0 at a grid point, the search continues for the
impact before this point. If ξ < 0 only at the refined zero of ξ', `event.py` processes the lane.

`kernels/__init__.py` explains the terms.
"""

from vibrodrive.jit.branchless import choose, put
from vibrodrive.jit.compile import inline_each
from vibrodrive.kernels import first_zero, margins, motion, muller, switch, take_over
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import BOTH, FALLEN, NOTHING, S1, S2, ZERO


@inline_each("fixed")
def find_switch_on_grid(w, k, i, fixed, apart):
    """Return the outcome of the search in lane i at its cursor, as `Found` (take_over.py).

    `apart` is true if the last grid point with ξ >= 0 is more than one step before the cursor. If ξ < 0 at the cursor,
    the search must then continue for the first grid point with ξ < 0.
    """
    met, which, cursor, margin = w[r.OUTCOME + i], k[r.SEARCH + i], w[r.CURSOR + i], w[r.MARGIN + i]
    high = cursor * w[r.DTAU + i]
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
        ended &= (there.x > 0.0) | (which != S2)
    event, off, work = choose(gap, S1, which), margins.gap_rounding(w, i, h), w[r.WORK + i] + evaluations
    return take_over.Found(h, event, there, 0.0, off, work, margin, ended, aside, margin, busy)


@inline_each("fixed")
def apply_switch_on_grid_disturbed(w, k, i, fixed, extent):
    """If the switch found in lane i is ordinary, apply it and begin the next search. Else `event.py` applies it."""
    cursor, above = w[r.CURSOR + i], w[r.LAST_NONNEGATIVE + i]
    apart = cursor - above > 1.0
    found = find_switch_on_grid(w, k, i, fixed, apart)
    begun = take_over.apply_ordinary(w, k, i, True, True, fixed, found, extent)
    over, aside = begun.over, found.aside
    put(w, r.WORK + i, over, found.work)
    if fixed:
        motion.commit_grid(k, i, over, k[r.GRID + i] + int(cursor))

    # search for the first grid point with ξ < 0 from `above` + 1 on. If this point is the cursor, begin at `above`,
    # because Muller's method also needs the value there; at the start of the segment this value is known
    goal = choose(aside, S1, switch.terminating_function(begun.to))
    limit = motion.grid_steps(w, i, begun.left)
    reach = choose(aside, cursor, limit) * w[r.DTAU + i]
    search = first_zero.search_shape(w, i, goal, reach)
    first = choose(switch.waits(begun.to), 1.0, first_zero.first_grid_point(search, w[r.DTAU + i], limit))
    begin_at = choose(aside, above + choose(apart | (above == 0.0), 1.0, 0.0), first)
    first_zero.set_limit(w, i, over, limit)
    first_zero.set_search(w, k, i, over | aside, goal, search, begin_at)
    first_zero.unknown_values(w, i, aside)
    first_zero.start_on_grid(w, i, over, goal)
