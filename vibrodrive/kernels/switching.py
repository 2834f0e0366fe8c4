"""Switching functions S1-S5, eq. (8), as shapes, and how a search for the first zero of one begins.

Each switching function is positive while its state lasts and is searched for its first zero:

    S1 =  ξ          sliding down ends in an impact
    S2 = -ξ'         sliding down ends in the air
    S3 =  ξ'         sliding up ends
    S4 = 1 ∓ H       sticking ends (two sides, searched in turn)
    S5 = 1 - H       resting at the obstacle ends

As shapes (motion.py) they are  BASE + SIG · (c0 + c1 h + c2 h² + α sin h + β vers h + fast).
"""

from __future__ import annotations

from typing import NamedTuple

from vibrodrive.jit.branchless import choose
from vibrodrive.jit.compile import inline
from vibrodrive.kernels.codes import (
    INFINITY,
    S1,
    S2,
    S3,
    S4,
    UNKNOWN,
)
from vibrodrive.kernels.lane import (
    AF,
    AL,
    ALF,
    BASE,
    BE,
    BEF,
    BEFORE,
    C0,
    C1,
    C2,
    CURSOR,
    D1,
    D2,
    DIP_DENOMINATOR,
    ETA,
    FALL_TOLERANCE,
    FAST_AMPLITUDE,
    INVERSE,
    LAST_NONNEGATIVE,
    LIMIT,
    M2_SLOW,
    M3,
    MARGIN,
    NOISE,
    OTHER,
    PF,
    QF,
    SEARCH,
    SIG,
    SPAN,
    SPAN0,
    VALUE,
    WATCHED_GAP,
    X0,
    XALF,
    XBEF,
    A,
    B,
    P,
    Q,
)
from vibrodrive.kernels.motion import segment_of, slide_shape

NOISE_SHARE = 1e-13
"""Values of a switching function below this share of its terms are not trusted to have a sign when grid
points are skipped. Four hundred times the rounding of one term: a larger share only costs a few more visits."""

LATE_SHARE = 4e-3
"""What the rounding of a grid point's time does to the fast part, a η ulp(h), in units of NOISE_SHARE."""


class Search(NamedTuple):
    """A switching function as a shape, sig · (…) + base, and what its search needs: the amplitude of its fast part,
    bounds of its second (without that part) and third derivatives, the first span to try (first_zero.py), and the
    value below which no grid point is skipped."""

    c0: float
    d1: float
    d2: float
    c1: float
    c2: float
    al: float
    be: float
    alf: float
    bef: float
    base: float
    sig: float
    fast: float
    m2: float
    m3: float
    span: float
    noise: float


@inline
def search_shape(w, i, which, limit):
    """Switching function `which`, eq. (8), of the segment under way in lane i, to be searched up to `limit`."""
    gap, force = which == S1, which >= S4
    eta, inverse = w[ETA + i], w[INVERSE + i]
    p, q, pf, qf, xalf, xbef, af = w[P + i], w[Q + i], w[PF + i], w[QF + i], w[XALF + i], w[XBEF + i], w[AF + i]
    rate = p + eta * pf
    c0, d1, d2, c1, c2, al, be = slide_shape(segment_of(w, i), p, q, gap, rate)
    c0 = choose(force, q + qf - w[B + i], c0)
    d1 = choose(force, rate, d1)
    d2 = choose(force, -0.5 * (q + eta * eta * qf), d2)
    c1 = choose(force, 0.0, c1)
    al = choose(force, p, al)
    be = choose(force, -q, be)
    alf = choose(gap, xalf, choose(force, pf, eta * xbef))
    bef = choose(gap, xbef, choose(force, -qf, -eta * xalf))
    base = choose(force, 1.0, 0.0)
    sig = choose(gap | (which == S3), 1.0, -1.0)
    a = af * choose(gap, inverse * inverse, choose(force, 1.0, inverse))
    fast = a * eta * eta
    m2 = 2.0 * abs(c2) + w[A + i] + 1e-300  # never zero: it divides
    m3 = w[A + i] + fast * eta
    span = choose(a > 0.0, (w[A + i] + fast) / (m3 + 1e-300), 1.0)
    drift = (abs(c1) + abs(c2) * limit) * limit
    noise = NOISE_SHARE * (base + abs(c0) + 2.0 * (abs(al) + abs(be) + a) + drift + LATE_SHARE * a * eta * limit)
    return Search(c0, d1, d2, c1, c2, al, be, alf, bef, base, sig, a, m2, m3, span, noise)


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
    w[C0 + i] = choose(where, search.c0, w[C0 + i])
    w[D1 + i] = choose(where, search.d1, w[D1 + i])
    w[D2 + i] = choose(where, search.d2, w[D2 + i])
    w[C1 + i] = choose(where, search.c1, w[C1 + i])
    w[C2 + i] = choose(where, search.c2, w[C2 + i])
    w[AL + i] = choose(where, search.al, w[AL + i])
    w[BE + i] = choose(where, search.be, w[BE + i])
    w[ALF + i] = choose(where, search.alf, w[ALF + i])
    w[BEF + i] = choose(where, search.bef, w[BEF + i])
    w[BASE + i] = choose(where, search.base, w[BASE + i])
    w[SIG + i] = choose(where, search.sig, w[SIG + i])
    w[FAST_AMPLITUDE + i] = choose(where, search.fast, w[FAST_AMPLITUDE + i])
    w[M2_SLOW + i] = choose(where, search.m2, w[M2_SLOW + i])
    w[M3 + i] = choose(where, search.m3, w[M3 + i])
    w[SPAN0 + i] = choose(where, search.span, w[SPAN0 + i])
    w[SPAN + i] = choose(where, search.span, w[SPAN + i])
    w[NOISE + i] = choose(where, search.noise, w[NOISE + i])
    w[CURSOR + i] = choose(where, cursor, w[CURSOR + i])
    w[OTHER + i] = choose(where, choose(which == S4, 0.0, INFINITY), w[OTHER + i])
    w[LAST_NONNEGATIVE + i] = choose(where, 0.0, w[LAST_NONNEGATIVE + i])
    w[WATCHED_GAP + i] = choose(where, choose(falling, w[X0 + i], INFINITY), w[WATCHED_GAP + i])
    w[FALL_TOLERANCE + i] = choose(where, choose(falling, w[MARGIN + i], INFINITY), w[FALL_TOLERANCE + i])
    w[DIP_DENOMINATOR + i] = choose(where, 0.0, w[DIP_DENOMINATOR + i])
    k[SEARCH + i] = choose(where, which, k[SEARCH + i])


@inline
def set_limit(w, i, where, limit):
    """How far the search in lane i may go."""
    w[LIMIT + i] = choose(where, limit, w[LIMIT + i])


@inline
def clear_dip(w, i):
    """No tangency has been met yet."""
    w[DIP_DENOMINATOR + i] = 0.0


@inline
def unknown_values(w, i, where):
    """No value of the switching function is known at the grid points around the cursor."""
    w[VALUE + i] = choose(where, UNKNOWN, w[VALUE + i])
    w[BEFORE + i] = choose(where, UNKNOWN, w[BEFORE + i])


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
    w[FALL_TOLERANCE + i] = choose(where & (which == S2), 0.0, w[FALL_TOLERANCE + i])
    w[OTHER + i] = choose(where & (which == S4), 1.0, w[OTHER + i])


@inline
def turn_side(w, i):
    """Go over to the other side of S4, on a grid."""
    w[SIG + i] = -w[SIG + i]
    unknown_values(w, i, True)
