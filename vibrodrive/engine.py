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
from vibrodrive.calm import AT_ONCE, STEPPED, narrow_all
from vibrodrive.counter import next_index
from vibrodrive.event import CERTIFIED, LEAPT, LITERAL, MULLER, begin_search, begin_state, finish_at_rest, process_event
from vibrodrive.lane import DISTURBED, DRAWN, IN_USE, LANES, PASSES, PAUSED, ROWS_K, ROWS_W, STRIDE
from vibrodrive.literal import fill_tables
from vibrodrive.literal import scan as scan_every
from vibrodrive.locate import NOTHING, ZERO, search_on_grid, search_stepwise
from vibrodrive.margins import meet_force
from vibrodrive.motion import excitation, force_at, place, state_at, time_until
from vibrodrive.parameters import State, Status
from vibrodrive.record import LOOK_BACK, SETTLE, finish, write_points, write_row
from vibrodrive.recurrence import look_ahead, look_back
from vibrodrive.release import release_down, release_up
from vibrodrive.switch import begin, commit_segment, decide, direction, waits
from vibrodrive.switch_disturbed import cross_all_disturbed, mark_points, write_ahead
from vibrodrive.switch_muller import cross_all_refined
from vibrodrive.switch_undisturbed import cross_all
from vibrodrive.switching import INFINITY, S1, S2, can_leave
from vibrodrive.trig import TWO_PI, turns

UP, DOWN, STICK, REST, IMPACT = (int(s) for s in State)
OK = int(Status.OK)

STEPS, EVALUATIONS = 3, 2
"""Of a search between two looks at what it has met, with and without a disturbance: most are over by then, and
looking costs more than a step."""


@part
def set_parameters(w, k, i, points, row, method):
    """The parameters of a point, its start in time, and the ends of its waits at ε = 0.

    AF = A ε η² is the amplitude of the disturbance in H and ξ'', from eq. (9).
    """
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
    w[r.LATE + i] = 0.0
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
    w[r.PHI_UP + i] = 0.0
    w[r.P_UP + i] = 0.0
    if a - 1.0 - b > 0.0:
        w[r.PHI_UP + i], w[r.P_UP + i] = release_up(a, b)
    w[r.PHI_DOWN + i] = 0.0
    w[r.P_DOWN + i] = 0.0
    if a > abs(1.0 - b):
        w[r.PHI_DOWN + i], w[r.P_DOWN + i] = release_down(a, b)


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
        state = decide(S2 if x > 0.0 else S1, 0.0, force)
        distance = abs(abs(force) - 1.0) if x > 0.0 else abs(force - 1.0)
        meet_force(w, k, i, distance, TWO_PI)
    k[r.STATE + i] = state
    if rows_int.shape[0] > 0:
        stored[0] = 1
        write_row(w, k, i, 0, state, state, x, v, rows_int, rows_float)
    if waits(state) and not can_leave(w, i, state):
        finish_at_rest(w, k, i, transient, section)
        return False
    begin_state(w, k, i, state, x, v, force, False, 0.0, 0.0, method)
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
    """List the lanes that are left to `process_event`."""
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

    Returns whether all is done. If not, the passes granted (lane.PASSES) are spent, and the next call goes on.
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
    if todo[PAUSED]:
        n, c, fast = todo[IN_USE], todo[DRAWN], todo[DISTURBED] == 1
    else:
        n, c, fast = 0, next_index(counter), False
    passes = todo[PASSES] + 1 if todo[PASSES] > 0 else 0  # from 0 it counts down without end
    while True:
        passes -= 1
        if passes == 0:
            todo[PAUSED], todo[IN_USE], todo[DRAWN], todo[DISTURBED] = 1, n, c, 1 if fast else 0
            return False
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
                todo[PAUSED] = 0
                return True
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
            if leaps and w[r.KIND + i] != STEPPED:
                w[r.WORK + i] = w[r.PAID + i]  # a leap that failed costs nothing, or the budget would end sooner
                begin_search(w, k, i, k[r.STATE + i], False, method)
                w[r.KIND + i] = STEPPED
                continue
            if not process_event(
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
def sample_segments(
    lanes_w, lanes_k, points, rows_int, rows_float, method, transient, per_period, count, under_way, out, state
):
    """The closed form between the switches `rows` (as written by `run`), at the next `count` instants.

    under_way int64 (2,): the next instant and the row of its segment, at first 0 and -1.
    out float64 (n, 3): ξ, ξ', H; state int8 (n,). Returns whether all is done.
    """
    w, k = lanes_w[0], lanes_k[0]
    first, row = under_way[0], under_way[1]
    if first == 0:
        set_parameters(w, k, 0, points, 0, method)
    start, phi0 = k[r.PERIOD0] + transient, w[r.PHI0]
    last = min(first + count, out.shape[0])
    for m in range(first, last):
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
            left = method == CERTIFIED and (before == STICK or before == REST)
            segment = begin(
                direction(now), x, v, force, left, method != CERTIFIED,
                w[r.B], w[r.INVERSE], w[r.P], w[r.Q], w[r.PF], w[r.QF],
            )  # fmt: skip
            commit_segment(w, 0, True, segment, 0.0, 0.0)
            w[r.XALF], w[r.XBEF] = segment.xalf, segment.xbef
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
    under_way[0], under_way[1] = last, row
    return last == out.shape[0]
