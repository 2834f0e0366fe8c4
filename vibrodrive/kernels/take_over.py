"""Functions shared by the modules that apply ordinary switches (engine.py) in all lanes of a batch.

The modules switch_disturbed.py, switch_grid.py and switch_grid_disturbed.py first find the end of a state, and decide
whether the switch there may be ordinary. `apply_ordinary` then determines the next state and applies the switch. Then
these modules begin the search for the end of the next state.

The module switch_undisturbed.py, for certified switches at ε = 0, does not use `apply_ordinary`. It also ends a wait
that follows the switch, and begins the state after this wait. It uses the other functions of this module.
`kernels/__init__.py` explains the terms.
"""

from typing import NamedTuple

from vibrodrive.jit.branchless import choose, whole
from vibrodrive.jit.compile import inline, inline_each
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import margins, motion, switch, undisturbed
from vibrodrive.kernels.codes import ALL, CHECK_RECURRENCE, DONE, KEEP_SWITCH, S1, S4, S5, UNUSUAL


class Found(NamedTuple):
    """Outcome of the search in a lane.

    h, event : time from the last switch to this switch, and the switching function that is zero there
    there, late : arrival at h, and LATE (motion.py)
    off : bound of the rounding error of ξ at the end of a slide
    work : number of evaluations of switching functions so far
    margin : margin so far
    ordinary : true if the switch is ordinary, as far as the search can determine this
    aside : true if the switch must not be applied, because an earlier impact must be searched for
    margin_aside : margin so far if `aside` is true
    idle : true if the search has not found an end yet and continues
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
    """Result of `apply_ordinary`.

    over : true if `apply_ordinary` has applied the switch
    to, segment : the next state and its segment
    left : time from the switch to the end of the record
    """

    over: bool
    to: int
    segment: motion.Segment
    left: float


class PrecedingEvents(NamedTuple):
    """Events between the present time and a switch.

    due : time from the present to the next section point
    point : true if this section point precedes the switch
    within : true if the switch is in the record and the budget, and no further section point precedes it
    cost : cost of the period of the switch, including this switch
    """

    due: float
    point: bool
    within: bool
    cost: int


@inline
def preceding_events(w, k, i, h, work, extent):
    """Return the events before a switch at h. `work` is the number of evaluations up to the switch."""
    slot, period = k[r.SECTIONS + i], k[r.PERIOD + i]
    due, point, one = switch.next_section_point(w, k, i, slot, period, w[r.PHI + i], w[r.LOW + i], h, extent)
    cost = switch.number_in_period(k, i)
    cheap = (work - w[r.WORK_BOOKED + i] < switch.STEEP_COST) & (cost < extent.budget)
    return PrecedingEvents(due, point, (h <= w[r.LEFT + i]) & one & cheap, cost)


@inline
def distance_of(gap, force):
    """Return the distance of H = `force` from the boundary at which another state would follow a slide.

    `gap` is true if the slide ends in an impact.
    """
    return abs(choose(gap, force, abs(force)) - 1.0)


@inline
def decide_clearly(w, i, event, force, margin):
    """Return (to, margin, clear) for the decision after the zero of switching function `event`, where H = `force`.

    to : the next state
    margin : margin so far, including this decision
    clear : true if rounding cannot change the decision, and if the next state is a slide or a wait that ends
    """
    to, waited, distance = switch.decide(event, w[r.SIG + i], force), event >= S4, distance_of(event == S1, force)
    clear = (waited | (distance >= margins.suspect(w, i))) & (switch.can_leave(w, i, to) | (not switch.waits(to)))
    return to, choose(waited, margin, switch.smaller(distance, margin)), clear


@inline
def is_due(w, k, i, departs, phi):
    """Return whether lane i must compare its state at the phase `phi` with the reference, or replace the reference.

    The result is false if the mass does not leave the obstacle (`departs`). Departures are counted.
    """
    since = switch.commit_departure(k, i, departs)
    return departs & ((phi == w[r.REFERENCE_PHI + i]) | (since >= k[r.WINDOW + i]))


@inline_each("fast", "on_grid", "fixed")
def apply_ordinary(w, k, i, fast, on_grid, fixed, found, extent):
    """Apply the switch found in lane i if it is ordinary, with a disturbance (`fast`) or without. Return `Begun`."""
    event, there, period, x0 = found.event, found.there, k[r.PERIOD + i], w[r.X0 + i]
    gap, waited = event == S1, event >= S4
    force = motion.adhesive_force(w, i, there.q, there.qf) if fast else there.q - w[r.B + i]

    # decide the next state, and whether the switch is ordinary
    ahead = preceding_events(w, k, i, found.h, found.work, extent)
    to, nearest, decided = decide_clearly(w, i, event, force, found.margin)
    over, s = found.ordinary & ahead.within & decided, switch.direction(to)
    if not fast:
        over &= switch.waits(to) | (1.0 + s * w[r.B + i] >= undisturbed.LEAST_FALL)
        sx, sv = motion.section_at(w, i, ahead.due)
        switch.set_next_point(w, k, i, k[r.SECTIONS + i], choose(waited, x0, sx), choose(waited, 0.0, sv))

    # the next segment and its start
    arrived = period + whole(there.turned)
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

    # work left in the lane
    kept, more = recorded, DONE
    if fast:
        switch.commit_segment_fast(w, i, over, segment)
        switch.commit_time_fast(w, i, over, there.theta, there.pf, there.qf, found.late)
    else:
        # after an impact or a rest the state may equal an earlier state, the reference (recurrence.py)
        look = is_due(w, k, i, over & (gap | (event == S5)), there.phi) & (not fixed)
        kept, more = recorded | (k[r.HISTORY_KEEPS + i] == ALL), choose(look, CHECK_RECURRENCE, DONE)
    more += choose(kept, KEEP_SWITCH, DONE)
    switch.set_remaining_work(k, i, choose(over, more, choose(found.aside | found.idle, DONE, UNUSUAL)))
    return Begun(over, to, segment, left)
