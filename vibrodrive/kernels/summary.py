"""Summary of a recorded motion in a few numbers, from its switches.

The summary of a motion of period n covers one period, from an impact to the same impact n excitation periods later. The
summary of any other motion covers the time from the first recorded switch to the last. Each segment in this time is
complete, begins with ξ' = 0 and has a closed form, so all sums are exact:

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

record.py defines main impacts. Here the first and the last main impact of a record are omitted, because an impact
outside the record may be faster than one of these.
"""

import math
from typing import NamedTuple

from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import PI, TWO_PI, sincos
from vibrodrive.kernels import motion, release
from vibrodrive.kernels.codes import IMPACT, INFINITY, REST, STICK, UNKNOWN, UP

PERIOD, PHASE, BEFORE, AFTER, XI, DXI, COLUMNS = 0, 1, 2, 3, 4, 5, 6
"""Columns of a row that stores a switch, in the order of `Trajectory.switches`."""

(
    # time in each of four states; of the impacts: number, largest |ξ'|, Σ|ξ'| and Σ½ξ'²; friction loss;
    # work of the excitation; largest ξ, least ξ', largest ξ'
    TIME_UP, TIME_DOWN, TIME_STICK, TIME_REST, LANDED, FASTEST, MOMENTUM, ENERGY, FRICTION, DRIVE, HIGHEST, LEAST, MOST,
    # time of the last switch, and F, -G and -∫G at this time, if they are known
    AT, FORCE, FIRST_INTEGRAL, SECOND_INTEGRAL,
    # phase φ at which H falls to 1 (NaN if there is none), and A cos φ at this phase; the same two for H rising to -1
    TURN_UP, COSINE_UP, TURN_DOWN, COSINE_DOWN,
    # Σ log |δφ₁/δφ₀|; δφ and δξ for the delay δφ = 1 of the last impact; times of the first and the last impact
    GROWTH, LATE, OFF, FIRST, LAST,
    # time and speed of the last main impact, which a faster impact may still replace; time of the main impact before;
    # number of main impacts
    MAIN_TIME, MAIN_SPEED, MAIN_BEFORE, MAINS,
    # the last GAPS gaps, that is numbers of periods between main impacts; for each number n up to GAPS, 1 if the gaps
    # repeat after n gaps, otherwise 0
    GAP, _, _, _, _, _, _, _, REPEATS, _, _, _, _, _, _, _,
    TOTALS,
) = range(47)  # fmt: skip

GAPS = 8
"""Number of gaps in the longest cycle that is searched for. A gap is the rounded number of excitation periods between
two successive main impacts."""

(
    OUT_PERIOD, OUT_SEQUENCE, OUT_GAPS, OUT_IMPACTS, OUT_IMPACT_SPEED_MAX, OUT_IMPACT_SPEED_MEAN,
    OUT_XI_MAX, OUT_DXI_MIN, OUT_DXI_MAX, OUT_MOMENTUM, OUT_ENERGY, OUT_FRICTION_LOSS, OUT_DRIVE_WORK, OUT_LYAPUNOV,
    OUT_SHARE_UP, OUT_SHARE_DOWN, OUT_SHARE_STICK, OUT_SHARE_REST, OUT,
) = range(19)  # fmt: skip
"""Columns of a summary; model/records.py gives their meanings."""

LONGEST = 64  # longest period of a motion that is searched for, in excitation periods
REACH = 1024  # number of switches before the last one among which the period is searched for

SAME = 1e-6
"""A switch is a repetition of an earlier switch if time (less a period), ξ and ξ' differ by at most this value. A
smaller value would miss periods, because a motion approaches its orbit only like |multiplier|ⁿ."""


class Drive(NamedTuple):
    """Parameters of a motion: A, B, A ε η², η and the fractional part of η."""

    a: float
    b: float
    af: float
    eta: float
    frac: float


@inline
def turn_of(s, a, b):
    """Return (φ, A cos φ) at the phase φ at which the slow part of s H falls to 1. Return (NaN, 0) if there is none."""
    level = (b + s) / a if a > 0.0 else 2.0
    if not abs(level) < 1.0:
        return UNKNOWN, 0.0
    rising, cosine = math.asin(level), a * math.sqrt(1.0 - level * level)
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
    totals[HIGHEST] = -INFINITY
    totals[LEAST] = INFINITY
    totals[MOST] = -INFINITY
    totals[AT], totals[LATE], totals[FIRST] = UNKNOWN, UNKNOWN, UNKNOWN
    for n in range(GAPS):
        totals[REPEATS + n] = 1.0


@inline
def begin_totals(rows, row, totals):
    """Begin the totals at a switch. If this switch is an impact, the growth of a delay also begins there."""
    if int(rows[row, AFTER]) == IMPACT:
        totals[LATE], totals[FIRST] = 1.0, time_of(rows, row)


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
def slow_peak(s, phi, h, g, cosine, slope, totals):
    """Return the largest s ξ' of a slide of direction s that begins at the phase `phi`, without the fast excitation.

    h is the duration of the slide, g is -G at its beginning, `cosine` is A cos φ at its end, and `slope` is B + s. The
    largest value occurs where s H falls to 1, or at the end of the slide.
    """
    best = s * (g - slope * h - cosine)
    turn = (totals[TURN_UP] if s > 0.0 else totals[TURN_DOWN]) - phi
    turn -= math.floor(turn * (1.0 / TWO_PI)) * TWO_PI
    if turn < h:
        if s * slope < 0.0:  # |ξ'| has one maximum in each period, and the last is the largest
            turn += math.floor((h - turn) * (1.0 / TWO_PI)) * TWO_PI
        best = max(best, s * (g - slope * turn - (totals[COSINE_UP] if s > 0.0 else totals[COSINE_DOWN])))
    return best


@part
def fast_peak(s, row, rows, h, g, slow, drive, least):
    """Return the largest s ξ' of a slide that begins at switch `row`, with a disturbance, or `least` if this is larger.

    h and g are those of `slow_peak`, and `slow` is its result. If the fast part can raise this value above `least`, ξ'
    is evaluated at eight points of each fast period. The largest of these values is refined by Newton's method, applied
    to ξ'' = H - s.
    """
    a, b, af, eta = drive.a, drive.b, drive.af, drive.eta
    phi = rows[row, PHASE]
    ripple = af / eta
    if slow + ripple <= least:
        return least
    theta = motion.fast_phase(eta, drive.frac, rows[row, PERIOD], phi, 0.0)
    step = TWO_PI / (8.0 * max(eta, 1.0))
    count = int(h / step) + 1
    at, best = 0.0, -INFINITY
    for n in range(count + 1):
        x = min(n * step, h)
        v = s * (g - (b + s) * x - a * sincos(phi + x)[1] - ripple * sincos(theta + eta * x)[1])
        if v > best:
            best, at = v, x
    for _ in range(5):
        sn, cs = sincos(phi + at)
        sf, cf = sincos(theta + eta * at)
        bend = a * cs + af * eta * cf
        if bend * s < 0.0:
            at = min(max(at - (a * sn + af * sf - b - s) / bend, 0.0), h)
    v = s * (g - (b + s) * at - a * sincos(phi + at)[1] - ripple * sincos(theta + eta * at)[1])
    return max(least, best, v)


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
    totals[FRICTION] += abs(x1 - x0)
    totals[DRIVE] += -g1 * v - 0.5 * (g1 * g1 - g0 * g0) - slope * (i1 - i0)
    peak = slow_peak(s, rows[row0, PHASE], h, g0, cosine, slope, totals)
    fastest = totals[MOST] if s > 0.0 else -totals[LEAST]
    if drive.af > 0.0:
        peak = fast_peak(s, row0, rows, h, g0, peak, drive, fastest)
    fastest = max(fastest, peak)
    totals[MOST] = fastest if s > 0.0 else totals[MOST]
    totals[LEAST] = totals[LEAST] if s > 0.0 else -fastest
    a0, a1 = f0 - slope, f1 - slope
    totals[OFF] -= a0 * h * totals[LATE]
    if not landed:
        totals[LATE] *= a0 / a1
        return
    totals[LATE] = -totals[OFF] / v
    totals[OFF] = 0.0
    add_impact(time_of(rows, row1), -v, totals)


@inline
def add_impact(time, speed, totals):
    """Add an impact, and the growth of a delay from the last impact to this one, to the totals."""
    totals[LANDED] += 1.0
    totals[FASTEST] = max(totals[FASTEST], speed)
    totals[MOMENTUM] += speed
    totals[ENERGY] += 0.5 * speed * speed
    if totals[FIRST] != totals[FIRST]:
        totals[FIRST] = time
    else:
        late = abs(totals[LATE])
        totals[GROWTH] += math.log(late) if late > 0.0 else -INFINITY
    totals[LAST] = time
    totals[LATE] = 1.0


@inline
def keep_gap(known, totals):
    """Store the number of periods between the last two main impacts as gap number `known`, counted from 0."""
    gap = math.floor((totals[MAIN_TIME] - totals[MAIN_BEFORE]) / TWO_PI + 0.5)
    for n in range(GAPS):
        if known > n and totals[GAP + (known - 1 - n) % GAPS] != gap:
            totals[REPEATS + n] = 0.0
    totals[GAP + known % GAPS] = gap


@part
def add_gap(rows, row, totals):
    """If the switch in `row` is an impact, update the main impacts and their gaps."""
    if int(rows[row, AFTER]) != IMPACT:
        return
    time, speed = time_of(rows, row), -rows[row, DXI]
    if totals[MAINS] > 0.0 and time - totals[MAIN_TIME] <= PI:
        if speed > totals[MAIN_SPEED]:
            totals[MAIN_TIME], totals[MAIN_SPEED] = time, speed
        return
    if totals[MAINS] > 2.0:  # the gap after the first main impact is omitted
        keep_gap(int(totals[MAINS]) - 3, totals)
    totals[MAIN_BEFORE] = totals[MAIN_TIME]
    totals[MAIN_TIME], totals[MAIN_SPEED] = time, speed
    totals[MAINS] += 1.0


@inline
def digits_of(gaps, length, last):
    """Return a cycle of `length` gaps as a number with one digit for each gap. Return 0 if a gap is not in 1 ... 9.

    Each rotation of the cycle gives one such number. The result is the smallest of these numbers. `gaps` contains
    gap k at index k mod GAPS. The cycle ends with gap number `last`.
    """
    least = INFINITY
    for turn in range(length):
        digits = 0.0
        for n in range(length):
            back = turn + n
            back -= length if back >= length else 0
            gap = gaps[(last - back) % GAPS]
            if gap < 1.0 or gap > 9.0:
                return 0.0
            digits = 10.0 * digits + gap
        least = min(least, digits)
    return least


@inline
def gap_cycle(totals):
    """Return the shortest cycle of the gaps of a record as a number (`digits_of`). Return 0 without a cycle."""
    known = int(totals[MAINS]) - 3
    for length in range(1, GAPS + 1):
        if totals[REPEATS + length - 1] == 1.0 and known >= 2 * length:
            return digits_of(totals[GAP : GAP + GAPS], length, known - 1)
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
        add_gap(rows, 0, totals)
        begin_totals(rows, 0, totals)
    for k in range(max(first, 1), end):
        add_gap(rows, k, totals)
        add_segment(rows, k - 1, k, drive, totals)


@part
def summarise(rows, added, count, state, x, drive, totals, out):
    """Compute the summary of a motion from its last switches, which are in rows 0 … count - 1.

    `totals` already includes the switches before row `added`. If added > 0, `totals` also includes earlier switches
    that are no longer in the rows. `state` is the state in which the motion ends, and x is ξ at the beginning of this
    state.
    """
    last, n, switches, gaps, sequence = count - 1, 0, 0, 0.0, 0
    resting = (state == STICK or state == REST) and not release.can_end(state, drive.a + drive.af, drive.b)
    if resting:
        n = 1
        clear_totals(totals, drive.a, drive.b)
        totals[HIGHEST], totals[LEAST], totals[MOST] = x, 0.0, 0.0
        totals[state], totals[GROWTH] = TWO_PI, -INFINITY
        totals[FIRST], totals[LAST] = 0.0, TWO_PI
    elif count > 0:
        n, switches = find_period(rows, max(0, count - REACH), last)
    if switches > 0:
        for back in range(min(switches, last - switches + 1)):  # let the period end at an impact, if there is one
            if int(rows[last - back, AFTER]) == IMPACT:
                last -= back
                break
        gaps = gap_cycle_of_period(rows, last, switches, n, totals)
        sequence = sequence_number(rows, last, switches)
        clear_totals(totals, drive.a, drive.b)
        begin_totals(rows, last - switches, totals)
        for k in range(last - switches + 1, last + 1):
            add_segment(rows, k - 1, k, drive, totals)
    elif not resting:
        if count == 0:
            clear_totals(totals, drive.a, drive.b)
        add_switches(rows, added, count, drive, totals)
        gaps = gap_cycle(totals)
    duration = float(n)
    if n == 0:
        duration = totals[TIME_UP] + totals[TIME_DOWN] + totals[TIME_STICK] + totals[TIME_REST]
        duration = duration / TWO_PI if duration > 0.0 else UNKNOWN
    write_summary(n, sequence, gaps, duration, drive.af, totals, out)


@inline
def write_summary(n, sequence, gaps, duration, af, totals, out):
    """Write the summary `out`: n (0: no period found), sequence, gaps, and totals divided by `duration`, in periods."""
    out[OUT_PERIOD], out[OUT_SEQUENCE], out[OUT_GAPS] = float(n), float(sequence), gaps
    out[OUT_IMPACTS] = totals[LANDED] / duration
    out[OUT_IMPACT_SPEED_MAX] = totals[FASTEST]
    out[OUT_IMPACT_SPEED_MEAN] = totals[MOMENTUM] / totals[LANDED] if totals[LANDED] > 0.0 else 0.0
    known = totals[HIGHEST] >= 0.0
    out[OUT_XI_MAX] = totals[HIGHEST] if known else UNKNOWN
    out[OUT_DXI_MIN] = totals[LEAST] if totals[LEAST] < INFINITY else (0.0 if known else UNKNOWN)
    out[OUT_DXI_MAX] = totals[MOST] if totals[MOST] > -INFINITY else (0.0 if known else UNKNOWN)
    out[OUT_MOMENTUM], out[OUT_ENERGY] = totals[MOMENTUM] / duration, totals[ENERGY] / duration
    out[OUT_FRICTION_LOSS], out[OUT_DRIVE_WORK] = totals[FRICTION] / duration, totals[DRIVE] / duration
    span = (totals[LAST] - totals[FIRST]) / TWO_PI
    grown = totals[GROWTH] / span if span > 0.0 else UNKNOWN
    out[OUT_LYAPUNOV] = grown if af == 0.0 else UNKNOWN
    for k in range(4):
        out[OUT_SHARE_UP + k] = totals[TIME_UP + k] / (duration * TWO_PI)
