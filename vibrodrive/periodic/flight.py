"""One flight of the undisturbed mass (ε = 0) in closed form: from a launch at the obstacle to an impact.

Terms:

* A *flight* is the motion of the mass from the instant at which it leaves the obstacle to the next impact.
* The *launch* is the instant at which the mass leaves the obstacle; its phase is ψ.
* The mass is *in the air* during a flight, although it stays on the incline, and it *lands* when it hits the obstacle.
* *On the level* means on a horizontal plane: B = 0.
* The *word* of a flight is the sequence of its states.

The mass leaves the obstacle at a phase ψ of the *window* [φ_up, π - φ_up]. Inside the window H > 1, and at its ends
H = 1. If the phase of an impact is inside the window, the mass leaves immediately, and ψ is this phase. Otherwise the
mass rests until the window begins, and ψ = φ_up. Everything else follows from ψ. Three facts make a flight simple:

* A slide up ends within a known interval, its bracket (`enclose` and the head of kernels/undisturbed.py). For B < 1 a
  slide down also ends in its bracket. For B > 1 gravity may exceed friction. ξ' then remains negative, and only an
  impact can end the slide.
* ξ falls as long as ξ' < 0. So a slide down has at most one zero of ξ, and two values of ξ with different signs enclose
  this zero. ξ' is least at the instant at which H returns to -1, and most slides that land end before this instant. So
  the sign of ξ is evaluated at this instant first.
* As ψ grows, the beginnings of slides up do not become earlier, the beginnings of slides down do not become later, and
  ξ at every reversal (a zero of ξ') falls strictly. This follows from eqs. (4), (5) with ξ' = 0 at the beginning of a
  slide. A decision between an impact and a reversal depends on the sign of this ξ. Every other decision compares H with
  ±1. So each decision changes at most once as ψ grows, as long as the earlier decisions are the same. Therefore the
  phases with one word form an interval. The phases with one itinerary (the words of several flights in a row) form an
  interval, too. On each of these intervals the impact time falls strictly.

Because of the third fact all orbits and all breakpoints of the map (impact_map.py) can be found: if the words at both
ends of an interval are equal, all phases between them have this word (see itineraries.py).

If a sticking follows the first slide up, the next slide down always reaches the obstacle: friction and gravity oppose
the rise, whereas gravity drives the fall, and the share of its half wave of the excitation that the fall takes is at
least as large as the share that the rise takes of its half wave.

**On the level (B = 0)** a slide down is the mirror image of a slide up, half a period later. Let T(ψ) be the end of
the slide up that begins at ψ, and let D(ψ) be the distance over which the mass slides. Both fall as ψ grows, and
T(ψ*) = ψ* + π for A cos ψ* = π/2.

First let A > A_s = √(1 + π²/4), so that φ_up < ψ*. If a slide up begins at ψ*, the next slide down has the same length,
so the flight touches the obstacle at ψ* + 2π without speed. For any other ψ let slide number i = 0, 1, 2, … begin at
the phase a_i + iπ, so a_0 = ψ. The a_i are alternately on both sides of ψ* and converge to ψ*. If ψ < ψ*, each
difference D(a_2i) - D(a_2i+1) is positive, and the mass never lands. If ψ > ψ*, the first difference is negative, and
the mass lands in its first fall.

For A <= A_s every slide up ends in a sticking, so the next slide down begins at φ_up + π. The flight with a launch at
φ_up touches the obstacle without speed, and every flight with a later launch lands. The code decides all these cases
explicitly (`touching`), so that rounding does not decide them.

**Functions of the kernels.** The function `flight` uses functions of the kernels: `step_in_bracket` for the end of a
slide, `arrive` for the state there, `decide_after_slide` for the decision, `begin` for the beginning of the next slide,
and `release` for the duration of a sticking or rest. `flight` differs from the kernels in three ways. It also computes
derivatives with respect to ψ. It reports no TOO_CLOSE if rounding may change a decision. It recognises a launch by its
phase, φ_up < ψ < π - φ_up, and not by H > 1. The reason is that the ends of the window are breakpoints of the map, and
that the computed H at these ends is 1 only within rounding.
"""

import math

import numpy as np

from vibrodrive.jit.compile import array, inline, jit
from vibrodrive.jit.trig import HALF_PI, PI, PI_LOW, TWO_PI, arc, arcsine, turns
from vibrodrive.kernels.codes import DOWN, IMPACT, REST, S1, S2, S3, STICK, UP
from vibrodrive.kernels.motion import Field, arrive, excitation, slide_at
from vibrodrive.kernels.release import release_down, release_up
from vibrodrive.kernels.switch import begin, decide_after_slide, direction
from vibrodrive.kernels.undisturbed import enclose, gap_guess, guess_end, release, step_in_bracket

LETTERS = 8  # base of the number that represents a word; the digit of a state is State + 1
WORDS = (
    2**59 - 55
)  # prime modulus of these numbers; words of up to 19 states have distinct numbers, longer words almost surely

NO_WORD = 0  # the empty word

FROM_GROUND, FROM_STICK, FROM_REVERSAL = 0, 1, 2  # beginning of a slide: at the obstacle, after sticking, at a reversal

AIRBORNE = 16  # number of excitation periods for which a flight that never lands is computed, to name its first states


@inline
def append(word, letter):
    """Return the number of a word to which one letter is appended."""
    return (word * LETTERS + letter) % WORDS


@inline
def end_of_slide(which, segment, A, B, p, q, lo, hi, h):
    """Return the zero of switching function `which` of a slide, between lo and hi; h is the first guess."""
    evaluations = 0
    while True:
        h, lo, hi, found = step_in_bracket(which, segment, A, B, p, q, h, lo, hi, evaluations)
        if found:
            return h
        evaluations += 1


@inline
def gap_at(segment, p, q, h):
    """Return ξ at the time h after the beginning of a slide, where A cos τ = p and A sin τ = q at the beginning."""
    s, v, ds, dv, near = arc(h)
    return slide_at(segment, p, q, p, near, h, s, v, ds, dv)[0]


@inline
def window_end(up):
    """Return π - φ_up, the end of the window that begins at φ_up. H falls to 1 at this end."""
    return PI - up + PI_LOW


@inline
def touching(A, up):
    """Return, for B = 0, the launch phase of the flight that touches the obstacle without speed.

    Flights with an earlier launch never land, and flights with a later launch land.
    """
    y = HALF_PI / A
    return max(up, HALF_PI - arcsine(y, (A - HALF_PI) / A)) if y < 1.0 else up


@inline
def bracket_impact(segment, p, q, lo):
    """Return (low, high), two times between which a slide down ends in an impact. At `high` ξ <= 0.

    Times are measured from the beginning of the slide, where A cos τ = p and A sin τ = q. ξ' is least at the time `lo`.
    """
    low, high = 0.0, lo
    below = gap_at(segment, p, q, high)
    while below > 0.0:
        low, high = high, high + TWO_PI
        below = gap_at(segment, p, q, high)
    return low, high


@inline
def launch(psi, A, B, up, p_up):
    """Return (φ, H, A cos φ, A sin φ) at the launch of a flight. φ is ψ, or φ_up if ψ is outside the window."""
    p, q = excitation(A, psi, 0.0)
    if psi <= up or psi >= window_end(up):
        return up, 1.0, p_up, 1.0 + B
    return psi, q - B, p, q


@jit(like=(0.0, 0.0, 0.0, 0, 0, array(2)), _nrt=False)
def flight(psi, A, B, horizon, word, slides):
    """Compute the flight with a launch at phase ψ. If ψ is outside the open window, the launch is at φ_up, from rest.

    The flight is computed for at most `horizon` excitation periods, and for at most AIRBORNE if it never lands (B = 0).
    `slides` (any, 3) receives a row for each slide in order: the phase of its beginning, its duration and its kind of
    beginning. If there are more slides than rows, the other slides are not recorded.

    Return (k, phase, velocity, slope, word, count):

    k, phase : the impact is at the time 2πk + phase, 0 <= phase < 2π, from the beginning of the period of the launch;
        k is -1 if no impact was found
    velocity : ξ' <= 0 at the impact
    slope : d(impact time)/dψ <= 0
    word : the argument `word`, followed by the states of the flight without IMPACT
    count : number of slides

    The slope follows from the delays of the slides. Let a slide with the initial acceleration a begin later by δ. Then
    its velocity is less by a·δ at each time, and the slide ends later by a·δ divided by the acceleration at its end.
    The next slide begins with this delay, and with another acceleration, because friction changes its sign (saltation).
    After a sticking δ = 0. The impact comes earlier by (Σ a·δ·duration) / |ξ'|, with the sum over all slides. A
    sticking sets the velocity to zero but does not change ξ, so the slope is zero only after a rest. The slope is -inf
    for an impact without speed.
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
        which, guess, touches = S3 if state == UP else S2, guess_end(lo, hi), False
        if state == DOWN and not never_lands and (fall <= 0.0 or gap_at(segment, p, q, lo) <= 0.0):
            which = S1
            lo, hi = bracket_impact(segment, p, q, lo)
            guess = hi
        while True:  # repeated if ξ < 0 at the end of a slide down, because the impact is before this end
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
            # for B > 1 a slide down may begin after 2π; its phase must not jump at 2π as a function of ψ
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
        released = to == STICK or to == state  # if to == state, |H| exceeds 1 only by rounding
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


@jit(like=(array(1), 0.0, 0.0, 0, array(2), array(2, np.int64)), _nrt=False)
def impacts(phi, A, B, horizon, motions, counts):
    """Compute the next impact after an impact at each phase in `phi`, within `horizon` excitation periods.

    `motions`, float64 (n, 3), receives the phase, the speed and the slope, and `counts`, int64 (n, 2), the number of
    periods and the word as a number. If there are more rows than phases, these impacts follow the impact of the last.
    """
    up, _ = release_up(A, B)
    end = window_end(up)
    no_slides = motions[:0]
    none = np.int64(NO_WORD)  # for a literal, `flight` would be compiled again
    rested = False  # the flight after a rest may be long, so it is computed once, and only if it is needed
    k0, phase0, velocity0, word0 = -1, math.nan, math.nan, none
    for i in range(len(motions)):
        psi = turns(phi[i] if i < len(phi) else motions[i - 1, 0], 0.0)[1]
        if up < psi < end:
            k, landed, velocity, rate, word, _ = flight(psi, A, B, horizon, none, no_slides)
        else:
            if not rested:
                rested = True
                k0, phase0, velocity0, _, word0, _ = flight(up, A, B, horizon, append(none, REST + 1), no_slides)
            k, landed, velocity, rate, word = k0, phase0, velocity0, 0.0, word0
            if psi >= end and k0 >= 0:
                k = k0 + 1
        motions[i, 0], motions[i, 1], motions[i, 2] = landed, -velocity + 0.0, rate  # no -0.0
        counts[i, 0], counts[i, 1] = k, append(word, IMPACT + 1)


@jit(like=(0.0, 0.0, 0.0), _nrt=False)
def launch_after(phi, A, B):
    """Return (psi, rests): φ modulo 2π, and True if a rest follows an impact at this phase.

    If no rest follows, psi is the launch phase.
    """
    psi = turns(phi, 0.0)[1]
    up, _ = release_up(A, B)
    return psi, psi <= up or psi >= window_end(up)


@jit(like=(0.0, 0.0), _nrt=False)
def launch_window(A, B):
    """Return (φ_up, π - φ_up, touch): both ends of the window, and the launch phase `touching` (only for B = 0)."""
    up = release_up(A, B)[0]
    return up, window_end(up), touching(A, up)
