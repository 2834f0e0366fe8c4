"""The one loop: find the next switch, advance to it, decide, record. For one trajectory and for many abreast.

`run` keeps up to `LANES` trajectories under way. Each pass goes some steps on in every lane's search (locate.py;
calm.py at ε = 0) and takes the lanes that met an ordinary switch over it (abreast.py), both vectorised. Anything else,
the switches on a grid and those of a single trajectory are settled one by one: the switch is recorded, the next
state decided and its search begun. A motion that repeats itself is not computed again (recurrence.py), and a lane
whose trajectory ends takes the next point at once. Lanes never look at each other, so a trajectory's bits depend on
nothing but its point.
"""

from __future__ import annotations

import math

from vibrodrive import lane as r
from vibrodrive._jit import inline, jit, part
from vibrodrive.abreast import cross_all, cross_all_disturbed, mark_points, write_ahead
from vibrodrive.abreast_refined import cross_all_refined
from vibrodrive.calm import (
    AT_ONCE,
    BRACKETED,
    LEAST_FALL,
    STEPPED,
    aim_at_impact,
    aim_in_bracket,
    narrow_all,
    remember,
    wait_end,
)
from vibrodrive.counter import next_index
from vibrodrive.lane import LANES, ROWS_K, ROWS_W, STRIDE
from vibrodrive.literal import fill_tables
from vibrodrive.literal import scan as scan_every
from vibrodrive.locate import (
    BOTH,
    FALLEN,
    LEAST_GAP,
    LIMIT_MET,
    NOTHING,
    ZERO,
    fall_from_nothing,
    search_on_grid,
    search_stepwise,
    skip_start,
    stay_inside,
)
from vibrodrive.margins import (
    ROUNDING,
    calm_end_distance,
    gap_rounding,
    meet,
    meet_for_ever,
    meet_force,
    meet_hit,
    meet_tangency,
    meet_turn,
    terms,
    velocity_rounding,
)
from vibrodrive.motion import (
    LONGEST_SCAN,
    arrive,
    depart,
    excitation,
    force_at,
    grid_time,
    longest,
    pass_time,
    place,
    slide,
    state_at,
    time_until,
)
from vibrodrive.muller import refine, value
from vibrodrive.parameters import Method, Scan, State, Status
from vibrodrive.record import LOOK_BACK, SETTLE, emit_rest, emit_sections, finish, record, write_points, write_row
from vibrodrive.recurrence import forget, look_ahead, look_back
from vibrodrive.switching import (
    INFINITY,
    S1,
    S2,
    S3,
    S4,
    S5,
    UNKNOWN,
    aim,
    can_leave,
    decide_at_obstacle,
    decide_in_air,
    ended_by,
)
from vibrodrive.trig import PI, PI_LOW, TWO_PI, arcsine, turns

UP, DOWN, STICK, REST, IMPACT = (int(s) for s in State)
FIXED, MULLER, CERTIFIED = (int(m) for m in Method)
LITERAL = int(Scan.LITERAL)
OK, BUDGET = int(Status.OK), int(Status.BUDGET)

STEPS, EVALUATIONS = 3, 2
"""Of a search between two looks at what it has met, with and without a disturbance: most are over by then, and
looking costs more than a step."""

LEAPT = CERTIFIED + 1
"""`method` within the engine where Muller's scans are leapt over at ε = 0 (abreast_refined.py): no switch of it is
written down one by one, and no scan is asked for by name."""

SMALLEST = 5e-324


@inline
def stretch(w, i, method):
    """The end of the search about to begin: the record's end, or where the segment is continued afresh."""
    most = longest(w, i)
    left = w[r.LEFT + i]
    if method == CERTIFIED:
        w[r.LIMIT + i] = left if left < most else most
    else:
        steps = float(math.floor(most / w[r.DTAU + i]))
        steps = steps if steps < LONGEST_SCAN else LONGEST_SCAN
        last = float(math.ceil(left / w[r.DTAU + i]))
        steps = steps if steps < last else last
        w[r.LIMIT + i] = steps if steps > 1.0 else 1.0


@inline
def begin_search(w, k, i, state, method):
    """Aim at the switching function that ends `state` (switching.py) and put the cursor at its start."""
    stretch(w, i, method)
    span = w[r.LIMIT + i] if method == CERTIFIED else w[r.LIMIT + i] * w[r.DTAU + i]
    aim(w, k, i, ended_by(state), span)
    if method != CERTIFIED:
        w[r.H + i] = 1.0
        if state == DOWN:
            w[r.DIP + i] = 0.0
        if state == STICK:
            w[r.OTHER + i] = 1.0


@part
def enter(w, k, i, state, x, v, h_force, at_boundary, method):
    """Begin `state` at the present time, where the adhesive force is h_force, and aim at what ends it."""
    k[r.STATE + i] = state
    s = 1.0 if state == UP else (-1.0 if state == DOWN else 0.0)
    a0 = h_force - s
    if v == 0.0 and (at_boundary or a0 * s < 0.0):
        a0 = 0.0  # H = ±1 by definition where a wait ends
    slide(w, i, s, x, v, a0)
    w[r.KIND + i] = STEPPED
    w[r.NEAR_UNDER + i] = 0.0
    if (method == CERTIFIED or method == LEAPT) and w[r.AF + i] == 0.0:
        if s == 0.0:
            w[r.KIND + i] = AT_ONCE
            w[r.H + i], _, _, down = wait_end(w, i, state, w[r.PHI + i])
            w[r.SIG + i] = 1.0 if down else -1.0
            k[r.SEARCH + i] = ended_by(state)
            return
        if v == 0.0 and 1.0 + s * w[r.B + i] >= LEAST_FALL:
            fall = aim_in_bracket(w, k, i, s)
            if method == CERTIFIED and fall < w[r.MARGIN + i]:
                w[r.MARGIN + i] = fall
            return
    begin_search(w, k, i, state, method)
    if method == CERTIFIED and v == 0.0:
        if s == 0.0:
            stay_inside(w, k, i, h_force)
        else:
            skip_start(w, i, s)


@part
def stay(w, k, i, transient, section):
    """The mass never moves again."""
    emit_rest(w, k, i, transient, section)
    meet_for_ever(w, k, i, k[r.STATE + i] == STICK)


CONTINUE, END, STRETCHED, TURN, HIT, LEAVE_UP, LEAVE_DOWN = 0, 1, 2, 3, 4, 5, 6


@inline
def certified_event(w, k, i, x):
    """(event, h) of a search without a grid; x = ξ at the cursor."""
    h = w[r.H + i]
    met = w[r.MET + i]
    which = k[r.SEARCH + i]
    if w[r.KIND + i] == BRACKETED:
        if which == S1:
            return HIT, h
        if which == S3 or x > 0.0:
            if which == S2:
                meet(w, k, i, x, gap_rounding(w, i, h))
            return TURN, h
    if which == S2:
        if met == FALLEN or x <= 0.0:
            if w[r.AF + i] == 0.0:
                # ξ has fallen all the way: it has one zero
                meet(w, k, i, 0.0 - x, gap_rounding(w, i, h))
                aim_at_impact(w, k, i, h, x)
                return CONTINUE, h
            # an impact comes before the end of the slide: look for it from the last instant with ξ >= 0
            if met == ZERO:
                meet(w, k, i, 0.0 - x, gap_rounding(w, i, h))
            above = w[r.ABOVE + i]
            aim(w, k, i, S1, h)
            w[r.H + i] = above if w[r.X0 + i] >= LEAST_GAP else fall_from_nothing(w, i, h)
            w[r.LIMIT + i] = h  # where ξ <= 0 was seen: should rounding hide the zero, the impact is there
            return CONTINUE, h
        if met == ZERO:
            meet(w, k, i, x, gap_rounding(w, i, h))
    elif which == S1 and (met == ZERO or (h >= w[r.LIMIT + i] and x <= 0.0)):
        return HIT, h
    if met == LIMIT_MET:
        return END if h >= w[r.LEFT + i] else STRETCHED, h
    if which == S4:
        return LEAVE_UP if w[r.SIG + i] < 0.0 else LEAVE_DOWN, h
    return LEAVE_UP if which == S5 else TURN, h


@part
def grid_event(w, k, i, method):
    """(event, h) of a search on the grid: at the grid point itself (fixed) or refined (Muller)."""
    cursor = w[r.H + i]
    dtau = w[r.DTAU + i]
    h = cursor * dtau
    before = (cursor - 1.0) * dtau
    met = w[r.MET + i]
    which = k[r.SEARCH + i]
    if which == S4 and met == LIMIT_MET:
        # one side has reached the limit unchanged: the other side's last grid point is still to be seen
        w[r.SIG + i] = -w[r.SIG + i]
        w[r.VALUE + i] = w[r.BEFORE + i] = UNKNOWN
        if value(w, i, h) < 0.0:
            met = ZERO
    if met == LIMIT_MET:
        return END if h >= w[r.LEFT + i] else STRETCHED, h
    hit = which == S1 or met == FALLEN
    if met == FALLEN and cursor - w[r.ABOVE + i] > 1.0:
        # ξ fell below 0 somewhere in a stretch free of other switches: visit it for the first such grid point
        above = w[r.ABOVE + i]
        aim(w, k, i, S1, h)
        w[r.H + i] = above + 1.0
        return CONTINUE, h
    if method == FIXED:
        hit = hit or met == BOTH
    else:
        if which == S2 and not hit:
            h = refine(w, i, before, h)
            x, _ = state_at(w, i, h, w[r.AF + i] > 0.0)
            hit = x <= 0.0
        if hit:
            if which != S1:
                aim(w, k, i, S1, h)
            h = refine(w, i, before, h)
        elif which != S2:
            h = refine(w, i, before, h)
    if hit:
        return HIT, h
    if which == S4:
        return LEAVE_UP if w[r.SIG + i] < 0.0 else LEAVE_DOWN, h
    return LEAVE_UP if which == S5 else TURN, h


@inline
def settle(w, k, i, method, scan, transient, periods, budget, section, rows_int, rows_float, stored):
    """Lane i has met something: record it, decide, begin the next search. False when the trajectory has ended.

    Without a grid the motion and the excitation there have been put down (motion.py).
    """
    certified = method == CERTIFIED
    calm = certified and w[r.AF + i] == 0.0
    # times on a fixed grid never come back; the literal scan visits every point; a single trajectory's switches are
    # written down one by one
    may_repeat = w[r.AF + i] == 0.0 and method != FIXED and scan != LITERAL and rows_int.shape[0] == 0
    phase, later = 0.0, False
    if calm and (k[r.STATE + i] == STICK or k[r.STATE + i] == REST):
        h, phase, later, down = wait_end(w, i, k[r.STATE + i], w[r.PHI + i])
        event = LEAVE_DOWN if down else LEAVE_UP
    elif certified:
        meet_tangency(w, k, i, w[r.H + i])
        if w[r.KIND + i] == BRACKETED and k[r.SEARCH + i] != S1:
            s = 1.0 if k[r.SEARCH + i] == S3 else -1.0
            remember(w, i, s, w[r.H + i], (w[r.THERE_Q + i] - w[r.B + i]) - s)
        event, h = certified_event(w, k, i, w[r.THERE_X + i])
    else:
        event, h = grid_event(w, k, i, method)
    while True:
        if event == CONTINUE:
            return True
        if event == END or h > w[r.LEFT + i]:
            emit_rest(w, k, i, transient, section)
            return False
        state = k[r.STATE + i]
        x, v = w[r.X0 + i], 0.0
        if state == UP or state == DOWN:
            if certified:
                x, v = w[r.THERE_X + i], w[r.THERE_V + i]
            else:
                x, v = state_at(w, i, h, w[r.AF + i] > 0.0)
        emit_sections(w, k, i, h, transient, section)
        x_off, v_off = w[r.X_OFF + i], 0.0
        if event == HIT:
            x_off = 0.0
        elif state == UP or state == DOWN:
            x_off = gap_rounding(w, i, h)
            v_off = velocity_rounding(w, i, h) if event == STRETCHED else 0.0

        # what one period may cost: switches, and for each a hundred steps of searching or 1e5 grid points
        if k[r.COUNTED + i] != k[r.PERIOD + i]:
            k[r.COUNTED + i] = k[r.PERIOD + i]
            k[r.COUNT + i] = 0
        k[r.COUNT + i] += 1 + int((w[r.WORK + i] - w[r.PAID + i]) * (1e-5 if scan == LITERAL else 1e-2))
        w[r.PAID + i] = w[r.WORK + i]
        if k[r.COUNT + i] > budget:
            k[r.STATUS + i] = BUDGET
            return False

        # advance to the switch
        if calm and (state == STICK or state == REST):
            force = 1.0 if event == LEAVE_UP else -1.0
            meet(w, k, i, calm_end_distance(w, i, event == LEAVE_DOWN), ROUNDING * terms(w, i))
            w[r.PHI + i] = phase
            w[r.LOW + i] = 0.0
            k[r.PERIOD + i] += 1 if later else 0
            w[r.P + i] = w[r.P_UP + i] if event == LEAVE_UP else w[r.P_DOWN + i]
            w[r.Q + i] = w[r.B + i] + force
        elif certified:
            force = depart(w, k, i)
        else:
            if method == FIXED:
                grid_time(w, k, i, w[r.H + i])
            else:
                pass_time(w, k, i, h)
            force = place(w, k, i)
        w[r.LEFT + i] = time_until(w, k, i, k[r.PERIOD0 + i] + transient + periods, w[r.PHI0 + i])

        if event == STRETCHED:
            w[r.X_OFF + i] = x_off
            w[r.V_OFF + i] = v_off
            enter(w, k, i, state, x, v, force, False, method)
            return True
        # decide
        if event == HIT:
            x = 0.0 if certified else x
            record(w, k, i, state, IMPACT, x, v, transient, rows_int, rows_float, stored)
            to = decide_at_obstacle(force)
            meet_hit(w, k, i, h, force, v)
            state, x, v = IMPACT, 0.0, 0.0
        elif event == TURN:
            to = decide_in_air(force)
            if certified and to == state:
                to = STICK  # where ξ' has just fallen to 0 its slope is not positive: H is beyond 1 by rounding only
            v = 0.0 if certified else v
            if certified and x <= 0.0:
                x = SMALLEST  # it has gone up, by less than a double can tell
            meet_turn(w, k, i, h, force, force - (1.0 if state == UP else -1.0))
        else:
            to = UP if event == LEAVE_UP else DOWN
        record(w, k, i, state, to, x, v, transient, rows_int, rows_float, stored)
        w[r.X_OFF + i] = x_off
        w[r.V_OFF + i] = v_off
        waiting = to == STICK or to == REST
        if waiting and not can_leave(w, i, to):
            k[r.STATE + i] = to
            w[r.X0 + i] = x
            stay(w, k, i, transient, section)
            return False
        if not (calm and waiting):
            if calm and state == REST:
                forget(w, i)
            enter(w, k, i, to, x, 0.0, force, certified and (state == STICK or state == REST), method)
            if state == REST or state == IMPACT:
                k[r.SINCE + i] += 1
                if may_repeat:
                    look_back(w, k, i, certified, transient, periods, budget, section)
            return True
        k[r.STATE + i] = to
        w[r.X0 + i] = x
        h, phase, later, down = wait_end(w, i, to, w[r.PHI + i])
        event = LEAVE_DOWN if down else LEAVE_UP


@part
def set_parameters(w, k, i, points, row, method):
    """The parameters of a point, its start in time, and the ends of its waits at ε = 0."""
    a, b, eps, eta = points[row, 0], points[row, 1], points[row, 2], points[row, 3]
    fast = is_disturbed(points, row)
    w[r.A + i] = a
    w[r.B + i] = b
    w[r.AF + i] = a * eps * eta * eta if fast else 0.0
    w[r.ETA + i] = eta if fast else 0.0
    w[r.INVERSE + i] = 1.0 / eta if fast else 0.0
    w[r.FRAC + i] = eta - float(math.floor(eta)) if fast else 0.0
    w[r.DTAU + i] = points[row, 4] if method != CERTIFIED else 1.0
    w[r.TOL + i] = points[row, 5]
    w[r.PF + i] = 0.0
    w[r.QF + i] = 0.0
    w[r.X_OFF + i] = 0.0
    w[r.V_OFF + i] = 0.0
    w[r.THETA + i] = 0.0
    _, phi, _ = turns(points[row, 9], 0.0)
    w[r.SECTION + i] = phi
    w[r.COS_S + i], w[r.SIN_S + i] = excitation(a, phi, 0.0)
    n, phi, low = turns(points[row, 8], 0.0)
    w[r.PHI + i] = phi
    w[r.LOW + i] = low
    w[r.PHI0 + i] = phi
    k[r.PERIOD + i] = int(n)
    k[r.PERIOD0 + i] = int(n)
    up = a - 1.0 - b
    w[r.PHI_UP + i] = 0.0
    w[r.P_UP + i] = 0.0
    if up > 0.0:
        w[r.PHI_UP + i] = arcsine((1.0 + b) / a, up / a)
        w[r.P_UP + i] = math.sqrt(up * (a + (1.0 + b)))
    below = abs(1.0 - b)
    w[r.PHI_DOWN + i] = 0.0
    w[r.P_DOWN + i] = 0.0
    if a > below:
        angle = arcsine(below / a, (a - below) / a)
        w[r.PHI_DOWN + i] = (PI + angle if b <= 1.0 else PI - angle) + PI_LOW
        w[r.P_DOWN + i] = -math.sqrt((a - below) * (a + below))


@inline
def is_disturbed(points, row):
    """Whether the disturbance of a point is anything at all."""
    return points[row, 0] * points[row, 2] * points[row, 3] * points[row, 3] > 0.0


@part
def load(
    w, k, i, points, row, method, transient, periods, section, rows_int, rows_float, stored
):  # fmt: skip
    """Put a point into lane i at its start. False when the trajectory ends before any search."""
    set_parameters(w, k, i, points, row, method)
    for row_k in (r.GRID, r.SECTIONS, r.COUNT, r.SEARCH):
        k[row_k + i] = 0
    for to in range(5):
        k[r.SWITCHES + to * STRIDE + i] = 0
    k[r.COUNTED + i] = k[r.PERIOD + i]
    k[r.POINT + i] = row
    k[r.STATUS + i] = OK
    look_ahead(w, k, i)
    w[r.WORK + i] = 0.0
    w[r.PAID + i] = 0.0
    w[r.MARGIN + i] = INFINITY
    w[r.LEFT + i] = float(transient + periods) * TWO_PI
    force = place(w, k, i)
    x, v = points[row, 6], points[row, 7]
    w[r.X0 + i] = x
    if v > 0.0:
        state = UP
    elif v < 0.0:
        state = DOWN
    else:
        state = decide_in_air(force) if x > 0.0 else decide_at_obstacle(force)
        distance = abs(abs(force) - 1.0) if x > 0.0 else abs(force - 1.0)
        meet_force(w, k, i, distance, TWO_PI)
    k[r.STATE + i] = state
    if rows_int.shape[0] > 0:
        stored[0] = 1
        write_row(w, k, i, 0, state, state, x, v, rows_int, rows_float)
    waiting = state == STICK or state == REST
    if waiting and not can_leave(w, i, state):
        stay(w, k, i, transient, section)
        return False
    enter(w, k, i, state, x, v, force, False, method)
    return True


@part
def search_calm(w, k, n, grid):
    """A pass over the lanes 0..n-1 at ε = 0: brackets narrowed abreast, what has none one by one."""
    if narrow_all(w, k, n, EVALUATIONS) < n:
        for i in range(n):
            if w[r.KIND + i] == STEPPED:
                if grid:
                    search_on_grid(w[i:], 1, False)
                else:
                    search_stepwise(w[i:], 1, 1)
            elif w[r.KIND + i] == AT_ONCE:
                w[r.MET + i] = ZERO


@inline
def list_met(w, todo, n):
    """List the lanes that have met something. Returns how many there are."""
    m = 0
    for i in range(n):
        todo[m] = i
        m += 1 if w[r.MET + i] != NOTHING else 0
    return m


@part
def follow_up(w, k, n, guessed, transient, periods, budget, section):
    """What lanes taken abreast at ε = 0 leave to be done: the section points they passed, a look back."""
    for i in range(n):
        write_points(w, k, i, section)
        if k[r.LEFT_OVER + i] & LOOK_BACK:
            look_back(w, k, i, guessed, transient, periods, budget, section)


@inline
def list_left_over(k, todo, n):
    """List the lanes that are left to `settle`."""
    m = 0
    for i in range(n):
        todo[m] = i
        m += 1 if k[r.LEFT_OVER + i] == SETTLE else 0


@jit(_nrt=False)
def run(
    lanes_w, lanes_k, points, order, counter, method, scan, transient, periods, budget,
    section, status, margin, counts, work, rows_int, rows_float, stored,
):  # fmt: skip
    """Trajectories of points[order[c]] for every c that `counter` hands out, into the rows of the same number.

    lanes_w, lanes_k : memory of the lanes, and for tables and lists (lane.py)
    points float64 (n, columns), order int64 (n,), counter int64 (1,)
    section float64 (n, periods, 2), status int8 (n,), margin float64 (n,), counts int64 (n, 5): results
    work float64 (n,): evaluations of switching functions
    rows_int int64 (cap, 3), rows_float float64 (cap, 3), stored int64 (1,): the switches of a single trajectory behind
    the last one before the record, as many as fit, and how many there were.
    """
    w, g = lanes_w[0], lanes_w[1]
    k, todo = lanes_k[0], lanes_k[1]
    grid = method != CERTIFIED
    # a literal scan is vectorised along its grid, one trajectory at a time, with tables in g
    literal = grid and scan == LITERAL
    lanes = 1 if literal else LANES
    alone = rows_int.shape[0] > 0  # its switches are written down one by one
    if method == MULLER and not (literal or alone):
        method = LEAPT
    n = 0
    c = next_index(counter)
    fast = False
    while True:
        # lanes are filled with trajectories of one kind: disturbed ones, or calm ones
        while c < order.shape[0] and n < lanes:
            disturbed = is_disturbed(points, order[c])
            if n > 0 and disturbed != fast:
                break
            fast = disturbed
            if load(
                w, k, n, points, order[c], method, transient, periods, section, rows_int, rows_float, stored
            ):  # fmt: skip
                if literal:
                    fill_tables(g, w[r.DTAU + n], w[r.ETA + n])
                n += 1
            else:
                finish(w, k, n, section, status, margin, counts, work)
            c = next_index(counter)
        if n == 0:
            if c >= order.shape[0]:
                break
            continue
        leaps = method == LEAPT and not fast
        scans = grid and not leaps
        if literal:
            scan_every(w, k, 0, g)
        elif scans:
            search_on_grid(w, n, fast)
        elif fast:
            search_stepwise(w, n, STEPS)
        else:
            search_calm(w, k, n, grid)
        if alone or scans:
            m = list_met(w, todo, n)
        else:
            if fast:
                mark_points(w, k, n, transient, periods)
                write_ahead(w, k, n, transient, section)
                m = cross_all_disturbed(w, k, n, transient, periods, budget)
            elif leaps:
                m = cross_all_refined(w, k, n, transient, periods, budget)
            else:
                m = cross_all(w, k, n, transient, periods, budget)
            if not fast:
                follow_up(w, k, n, not leaps, transient, periods, budget, section)
            if m > 0:
                list_left_over(k, todo, n)
        ended = 0
        for j in range(m):
            i = todo[j]
            if not grid:
                arrive(w, k, i, fast)
            elif leaps and w[r.KIND + i] != STEPPED:
                w[r.WORK + i] = w[r.PAID + i]  # a leap that failed costs nothing, or the budget would end sooner
                begin_search(w, k, i, k[r.STATE + i], method)
                w[r.KIND + i] = STEPPED
                continue
            if not settle(
                w, k, i, method, scan, transient, periods, budget, section, rows_int, rows_float, stored
            ):  # fmt: skip
                finish(w, k, i, section, status, margin, counts, work)
                todo[ended] = i  # never ahead of j
                ended += 1
        # close the gaps from the back, so that the lane moved in is never one of the gaps itself
        for j in range(ended - 1, -1, -1):
            i = todo[j]
            n -= 1
            if i != n:
                for row in range(ROWS_W):
                    w[row * STRIDE + i] = w[row * STRIDE + n]
                for row in range(ROWS_K):
                    k[row * STRIDE + i] = k[row * STRIDE + n]


@jit(_nrt=False)
def sample_segments(lanes_w, lanes_k, points, rows_int, rows_float, method, transient, per_period, out, state):
    """The closed form between the switches `rows` (as written by `run`).

    out float64 (n, 3): ξ, ξ', H; state int8 (n,).
    """
    w, k = lanes_w[0], lanes_k[0]
    set_parameters(w, k, 0, points, 0, method)
    start, phi0 = k[r.PERIOD] + transient, w[r.PHI0]
    row = -1
    for m in range(out.shape[0]):
        n = start + m // per_period
        phi = phi0 + TWO_PI * float(m % per_period) / float(per_period)
        if phi >= TWO_PI:
            phi -= TWO_PI
            n += 1
        while row + 1 < rows_int.shape[0] and (
            row < 0 or rows_int[row + 1, 0] < n or (rows_int[row + 1, 0] == n and rows_float[row + 1, 0] <= phi)
        ):
            row += 1
            k[r.PERIOD] = rows_int[row, 0]
            w[r.PHI] = rows_float[row, 0]
            w[r.LOW] = 0.0
            before, now = rows_int[row, 1], rows_int[row, 2]
            at_obstacle = before == IMPACT or now == IMPACT or now == REST
            x = 0.0 if at_obstacle else rows_float[row, 1]
            v = rows_float[row, 2] if before == now and row == 0 else 0.0
            force = place(w, k, 0)
            s = 1.0 if now == UP else (-1.0 if now == DOWN else 0.0)
            left = method == CERTIFIED and (before == STICK or before == REST)
            a0 = 0.0 if v == 0.0 and (left or (force - s) * s < 0.0) else force - s
            slide(w, 0, s, x, v, a0)
            k[r.STATE] = now
        h = time_until(w, k, 0, n, phi)
        now = k[r.STATE]
        x, v = w[r.X0], 0.0
        if now == UP or now == DOWN:
            x, v = state_at(w, 0, h, w[r.AF] > 0.0)
        out[m, 0] = x
        out[m, 1] = v
        out[m, 2] = force_at(w, 0, h)
        state[m] = now
