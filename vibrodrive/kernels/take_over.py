"""What the batched switches share: what lies ahead of a switch, how clear its decision is, and what it leaves behind.

`switch_disturbed.py`, `switch_grid.py` and `switch_grid_disturbed.py` find where a state ends and whether that is
ordinary, `take_over` decides and applies the switch, and they begin the next search. At ε = 0 the certified switch
(switch_undisturbed.py) ends a wait within the same batch and commits what follows that; it shares all but `take_over`.
"""

from __future__ import annotations

from typing import NamedTuple

from vibrodrive.jit.branchless import choose
from vibrodrive.jit.compile import inline, inline_each
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import margins, motion, switch, undisturbed
from vibrodrive.kernels.codes import ALL, CHECK_RECURRENCE, DONE, KEEP_SWITCH, S1, S4, S5, UNUSUAL


class Found(NamedTuple):
    """What a lane has met.

    h, event : when, and the switching function that is zero there
    there, late : where that leads (motion.py)
    off : bound of what rounding has done to ξ there, sliding
    work : evaluations of switching functions so far
    margin : the smallest margin so far
    ordinary : whether the switch is an ordinary one, as far as the search can tell
    aside, margin_aside : whether an impact before it is to be looked for instead, and the smallest margin then
    idle : whether the search goes on
    """

    h: float
    event: int
    there: motion.Arrival
    late: float
    off: float
    work: float
    margin: float
    ordinary: bool
    aside: bool
    margin_aside: float
    idle: bool


class Begun(NamedTuple):
    """Whether a switch was applied, the state and the segment that begin, and what is left of the record."""

    over: bool
    to: int
    segment: motion.Segment
    left: float


class Ahead(NamedTuple):
    """What lies on the way to a switch.

    due, point : time to the next section point, and whether that is passed
    within : whether the switch lies in the record and the budget, with no other section point on the way
    cost : its number among the switches of its period
    """

    due: float
    point: bool
    within: bool
    cost: int


@inline
def look_ahead(w, k, i, h, work, extent):
    """What lies on the way to a switch at h, after `work` evaluations in all."""
    slot, period = k[r.SECTIONS + i], k[r.PERIOD + i]
    due, point, one = switch.point_on_the_way(w, k, i, slot, period, w[r.PHI + i], w[r.LOW + i], h, extent)
    cost = switch.number_in_period(k, i)
    cheap = (work - w[r.WORK_BOOKED + i] < switch.STEEP_COST) & (cost < extent.budget)
    return Ahead(due, point, (h <= w[r.LEFT + i]) & one & cheap, cost)


@inline
def distance_of(gap, force):
    """How far H is from the boundary at which another state would begin, after a slide."""
    return abs(choose(gap, force, abs(force)) - 1.0)


@inline
def decide_clearly(w, i, event, force, margin):
    """(state that begins, margin then, whether that is far enough from any other and does not last for ever)."""
    to, waited, distance = switch.decide(event, w[r.SIG + i], force), event >= S4, distance_of(event == S1, force)
    clear = (waited | (distance >= margins.suspect(w, i))) & (switch.can_leave(w, i, to) | (not switch.waits(to)))
    return to, choose(waited, margin, switch.smaller(distance, margin)), clear


@inline
def is_due(w, k, i, departs, phi):
    """Whether a lane that leaves the obstacle at φ, if it `departs`, is to be looked at for a recurrence."""
    since = switch.commit_departure(k, i, departs)
    return departs & ((phi == w[r.REFERENCE_PHI + i]) | (since >= k[r.WINDOW + i]))


@inline_each("fast", "on_grid", "fixed")
def take_over(w, k, i, fast, on_grid, fixed, found, extent):
    """Apply the switch found in lane i if it is an ordinary one, with a disturbance (`fast`) or without."""
    event, there, period, x0 = found.event, found.there, k[r.PERIOD + i], w[r.X0 + i]
    gap, waited = event == S1, event >= S4
    force = motion.adhesive_force(w, i, there.q, there.qf) if fast else there.q - w[r.B + i]

    # ordinary is what lies before the next section point but one, within the budget, and is clearly decided
    ahead = look_ahead(w, k, i, found.h, found.work, extent)
    to, nearest, decided = decide_clearly(w, i, event, force, found.margin)
    over, s = found.ordinary & ahead.within & decided, switch.direction(to)
    if not fast:
        over &= switch.waits(to) | (1.0 + s * w[r.B + i] >= undisturbed.LEAST_FALL)
        sx, sv = motion.section_at(w, i, ahead.due)
        switch.set_point_ahead(w, k, i, k[r.SECTIONS + i], choose(waited, x0, sx), choose(waited, 0.0, sv))

    # what begins, and when
    arrived = period + int(there.turned)
    left = switch.time_left(w, k, i, arrived, there.phi, there.low, extent)
    recorded = over & switch.in_record(w, k, i, arrived, there.phi, extent.transient)
    x = choose(gap, 0.0, choose(waited, x0, there.x))
    inverse = w[r.INVERSE + i] if fast else 0.0
    field = motion.Field(there.p, there.q, there.pf, there.qf)
    segment = switch.begin(s, x, 0.0, force, waited & (not on_grid), on_grid, w[r.B + i], inverse, field)
    switch.note_end(w, k, i, event, arrived, there.phi, there.x, there.v)
    switch.commit_points(k, i, over & ahead.point, k[r.SECTIONS + i] + 1)
    switch.commit_state(k, i, over, to)
    switch.commit_time(w, k, i, over, arrived, there.phi, there.low, left, there.p, there.q)
    switch.commit_segment(w, i, over, segment, choose(gap, 0.0, choose(waited, w[r.X_OFF + i], found.off)), 0.0)
    switch.commit_cost(w, k, i, over, period, ahead.cost)
    switch.count_switch(k, i, recorded, gap, to)
    margins.set_margin(w, i, over | found.aside, choose(over, nearest, found.margin_aside))

    # what is left to do
    kept, more = recorded, DONE
    if fast:
        switch.commit_segment_fast(w, i, over, segment)
        switch.commit_time_fast(w, i, over, there.theta, there.pf, there.qf, found.late)
    else:
        # away from the obstacle, or at rest there: is this where the motion has been before?
        look = is_due(w, k, i, over & (gap | (event == S5)), there.phi) & (not fixed)
        kept, more = recorded | (k[r.HISTORY_KEEPS + i] == ALL), choose(look, CHECK_RECURRENCE, DONE)
    more += choose(kept, KEEP_SWITCH, DONE)
    switch.leave_over(k, i, choose(over, more, choose(found.aside | found.idle, DONE, UNUSUAL)))
    return Begun(over, to, segment, left)
