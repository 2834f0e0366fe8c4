"""The scheme of Fig. 2: switching functions S1-S5, eq. (8), and the decisions between states.

Each switching function is positive while its state lasts and is searched for its first zero:

    S1 =  ξ          sliding down ends in an impact
    S2 = -ξ'         sliding down ends in the air
    S3 =  ξ'         sliding up ends
    S4 = 1 ∓ H       sticking ends (two sides, searched in turn)
    S5 = 1 - H       resting at the obstacle ends

As shapes (motion.py) they are  BASE + SIG · (c0 + c1 h + c2 h² + α sin h + β vers h + fast).
"""

from __future__ import annotations

from vibrodrive._jit import inline
from vibrodrive.branchless import choose
from vibrodrive.lane import (
    A0,
    ABOVE,
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
    D1,
    D2,
    DIP,
    ETA,
    INVERSE,
    M2S,
    M3,
    MARGIN,
    NEAR_UNDER,
    NOISE,
    OTHER,
    PF,
    QF,
    RF,
    SEARCH,
    SIG,
    SPAN,
    SPAN0,
    V0,
    VALUE,
    WATCH,
    X0,
    XALF,
    XBEF,
    XC1,
    XC2,
    XD2,
    A,
    B,
    H,
    L,
    P,
    Q,
)
from vibrodrive.parameters import State

UP, DOWN, STICK, REST, IMPACT = (int(s) for s in State)
S1, S2, S3, S4, S5 = 1, 2, 3, 4, 5

INFINITY, UNKNOWN = float("inf"), float("nan")

TRANSITIONS = (
    # state, switching function, what decides, next state
    (State.UP, "S3", "H < -1", State.DOWN),
    (State.UP, "S3", "|H| <= 1", State.STICK),
    (State.DOWN, "S1", "", State.IMPACT),
    (State.DOWN, "S2", "H > 1", State.UP),
    (State.DOWN, "S2", "|H| <= 1", State.STICK),
    (State.STICK, "S4", "H = 1", State.UP),
    (State.STICK, "S4", "H = -1", State.DOWN),
    (State.REST, "S5", "", State.UP),
    (State.IMPACT, "", "H > 1", State.UP),
    (State.IMPACT, "", "H <= 1", State.REST),
)
"""Fig. 2 as a table; `decide_in_air` and `decide_at_obstacle` are its third column."""

NOISE_SHARE = 1e-13
"""Values of a switching function below this share of its terms are not trusted to have a sign when grid
points are skipped. Four hundred times the rounding of one term: a larger share only costs a few more visits."""

LATE_SHARE = 4e-3
"""What the rounding of a grid point's time does to the fast part, a η ulp(h), in units of NOISE_SHARE."""


@inline
def decide_in_air(h):
    """Next state where ξ' = 0 and ξ > 0. After a correct switch one of the two slides is impossible;
    the fixed path may well meet it, and then the mass goes on from rest (§5)."""
    return choose(h > 1.0, UP, choose(h < -1.0, DOWN, STICK))


@inline
def decide_at_obstacle(h):
    """Next state after an impact: the obstacle carries whatever pushes towards it."""
    return choose(h > 1.0, UP, REST)


@inline
def ended_by(state):
    """The switching function whose first zero ends a state; sliding down, the one looked for first."""
    return choose(state == UP, S3, choose(state == DOWN, S2, choose(state == STICK, S4, S5)))


@inline
def can_leave(w, i, state):
    """Whether H can reach a boundary of the wait at all: |H + B| never exceeds A + AF."""
    reach = w[A + i] + w[AF + i]
    return (reach > 1.0 + w[B + i]) | ((state == STICK) & (reach > abs(1.0 - w[B + i])))


@inline
def slide_shape(w, i, gap, rate):
    """(c0, d1, d2, c1, c2, α, β) of ξ, if `gap`, or else of ξ', sliding; H' = `rate` at the start."""
    x0, v0, a0, slope, p, q = w[X0 + i], w[V0 + i], w[A0 + i], w[L + i], w[P + i], w[Q + i]
    xd2, xc1, xc2 = w[XD2 + i], w[XC1 + i], w[XC2 + i]
    return (
        choose(gap, x0, v0), choose(gap, v0, a0), choose(gap, xd2, 0.5 * rate),
        choose(gap, xc1, slope), choose(gap, xc2, 0.0), choose(gap, -p, q), choose(gap, q, p),
    )  # fmt: skip


@inline
def aimed(w, i, which, limit):
    """Switching function `which` as a shape, and the bounds of its derivatives:

    (c0, d1, d2, c1, c2, α, β, α_f, β_f, base, sig, a, M2, M3, span, noise); a bounds the fast part, span is the first
    to try (locate.py), noise what grid points may be skipped by, `limit` how far the search may go.
    """
    gap, force = which == S1, which >= S4
    eta, inverse = w[ETA + i], w[INVERSE + i]
    p, q, pf, qf, xalf, xbef, af = w[P + i], w[Q + i], w[PF + i], w[QF + i], w[XALF + i], w[XBEF + i], w[AF + i]
    rate = p + eta * pf
    c0, d1, d2, c1, c2, al, be = slide_shape(w, i, gap, rate)
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
    return c0, d1, d2, c1, c2, al, be, alf, bef, base, sig, a, m2, m3, span, noise


@inline
def aim(w, k, i, which, limit):
    """Search for the first zero of S1 ... S5 from the present switch on.

    S1 = ξ, S2 = -ξ', S3 = ξ', S5 = 1 - H; both sides of S4 = 1 - |H|: the one whose cursor is behind is searched next.

    While the mass slides down ξ is watched beside S2: it decreases strictly while ξ' < 0, so S1 has a zero before the
    first zero of S2 exactly when ξ there is not positive, and it is then unique. The watch ends the search early once
    ξ is further below 0 than any margin met so far: the impact is certain then, and its margin no longer the
    smallest.
    """
    (
        w[C0 + i], w[D1 + i], w[D2 + i], w[C1 + i], w[C2 + i], w[AL + i], w[BE + i], w[ALF + i], w[BEF + i],
        w[BASE + i], w[SIG + i], w[RF + i], w[M2S + i], w[M3 + i], w[SPAN0 + i], w[NOISE + i],
    ) = aimed(w, i, which, limit)  # fmt: skip
    w[SPAN + i] = w[SPAN0 + i]
    w[H + i] = 0.0
    w[OTHER + i] = 0.0 if which == S4 else INFINITY
    w[ABOVE + i] = 0.0
    w[WATCH + i] = w[X0 + i] if which == S2 else INFINITY
    w[DIP + i] = w[MARGIN + i] if which == S2 else INFINITY
    w[NEAR_UNDER + i] = 0.0
    w[VALUE + i] = w[BEFORE + i] = UNKNOWN
    k[SEARCH + i] = which
