"""Ends of states at ε = 0: at a known phase, or at the only zero of a function in a known interval.

**Waits** end at a known phase, the arcsine of (1 + B)/A or (B - 1)/A.

**Slides** from rest. Let g = s ξ', with s = 1 in a slide up and s = -1 in a slide down. Then g' = sH - 1. g starts at 0
and grows to the peak of |ξ'|. There, at the time lo, sH falls to 1 at a known phase. Then g falls until the time hi, at
which sH rises to 1 again at another known phase. The integral of g' from one phase at which sH rises to 1 to the next
is -2π(1 + sB). A slide that begins after such a phase lacks a part of the growth of g. So g at hi is at most
-2π(1 + sB), which is below zero for 1 + sB > 0. Therefore g has exactly one zero on [lo, hi], and no zero between the
start and lo. Any method that converges inside this bracket finds the switch. The depth of g below zero at hi is the
distance of this decision from the opposite decision.

The first slide of a motion may begin with ξ' ≠ 0. The end of such a slide, and of a slide with 1 + sB < LEAST_FALL, is
searched for by steps (first_zero.py).

**Impacts.** While ξ' < 0, ξ decreases strictly. So if ξ is not positive at the end of the slide, ξ has exactly one zero
before this end.

The search uses Householder's method in the form of a series. With u = g/g' and a_k = g⁽ᵏ⁾/(k! g'),

    δ = u + a2 u² + (2 a2² - a3) u³ + (5 a2³ - 5 a2 a3 + a4) u⁴

is the step back to the zero. The method converges with order five and needs one division. The derivatives cost almost
nothing, because they use the same sine and cosine. Each search begins at a guess of the duration of the slide. The
guess is the duration of the last slide of the trajectory in this direction, plus the difference of the two starts times
the derivative of the duration with respect to the start. This derivative follows from ∫ ξ'' dτ = 0 over the slide.

`kernels/__init__.py` explains the terms.
"""

import math

from vibrodrive.jit.branchless import choose, fma, full, put, wide
from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import HALF_PI, PI, TWO_PI, arc, dot
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import motion
from vibrodrive.kernels.codes import BRACKETED, NOTHING, S1, S2, S3, STICK, ZERO

LEAST_FALL = 0.01
"""Least value of 1 + sB for a search in a bracket. Below this value ξ' may be nearly 0 at hi, or may have no zero, so
the search proceeds by steps."""

PATIENCE = 24.0
"""Number of evaluations after which bisection replaces the steps by the series, so that the search certainly ends."""


@inline
def release(state, phi, a, b, rises, falls):
    """Return (h, phase, later, down) for the wait `state` that begins at the phase `phi`. a = A, b = B.

    h : duration of the wait; 0 if, because of rounding, the wait begins after its end
    phase : phase of the end: `rises` if H rises to 1, or `falls` if H falls to -1
    later : true if the end is in the next period
    down : true if the wait ends because H falls to -1
    """
    falling = (phi > HALF_PI) & (phi <= 3.0 * HALF_PI)
    down = (state == STICK) & (falling | (a <= 1.0 + b))
    target = choose(down, falls, rises)
    later = phi > choose(down, 3.0 * HALF_PI, HALF_PI)
    ahead = target - phi
    past = (ahead < 0.0) & (not later)
    h = choose(later, (TWO_PI - phi) + target, choose(past, 0.0, ahead))
    return h, choose(past, phi, target), later, down


@inline
def wait_end(w, i, state, phi):
    """Return the result of `release` for lane i."""
    return release(state, phi, w[r.A + i], w[r.B + i], w[r.PHI_UP + i], w[r.PHI_DOWN + i])


@inline
def enclose(s, phi, p, slope, rises, p_up, falls, p_down):
    """Return (lo, hi, fall) for a slide of direction s that begins at rest at `phi`, where A cos φ = p and L = slope.

    lo and hi are the ends of the bracket, and `fall` is the depth of s ξ' below 0 at hi. H rises to 1 at the phase
    `rises`, where A cos φ = p_up. H falls to -1 at the phase `falls`, where A cos φ = p_down.
    """
    up = s > 0.0
    target = choose(up, rises, falls)
    lo = choose(up, PI, 3.0 * PI) - target - phi
    lo = choose(lo >= TWO_PI, lo - TWO_PI, lo)
    hi = lo + (2.0 * target + choose(up, PI, -PI))
    lo = choose(lo > 0.0, lo, 0.0)
    return lo, hi, -s * (slope * hi + (p - choose(up, p_up, p_down)))


@inline
def bracket(w, i, s, phi, p, slope):
    """Return (lo, hi, fall, guess): the result of `enclose` for lane i, and a guess of the duration of the slide.

    The guess is computed from the last slide in the same direction.
    """
    up = s > 0.0
    # read before the choice: a conditional read would prevent vectorising
    up_began, up_lasted, up_rate = w[r.BEGAN_UP + i], w[r.LASTED_UP + i], w[r.RATE_UP + i]
    down_began, down_lasted, down_rate = w[r.BEGAN_DOWN + i], w[r.LASTED_DOWN + i], w[r.RATE_DOWN + i]
    lo, hi, fall = enclose(s, phi, p, slope, w[r.PHI_UP + i], w[r.P_UP + i], w[r.PHI_DOWN + i], w[r.P_DOWN + i])
    since = phi - choose(up, up_began, down_began)
    guess = choose(up, up_lasted, down_lasted) + choose(up, up_rate, down_rate) * since
    return lo, hi, fall, choose((guess > lo) & (guess < hi), guess, guess_end(lo, hi))


@inline
def guess_end(lo, hi):
    """Return a guess of the duration of a slide from its bracket only."""
    return lo + 0.4 * (hi - lo)


@inline
def gap_guess(x, below, h):
    """Return a guess of the zero of ξ, which falls from x at the time 0 to `below` <= 0 at the time h.

    The guess is the zero of the cubic that has these values, and the slope 0, at both times.
    """
    y = x / (x - below)
    late = y > 0.5
    share = choose(late, 1.0 - y, y)
    r = math.sqrt(choose(share > 0.0, share, 0.0) * (1.0 / 3.0))
    t = r * (1.0 + r * (1.0 / 3.0 + r * (5.0 / 18.0 + r * (8.0 / 27.0))))
    guess = h * choose(late, 1.0 - t, t)
    return choose(guess >= 0.0, guess, 0.5 * h)  # `guess` is NaN if x = below = 0


@inline
def search_in_bracket(w, k, i, s):
    """Begin the search for the end of a slide that has just begun at rest. Return `fall` of `enclose`."""
    lo, hi, fall, guess = bracket(w, i, s, w[r.PHI + i], w[r.P + i], w[r.L + i])
    set_bracket(w, k, i, True, choose(s > 0.0, S3, S2), lo, hi, guess)
    set_search_mode(w, i, True, BRACKETED)
    return fall


@inline
def search_impact(w, k, i, h, below):
    """Begin the search for the impact before h. Without the obstacle ξ would be `below` <= 0 at h."""
    set_bracket(w, k, i, True, S1, 0.0, h, gap_guess(w[r.X0 + i], below, h))
    set_search_mode(w, i, True, BRACKETED)


@inline
def rate_of(begin, end):
    """Return the derivative of the duration of a slide with respect to its start.

    `begin` and `end` are ξ'' at the beginning and at the end of the slide.
    """
    return begin / end - 1.0


@inline
def keep_guesses(w, i, slid_up, slid_down, rested, phi, h, rate):
    """Store the start `phi`, the duration h and its derivative `rate` of a slide. `bracket` computes guesses from them.

    `slid_up` and `slid_down` are masks of the direction of the slide. `rested` is a mask that clears all guesses.
    """
    w[r.BEGAN_UP + i] = choose(rested, 0.0, choose(slid_up, phi, w[r.BEGAN_UP + i]))
    w[r.BEGAN_DOWN + i] = choose(rested, 0.0, choose(slid_down, phi, w[r.BEGAN_DOWN + i]))
    w[r.LASTED_UP + i] = choose(rested, 0.0, choose(slid_up, h, w[r.LASTED_UP + i]))
    w[r.LASTED_DOWN + i] = choose(rested, 0.0, choose(slid_down, h, w[r.LASTED_DOWN + i]))
    w[r.RATE_UP + i] = choose(rested, 0.0, choose(slid_up, rate, w[r.RATE_UP + i]))
    w[r.RATE_DOWN + i] = choose(rested, 0.0, choose(slid_down, rate, w[r.RATE_DOWN + i]))


@inline
def clear_guesses(w, i):
    """Clear the data of earlier slides from which guesses are computed."""
    keep_guesses(w, i, False, False, True, 0.0, 0.0, 0.0)


@inline
def householder_step(h, lo, hi, form, sig, m, halve):
    """Do one evaluation at h in the bracket [lo, hi]. Return (next h, lo, hi, close).

    next h : estimate of the zero by the series; the midpoint of the bracket if the estimate is outside, or if `halve`
    lo, hi : ends of the new bracket
    close : true if the next h is the zero to the last bit
    """
    s, v, ds, dv, near = arc(h)
    g = sig * motion.shape(near, h, form, s, v, ds, dv)
    g1, g2, g3, g4 = motion.derivatives(h, form.d1, form.c2, form.al, form.be, s, v)
    above = g > 0.0
    lo = choose(above, h, lo)
    hi = choose(above, hi, h)
    g1 = sig * g1
    inverse = 1.0 / choose(g1 < 0.0, g1, -1e-300)
    u = g * inverse
    scaled = sig * inverse
    a2 = 0.5 * g2 * scaled
    a3 = (1.0 / 6.0) * g3 * scaled
    a4 = (1.0 / 24.0) * g4 * scaled
    ahead = h - motion.householder_series(u, a2, a3, a4)
    inside = (ahead >= lo) & (ahead <= hi) & (not halve)
    # bound of all terms of order five of the series: (m/g')⁴, (m/g')³, (m/g')² and m/g' times u⁵
    square = u * u
    e = abs(m * inverse) * square
    t2 = fma(m * inverse, m * inverse * square, 0.5 * e)
    close = (inside & (dot(t2, t2, (1.0 / 120.0) * square, e) * abs(u) <= motion.TINY * ahead)) | (
        hi - lo <= 4.0 * motion.TINY * hi + 1e-300
    )
    return choose(inside, ahead, 0.5 * (lo + hi)), lo, hi, close


@inline
def step_in_bracket(which, segment, a, b, p, q, h, lo, hi, evaluations):
    """Return the result of `householder_step` for switching function `which` of a slide.

    `evaluations` is the number of earlier evaluations. The other arguments are those of `arrive` in motion.py.
    """
    sig = choose(which == S2, -1.0, 1.0)
    m = a + 1.0 + b  # bound of the second and all higher derivatives of ξ
    form = motion.slide_shape(segment, p, q, which == S1, p)
    return householder_step(h, lo, hi, form, sig, m, evaluations > PATIENCE)


@inline
def search_bracket(w, k, i):
    """Do one evaluation in lane i, if the lane has a bracket and no outcome yet."""
    h, lo, hi = w[r.CURSOR + i], w[r.LO + i], w[r.HI + i]
    ahead, low, high, found = step_in_bracket(
        k[r.SEARCH + i], motion.segment_of(w, i), w[r.A + i], w[r.B + i], w[r.P + i], w[r.Q + i], h, lo, hi,
        w[r.WORK + i] - w[r.WORK_BOOKED + i],
    )  # fmt: skip
    on = (w[r.SEARCH_MODE + i] == BRACKETED) & (w[r.OUTCOME + i] == NOTHING)
    put(w, r.CURSOR + i, on, ahead)
    put(w, r.LO + i, on, low)
    put(w, r.HI + i, on, high)
    put(w, r.OUTCOME + i, on & found, ZERO)
    w[r.WORK + i] += choose(on, 1.0, 0.0)


@inline
def search_one_bracket(w, k, i, most):
    """Do up to `most` evaluations in registers in lane i, which has a bracket, until a zero is found."""
    segment, which = motion.segment_of(w, i), k[r.SEARCH + i]
    a, b, p, q = w[r.A + i], w[r.B + i], w[r.P + i], w[r.Q + i]
    h, lo, hi, before = w[r.CURSOR + i], w[r.LO + i], w[r.HI + i], w[r.WORK + i] - w[r.WORK_BOOKED + i]
    found, steps = False, 0
    while steps < most and not found:
        h, lo, hi, found = step_in_bracket(which, segment, a, b, p, q, h, lo, hi, before + float(steps))
        steps += 1
    w[r.CURSOR + i], w[r.LO + i], w[r.HI + i] = h, lo, hi
    w[r.OUTCOME + i] = ZERO if found else NOTHING
    w[r.WORK + i] += float(steps)


@part
def search_brackets(w, k, n, evaluations):
    """Do up to `evaluations` evaluations in each of the lanes 0..n-1 with a bracket, until the lane has an outcome.

    First clear the outcomes of all lanes. Return the number of lanes with a bracket.
    """
    wide()
    total = 0
    m = full(n)
    for i in range(m):
        w[r.OUTCOME + i] = NOTHING
        total += choose((i < n) & (w[r.SEARCH_MODE + i] == BRACKETED), 1, 0)
    for _ in range(evaluations):
        for i in range(m):
            search_bracket(w, k, i)
    return total


@inline
def set_bracket(w, k, i, where, which, lo, hi, cursor):
    """Set the search in lane i for the only zero of switching function `which` between lo and hi."""
    put(w, r.LO + i, where, lo)
    put(w, r.HI + i, where, hi)
    put(w, r.CURSOR + i, where, cursor)
    put(k, r.SEARCH + i, where, which)


@inline
def set_search_mode(w, i, where, mode):
    """Set the search mode in lane i: STEPPED, BRACKETED or AT_ONCE."""
    put(w, r.SEARCH_MODE + i, where, mode)


@inline
def set_side(w, i, where, down):
    """Set the side of S4 at which a wait with a known end ends: H = -1 if `down`, otherwise H = 1."""
    put(w, r.SIG + i, where, choose(down, 1.0, -1.0))
