"""One flight of the undisturbed mass (ε = 0) in closed form: from a launch at the obstacle to an impact.

The terms: the mass stays on the incline all the time. A *flight* is its motion from leaving the obstacle (the
*launch*, at phase ψ) to the next impact; it is *in the air* meanwhile, and *lands* when it hits the obstacle. *On the
level* means on a horizontal plane, B = 0. The *word* of a flight is the sequence of its states.

The obstacle is left at a phase ψ of the *window* [φ_up, π - φ_up] in which H > 1: at the impact itself if
that falls into the window, otherwise (after a rest) at its beginning φ_up. Everything else follows from ψ.
Four facts, all from eqs. (4), (5) at ξ' = 0 at the beginning of a slide, make a flight simple:

* Slide up: ξ' grows to the end of the window and falls from there to 2π + φ_up, where it is negative because
  cos φ_up >= cos ψ. So it has one zero, and Newton's method started at its inflection 3π/2 runs to it
  monotonely.
* Slide down, begun where H < -1, for φ in [φ_down, 3π - φ_down]: the same with inflection 5π/2; for B > 1
  gravity may outweigh friction, then ξ' stays negative and only an impact can end the slide.
* ξ has its inflection at 3π - φ_down and falls as long as ξ' < 0: Newton's method started there is monotone
  here as well.
* Seen as functions of ψ the beginnings of slides up do not fall, those of slides down do not grow, and the
  gap at every reversal falls strictly. Hence each decision (impact or reversal; H against ±1) changes at most
  once as ψ grows, as long as the decisions before it are the same. The phases with one word, and with one
  itinerary over several flights, are intervals, and the impact time falls strictly on each.

The last fact is why orbits and breakpoints can be found completely: equal words at both ends of an interval
mean one word throughout (see itineraries.py).

A slide down that follows the first slide up after a sticking always reaches the obstacle: friction and
gravity opposed the rise, whereas gravity drives the fall, which lasts for at least as much of its half wave.

**On the level (B = 0)** a slide down is the mirror image of a slide up, half a period later. Let T(ψ) be the end of
the slide up begun at ψ and D(ψ) how far it goes; both fall with ψ, and T(ψ*) = ψ* + π where A cos ψ* = π/2. Take
A > A_s = √(1 + π²/4), for which φ_up < ψ*. The next slide exactly cancels one begun at ψ*: the flight touches the
obstacle at ψ* + 2π with no speed. The slides of another flight begin (up to half periods) at a_0 = ψ, a_1, a_2, …
on alternate sides of ψ*, which they approach from both. For ψ < ψ* each pair D(a_2i) - D(a_2i+1) > 0: the mass
never lands. For ψ > ψ* already the first pair is negative: it lands in its first fall. For A <= A_s every
slide up ends in a sticking, so that the next one down begins at φ_up + π: a launch at φ_up touches without speed,
every later one lands. These cases are decided explicitly, not by rounding: see `touching`.

**What is shared with the kernels.** The formulas are theirs (`motion.shape`, `release_up`, `release_down`), the steps
are not. The kernels advance lanes, and report a decision that rounding makes uncertain (TOO_CLOSE). A flight has no
lane, and must decide: it compares phases (φ_up < τ < π - φ_up) where the kernels compare H with ±1, because phases are
what is monotone in ψ. Newton's method needs no bracket here, as it is monotone from the inflection; Householder's in
a bracket (`undisturbed.householder_step`) takes other steps and would end on other last bits.
"""

from __future__ import annotations

import math

from vibrodrive.jit.compile import inline, jit, part
from vibrodrive.jit.trig import HALF_PI, PI, PI_LOW, TWO_PI, TWO_PI_LOW, arc, arcsine
from vibrodrive.kernels.motion import shape
from vibrodrive.kernels.release import release_down, release_up
from vibrodrive.model.states import State

UP, DOWN, STICK, REST, IMPACT = (int(s) for s in State)

LETTERS = 8  # a word is a number to this base, a state the digit State + 1
WORDS = 2**59 - 55  # a prime: words of up to 19 states are told apart exactly, longer ones by remainder

NO_WORD = 0  # the empty word

FROM_GROUND, FROM_STICK, FROM_REVERSAL = 0, 1, 2  # how a slide begins

NEWTON_STEPS = 200  # Newton's method: monotone, so it ends by itself, near a double zero after some 53 halvings
AIRBORNE = 16  # excitation periods for which a flight that never lands is followed: enough to name its first states

CONVERGED = 1e-17  # the step to come is about step³/last² once convergence is quadratic


@inline
def append(word, letter):
    """The word (the sequence of states, as a number) with one more letter."""
    return (word * LETTERS + letter) % WORDS


@inline
def slide(h, a, p, q):
    """(ξ'', ξ', ξ - ξ_i) a time h after a slide began at rest: `motion.state_at` (eqs. (4), (5)), and ξ''.

    a = ξ''_i, p = A cos τ_i, q = A sin τ_i.
    """
    s, v, ds, dv, near = arc(h)
    rate = a - q
    velocity = shape(near, h, 0.0, a, 0.5 * p, rate, 0.0, q, p, s, v, ds, dv)
    move = shape(near, h, 0.0, 0.0, 0.5 * a, p, 0.5 * rate, -p, q, s, v, ds, dv)
    return a + (p * s - q * v), velocity, move


@inline
def reversal_time(h, a, p, q):
    """The zero of ξ' on the side of its inflection h to which Newton's method leads."""
    last = 0.0
    for _ in range(NEWTON_STEPS):
        acceleration, velocity, _ = slide(h, a, p, q)
        step = velocity / acceleration
        if last > 0.0 and not abs(step) < last:
            break
        h -= step
        if step * step * abs(step) <= CONVERGED * last * last:
            break
        last = abs(step)
    return h


@inline
def landing_time(h, x, a, p, q):
    """The zero of x + (ξ - ξ_i), started at the inflection h or at an end of a piece without one."""
    last = 0.0
    for _ in range(NEWTON_STEPS):
        _, velocity, move = slide(h, a, p, q)
        if velocity == 0.0:
            break
        step = (x + move) / velocity
        if last > 0.0 and not abs(step) < last:
            break
        h -= step
        if step * step * abs(step) <= CONVERGED * last * last:
            break
        last = abs(step)
    return h


@part
def start_of_landing(x, a, p, q, first, second):
    """Where to start `landing_time` on a slide down that gravity never lets reverse (B > 1).

    ξ is concave up to `first`, convex from there to `second`, concave up to first + 2π, and so on.
    """
    while True:
        if x + slide(second, a, p, q)[2] <= 0.0:
            return first
        first += TWO_PI
        if x + slide(first, a, p, q)[2] <= 0.0:
            return first
        second += TWO_PI


@inline
def window_end(up):
    """π - φ_up, where the window that opens at φ_up closes: H falls back to 1."""
    return PI - up + PI_LOW


@inline
def touching(A, up):
    """B = 0: the launch whose flight touches the obstacle without speed. Earlier ones never land, later ones do."""
    y = HALF_PI / A
    return max(up, HALF_PI - arcsine(y, (A - HALF_PI) / A)) if y < 1.0 else up


@jit(_nrt=False)
def flight(psi, A, B, horizon, word, slides):
    """The flight launched at phase ψ.

    Parameters
    ----------
    psi : float
        outside the open window the launch is from rest, at φ_up.
    horizon : int
        excitation periods for which the flight is followed (AIRBORNE, if fewer, where it never lands: B = 0).
    word : int
        the word so far, to be continued (see LETTERS, WORDS).
    slides : float64 (any, 3)
        receives one row per slide, as many as there are rows: phase of its beginning, duration, and how it began
        (FROM_GROUND, FROM_STICK, FROM_REVERSAL).

    Returns
    -------
    k, phase : int, float
        impact at 2πk + phase, 0 <= phase < 2π, counted from the period of the launch; k = -1: no impact found.
    velocity : float
        ξ' <= 0 into the impact.
    slope : float
        d(impact time)/dψ <= 0. A later launch by dψ lowers the velocity by w dψ, w = H(ψ) - 1; a reversal in
        the air multiplies w by the ratio of the accelerations across it (saltation: friction changes
        sign), sticking makes it 0, and the impact comes (Σ w · duration) / |ξ'| earlier. Sticking sets
        the velocity to zero but keeps the gap, so only a rest makes the slope vanish. -inf for an impact without speed.
    word : int
        continued by the states of the flight, without IMPACT, which the caller appends.
    count : int
        the number of slides.
    """
    up, p_up = release_up(A, B)
    down, p_down = release_down(A, B)
    rise = 3.0 * PI - down
    end = window_end(up)
    tau, p, q = psi, A * math.cos(psi), A * math.sin(psi)
    a = q - B - 1.0
    if psi <= up or psi >= end:
        tau, a, p, q = up, 0.0, p_up, 1.0 + B
    w = a
    level = B == 0.0
    touch = touching(A, up) if level else 0.0
    never_lands, exact = level and tau < touch, level and tau == touch
    if never_lands:
        horizon = min(horizon, AIRBORNE)
    x = 0.0
    moment = 0.0
    falling = False
    begun = FROM_GROUND
    k = 0
    count = 0
    while k <= horizon:
        impact = False
        if not falling:
            word = append(word, UP + 1)
            h = reversal_time(3.0 * HALF_PI - tau, a, p, q)
            x += slide(h, a, p, q)[2]
        else:
            word = append(word, DOWN + 1)
            h = rise - tau
            impact = True
            touches = False
            if never_lands or x + slide(h, a, p, q)[2] > 0.0:
                top = TWO_PI + down - tau
                if slide(top, a, p, q)[1] > 0.0:
                    turn = reversal_time(5.0 * HALF_PI - tau, a, p, q)
                    gap = x + slide(turn, a, p, q)[2]
                    lands = count == 1 and (level or begun == FROM_STICK)
                    if never_lands or (gap > 0.0 and not lands):
                        impact = False
                        x = gap
                        h = turn
                    elif exact or gap > 0.0:
                        touches = True
                        h = turn
                else:
                    h = start_of_landing(x, a, p, q, h, top)
            if impact and not touches:
                h = landing_time(h, x, a, p, q)
        moment += w * h
        if count < len(slides):
            slides[count, 0] = tau
            slides[count, 1] = h
            slides[count, 2] = begun
        count += 1
        tau += h
        if impact:
            velocity = 0.0 if touches else min(slide(h, a, p, q)[1], 0.0)
            slope = -math.inf if moment > 0.0 else 0.0
            if velocity < 0.0:
                slope = moment / velocity
            while tau >= TWO_PI:
                tau = max((tau - TWO_PI) - TWO_PI_LOW, 0.0)
                k += 1
            return k, tau, velocity, slope, word, count
        # ξ' = 0 in the air. A sticking ends where H = 1 or H = -1; `falling` tells the direction of the next slide
        if falling:
            tau = (tau - TWO_PI) - TWO_PI_LOW
            k += 1
            reverses = up < tau < end
            falling = tau >= end
        else:
            reverses = down < tau < rise
            falling = tau < rise
            if not falling:
                k += 1
        if reverses:
            begun = FROM_REVERSAL
            p, q = A * math.cos(tau), A * math.sin(tau)
            a = q - B + (1.0 if falling else -1.0)
            w *= a / (a - 2.0 if falling else a + 2.0)
        else:
            begun = FROM_STICK
            word = append(word, STICK + 1)
            w = 0.0
            if falling:
                tau, a, p, q = down, 0.0, p_down, B - 1.0
            else:
                tau, a, p, q = up, 0.0, p_up, 1.0 + B
    return -1, math.nan, math.nan, math.nan, word, count
