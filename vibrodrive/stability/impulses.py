"""What every disturbance may be: the impulse V and the force m below which none destroys a structure, for ever (§1).

The disturbance is the sum of a force of at most m and of impulses whose sum over any span of time stays below V, such
as blows, noise, or sines of any frequency. Main impacts then stay in intervals of phases that this module computes from
the undisturbed orbit alone (docs/stability.md has the proof in full):

1. Let u be the velocity v of the mass less the impulses so far, where these are between 0 and V. Friction pulls u
   towards the motions above and below (bounds.py), so v stays less than V above the one and less than V below the
   other. Only a touch could lift the mass above the motion above. It does not while that motion rises, or rests.
2. With d >= 0, the distance of u from the motion above, ξ - V min(d, V) / 2 stays below the bound of bounds.py: it
   follows from the signs of v and of the velocity of that motion. ξ + V min(e, V) / 2 stays above the other bound.
3. While both motions fall, the motion above faster than V, d and e do not fall, and v is away from the motions by
   less than V - d and V - e. So after a time V / 2 both bounds hold without d and e.
4. After a main impact the mass rests, apart from hops whose height has a bound. It may fall faster than V if H < -1
   meanwhile, but has then touched the obstacle before the launch, if `fall_in_rest` says so.
5. Where the bound from below is 0 in flight, the mass may touch. The bound begins again at 0. Another motion above
   begins there, at the earliest touch, unless one rises there already.
6. The next main impact is between the zeros of the two bounds, if the mass falls for sure between them.
7. Intervals grow from the phases of the orbit until they return into themselves.
8. Touches do not count if they are within half a period of a main impact and slower. A slower one counts only if it
   is later than half a period after the last main impact and earlier than half a period before the next one, and must
   be slower than SHARE times the orbit's main impacts. An orbit with one main impact allows for faster ones soon after
   a main impact, because all that is within half a period is one main impact.

The delay of a switch, Δτ, is no such disturbance: its impulses add up.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vibrodrive.jit.compile import array, inline, jit, part
from vibrodrive.jit.trig import PI, TWO_PI, sincos
from vibrodrive.kernels.release import release_up
from vibrodrive.model.reasons import Beyond
from vibrodrive.stability import bounds
from vibrodrive.stability.main_impacts import SHARE, ImpactCycle

PROVED, NO_IMPACTS, MISSED, SHIFTED, FALL, HELD, TOUCH, DRIFT, ORDER = map(int, Beyond)

(
    PHASE, SPEED, TURNS, FIRST, LAST, LEAST, MOST, NEAR, FAR, LONE, TOUCH_FIRST, TOUCH_LAST, OLD_FIRST, OLD_LAST,
) = range(14)  # fmt: skip
"""Columns of a main impact: its phase and speed in the orbit, the number of excitation periods to the next launch, the
ends of the interval of its phases, least and largest speed; the largest speed of touches before it: soon after the last
main impact, later than half a period after it, and of those of them that may count; the first and the last instant of
touches in flight; earlier ends of its interval."""

ABOVE = 6  # largest number of motions above: one, and one from each place at which the mass may touch
STEPS = 300  # most steps in which intervals grow
PAD = 1e-9  # width by which intervals are enlarged at each end, so that the end of their growth is inside
ROUNDING = 1e-12  # distance from a decision within which rounding may change it
MARGIN = 1e-10  # share of 1 + A by which V and m are less than what is tried. It exceeds the effect of all rounding
LEAST_TRIED = 1e-8  # smallest V and m tried, in units of 1 + A
RATIO = 1.0 + 2.0**-13  # ratio of two values that ends a search


class Pair(NamedTuple):
    """The motions above and below and the largest force. `rows` has the pieces of the motion below, and then those of
    motions above, and `counts` their numbers, and at its end the number of motions above."""

    high: bounds.Side
    low: bounds.Side
    m: float
    rows: np.ndarray
    counts: np.ndarray


@part
def falls_fast(c, begin):
    """Return (first, last): between them all motions above fall faster than V, in the first such fall after `begin`."""
    first, last = -math.inf, math.inf
    for j in range(1, c.counts[-1] + 1):
        k = 0
        while k < c.counts[j] and not (bounds.is_fast(c.rows[j, k], -1.0) and c.rows[j, k + 1, bounds.BEGIN] > begin):
            k += 1
        if k == c.counts[j]:
            return math.inf, math.inf
        first, last = max(first, c.rows[j, k, bounds.BEGIN]), min(last, c.rows[j, k + 1, bounds.BEGIN])
    return first, last


@part
def first_low(low, row, stop, raised, sure, until):
    """Return (t, certain): the first instant of a piece at which the mass may be at the obstacle, inf if there is none.

    `certain` is true if the mass falls there for sure, as it does from `sure` to `until`. The piece ends at `stop`, and
    ξ + V min(e, V) / 2 is at least `raised` less the bound.
    """
    unpaid = 0.5 * low.V * low.V
    above = raised - bounds.bound_at(low, row, min(sure, stop)) - unpaid
    if above > ROUNDING:
        paid = sure + 0.5 * low.V
        if paid < until and bounds.bound_at(low, row, until) >= raised:
            if bounds.bound_at(low, row, paid) >= raised - ROUNDING:
                return bounds.fall_zero(low, row, above, sure, paid), True
            return bounds.bound_zero(low, row, raised, paid, until), True
        if raised - bounds.bound_at(low, row, stop) - unpaid > ROUNDING:
            return math.inf, False
    level = raised - unpaid
    return row[bounds.BEGIN] if row[bounds.BOUND] >= level else bounds.bound_zero(
        low, row, level, row[bounds.BEGIN], stop
    ) - PAD, False


@part
def allow_touches(c, first, last, end):
    """Return PROVED if motions above bound a mass that touches between `first` and `last`, else HELD.

    One of them rises there and is not below the mass, or another one begins at `first`.
    """
    high, n = c.high, c.counts[-1]
    for j in range(1, n + 1):
        k = bounds.piece_at(c.rows[j], c.counts[j], first)
        row, stop = c.rows[j, k], c.rows[j, k + 1, bounds.BEGIN]
        if (
            row[bounds.DIRECTION] > 0.0
            and row[bounds.BEGIN] <= first
            and last <= stop
            and bounds.bound_at(high, row, first) >= 0.0
        ):
            return PROVED
    sine, cosine = sincos(first)
    if high.A * sine - high.B < 1.0 or cosine < 0.0 or last - first > PI or n == ABOVE:
        return HELD
    c.counts[-1] = n + 1
    c.counts[n + 1] = bounds.trace(high, first, 0.0, end, c.rows[n + 1])
    return PROVED


@part
def descend(c, zone, end, after):
    """Follow the motion below until the mass may be at the obstacle after `zone`. Write the touches before to `after`.

    Return (code, i, t, sure, until): number of the piece, the instant, and the results of `falls_fast`.
    """
    low, pieces = c.low, c.rows[0]
    risen = 0 if low.V == 0.0 else 1
    if not bounds.is_fast(pieces[risen], 1.0):
        return MISSED, risen, end, end, end
    raised, touched, speed = pieces[risen, bounds.BOUND], math.inf, low.V
    after[FAR], after[TOUCH_FIRST], after[TOUCH_LAST] = 0.0, math.inf, -math.inf
    for i in range(risen + 1, c.counts[0]):
        row, begin, stop = pieces[i], pieces[i, bounds.BEGIN], pieces[i + 1, bounds.BEGIN]
        if bounds.is_fast(row, 1.0):  # the mass rises for sure
            raised = max(raised, row[bounds.BOUND])
            if touched < math.inf:
                code = allow_touches(c, touched, begin, end) if begin < zone else MISSED
                if code != PROVED:
                    return code, i, touched, touched, touched
                after[FAR], after[TOUCH_LAST] = max(after[FAR], speed), begin
                after[TOUCH_FIRST] = min(after[TOUCH_FIRST], touched)
                touched, speed = math.inf, low.V
            continue
        falls = row[bounds.DIRECTION] < 0.0
        if touched == math.inf:
            sure, until = falls_fast(c, begin) if falls else (math.inf, math.inf)
            until = min(until, stop)
            touched, certain = first_low(low, row, stop, raised, sure, until)
            if zone <= touched < math.inf:
                if not certain:
                    sure, until = falls_fast(c, touched)
                return PROVED, i, touched, sure, until
        if falls and touched < math.inf:
            speed = max(
                speed,
                low.V
                - bounds.velocity_at(low, row, min(max(bounds.peak_of(low, -1.0, row[bounds.SINCE]), touched), stop)),
            )
    return MISSED, 0, end, end, end


@part
def arrive(c, i, t, sure, until, after):
    """Write the interval of the main impact, from t on, and its speeds to `after`. Return whether it must come."""
    high, low, below = c.high, c.low, c.rows[0, i]
    paid, latest, least = sure + 0.5 * high.V, t, math.inf
    for j in range(1, c.counts[-1] + 1):
        row = c.rows[j, bounds.piece_at(c.rows[j], c.counts[j], sure)]
        if paid >= until or bounds.bound_at(high, row, until) >= -ROUNDING:
            return False
        if bounds.bound_at(high, row, paid) > 0.0:
            zero = bounds.bound_zero(high, row, 0.0, paid, until)
        else:
            zero = bounds.fall_zero(high, row, bounds.bound_at(high, row, sure) + 0.5 * high.V * high.V, sure, paid)
        latest = max(latest, zero)
    for j in range(1, c.counts[-1] + 1):
        row = c.rows[j, bounds.piece_at(c.rows[j], c.counts[j], sure)]
        least = min(least, -bounds.velocity_at(high, row, t) - high.V, -bounds.velocity_at(high, row, latest) - high.V)
    fastest = min(max(bounds.peak_of(low, -1.0, below[bounds.SINCE]), t), min(c.rows[0, i + 1, bounds.BEGIN], latest))
    after[FIRST], after[LAST], after[LEAST] = t, latest, least
    after[MOST] = low.V - bounds.velocity_at(low, below, fastest)
    if t < sure:
        after[LEAST] = 0.0
    return True


@part
def judge_touches(c, first, launch, near, after):
    """Write the speeds of touches before the main impact in `after` to it. The main impact before is at `first` or
    later, and touches in the rest after it are not faster than `near`."""
    low, half, before = c.low, first + PI, after[LAST] - PI
    after[NEAR] = near
    after[LONE] = after[FAR] if after[TOUCH_FIRST] < before and after[TOUCH_LAST] > half else 0.0
    if c.rows[0, 0 if low.V == 0.0 else 1, bounds.BEGIN] > half:  # touches before the mass rises for sure
        speed = low.V
        if half > launch:
            speed -= bounds.slide_velocity(low, 1.0, launch, half)
        elif half < PI - low.down or not bounds.fall_in_rest(low, c.m, first, half)[1]:
            speed = near  # falls faster than V have not all ended
        after[FAR] = max(after[FAR], speed)
        after[LONE] = max(after[LONE], speed if before > half else 0.0)


@part
def next_impact(c, impact, after):
    """Write the interval of the main impact that follows those in the interval of `impact` to `after`. Return a code.

    Phases of impacts are between the end of a window of launches, in which H > 1, and the end of the next one.
    """
    high, low, first, last = c.high, c.low, impact[FIRST] - PAD, impact[LAST] + PAD
    later = TWO_PI * impact[TURNS]
    zone, end = later - high.up - PI, later - low.up + PI
    if first <= -PI - high.up or last >= PI - low.up:
        return SHIFTED
    launch = max(last, low.up)
    near, sound = bounds.fall_in_rest(low, c.m, first, launch)
    if not sound:
        return FALL
    c.counts[-1] = 1
    c.counts[1] = bounds.trace(high, max(first, high.up), bounds.height_after_rest(high, first), end, c.rows[1])
    c.counts[0] = bounds.trace(low, launch, 0.0, end, c.rows[0])
    code, i, t, sure, until = descend(c, zone, end, after)
    if code != PROVED:
        return code
    if not arrive(c, i, t, sure, until, after):
        return MISSED
    if after[LAST] >= end:
        return SHIFTED
    judge_touches(c, first, launch, near, after)
    after[FIRST], after[LAST] = after[FIRST] - later, after[LAST] - later
    return PROVED


@inline
def stays_nearest(impacts, j, k, turn):
    """Return whether main impact j stays nearer to its place in the orbit than to that of k, `turn` periods later."""
    along = impacts[k, PHASE] + TWO_PI * turn - impacts[j, PHASE]
    up = impacts[k, SPEED] - impacts[j, SPEED]
    phase = (impacts[j, LAST] if along > 0.0 else impacts[j, FIRST]) - impacts[j, PHASE]
    speed = (impacts[j, MOST] if up > 0.0 else impacts[j, LEAST]) - impacts[j, SPEED]
    return along * phase + up * speed < 0.5 * (along * along + up * up) - 16.0 * PAD


@part
def judge(impacts, ordered):
    """Return PROVED if main impacts and touches keep the gaps of the orbit and, if `ordered`, its order."""
    count = len(impacts)
    least = slowest = math.inf
    near = far = lone = 0.0
    for j in range(count):
        least, slowest = min(least, impacts[j, LEAST]), min(slowest, impacts[j, SPEED])
        near, far, lone = max(near, impacts[j, NEAR]), max(far, impacts[j, FAR]), max(lone, impacts[j, LONE])
    if (far > 0.0 and far >= least) or lone >= SHARE * slowest or (count > 1 and near >= least):
        return TOUCH
    for j in range(count):
        k = (j + 1) % count
        gap = TWO_PI * np.floor((impacts[k, PHASE] - impacts[j, PHASE]) / TWO_PI + 0.5)
        if max(impacts[k, LAST] - impacts[j, FIRST] - gap, impacts[j, LAST] - impacts[k, FIRST] + gap) > PI - 4.0 * PAD:
            return ORDER
        for k in range(count):
            for turn in range(-1, 2):
                if ordered and (k != j or turn != 0) and not stays_nearest(impacts, j, k, turn):
                    return ORDER
    return PROVED


@part
def grow(c, impacts, after):
    """Enlarge the interval of each main impact by the impacts that follow those before it. Return (code, growth)."""
    growth = 0.0
    for j in range(len(impacts)):
        k = (j + 1) % len(impacts)
        code = next_impact(c, impacts[j], after)
        if code != PROVED:
            return code, growth
        for column in range(LEAST, LONE + 1):
            impacts[k, column] = after[column]
        early, late = impacts[k, FIRST] - after[FIRST], after[LAST] - impacts[k, LAST]
        if max(early, late) > PAD - ROUNDING:
            growth += max(early, 0.0) + max(late, 0.0)
        impacts[k, FIRST], impacts[k, LAST] = min(impacts[k, FIRST], after[FIRST]), max(impacts[k, LAST], after[LAST])
    return PROVED, growth


@part
def closes(c, ordered, impacts, after):
    """Return PROVED if the intervals grow until they return into themselves and the structure is kept in them.

    In the end they grow like a geometric series. In every eighth step they first grow by what is left of it, which may
    prove more than they need.
    """
    growth, ratio = math.inf, 1.0
    for step in range(STEPS):
        ahead = step % 8 == 7 and ratio < 1.0
        rest = 1.1 * ratio / (1.0 - ratio) if ahead else 0.0
        for j in range(len(impacts)):
            early, late = impacts[j, OLD_FIRST] - impacts[j, FIRST], impacts[j, LAST] - impacts[j, OLD_LAST]
            impacts[j, OLD_FIRST], impacts[j, OLD_LAST] = impacts[j, FIRST], impacts[j, LAST]
            if ahead:
                impacts[j, FIRST] -= rest * early
                impacts[j, LAST] += rest * late
        code, more = grow(c, impacts, after)
        if code == PROVED and more == 0.0:
            return judge(impacts, ordered)
        if ahead:
            for j in range(len(impacts)):
                impacts[j, FIRST], impacts[j, LAST] = impacts[j, OLD_FIRST], impacts[j, OLD_LAST]
            continue
        if code != PROVED:
            return code
        growth, ratio = more, more / growth
        if step > 24 and ratio >= 1.0:
            break
    return DRIFT


@part
def begin(A, B, phase, speed, gaps, orbit):
    """Write the main impacts of an orbit, with intervals that are points.

    If `orbit` has fewer rows, impacts share them in turn, and each row has the interval of all their phases.
    """
    done, count = PI - release_up(A, B)[0], len(phase)
    for j in range(count):
        row, k = orbit[j % len(orbit)], (j + 1) % count
        here = phase[j] if phase[j] < done else phase[j] - TWO_PI
        there = phase[k] if phase[k] < done else phase[k] - TWO_PI
        apart = phase[k] - phase[j]  # the time to the next impact is 2π gap + this difference in [-π, π)
        apart -= TWO_PI * np.floor(apart / TWO_PI + 0.5)
        turns = gaps[j] + np.floor((apart + here - there) / TWO_PI + 0.5)
        if j < len(orbit):
            row[PHASE], row[FIRST], row[LAST], row[SPEED], row[TURNS] = here, here, here, speed[j], turns
        row[FIRST] = min(row[FIRST], here) if turns == row[TURNS] else -math.inf
        row[LAST], row[SPEED] = max(row[LAST], here), min(row[SPEED], speed[j])


_LIKE = 0.0, 0.0, 0.0, False, False, (array(1),) * 3, array(2), array(2), array(3), array(1, np.int64), array(1)


@jit(like=_LIKE, _nrt=False)
def largest(A, B, m, of_force, ordered, cycle, orbit, impacts, rows, counts, after):
    """Return (value, code): the largest V proved beside a force m or, if `of_force`, the largest force; NaN if none.

    The code is what is not proved beyond it. `cycle` has phases, speeds and gaps of the main impacts of the orbit.
    `impacts` receives those at this value. The other arrays are memory.
    """
    phase, speed, gaps = cycle
    begin(A, B, phase, speed, gaps, orbit)
    low, high = 0.0, min(1.0 - B, A - 1.0 - B) if of_force else speed[0]
    value, beyond = LEAST_TRIED * (1.0 + A), NO_IMPACTS
    while True:
        V, force = (0.0, value) if of_force else (value, m)
        for j in range(len(orbit)):
            for column in range(len(after)):
                impacts[j, column] = orbit[j, column]
        code = NO_IMPACTS
        if B + force < 1.0 and 1.0 + B + force < A and force < 1.0 + B:
            sides = bounds.make_side(1.0, A, B - force, V), bounds.make_side(-1.0, A, B + force, V)
            code = closes(Pair(sides[0], sides[1], force, rows, counts), ordered, impacts, after)
        if code == PROVED:
            low = value
            if high <= low * RATIO:
                return low - MARGIN * (1.0 + A), beyond
        elif low == 0.0:
            return math.nan, code
        else:
            high, beyond = value, code
        middle = math.sqrt(low * high) if high > 2.0 * low else 0.5 * (low + high)
        value = middle if high > low * RATIO else low


class Tolerated(NamedTuple):
    """What the structure of an orbit tolerates for ever.

    velocity, force : V and m; NaN if nothing is proved.
    beyond, beyond_force : what is not proved beyond them.
    starts : first and last phase of each main impact under disturbances below V, float64 (m, 2).
    """

    velocity: float
    force: float
    beyond: Beyond
    beyond_force: Beyond
    starts: np.ndarray


def find_tolerated(A: float, B: float, cycle: ImpactCycle | None, ordered: bool = True) -> Tolerated:
    """Find what every disturbance may be of an orbit with the main impacts `cycle`, None if there are none.

    If not `ordered`, the gaps alone must be kept. Impacts that the same gaps follow may then change places.

    >>> find_tolerated(2.0, 0.1, None).beyond.name
    'NO_IMPACTS'
    """
    if cycle is None:
        return Tolerated(math.nan, math.nan, Beyond.NO_IMPACTS, Beyond.NO_IMPACTS, np.empty((0, 2)))
    force, beyond_force, _ = _largest(A, B, cycle, ordered)
    velocity, beyond, starts = _largest(A, B, cycle, ordered, 0.0)
    return Tolerated(velocity, force, beyond, beyond_force, starts)


def velocity_beside(A: float, B: float, cycle: ImpactCycle, force: float, ordered: bool = True) -> float:
    """Return the V of disturbances to which any force of at most `force` is added; NaN if none is proved."""
    return _largest(A, B, cycle, ordered, force)[0]


def _largest(
    A: float, B: float, cycle: ImpactCycle, ordered: bool, beside: float | None = None
) -> tuple[float, Beyond, np.ndarray]:
    """Return the largest V beside a force, or by default the largest force, with the other results of `largest`.

    The last result has the intervals of the phases of main impacts, float64 (m, 2).
    """
    gaps, columns = cycle.gaps, OLD_LAST + 1
    n = len(gaps)
    places = n if ordered else next(m for m in range(1, n + 1) if n % m == 0 and (gaps == np.resize(gaps[:m], n)).all())
    rows = np.empty((ABOVE + 1, bounds.PIECES * (int(gaps.max()) + 2), bounds.BOUND + 1))
    orbit, impacts = np.zeros((2, places, columns))
    memory = orbit, impacts, rows, np.empty(ABOVE + 2, np.int64), np.empty(columns)
    numbers = cycle.phase, cycle.speed, gaps.astype(np.float64)
    value, code = largest(A, B, beside or 0.0, beside is None, ordered, numbers, *memory)
    return value, Beyond(code), impacts[:, FIRST : LAST + 1]
