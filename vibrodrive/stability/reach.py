"""All motions that begin at rest at the obstacle in an interval of phases: when they touch the obstacle next.

A *line* is a fixed force H(t) = A sin t + V η sin(ψ + ηt) - B. A *cell* is a set of forces close to that of a line, and
the functions here enclose the motions under all of them. The steps of the proof (docs/stability.md) used here:

(1) Friction contracts. If the integrals of two forces differ by at most d, apart from a constant, then the velocities
of two free motions, which ignore the obstacle, from one state differ by at most 2d, and their positions after a time h
by d h and the integral of that difference: at most 2d/η if it is a ripple, slow min(h, 2) if it changes as slowly as
sin t. Rounding, and whatever happens at a zero of ξ' that is only nearly one, adds to d.

(2) Free motions under one force do not overtake each other in ξ'. So the motions that leave the obstacle between two
times are between the free motions from the first time, the *upper* one, and from the last, the *lower* one.

(3) They all have touched the obstacle when the upper one is below it. One of them can touch it only while the lower
one is lower than ever before, because a motion above it that falls to 0 has never been as low before.

(4) A motion at rest at the obstacle leaves it as soon as H > 1, and touches it again after H has fallen below -1.
"""

import math
from typing import NamedTuple

from vibrodrive.jit.compile import array, inline, jit, part
from vibrodrive.jit.trig import TWO_PI, sincos
from vibrodrive.model.reasons import Unproved

CLOSED = 0
LATE, STRAYS, FULL, COARSE = map(int, (Unproved.LATE, Unproved.STRAYS, Unproved.FULL, Unproved.COARSE))
"""Results: all motions arrive in the window; some arrive after it, or never; an impact is neither a touch nor an
arrival in the window; too many intervals; the cell is too large."""

INTERVALS = 256  # most intervals of rest on a line, and of touches of one pair of flights
LAST_BIT = 4e-16  # least step, as a share of a time
FINE = 64  # pieces of a ripple, 2π/η, over which velocities are bounded
LARGEST_MU = 0.45  # below a half, so that forces at which motions leave and fall are apart


class Line(NamedTuple):
    """A line and the size of its cell.

    d : largest difference of integrals of forces of the cell from that of the line, with rounding.
    mu : largest difference of these forces from that of the line.
    slow : share of d that changes with the slow force, not with the ripple.
    tiny : a velocity that counts as 0.
    """

    A: float
    B: float
    V: float
    eta: float
    psi: float
    d: float
    mu: float
    slow: float
    tiny: float


class Window(NamedTuple):
    """What an impact at a time t means for motions that start in an interval.

    t < near : it belongs to the impact at the start, whatever its speed.
    first <= t <= last : it arrives, if it is at least as fast as `touch`.
    Otherwise it must be a touch, slower than `touch`.
    """

    near: float
    first: float
    last: float
    touch: float


class Slide(NamedTuple):
    """Beginning of a slide: time, ξ', ξ, direction, and sines and cosines of t and of ψ + ηt there."""

    t: float
    v: float
    x: float
    side: float
    s: float
    c: float
    fs: float
    fc: float


@inline
def force(f, t):
    return f.A * sincos(t)[0] + f.V * f.eta * sincos(f.psi + f.eta * t)[0] - f.B


@inline
def ahead(g, slope, bend):
    """Return a step over which g >= 0 has no zero, because |g''| <= bend."""
    return (slope + math.sqrt(slope * slope + 2.0 * bend * g)) / bend


@part
def crossing(f, t, side, level, until):
    """Return the first time from t on at which side (H - level) <= 0, or `until`."""
    wave = f.V * f.eta
    while t < until:
        (s, c), (fs, fc) = sincos(t), sincos(f.psi + f.eta * t)
        slow = side * (f.A * s - f.B - level)
        g = slow + side * wave * fs
        if g <= 10.0 * f.tiny * (1.0 + f.eta):
            return t
        h = ahead(g, side * (f.A * c + wave * f.eta * fc), f.A + wave * f.eta * f.eta)
        if slow > wave:
            h = max(h, ahead(slow - wave, side * f.A * c, f.A))
        t += max(h, LAST_BIT * t)
    return until


@inline
def slide_from(f, t, v, x, side):
    (s, c), (fs, fc) = sincos(t), sincos(f.psi + f.eta * t)
    return Slide(t, v, x, side, s, c, fs, fc)


@inline
def at(f, b, h):
    """Return ξ', ξ, and the sines and cosine (t, ψ + ηt), at the time h after the beginning b of a slide."""
    (s, c), (fs, fc) = sincos(b.t + h), sincos(f.psi + f.eta * (b.t + h))
    v = b.v - (f.B + b.side) * h - f.A * (c - b.c) - f.V * (fc - b.fc)
    speed = b.v + f.A * b.c + f.V * b.fc - 0.5 * (f.B + b.side) * h
    return v, b.x + speed * h - f.A * (s - b.s) - f.V / f.eta * (fs - b.fs), s, fs, fc


@part
def time_of(f, b, low, high, level):
    """Return the time h, between `low` and `high`, at which ξ passes a level in a slide."""
    h = 0.5 * (low + high)
    for _ in range(60):
        v, x, _, _, _ = at(f, b, h)
        if (x > level) == (b.side < 0.0):
            low = h
        else:
            high = h
        if abs(x - level) <= f.tiny or high - low < 1e-15:
            break
        h -= (x - level) / v if v != 0.0 else 0.0
        if not low < h < high:
            h = 0.5 * (low + high)
    return h


@part
def fastest(f, b, sign, first, last, work):
    """Return a bound of sign ξ' between two times of a slide."""
    n = 1 + int((last - first) * f.eta * (FINE / TWO_PI))
    step, most = (last - first) / n, -math.inf
    work[0] += n
    for k in range(n + 1):
        most = max(most, sign * at(f, b, first + k * step - b.t)[0])
    return most + 0.125 * (f.A + f.V * f.eta * f.eta) * step * step


@part
def leg(f, t, v, x, side, floor, until, work):
    """Follow one slide, or one sticking (side 0), of a free motion. Return (t, ξ', ξ, side) at its end.

    A slide down ends at ξ = floor, too. Its side is then still -1.
    """
    if side == 0.0:
        t = crossing(f, t, 1.0, -1.0, crossing(f, t, -1.0, 1.0, until))
        return t, 0.0, x, math.copysign(1.0, force(f, t)) if t < until else 0.0
    b = slide_from(f, t, v, x, side)
    wave = f.V * f.eta
    bend, low, h = f.A + wave * f.eta, 0.0, 0.0
    if side * v <= f.tiny:
        rate = side * (f.A * b.s + wave * b.fs - f.B) - 1.0
        change = side * (f.A * b.c + wave * f.eta * b.fc)
        h = max(1.8 * rate / bend, 2.7 * change / (f.A + wave * f.eta * f.eta), 1e-9)
    while True:
        work[0] += 1.0
        h = min(h, until - t)
        u, y, s, fs, fc = at(f, b, h)
        if side < 0.0 and y <= floor:
            h = time_of(f, b, low, h, floor)
            return t + h, min(at(f, b, h)[0], 0.0), floor, side
        pull, g = f.A * s + wave * fs - f.B, side * u
        if g <= f.tiny:
            return t + h, 0.0, y, 1.0 if pull > 1.0 else -1.0 if pull < -1.0 else 0.0
        if h >= until - t:
            return until, u, y, side
        low = h
        step = ahead(g, side * pull - 1.0, bend)
        slow = g + side * f.V * fc - f.V
        if slow > 0.0:
            step = max(step, ahead(slow, side * (f.A * s - f.B) - 1.0, f.A))
        h += max(step, LAST_BIT * t)


@inline
def room(f, h):
    """Return how far a motion of the cell may be from the free motion of the line, the time h after both left."""
    return f.d * (h + 2.0 / f.eta) + f.slow * min(h, 2.0) + 300.0 * f.tiny


@part
def landing(f, start, until, work):
    """Return the time at which the motion that leaves at `start` and all below it have landed, or `until`.

    Also return the time at which its last slide down begins.
    """
    t, v, x, side = start, 0.0, 0.0, 1.0 if force(f, start) > 1.0 else 0.0
    begun = start
    while t < until:
        below = -room(f, t - start)
        if side < 0.0:
            if x <= below + 100.0 * f.tiny:
                return t, begun
            if v == 0.0:
                begun = t
        t, v, x, side = leg(f, t, v, x, side, below, until, work)
    return until, begun


@part
def rises(f, b, end, work):
    """Return two times after the beginning of a slide up, between which ξ' > 2d; `end` twice if none are found."""
    speed, h = 2.0 * f.d, 2.0 * f.d / (f.A + f.V * f.eta)
    while h < end - b.t:
        v, x, _, _, _ = at(f, b, h)
        if v > speed:
            return b.t + h, leg(f, b.t + h, v - speed, x, 1.0, -math.inf, end, work)[0]
        h *= 1.5
    return end, end


@part
def touches(f, start, from_, until, near, rows, work):
    """Write the intervals in which motions above the one that leaves at `start` can touch, and return their number.

    A row is (first time, last time, -, largest speed). Speeds before `near` are not computed. All touches are between
    `from_` and `until`. The number is -1 if there are too many.
    """
    t, v, x, side = start, 0.0, 0.0, 1.0 if force(f, start) > 1.0 else 0.0
    while t < from_:
        t, v, x, side = leg(f, t, v, x, side, -math.inf, from_, work)
    lowest, when, count, inside = 0.0, start, 0, False
    while t < until:
        b = slide_from(f, t, v, x, side)
        t, v, x, side = leg(f, t, v, x, side, -math.inf, until, work)
        level, first = lowest + room(f, t - when), b.t
        begins = not inside and (b.x <= level or x <= level)
        if begins and b.side < 0.0 and b.x > level:
            first = b.t + time_of(f, b, 0.0, t - b.t, level)
        inside |= begins
        if inside and count == len(rows):
            return -1
        if begins:
            rows[count, 0], rows[count, 3] = first, 2.0 * f.d
        if inside and b.side < 0.0:
            fast = fastest(f, b, -1.0, first, t, work) + 2.0 * f.d if t > near else math.inf
            rows[count, 3] = max(rows[count, 3], fast)
        if inside and b.side > 0.0:
            rise, fall = rises(f, b, t, work)
            if rise < t:
                rows[count, 1] = rise
                count += 1
                inside = at(f, b, fall - b.t)[1] <= level
                if inside and count < len(rows):
                    rows[count, 0], rows[count, 3] = fall, 2.0 * f.d
        if inside and count < len(rows):
            rows[count, 1] = t
        if x < lowest:
            lowest, when = x, t
    return count + int(inside) if count + int(inside) <= len(rows) else -1


@part
def image(f, w, start, end, from_, rows, work):
    """Write the intervals of the next touches of all motions that leave the obstacle between two times.

    A row is (first time, last time, least speed, largest speed). Return the number of rows; -1 if there are too many;
    -2 if some motion has not landed at the end of the window.
    """
    until = w.last + 1.0
    landed, begun = landing(f, start, until, work)
    if landed >= until:
        return -2
    count = touches(f, end, from_, landed, w.near, rows, work)
    upper = slide_from(f, begun, 0.0, 0.0, -1.0)
    for k in range(count):
        rows[k, 2] = 0.0
        if rows[k, 1] >= w.near and rows[k, 0] >= begun:
            rows[k, 2] = max(-fastest(f, upper, 1.0, rows[k, 0], rows[k, 1], work) - 2.0 * f.d, 0.0)
    return count


@inline
def strays(w, row):
    """Return whether an interval of touches may contain an impact that is neither a touch nor an arrival."""
    return row[1] >= w.near and row[3] >= w.touch and not (w.first <= row[0] and row[1] <= w.last)


@inline
def mixes(w, row):
    """Return whether an interval of touches in the window may contain both arrivals and touches."""
    return w.first <= row[0] and row[1] <= w.last and row[2] < w.touch <= row[3]


@part
def join(rows, count, first, last):
    """Add an interval to others, and join those that meet. Return their number, -1 if there are too many."""
    k = 0
    while k < count:
        if rows[k, 0] <= last and first <= rows[k, 1]:
            first, last = min(first, rows[k, 0]), max(last, rows[k, 1])
            count -= 1
            rows[k, 0], rows[k, 1] = rows[count, 0], rows[count, 1]
            k = -1
        k += 1
    if count == len(rows):
        return -1
    rows[count, 0], rows[count, 1] = first, last
    return count + 1


@part
def take(w, rows, count, rests, resting, out):
    """Add touches to the intervals of rest, and arrivals to `out`. Return the number of intervals of rest, -1: full."""
    for k in range(count):
        first, last, slow, fast = rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3]
        arrives = last >= w.near and w.first <= first and last <= w.last
        if arrives and fast >= w.touch:
            out[0], out[1] = min(out[0], first), max(out[1], last)
            out[2], out[3] = min(out[2], max(slow, w.touch)), max(out[3], fast)
        if not arrives or slow < w.touch:
            resting = join(rests, resting, first, last)
            if resting < 0:
                return -1
    return resting


@part
def leave(f, start, rests, resting, pieces, until):
    """Find the next time span in which motions at rest can leave, and divide the intervals of rest there.

    Return the numbers of intervals of rest that remain and of pieces (-1: too many), and when touches can begin.
    """
    mu = f.mu
    begins = crossing(f, start, -1.0, 1.0 - 2.0 * mu, until)
    ends = crossing(f, begins, 1.0, 1.0 - 3.0 * mu, until)
    surely = crossing(f, begins, -1.0, 1.0 + 2.0 * mu, ends)  # from here on every motion leaves,
    doubtful = crossing(f, surely, 1.0, 1.0 + mu, ends) if surely < ends else begins  # up to here
    count = kept = 0
    stays = surely >= ends
    for k in range(resting):
        first, last = rests[k, 0], rests[k, 1]
        if first <= ends:
            leaves = ends if last > doubtful else max(last, surely if first < surely else last)
            stays |= last > doubtful
            count = join(pieces, count, max(first, begins), min(leaves, ends))
        if last > ends:
            rests[kept, 0], rests[kept, 1] = max(first, ends), last
            kept += 1
    if stays:
        kept = join(rests, kept, ends, ends)
    return kept, count, crossing(f, ends, 1.0, mu - 1.0, until)


@jit(like=(array(1), array(1), 0.0, array(2), array(2), array(2), array(1), array(1)), _nrt=False)
def reach(line, window, finest, rests, pieces, rows, out, work):
    """Enclose the next main impacts of all motions of a cell from rest in the interval rests[0].

    Parameters
    ----------
    line, window : float64, the fields of Line and of Window.
    finest : a piece of starts is divided down to this length if its touches are more than a quarter of a ripple apart,
        and to a 1000th of it if one may stray.
    rests, pieces, rows : work arrays (INTERVALS, 2), (INTERVALS, 2), (INTERVALS, 4).
    out : float64 (4,), receives the first and the last time of an arrival, its least and its largest speed.
    work : float64 (2,), counted evaluations, and their largest number.

    Return one of the results above.
    """
    f = Line(line[0], line[1], line[2], line[3], line[4], line[5], line[6], line[7], line[8])
    w = Window(window[0], window[1], window[2], window[3])
    out[0] = out[2] = math.inf
    out[1] = out[3] = -math.inf
    if f.mu > LARGEST_MU:
        return COARSE
    until, resting = w.last + 2.0 * TWO_PI, 1
    while resting > 0:
        start = math.inf
        for k in range(resting):
            start = min(start, rests[k, 0])
        if start > w.last:
            return LATE
        resting, count, from_ = leave(f, start, rests, resting, pieces, until)
        if resting < 0 or count < 0 or from_ >= until:
            return LATE if from_ >= until else FULL
        while count > 0:
            count -= 1
            first, last = pieces[count, 0], pieces[count, 1]
            touching = image(f, w, first, last, from_, rows, work)
            result = LATE if touching == -2 else FULL if touching <= 0 else CLOSED
            apart = touching > 0 and rows[touching - 1, 1] - rows[0, 0] > 0.25 * TWO_PI / f.eta
            for k in range(touching):
                apart |= mixes(w, rows[k])
                if strays(w, rows[k]):
                    result = STRAYS
            lost, span = result != CLOSED, last - first
            if (span > finest and (apart or lost)) or (span > 1e-3 * finest and lost):
                if count + 2 > len(pieces) or work[0] > work[1]:
                    return FULL
                middle = 0.5 * (first + last)
                pieces[count, 1] = pieces[count + 1, 0] = middle
                pieces[count + 1, 1] = last
                count += 2
                continue
            if lost:
                return result
            resting = take(w, rows, touching, rests, resting, out)
            if resting < 0:
                return FULL
    return CLOSED if resting == 0 else FULL
