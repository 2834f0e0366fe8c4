"""Searching the first zero of a switching function S1-S5, eq. (8), and never another.

Each switching function is positive while its state lasts and is searched for its first zero:

    S1 =  ξ          sliding down ends in an impact
    S2 = -ξ'         sliding down ends in the air
    S3 =  ξ'         sliding up ends
    S4 = 1 ∓ H       sticking ends (two sides, searched in turn)
    S5 = 1 - H       resting at the obstacle ends

As shapes (motion.py) they are  BASE + SIG · (c0 + c1 h + c2 h² + α sin h + β vers h + fast).

**Why no zero is missed.** Let g >= 0 be a switching function at the cursor, g', g'' its derivatives there and
|g'''| <= M3 ahead: the functions are sums of a polynomial of degree two and two sinusoids, so M3 is the sum
of the amplitudes of their third derivatives. Taylor's theorem with the remainder bounded gives, for any S > 0,

    g(τ + s) >= g + g's + (g'' - M3 S/3) s²/2       for 0 < s <= S

The right side is a parabola. Up to S or its first positive root, whichever comes first, it is positive and so is g:
that is the step. S is free: it is taken as long as the last step, and near a transversal zero the parabola's root
then falls short of the zero by an error that shrinks faster than the square of the distance. Where a fast ripple of
amplitude a dominates M3, the slow part less a is bounded in the same way with the small bound M2 of
its own derivatives, g_slow + g_slow's + b s²/2 - a, where b is -M2 or, as far as that is more, g_slow'' - M2 S/3 with a
large S; where that is positive beyond the other's S, its step is taken.

**Starts on a zero.** A slide from rest has g = 0 and g' >= 0 where it begins, and g/s >= g' + g''s/2 - M3 s²/6: the
search begins at the positive root of that, and the start is not taken for the next switch. At ε = 0 a slide that
starts by accelerating goes on doing so until H is back at the same boundary, a known phase: the search
begins at that peak of |ξ'|.

**Ends.** Near a simple zero the series of undisturbed.py takes over. Where g' is sure to change by less than a quarter
over the way d that it points, |g''| d + M3 d²/2 + M4 d³/6 < |g'|/4, a zero there is the only one and the series ends
close to it: the cursor goes there, to whichever side of the zero that may be. As soon as the terms fall fast enough
that is the zero to the last bit.

**Rounding.** No other step ends past a zero by more than the rounding of g over its slope. A tangency closer
than that cannot be told from two zeros or none: it is met, and reported through the margin (margins.py). The same
bound, with g less its rounding, lets the fixed and Muller paths skip grid points: none of those skipped
could have shown a change of sign. They begin behind the start and go by the series, too, as far as g is sure to stay
above its rounding.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vibrodrive.jit.branchless import ROUND, choose, fma, full, wide
from vibrodrive.jit.compile import inline, inline_each, part, part_each
from vibrodrive.jit.trig import PI, TWO_PI, arc, arc_of_product, dot
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import motion
from vibrodrive.kernels.codes import BOTH, FALLEN, INFINITY, LEAVING, LIMIT_MET, NOTHING, S1, S2, S3, S4, UNKNOWN, ZERO

NOISE_SHARE = 1e-13
"""Values of a switching function below this share of its terms are not trusted to have a sign when grid
points are skipped. Four hundred times the rounding of one term: a larger share only costs a few more visits."""

LATE_SHARE = 4e-3
"""What the rounding of a grid point's time does to the fast part, a η ulp(h), in units of NOISE_SHARE."""


class Search(NamedTuple):
    """A switching function as a shape, sig · (…) + base, and what its search needs: the amplitude of its fast part,
    bounds of its second (without that part) and third derivatives, the first span to try (first_zero.py), and the
    value below which no grid point is skipped."""

    form: motion.Form
    alf: float
    bef: float
    base: float
    sig: float
    fast: float
    m2: float
    m3: float
    span: float
    noise: float


class Taylor(NamedTuple):
    """A switching function and its first four derivatives at an instant."""

    g: float
    dg: float
    ddg: float
    dddg: float
    ddddg: float


class Ripple(NamedTuple):
    """Of the fast part of a switching function: its slope, its second derivative over η²; and g" without it."""

    slope: float
    second: float
    slow: float


@inline
def search_shape(w, i, which, limit):
    """Switching function `which`, eq. (8), of the segment under way in lane i, to be searched up to `limit`."""
    gap, force = which == S1, which >= S4
    eta, inverse = w[r.ETA + i], w[r.INVERSE + i]
    p, q, pf, qf = w[r.P + i], w[r.Q + i], w[r.PF + i], w[r.QF + i]
    xalf, xbef, af = w[r.XALF + i], w[r.XBEF + i], w[r.AF + i]
    rate = p + eta * pf
    form = motion.slide_shape(motion.segment_of(w, i), p, q, gap, rate)
    c0 = choose(force, q + qf - w[r.B + i], form.c0)
    d1 = choose(force, rate, form.d1)
    d2 = choose(force, -0.5 * (q + eta * eta * qf), form.d2)
    c1 = choose(force, 0.0, form.c1)
    al = choose(force, p, form.al)
    be = choose(force, -q, form.be)
    alf = choose(gap, xalf, choose(force, pf, eta * xbef))
    bef = choose(gap, xbef, choose(force, -qf, -eta * xalf))
    base = choose(force, 1.0, 0.0)
    sig = choose(gap | (which == S3), 1.0, -1.0)
    a = af * choose(gap, inverse * inverse, choose(force, 1.0, inverse))
    fast = a * eta * eta
    c2 = form.c2
    m2 = 2.0 * abs(c2) + w[r.A + i] + 1e-300  # never zero: it divides
    m3 = w[r.A + i] + fast * eta
    span = choose(a > 0.0, (w[r.A + i] + fast) / (m3 + 1e-300), 1.0)
    drift = (abs(c1) + abs(c2) * limit) * limit
    noise = NOISE_SHARE * (base + abs(c0) + 2.0 * (abs(al) + abs(be) + a) + drift + LATE_SHARE * a * eta * limit)
    return Search(motion.Form(c0, d1, d2, c1, c2, al, be), alf, bef, base, sig, a, m2, m3, span, noise)


@inline
def set_search(w, k, i, where, which, search, cursor):
    """Lane i goes on with the search for the first zero of S1 ... S5 from `cursor` on.

    Both sides of S4 = 1 - |H| are searched: the one whose cursor is behind is next.

    While the mass slides down ξ is watched beside S2: it decreases strictly while ξ' < 0, so S1 has a zero before the
    first zero of S2 exactly when ξ there is not positive, and it is then unique. The watch ends the search early once
    ξ is further below 0 than any margin met so far: the impact is certain then, and its margin no longer the
    smallest.
    """
    falling = which == S2
    w[r.C0 + i] = choose(where, search.form.c0, w[r.C0 + i])
    w[r.D1 + i] = choose(where, search.form.d1, w[r.D1 + i])
    w[r.D2 + i] = choose(where, search.form.d2, w[r.D2 + i])
    w[r.C1 + i] = choose(where, search.form.c1, w[r.C1 + i])
    w[r.C2 + i] = choose(where, search.form.c2, w[r.C2 + i])
    w[r.AL + i] = choose(where, search.form.al, w[r.AL + i])
    w[r.BE + i] = choose(where, search.form.be, w[r.BE + i])
    w[r.ALF + i] = choose(where, search.alf, w[r.ALF + i])
    w[r.BEF + i] = choose(where, search.bef, w[r.BEF + i])
    w[r.BASE + i] = choose(where, search.base, w[r.BASE + i])
    w[r.SIG + i] = choose(where, search.sig, w[r.SIG + i])
    w[r.FAST_AMPLITUDE + i] = choose(where, search.fast, w[r.FAST_AMPLITUDE + i])
    w[r.M2_SLOW + i] = choose(where, search.m2, w[r.M2_SLOW + i])
    w[r.M3 + i] = choose(where, search.m3, w[r.M3 + i])
    w[r.SPAN0 + i] = choose(where, search.span, w[r.SPAN0 + i])
    w[r.SPAN + i] = choose(where, search.span, w[r.SPAN + i])
    w[r.NOISE + i] = choose(where, search.noise, w[r.NOISE + i])
    w[r.CURSOR + i] = choose(where, cursor, w[r.CURSOR + i])
    w[r.OTHER + i] = choose(where, choose(which == S4, 0.0, INFINITY), w[r.OTHER + i])
    w[r.LAST_NONNEGATIVE + i] = choose(where, 0.0, w[r.LAST_NONNEGATIVE + i])
    w[r.WATCHED_GAP + i] = choose(where, choose(falling, w[r.X0 + i], INFINITY), w[r.WATCHED_GAP + i])
    w[r.FALL_TOLERANCE + i] = choose(where, choose(falling, w[r.MARGIN + i], INFINITY), w[r.FALL_TOLERANCE + i])
    w[r.DIP_DENOMINATOR + i] = choose(where, 0.0, w[r.DIP_DENOMINATOR + i])
    k[r.SEARCH + i] = choose(where, which, k[r.SEARCH + i])


@inline
def form_of(w, i):
    """The slow part of the switching function searched in lane i."""
    return motion.Form(w[r.C0 + i], w[r.D1 + i], w[r.D2 + i], w[r.C1 + i], w[r.C2 + i], w[r.AL + i], w[r.BE + i])


@inline
def set_limit(w, i, where, limit):
    """How far the search in lane i may go."""
    w[r.LIMIT + i] = choose(where, limit, w[r.LIMIT + i])


@inline
def unknown_values(w, i, where):
    """No value of the switching function is known at the grid points around the cursor."""
    w[r.VALUE + i] = choose(where, UNKNOWN, w[r.VALUE + i])
    w[r.BEFORE + i] = choose(where, UNKNOWN, w[r.BEFORE + i])


@inline
def restart_search(w, k, i, which, limit, cursor):
    """Begin the search for the first zero of `which` at `cursor` after the present switch, in one lane."""
    set_search(w, k, i, True, which, search_shape(w, i, which, limit), cursor)
    unknown_values(w, i, True)


@inline
def start_on_grid(w, i, where, which):
    """The search that has just begun visits grid points. Both sides of S4 are looked at from the first on, and any ξ
    below 0 is an impact."""
    unknown_values(w, i, where)
    w[r.FALL_TOLERANCE + i] = choose(where & (which == S2), 0.0, w[r.FALL_TOLERANCE + i])
    w[r.OTHER + i] = choose(where & (which == S4), 1.0, w[r.OTHER + i])


@inline
def turn_side(w, i):
    """Go over to the other side of S4, on a grid."""
    w[r.SIG + i] = -w[r.SIG + i]
    unknown_values(w, i, True)


BENT = 0.25
"""The share of g' by which it may change on a way d that the series is trusted for. It knows four derivatives, so it
ends off the zero by what the change of the fourth can do, at most M4 d⁴/12: a sixth of d. Where that is past the
zero, the way back is trusted in turn: over r = d/5, |g''| r + M3 r²/2 + M4 r³/6 is below a quarter of g' there."""

LEAP = 2.0
"""As far as a step by the slow part goes where its second derivative is taken for what it is, not for its bound."""

SURELY_FREE = 0.95
"""The share of what is free of zeros behind a start from rest that grid points are skipped in: at its end nothing is
known to be above the noise."""

LEAST_GAP = 1e-30
"""From a smaller gap, with a disturbance, an impact is not searched for by steps."""

PATIENCE = 1e5
"""Steps a search may take before it is handed back as if at its limit, so that the budget is looked at."""


@inline
def parabola(g, dg, bend, span):
    """(first positive root of g + dg s + bend s²/2 with g >= 0, minus the slope there); (span, 0) if none is below."""
    q2 = dot(dg, dg, -2.0 * g, bend)
    q = math.sqrt(q2 if q2 > 0.0 else 0.0)
    falling = dg < 0.0
    numerator = 2.0 * g if falling else dg + q
    denominator = q - dg if falling else -bend
    root = numerator / (denominator if denominator > 0.0 else 1e-300)
    real = (q2 >= 0.0) & (falling | (bend < 0.0)) & (root < span)
    return choose(real, root, span), choose(real, q, 0.0)


@inline
def curvature_bound(ddg, m3, span):
    """The bend of the parabola that a function with |g'''| <= m3 stays above up to S = span."""
    return fma(-(1.0 / 3.0) * m3, span, ddg)


@inline
def safe_step(g, dg, ddg, m3, span):
    """(step, slope): the step for S = span, and minus the slope of the parabola where it has its root there."""
    return parabola(g, dg, curvature_bound(ddg, m3, span), span)


@inline
def zero_free_span(rise, bend, m3):
    """Up to where g is positive that starts with g = 0, g' = rise >= 0, g'' = bend: g/s >= g' + g''s/2 - M3 s²/6."""
    free, _ = parabola(rise, 0.5 * bend, -(1.0 / 3.0) * m3, INFINITY)
    return free


@inline
def first_cursor(search, limit):
    """Where the search for the end of a slide can begin that starts with ξ' = 0."""
    free = zero_free_span(search.sig * search.form.d1, 2.0 * search.sig * search.form.d2, search.m3)
    return choose(free > 0.0, choose(free < limit, free, limit), 0.0)


@inline
def first_grid_point(search, dtau, limit):
    """The same on a grid: the first of its points to be looked at. At all before, the function is above its noise.

    What g/s is at least is a concave function of s, least at one end of the way.
    """
    rise, bend = search.sig * search.form.d1, 2.0 * search.sig * search.form.d2
    free = zero_free_span(rise, bend, search.m3)
    steps = np.floor(SURELY_FREE * free / dtau)
    steps = choose(steps < limit, steps, limit)
    h = steps * dtau
    at_first = rise + dtau * (0.5 * bend - (1.0 / 6.0) * search.m3 * dtau)
    at_last = rise + h * (0.5 * bend - (1.0 / 6.0) * search.m3 * h)
    least = choose(at_first < at_last, at_first, at_last)
    return choose((steps > 1.0) & (dtau * least > search.noise), steps, 1.0)


@inline
def peak_cursor(w, i, s, limit):
    """The same at ε = 0: the peak of |ξ'|, where H is back at s."""
    h = (PI - w[r.PHI_UP + i] if s > 0.0 else 3.0 * PI - w[r.PHI_DOWN + i]) - w[r.PHI + i]
    if h >= TWO_PI:
        h -= TWO_PI
    return choose(h > 0.0, choose(h < limit, h, limit), 0.0)


@inline
def stay_inside(w, k, i, force):
    """A wait that begins with |H| above 1 by rounding, and falling: it is not to end where it begins."""
    rise, bend = w[r.D1 + i], 2.0 * w[r.D2 + i]
    if force > 1.0 and rise < 0.0:
        w[r.CURSOR + i] = zero_free_span(-rise, -bend, w[r.M3 + i])
    elif k[r.SEARCH + i] == S4 and force < -1.0 and rise > 0.0:
        w[r.OTHER + i] = zero_free_span(rise, bend, w[r.M3 + i])


@part
def fall_from_nothing(w, i, h):
    """Where a gap below LEAST_GAP falls to 0, if it is closed at h: its order of magnitude is bisected.

    Beside it the rounding of the higher derivatives is large, and a search by steps would stand still.
    """
    low, high = 1e-300, h
    for _ in range(64):
        middle = math.sqrt(low) * math.sqrt(high)
        x, _ = motion.state_at(w, i, middle, True)
        low = choose(x > 0.0, middle, low)
        high = choose(x > 0.0, high, middle)
    w[r.WORK + i] += 64.0
    return high


@inline
def series(h, u, half, third, fourth, m3, scale, rate):
    """(h + δ, whether that is a zero to the last bit) from u = g/g' and the derivatives over g'; half = g"/2g'.

    The terms of the series fall like powers of t, with m3 = M3/g' and m3 · scale for the derivatives of order two,
    and like those of `rate` u, with m3 rate and m3 rate² for the fourth and the fifth; the first one left out is below
    the bound used here. All are far below 1 then: the zero is the only one near.
    """
    ahead = h - motion.householder_series(u, half, third * (1.0 / 6.0), fourth * (1.0 / 24.0))
    t = fma(abs(m3), scale, abs(half)) * u
    e = abs(m3) * u * u
    t2 = fma(t, t, e)
    q = 0.25 * rate * u
    near = abs(ahead - h) <= h  # false for what overflows, too
    return ahead, (dot(t2, t2, q * q, e) * abs(u) <= motion.TINY * h) & near


@inline
def bends_little(way, dg, ddg, m3, rate):
    """Whether g' < 0 is sure to change by less than BENT of it within `way`: M3 = m3, M4 = m3 rate."""
    return fma(fma(fma((1.0 / 6.0) * rate * m3, way, 0.5 * m3), way, abs(ddg)), way, BENT * dg) < 0.0


@inline
def step_to_zero(taylor, m3, rate, noise):
    """A step to shortly before the zero that g > 0 points to, where g is still above `noise`; 0 if that is not sure.

    All the way g' keeps 3/4 of what it is at least, so g falls, and from what its Taylor polynomial and the remainder,
    M5 s⁵/120, are off at the end of the series follows how much sooner to end.
    """
    g, dg, ddg, dddg, ddddg = taylor
    inverse = 1.0 / choose(dg < 0.0, dg, -1e-300)
    half, third, fourth = 0.5 * ddg, (1.0 / 6.0) * dddg, (1.0 / 24.0) * ddddg
    way = -motion.householder_series(g * inverse, half * inverse, third * inverse, fourth * inverse)
    square = way * way
    off = abs(fma(fma(fma(fma(fourth, way, third), way, half), way, dg), way, g))
    off = fma((1.0 / 120.0) * m3 * rate * rate, square * square * way, off) + noise
    return choose(bends_little(way, dg, ddg, m3, rate) & (way > 0.0), fma(1.5 * off, inverse, way), 0.0)


@inline
def advance(h, taylor, m3, scale, rate, step, limit):
    """(where the cursor goes, whether that is the zero) from g and four derivatives at h, where `step` is safe.

    The second derivative may be M3 `scale`, the fourth M3 `rate`.
    """
    g, dg, ddg, dddg, ddddg = taylor
    inverse = 1.0 / choose(dg < 0.0, dg, -1e-300)
    jump, close = series(
        h, g * inverse, 0.5 * ddg * inverse, dddg * inverse, ddddg * inverse, m3 * inverse, scale, rate
    )  # fmt: skip
    close = close & (dg < 0.0)
    past = g < 0.0
    ahead = choose(past, h, h + step)
    way = abs(jump - h)
    trusted = bends_little(way, dg, ddg, m3, rate) & choose(
        past, (jump < h) & (jump > 0.0), (jump > ahead) & (jump < limit)
    )
    zero = close | ((not trusted) & (past | (step <= motion.TINY * ahead)))
    return choose(close | trusted, jump, ahead), zero


@inline_each("fast")
def evaluate(w, i, h, fast):
    """(values at h of the function searched in lane i, ξ there, values of its ripple), with a disturbance or without.

    The ripple: its slope, and its second derivative over η²; the second derivative without it.
    """
    form, sig = form_of(w, i), w[r.SIG + i]
    s, v, ds, dv, near = arc(h)
    if fast:
        eta, alf, bef = w[r.ETA + i], w[r.ALF + i], w[r.BEF + i]
        sf, vf, dsf, dvf, near_fast = arc_of_product(eta, h)
        near = near & near_fast
    g = motion.shape(near, h, form, s, v, ds, dv)
    dg, slow_ddg, dddg, ddddg = motion.derivatives(h, form.d1, form.c2, form.al, form.be, s, v)
    ddg = slow_ddg
    p, q = w[r.P + i], w[r.Q + i]
    gap = motion.Form(w[r.WATCHED_GAP + i], w[r.V0 + i], w[r.XD2 + i], w[r.XC1 + i], w[r.XC2 + i], -p, q)
    x = motion.shape(near, h, gap, s, v, ds, dv)
    fast_slope = fast_second = 0.0
    if fast:
        g += motion.fast_part(near, alf, bef, sf, vf, dsf, dvf)
        # the ripple's slope, and its second derivative over η²: minus its value, but for a constant
        cf = 1.0 - vf
        fast_slope, fast_second = eta * dot(alf, cf, bef, sf), dot(bef, cf, -alf, sf)
        square = eta * eta
        dg = fma(eta, dot(bef, sf, -alf, vf), dg)
        ddg = fma(square, fast_second, ddg)
        dddg = fma(-square, fast_slope, dddg)
        ddddg = fma(-square * square, fast_second, ddddg)
        x += motion.fast_part(near, w[r.XALF + i], w[r.XBEF + i], sf, vf, dsf, dvf)
    g = w[r.BASE + i] + sig * g
    return Taylor(g, sig * dg, sig * ddg, sig * dddg, sig * ddddg), x, Ripple(fast_slope, fast_second, slow_ddg)


@inline_each("fast")
def free_step(w, i, taylor, ripple, trusted, fast):
    """(step, slope) as `safe_step` for the span of lane i, and whether the step is that of the slow part.

    Where the parabola under the slow part is still positive at S, the slow part's step is the longer one.
    """
    m3, span = w[r.M3 + i], w[r.SPAN + i]
    if not fast:
        step, slope = safe_step(trusted, taylor.dg, taylor.ddg, m3, span)
        return step, slope, False
    rf, m2, sig = w[r.FAST_AMPLITUDE + i], w[r.M2_SLOW + i], w[r.SIG + i]
    slow = fma(sig, ripple.second, trusted) - (rf + w[r.NOISE + i])
    slow_slope = fma(-sig, ripple.slope, taylor.dg)
    far = (slow > 0.0) & (rf > 0.0) & (fma(fma(-0.5 * m2, span, slow_slope), span, slow) > 0.0)
    slow_bend = curvature_bound(sig * ripple.slow, m2, LEAP)
    leap = slow_bend > -m2
    bend = choose(far, choose(leap, slow_bend, -m2), curvature_bound(taylor.ddg, m3, span))
    reach = choose(far, choose(leap, LEAP, INFINITY), span)
    step, slope = parabola(choose(far, slow, trusted), choose(far, slow_slope, taylor.dg), bend, reach)
    return step, choose(far, 0.0, slope), far


@inline
def note_dip(w, i, h, taylor, x):
    """Keep the closest the function came to a zero that it does not have.

    It is the lowest point of the parabola of second order here, |g - g'²/2g"|, where the third derivative cannot
    belie it; kept as a fraction, so that no step pays for a division.
    """
    g, dg, ddg = taylor.g, taylor.dg, taylor.ddg
    over, under = abs(dot(2.0 * g, ddg, -dg, dg)), 2.0 * ddg
    sure = (under > 0.0) & (w[r.M3 + i] * abs(dg * dg * dg) <= 1.5 * over * ddg * ddg) & (h > 0.0)
    first = w[r.DIP_DENOMINATOR + i] == 0.0
    nearer = sure & (x > 0.0) & (first | (over * w[r.DIP_DENOMINATOR + i] < w[r.DIP_NUMERATOR + i] * under))
    nearer = nearer & (w[r.OUTCOME + i] == NOTHING)
    w[r.DIP_NUMERATOR + i] = choose(nearer, over, w[r.DIP_NUMERATOR + i])
    w[r.DIP_DENOMINATOR + i] = choose(nearer, under, w[r.DIP_DENOMINATOR + i])


@inline
def next_on_grid(w, i, taylor, x, step, rate, trusted):
    """(grid point to go to, what is met at the cursor), where `step` is free of zeros."""
    cursor, limit = w[r.CURSOR + i], w[r.LIMIT + i]
    further = step_to_zero(taylor, w[r.M3 + i], rate, w[r.NOISE + i])
    step = choose(further > step, further, step)
    reach = cursor + (step / w[r.DTAU + i] if trusted > 0.0 else 0.0)
    reach = reach if reach < limit else limit
    whole = (reach + ROUND) - ROUND
    whole = whole - 1.0 if whole > reach else whole
    ahead = whole if whole > cursor + 1.0 else cursor + 1.0
    zero, fallen = taylor.g < 0.0, x < 0.0
    met = FALLEN if fallen else (ZERO if zero else (LIMIT_MET if cursor >= limit else NOTHING))
    # where ξ and ξ' are both seen to have changed sign it is an impact; which of the two is noted for Muller
    met = BOTH if zero & fallen else met
    return cursor if met != NOTHING else ahead, met


@inline
def next_instant(w, i, h, taylor, x, step, rate):
    """(h to go to, what is met there) without a grid, where `step` is free of zeros."""
    limit = w[r.LIMIT + i]
    tired = w[r.WORK + i] - w[r.WORK_BOOKED + i] > PATIENCE
    ahead, zero = advance(h, taylor, w[r.M3 + i], w[r.SPAN0 + i], rate, step, choose(tired, 0.0, limit))
    at_limit = ahead >= limit
    ahead = limit if at_limit else ahead
    met = LIMIT_MET if at_limit | tired else (ZERO if zero else NOTHING)
    return ahead, FALLEN if x < -w[r.FALL_TOLERANCE + i] else met


@inline_each("fast", "grid")
def search(w, i, fast, grid):
    """One step of the search in lane i. `fast` and `grid` are literals: each pair is a loop of its own.

    Without a grid the cursor is a time h after the last switch; on a grid it is a whole number of steps, and a zero is
    met where eq. (10) holds for the step that ends there. A lane that has met something stays as it is.
    """
    cursor, sig = w[r.CURSOR + i], w[r.SIG + i]
    h = cursor * w[r.DTAU + i] if grid else cursor
    taylor, x, ripple = evaluate(w, i, h, fast)
    g = taylor.g
    trusted = g - w[r.NOISE + i] if grid else g
    trusted = trusted if trusted > 0.0 else 0.0
    step, slope, far = free_step(w, i, taylor, ripple, trusted, fast)
    # the next S: as far as this step went where the root is in sight, further where it is not
    span = choose(slope > 0.0, step, choose(far, w[r.SPAN0 + i], 3.0 * w[r.SPAN + i]))
    rate = choose(w[r.ETA + i] > 1.0, w[r.ETA + i], 1.0) if fast else 1.0
    if grid:
        span += 1e-9 * w[r.SPAN0 + i]  # a value not trusted gives the step 0, which must not be the last S
        ahead, met = next_on_grid(w, i, taylor, x, step, rate, trusted)
    else:
        note_dip(w, i, h, taylor, x)
        ahead, met = next_instant(w, i, h, taylor, x, step, rate)
    # a search of two sides goes on with the one that is behind
    other = w[r.OTHER + i]
    turn = ahead > other
    if grid:
        next_one = choose((ahead == cursor + 1.0) & (not turn), g, UNKNOWN)
        w[r.BEFORE + i] = choose(ahead == cursor, w[r.BEFORE + i], next_one)
        w[r.VALUE + i] = choose(turn, UNKNOWN, g)
    on = w[r.OUTCOME + i] == NOTHING
    w[r.LAST_NONNEGATIVE + i] = choose(on & (x >= 0.0) & (g >= 0.0), cursor, w[r.LAST_NONNEGATIVE + i])
    w[r.CURSOR + i] = choose(on, choose(turn, other, ahead), cursor)
    w[r.OTHER + i] = choose(on & turn, ahead, other)
    w[r.SIG + i] = choose(on & turn, -sig, sig)
    w[r.OUTCOME + i] = choose(on, choose(turn, NOTHING, met), w[r.OUTCOME + i])
    w[r.SPAN + i] = choose(on, choose(turn, w[r.SPAN0 + i], span), w[r.SPAN + i])
    w[r.WORK + i] += choose(on, 1.0, 0.0)


@part_each("fast")
def search_on_grid(w, n, fast, steps):
    """`search_stepwise` on a grid, with a disturbance (`fast`) or without. A zero that is being refined stays."""
    wide()
    m = full(n)
    for i in range(m):
        w[r.OUTCOME + i] = choose(w[r.REFINEMENT + i] >= LEAVING, w[r.OUTCOME + i], NOTHING)
    for _ in range(steps):
        for i in range(m):
            search(w, i, fast, True)


@part
def search_stepwise(w, n, steps):
    """`steps` passes over the searches in the lanes 0..n-1, without a grid: one that has ended stays as it is.

    What earlier passes met is cleared first. `steps` is an argument, not a literal, or the compiler would unroll the
    loop.
    """
    wide()
    m = full(n)
    for i in range(m):
        w[r.OUTCOME + i] = NOTHING
    for _ in range(steps):
        for i in range(m):
            search(w, i, True, False)
