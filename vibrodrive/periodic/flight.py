"""One flight of the undisturbed mass (ε = 0) in closed form: from a launch at the obstacle to an impact.

Terms: a *flight* is the motion of the mass from the instant at which it leaves the obstacle (the *launch*, at phase ψ)
to the next impact. In between the mass is *in the air*, although it stays on the incline, and it *lands* when it hits
the obstacle. *On the level* means on a horizontal plane, B = 0. The *word* of a flight is the sequence of its states.

The mass leaves the obstacle at a phase ψ of the *window* [φ_up, π - φ_up], in which H > 1: at the impact itself if
its phase is in the window, otherwise (after a rest) at the beginning φ_up. Everything else follows from ψ.
Three facts make a flight simple:

* A slide up ends in its bracket, and so does a slide down for B < 1 (`enclose` and the head of undisturbed.py). For
  B > 1 gravity may exceed friction: then ξ' stays negative, and only an impact can end the slide.
* ξ falls as long as ξ' < 0. So a slide down has at most one zero of ξ, between two values of ξ with different signs.
  ξ' is least at the instant at which H returns to -1, and most slides that land do so before it. So the sign of ξ is
  evaluated there first.
* As functions of ψ, the beginnings of slides up do not fall, those of slides down do not grow, and the
  gap at every reversal falls strictly (eqs. (4), (5) at ξ' = 0 at the beginning of a slide). Hence each decision
  (impact or reversal; H against ±1) changes at most once as ψ grows, as long as the decisions before it are the
  same. The phases with one word, and with one itinerary over several flights, are intervals, and the impact
  time falls strictly on each.

Because of the last fact orbits and breakpoints can be found completely: equal words at both ends of an interval
mean one word throughout (see itineraries.py).

A slide down that follows the first slide up after a sticking always reaches the obstacle: friction and
gravity opposed the rise, whereas gravity drives the fall, which lasts for at least as much of its half wave.

**On the level (B = 0)** a slide down is the mirror image of a slide up, half a period later. Let T(ψ) be the end of
the slide up that begins at ψ, and D(ψ) its length. Both fall with ψ, and T(ψ*) = ψ* + π for A cos ψ* = π/2. Take
A > A_s = √(1 + π²/4), for which φ_up < ψ*. The next slide exactly cancels a slide that begins at ψ*: the flight touches
the obstacle at ψ* + 2π with no speed. The slides of another flight begin (up to half periods) at a_0 = ψ, a_1, a_2, …
on alternate sides of ψ*, and these phases converge to ψ* from both sides. For ψ < ψ* each difference
D(a_2i) - D(a_2i+1) > 0: the mass never lands. For ψ > ψ* the first difference is negative: the mass lands in its first
fall. For A <= A_s every slide up ends in a sticking, so that the next slide down begins at φ_up + π: a launch at φ_up
touches without speed, every later one lands. These cases are decided explicitly, not by rounding: see `touching`.

**Functions of the kernels.** A flight uses the kernels' functions for the end of a slide (`step_in_bracket`), the state
there (`arrive`), the decision (`decide_after_slide`), the beginning of the next slide (`begin`) and the length of a
wait (`release`). It differs from the kernels in three ways. It also computes d/dψ. It makes a decision even if the
kernels report that rounding may change it (TOO_CLOSE). And it recognises a launch by its phase, φ_up < ψ < π - φ_up,
not by H > 1, because the ends of the window are breakpoints of the map, and H is 1 there only within its rounding.
"""

from __future__ import annotations

import math

import numpy as np

from vibrodrive.jit.compile import inline, jit
from vibrodrive.jit.trig import HALF_PI, PI, PI_LOW, TWO_PI, arc, arcsine, turns
from vibrodrive.kernels.codes import DOWN, IMPACT, REST, S1, S2, S3, STICK, UP
from vibrodrive.kernels.motion import Field, arrive, excitation, slide_at
from vibrodrive.kernels.release import release_down, release_up
from vibrodrive.kernels.switch import begin, decide_after_slide, direction
from vibrodrive.kernels.undisturbed import enclose, gap_guess, release, step_in_bracket, usual_end

LETTERS = 8  # base of the number that represents a word; a state is the digit State + 1
WORDS = 2**59 - 55  # prime modulus of words: those of up to 19 states have different numbers, longer ones almost surely

NO_WORD = 0  # the empty word

FROM_GROUND, FROM_STICK, FROM_REVERSAL = 0, 1, 2  # kinds of beginning of a slide

AIRBORNE = 16  # excitation periods computed of a flight that never lands: enough to name its first states


@inline
def append(word, letter):
    """Return the word (the sequence of states, as a number) with one more letter."""
    return (word * LETTERS + letter) % WORDS


@inline
def end_of_slide(which, segment, A, B, p, q, lo, hi, h):
    """Return the zero of switching function `which` between lo and hi, with the first guess h."""
    evaluations = 0
    while True:
        h, lo, hi, found = step_in_bracket(which, segment, A, B, p, q, h, lo, hi, evaluations)
        if found:
            return h
        evaluations += 1


@inline
def gap_at(segment, p, q, h):
    """Return ξ at h after the beginning of a slide, where A cos τ = p and A sin τ = q."""
    s, v, ds, dv, near = arc(h)
    return slide_at(segment, p, q, p, near, h, s, v, ds, dv)[0]


@inline
def window_end(up):
    """Return π - φ_up, the end of the window that begins at φ_up: H falls to 1."""
    return PI - up + PI_LOW


@inline
def touching(A, up):
    """Return, for B = 0, the launch whose flight touches the obstacle without speed.

    Flights from earlier launches never land, those from later ones do.
    """
    y = HALF_PI / A
    return max(up, HALF_PI - arcsine(y, (A - HALF_PI) / A)) if y < 1.0 else up


@inline
def where_below(segment, p, q, lo):
    """Return a bracket of the impact of a slide down whose ξ' is least at lo; its end has ξ <= 0."""
    low, high = 0.0, lo
    below = gap_at(segment, p, q, high)
    while below > 0.0:
        low, high = high, high + TWO_PI
        below = gap_at(segment, p, q, high)
    return low, high


@inline
def launch(psi, A, B, up, p_up):
    """Return (phase φ, H, A cos φ, A sin φ) at the beginning of a flight: φ = ψ, or φ_up if ψ is outside the window."""
    p, q = excitation(A, psi, 0.0)
    if psi <= up or psi >= window_end(up):
        return up, 1.0, p_up, 1.0 + B
    return psi, q - B, p, q


@jit(_nrt=False)
def flight(psi, A, B, horizon, word, slides):
    """Compute the flight launched at phase ψ. If ψ is outside the open window, the flight starts from rest at φ_up.

    The flight is followed for at most `horizon` excitation periods, and for at most AIRBORNE if it never lands (B = 0).
    Each row of `slides` (any, 3) receives the phase of the beginning, the duration and the kind of beginning of one
    slide, as long as there are rows.

    Returns (k, phase, velocity, slope, word, count): the impact is at 2πk + phase, 0 <= phase < 2π, counted from the
    period of the launch (k = -1: none found), with ξ' = velocity <= 0. The states of the flight, without IMPACT, are
    appended to the word, and the flight has `count` slides.

    The slope is d(impact time)/dψ <= 0. A slide that begins later by δ, with the acceleration a, is slower by a δ from
    there on and ends later by a δ over its acceleration there (saltation: friction changes sign); after a sticking
    δ = 0. The impact comes (Σ a δ · duration) / |ξ'| earlier. Sticking sets the velocity to zero but does not change
    the gap, so only a rest makes the slope vanish. The slope is -inf for an impact without speed.
    """
    up, p_up = release_up(A, B)
    down, p_down = release_down(A, B)
    state, begun = UP, FROM_GROUND
    phi, force, p, q = launch(psi, A, B, up, p_up)
    released = phi == up
    level = B == 0.0
    touch = touching(A, up) if level else 0.0
    never_lands, exact = level and phi < touch, level and phi == touch
    if never_lands:
        horizon = min(horizon, AIRBORNE)
    x = 0.0
    delay = 1.0  # d(beginning of the slide)/dψ
    moment = 0.0
    k = 0
    count = 0
    while k <= horizon:
        s = direction(state)
        segment = begin(s, x, 0.0, force, released, False, B, 0.0, Field(p, q, 0.0, 0.0))
        lo, hi, fall = enclose(s, phi, p, segment.slope, up, p_up, down, p_down)
        word = append(word, state + 1)
        which, guess, touches = S3 if state == UP else S2, usual_end(lo, hi), False
        if state == DOWN and not never_lands and (fall <= 0.0 or gap_at(segment, p, q, lo) <= 0.0):
            which = S1
            lo, hi = where_below(segment, p, q, lo)
            guess = hi
        while True:  # a second time if the end of a slide down is below the obstacle: the impact was before it
            h = end_of_slide(which, segment, A, B, p, q, lo, hi, guess)
            there = arrive(segment, A, phi, 0.0, p, q, h)
            if which != S2 or never_lands:
                break
            if there.x > 0.0 and not (count == 1 and (level or begun == FROM_STICK)):
                break
            which, touches = S1, exact or there.x > 0.0
            if touches:
                break
            lo, hi, guess = 0.0, h, gap_guess(x, there.x, h)
        moment += delay * segment.a0 * h
        if count < len(slides):
            # for B > 1 a slide down may begin past 2π: as a function of ψ that phase must not jump
            slides[count, 0] = phi + TWO_PI if state == DOWN and phi < HALF_PI else phi
            slides[count, 1] = h
            slides[count, 2] = begun
        count += 1
        k += int(there.turned)
        if which == S1:
            velocity = 0.0 if touches else min(there.v, 0.0)
            slope = -math.inf if moment > 0.0 else 0.0
            if velocity < 0.0:
                slope = moment / velocity
            return k, there.phi, velocity, slope, word, count
        x, phi, p, q = there.x, there.phi, there.p, there.q
        force = q - B
        to = decide_after_slide(False, force)
        released = to == STICK or to == state  # the same slide again: |H| is beyond 1 by rounding only
        if released:
            word = append(word, STICK + 1)
            _, phi, later_period, falls = release(STICK, phi, A, B, up, down)
            k += 1 if later_period else 0
            state, begun, delay = DOWN if falls else UP, FROM_STICK, 0.0
            force, p = (-1.0, p_down) if falls else (1.0, p_up)
            q = B + force
        else:
            state, begun = to, FROM_REVERSAL
            delay *= segment.a0 / (force - s)
    return -1, math.nan, math.nan, math.nan, word, count


@jit(_nrt=False)
def impacts(phi, A, B, horizon, phase, periods, speed, slope, code, no_slides):
    """Write the next impact after every phase of `phi` to the arrays `phase` … `code`, all (n,); `no_slides` (0, 3)."""
    up, _ = release_up(A, B)
    end = window_end(up)
    none = np.int64(NO_WORD)  # a literal would compile another specialisation
    rested = False  # the flight after a rest, which may be long, is computed once, and only if needed
    k0, phase0, velocity0, word0 = -1, math.nan, math.nan, none
    for i in range(len(phi)):
        psi = turns(phi[i], 0.0)[1]
        if up < psi < end:
            k, landed, velocity, rate, word, _ = flight(psi, A, B, horizon, none, no_slides)
        else:
            if not rested:
                rested = True
                k0, phase0, velocity0, _, word0, _ = flight(up, A, B, horizon, append(none, REST + 1), no_slides)
            k, landed, velocity, rate, word = k0, phase0, velocity0, 0.0, word0
            if psi >= end and k0 >= 0:
                k = k0 + 1
        phase[i] = landed
        periods[i] = k
        speed[i] = -velocity + 0.0  # no -0.0
        slope[i] = rate
        code[i] = append(word, IMPACT + 1)


@jit(_nrt=False)
def launch_after(phi, A, B):
    """Return (ψ, rests): the phase φ in [0, 2π), and True if a rest follows an impact there; if not, a launch at ψ."""
    psi = turns(phi, 0.0)[1]
    up, _ = release_up(A, B)
    return psi, psi <= up or psi >= window_end(up)


@jit(_nrt=False)
def launch_window(A, B):
    """Return (φ_up, π - φ_up, ψ*): the window, and for B = 0 the launch whose flight touches without speed."""
    up = release_up(A, B)[0]
    return up, window_end(up), touching(A, up)
