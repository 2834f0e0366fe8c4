"""Summary of a recorded motion in a few numbers, from its switches.

The summary of a motion of period n covers one period. Of any other motion, the extremes cover the recorded switches and
all segments between them, and the sums extend from a main impact to a main impact. At both ends ξ = ξ' = 0, so the
energy balance closes. Only complete flights count, so the means do not depend on the ends of the record. Without two
main impacts there are no means. Each segment is complete, begins with ξ' = 0 and has a closed form, so all sums are
exact:

* In each slide, friction dissipates the energy |Δξ|. An impact dissipates ½ξ'². Friction force and mass are 1 (§2).
* The excitation F = A sin τ + A ε η² sin ητ does the work ∫ F ξ' dτ. Let G be the integral of F, and
  ξ'' = F + L with L = -(B + s), where s is 1 in a slide up and -1 in a slide down. Then

      ∫ F ξ' dτ = [G ξ'] - ½ [G²] - L [∫ G dτ]

  where [X] is X at the end of the slide minus X at its beginning. This formula does not assume that the work of the
  excitation equals the dissipated energy, so the energy balance can be checked.
* Let the beginning of a slide be delayed by a small δφ₀, and let the gap there change by a small δξ₀. The changes at
  the end of the slide are δφ₁ and δξ₁. With the values a₀ and a₁ of ξ'' at the beginning and at the end, and the
  duration h,

      δξ₁ = δξ₀ - a₀ h δφ₀,    δφ₁ = a₀ δφ₀ / a₁   at a zero of ξ',    δφ₁ = -δξ₁ / ξ'   at an impact

  A wait ends at a known phase, so δφ = 0 after it. An impact sets δξ to 0. So these equations, applied to each slide
  from one impact to the next, give the derivative of the impact-phase map: the ratio of the delays of the two impacts.
  The mean of log |ratio| per period is the Lyapunov exponent (ε = 0).

record.py defines main impacts. Here a main impact counts only if switches more than half an excitation period before
and after it are recorded, because an impact outside the record might be faster.

**Extremes.** ξ is largest at a switch, unless a grid ends a slide late or misses two zeros of ξ'. In a slide of
direction s, s ξ' is largest at the end or, at ε = 0, at a known phase. In all other cases the largest value of f (ξ, ξ'
or -ξ') is searched for by steps over which f certainly nowhere exceeds the largest value so far. With the bounds
|f''| <= M2 and |f'''| <= M3, each of the following steps is safe, and the longest is taken:

* Up to the first positive root of f' + f''t - M3 t²/2, f increases, so its largest value is that at the end. The ends
  of these steps converge quadratically to the next peak.
* Up to the root of f + f't + M2 t²/2 = largest value so far. The same with the slow part of f, its smaller
  bound of f'', and the amplitude of the fast part added.
* Where f'' < 0, up to t = -2f''/M3 the third derivative adds at most -f''t²/3 to f. If then f + f't + f''t²/6 stays
  below the largest value so far, the whole step is safe. This step leaves a peak.

On a grid, s ξ' >= 0 at all grid points of a slide but the last, at which s ξ' = v. Between two grid points s ξ' is at
most d below the line through both values: the slow part is at most A Δτ²/8 below its own line, the fast part
A ε η³ Δτ²/8 or twice its amplitude. (At ε = 0 the least value -d of s ξ' before the end occurs at a known phase; d = 0
if it is positive.) So s ξ' >= -d, and s ξ' >= min(v, 0) - d in the last step. In a slide of duration h the gap
therefore exceeds that at the end of a slide up by at most d h + max(-v, 0) Δτ, and that at both ends of a slide down by
at most d h. Only slides in which these bounds exceed the extremes so far are searched.
"""

import math
from typing import NamedTuple

from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import PI, TWO_PI, arcsine, log, sincos
from vibrodrive.kernels import motion, release
from vibrodrive.kernels.codes import IMPACT, INFINITY, REST, STICK, UNKNOWN, UP
from vibrodrive.model.choices import LONGEST, UNSEEN

PERIOD, PHASE, BEFORE, AFTER, XI, DXI, COLUMNS = 0, 1, 2, 3, 4, 5, 6
"""Columns of a row that stores a switch, in the order of `Trajectory.switches`."""

SUMS = 10  # number of sums, the first of the totals

(
    # the sums: time in each of four states; of the impacts: number, Σ|ξ'| and Σ½ξ'²; friction loss; work of the
    # excitation; Σ log |δφ₁/δφ₀|
    TIME_UP, TIME_DOWN, TIME_STICK, TIME_REST, LANDED, MOMENTUM, ENERGY, FRICTION, DRIVE, GROWTH,
    # the same sums up to the last main impact, which a faster impact may still replace; up to the main impact before
    SUMS_MAIN, _, _, _, _, _, _, _, _, _, SUMS_KNOWN, _, _, _, _, _, _, _, _, _,
    # largest |ξ'| of an impact, largest ξ, least ξ', largest ξ'
    FASTEST, HIGHEST, LEAST, MOST,
    # time of the last switch, and F, -G and -∫G at this time, if they are known
    AT, FORCE, FIRST_INTEGRAL, SECOND_INTEGRAL,
    # phase φ at which H falls to 1 (NaN if there is none), and A cos φ at this phase; the same two for H rising to -1
    TURN_UP, COSINE_UP, TURN_DOWN, COSINE_DOWN,
    # δφ and δξ for the delay δφ = 1 of the last impact
    LATE, OFF,
    # time of the first switch; time and speed of the last main impact; time of the main impact before; number of main
    # impacts before the last one
    BEGAN, MAIN_TIME, MAIN_SPEED, MAIN_BEFORE, MAINS,
    # the last GAPS gaps, that is numbers of periods between main impacts; for each number n up to GAPS, 1 if the gaps
    # repeat after n gaps, otherwise 0
    GAP, _, _, _, _, _, _, _, REPEATS, _, _, _, _, _, _, _,
    TOTALS,
) = range(66)  # fmt: skip

GAPS = 8
"""Number of gaps in the longest cycle that is searched for. A gap is the rounded number of excitation periods between
two successive main impacts."""

(
    OUT_PERIOD, OUT_SEQUENCE, OUT_GAPS, OUT_IMPACTS, OUT_IMPACT_SPEED_MAX, OUT_IMPACT_SPEED_MEAN,
    OUT_XI_MAX, OUT_DXI_MIN, OUT_DXI_MAX, OUT_MOMENTUM, OUT_ENERGY, OUT_FRICTION_LOSS, OUT_DRIVE_WORK, OUT_LYAPUNOV,
    OUT_SHARE_UP, OUT_SHARE_DOWN, OUT_SHARE_STICK, OUT_SHARE_REST, OUT,
) = range(19)  # fmt: skip
"""Columns of a summary; model/records.py gives their meanings."""

REACH = 1024  # number of switches before the last one among which the period is searched for

SAME = 1e-6
"""A switch is a repetition of an earlier switch if time (less a period), ξ and ξ' differ by at most this value. A
smaller value would miss periods, because a motion approaches its orbit only like |multiplier|ⁿ."""

SETTLED = 1e-12  # largest difference of a switch from that a period before it that may be due to rounding


class Drive(NamedTuple):
    """Parameters of a motion: A, B, A ε η², η, the fractional part of η, and Δτ, which is NaN without a grid."""

    a: float
    b: float
    af: float
    eta: float
    frac: float
    step: float


@inline
def turn_of(s, a, b):
    """Return (φ, A cos φ) at the phase φ at which the slow part of s H falls to 1. Return (NaN, 0) if there is none."""
    level = (b + s) / a if a > 0.0 else 2.0
    if not abs(level) < 1.0:
        return UNKNOWN, 0.0
    size = abs(level)
    rising, cosine = arcsine(size, 1.0 - size), a * math.sqrt(1.0 - level * level)
    rising = rising if level > 0.0 else -rising
    return (PI - rising, -cosine) if s > 0.0 else (rising, cosine)


@inline
def time_of(rows, row):
    """Return τ of a switch. Its rounding error grows with the number of periods."""
    return rows[row, PERIOD] * TWO_PI + rows[row, PHASE]


@inline
def between(rows, a, b):
    """Return the time from switch a to switch b."""
    return (rows[b, PERIOD] - rows[a, PERIOD]) * TWO_PI + (rows[b, PHASE] - rows[a, PHASE])


@inline
def clear_totals(totals, a, b):
    """Set the totals of a motion to their initial values.

    TURN_UP, COSINE_UP, TURN_DOWN and COSINE_DOWN depend on A = a and B = b (`turn_of`).
    """
    for n in range(TOTALS):
        totals[n] = 0.0
    totals[TURN_UP], totals[COSINE_UP] = turn_of(1.0, a, b)
    totals[TURN_DOWN], totals[COSINE_DOWN] = turn_of(-1.0, a, b)
    totals[HIGHEST], totals[MAIN_TIME] = -INFINITY, -INFINITY
    totals[AT], totals[LATE] = UNKNOWN, 1.0
    for n in range(GAPS):
        totals[REPEATS + n] = 1.0


@inline
def forces(row, rows, drive):
    """Return (F, -G, -∫G, A cos φ) at a switch: F = A sin φ + AF sin θ and G = ∫F."""
    s, c = sincos(rows[row, PHASE])
    a, af, eta = drive.a, drive.af, drive.eta
    cosine = a * c
    force, first, second = a * s, cosine, a * s
    if af > 0.0:
        theta = motion.fast_phase(eta, drive.frac, rows[row, PERIOD], rows[row, PHASE], 0.0)
        sf, cf = sincos(theta)
        force += af * sf
        first += af * cf / eta
        second += af * sf / (eta * eta)
    return force, first, second, cosine


@inline
def slow_peak(s, direction, phi, h, g, slope, totals, best):
    """Return the largest maximum of s ξ' in a slide without the fast excitation, or `best` if this is larger.

    The slide begins at the phase `phi`. `direction` is that of the slide, h its duration, g is -G at its beginning, and
    `slope` is F - ξ''. In a maximum s ξ'' falls to 0.
    """
    turn, there = totals[TURN_UP], totals[COSINE_UP]
    if direction < 0.0:
        turn, there = totals[TURN_DOWN], totals[COSINE_DOWN]
    if s != direction:
        turn, there = PI - turn, -there
    turn -= phi
    turn -= math.floor(turn * (1.0 / TWO_PI)) * TWO_PI
    if turn < h:
        if s * slope < 0.0:  # s ξ' has one maximum in each period, and the last is the largest
            turn += math.floor((h - turn) * (1.0 / TWO_PI)) * TWO_PI
        best = max(best, s * (g - slope * turn - there))
    return best


@inline
def rise(value, slope, bend):
    """Return the positive t at which slope t + bend t²/2 = value, for value >= 0 and bend > 0."""
    root = math.sqrt(slope * slope + 2.0 * bend * value)
    return 2.0 * value / (slope + root) if slope > 0.0 else (root - slope) / bend


@part
def largest(gap, s, slope, row, rows, h, g, start, drive, best):
    """Return the largest ξ (if `gap`) or s ξ' of a slide that begins at switch `row`, or `best` if this is larger.

    `slope` is F - ξ'', h is the duration of the slide, g is -G at its beginning, and `start` is ξ - ∫G there. The head
    describes the search. The result may be too small by `least` (rounding), the least rise above `best` that is found.
    """
    a, af, eta = drive.a + 1e-300, drive.af, drive.eta  # a is a divisor, so not zero
    ripple = af / eta if af > 0.0 else 0.0
    phi = rows[row, PHASE]
    theta = motion.fast_phase(eta, drive.frac, rows[row, PERIOD], phi, 0.0)
    wave, slow_bend, second, third = ripple, a, a + af * eta, a + af * eta * eta
    if gap:
        wave, slow_bend, second, third = (
            (ripple / eta if af > 0.0 else 0.0),
            a + abs(slope),
            a + af + abs(slope),
            second,
        )
    least = 1e-15 * (a + ripple + (abs(best) if gap else 0.0))
    x = 0.0
    while x < h:
        sn, cs = sincos(phi + x)
        sf, cf = sincos(theta + eta * x)
        v, acceleration = g - slope * x - a * cs - ripple * cf, a * sn + af * sf - slope
        if gap:
            f, rate, bend = start + (g - 0.5 * slope * x) * x - a * sn - wave * sf, v, acceleration
            slow, slow_rate = f + wave * sf, v + ripple * cf
        else:
            f, rate, bend = s * v, s * acceleration, s * (a * cs + af * eta * cf)
            slow, slow_rate = f + s * ripple * cf, rate - s * af * sf
        best = max(best, f)
        step = rise(best - f + least, rate, second)
        if best - slow > wave:
            step = max(step, rise(best - slow - wave, slow_rate, slow_bend))
        if rate > 0.0:
            step = max(step, rise(rate, -bend, third))
        if bend < 0.0 and (rate <= 0.0 or 1.5 * rate * rate < -bend * (best - f + least)):
            step = max(step, -2.0 * bend / third)
        x += step
    return best


@inline
def fastest(s, direction, slope, row, rows, h, g, cosine, drive, totals, best):
    """Return the largest s ξ' of a slide that begins at switch `row`, or `best` if this is larger.

    The arguments are those of `slow_peak` and `largest`; `cosine` is A cos φ at the end. At the beginning of the slide
    the slow part of s ξ' is at most the amplitude of its fast part.
    """
    peak = slow_peak(s, direction, rows[row, PHASE], h, g, slope, totals, s * (g - slope * h - cosine))
    if drive.af == 0.0:
        return max(best, peak)
    ripple = drive.af / drive.eta
    if max(peak, ripple) + ripple <= best:
        return best
    return largest(False, s, slope, row, rows, h, g, 0.0, drive, best)


@part
def add_segment(rows, row0, row1, drive, totals):
    """Add the segment between two successive switches, and the second of these switches, to the totals."""
    state, h = int(rows[row0, AFTER]), between(rows, row0, row1)
    if state == IMPACT:
        return
    totals[state] += h
    x0, x1 = rows[row0, XI], rows[row1, XI]
    landed = int(rows[row1, AFTER]) == IMPACT
    if landed:
        x1 = 0.0
    totals[HIGHEST] = max(totals[HIGHEST], x0, x1)
    if state == STICK or state == REST:
        totals[LATE] *= 0.0
        return
    s = 1.0 if state == UP else -1.0
    v = rows[row1, DXI]
    slope = drive.b + s
    if totals[AT] == time_of(rows, row0):
        f0, g0, i0 = totals[FORCE], totals[FIRST_INTEGRAL], totals[SECOND_INTEGRAL]
    else:
        f0, g0, i0, _ = forces(row0, rows, drive)
    f1, g1, i1, cosine = forces(row1, rows, drive)
    totals[AT] = time_of(rows, row1)
    totals[FORCE], totals[FIRST_INTEGRAL], totals[SECOND_INTEGRAL] = f1, g1, i1
    if drive.step > 0.0 and s * (f0 - slope) < 0.0:
        slope = f0  # ξ'' = 0 after a wait that Muller's method has ended early, as in `begin` (switch.py)
    totals[FRICTION] += abs(x1 - x0)
    totals[DRIVE] += -g1 * v - 0.5 * (g1 * g1 - g0 * g0) - slope * (i1 - i0)
    a0, a1 = f0 - slope, f1 - slope
    ahead, back = totals[MOST], -totals[LEAST]
    if s < 0.0:
        ahead, back = back, ahead
    ahead = fastest(s, s, slope, row0, rows, h, g0, cosine, drive, totals, max(ahead, s * v))
    if drive.step > 0.0:
        late, square = max(-s * v, 0.0), 0.125 * drive.step * drive.step
        if drive.af > 0.0:
            dip = drive.a * square + drive.af * min(2.0 / drive.eta, drive.eta * square)
        else:
            dip = slow_peak(-s, s, rows[row0, PHASE], h, g0, slope, totals, 0.0)
        if late + dip > back:
            back = fastest(-s, s, slope, row0, rows, h, g0, cosine, drive, totals, max(back, late))
        if (x1 + late * drive.step if s > 0.0 else max(x0, x1)) + dip * h > totals[HIGHEST]:
            totals[HIGHEST] = largest(True, s, slope, row0, rows, h, g0, x0 + i0, drive, totals[HIGHEST])
    totals[MOST] = ahead if s > 0.0 else back
    totals[LEAST] = -back if s > 0.0 else -ahead
    totals[OFF] -= a0 * h * totals[LATE]
    if not landed:
        totals[LATE] *= a0 / a1
        return
    totals[LATE] = -totals[OFF] / v
    totals[OFF] = 0.0
    add_impact(abs(v), totals)


@inline
def add_impact(speed, totals):
    """Add an impact, and the growth of a delay from the last impact to this one, to the totals."""
    totals[LANDED] += 1.0
    totals[FASTEST] = max(totals[FASTEST], speed)
    totals[MOMENTUM] += speed
    totals[ENERGY] += 0.5 * speed * speed
    late = abs(totals[LATE])
    totals[GROWTH] += log(late) if late > 0.0 else -INFINITY
    totals[LATE] = 1.0


@inline
def keep_gap(known, totals):
    """Store the number of periods between the last two main impacts as gap number `known`, counted from 0."""
    gap = math.floor((totals[MAIN_TIME] - totals[MAIN_BEFORE]) / TWO_PI + 0.5)
    for n in range(GAPS):
        if known > n and totals[GAP + (known - 1 - n) % GAPS] != gap:
            totals[REPEATS + n] = 0.0
    totals[GAP + known % GAPS] = gap


@inline
def keep_main(totals):
    """Count the last main impact, because no faster impact follows: keep the gap before it, and the sums up to it."""
    if not totals[MAIN_TIME] - totals[BEGAN] > PI:
        return
    mains = int(totals[MAINS])
    if mains > 0:
        keep_gap(mains - 1, totals)
    for n in range(SUMS):
        totals[SUMS_KNOWN + n] = totals[SUMS_MAIN + n]
    totals[MAIN_BEFORE] = totals[MAIN_TIME]
    totals[MAINS] += 1.0


@part
def add_main(rows, row, totals):
    """If the switch in `row` is an impact, update the main impacts. The sums begin at the first one that counts."""
    if int(rows[row, AFTER]) != IMPACT:
        return
    time, speed = time_of(rows, row), -rows[row, DXI]
    if time - totals[MAIN_TIME] > PI:
        keep_main(totals)
    elif speed <= totals[MAIN_SPEED]:
        return
    totals[MAIN_TIME], totals[MAIN_SPEED] = time, speed
    for n in range(SUMS):
        if totals[MAINS] == 0.0:
            totals[n] = 0.0
        totals[SUMS_MAIN + n] = totals[n]


@inline
def digits_of(gaps, length, last):
    """Return a cycle of `length` gaps as a number with one digit for each gap. Return 0 if a gap is not in 1 ... 9.

    The digits are in order of time. Each rotation of the cycle gives one such number. The result is the smallest of
    these numbers. `gaps` contains gap k at index k mod GAPS. The cycle ends with gap number `last`.
    """
    least = INFINITY
    for turn in range(length):
        digits = 0.0
        for n in range(length):
            later = turn + n
            later -= length if later >= length else 0
            gap = gaps[(last + 1 - length + later) % GAPS]
            if gap < 1.0 or gap > 9.0:
                return 0.0
            digits = 10.0 * digits + gap
        least = min(least, digits)
    return least


@inline
def gap_cycle(totals):
    """Return the shortest cycle of the gaps of a record as a number (`digits_of`). Return 0 without a cycle.

    Return UNSEEN if the record is too short to show a cycle twice.
    """
    known = int(totals[MAINS]) - 1
    for length in range(1, GAPS + 1):
        if totals[REPEATS + length - 1] == 1.0:
            return digits_of(totals[GAP : GAP + GAPS], length, known - 1) if known >= 2 * length else UNSEEN
    return 0.0


@part
def gap_cycle_of_period(rows, last, count, n, totals):
    """Return the cycle of gaps of a motion of period n as a number (`digits_of`), from its fastest impact on.

    One period consists of the `count` switches up to row `last`.
    """
    first = last - count + 1
    main, speed = -1, 0.0
    for row in range(last, first - 1, -1):
        if int(rows[row, AFTER]) == IMPACT and -rows[row, DXI] > speed:
            main, speed = row, -rows[row, DXI]
    if main < 0:
        return 0.0
    for length in range(GAPS):
        totals[REPEATS + length] = 1.0
    start = time_of(rows, main)
    totals[MAIN_TIME], totals[MAIN_BEFORE], totals[MAIN_SPEED] = start, start - TWO_PI, speed
    kept = 0
    for step in range(main + 1, main + count + 1):
        row = step if step <= last else step - count
        if int(rows[row, AFTER]) == IMPACT:
            turned = float(n) if step > last else 0.0
            time, fast = (rows[row, PERIOD] + turned) * TWO_PI + rows[row, PHASE], -rows[row, DXI]
            if time - totals[MAIN_TIME] <= PI:
                if fast > totals[MAIN_SPEED]:
                    totals[MAIN_TIME], totals[MAIN_SPEED] = time, fast
                continue
            if kept > 0:
                keep_gap(kept - 1, totals)
            kept += 1
            totals[MAIN_BEFORE] = totals[MAIN_TIME]
            totals[MAIN_TIME], totals[MAIN_SPEED] = time, fast
    if kept == 0:
        return 0.0
    keep_gap(kept - 1, totals)
    for length in range(1, min(kept, GAPS) + 1):
        if kept % length == 0 and totals[REPEATS + length - 1] == 1.0:
            return digits_of(totals[GAP : GAP + GAPS], length, kept - 1)
    return 0.0


@inline
def alike(rows, a, b, n):
    """Return whether switch b is the same as switch a, n periods later, within SAME."""
    return (
        rows[a, AFTER] == rows[b, AFTER]
        and abs(between(rows, a, b) - n * TWO_PI) <= SAME
        and abs(rows[a, XI] - rows[b, XI]) <= SAME
        and abs(rows[a, DXI] - rows[b, DXI]) <= SAME
    )


@part
def find_period(rows, first, last):
    """Return (n, number of switches in n periods) if the switches first … last repeat after n periods, else (0, 0).

    The last n periods are compared with the n periods before, as far as these are in the rows first … last.
    """
    for j in range(last - 1, first - 1, -1):
        n = math.floor(between(rows, j, last) * (1.0 / TWO_PI) + 0.5)
        if n > LONGEST:
            break
        if n >= 1 and alike(rows, j, last, n):
            back = 1
            while j - back >= first and back < last - j and alike(rows, j - back, last - back, n):
                back += 1
            if j - back < first or back == last - j:
                return int(n), last - j
    return 0, 0


@inline
def apart(rows, row, back, n):
    """Return how far apart, in time, ξ and ξ' together, a switch is from that `back` rows before, n periods earlier."""
    a, late = row - back, between(rows, row - back, row) - n * TWO_PI
    return abs(late) + abs(rows[row, XI] - rows[a, XI]) + abs(rows[row, DXI] - rows[a, DXI])


@part
def lasting_period(rows, first, last, count, n, growth):
    """Return the period that a motion keeps whose last `count` switches repeat after n periods: n, n/2 or UNSEEN.

    Near a period doubling a motion alternates about an orbit, by d, while n periods change it by less than SAME. By the
    normal form d' = μ d - c d³, the rate -d'/d at which d falls, as a share of that of a small difference from the
    motion, 3 c d² - μ (`growth`, for n periods), exceeds 1/3 if μ < 0, so that d falls to 0. Otherwise it does not.
    """
    half, now, before = count // 2, 0.0, 0.0
    for row in range(last, last - half, -1):
        if n % 2 == 1 or count % 2 == 1 or rows[row, AFTER] != rows[row - half, AFTER]:
            return n
        if row - count - half >= first:
            now += apart(rows, row, half, 0.5 * n)
            before += apart(rows, row - count, half, 0.5 * n)
    if now == 0.0:  # the record is shorter than 1.5 n
        return n if apart(rows, last, count, float(n)) <= SETTLED else UNSEEN
    return n // 2 if 0.0 < -growth < 3.0 * log(before / now) else n


@inline
def may_repeat(rows, first, last, drive):
    """Return whether a motion may have a period up to LONGEST that the switches first … last are too few to show.

    With a disturbance the motion has no period n if the excitation differs after n periods.
    """
    seen = math.floor((between(rows, first, last) + SAME) * (1.0 / TWO_PI)) if last > first else 0.0
    for n in range(int(seen) + 1, LONGEST + 1):
        turn = n * drive.frac
        if drive.af * TWO_PI * abs(turn - math.floor(turn + 0.5)) <= SAME:
            return True
    return False


MODULUS = 9007199254740881
"""Modulus of sequence numbers, the largest prime below 2⁵³. A sequence of up to 20 states gives a smaller number, whose
digits in base 6 are the codes of the states plus 1."""


@inline
def shortest_cycle(rows, first, count):
    """Return the length of the shortest sequence of states that the `count` switches from row `first` on repeat."""
    for length in range(1, count // 2 + 1):
        n = length
        while n < count and rows[first + n, AFTER] == rows[first + n - length, AFTER]:
            n += 1
        if n == count and count % length == 0:
            return length
    return count


@inline
def least_rotation(rows, first, length):
    """Return the number of switches by which a cycle of `length` states must be rotated.

    The rotated cycle is the first one of all rotations of the cycle in lexicographic order.
    """
    start = 0
    for turn in range(1, length):
        for n in range(length):
            one, other = start + n, turn + n
            one -= length if one >= length else 0
            other -= length if other >= length else 0
            difference = rows[first + other, AFTER] - rows[first + one, AFTER]
            if difference != 0.0:
                if difference < 0.0:
                    start = turn
                break
    return start


@part
def sequence_number(rows, last, count):
    """Return a number for the cycle of states of the `count` switches up to `last`. Equal cycles have equal numbers.

    The number is computed from the shortest sequence of which the cycle consists, in the rotation of this sequence that
    is first in lexicographic order.
    """
    first = last - count + 1
    length = shortest_cycle(rows, first, count)
    start = least_rotation(rows, first, length)
    number = 0
    for n in range(start, start + length):
        number = 6 * number + int(rows[first + (n if n < length else n - length), AFTER]) + 1
        if number >= MODULUS:
            number %= MODULUS
    return number


@part
def add_switches(rows, first, end, drive, totals):
    """Add the switches in rows first … end - 1 to the totals. If first = 0, the totals begin at row 0."""
    if first == 0 and end > 0:
        clear_totals(totals, drive.a, drive.b)
        totals[BEGAN], speed = time_of(rows, 0), rows[0, DXI]
        landed = int(rows[0, AFTER]) == IMPACT
        totals[HIGHEST], totals[FASTEST] = (0.0, abs(speed)) if landed else (rows[0, XI], 0.0)
        totals[LEAST], totals[MOST] = min(speed, 0.0), max(speed, 0.0)
        add_main(rows, 0, totals)
    for k in range(max(first, 1), end):
        add_segment(rows, k - 1, k, drive, totals)
        add_main(rows, k, totals)


@part
def add_period(rows, last, count, drive, totals):
    """Let the totals be those of the period that consists of the `count` switches up to row `last`.

    If there is an impact, the period begins and ends at one, because a delay grows from impact to impact. The switches
    before this impact then follow those after it.
    """
    start = last
    while start > last - count and int(rows[start, AFTER]) != IMPACT:
        start -= 1
    if start == last - count:
        start = last
    if start >= count:  # the switches of a whole period before this impact are known, too
        last = start
    clear_totals(totals, drive.a, drive.b)
    for k in range(start + 1, start + count + 1):
        row = k if k <= last else k - count
        add_segment(rows, row - 1, row, drive, totals)
    if totals[LANDED] == 0.0:
        totals[GROWTH] = UNKNOWN


@part
def summarise(rows, added, count, state, x, drive, totals, out):
    """Compute the summary of a motion from its last switches, which are in rows 0 … count - 1.

    `totals` already includes the switches before row `added`. If added > 0, `totals` also includes earlier switches
    that are no longer in the rows. `state` is the state in which the motion ends, and x is ξ at the beginning of this
    state.
    """
    last, first = count - 1, max(0, count - REACH)
    n, switches, sequence, gaps, sums = 0, 0, 0, 0.0, 0
    if (state == STICK or state == REST) and not release.can_end(state, drive.a + drive.af, drive.b):
        n = 1
        clear_totals(totals, drive.a, drive.b)
        totals[HIGHEST], totals[state], totals[GROWTH] = x, TWO_PI, -INFINITY
    else:
        n, switches = find_period(rows, first, last)
        if switches > 0:
            gaps = gap_cycle_of_period(rows, last, switches, n, totals)
            sequence = sequence_number(rows, last, switches)
            add_period(rows, last, switches, drive, totals)
        else:
            if count == 0:
                clear_totals(totals, drive.a, drive.b)
            add_switches(rows, added, count, drive, totals)
            if count > 0 and time_of(rows, last) - totals[MAIN_TIME] > PI:
                keep_main(totals)
            gaps, sums = gap_cycle(totals), SUMS_KNOWN
            if may_repeat(rows, first, last, drive):
                n, sequence = UNSEEN, UNSEEN
    write_summary(n, sequence, gaps, sums, drive.af, totals, out)
    if switches > 0:
        out[OUT_PERIOD] = float(lasting_period(rows, first, last, switches, n, totals[GROWTH]))


@inline
def write_summary(n, sequence, gaps, sums, af, totals, out):
    """Write the summary `out`: period n, sequence, gaps, and the sums from `sums` on, divided by their duration."""
    time = 0.0
    for k in range(4):
        time += totals[sums + TIME_UP + k]
    time = time if time > 0.0 else UNKNOWN
    duration = float(n) if n > 0 else time / TWO_PI
    out[OUT_PERIOD], out[OUT_SEQUENCE], out[OUT_GAPS] = float(n), float(sequence), gaps
    landed = totals[sums + LANDED]
    out[OUT_IMPACTS] = landed / duration
    out[OUT_IMPACT_SPEED_MEAN] = totals[sums + MOMENTUM] / landed if landed > 0.0 else 0.0 * duration
    known = totals[HIGHEST] >= 0.0
    out[OUT_IMPACT_SPEED_MAX] = totals[FASTEST] if n > 0 or totals[FASTEST] > 0.0 else UNKNOWN
    out[OUT_XI_MAX] = totals[HIGHEST] if known else UNKNOWN
    out[OUT_DXI_MIN] = totals[LEAST] if known else UNKNOWN
    out[OUT_DXI_MAX] = totals[MOST] if known else UNKNOWN
    out[OUT_MOMENTUM], out[OUT_ENERGY] = totals[sums + MOMENTUM] / duration, totals[sums + ENERGY] / duration
    out[OUT_FRICTION_LOSS], out[OUT_DRIVE_WORK] = totals[sums + FRICTION] / duration, totals[sums + DRIVE] / duration
    out[OUT_LYAPUNOV] = totals[sums + GROWTH] / duration if af == 0.0 and n != UNSEEN else UNKNOWN
    for k in range(4):
        out[OUT_SHARE_UP + k] = totals[sums + TIME_UP + k] / time
