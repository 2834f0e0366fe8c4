"""One lane over the end of its search, whatever it has met: the switch is recorded, the next state decided and begun.

The batched loops (`switch_*`) take the ordinary switches, all lanes at once; what they leave, and the switches of a
single trajectory, come here. Both follow switch.py.
"""

from __future__ import annotations

from vibrodrive.jit.compile import inline, inline_each, part, part_each
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.certainty import (
    NO_END,
    end_of_record,
    end_of_segment,
    heed_status,
    judge_tangency,
    pass_errors_on,
)
from vibrodrive.kernels.codes import (
    AT_ONCE,
    BOTH,
    BRACKETED,
    BUDGET,
    CERTIFIED,
    CONTINUE,
    END,
    FALLEN,
    FIXED,
    FIXED_BRACKETED,
    IMPACT,
    LIMIT_MET,
    MULLER_BRACKETED,
    REST,
    S1,
    S2,
    S3,
    S4,
    STEPPED,
    STICK,
    STRETCHED,
    UP,
    ZERO,
)
from vibrodrive.kernels.first_zero import (
    LEAST_GAP,
    fall_from_nothing,
    first_cursor,
    first_grid_point,
    peak_cursor,
    stay_inside,
)
from vibrodrive.kernels.margins import (
    ROUNDING,
    gap_rounding,
    magnitude_scale,
    record_margin,
    record_margin_of_impact,
    record_margin_of_rest,
    record_margin_of_reversal,
    record_margin_of_tangency,
    set_margin,
    velocity_rounding,
    wait_end_distance,
)
from vibrodrive.kernels.motion import (
    Arrival,
    adhesive_force,
    arrive_later,
    arrive_on_grid,
    grid_steps,
    longest,
    propagate,
    state_at,
    time_between,
)
from vibrodrive.kernels.muller import refine, value
from vibrodrive.kernels.record import emit_rest, emit_sections, record
from vibrodrive.kernels.recurrence import ENDED_EARLY, detect_recurrence
from vibrodrive.kernels.switch import (
    SCAN_PRICE,
    SEARCH_PRICE,
    begin,
    can_leave,
    commit_cost,
    commit_departure,
    commit_segment,
    commit_segment_fast,
    commit_state,
    commit_time,
    commit_time_fast,
    commit_wait,
    decide,
    direction,
    number_in_period,
    terminating_function,
    waits,
)
from vibrodrive.kernels.switching import (
    clear_dip,
    restart_search,
    search_shape,
    set_limit,
    set_search,
    start_on_grid,
    turn_side,
)
from vibrodrive.kernels.undisturbed import (
    LEAST_FALL,
    clear_guesses,
    keep_guesses,
    rate_of,
    search_impact,
    search_in_bracket,
    set_bracket,
    set_search_mode,
    set_side,
    wait_end,
)

SMALLEST = 5e-324

NOWHERE = Arrival(*10 * [0.0])


@inline_each("method")
def reach(w, i, method):
    """The end of the search about to begin: the record's end, or where the segment is continued afresh."""
    left = w[r.LEFT + i]
    if method != CERTIFIED:
        return grid_steps(w, i, left)
    most = longest(w, i)
    return left if left < most else most


@inline_each("method")
def begin_search(w, k, i, state, from_rest, method):
    """Begin the search for what ends `state`, at its beginning."""
    limit, which = reach(w, i, method), terminating_function(state)
    set_limit(w, i, True, limit)
    search = search_shape(w, i, which, limit if method == CERTIFIED else limit * w[r.DTAU + i])
    cursor = 0.0 if method == CERTIFIED else 1.0
    if from_rest and not waits(state):
        if method != CERTIFIED:
            cursor = first_grid_point(search, w[r.DTAU + i], limit)
        else:
            disturbed = w[r.AF + i] > 0.0
            cursor = first_cursor(search, limit) if disturbed else peak_cursor(w, i, direction(state), limit)
    set_search(w, k, i, True, which, search, cursor)
    if method != CERTIFIED:
        start_on_grid(w, i, True, which)


@part_each("method")
def begin_state(w, k, i, state, x, v, force, at_boundary, x_off, v_off, method):
    """Begin `state` at the present time, where the adhesive force is `force`, and the search for what ends it."""
    commit_state(k, i, True, state)
    s = direction(state)
    segment = begin(
        s, x, v, force, at_boundary, method != CERTIFIED,
        w[r.B + i], w[r.INVERSE + i], w[r.P + i], w[r.Q + i], w[r.PF + i], w[r.QF + i],
    )  # fmt: skip
    commit_segment(w, i, True, segment, x_off, v_off)
    commit_segment_fast(w, i, True, segment)
    set_search_mode(w, i, True, STEPPED)
    clear_dip(w, i)
    if (method == CERTIFIED or method == MULLER_BRACKETED or method == FIXED_BRACKETED) and w[r.AF + i] == 0.0:
        if s == 0.0:
            h, _, _, down = wait_end(w, i, state, w[r.PHI + i])
            set_bracket(w, k, i, True, terminating_function(state), h, h, h)
            set_search_mode(w, i, True, AT_ONCE)
            set_side(w, i, True, down)
            return
        if v == 0.0 and 1.0 + s * w[r.B + i] >= LEAST_FALL:
            fall = search_in_bracket(w, k, i, s)
            if method == CERTIFIED and fall < w[r.MARGIN + i]:
                set_margin(w, i, True, fall)
            return
    begin_search(w, k, i, state, v == 0.0, method)
    if method == CERTIFIED and s == 0.0:
        stay_inside(w, k, i, force)


@part
def finish_at_rest(w, k, i, transient, section, errors):
    """The mass never moves again."""
    record_margin_of_rest(w, k, i, k[r.STATE + i] == STICK)
    if errors is not None:
        heed_status(w, k, i)
    emit_rest(w, k, i, transient, section, errors, NO_END)


@inline
def certified_event(w, k, i, x):
    """(event, h) of a search without a grid; x = ξ at the cursor."""
    h = w[r.CURSOR + i]
    met = w[r.OUTCOME + i]
    which = k[r.SEARCH + i]
    if w[r.SEARCH_MODE + i] == BRACKETED:
        if which == S1:
            return S1, h
        if which == S3 or x > 0.0:
            if which == S2:
                record_margin(w, k, i, x, gap_rounding(w, i, h))
            return which, h
    if which == S2:
        if met == FALLEN or x <= 0.0:
            if w[r.AF + i] == 0.0:
                # ξ has fallen all the way: it has one zero
                record_margin(w, k, i, 0.0 - x, gap_rounding(w, i, h))
                search_impact(w, k, i, h, x)
                return CONTINUE, h
            # an impact comes before the end of the slide: look for it from the last instant with ξ >= 0
            if met == ZERO:
                record_margin(w, k, i, 0.0 - x, gap_rounding(w, i, h))
            above = w[r.LAST_NONNEGATIVE + i]
            restart_search(w, k, i, S1, h, above if w[r.X0 + i] >= LEAST_GAP else fall_from_nothing(w, i, h))
            set_limit(w, i, True, h)  # where ξ <= 0 was seen: should rounding hide the zero, the impact is there
            return CONTINUE, h
        if met == ZERO:
            record_margin(w, k, i, x, gap_rounding(w, i, h))
    elif which == S1 and (met == ZERO or (h >= w[r.LIMIT + i] and x <= 0.0)):
        return S1, h
    if met == LIMIT_MET:
        return END if h >= w[r.LEFT + i] else STRETCHED, h
    return which, h


@part
def grid_event(w, k, i, fixed):
    """(event, h) of a search on the grid: at the grid point that eq. (10) finds (fixed) or refined (Muller)."""
    cursor = w[r.CURSOR + i]
    dtau = w[r.DTAU + i]
    h = cursor * dtau
    before = (cursor - 1.0) * dtau
    met = w[r.OUTCOME + i]
    which = k[r.SEARCH + i]
    if which == S4 and met == LIMIT_MET:
        # one side has reached the limit unchanged: the other side's last grid point is still to be seen
        turn_side(w, i)
        if value(w, i, h) < 0.0:
            met = ZERO
    if met == LIMIT_MET:
        return END if h >= w[r.LEFT + i] else STRETCHED, h
    hit = which == S1 or met == FALLEN
    if met == FALLEN and cursor - w[r.LAST_NONNEGATIVE + i] > 1.0:
        # ξ fell below 0 somewhere in a stretch free of other switches: visit it for the first such grid point
        above = w[r.LAST_NONNEGATIVE + i]
        restart_search(w, k, i, S1, h, above + 1.0)
        return CONTINUE, h
    if fixed:
        hit = hit or met == BOTH
    else:
        if which == S2 and not hit:
            h = refine(w, i, before, h)
            x, _ = state_at(w, i, h, w[r.AF + i] > 0.0)
            hit = x <= 0.0
        if hit:
            if which != S1:
                restart_search(w, k, i, S1, h, 0.0)
            h = refine(w, i, before, h)
        elif which != S2:
            h = refine(w, i, before, h)
    return S1 if hit else which, h


@inline_each("method", "repeats")
def process_event(
    w, k, i, method, repeats, literal, transient, periods, budget, section, impacts, history, totals, summary,
    rows, off, stored, errors,
):  # fmt: skip
    """Lane i has met something: record it, decide, begin the next search. False when the trajectory has ended.

    repeats: whether the motion is looked at for a return to where it has been. Times on a fixed grid never come back; a
    literal scan visits every point; a single trajectory's switches are written down one by one.
    An impact leaves ξ = ξ' = 0, eq. (7).
    """
    if w[r.LEFT + i] == ENDED_EARLY:
        return False
    certified = method == CERTIFIED
    fixed = method == FIXED or method == FIXED_BRACKETED
    undisturbed = certified and w[r.AF + i] == 0.0
    state = k[r.STATE + i]
    there, end_error = NOWHERE, NO_END
    phase, later, side, late = 0.0, False, w[r.SIG + i], 0.0
    if undisturbed and waits(state):
        h, phase, later, down = wait_end(w, i, state, w[r.PHI + i])
        event, side = terminating_function(state), 1.0 if down else -1.0
    elif certified:
        wait_ends = waits(state) and w[r.OUTCOME + i] == ZERO
        there, late = propagate(w, k, i, wait_ends, -1.0 if side > 0.0 else 1.0)
        record_margin_of_tangency(w, k, i, w[r.CURSOR + i])
        if errors is not None:
            judge_tangency(w, k, i)
        if w[r.SEARCH_MODE + i] == BRACKETED and k[r.SEARCH + i] != S1:
            s = direction(state)
            rate = rate_of(w[r.A0 + i], adhesive_force(w, i, there.q, 0.0) - s)
            keep_guesses(w, i, s > 0.0, s < 0.0, False, w[r.PHI + i], w[r.CURSOR + i], rate)
        event, h = certified_event(w, k, i, there.x)
        side = w[r.SIG + i]
    else:
        event, h = grid_event(w, k, i, fixed)
        side = w[r.SIG + i]
    while True:
        if event == CONTINUE:
            return True
        if event == END or h > w[r.LEFT + i]:
            if errors is not None:
                end_error = end_of_record(w, k, i)
            emit_rest(w, k, i, transient, section, errors, end_error)
            return False
        state = k[r.STATE + i]
        sliding = not waits(state)
        x, v = w[r.X0 + i], 0.0
        if sliding:
            x, v = there.x, there.v
            if not certified:
                x, v = state_at(w, i, h, w[r.AF + i] > 0.0)
        if undisturbed and not sliding:
            p, q = (w[r.P_DOWN + i] if side > 0.0 else w[r.P_UP + i]), w[r.B + i] - side
            there = Arrival(x, v, 1.0 if later else 0.0, phase, 0.0, p, q, 0.0, 0.0, 0.0)
        elif not (certified or fixed):
            there = arrive_later(w, k, i, x, v, h)
        if errors is not None:
            end_error = end_of_segment(w, k, i, method, event, h, x, v, side, there)
        emit_sections(w, k, i, h, transient, section, errors, end_error)
        x_off, v_off = w[r.X_OFF + i], 0.0
        if event == S1:
            x_off = 0.0
        elif sliding:
            x_off = gap_rounding(w, i, h)
            v_off = velocity_rounding(w, i, h) if event == STRETCHED else 0.0

        # what one period may cost: switches, and what their searches took
        price = SCAN_PRICE if literal else SEARCH_PRICE
        cost = number_in_period(k, i) + int((w[r.WORK + i] - w[r.WORK_BOOKED + i]) * price)
        commit_cost(w, k, i, True, k[r.PERIOD + i], cost)
        if cost > budget:
            k[r.STATUS + i] = BUDGET
            return False

        # advance to the switch
        if undisturbed and not sliding:
            record_margin(w, k, i, wait_end_distance(w, i, side > 0.0), ROUNDING * magnitude_scale(w, i))
        elif fixed:
            there = arrive_on_grid(w, k, i, x, v, w[r.CURSOR + i])
        period = k[r.PERIOD + i] + int(there.turned)
        end = k[r.PERIOD0 + i] + transient + periods
        left = time_between(period, there.phi, there.low, end, w[r.PHI0 + i])
        commit_time(w, k, i, True, period, there.phi, there.low, left, there.p, there.q)
        commit_time_fast(w, i, True, there.theta, there.pf, there.qf, late)
        force = -side if undisturbed and not sliding else adhesive_force(w, i, there.q, there.qf)

        if event == STRETCHED:
            begin_state(w, k, i, state, x, v, force, False, x_off, v_off, method)
            if errors is not None:
                pass_errors_on(w, k, i, method, event, end_error)
            return True
        # decide
        to = decide(event, side, force)
        if event == S1:
            x = 0.0 if certified else x
            record(
                w, k, i, state, IMPACT, x, v, transient, impacts, history, totals, rows, off, stored, end_error,
            )  # fmt: skip
            record_margin_of_impact(w, k, i, h, force, v)
            state, x, v = IMPACT, 0.0, 0.0
        elif sliding:
            if certified and to == state:
                to = STICK  # where ξ' has just fallen to 0 its slope is not positive: H is beyond 1 by rounding only
            v = 0.0 if certified else v
            if certified and x <= 0.0:
                x = SMALLEST  # it has gone up, by less than a double can tell
            record_margin_of_reversal(w, k, i, h, force, force - (1.0 if state == UP else -1.0))
        record(
            w, k, i, state, to, x, v, transient, impacts, history, totals, rows, off, stored, end_error,
        )  # fmt: skip
        waiting = waits(to)
        if waiting and not can_leave(w, i, to):
            commit_wait(w, k, i, to, x, x_off)
            if errors is not None:
                pass_errors_on(w, k, i, method, event, end_error)
            finish_at_rest(w, k, i, transient, section, errors)
            return False
        if not (undisturbed and waiting):
            if undisturbed and state == REST:
                clear_guesses(w, i)
            at_boundary = certified and (state == STICK or state == REST)
            begin_state(w, k, i, to, x, 0.0, force, at_boundary, x_off, v_off, method)
            if errors is not None:
                pass_errors_on(w, k, i, method, event, end_error)
            if state == REST or state == IMPACT:
                commit_departure(k, i, True)
                if repeats:
                    return detect_recurrence(
                        w, k, i, certified, transient, periods, budget, section, impacts, history, totals, summary
                    )  # fmt: skip
            return True
        commit_wait(w, k, i, to, x, x_off)
        if errors is not None:
            pass_errors_on(w, k, i, method, event, end_error)
        h, phase, later, down = wait_end(w, i, to, w[r.PHI + i])
        event, side = terminating_function(to), 1.0 if down else -1.0
