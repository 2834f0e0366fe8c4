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
    C0,
    C1,
    C2,
    D1,
    D2,
    DIP,
    ETA,
    LIMIT,
    M2S,
    M3,
    MARGIN,
    NEAR_UNDER,
    NOISE,
    OTHER,
    PF,
    PHI,
    PHI_DOWN,
    PHI_UP,
    QF,
    RF,
    SEARCH,
    SIG,
    SPAN,
    SPAN0,
    V0,
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
from vibrodrive.trig import PI, TWO_PI

UP, DOWN, STICK, REST, IMPACT = (int(s) for s in State)
S1, S2, S3, S4, S5 = 1, 2, 3, 4, 5

INFINITY = float("inf")

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
def can_leave(w, i, state):
    """Whether H can reach a boundary of the wait at all: |H + B| never exceeds A + AF."""
    reach = w[A + i] + w[AF + i]
    return (reach > 1.0 + w[B + i]) | ((state == STICK) & (reach > abs(1.0 - w[B + i])))


@inline
def _start(w, k, i, which, base, sig, a, noise):
    """Common to all searches; `a` bounds the fast part of the shape."""
    w[BASE + i] = base
    w[SIG + i] = sig
    w[SPAN + i] = w[SPAN0 + i]
    if a > 0.0:
        eta = w[ETA + i]
        fast = a * eta * eta
        w[RF + i] = a
        w[M2S + i] = 2.0 * abs(w[C2 + i]) + w[A + i] + 1e-300  # never zero: it divides
        w[M3 + i] = w[A + i] + fast * eta
        w[SPAN0 + i] = (w[A + i] + fast) / w[M3 + i]
        w[SPAN + i] = w[SPAN0 + i]
    w[NOISE + i] = NOISE_SHARE * (base + abs(w[C0 + i]) + 2.0 * (abs(w[AL + i]) + abs(w[BE + i]) + a) + noise)
    w[H + i] = 0.0
    w[OTHER + i] = INFINITY
    w[ABOVE + i] = 0.0
    w[WATCH + i] = INFINITY
    w[DIP + i] = INFINITY
    w[NEAR_UNDER + i] = 0.0
    k[SEARCH + i] = which


@inline
def aim_gap(w, k, i, limit):
    """S1 = ξ."""
    w[C0 + i] = w[X0 + i]
    w[D1 + i] = w[V0 + i]
    w[D2 + i] = w[XD2 + i]
    w[C1 + i] = w[XC1 + i]
    w[C2 + i] = w[XC2 + i]
    w[AL + i] = -w[P + i]
    w[BE + i] = w[Q + i]
    w[ALF + i] = w[XALF + i]
    w[BEF + i] = w[XBEF + i]
    eta = w[ETA + i]
    a = w[AF + i] / (eta * eta) if w[AF + i] > 0.0 else 0.0
    _start(w, k, i, S1, 0.0, 1.0, a, (abs(w[C1 + i]) + abs(w[C2 + i]) * limit) * limit)


@inline
def aim_velocity(w, k, i, s, limit):
    """S3 = ξ' (s = 1) or S2 = -ξ' (s = -1); while sliding down ξ is watched beside it.

    ξ decreases strictly while ξ' < 0, so S1 has a zero before the first zero of S2 exactly when ξ there is
    not positive, and it is then unique. The watch ends the search early once ξ is further below 0 than any
    margin met so far: the impact is certain then, and its margin no longer the smallest.
    """
    eta = w[ETA + i]
    w[C0 + i] = w[V0 + i]
    w[D1 + i] = w[A0 + i]
    w[D2 + i] = 0.5 * (w[P + i] + eta * w[PF + i])
    w[C1 + i] = w[L + i]
    w[C2 + i] = 0.0
    w[AL + i] = w[Q + i]
    w[BE + i] = w[P + i]
    w[ALF + i] = eta * w[XBEF + i]
    w[BEF + i] = -eta * w[XALF + i]
    a = w[AF + i] / eta if w[AF + i] > 0.0 else 0.0
    _start(w, k, i, S3 if s > 0.0 else S2, 0.0, s, a, abs(w[C1 + i]) * limit)
    if s < 0.0:
        w[WATCH + i] = w[X0 + i]
        w[DIP + i] = w[MARGIN + i]


@inline
def skip_start(w, i, s):
    """A slide that starts with ξ' = 0: put the cursor where the search can begin (locate.py, starts on a zero)."""
    h = 0.0
    if w[ETA + i] == 0.0:
        h = (PI - w[PHI_UP + i] if s > 0.0 else 3.0 * PI - w[PHI_DOWN + i]) - w[PHI + i]
        if h >= TWO_PI:
            h -= TWO_PI
    elif w[A0 + i] == 0.0:
        h = 2.9 * s * 2.0 * w[D2 + i] / w[M3 + i]
    h = h if h < w[LIMIT + i] else w[LIMIT + i]
    w[H + i] = h if h > 0.0 else 0.0


@inline
def aim_force(w, k, i, which):
    """S5 = 1 - H, or both sides of S4 = 1 - |H|: the side whose cursor is behind is searched next."""
    eta = w[ETA + i]
    w[C0 + i] = w[Q + i] + w[QF + i] - w[B + i]
    w[D1 + i] = w[P + i] + eta * w[PF + i]
    w[D2 + i] = -0.5 * (w[Q + i] + eta * eta * w[QF + i])
    w[C1 + i] = 0.0
    w[C2 + i] = 0.0
    w[AL + i] = w[P + i]
    w[BE + i] = -w[Q + i]
    w[ALF + i] = w[PF + i]
    w[BEF + i] = -w[QF + i]
    _start(w, k, i, which, 1.0, -1.0, w[AF + i], 0.0)
    if which == S4:
        w[OTHER + i] = 0.0
