"""Hand-written Numba: branch and prune with interval arithmetic, and the interval Newton method.

The bounds of an interval (low, high) are doubles, rounded outwards, so they hold for the exact function of the inputs.
From left to right, a box without a zero (g or g′ excludes 0) is discarded, a box with one zero (g′ excludes 0, and g
has different signs at its ends) is narrowed by Newton's method, and any other box is halved. The search ends undecided
where a box cannot be halved, at a double zero or where rounding hides the sign of g. The zeros before this point are
the answer, and the case is refused if there is none.

The start: if g = 0 there, a box in which g′ excludes 0 has no zero after the start. If also g′ = 0 at the start, the
same holds for g″. At level 0 these must be exact zeros. At levels 1 to 3 a slide that begins with ξ′ = 0 has g = 0, and
g′ counts as 0 if it could be 0 at a start within 4 ulps: the time at which STICK or REST ends, H = 1, is rounded.

At levels 1 to 3 each search and each decision about H is certain for the state, in doubles, in which it starts. The
rounding of this state is not carried on, so the motion as a whole is not enclosed.
"""

import math
from typing import NamedTuple

import numpy as np

from benchmarks.switches.loop import UNKNOWN, event_loop
from benchmarks.switches.model import DOWN, STICK, UP, jit

NAME, PACKAGE = "branch and prune", None
SETTINGS: list[dict[str, float]] = [{}]

NONE, FOUND, UNDECIDED = range(3)
NO_START, SIMPLE, DOUBLE = range(3)  # g is not 0 at the start, or has a simple or a double zero there
ULP, TINY = 2.0**-52, 5e-324
ZERO, ONE, WHOLE = (0.0, 0.0), (1.0, 1.0), (-1.0, 1.0)


class Form(NamedTuple):
    """g(h) = k0 + k1 h + k2 h² + p sin h + q (1 − cos h) + pf sin wh + qf (1 − cos wh), with intervals except for w.

    If g(0) = 0, the values near h = 0 have small relative errors. w = 0 without a fast wave.
    """

    k0: tuple[float, float]
    k1: tuple[float, float]
    k2: tuple[float, float]
    p: tuple[float, float]
    q: tuple[float, float]
    pf: tuple[float, float]
    qf: tuple[float, float]
    w: float


# Intervals. A rounded result x is at most half an ulp from the exact one, and ULP * |x| is at least an ulp.


@jit
def below(x):
    return x - (ULP * abs(x) + TINY)


@jit
def above(x):
    return x + (ULP * abs(x) + TINY)


@jit
def sum_and_error(a, b):
    """Return the rounded sum, and its exact error (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@jit
def add(a, b):
    """Return a + b. An exact sum is not widened, so 0 remains 0."""
    low, under = sum_and_error(a[0], b[0])
    high, over = sum_and_error(a[1], b[1])
    return low if under >= 0.0 else below(low), high if over <= 0.0 else above(high)


@jit
def neg(a):
    return -a[1], -a[0]


@jit
def mul(a, b):
    """Return a b. Factors 0 and 1 are exact."""
    if a == ZERO or b == ZERO:
        return ZERO
    if a == ONE:
        return b
    if b == ONE:
        return a
    w, x, y, z = a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]
    return below(min(w, x, y, z)), above(max(w, x, y, z))


@jit
def scale(x, a):
    return mul((x, x), a)


@jit
def meet(a, b):
    return max(a[0], b[0]), min(a[1], b[1])


@jit
def spread(a, rho):
    """Return a [−ρ, ρ]."""
    size = above(max(-a[0], a[1]) * rho) if rho > 0.0 and a != ZERO else 0.0
    return -size, size


@jit
def same(a, sign):
    """Return True if all of the interval has this sign."""
    return a[0] > 0.0 if sign > 0.0 else a[1] < 0.0


@jit
def clear(a):
    """Return True if the interval excludes 0."""
    return a[0] > 0.0 or a[1] < 0.0


@jit
def product_and_error(x, y):
    """Return the rounded product, and its exact error (Dekker)."""
    hi = x * y
    t, u = 134217729.0 * x, 134217729.0 * y
    xh, yh = t - (t - x), u - (u - y)
    xl, yl = x - xh, y - yh
    return hi, ((xh * yh - hi) + xh * yl + xl * yh) + xl * yl


@jit
def cos_sin(w, x):
    """Return cos wx and sin wx. The error of the C library's functions is less than an ulp (glibc's manual)."""
    angle, rest = product_and_error(w, x)
    if angle == 0.0:
        return ONE, ZERO
    s, c = math.sin(angle), math.cos(angle)
    cos, sin = (below(below(c)), above(above(c))), (below(below(s)), above(above(s)))
    if rest != 0.0:
        cos, sin = turn(cos, sin, (rest, rest))
    return meet(cos, WHOLE), meet(sin, WHOLE)


@jit
def turn(cos, sin, by):
    """Return cosine and sine of an angle after a turn by any angle of the interval `by`, less than 1.5 in size."""
    size = max(-by[0], by[1])
    c = (max(below(1.0 - above(0.5 * size * size)), 0.0), 1.0)
    cube = above(above(size * size) * size)
    s = (below(by[0] - cube), above(by[1] + cube)) if by[0] == by[1] else by  # |sin x − x| < |x|³ and |sin x| ≤ |x|
    return add(mul(cos, c), neg(mul(sin, s))), add(mul(sin, c), mul(cos, s))


# Functions


@jit
def wave(p, q, w, m, rho):
    """Return value and slope at m of p sin wh + q (1 − cos wh); value, slope and second derivative in m ± rho."""
    c, s = cos_sin(w, m)
    versed = add(ONE, neg(c))
    if 0.0 < c[0] < 1.0:
        square, over = mul(s, s), add(ONE, c)
        versed = below(max(square[0], 0.0) / over[1]), above(square[1] / over[0])
    delta = above(w * rho)
    cos, sin = WHOLE, WHOLE
    if delta < 1.5:
        cos, sin = turn(c, s, (-delta, delta))
        cos, sin = meet(cos, WHOLE), meet(sin, WHOLE)
    value, slope = add(mul(p, s), mul(q, versed)), scale(w, add(mul(p, c), mul(q, s)))
    values = add(mul(p, sin), mul(q, add(ONE, neg(cos))))
    slopes = scale(w, add(mul(p, cos), mul(q, sin)))
    bends = scale(w, scale(w, add(mul(q, cos), neg(mul(p, sin)))))
    return value, slope, values, slopes, bends


@jit
def taylor(g, d, bend, rho):
    """Return the bounds of a function in a box from value and slope at its middle, and the second derivative."""
    half = spread(bend, above(0.5 * rho * rho))
    half = (half[0] if bend[0] < 0.0 else 0.0, half[1] if bend[1] > 0.0 else 0.0)
    return add(add(g, spread(d, rho)), half)


@jit
def with_wave(g, d, b, wide, rate, part, w, rho):
    """Add a `part` of frequency w to a function: value and slope at m, and g″, g and g′ in m ± rho."""
    value, slope, values, slopes, bend = part
    wide, rate = add(wide, values), add(rate, slopes)
    g, d, b = add(g, value), add(d, slope), add(b, bend)
    box, change = taylor(g, d, b, rho), add(d, spread(b, rho))
    if w * rho > 0.25:  # the amplitude of a wave is the better bound if the box contains many
        box, change = meet(box, wide), meet(change, rate)
    return g, d, b, box, change


@jit
def enclose(form, m, rho):
    """Return bounds of g at m, and of g, g′ and g″ in m ± rho."""
    at = (m, m)
    bent = mul(form.k2, at)
    g, d, b = add(form.k0, mul(add(form.k1, bent), at)), add(form.k1, scale(2.0, bent)), scale(2.0, form.k2)
    wide, rate = taylor(g, d, b, rho), add(d, spread(b, rho))
    part = wave(form.p, form.q, 1.0, m, rho)
    g, d, b, wide, rate = with_wave(g, d, b, wide, rate, part, 1.0, rho)
    if form.w != 0.0:
        part = wave(form.pf, form.qf, form.w, m, rho)
        g, d, b, wide, rate = with_wave(g, d, b, wide, rate, part, form.w, rho)
    return g, wide, rate, b


def newton_by(enclose, jit):
    """Return the interval Newton method for functions that `enclose` bounds. `jit` compiles it."""

    @jit
    def newton(form, low, high):
        """Return bounds of the only zero in [low, high], in which g′ excludes 0."""
        while True:
            m = 0.5 * (low + high)
            g, _, slope, _ = enclose(form, m, above(max(m - low, high - m)))
            if not clear(slope):
                return low, high
            a, b, c, d = g[0] / slope[0], g[0] / slope[1], g[1] / slope[0], g[1] / slope[1]
            new_low = max(low, below(m - above(max(a, b, c, d))))
            new_high = min(high, above(m - below(min(a, b, c, d))))
            if not new_high - new_low < 0.9 * (high - low):
                return new_low, new_high
            low, high = new_low, new_high

    return newton


def first_by(enclose, jit):
    """Return the search for a first zero of functions that `enclose` bounds. `jit` compiles it."""
    newton = newton_by(enclose, jit)

    @jit
    def next_zero(form, left, end, sign, start, width):
        """Search (left, end] for the first zero of a function that has `sign` just after `left`.

        Return (outcome, low, high, right, width). A zero FOUND is in [low, high] and is the only one up to `right`. If
        the search is UNDECIDED, there is no zero up to `low`. `width` is that of the first box, then of the next one.
        """
        while left < end:
            right = min(left + width, end)
            m = 0.5 * (left + right)
            if not left < m < right:
                return UNDECIDED, left, right, right, width
            _, box, slope, bend = enclose(form, m, above(max(m - left, right - m)))
            none = same(slope, sign) or (same(box, sign) if start == NO_START else start == DOUBLE and same(bend, sign))
            if not none:
                crosses = same(slope, -sign)
                ahead = enclose(form, right, 0.0)[0] if crosses else WHOLE
                if same(ahead, -sign):
                    low, high = newton(form, left, right)
                    return FOUND, low, high, right, width
                none = same(ahead, sign)
                if not none:  # 0.7: the end of the box is too close to the zero
                    width = (0.7 if crosses else 0.5) * (right - left)
                    continue
            left, start, width = right, NO_START, 2.0 * width
        return NONE, end, end, end, width

    return next_zero


def all_by(enclose, next_zero, jit):
    """Return the search for all zeros of functions that `enclose` bounds. `jit` compiles it."""

    @jit
    def fill(form, T, found):
        """Fill `found` with the zeros in (0, T] in order. Return their number, and True if these are all zeros."""
        value, _, slope, bend = enclose(form, 0.0, 0.0)
        start = NO_START if value != ZERO else SIMPLE if slope != ZERO else DOUBLE
        first = value if start == NO_START else slope if start == SIMPLE else bend
        sign, count, left, width = 1.0 if first[0] > 0.0 else -1.0, 0, 0.0, T
        while clear(first) and count < len(found):
            outcome, low, high, left, width = next_zero(form, left, T, sign, start, width)
            if outcome != FOUND:
                return count, outcome == NONE
            found[count] = 0.5 * (low + high)
            count, sign, start = count + 1, -sign, NO_START
        return count, False

    return fill


# Level 0


@jit
def form_of(f):
    """Return g of level 0."""
    cos, sin = cos_sin(1.0, f.alpha)
    p, q = scale(f.a, cos), scale(f.a, sin)
    cos, sin = cos_sin(1.0, f.beta)
    pf, qf = scale(f.b, cos), scale(f.b, sin)
    c1, c2 = (f.c1, f.c1), (f.c2, f.c2)
    k0 = add(add((f.c0, f.c0), q), qf)
    return Form(k0, c1, c2, p, neg(q), pf, neg(qf), f.eta if f.b != 0.0 else 0.0)


next_zero = first_by(enclose, jit)
fill = all_by(enclose, next_zero, jit)


def search(function, T):
    """Return the zeros of `function` in (0, T] before the first that is undecided, and True if these are all zeros."""
    found = np.empty(100_000)
    count, whole = fill(form_of(function), T, found)
    return found[:count].tolist(), whole


def zeros(function, T):
    """Return the zeros of `function` in (0, T], or those before the first that is undecided."""
    found, whole = search(function, T)
    if not found and not whole:
        raise ArithmeticError(UNKNOWN)
    return found


# Levels 1 to 3


@jit
def forms(point, sign, t0, xi, dxi):
    """Return ±ξ′, ξ and H in a slide up (`sign` 1) or down (−1) from t0, as functions of h = τ − t0."""
    cos, sin = cos_sin(1.0, t0)
    wcos, wsin = cos_sin(point.eta, t0) if point.eps > 0.0 else (ZERO, ZERO)
    w, A = point.eta if point.eps > 0.0 else 0.0, (point.A, point.A)
    gap = scale(point.eps, A)  # amplitudes of the fast wave in ξ, ξ′ and H
    speed = scale(point.eta, gap)
    push = scale(point.eta, speed)
    pull = add((point.B, point.B), (sign, sign))
    px, qx, pv, qv = mul(A, cos), mul(A, sin), mul(gap, wcos), mul(gap, wsin)
    first = add(add((dxi, dxi), px), mul(speed, wcos))
    velocity = Form(
        (sign * dxi, sign * dxi), scale(-sign, pull), ZERO, scale(sign, qx), scale(sign, px),
        scale(sign, mul(speed, wsin)), scale(sign, mul(speed, wcos)), w,
    )  # fmt: skip
    distance = Form((xi, xi), first, scale(-0.5, pull), neg(px), qx, neg(pv), qv, w)
    h = add(add(qx, (-point.B, -point.B)), mul(push, wsin))
    force = Form(h, ZERO, ZERO, px, neg(qx), mul(push, wcos), neg(mul(push, wsin)), w)
    return velocity, distance, force


@jit
def margin(force, sign):
    """Return 1 − H (`sign` 1) or 1 + H (−1)."""
    k0 = add(ONE, scale(-sign, force.k0))
    p, q = scale(-sign, force.p), scale(-sign, force.q)
    return Form(k0, ZERO, ZERO, p, q, scale(-sign, force.pf), scale(-sign, force.qf), force.w)


@jit
def within(form, low, high):
    """Return the bounds of a function in [low, high]."""
    m = 0.5 * (low + high)
    return enclose(form, m, above(max(m - low, high - m)))[1]


@jit
def beginning(velocity, t0, dxi):
    """Return the kind of start of a slide, and True if ±ξ′ > 0 after it."""
    if dxi != 0.0:
        return NO_START, True
    _, _, slope, bend = enclose(velocity, 0.0, 0.0)
    if not clear(add(slope, spread(bend, 4.0 * ULP * abs(t0)))):
        return DOUBLE, same(bend, 1.0)
    return SIMPLE, same(slope, 1.0)


@jit
def locate(point, setting, state, t0, xi, dxi, end):
    sign = 1.0 if state == UP else -1.0
    velocity, distance, force = forms(point, sign, t0, xi, dxi)
    up, down = margin(force, 1.0), margin(force, -1.0)
    span, never = end - t0, end + 1.0
    width = min(1.0, span)
    if state in (UP, DOWN):
        start, known = beginning(velocity, t0, dxi)
        if not known:
            return math.nan, False, xi
        outcome, low, high, _, _ = next_zero(velocity, 0.0, span, 1.0, start, width)
        if state == DOWN:
            gap = within(distance, low, high)  # ξ decreases up to the reversal
            if same(gap, -1.0):
                outcome, low, high, _, _ = next_zero(distance, 0.0, high, 1.0, NO_START, width)
                sure = outcome == FOUND and clear(within(up, low, high))
                return t0 + 0.5 * (low + high) if sure else math.nan, True, 0.0
            if not clear(gap):
                return math.nan, False, xi
        if outcome == NONE:
            return never, False, xi
        sure = outcome == FOUND and clear(within(up, low, high)) and clear(within(down, low, high))
        gap = within(distance, low, high)
        return t0 + 0.5 * (low + high) if sure else math.nan, False, 0.5 * (gap[0] + gap[1])
    if not same(up.k0, 1.0) or not (state != STICK or same(down.k0, 1.0)):
        return math.nan, False, xi
    outcome, low, high, _, _ = next_zero(up, 0.0, span, 1.0, NO_START, width)
    if state == STICK:
        falls = next_zero(down, 0.0, high, 1.0, NO_START, width)
        if falls[0] != NONE:
            outcome, low, high = falls[0], falls[1], falls[2]
    if outcome == NONE:
        return never, False, xi
    return t0 + 0.5 * (low + high) if outcome == FOUND else math.nan, False, xi


events = event_loop(locate, compiled=True)
