"""What the batched switches share: what lies ahead of a switch, how clear its decision is, and what it leaves behind.

`switch_disturbed.py`, `switch_grid.py` and `switch_grid_disturbed.py` find where a state ends and what is ordinary
there, `take_over` applies the switch, and they begin the next search. At ε = 0 the certified switch
(switch_undisturbed.py) ends a wait within the same batch and commits what follows that; it shares all but `take_over`.
"""

from __future__ import annotations

from typing import NamedTuple

from vibrodrive.jit.branchless import choose
from vibrodrive.jit.compile import inline, inline_each
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import motion, switch
from vibrodrive.kernels.codes import S1, S4, UNUSUAL


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


class Taken(NamedTuple):
    """A switch found in a lane.

    over : whether it is ordinary, and applied
    event, to : the switching function that is zero, the state that begins
    force : H there
    off : bound of what rounding has done to ξ there, sliding
    """

    over: bool
    event: int
    to: int
    force: float
    off: float


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
def decide_clearly(w, i, event, force, margin, suspect):
    """(state that begins, margin then, whether that is far enough from any other and does not last for ever)."""
    to, waited, distance = switch.decide(event, w[r.SIG + i], force), event >= S4, distance_of(event == S1, force)
    clear = (waited | (distance >= suspect)) & (switch.can_leave(w, i, to) | (not switch.waits(to)))
    return to, choose(waited, margin, switch.smaller(distance, margin)), clear


@inline
def is_due(w, k, i, departs, phi):
    """Whether a lane that leaves the obstacle at φ, if it `departs`, is to be looked at for a recurrence."""
    since = switch.commit_departure(k, i, departs)
    return departs & ((phi == w[r.REFERENCE_PHI + i]) | (since >= k[r.WINDOW + i]))


@inline_each("fast", "on_grid")
def take_over(w, k, i, fast, on_grid, taken, there, late, ahead, extent):
    """Apply a switch in lane i where it is `taken.over`, with a disturbance (`fast`) or without; `there` is where.

    Returns (the segment that begins, what is left of the record, whether it belongs to that).
    """
    over, event, to = taken.over, taken.event, taken.to
    gap, waited = event == S1, event >= S4
    period, x0 = k[r.PERIOD + i], w[r.X0 + i]
    arrived = period + int(there.turned)
    end = k[r.PERIOD0 + i] + extent.transient + extent.periods
    left = motion.time_between(arrived, there.phi, there.low, end, w[r.PHI0 + i])
    recorded = over & switch.in_record(w, k, i, arrived, there.phi, extent.transient)
    x = choose(gap, 0.0, choose(waited, x0, there.x))
    inverse = w[r.INVERSE + i] if fast else 0.0
    at_boundary = waited & (not on_grid)
    segment = switch.begin(switch.direction(to), x, 0.0, taken.force, at_boundary, on_grid, w[r.B + i], inverse, there)
    switch.note_end(w, k, i, event, arrived, there.phi, there.x, there.v)
    switch.commit_points(k, i, over & ahead.point, k[r.SECTIONS + i] + 1)
    switch.commit_state(k, i, over, to)
    switch.commit_time(w, k, i, over, arrived, there.phi, there.low, left, there.p, there.q)
    off = choose(gap, 0.0, choose(waited, w[r.X_OFF + i], taken.off))
    switch.commit_segment(w, i, over, segment, off, 0.0)
    if fast:
        switch.commit_segment_fast(w, i, over, segment)
        switch.commit_time_fast(w, i, over, there.theta, there.pf, there.qf, late)
    switch.commit_cost(w, k, i, over, period, ahead.cost)
    switch.count_switch(k, i, recorded, gap, to)
    return segment, left, recorded


@inline
def count_unusual(k, n):
    """How many of the lanes 0..n-1 are left to `event.py`."""
    left = 0
    for i in range(n):
        left += choose(k[r.LEFT_OVER + i] == UNUSUAL, 1, 0)
    return left
