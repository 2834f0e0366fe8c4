"""Switches on a grid at ε = 0 in all lanes at once: what scanning and `event.py` do, without branches.

Where a state ends is found as on the certified path (undisturbed.py), for slides that begin at rest and for waits. That
tells which grid points the scan would stop between, and a few values tell that it would stop nowhere else: the
switching function rises to a known phase and falls from there, so if it is beyond rounding where the scan begins (a
wait at its start, a slide one grid point later) and at the last grid point before the zero, it is at all between. The
other side of S4 either grows all the way or is least where H passes its peak, at 1 + B - A.

The fixed path then switches at the grid point behind the zero, eq. (10). Muller's refines the zero from the two points
around it, as ever. So the bits are those of the scan.

Whatever is not that clear is scanned: a zero too close to a grid point, a refinement that takes longer, a decision
within rounding.
"""

from __future__ import annotations

import numpy as np

from vibrodrive.jit.branchless import choose, fma, wide
from vibrodrive.jit.compile import inline, inline_each, part_each
from vibrodrive.jit.trig import TWO_PI, arc
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import (
    ALL,
    AT_ONCE,
    BRACKETED,
    CHECK_RECURRENCE,
    DONE,
    INFINITY,
    KEEP_SWITCH,
    NOTHING,
    S1,
    S2,
    S3,
    S4,
    S5,
    UNUSUAL,
)
from vibrodrive.kernels.impacts import note_end
from vibrodrive.kernels.lane import full
from vibrodrive.kernels.margins import (
    SUSPECT,
    gap_rounding,
    magnitude_scale,
    set_margin,
)
from vibrodrive.kernels.motion import (
    LONGEST_SCAN,
    STRETCH,
    advance_phase,
    commit_grid,
    excitation,
    grid_time,
    section_at,
    segment_of,
    shape,
    slide_shape,
    state_at,
    time_between,
)
from vibrodrive.kernels.muller import on_chord, on_parabola
from vibrodrive.kernels.switch import (
    STEEP_COST,
    begin,
    can_leave,
    commit_cost,
    commit_departure,
    commit_points,
    commit_segment,
    commit_state,
    commit_time,
    count_switch,
    decide,
    direction,
    in_record,
    leave_over,
    number_in_period,
    point_on_the_way,
    set_point_ahead,
    smaller,
    terminating_function,
    waits,
)
from vibrodrive.kernels.switching import search_shape
from vibrodrive.kernels.undisturbed import (
    LEAST_FALL,
    bracket,
    gap_guess,
    keep_guesses,
    rate_of,
    set_bracket,
    set_search_mode,
    set_side,
    wait_end,
)

CONFIRMED, REFINED = 2.0, 4.0
"""Evaluations of a switching function that confirm its zero here, and that refine it, too."""


@inline
def value_at(base, sig, c0, d1, d2, c1, c2, al, be, h):
    """A switching function at h, as `muller.value`."""
    s, v, ds, dv, near = arc(h)
    return base + sig * shape(near, h, c0, d1, d2, c1, c2, al, be, s, v, ds, dv)


@inline
def refine_briefly(base, sig, c0, d1, d2, c1, c2, al, be, low, high, g0, g1, tol):
    """(h, whether that is what `muller.refine` comes to) in two of its steps at most, from the values at both ends."""
    p0 = on_chord(low, high, g0, g1)
    f0 = value_at(base, sig, c0, d1, d2, c1, c2, al, be, p0)
    below = f0 < 0.0
    lo, hi = choose(below, low, p0), choose(below, p0, high)
    p1 = on_parabola(lo, hi, low, g0, high, g1, p0, f0)
    soon = abs(p1 - p0) < tol
    f1 = value_at(base, sig, c0, d1, d2, c1, c2, al, be, p1)
    below = f1 < 0.0
    p2 = on_parabola(choose(below, lo, p1), choose(below, p1, hi), high, g1, p0, f0, p1, f1)
    refined = (f0 != 0.0) & (soon | ((p1 != lo) & (p1 != hi) & (f1 != 0.0) & (abs(p2 - p1) < tol)))
    return choose(soon, p1, p2), refined


@inline_each("fixed")
def apply_switch_on_grid(w, k, i, fixed, transient, periods, budget):
    """Take lane i, whose state ends at its cursor, over the switch; or leave it to be scanned.

    `fixed` is a literal: the switch is at the grid point behind the zero, or else refined by Muller's method.
    """
    which = k[r.SEARCH + i]
    gap, falling, rising, waited = which == S1, which == S2, which == S3, which >= S4
    met = ((w[r.OUTCOME + i] != NOTHING) & (w[r.SEARCH_MODE + i] == BRACKETED)) | (w[r.SEARCH_MODE + i] == AT_ONCE)
    a, b, x0, dtau, tol = w[r.A + i], w[r.B + i], w[r.X0 + i], w[r.DTAU + i], w[r.TOL + i]
    period, phi = k[r.PERIOD + i], w[r.PHI + i]

    # the grid points to either side, and what the scan has seen on the way there
    cell = np.floor(w[r.CURSOR + i] / dtau)
    low, high = cell * dtau, (cell + 1.0) * dtau
    shaped = search_shape(w, i, which, high)
    c0, d1, d2, c1, c2, al, be = shaped.c0, shaped.d1, shaped.d2, shaped.c1, shaped.c2, shaped.al, shaped.be
    base, noise = shaped.base, shaped.noise
    sig = choose(which == S4, w[r.SIG + i], shaped.sig)
    g0 = value_at(base, sig, c0, d1, d2, c1, c2, al, be, low)
    g1 = value_at(base, sig, c0, d1, d2, c1, c2, al, be, high)
    first = fma(fma(-(1.0 / 6.0) * a, dtau, 0.5 * sig * w[r.P + i]), dtau, sig * w[r.A0 + i]) * dtau
    # the gap was looked at where the slide ends: see `aside`
    start = choose(waited, choose(which == S5, 1.0 - c0, 1.0 - abs(c0)), choose(gap, INFINITY, first))
    peak = choose((which == S4) & (a <= 1.0 + b), (1.0 + b) - a, INFINITY)
    sure = met & (g0 > noise) & (g1 < 0.0) & (smaller(start, peak) > noise) & (low < TWO_PI)
    sure &= (high + dtau < STRETCH) & (cell < LONGEST_SCAN)

    if fixed:
        h, refined = high, True
        steps = k[r.GRID + i] + int(cell + 1.0)
        there, phi1, low1 = grid_time(w, k, i, steps)
    else:
        h, refined = refine_briefly(base, sig, c0, d1, d2, c1, c2, al, be, low, high, g0, g1, tol)
        steps = k[r.GRID + i]
        turned, phi1, _ = advance_phase(phi, w[r.LOW + i], h)
        there, low1 = period + int(turned), 0.0

    # arrive
    x, v = state_at(w, i, h, False)
    p, q = excitation(a, phi1, low1)
    force = q - b

    # S2 ends below the obstacle: there was an impact before, look for it. Within a grid step of the least it reaches ξ
    # differs from that by less than `slack`
    e0, e1, e2, e3, e4, e5, e6 = slide_shape(segment_of(w, i), w[r.P + i], w[r.Q + i], True, 0.0)
    x_low = value_at(0.0, 1.0, e0, e1, e2, e3, e4, e5, e6, low)
    off = gap_rounding(w, i, h)
    slack = off + (a + 1.0 + b) * dtau * dtau
    aside = sure & falling & (x_low < -slack)
    guess_below = gap_guess(x0, x_low, low)

    # a switch: the section point on the way, and what the period may cost
    slot = k[r.SECTIONS + i]
    due, point, one = point_on_the_way(w, k, i, slot, period, phi, w[r.LOW + i], h, transient, periods)
    sx, sv = section_at(w, i, due)
    set_point_ahead(w, k, i, slot, choose(waited, x0, sx), choose(waited, 0.0, sv))
    cost = number_in_period(k, i)
    over = sure & refined & (h <= w[r.LEFT + i]) & one & (cost < budget)
    over &= (w[r.WORK + i] - w[r.WORK_BOOKED + i] < STEEP_COST) & ((x > slack) | (not falling))

    # decide
    end = k[r.PERIOD0 + i] + transient + periods
    to = decide(which, w[r.SIG + i], force)
    distance = abs(choose(gap, force, abs(force)) - 1.0)
    over &= waited | (distance >= SUSPECT * magnitude_scale(w, i))
    margin = w[r.MARGIN + i]
    nearest = choose(waited, margin, smaller(distance, margin))

    # what begins there, from rest
    waiting = waits(to)
    s = direction(to)
    over &= choose(waiting, can_leave(w, i, to), 1.0 + s * b >= LEAST_FALL)
    recorded = over & in_record(w, k, i, there, phi1, transient)
    x1 = choose(gap, 0.0, choose(waited, x0, x))
    segment = begin(s, x1, 0.0, force, False, True, b, 0.0, p, q, 0.0, 0.0)

    # where it ends
    rate = rate_of(w[r.A0 + i], force - choose(rising, 1.0, -1.0))
    slid_up, slid_down = over & rising, (over | aside) & falling
    keep_guesses(w, i, slid_up, slid_down, False, phi, h, rate)
    b_lo, b_hi, _, guess = bracket(w, i, s, phi1, p, segment.slope)
    wait, _, _, down = wait_end(w, i, to, phi1)

    # away from the obstacle, or at rest there: is this where the motion has been before?
    at_obstacle = over & (gap | (which == S5))
    since = commit_departure(k, i, at_obstacle)
    look = at_obstacle & (not fixed) & ((phi1 == w[r.REFERENCE_PHI + i]) | (since >= k[r.WINDOW + i]))
    # nothing is to be done where no end was found yet, neither in a bracket nor by a scan
    idle = aside | (not (met | (w[r.OUTCOME + i] != NOTHING)))
    more = choose(look, CHECK_RECURRENCE, DONE)
    more += choose(recorded | (k[r.HISTORY_KEEPS + i] == ALL), KEEP_SWITCH, DONE)
    leave_over(k, i, choose(over, more, choose(idle, DONE, UNUSUAL)))

    note_end(w, k, i, which, there, phi1, x, v)
    w[r.WORK + i] += choose(met, CONFIRMED if fixed else REFINED, 0.0)
    left = time_between(there, phi1, low1, end, w[r.PHI0 + i])
    commit_state(k, i, over, to)
    commit_time(w, k, i, over, there, phi1, low1, left, p, q)
    commit_grid(k, i, over, steps)
    commit_segment(w, i, over, segment, choose(gap, 0.0, choose(waited, w[r.X_OFF + i], off)), 0.0)
    commit_cost(w, k, i, over, period, cost)
    count_switch(k, i, recorded, gap, to)
    commit_points(k, i, over & point, slot + 1)
    set_margin(w, i, over, nearest)
    goal, cursor = choose(over, terminating_function(to), S1), choose(over, choose(waiting, wait, guess), guess_below)
    set_bracket(w, k, i, over | aside, goal, choose(over, b_lo, 0.0), choose(over, b_hi, low), cursor)
    set_search_mode(w, i, over, choose(waiting, AT_ONCE, BRACKETED))
    set_side(w, i, over, down)


@part_each("fixed")
def apply_switches_on_grid(w, k, n, fixed, transient, periods, budget):
    """Take those of the lanes 0..n-1 that can be over the switch at the end of their state. Returns how many cannot."""
    wide()
    for i in range(full(n)):
        apply_switch_on_grid(w, k, i, fixed, transient, periods, budget)
    left = 0
    for i in range(n):
        left += 1 if k[r.LEFT_OVER + i] == UNUSUAL else 0
    return left
