"""The ordinary switch with a disturbance, certified, in all lanes at once: as switch_undisturbed.py, for ε > 0.

The section point on the way to a switch is written before the motion that leads there is given up.
"""

from __future__ import annotations

from vibrodrive.jit.branchless import choose, full, wide
from vibrodrive.jit.compile import inline, part
from vibrodrive.kernels import first_zero, margins, motion, record, switch, take_over
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import DONE, FALLEN, KEEP_SWITCH, NOTHING, S1, S2, S4, UNUSUAL, ZERO


@part
def mark_points(w, k, n, extent):
    """The number of the section point on the way to what each of the lanes 0..n-1 has met; `periods` where none is.

    The cursor is a time, or on a grid a number of steps.
    """
    wide()
    periods = extent.periods
    for i in range(full(n)):
        slot = k[r.SECTIONS + i]
        due = switch.section_due(w, k, i, slot, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], extent.transient)
        passed = (w[r.OUTCOME + i] != NOTHING) & (due <= w[r.CURSOR + i] * w[r.DTAU + i]) & (slot < periods)
        switch.mark_point_ahead(k, i, choose(passed, slot, periods))


@part
def write_ahead(w, k, n, transient, section):
    """Write the section points on the way in the lanes 0..n-1, before the motion that leads there is given up.

    Whether the switch at its end is taken is not known yet: if it is not, the right point is written over this one.
    """
    for i in range(n):
        slot = k[r.SLOT + i]
        if slot < section.shape[1]:
            hs = switch.section_due(w, k, i, slot, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], transient)
            record.write_point(w, k, i, slot, hs, section)


@inline
def apply_switch_disturbed(w, k, i, extent):
    """Take lane i, which stands at the end of its search, over the switch; or leave it to `event.py`."""
    met = w[r.OUTCOME + i]
    h, which = w[r.CURSOR + i], k[r.SEARCH + i]
    gap, falling, waited = which == S1, which == S2, which >= S4
    margin, usual = w[r.MARGIN + i], margins.magnitude_scale(w, i)
    level = choose(w[r.SIG + i] > 0.0, -1.0, 1.0)
    there, late = motion.on_boundary(w, i, waited, motion.propagate_disturbed(w, k, i, h), level, h)
    x0, v0 = w[r.X0 + i], w[r.V0 + i]
    x = choose(waited, x0, there.x)
    force = motion.adhesive_force(w, i, there.q, there.qf)
    suspect = margins.SUSPECT * (usual + abs(v0))

    # the closest the search came to a zero that was none
    under, over_under = w[r.DIP_DENOMINATOR + i], w[r.DIP_NUMERATOR + i]
    touched = under > 0.0
    near = choose(touched, over_under, 1.0) / choose(touched, under, 1.0)
    clear = (not touched) | (near >= suspect)
    margin = choose(touched, switch.smaller(near, margin), margin)

    # S2 ends below the obstacle: there was an impact before, look for it
    off = margins.gap_rounding(w, i, h)
    aside = clear & falling & (x < -off) & ((met == ZERO) | (met == FALLEN)) & (x0 >= first_zero.LEAST_GAP)
    margin_aside = choose(met == ZERO, switch.smaller(-x, margin), margin)

    # ordinary is what lies before the next section point but one, within the budget, and is clearly decided
    ahead = take_over.look_ahead(w, k, i, h, w[r.WORK + i], extent)
    ahead = take_over.Ahead(ahead.due, k[r.SLOT + i] < extent.periods, ahead.within, ahead.cost)  # as written ahead
    lowest = choose(falling, switch.smaller(x, margin), margin)
    to, nearest, decided = take_over.decide_clearly(w, i, which, force, lowest, suspect)
    over = clear & (met == ZERO) & ahead.within & (gap | waited | (x > choose(falling, off, 0.0))) & decided
    taken = take_over.Taken(over, which, to, force, off)
    _, left, recorded = take_over.take_over(w, k, i, True, False, taken, there, late, ahead, extent)
    done = choose(recorded, KEEP_SWITCH, DONE)
    switch.leave_over(k, i, choose(over | aside | (met == NOTHING), done, UNUSUAL))
    margins.set_margin(w, i, over | aside, choose(over, nearest, margin_aside))

    # and what ends it
    goal = choose(aside, S1, switch.terminating_function(to))
    slides = not switch.waits(to)
    limit = choose(aside, h, switch.smaller(left, motion.longest(w, i)))
    search = first_zero.search_shape(w, i, goal, limit)
    cursor = choose(over, choose(slides, first_zero.first_cursor(search, limit), 0.0), w[r.LAST_NONNEGATIVE + i])
    first_zero.set_limit(w, i, over | aside, limit)
    first_zero.set_search(w, k, i, over | aside, goal, search, cursor)


@part
def apply_switches_disturbed(w, k, n, extent):
    """Take those of the lanes 0..n-1 that can be over the switch at the end of their search, ε > 0.

    Returns how many are left to `event.py`.
    """
    wide()
    for i in range(full(n)):
        apply_switch_disturbed(w, k, i, extent)
    return take_over.count_unusual(k, n)
