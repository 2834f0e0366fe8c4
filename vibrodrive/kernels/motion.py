"""Closed form of the motion between two switches, eqs. (1), (2), (4), (5), (9), relative to the last switch.

With h = τ - τ_i, φ = τ_i mod 2π, θ = η τ_i mod 2π and AF = A ε η²,

    P = A cos φ,   Q = A sin φ,   PF = AF cos θ,   QF = AF sin θ,      H_i = Q + QF - B
    H  = H_i + P sin h - Q vers h + PF sin ηh - QF vers ηh
    ξ' = v + L h + Q sin h + P vers h + (QF sin ηh + PF vers ηh) / η
    ξ  = x + (v + P + PF/η) h + L h²/2 - P sin h + Q vers h - (PF sin ηh - QF vers ηh) / η²

where vers h = 1 - cos h, L = -(B + s), and s = ±1 while sliding up / down; x and v are ξ and ξ' at τ_i. This is the
solution of the paper with its constants inserted. H, ξ' and ξ have the same form, here called a *shape*:

    c0 + c1 h + c2 h² + α sin h + β vers h + α_f sin ηh + β_f vers ηh

Its last two terms are the fast part. Every switching function is a shape, too, so one routine searches for the zeros of
all switching functions. If h and ηh are below π/4, the linear part of each sine and the quadratic part of each versine
are first added to the coefficients, in which they cancel exactly:

    c0 + d1 h + d2 h² + α (sin h - h) + β (vers h - h²/2) + ...

A slide from rest after a wait begins with ξ' = ξ'' = 0. d1 is then set to 0 and not computed. So the relative accuracy
of ξ and ξ' is full from the beginning, and not limited by the rounding error of A.

Time is (number of periods n, phase φ, phase θ), so it is as accurate after a million periods as after one.
`kernels/__init__.py` explains the terms.
"""

from typing import NamedTuple

import numpy as np

from vibrodrive.jit.branchless import choose, fma, put, real
from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import PI, TWO_PI, TWO_PI_LOW, arc, arc_of_product, dot, sincos, turns, two_product
from vibrodrive.kernels import lane as r

FAR = 0.8
"""From this h on, the change of ξ since the last switch is not small compared with the terms of its closed form. So
`arrive_far` can subtract sines and cosines without loss of digits."""


STRETCH = 4.0 * PI
"""Longest duration of a segment. A longer state is divided into several segments, so that h and ηh remain small enough
for an exact result."""


LONGEST_SCAN = 4194304.0
"""Largest number of grid points of a segment. Longer states are divided, so that the budget is checked in between."""


@inline
def longest(w, i):
    """Return the longest duration of a segment."""
    return choose(w[r.ETA + i] * STRETCH > 1e6, 1e6 * w[r.INVERSE + i], STRETCH)


@inline
def grid_steps(w, i, left):
    """Return the number of grid steps to the limit of a search.

    The limit is the end of the record, after the time `left`, or the end of the longest segment, whichever is first.
    """
    steps, last = np.floor(longest(w, i) / w[r.DTAU + i]), np.ceil(left / w[r.DTAU + i])
    steps = choose(steps < LONGEST_SCAN, steps, LONGEST_SCAN)
    steps = choose(steps < last, steps, last)
    return choose(steps > 1.0, steps, 1.0)


@inline
def shape(near, h, form, s, v, ds, dv):
    """Return the slow part of a shape at h with the coefficients `form`; s, v, ds, dv, near are those of `arc(h)`."""
    linear = form.d1 if near else form.c1
    square = form.d2 if near else form.c2
    return form.c0 + fma(fma(square, h, linear), h, dot(form.al, ds if near else s, form.be, dv if near else v))


@inline
def derivatives(h, d1, c2, al, be, s, v):
    """Return the first four derivatives at h of the slow part of a shape (`Form`); s = sin h, v = vers h."""
    c = 1.0 - v
    first, second = dot(al, c, be, s), dot(be, c, -al, s)  # derivatives of α sin h + β vers h
    return d1 + fma(2.0 * c2, h, dot(be, s, -al, v)), fma(2.0, c2, second), -first, -second


TINY = 1.2e-16  # share of h: a smaller step does not change h, and a smaller error is within the rounding of h


@inline
def householder_series(u, a2, a3, a4):
    """Return δ such that g(h - δ) = 0 up to terms of order five in u = g/g', where a_k = g⁽ᵏ⁾/(k! g').

    undisturbed.py gives the series.
    """
    square = a2 * a2
    return fma(u * u, fma(u, fma(u, fma(5.0 * a2, square - a3, a4), fma(2.0, square, -a3)), a2), u)


@inline
def fast_part(near, alf, bef, s, v, ds, dv):
    """Return the fast part of a shape at h; s, v, ds, dv, near are those of `arc_of_product(η, h)`."""
    return dot(alf, ds if near else s, bef, dv if near else v)


class Form(NamedTuple):
    """Coefficients of the slow part of a shape: c0; d1 and d2, used for small h; c1 and c2, used otherwise; α and β."""

    c0: float
    d1: float
    d2: float
    c1: float
    c2: float
    al: float
    be: float


class Field(NamedTuple):
    """Excitation at the beginning of a segment: A cos φ, A sin φ, AF cos θ, AF sin θ."""

    p: float
    q: float
    pf: float
    qf: float


class Segment(NamedTuple):
    """Closed form of a segment: ξ, ξ' and ξ'' at its beginning, L, and the coefficients d2, c1, c2, α_f, β_f of ξ."""

    x: float
    v: float
    a0: float
    slope: float
    xd2: float
    xc1: float
    xc2: float
    xalf: float
    xbef: float


@inline
def segment_of(w, i):
    """Return the present segment of lane i."""
    return Segment(
        w[r.X0 + i], w[r.V0 + i], w[r.A0 + i], w[r.L + i],
        w[r.XD2 + i], w[r.XC1 + i], w[r.XC2 + i], w[r.XALF + i], w[r.XBEF + i],
    )  # fmt: skip


@inline
def slide_shape(segment, p, q, gap, rate):
    """Return the coefficients of ξ (if `gap`) or of ξ' in a slide; p = A cos φ, q = A sin φ, rate = H' at its start."""
    return Form(
        choose(gap, segment.x, segment.v), choose(gap, segment.v, segment.a0), choose(gap, segment.xd2, 0.5 * rate),
        choose(gap, segment.xc1, segment.slope), choose(gap, segment.xc2, 0.0), choose(gap, -p, q), choose(gap, q, p),
    )  # fmt: skip


@inline
def slide_at(segment, p, q, rate, near, h, s, v, ds, dv):
    """Return (x, v): the slow parts of ξ and ξ' at h in a slide, by eqs. (4), (5) and their derivatives.

    s, v, ds, dv, near are the results of `arc(h)`. The other arguments are those of `slide_shape`.
    """
    x = shape(near, h, slide_shape(segment, p, q, True, rate), s, v, ds, dv)
    return x, shape(near, h, slide_shape(segment, p, q, False, rate), s, v, ds, dv)


@inline
def state_at(w, i, h, fast):
    """Return (ξ, ξ') in a slide, h after the last switch, by eqs. (4), (5), (9) and their derivatives.

    `fast` is true with a disturbance.
    """
    eta, p = w[r.ETA + i], w[r.P + i]
    s, v, ds, dv, near = arc(h)
    if fast:
        sf, vf, dsf, dvf, near_fast = arc_of_product(eta, h)
        near = near & near_fast
    x, dx = slide_at(segment_of(w, i), p, w[r.Q + i], p + eta * w[r.PF + i], near, h, s, v, ds, dv)
    if fast:
        x += fast_part(near, w[r.XALF + i], w[r.XBEF + i], sf, vf, dsf, dvf)
        dx += fast_part(near, eta * w[r.XBEF + i], -eta * w[r.XALF + i], sf, vf, dsf, dvf)
    return x, dx


@inline
def section_at(w, i, h):
    """Return (ξ, ξ') at a section instant, h after the last switch, at ε = 0.

    This function uses the stored values of A sin φ_s and A cos φ_s.
    """
    linear = fma(w[r.XC2 + i], h, w[r.XC1 + i])
    return (
        w[r.X0 + i] + fma(linear, h, w[r.Q + i] - w[r.SIN_S + i]),
        w[r.V0 + i] + fma(w[r.L + i], h, w[r.P + i] - w[r.COS_S + i]),
    )


@inline
def force_at(w, i, h):
    """Return the adhesive force H at h after the last switch, eq. (2)."""
    s, v, _, _, _ = arc(h)
    sf, vf, _, _, _ = arc_of_product(w[r.ETA + i], h)
    return (w[r.Q + i] + w[r.QF + i] - w[r.B + i]) + (
        dot(w[r.P + i], s, -w[r.Q + i], v) + dot(w[r.PF + i], sf, -w[r.QF + i], vf)
    )


@inline
def excitation(a, phi, low):
    """Return (a cos(φ + low), a sin(φ + low)) for a tiny `low`."""
    s, c = sincos(phi)
    return a * fma(-s, low, c), a * fma(c, low, s)


@inline
def fast_phase(eta, frac, period, phi, low):
    """Return θ = η (2πn + φ) mod 2π at the phase φ + low of period n; `frac` is the fractional part of η.

    Complete turns of θ are removed before any rounding: 2πnη mod 2π is 2π times the fractional part of n · frac, and
    `two_product` gives this product exactly.
    """
    p, e = two_product(period, frac)
    turn = (p - np.floor(p)) + e
    p, e = two_product(eta, phi)
    _, theta, _ = turns(p, fma(turn, TWO_PI, fma(eta, low, e)))
    return theta


@inline
def advance_phase(phi, low, h):
    """Return (n, φ, low) at the time h after (φ, low); n is the number of periods that have begun since then.

    The rounding error of φ + h is added to low.
    """
    s = phi + h
    back = s - phi
    return turns(s, low + ((phi - (s - back)) + (h - back)))


@inline
def fast_excitation(w, i, period, phi, low):
    """Return (θ, AF cos θ, AF sin θ) at the phase φ + low of a period."""
    theta = fast_phase(w[r.ETA + i], w[r.FRAC + i], period, phi, low)
    pf, qf = excitation(w[r.AF + i], theta, 0.0)
    return theta, pf, qf


@inline
def evaluate_excitation(w, i, period, phi, low):
    """Return (A cos φ, A sin φ, θ, AF cos θ, AF sin θ) at the phase φ + low of a period.

    Without a disturbance the last three numbers are 0.
    """
    p, q = excitation(w[r.A + i], phi, low)
    theta, pf, qf = 0.0, 0.0, 0.0
    if w[r.AF + i] > 0.0:
        theta, pf, qf = fast_excitation(w, i, float(period), phi, low)
    return p, q, theta, pf, qf


@inline
def adhesive_force(w, i, q, qf):
    """Return H = A sin τ + A ε η² sin ητ - B, eq. (2), from its first two terms q and qf."""
    return q + qf - w[r.B + i]


class Arrival(NamedTuple):
    """Motion and excitation at the end of a segment.

    x, v : ξ and ξ'
    turned : number of periods that have begun during the segment
    phi, low : phase φ and its low-order part
    p, q : A cos φ and A sin φ
    theta, pf, qf : θ = ητ mod 2π, AF cos θ and AF sin θ; 0 without a disturbance
    """

    x: float
    v: float
    turned: float
    phi: float
    low: float
    p: float
    q: float
    theta: float
    pf: float
    qf: float


@inline
def arrive(segment, a, phi, low, p, q, h):
    """Return the arrival at ε = 0, at the time h after (φ, low), for any h >= 0. a = A, p = A cos φ, q = A sin φ."""
    s, v, ds, dv, near = arc(h)
    x1, v1 = slide_at(segment, p, q, p, near, h, s, v, ds, dv)
    turned, phi1, _ = advance_phase(phi, low, h)
    p1, q1 = excitation(a, phi1, 0.0)
    return Arrival(x1, v1, turned, phi1, 0.0, p1, q1, 0.0, 0.0, 0.0)


@inline
def arrive_far(segment, a, phi, low, p, q, h):
    """Return the same as `arrive`, but only for h >= FAR. This function needs only one sine and one cosine."""
    n, phi = advance_phase_short(phi, low, h)
    p1, q1 = excitation(a, phi, 0.0)
    x = segment.x + fma(fma(segment.xc2, h, segment.xc1), h, q - q1)
    v = segment.v + fma(segment.slope, h, p - p1)
    return Arrival(x, v, n, phi, 0.0, p1, q1, 0.0, 0.0, 0.0)


@inline
def propagate_undisturbed(w, i, h):
    """Return the arrival of lane i at ε = 0, at the time h >= FAR after the last switch."""
    return arrive_far(segment_of(w, i), w[r.A + i], w[r.PHI + i], w[r.LOW + i], w[r.P + i], w[r.Q + i], h)


@inline
def advance_phase_short(phi, low, h):
    """Return (n, φ) of `advance_phase` for a time h < 4π. n TWO_PI is exact, because n <= 2.

    At ε = 0 the low-order part of φ is dropped at every switch. So a motion that returns to the same φ repeats itself
    (recurrence.py).
    """
    s = phi + h
    back = s - phi
    small = low + ((phi - (s - back)) + (h - back))
    n = choose(s >= 2.0 * TWO_PI, 2.0, choose(s >= TWO_PI, 1.0, 0.0))
    return n, fma(-n, TWO_PI, s) + fma(-n, TWO_PI_LOW, small)


@inline
def propagate_disturbed(w, k, i, h):
    """Return the arrival of lane i with a disturbance, at the time h after the last switch."""
    x, v = state_at(w, i, h, True)
    turned, phi, low = advance_phase(w[r.PHI + i], w[r.LOW + i], h)
    p, q = excitation(w[r.A + i], phi, low)
    theta, pf, qf = fast_excitation(w, i, real(k[r.PERIOD + i]) + turned, phi, low)
    return Arrival(x, v, turned, phi, low, p, q, theta, pf, qf)


NEAR_BOUNDARY = 1e-8  # largest change of φ and of θ, in radians, by which the end of a wait is corrected


@inline
def on_boundary(w, i, where, there, level, h):
    """Return (arrival, LATE) at the end of a wait that has lasted h, with a disturbance.

    `there` is the arrival at the cursor. The result is the arrival at the instant near it at which H = `level`. This
    instant is exact to the last bit of φ + low.

    The rounding error of the cursor is multiplied by η in θ. Without the correction, the next slide would begin with
    ξ'' = 0, but with the H' of another instant. The correction is one step of Newton's method. The sines and cosines of
    the excitation (p, q, pf, qf) are updated to first order. LATE · ROUNDING is the remaining error of the time, caused
    by the rounding of H (margins.py). If `where` is false, the arrival is `there` and LATE is 0.

    The end is moved back by at most h, so that time does not decrease. φ is the double next to φ + low, so that an
    event immediately after the end is not recorded before the end.
    """
    eta = w[r.ETA + i]
    rate = there.p + eta * there.pf
    inverse = 1.0 / choose(rate == 0.0, 1e-300, rate)
    shift = (level - adhesive_force(w, i, there.q, there.qf)) * inverse
    near = where & (abs(eta * shift) < NEAR_BOUNDARY) & (abs(shift) < NEAR_BOUNDARY)
    shift = choose(near, choose(shift > -h, shift, -h), 0.0)
    fast = eta * shift
    turned, phi, low = turns(there.phi, there.low + shift)
    moved = Arrival(
        there.x, there.v, there.turned + turned, phi, low,
        fma(-there.q, shift, there.p), fma(there.p, shift, there.q), there.theta + fast,
        fma(-there.qf, fast, there.pf), fma(there.pf, fast, there.qf),
    )  # fmt: skip
    return moved, choose(where, (1.0 + w[r.A + i] + w[r.AF + i] + w[r.B + i]) * abs(inverse), 0.0)


@part
def propagate(w, k, i, wait_ends, level):
    """Return (arrival, LATE) at the cursor of lane i, with a disturbance or without.

    If a wait ends at the cursor (`wait_ends`), `on_boundary` corrects the time and the excitation of the arrival. ξ and
    ξ' are computed as if the mass were sliding, so they are not valid at the end of a wait.
    """
    h = w[r.CURSOR + i]
    if w[r.AF + i] > 0.0:
        return on_boundary(w, i, wait_ends, propagate_disturbed(w, k, i, h), level, h)
    there = propagate_undisturbed(w, i, h)
    if h < FAR or there.phi < 0.0 or there.phi >= TWO_PI:
        there = arrive(segment_of(w, i), w[r.A + i], w[r.PHI + i], w[r.LOW + i], w[r.P + i], w[r.Q + i], h)
    return there, 0.0


@inline
def arrive_later(w, k, i, x, v, h):
    """Return the arrival at h, with ξ = x and ξ' = v, on a grid that begins at the last switch.

    At ε = 0 the low-order part of φ is 0.
    """
    turned, phi, low = advance_phase(w[r.PHI + i], w[r.LOW + i], h)
    low = low if w[r.AF + i] > 0.0 else 0.0
    return Arrival(x, v, turned, phi, low, *evaluate_excitation(w, i, k[r.PERIOD + i] + int(turned), phi, low))


@inline
def grid_time(w, k, i, steps):
    """Return (period, φ, low) of grid point k = `steps`, from τ = τ0 + kΔτ. Steps Δτ are never accumulated."""
    p, e = two_product(float(steps), w[r.DTAU + i])
    n, phi, low = turns(p, e)
    more, phi, low = advance_phase(w[r.PHI0 + i], low, phi)
    return k[r.PERIOD0 + i] + int(n + more), phi, low


@inline
def commit_grid(k, i, where, steps):
    """Set the number of the present grid point in lane i."""
    put(k, r.GRID + i, where, steps)


@inline
def arrive_on_grid(w, k, i, x, v, steps):
    """Add `steps` to the number of the grid point in lane i. Return the arrival there, with ξ = x and ξ' = v."""
    commit_grid(k, i, True, k[r.GRID + i] + int(steps))
    period, phi, low = grid_time(w, k, i, k[r.GRID + i])
    return Arrival(x, v, float(period - k[r.PERIOD + i]), phi, low, *evaluate_excitation(w, i, period, phi, low))


@inline
def propagate_on_grid(w, k, i, h, steps):
    """Return the arrival with a disturbance at grid point number `steps`, which is h after the last switch."""
    x, v = state_at(w, i, h, True)
    period, phi, low = grid_time(w, k, i, steps)
    p, q = excitation(w[r.A + i], phi, low)
    theta, pf, qf = fast_excitation(w, i, float(period), phi, low)
    return Arrival(x, v, float(period - k[r.PERIOD + i]), phi, low, p, q, theta, pf, qf)


@inline
def time_between(period, phi, low, to_period, to_phase):
    """Return the time from (period, φ, low) to (to_period, to_phase)."""
    return real(to_period - period) * TWO_PI + ((to_phase - phi) - low)


@inline
def time_until(w, k, i, period, phase):
    """Return the time from the last switch to (period, phase)."""
    return time_between(k[r.PERIOD + i], w[r.PHI + i], w[r.LOW + i], period, phase)
