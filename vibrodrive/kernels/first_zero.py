"""Search for the first zero of a switching function S1-S5, eq. (8).

Each switching function is positive while its state lasts. The state ends at the first zero:

    S1 =  ξ          sliding down ends in an impact
    S2 = -ξ'         sliding down ends in the air
    S3 =  ξ'         sliding up ends
    S4 = 1 ∓ H       sticking ends: two sides, 1 - H and 1 + H
    S5 = 1 - H       resting at the obstacle ends

In terms of the shapes of motion.py, each function is BASE + SIG · (c0 + c1 h + c2 h² + α sin h + β vers h + fast part).

**Why no zero is missed.** Let g >= 0 be the value of a switching function at the cursor, let g' and g'' be its
derivatives there, and let |g'''| <= M3 after the cursor. A switching function is the sum of a polynomial of degree two
and two sinusoids, so M3 is the sum of the amplitudes of the third derivatives of the sinusoids. Taylor's theorem with a
bounded remainder gives, for any S > 0,

    g(τ + s) >= g + g's + (g'' - M3 S/3) s²/2       for 0 < s <= S

The right side is a parabola in s. It is positive, and so is g, up to S or up to its first positive root, whichever is
smaller. This length is the step of the search. S is arbitrary; the code derives it from the last step. Let d
be the distance from the cursor to a transversal zero. The root of the parabola is before this zero, and its distance
from the zero decreases faster than d² as d → 0.

If a fast ripple of amplitude a dominates M3, a second bound may give a longer step: g_slow + g_slow's + b s²/2 - a. It
uses the slow part of g, and the small bound M2 of the second and third derivatives of the slow part. b is the larger of
-M2 and g_slow'' - M2 S/3 with a large S. The code takes the step of the second bound if this bound, with b = -M2, is
positive at the S of the first bound.

**Starts on a zero.** A slide from rest has g = 0 and g' >= 0 at its beginning, and g/s >= g' + g''s/2 - M3 s²/6. The
search begins at the positive root of this bound, so the start is not mistaken for the next switch. At ε = 0 a slide
from rest accelerates until H returns to the boundary 1 or -1. |ξ'| has its peak there, at a known phase, and the search
begins at this peak.

**Ends.** Near a simple zero the code uses the series of undisturbed.py. Let d be the step that the series gives, and
let |g''''| <= M4. If |g''| d + M3 d²/2 + M4 d³/6 < |g'|/4, then g' changes by less than a quarter over d. A zero within
d is then unique, and the series ends close to it. The cursor moves to the end of the series, which may be on either
side of the zero. If the terms of the series decrease fast, its end is the zero to the last bit.

**Rounding.** A step by the bounds may end after a zero, by at most the rounding error of g divided by |g'|. If a
minimum of g differs from 0 by less than the rounding error, g may have two zeros or no zero. The search ends there, and
the distance of this minimum from 0 counts for the margin (margins.py).

**Grids.** The methods `fixed` and `muller` skip grid points by the same bound, after the rounding error is subtracted
from g. So the computed g would be positive at each skipped point. These searches begin at the first grid point after
the switch. These searches also use the series, as far as g certainly remains above its rounding error.

`kernels/__init__.py` explains the terms.
"""

import math
from typing import NamedTuple

import numpy as np

from vibrodrive.jit.branchless import ROUND, choose, fma, full, put, wide
from vibrodrive.jit.compile import inline, inline_each, part, part_each
from vibrodrive.jit.trig import PI, TWO_PI, arc, arc_of_product, dot
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import motion
from vibrodrive.kernels.codes import BOTH, FALLEN, INFINITY, LEAVING, LIMIT_MET, NOTHING, S1, S2, S3, S4, UNKNOWN, ZERO

NOISE_SHARE = 1e-13
"""Share of the sum of the magnitudes of the terms of a switching function. The function must exceed this share at each
skipped grid point, so that its sign there is certain. The share is four hundred times the rounding error of one term.
A larger share costs only a few more evaluations."""

LATE_SHARE = 4e-3
"""Search.noise includes NOISE_SHARE · LATE_SHARE · a η h, because the time of a grid point is rounded. a is the
amplitude of the fast part, and h the limit of the search."""


class Search(NamedTuple):
    """A switching function as a shape, and the data of its search.

    form, alf, bef, base, sig : the function is base + sig · shape; `form` has the coefficients of the slow part of the
    shape, alf and bef are those of its fast part
    fast : amplitude of the fast part
    m2 : bound of the second and third derivatives of the slow part
    m3 : bound of the third derivative
    span : the first S (see the head)
    noise : bound of the rounding error. A grid point is skipped only if the function exceeds this bound there
    """

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
    """Value of a switching function and its first four derivatives at one instant."""

    g: float
    dg: float
    ddg: float
    dddg: float
    ddddg: float


class Ripple(NamedTuple):
    """Parts of the derivatives of a switching function.

    slope, second : first derivative of the fast part, and its second derivative over η²
    slow : second derivative of the slow part
    """

    slope: float
    second: float
    slow: float


@inline
def search_shape(w, i, which, limit):
    """Return switching function `which`, eq. (8), of the present segment in lane i, for a search up to `limit`."""
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
    m2 = 2.0 * abs(c2) + w[r.A + i] + 1e-300  # a divisor, so not zero
    m3 = w[r.A + i] + fast * eta
    span = choose(a > 0.0, (w[r.A + i] + fast) / (m3 + 1e-300), 1.0)
    drift = (abs(c1) + abs(c2) * limit) * limit
    noise = NOISE_SHARE * (base + abs(c0) + 2.0 * (abs(al) + abs(be) + a) + drift + LATE_SHARE * a * eta * limit)
    return Search(motion.Form(c0, d1, d2, c1, c2, al, be), alf, bef, base, sig, a, m2, m3, span, noise)


@inline
def set_search(w, k, i, where, which, search, cursor):
    """Begin the search for the first zero of switching function `which` (S1 ... S5) in lane i, at `cursor`.

    Both sides of S4 = 1 - |H| are searched. Each step is taken on the side whose cursor is earlier.

    The search for S2 also computes ξ, which decreases strictly while ξ' < 0. S1 has a zero before the first zero of S2
    if and only if ξ is not positive at this zero of S2. The zero of S1 is then unique. The search ends early if ξ is
    below 0 by more than the smallest margin so far. In this case the impact is certain, and the margin of this decision
    does not change the smallest margin.
    """
    falling = which == S2
    put(w, r.C0 + i, where, search.form.c0)
    put(w, r.D1 + i, where, search.form.d1)
    put(w, r.D2 + i, where, search.form.d2)
    put(w, r.C1 + i, where, search.form.c1)
    put(w, r.C2 + i, where, search.form.c2)
    put(w, r.AL + i, where, search.form.al)
    put(w, r.BE + i, where, search.form.be)
    put(w, r.ALF + i, where, search.alf)
    put(w, r.BEF + i, where, search.bef)
    put(w, r.BASE + i, where, search.base)
    put(w, r.SIG + i, where, search.sig)
    put(w, r.FAST_AMPLITUDE + i, where, search.fast)
    put(w, r.M2_SLOW + i, where, search.m2)
    put(w, r.M3 + i, where, search.m3)
    put(w, r.SPAN0 + i, where, search.span)
    put(w, r.SPAN + i, where, search.span)
    put(w, r.NOISE + i, where, search.noise)
    put(w, r.CURSOR + i, where, cursor)
    put(w, r.OTHER + i, where, choose(which == S4, 0.0, INFINITY))
    put(w, r.LAST_NONNEGATIVE + i, where, 0.0)
    put(w, r.WATCHED_GAP + i, where, choose(falling, w[r.X0 + i], INFINITY))
    put(w, r.FALL_TOLERANCE + i, where, choose(falling, w[r.MARGIN + i], INFINITY))
    put(w, r.DIP_DENOMINATOR + i, where, 0.0)
    put(k, r.SEARCH + i, where, which)


@inline
def form_of(w, i):
    """Return the slow part of the switching function searched in lane i."""
    return motion.Form(w[r.C0 + i], w[r.D1 + i], w[r.D2 + i], w[r.C1 + i], w[r.C2 + i], w[r.AL + i], w[r.BE + i])


@inline
def set_limit(w, i, where, limit):
    """Set the limit of the search in lane i."""
    put(w, r.LIMIT + i, where, limit)


@inline
def unknown_values(w, i, where):
    """Mark the values of the switching function at the grid points around the cursor as unknown."""
    put(w, r.VALUE + i, where, UNKNOWN)
    put(w, r.BEFORE + i, where, UNKNOWN)


@inline
def restart_search(w, k, i, which, limit, cursor):
    """Begin the search for the first zero of switching function `which` in lane i, without a mask, at `cursor`."""
    set_search(w, k, i, True, which, search_shape(w, i, which, limit), cursor)
    unknown_values(w, i, True)


@inline
def start_on_grid(w, i, where, which):
    """Adapt a search that has just begun to a grid.

    Both sides of S4 start at grid point 1. Any ξ < 0 is an impact.
    """
    unknown_values(w, i, where)
    put(w, r.FALL_TOLERANCE + i, where & (which == S2), 0.0)
    put(w, r.OTHER + i, where & (which == S4), 1.0)


@inline
def turn_side(w, i):
    """Continue a search on a grid with the other side of S4."""
    w[r.SIG + i] = -w[r.SIG + i]
    unknown_values(w, i, True)


BENT = 0.25
"""Largest relative change of g' over a step d of the series.

The series uses four derivatives. So g at the end of the series differs from 0 only by the effect of a change of
the fourth derivative. This effect is at most M4 d⁴/12 in g, or d/6 in time. If the series ends after the zero, the step
back is at most r = d/5 and fulfils the same condition: |g''| r + M3 r²/2 + M4 r³/6 is below a quarter of |g'| at that
end.
"""

LEAP = 2.0
"""S of the second bound (see the head), and largest step by it, if g_slow'' is used instead of its bound -M2."""

SURELY_FREE = 0.95
"""Share of the zero-free interval after a start from rest in which grid points are skipped. Near the end of this
interval g may be smaller than its rounding error."""

LEAST_GAP = 1e-30
"""Smallest ξ at the start of a slide down for which the impact is found by steps, with a disturbance. For a smaller ξ
bisection is used."""

PATIENCE = 1e5
"""Number of steps after which a search ends as if it had reached its limit, so that the budget is checked."""


@inline
def parabola(g, dg, bend, span):
    """Return (root, slope) of the parabola g + dg s + bend s²/2, where g >= 0.

    `root` is the first positive root s, and `slope` is minus the slope there. If there is no root below `span`, return
    (span, 0).
    """
    q2 = dot(dg, dg, -2.0 * g, bend)
    q = math.sqrt(q2 if q2 > 0.0 else 0.0)
    falling = dg < 0.0
    numerator = 2.0 * g if falling else dg + q
    denominator = q - dg if falling else -bend
    root = numerator / (denominator if denominator > 0.0 else 1e-300)
    root = choose((q2 >= 0.0) & (falling | (bend < 0.0)), root, INFINITY)
    return choose(root < span, root, span), choose(root < span, q, 0.0)


@inline
def curvature_bound(ddg, m3, span):
    """Return the second derivative of a parabola that is below g up to S = span. ddg = g'' and |g'''| <= m3."""
    return fma(-(1.0 / 3.0) * m3, span, ddg)


@inline
def safe_step(g, dg, ddg, m3, span):
    """Return (step, slope): the step for S = span, and minus the slope of the parabola at its root (0 without a root).

    ddg = g'' and |g'''| <= m3.
    """
    return parabola(g, dg, curvature_bound(ddg, m3, span), span)


@inline
def zero_free_span(rise, bend, m3):
    """Return S such that g > 0 on (0, S), if g = 0, g' = rise >= 0 and g'' = bend at 0.

    S is the positive root of the bound g/s >= g' + g''s/2 - M3 s²/6.
    """
    free, _ = parabola(rise, 0.5 * bend, -(1.0 / 3.0) * m3, INFINITY)
    return free


@inline
def first_cursor(search, limit):
    """Return the cursor at which the search for the end of a slide from rest can begin."""
    free = zero_free_span(search.sig * search.form.d1, 2.0 * search.sig * search.form.d2, search.m3)
    return choose(free > 0.0, choose(free < limit, free, limit), 0.0)


@inline
def first_grid_point(search, dtau, limit):
    """Return the first grid point to evaluate for a slide from rest. At earlier points the function exceeds its noise.

    The lower bound of g/s is a concave function of s, so its minimum is at one end of the interval.
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
    """Return the cursor at the peak of |ξ'| of a slide from rest at ε = 0, or `limit` if the peak is later.

    The peak is where H falls to 1 in a slide up (s = 1), or rises to -1 in a slide down (s = -1). The search for the
    end of the slide can begin there.
    """
    h = (PI - w[r.PHI_UP + i] if s > 0.0 else 3.0 * PI - w[r.PHI_DOWN + i]) - w[r.PHI + i]
    if h >= TWO_PI:
        h -= TWO_PI
    return choose(h > 0.0, choose(h < limit, h, limit), 0.0)


@inline
def stay_inside(w, k, i, force):
    """Move the cursor away from the start of a wait if |H| exceeds 1 by rounding there, and decreases.

    Otherwise the search would take the start for the end of the wait.
    """
    rise, bend = w[r.D1 + i], 2.0 * w[r.D2 + i]
    if force > 1.0 and rise < 0.0:
        w[r.CURSOR + i] = zero_free_span(-rise, -bend, w[r.M3 + i])
    elif k[r.SEARCH + i] == S4 and force < -1.0 and rise > 0.0:
        w[r.OTHER + i] = zero_free_span(rise, bend, w[r.M3 + i])


@part
def fall_from_tiny_gap(w, i, h):
    """Return the instant at which a gap that starts below LEAST_GAP falls to 0. This instant is not later than h.

    The instant is found by bisection of the logarithm of the time. A search by steps would make no progress, because
    for such gaps the rounding errors of the higher derivatives are large.
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
    """Return (h - δ, close): δ is the sum of the series, and `close` is true if h - δ is a zero to the last bit.

    u = g/g', half = g''/2g', third = g'''/g', fourth = g''''/g'. With m3 = M3/g', the moduli of the derivatives over g'
    are at most m3 · scale (second), m3 (third), m3 · rate (fourth) and m3 · rate² (fifth).

    The terms of the series decrease like powers of t and of rate · u. The bound used here exceeds the first omitted
    term. If this bound is below the last bit of h, then t and rate · u are far below 1, so no other zero is near.
    """
    ahead = h - motion.householder_series(u, half, third * (1.0 / 6.0), fourth * (1.0 / 24.0))
    t = fma(abs(m3), scale, abs(half)) * u
    e = abs(m3) * u * u
    t2 = fma(t, t, e)
    q = 0.25 * rate * u
    near = abs(ahead - h) <= h  # also false after an overflow
    return ahead, (dot(t2, t2, q * q, e) * abs(u) <= motion.TINY * h) & near


@inline
def is_nearly_straight(way, dg, ddg, m3, rate):
    """Return True if g' < 0 and g' certainly changes by less than BENT |g'| within the time `way`.

    dg = g', ddg = g'', |g'''| <= m3, and |g''''| <= m3 · rate.
    """
    return fma(fma(fma((1.0 / 6.0) * rate * m3, way, 0.5 * m3), way, abs(ddg)), way, BENT * dg) < 0.0


@inline
def step_to_zero(taylor, m3, rate, noise):
    """Return a step to an instant shortly before the zero that the series predicts. At this instant g exceeds `noise`.

    Return 0 if this is not certain.

    Over the step |g'| is at least 3/4 of its present value, so g falls. The modulus of the Taylor polynomial at the end
    of the series, plus the remainder M5 s⁵/120 (M5 = m3 · rate²) and the noise, is divided by this slope. The step ends
    before the end of the series by more than this quotient.
    """
    g, dg, ddg, dddg, ddddg = taylor
    inverse = 1.0 / choose(dg < 0.0, dg, -1e-300)
    half, third, fourth = 0.5 * ddg, (1.0 / 6.0) * dddg, (1.0 / 24.0) * ddddg
    way = -motion.householder_series(g * inverse, half * inverse, third * inverse, fourth * inverse)
    square = way * way
    off = abs(fma(fma(fma(fma(fourth, way, third), way, half), way, dg), way, g))
    off = fma((1.0 / 120.0) * m3 * rate * rate, square * square * way, off) + noise
    return choose(is_nearly_straight(way, dg, ddg, m3, rate) & (way > 0.0), fma(1.5 * off, inverse, way), 0.0)


@inline
def advance(h, taylor, m3, scale, rate, step, limit):
    """Return (next cursor, zero) from g and its derivatives at h; `zero` is true if this cursor is the zero of g.

    Assumptions: if g >= 0 at h, g has no zero between h and h + `step`. The moduli of the derivatives of g are at most
    m3 · scale (second), m3 (third) and m3 · rate (fourth).
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
    inside = (jump > choose(past, 0.0, ahead)) & (jump < choose(past, h, limit))
    trusted = inside & is_nearly_straight(way, dg, ddg, m3, rate)
    zero = close | ((not trusted) & (past | (step <= motion.TINY * ahead)))
    return choose(close | trusted, jump, ahead), zero


@inline_each("fast")
def evaluate(w, i, h, fast):
    """Return (taylor, x, ripple) at h: `Taylor` and `Ripple` of the switching function of lane i, and x = ξ."""
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
    """Return (step, slope, far): step and slope as from `safe_step` for the span S of lane i.

    `trusted` is g or, on a grid, g less its rounding error. `far` is true if the step follows from the second bound
    (see the head). This bound gives the longer step if it is positive at S. Then `slope` is 0.
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
    """Store the distance of a minimum of the switching function from 0, if it is the smallest so far.

    The minimum is that of the Taylor polynomial of degree two at h, so the distance is |g - g'²/2g''|. It is stored
    only if the third derivative is too small to invalidate this minimum. A fraction is stored, to avoid a division.
    """
    g, dg, ddg = taylor.g, taylor.dg, taylor.ddg
    over, under = abs(dot(2.0 * g, ddg, -dg, dg)), 2.0 * ddg
    sure = (under > 0.0) & (w[r.M3 + i] * abs(dg * dg * dg) <= 1.5 * over * ddg * ddg) & (h > 0.0)
    first = w[r.DIP_DENOMINATOR + i] == 0.0
    nearer = sure & (x > 0.0) & (first | (over * w[r.DIP_DENOMINATOR + i] < w[r.DIP_NUMERATOR + i] * under))
    nearer = nearer & (w[r.OUTCOME + i] == NOTHING)
    put(w, r.DIP_NUMERATOR + i, nearer, over)
    put(w, r.DIP_DENOMINATOR + i, nearer, under)


@inline
def next_on_grid(w, i, taylor, x, step, rate, trusted):
    """Return (next grid point, outcome at the cursor) of a search on a grid.

    Assumption: there is no zero within the time `step` after the cursor.
    """
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
    # BOTH: ξ and ξ' have changed sign. `fixed` then takes an impact. `muller` takes an impact only if ξ <= 0 at the
    # refined zero of ξ'
    met = BOTH if zero & fallen else met
    return cursor if met != NOTHING else ahead, met


@inline
def next_instant(w, i, h, taylor, x, step, rate):
    """Return (next h, outcome) of a search without a grid. Assumption: there is no zero between h and h + `step`."""
    limit = w[r.LIMIT + i]
    tired = w[r.WORK + i] - w[r.WORK_BOOKED + i] > PATIENCE
    ahead, zero = advance(h, taylor, w[r.M3 + i], w[r.SPAN0 + i], rate, step, choose(tired, 0.0, limit))
    at_limit = ahead >= limit
    ahead = limit if at_limit else ahead
    met = LIMIT_MET if at_limit | tired else (ZERO if zero else NOTHING)
    return ahead, FALLEN if x < -w[r.FALL_TOLERANCE + i] else met


@inline_each("fast", "grid")
def search(w, i, fast, grid):
    """Do one step of the search in lane i, with a disturbance if `fast`, on a grid if `grid`.

    `fast` and `grid` are literals: each pair is compiled to a separate loop. Without a grid the cursor is a time h. On
    a grid the cursor is the number of a grid point, counted from the last switch, and a zero is found if eq. (10) holds
    for the step that ends at this point. If lane i already has an outcome, the outcome remains unchanged.
    """
    cursor, sig = w[r.CURSOR + i], w[r.SIG + i]
    h = cursor * w[r.DTAU + i] if grid else cursor
    taylor, x, ripple = evaluate(w, i, h, fast)
    g = taylor.g
    trusted = g - w[r.NOISE + i] if grid else g
    trusted = trusted if trusted > 0.0 else 0.0
    step, slope, far = free_step(w, i, taylor, ripple, trusted, fast)
    # the next S: this step if the parabola had a root, otherwise a longer S
    span = choose(slope > 0.0, step, choose(far, w[r.SPAN0 + i], 3.0 * w[r.SPAN + i]))
    rate = choose(w[r.ETA + i] > 1.0, w[r.ETA + i], 1.0) if fast else 1.0
    if grid:
        span += 1e-9 * w[r.SPAN0 + i]  # S must not remain 0 after a step of length 0, where g < noise
        ahead, met = next_on_grid(w, i, taylor, x, step, rate, trusted)
    else:
        note_dip(w, i, h, taylor, x)
        ahead, met = next_instant(w, i, h, taylor, x, step, rate)
    # S4: continue with the side whose cursor is earlier
    other = w[r.OTHER + i]
    turn = ahead > other
    if grid:
        next_one = choose((ahead == cursor + 1.0) & (not turn), g, UNKNOWN)
        put(w, r.BEFORE + i, ahead != cursor, next_one)
        w[r.VALUE + i] = choose(turn, UNKNOWN, g)
    on = w[r.OUTCOME + i] == NOTHING
    put(w, r.LAST_NONNEGATIVE + i, on & (x >= 0.0) & (g >= 0.0), cursor)
    put(w, r.CURSOR + i, on, choose(turn, other, ahead))
    put(w, r.OTHER + i, on & turn, ahead)
    put(w, r.SIG + i, on & turn, -sig)
    put(w, r.OUTCOME + i, on, choose(turn, NOTHING, met))
    put(w, r.SPAN + i, on, choose(turn, w[r.SPAN0 + i], span))
    w[r.WORK + i] += choose(on, 1.0, 0.0)


@part_each("fast")
def search_on_grid(w, n, fast, steps):
    """Do `steps` steps of the searches on a grid in the lanes 0..n-1, with a disturbance (`fast`) or without.

    Outcomes are cleared first, except in lanes whose zero is being refined (muller.py). Lanes with an outcome remain
    unchanged.
    """
    wide()
    m = full(n)
    for i in range(m):
        put(w, r.OUTCOME + i, w[r.REFINEMENT + i] < LEAVING, NOTHING)
    for _ in range(steps):
        for i in range(m):
            search(w, i, fast, True)


@part
def search_stepwise(w, n, steps):
    """Do `steps` steps of the searches without a grid in the lanes 0..n-1.

    Outcomes are cleared first. Lanes with an outcome remain unchanged. If `steps` were a literal, the compiler would
    unroll the loop.
    """
    wide()
    m = full(n)
    for i in range(m):
        w[r.OUTCOME + i] = NOTHING
    for _ in range(steps):
        for i in range(m):
            search(w, i, True, False)
