"""One flight of the undisturbed mass (ε = 0) in closed form: from a launch at the obstacle to an impact.

The terms: the mass stays on the incline all the time. A *flight* is its motion from leaving the obstacle (the
*launch*, at phase ψ) to the next impact; it is *in the air* meanwhile, and *lands* when it hits the obstacle. *On the
level* means on a horizontal plane, B = 0. The *word* of a flight is the sequence of its states.

The obstacle is left at a phase ψ of the *window* [φ_up, π - φ_up] in which H > 1: at the impact itself if
that falls into the window, otherwise (after a rest) at its beginning φ_up. Everything else follows from ψ.
Three facts make a flight simple:

* A slide up ends in its bracket, and so does one down for B < 1 (`enclose` and the head of undisturbed.py). For
  B > 1 gravity may outweigh friction: then ξ' stays negative, and only an impact can end the slide.
* ξ falls as long as ξ' < 0: a slide down has one zero of ξ at most, between two values of ξ of unlike signs. Where H
  is back at -1, ξ' is least, and at the latest there most slides that land have done so: ξ is looked at there first.
* Seen as functions of ψ the beginnings of slides up do not fall, those of slides down do not grow, and the
  gap at every reversal falls strictly (eqs. (4), (5) at ξ' = 0 at the beginning of a slide). Hence each decision
  (impact or reversal; H against ±1) changes at most once as ψ grows, as long as the decisions before it are the
  same. The phases with one word, and with one itinerary over several flights, are intervals, and the impact
  time falls strictly on each.

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

**What is shared with the kernels.** What ends a slide, where it leads, what is decided there, what begins and how long
a wait lasts are the kernels' own functions: `step_in_bracket`, `arrive`, `decide_after_slide`, `begin`, `release`.
Three things are a flight's alone. It follows d/dψ. It decides even where the kernels report that rounding might
(TOO_CLOSE). And it tells a launch by its phase, φ_up < ψ < π - φ_up, not by H > 1: the ends of the window are
breakpoints of the map, and H is 1 there only within its rounding.
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

LETTERS = 8  # a word is a number to this base, a state the digit State + 1
WORDS = 2**59 - 55  # a prime: words of up to 19 states are told apart exactly, longer ones by remainder

NO_WORD = 0  # the empty word

FROM_GROUND, FROM_STICK, FROM_REVERSAL = 0, 1, 2  # how a slide begins

AIRBORNE = 16  # excitation periods for which a flight that never lands is followed: enough to name its first states


@inline
def append(word, letter):
    """The word (the sequence of states, as a number) with one more letter."""
    return (word * LETTERS + letter) % WORDS


@inline
def end_of_slide(which, segment, A, B, p, q, lo, hi, h):
    """The zero of switching function `which` between lo and hi, looked for from h on."""
    evaluations = 0
    while True:
        h, lo, hi, found = step_in_bracket(which, segment, A, B, p, q, h, lo, hi, evaluations)
        if found:
            return h
        evaluations += 1


@inline
def gap_at(segment, p, q, h):
    """ξ at h after the beginning of a slide, where A cos τ = p and A sin τ = q."""
    s, v, ds, dv, near = arc(h)
    return slide_at(segment, p, q, p, near, h, s, v, ds, dv)[0]


@inline
def window_end(up):
    """π - φ_up, where the window that opens at φ_up closes: H falls back to 1."""
    return PI - up + PI_LOW


@inline
def touching(A, up):
    """B = 0: the launch whose flight touches the obstacle without speed. Earlier ones never land, later ones do."""
    y = HALF_PI / A
    return max(up, HALF_PI - arcsine(y, (A - HALF_PI) / A)) if y < 1.0 else up


@inline
def where_below(segment, p, q, lo):
    """The bracket of an impact, after a slide down whose ξ' is least at lo: until ξ is below 0."""
    low, high = 0.0, lo
    below = gap_at(segment, p, q, high)
    while below > 0.0:
        low, high = high, high + TWO_PI
        below = gap_at(segment, p, q, high)
    return low, high


@inline
def launch(psi, A, B, up, p_up):
    """Phase, H, A cos and A sin of it where a flight begins: at ψ, or outside the open window at φ_up."""
    p, q = excitation(A, psi, 0.0)
    if psi <= up or psi >= window_end(up):
        return up, 1.0, p_up, 1.0 + B
    return psi, q - B, p, q


@jit(_nrt=False)
def flight(psi, A, B, horizon, word, slides):
    """The flight launched at phase ψ; outside the open window from rest, at φ_up.

    `horizon`: excitation periods for which it is followed (AIRBORNE, if fewer, where it never lands: B = 0). `slides`
    (any, 3) receives a row per slide, as far as there are rows: phase of its beginning, duration, how it began.

    Returns (k, phase, velocity, slope, word, count): the impact is at 2πk + phase, 0 <= phase < 2π, counted from the
    period of the launch (k = -1: none found), with ξ' = velocity <= 0; the word is continued by the states of the
    flight, without IMPACT, and `count` slides make it up.

    The slope is d(impact time)/dψ <= 0. A slide that begins later by δ, with the acceleration a, is slower by a δ from
    there on and ends later by a δ over its acceleration there (saltation: friction changes sign); after a sticking
    δ = 0. The impact comes (Σ a δ · duration) / |ξ'| earlier. Sticking sets the velocity to zero but keeps the gap, so
    only a rest makes the slope vanish. It is -inf for an impact without speed.
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
        while True:  # once, or again where the end of a slide down is below the obstacle: there was an impact before
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
    """The next impact for every phase of `phi`, into the arrays behind it, all (n,); `no_slides` (0, 3)."""
    up, _ = release_up(A, B)
    end = window_end(up)
    none = np.int64(NO_WORD)  # a literal would compile another specialisation
    rested = False  # the flight out of a rest, which may be long, is followed once, and only if needed
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
    """(ψ, rests): the phase φ of an impact, in [0, 2π), and whether a rest follows; if not, ψ is that of the launch."""
    psi = turns(phi, 0.0)[1]
    up, _ = release_up(A, B)
    return psi, psi <= up or psi >= window_end(up)


@jit(_nrt=False)
def launch_window(A, B):
    """(φ_up, π - φ_up, ψ*): the window, and the launch in it whose flight touches without speed if B = 0."""
    up = release_up(A, B)[0]
    return up, window_end(up), touching(A, up)
