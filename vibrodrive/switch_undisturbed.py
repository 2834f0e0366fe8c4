"""The ordinary switch, in all lanes at once: what `engine.settle` does, without branches.

Ordinary is a switch far from a change of decision, within the record and the budget, with no more than one section
point on the way. Everything else is left to `settle`. Both take the same decisions by the same formulas
in the same order, so a trajectory's bits do not depend on which of them took a switch.
"""

from __future__ import annotations

from vibrodrive import lane as r
from vibrodrive._jit import inline, part
from vibrodrive.branchless import choose, wide
from vibrodrive.calm import BRACKETED, LEAST_FALL, bracket, gap_guess, rate_of, wait_end
from vibrodrive.lane import STRIDE, full
from vibrodrive.locate import FALLEN, LEAST_GAP, NOTHING, ZERO, free_of_zeros
from vibrodrive.margins import ROUNDING, SUSPECT, calm_end_distance, far_rounding, gap_rounding, terms
from vibrodrive.motion import FAR, arrive_calm, arrive_disturbed, longest, section_at, time_between
from vibrodrive.parameters import State
from vibrodrive.record import DONE, LOOK_BACK, POINT, SETTLE, in_record, section_due, write_point
from vibrodrive.switching import (
    INFINITY,
    S1,
    S2,
    S3,
    S4,
    aimed,
    can_leave,
    decide_at_obstacle,
    decide_in_air,
    ended_by,
)
from vibrodrive.trig import TWO_PI

UP, DOWN, STICK, REST, IMPACT = (int(s) for s in State)


@inline
def smaller(a, b):
    return choose(a < b, a, b)


@inline
def move(w, k, i, over, to, period, phi, low, left, x, x_off, a0, slope, p, q, xc1, counted, cost):
    """If `over`, put lane i behind its switch, where `to` begins from rest, as `slide`: ξ = x, ξ'' = a0, L = slope.

    The switch is booked on period `counted`, as number `cost` of it.
    """
    k[r.STATE + i] = choose(over, to, k[r.STATE + i])
    k[r.PERIOD + i] = choose(over, period, k[r.PERIOD + i])
    w[r.PHI + i] = choose(over, phi, w[r.PHI + i])
    w[r.LOW + i] = choose(over, low, w[r.LOW + i])
    w[r.LEFT + i] = choose(over, left, w[r.LEFT + i])
    w[r.X0 + i] = choose(over, x, w[r.X0 + i])
    w[r.V0 + i] = choose(over, 0.0, w[r.V0 + i])
    w[r.V_OFF + i] = choose(over, 0.0, w[r.V_OFF + i])
    w[r.X_OFF + i] = choose(over, x_off, w[r.X_OFF + i])
    w[r.A0 + i] = choose(over, a0, w[r.A0 + i])
    w[r.L + i] = choose(over, slope, w[r.L + i])
    w[r.P + i] = choose(over, p, w[r.P + i])
    w[r.Q + i] = choose(over, q, w[r.Q + i])
    w[r.XD2 + i] = choose(over, 0.5 * a0, w[r.XD2 + i])
    w[r.XC2 + i] = choose(over, 0.5 * slope, w[r.XC2 + i])
    w[r.XC1 + i] = choose(over, xc1, w[r.XC1 + i])
    w[r.PAID + i] = choose(over, w[r.WORK + i], w[r.PAID + i])
    k[r.COUNTED + i] = choose(over, counted, k[r.COUNTED + i])
    k[r.COUNT + i] = choose(over, cost, k[r.COUNT + i])


@inline
def decide(w, i, which, force):
    """The state that begins where the zero of switching function `which` ends one."""
    turn = choose(which == S1, decide_at_obstacle(force), decide_in_air(force))
    leave = choose((which == S4) & (w[r.SIG + i] >= 0.0), DOWN, UP)
    return choose(which >= S4, leave, turn)


@inline
def keep_guesses(w, i, slid_up, slid_down, rested, phi, h, rate):
    """Where the next slide up and down will end by this one, as `remember` and `forget`."""
    w[r.BEGAN_UP + i] = choose(rested, 0.0, choose(slid_up, phi, w[r.BEGAN_UP + i]))
    w[r.BEGAN_DOWN + i] = choose(rested, 0.0, choose(slid_down, phi, w[r.BEGAN_DOWN + i]))
    w[r.LASTED_UP + i] = choose(rested, 0.0, choose(slid_up, h, w[r.LASTED_UP + i]))
    w[r.LASTED_DOWN + i] = choose(rested, 0.0, choose(slid_down, h, w[r.LASTED_DOWN + i]))
    w[r.RATE_UP + i] = choose(rested, 0.0, choose(slid_up, rate, w[r.RATE_UP + i]))
    w[r.RATE_DOWN + i] = choose(rested, 0.0, choose(slid_down, rate, w[r.RATE_DOWN + i]))


@inline
def count(k, i, recorded, hit, to):
    """Count a switch into `to`, and the impact before it if it is one."""
    k[r.SWITCHES + IMPACT * STRIDE + i] += choose(recorded & hit, 1, 0)
    k[r.SWITCHES + UP * STRIDE + i] += choose(recorded & (to == UP), 1, 0)
    k[r.SWITCHES + DOWN * STRIDE + i] += choose(recorded & (to == DOWN), 1, 0)
    k[r.SWITCHES + STICK * STRIDE + i] += choose(recorded & (to == STICK), 1, 0)
    k[r.SWITCHES + REST * STRIDE + i] += choose(recorded & (to == REST), 1, 0)


@inline
def cross(w, k, i, transient, periods, budget):
    """Take lane i, which stands at the end of its search, over the switch; or leave it to `settle`."""
    met = w[r.MET + i] != NOTHING
    h, which = w[r.H + i], k[r.SEARCH + i]
    gap, falling, rising = which == S1, which == S2, which == S3
    period, phi, low = k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i]
    margin, usual = w[r.MARGIN + i], terms(w, i)
    x, _, turned, phi1, p1, q1 = arrive_calm(w, i, h)
    force = q1 - w[r.B + i]
    begun_at_rest = w[r.V0 + i] == 0.0
    known = met & (w[r.KIND + i] == BRACKETED) & (h >= FAR) & (phi1 >= 0.0) & (phi1 < TWO_PI) & begun_at_rest

    # S2 ends below the obstacle: there was an impact before, look for it
    off = far_rounding(w, i, h, w[r.X_OFF + i], 0.0, 0.0)
    aside = known & falling & (x < -off)
    below = smaller(-x, margin)
    guess_below = gap_guess(w[r.X0 + i], x, h)

    # a switch: the section point on the way, and what the period may cost
    slot = k[r.SECTIONS + i]
    due = section_due(w, k, i, slot, period, phi, low, transient)
    point = (due <= h) & (slot < periods)
    w[r.THERE_SX + i], w[r.THERE_SV + i] = section_at(w, i, due)
    k[r.SLOT + i] = slot
    before = k[r.COUNT + i]
    cost = 1 + choose(k[r.COUNTED + i] == period, before, 0)
    over = known & (h <= w[r.LEFT + i]) & (due + TWO_PI > h + 1e-9) & (w[r.WORK + i] - w[r.PAID + i] < 100.0)
    over &= (gap | (x > choose(falling, off, 0.0))) & (cost < budget)

    # decide
    there = period + int(turned)
    end = k[r.PERIOD0 + i] + transient + periods
    to = choose(gap, decide_at_obstacle(force), decide_in_air(force))
    distance = abs(choose(gap, force, abs(force)) - 1.0)
    over &= distance >= SUSPECT * usual
    nearest = smaller(distance, choose(falling, smaller(x, margin), margin))
    recorded = in_record(w, k, i, there, phi1, transient)
    x1 = choose(gap, 0.0, x)

    # a wait, to its end
    waiting = (to == STICK) | (to == REST)
    hw, phase, later, down = wait_end(w, i, to, phi1)
    passed = slot + choose(point, 1, 0)
    due1 = section_due(w, k, i, passed, there, phi1, 0.0, transient)
    point1 = waiting & (due1 <= hw) & (passed < periods)
    cost1 = choose(waiting, 1 + choose(period == there, cost, 0), cost)
    way_out = calm_end_distance(w, i, down)
    left1 = time_between(there, phi1, 0.0, end, w[r.PHI0 + i])
    lasting = can_leave(w, i, to) & (hw <= left1) & (due1 + TWO_PI > hw + 1e-9) & (way_out > ROUNDING * usual)
    over &= ((cost1 < budget) & lasting) | (not waiting)
    nearest = choose(waiting, smaller(way_out, nearest), nearest)
    force_out = choose(down, -1.0, 1.0)
    after = there + choose(waiting & later, 1, 0)
    phi2 = choose(waiting, phase, phi1)
    recorded1 = waiting & in_record(w, k, i, after, phi2, transient)

    # the next slide, from rest
    up = choose(waiting, not down, to == UP)
    s = choose(up, 1.0, -1.0)
    over &= 1.0 + s * w[r.B + i] >= LEAST_FALL
    down_p, up_p = w[r.P_DOWN + i], w[r.P_UP + i]
    p2 = choose(waiting, choose(down, down_p, up_p), p1)
    q2 = choose(waiting, w[r.B + i] + force_out, q1)
    a0 = choose(waiting, force_out, force) - s
    a0 = choose(waiting | (a0 * s < 0.0), 0.0, a0)
    slope = a0 - q2
    rate = rate_of(w[r.A0 + i], force - choose(rising, 1.0, -1.0))
    slid_up, slid_down = over & rising, (over | aside) & falling
    rested = over & (to == REST)
    keep_guesses(w, i, slid_up, slid_down, rested, phi, h, rate)
    lo, hi, fall, guess = bracket(w, i, s, phi2, p2, slope)

    # away from the obstacle: is this where the motion has been before?
    left_obstacle = over & gap
    since = k[r.SINCE + i] + choose(left_obstacle, 1, 0)
    k[r.SINCE + i] = since
    look = left_obstacle & (rested | (phi2 == w[r.ANCHOR_PHI + i]) | (since >= k[r.WINDOW + i]))
    more = choose(point1, POINT, DONE) + choose(look, LOOK_BACK, DONE)
    k[r.LEFT_OVER + i] = choose(over, more, choose(aside | (not met), DONE, SETTLE))
    w[r.LO + i] = choose(over, lo, choose(aside, 0.0, w[r.LO + i]))
    w[r.HI + i] = choose(over, hi, choose(aside, h, w[r.HI + i]))
    w[r.H + i] = choose(over, guess, choose(aside, guess_below, w[r.H + i]))
    w[r.MARGIN + i] = choose(over, smaller(fall, nearest), choose(aside, below, w[r.MARGIN + i]))
    k[r.SEARCH + i] = choose(over, choose(up, S3, S2), choose(aside, S1, k[r.SEARCH + i]))
    k[r.SECTIONS + i] = choose(over, passed + choose(point1, 1, 0), k[r.SECTIONS + i])
    left = time_between(after, phi2, 0.0, end, w[r.PHI0 + i])
    counted = choose(waiting, there, period)
    x_off = choose(gap, 0.0, off)
    next_state = choose(up, UP, DOWN)
    move(w, k, i, over, next_state, after, phi2, 0.0, left, x1, x_off, a0, slope, p2, q2, p2, counted, cost1)
    count(k, i, over & recorded, gap, to)
    count(k, i, over & recorded1, False, next_state)


@part
def cross_all(w, k, n, transient, periods, budget):
    """Take those of the lanes 0..n-1 that can be over the switch at the end of their search, ε = 0.

    Returns how many are left to `settle`.
    """
    wide()
    left = 0
    for i in range(full(n)):
        cross(w, k, i, transient, periods, budget)
        left += choose((i < n) & (k[r.LEFT_OVER + i] == SETTLE), 1, 0)
    return left


@part
def mark_points(w, k, n, transient, periods):
    """The number of the section point on the way to what each of the lanes 0..n-1 has met; `periods` where none is."""
    wide()
    for i in range(full(n)):
        slot = k[r.SECTIONS + i]
        due = section_due(w, k, i, slot, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], transient)
        k[r.SLOT + i] = choose((w[r.MET + i] != NOTHING) & (due <= w[r.H + i]) & (slot < periods), slot, periods)


@part
def write_ahead(w, k, n, transient, section):
    """Write the section points on the way in the lanes 0..n-1, before the motion that leads there is given up.

    Whether the switch at its end is taken is not known yet: if it is not, the right point is written over this one.
    """
    for i in range(n):
        slot = k[r.SLOT + i]
        if slot < section.shape[1]:
            hs = section_due(w, k, i, slot, k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], transient)
            write_point(w, k, i, slot, hs, section)


@inline
def cross_disturbed(w, k, i, transient, periods, budget):
    """As `cross`, for a lane with a disturbance; the section point on the way has been written ahead."""
    met = w[r.MET + i]
    h, which = w[r.H + i], k[r.SEARCH + i]
    gap, falling = which == S1, which == S2
    waited = which >= S4
    period, phi, low = k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i]
    margin, usual = w[r.MARGIN + i], terms(w, i)
    x, _, turned, phi1, low1, p1, q1, theta1, pf1, qf1 = arrive_disturbed(w, k, i, h)
    x0, v0 = w[r.X0 + i], w[r.V0 + i]
    x = choose(waited, x0, x)
    force = q1 + qf1 - w[r.B + i]
    suspect = SUSPECT * (usual + abs(v0))

    # the closest the search came to a zero that was none
    under, over_under = w[r.NEAR_UNDER + i], w[r.NEAR_OVER + i]
    touched = under > 0.0
    near = choose(touched, over_under, 1.0) / choose(touched, under, 1.0)
    clear = (not touched) | (near >= suspect)
    margin = choose(touched, smaller(near, margin), margin)

    # S2 ends below the obstacle: there was an impact before, look for it
    off = gap_rounding(w, i, h)
    aside = clear & falling & (x < -off) & ((met == ZERO) | (met == FALLEN)) & (x0 >= LEAST_GAP)
    margin_aside = choose(met == ZERO, smaller(-x, margin), margin)

    # a switch: the section point on the way, and what the period may cost
    slot = k[r.SECTIONS + i]
    due = section_due(w, k, i, slot, period, phi, low, transient)
    point = k[r.SLOT + i] < periods
    before = k[r.COUNT + i]
    cost = 1 + choose(k[r.COUNTED + i] == period, before, 0)
    over = clear & (met == ZERO) & (h <= w[r.LEFT + i]) & (due + TWO_PI > h + 1e-9)
    over &= (w[r.WORK + i] - w[r.PAID + i] < 100.0) & (cost < budget)
    over &= gap | waited | (x > choose(falling, off, 0.0))

    # decide
    there = period + int(turned)
    end = k[r.PERIOD0 + i] + transient + periods
    left = time_between(there, phi1, low1, end, w[r.PHI0 + i])
    to = decide(w, i, which, force)
    distance = abs(choose(gap, force, abs(force)) - 1.0)
    over &= waited | (distance >= suspect)
    nearest = choose(waited, margin, smaller(distance, choose(falling, smaller(x, margin), margin)))
    over &= can_leave(w, i, to) | (to == UP) | (to == DOWN)
    recorded = over & in_record(w, k, i, there, phi1, transient)

    # what begins there, from rest, as `slide`
    s = choose(to == UP, 1.0, choose(to == DOWN, -1.0, 0.0))
    a0 = force - s
    a0 = choose(waited | (a0 * s < 0.0), 0.0, a0)
    slope = -(w[r.B + i] + s)
    inverse = w[r.INVERSE + i]
    x1 = choose(gap, 0.0, x)

    k[r.LEFT_OVER + i] = choose(over | aside | (met == NOTHING), DONE, SETTLE)
    k[r.SECTIONS + i] = slot + choose(over & point, 1, 0)
    x_off = choose(gap, 0.0, choose(waited, w[r.X_OFF + i], off))
    xc1 = p1 + pf1 * inverse
    move(w, k, i, over, to, there, phi1, low1, left, x1, x_off, a0, slope, p1, q1, xc1, period, cost)
    count(k, i, recorded, gap, to)
    w[r.THETA + i] = choose(over, theta1, w[r.THETA + i])
    w[r.PF + i] = choose(over, pf1, w[r.PF + i])
    w[r.QF + i] = choose(over, qf1, w[r.QF + i])
    w[r.XALF + i] = choose(over, -pf1 * (inverse * inverse), w[r.XALF + i])
    w[r.XBEF + i] = choose(over, qf1 * (inverse * inverse), w[r.XBEF + i])

    # aim at what ends it, as `begin_search`
    moved = over | aside
    goal = choose(aside, S1, ended_by(to))
    far = longest(w, i)
    limit = choose(aside, h, smaller(left, far))
    c0, d1, d2, c1, c2, al, be, alf, bef, base, sig, a, m2, m3, span, noise = aimed(w, i, goal, limit)
    margin = choose(over, nearest, choose(aside, margin_aside, w[r.MARGIN + i]))
    begin = free_of_zeros(sig * d1, 2.0 * sig * d2, m3)
    begin = choose((s != 0.0) & (begin > 0.0), smaller(begin, limit), 0.0)
    above = w[r.ABOVE + i]
    w[r.C0 + i] = choose(moved, c0, w[r.C0 + i])
    w[r.D1 + i] = choose(moved, d1, w[r.D1 + i])
    w[r.D2 + i] = choose(moved, d2, w[r.D2 + i])
    w[r.C1 + i] = choose(moved, c1, w[r.C1 + i])
    w[r.C2 + i] = choose(moved, c2, w[r.C2 + i])
    w[r.AL + i] = choose(moved, al, w[r.AL + i])
    w[r.BE + i] = choose(moved, be, w[r.BE + i])
    w[r.ALF + i] = choose(moved, alf, w[r.ALF + i])
    w[r.BEF + i] = choose(moved, bef, w[r.BEF + i])
    w[r.BASE + i] = choose(moved, base, w[r.BASE + i])
    w[r.SIG + i] = choose(moved, sig, w[r.SIG + i])
    w[r.RF + i] = choose(moved, a, w[r.RF + i])
    w[r.M2S + i] = choose(moved, m2, w[r.M2S + i])
    w[r.M3 + i] = choose(moved, m3, w[r.M3 + i])
    w[r.SPAN0 + i] = choose(moved, span, w[r.SPAN0 + i])
    w[r.SPAN + i] = choose(moved, span, w[r.SPAN + i])
    w[r.NOISE + i] = choose(moved, noise, w[r.NOISE + i])
    w[r.H + i] = choose(over, begin, choose(aside, above, h))
    w[r.OTHER + i] = choose(moved, choose(goal == S4, 0.0, INFINITY), w[r.OTHER + i])
    w[r.ABOVE + i] = choose(moved, 0.0, above)
    w[r.WATCH + i] = choose(moved, choose(goal == S2, x1, INFINITY), w[r.WATCH + i])
    w[r.DIP + i] = choose(moved, choose(goal == S2, margin, INFINITY), w[r.DIP + i])
    w[r.NEAR_UNDER + i] = choose(moved, 0.0, under)
    w[r.LIMIT + i] = choose(moved, limit, w[r.LIMIT + i])
    w[r.MARGIN + i] = margin
    k[r.SEARCH + i] = choose(moved, goal, which)


@part
def cross_all_disturbed(w, k, n, transient, periods, budget):
    """As `cross_all`, for ε > 0."""
    wide()
    left = 0
    for i in range(full(n)):
        cross_disturbed(w, k, i, transient, periods, budget)
        left += choose((i < n) & (k[r.LEFT_OVER + i] == SETTLE), 1, 0)
    return left
