"""Processing of one lane after the search for the end of its state, for every result of the search.

The switch is recorded, the next state is determined, and this state begins.

The modules `switch_*` apply ordinary switches (engine.py) in all lanes together. This module processes all other
switches, and the switches of single trajectories. All these modules use the formulas of switch.py.
`kernels/__init__.py` explains the terms.
"""

from typing import NamedTuple

from vibrodrive.jit.compile import inline, inline_each, part, part_each
from vibrodrive.kernels import certainty, codes, first_zero, margins, motion, muller, record, switch, undisturbed
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.outputs import Switch

SMALLEST = 5e-324

NOWHERE = motion.Arrival(*10 * [0.0])


class Start(NamedTuple):
    """Initial values of a state: ξ, ξ', and bounds of their rounding errors."""

    x: float
    v: float
    x_off: float
    v_off: float


@inline_each("method")
def begin_search(w, k, i, state, from_rest, method):
    """Begin the search for the end of `state`, which has just begun (at rest if `from_rest`).

    The limit of the search is the end of the record, or the end of the longest segment (`longest` in motion.py) if this
    is earlier. If the state lasts longer, it continues in a new segment.
    """
    which, slides = switch.terminating_function(state), from_rest and not switch.waits(state)
    if method == codes.CERTIFIED:
        limit, cursor = switch.smaller(w[r.LEFT + i], motion.longest(w, i)), 0.0
        search = first_zero.search_shape(w, i, which, limit)
        if slides and w[r.AF + i] > 0.0:
            cursor = first_zero.first_cursor(search, limit)
        elif slides:
            cursor = first_zero.peak_cursor(w, i, switch.direction(state), limit)
    else:
        limit, cursor = motion.grid_steps(w, i, w[r.LEFT + i]), 1.0
        search = first_zero.search_shape(w, i, which, limit * w[r.DTAU + i])
        if slides:
            cursor = first_zero.first_grid_point(search, w[r.DTAU + i], limit)
    first_zero.set_limit(w, i, True, limit)
    first_zero.set_search(w, k, i, True, which, search, cursor)
    if method != codes.CERTIFIED:
        first_zero.start_on_grid(w, i, True, which)


@part_each("method")
def begin_state(w, k, i, state, start, force, at_boundary, method):
    """Begin `state` at the present time, where H = `force`, and begin the search for its end.

    `start` has the initial values. `at_boundary` is that of `begin` in switch.py.
    """
    switch.commit_state(k, i, True, state)
    s = switch.direction(state)
    field = motion.Field(w[r.P + i], w[r.Q + i], w[r.PF + i], w[r.QF + i])
    on_grid = method != codes.CERTIFIED
    segment = switch.begin(s, start.x, start.v, force, at_boundary, on_grid, w[r.B + i], w[r.INVERSE + i], field)
    switch.commit_segment(w, i, True, segment, start.x_off, start.v_off)
    switch.commit_segment_fast(w, i, True, segment)
    undisturbed.set_search_mode(w, i, True, codes.STEPPED)
    margins.clear_tangency(w, i)
    bracketed = method == codes.FIXED_BRACKETED or method == codes.MULLER_BRACKETED
    if (bracketed or not on_grid) and w[r.AF + i] == 0.0:
        if s == 0.0:
            h, _, _, down = undisturbed.wait_end(w, i, state, w[r.PHI + i])
            undisturbed.set_bracket(w, k, i, True, switch.terminating_function(state), h, h, h)
            undisturbed.set_search_mode(w, i, True, codes.AT_ONCE)
            undisturbed.set_side(w, i, True, down)
            return
        if start.v == 0.0 and 1.0 + s * w[r.B + i] >= undisturbed.LEAST_FALL:
            fall = undisturbed.search_in_bracket(w, k, i, s)
            if method == codes.CERTIFIED and fall < w[r.MARGIN + i]:
                margins.set_margin(w, i, True, fall)
            return
    begin_search(w, k, i, state, start.v == 0.0, method)
    if method == codes.CERTIFIED and s == 0.0:
        first_zero.stay_inside(w, k, i, force)


@part
def finish_at_rest(w, k, i, transient, section, errors):
    """Write the results of a motion whose mass never moves again."""
    margins.record_margin_of_rest(w, k, i, k[r.STATE + i] == codes.STICK)
    certainty.check_certainty(w, k, i, errors)
    record.emit_rest(w, k, i, transient, section, errors, certainty.NO_END)


@inline
def certified_event(w, k, i, x):
    """Return (event, h) for the outcome of a search without a grid; x is ξ at the cursor.

    `event` is the switching function that is zero at h, or CONTINUE, STRETCHED or END (codes.py).
    """
    h = w[r.CURSOR + i]
    met = w[r.OUTCOME + i]
    which = k[r.SEARCH + i]
    if w[r.SEARCH_MODE + i] == codes.BRACKETED:
        if which == codes.S1:
            return codes.S1, h
        if which == codes.S3 or x > 0.0:
            if which == codes.S2:
                margins.record_margin(w, k, i, x, margins.gap_rounding(w, i, h))
            return which, h
    if which == codes.S2:
        if met == codes.FALLEN or x <= 0.0:
            if w[r.AF + i] == 0.0:
                # ξ has decreased strictly, so it has one zero
                margins.record_margin(w, k, i, 0.0 - x, margins.gap_rounding(w, i, h))
                undisturbed.search_impact(w, k, i, h, x)
                return codes.CONTINUE, h
            # an impact precedes the end of the slide: search for this impact from the last instant with ξ >= 0
            if met == codes.ZERO:
                margins.record_margin(w, k, i, 0.0 - x, margins.gap_rounding(w, i, h))
            start = w[r.LAST_NONNEGATIVE + i]
            if w[r.X0 + i] < first_zero.LEAST_GAP:
                start = first_zero.fall_from_tiny_gap(w, i, h)
            first_zero.restart_search(w, k, i, codes.S1, h, start)
            # ξ <= 0 at h: if the search finds no zero because of rounding, the impact is at h
            first_zero.set_limit(w, i, True, h)
            return codes.CONTINUE, h
        if met == codes.ZERO:
            margins.record_margin(w, k, i, x, margins.gap_rounding(w, i, h))
    elif which == codes.S1 and (met == codes.ZERO or (h >= w[r.LIMIT + i] and x <= 0.0)):
        return codes.S1, h
    if met == codes.LIMIT_MET:
        return codes.END if h >= w[r.LEFT + i] else codes.STRETCHED, h
    return which, h


@part
def grid_event(w, k, i, fixed):
    """Return (event, h) for the outcome of a search on a grid; `event` as from `certified_event`.

    If `fixed`, h is the time of the grid point by eq. (10). Otherwise h is the zero refined by Muller's method.
    """
    cursor = w[r.CURSOR + i]
    dtau = w[r.DTAU + i]
    h = cursor * dtau
    before = (cursor - 1.0) * dtau
    met = w[r.OUTCOME + i]
    which = k[r.SEARCH + i]
    if which == codes.S4 and met == codes.LIMIT_MET:
        # one side of S4 has no zero up to the limit: check the last grid point for the other side
        first_zero.turn_side(w, i)
        if muller.value(w, i, h) < 0.0:
            met = codes.ZERO
    if met == codes.LIMIT_MET:
        return codes.END if h >= w[r.LEFT + i] else codes.STRETCHED, h
    hit = which == codes.S1 or met == codes.FALLEN
    if met == codes.FALLEN and cursor - w[r.LAST_NONNEGATIVE + i] > 1.0:
        # ξ fell below 0 in an interval of several steps without other switches: search for the first point with ξ < 0
        above = w[r.LAST_NONNEGATIVE + i]
        first_zero.restart_search(w, k, i, codes.S1, h, above + 1.0)
        return codes.CONTINUE, h
    if fixed:
        hit = hit or met == codes.BOTH
    else:
        if which == codes.S2 and not hit:
            h = muller.refine(w, i, before, h)
            x, _ = motion.state_at(w, i, h, w[r.AF + i] > 0.0)
            hit = x <= 0.0
        if hit:
            if which != codes.S1:
                first_zero.restart_search(w, k, i, codes.S1, h, 0.0)
            h = muller.refine(w, i, before, h)
        elif which != codes.S2:
            h = muller.refine(w, i, before, h)
    return codes.S1 if hit else which, h


@inline
def end_of_wait(w, i, state):
    """Return (event, h, side, arrival) at the end of a wait at ε = 0, which is known without a search.

    `event` is S4 or S5, and `side` is 1 if H falls to -1 there, or -1 if H rises to 1.
    """
    h, phase, later, down = undisturbed.wait_end(w, i, state, w[r.PHI + i])
    side, p = (1.0 if down else -1.0), (w[r.P_DOWN + i] if down else w[r.P_UP + i])
    there = motion.Arrival(w[r.X0 + i], 0.0, 1.0 if later else 0.0, phase, 0.0, p, w[r.B + i] - side, 0.0, 0.0, 0.0)
    return switch.terminating_function(state), h, side, there


@inline
def end_of_search(w, k, i, errors):
    """Return (event, h, side, arrival, LATE) for the outcome of a search without a grid.

    event, h : as from `certified_event`
    side : if event is S4, the side: 1 if H falls to -1 there, or -1 if H rises to 1
    arrival, LATE : as from `propagate` in motion.py
    """
    state, level = k[r.STATE + i], -1.0 if w[r.SIG + i] > 0.0 else 1.0
    there, late = motion.propagate(w, k, i, switch.waits(state) and w[r.OUTCOME + i] == codes.ZERO, level)
    margins.record_margin_of_tangency(w, k, i, w[r.CURSOR + i])
    if errors is not None:
        certainty.judge_tangency(w, k, i)
    if w[r.SEARCH_MODE + i] == codes.BRACKETED and k[r.SEARCH + i] != codes.S1:
        s = switch.direction(state)
        rate = undisturbed.rate_of(w[r.A0 + i], motion.adhesive_force(w, i, there.q, 0.0) - s)
        undisturbed.keep_guesses(w, i, s > 0.0, s < 0.0, False, w[r.PHI + i], w[r.CURSOR + i], rate)
    event, h = certified_event(w, k, i, there.x)
    return event, h, w[r.SIG + i], there, late


@inline_each("method")
def end_of_state(w, k, i, method, errors):
    """Return (event, h, side, arrival, LATE) for the outcome in lane i, as `end_of_search` does.

    On a grid `process_event` computes the arrival later, and the returned one has no meaning.
    """
    if method == codes.CERTIFIED:
        if w[r.AF + i] == 0.0 and switch.waits(k[r.STATE + i]):
            event, h, side, there = end_of_wait(w, i, k[r.STATE + i])
            return event, h, side, there, 0.0
        return end_of_search(w, k, i, errors)
    event, h = grid_event(w, k, i, method == codes.FIXED or method == codes.FIXED_BRACKETED)
    return event, h, w[r.SIG + i], NOWHERE, 0.0


@inline
def book_cost(w, k, i, extent):
    """Add the cost of the switch and its search to the cost of the present period.

    Return False if the cost of this period exceeds the budget.
    """
    cost = switch.number_in_period(k, i) + int((w[r.WORK + i] - w[r.WORK_BOOKED + i]) * switch.SEARCH_PRICE)
    switch.commit_cost(w, k, i, True, k[r.PERIOD + i], cost)
    if cost > extent.budget:
        k[r.STATUS + i] = codes.BUDGET
        return False
    return True


@inline
def offsets_at_end(w, k, i, event, h):
    """Return (gap, velocity): bounds of the rounding errors of ξ and ξ' at the end of a segment.

    `velocity` is 0 if a new state begins, because this state starts with exactly ξ' = 0.
    """
    if event == codes.S1:
        return 0.0, 0.0
    if switch.waits(k[r.STATE + i]):
        return w[r.X_OFF + i], 0.0
    return margins.gap_rounding(w, i, h), margins.velocity_rounding(w, i, h) if event == codes.STRETCHED else 0.0


@inline_each("method")
def move_to_end(w, k, i, method, x, v, side, there, late, extent):
    """Advance lane i to the end of its state, and return H there. For `fixed`, compute the arrival first."""
    known = method == codes.CERTIFIED and w[r.AF + i] == 0.0 and switch.waits(k[r.STATE + i])
    if known:
        bound = margins.ROUNDING * margins.magnitude_scale(w, i)
        margins.record_margin(w, k, i, margins.wait_end_distance(w, i, side > 0.0), bound)
    elif method == codes.FIXED or method == codes.FIXED_BRACKETED:
        there = motion.arrive_on_grid(w, k, i, x, v, w[r.CURSOR + i])
    period = k[r.PERIOD + i] + int(there.turned)
    left = switch.time_left(w, k, i, period, there.phi, there.low, extent)
    switch.commit_time(w, k, i, True, period, there.phi, there.low, left, there.p, there.q)
    switch.commit_time_fast(w, i, True, there.theta, there.pf, there.qf, late)
    return -side if known else motion.adhesive_force(w, i, there.q, there.qf)


@inline_each("method")
def begin_next(w, k, i, method, searched, state, to, start, force):
    """Begin state `to` after `state`. If `searched`, also begin the search for the end of `to`.

    Otherwise `to` is a wait whose end is known without a search, or a wait that never ends.
    """
    if not searched:
        switch.commit_wait(w, k, i, to, start.x, start.x_off)
        return
    if method == codes.CERTIFIED and w[r.AF + i] == 0.0 and state == codes.REST:
        undisturbed.clear_guesses(w, i)
    at_boundary = method == codes.CERTIFIED and (state == codes.STICK or state == codes.REST)
    begin_state(w, k, i, to, start, force, at_boundary, method)
    if state == codes.REST or state == codes.IMPACT:
        switch.commit_departure(k, i, True)
        switch.set_remaining_work(k, i, codes.CHECK_RECURRENCE)


@inline
def reverse(w, k, i, certified, h, to, x, force):
    """Return (next state, ξ) after a slide of duration h that ends in the air. `to` is the next state by Fig. 2."""
    state = k[r.STATE + i]
    margins.record_margin_of_reversal(w, k, i, h, force, force - (1.0 if state == codes.UP else -1.0))
    if certified and to == state:
        to = codes.STICK  # ξ' has just reached 0, so ξ'' cannot continue the slide: |H| exceeds 1 only by rounding
    return to, SMALLEST if certified and x <= 0.0 else x  # the mass has moved up by less than a double resolves


@inline_each("method")
def process_event(w, k, i, method, extent, section, impacts, recorder, log, errors):
    """Process the outcome of the search in lane i: record the switch, determine the next state, and begin this state.

    Return False if the trajectory ends. After an impact ξ = ξ' = 0, eq. (7). If the mass leaves the obstacle, LEFT_OVER
    is set to CHECK_RECURRENCE (codes.py).
    """
    if w[r.LEFT + i] == codes.ENDED_EARLY:
        return False
    certified, fixed = method == codes.CERTIFIED, method == codes.FIXED or method == codes.FIXED_BRACKETED
    still = certified and w[r.AF + i] == 0.0
    switch.set_remaining_work(k, i, codes.DONE)
    event, h, side, there, late = end_of_state(w, k, i, method, errors)
    while event != codes.CONTINUE:
        if event == codes.END or h > w[r.LEFT + i]:
            end = certainty.record_end(w, k, i, errors)
            record.emit_rest(w, k, i, extent.transient, section, errors, end)
            return False
        state = k[r.STATE + i]
        sliding = not switch.waits(state)
        x, v = w[r.X0 + i], 0.0
        if sliding:
            x, v = there.x, there.v
            if not certified:
                x, v = motion.state_at(w, i, h, w[r.AF + i] > 0.0)
        if not (certified or fixed):
            there = motion.arrive_later(w, k, i, x, v, h)
        end = certainty.segment_end(w, k, i, method, event, h, side, there, errors)
        record.emit_sections(w, k, i, h, extent.transient, section, errors, end)
        x_off, v_off = offsets_at_end(w, k, i, event, h)
        if not book_cost(w, k, i, extent):
            return False
        force = move_to_end(w, k, i, method, x, v, side, there, late, extent)
        if event == codes.STRETCHED:
            begin_state(w, k, i, state, Start(x, v, x_off, v_off), force, False, method)
            certainty.pass_on(w, k, i, method, event, end, errors)
            return True
        to = switch.decide(event, side, force)
        if event == codes.S1:
            x = 0.0 if certified else x
            record.record(
                w, k, i, Switch(state, codes.IMPACT, x, v), extent.transient, impacts, recorder, log, errors, end
            )
            margins.record_margin_of_impact(w, k, i, h, force, v)
            state, x, v = codes.IMPACT, 0.0, 0.0
        elif sliding:
            to, x = reverse(w, k, i, certified, h, to, x, force)
            v = 0.0 if certified else v
        record.record(w, k, i, Switch(state, to, x, v), extent.transient, impacts, recorder, log, errors, end)
        leaves = switch.can_leave(w, i, to) or not switch.waits(to)
        known = leaves and still and switch.waits(to)
        begin_next(w, k, i, method, leaves and not known, state, to, Start(x, 0.0, x_off, v_off), force)
        certainty.pass_on(w, k, i, method, event, end, errors)
        if not leaves:
            finish_at_rest(w, k, i, extent.transient, section, errors)
        if not known:
            return leaves
        event, h, side, there = end_of_wait(w, i, to)
    return True
