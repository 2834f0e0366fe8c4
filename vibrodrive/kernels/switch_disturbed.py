"""Ordinary certified switches with a disturbance in all lanes of a batch, without branches.

A switch is ordinary if rounding cannot change its decision, it is within the record and the budget, and at most one
section point precedes it (engine.py).

The section point before a switch is written first, because applying the switch overwrites the segment that contains
this point. `kernels/__init__.py` explains the terms.
"""

from vibrodrive.jit.branchless import choose, full, wide
from vibrodrive.jit.compile import inline, part
from vibrodrive.kernels import first_zero, margins, motion, record, switch, take_over
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import FALLEN, NOTHING, S1, S2, S4, ZERO


@part
def mark_points(w, k, n, extent):
    """Set the number of the section point that precedes the outcome of the search in each of the lanes 0..n-1.

    The number is `periods` if no point precedes the outcome. The time of the cursor is CURSOR · DTAU. Without a grid,
    DTAU is 1.
    """
    wide()
    periods = extent.periods
    for i in range(full(n)):
        slot = k[r.SECTIONS + i]
        due = switch.section_due(w, k, i, slot, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], extent.transient)
        passed = (w[r.OUTCOME + i] != NOTHING) & (due <= w[r.CURSOR + i] * w[r.DTAU + i]) & (slot < periods)
        switch.mark_next_point(k, i, choose(passed, slot, periods))


@part
def write_next_points(w, k, n, transient, section):
    """Write the section points that precede the outcomes of the searches in the lanes 0..n-1.

    The point of a switch that is not applied afterwards may be wrong. The correct point later overwrites the wrong one.
    """
    for i in range(n):
        slot = k[r.SLOT + i]
        if slot < section.shape[1]:
            hs = switch.section_due(w, k, i, slot, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], transient)
            record.write_point(w, k, i, slot, hs, section)


@inline
def find_switch(w, k, i):
    """Return the outcome of the search in lane i at its cursor, as `Found` (take_over.py)."""
    met, h, which = w[r.OUTCOME + i], w[r.CURSOR + i], k[r.SEARCH + i]
    gap, falling, waited = which == S1, which == S2, which >= S4
    level = choose(w[r.SIG + i] > 0.0, -1.0, 1.0)
    there, late = motion.on_boundary(w, i, waited, motion.propagate_disturbed(w, k, i, h), level, h)

    # closest tangency before the zero
    under, over_under = w[r.DIP_DENOMINATOR + i], w[r.DIP_NUMERATOR + i]
    touched = under > 0.0
    near = choose(touched, over_under, 1.0) / choose(touched, under, 1.0)
    clear = (not touched) | (near >= margins.suspect(w, i))
    margin = choose(touched, switch.smaller(near, w[r.MARGIN + i]), w[r.MARGIN + i])

    # aside: ξ < 0 at the end of the slide, so the impact before this end is searched for
    off = margins.gap_rounding(w, i, h)
    fell = falling & (there.x < -off)
    aside = clear & fell & ((met == ZERO) | (met == FALLEN)) & (w[r.X0 + i] >= first_zero.LEAST_GAP)
    margin_aside = choose(met == ZERO, switch.smaller(-there.x, margin), margin)
    lowest = choose(falling, switch.smaller(there.x, margin), margin)
    ordinary = clear & (met == ZERO) & (gap | waited | (there.x > choose(falling, off, 0.0)))
    work, idle = w[r.WORK + i], met == NOTHING
    return take_over.Found(h, which, there, late, off, work, lowest, ordinary, aside, margin_aside, idle)


@inline
def apply_switch_disturbed(w, k, i, extent):
    """If the switch found in lane i is ordinary, apply it and begin the next search. Else `event.py` applies it."""
    found = find_switch(w, k, i)
    begun = take_over.apply_ordinary(w, k, i, True, False, False, found, extent)
    aside, where = found.aside, begun.over | found.aside
    goal = choose(aside, S1, switch.terminating_function(begun.to))
    limit = choose(aside, found.h, switch.smaller(begun.left, motion.longest(w, i)))
    search = first_zero.search_shape(w, i, goal, limit)
    first = choose(switch.waits(begun.to), 0.0, first_zero.first_cursor(search, limit))
    first_zero.set_limit(w, i, where, limit)
    first_zero.set_search(w, k, i, where, goal, search, choose(begun.over, first, w[r.LAST_NONNEGATIVE + i]))
