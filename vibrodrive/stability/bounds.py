"""Bounds of a disturbed motion: free undisturbed motions above and below it, and what they say of its height ξ.

The disturbance is a force of at most m, and impulses that change the velocity by less than V over any span of time. The
motion above has the constant force m in addition, so that B is less by m, and the motion below the force -m. They begin
at rest at the obstacle and do not see it afterwards. impulses.py proves, with v the velocity of the disturbed motion,

ξ' of the motion below - V <= v <= ξ' of the motion above + V,

and that ξ is between two bounds. On the side of the motion above (side = 1) and below (side = -1) the bound of side · ξ
changes by

* side · ξ' + V in a slide to this side, and in the fast part of a slide to the other side, |ξ'| > V;
* 0 in the slow parts of a slide to the other side;
* (1 + side · H) V / 2 while the motion sticks.

Each of these is a *piece*, in which bound and velocity have closed forms. Rounding moves a bound no more than a
disturbance of 1e-13 does, which the margin of V contains (impulses.py).
"""

import math
from typing import NamedTuple

import numpy as np

from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import PI, TWO_PI, sincos
from vibrodrive.kernels.release import release_down, release_up

BEGIN, SINCE, DIRECTION, MODE, BOUND = range(5)
"""Columns of a piece: its begin, the begin of its slide, the direction (1: up, -1: down, 0: sticking), how the bound
changes, and the bound at its begin."""

STILL, MOVING, STICKING = 0.0, 1.0, 2.0

PIECES = 16  # more than the number of pieces of a motion in an excitation period


class Side(NamedTuple):
    """The motion above (side = 1) or below (-1), and V. H rises to 1 and falls to -1 at the phases `up` and `down`."""

    side: float
    A: float
    B: float
    V: float
    up: float
    down: float


@inline
def make_side(side, A, B, V):
    return Side(side, A, B, V, release_up(A, B)[0], release_down(A, B)[0])


@inline
def following(phase, t):
    """Return the first instant with this phase from t on."""
    return phase + TWO_PI * np.ceil((t - phase) / TWO_PI)


@inline
def peak_of(c, s, since):
    """Return the instant of the largest |ξ'| in a slide of direction s that begins at `since`."""
    return following(PI - c.up if s > 0.0 else 3.0 * PI - c.down, since)


@inline
def slide_velocity(c, s, since, t):
    """Return ξ' at t in a slide of direction s from rest at `since`."""
    return c.A * (sincos(since)[1] - sincos(t)[1]) - (c.B + s) * (t - since)


@inline
def velocity_at(c, row, t):
    """Return ξ' at t in a piece."""
    return 0.0 if row[DIRECTION] == 0.0 else slide_velocity(c, row[DIRECTION], row[SINCE], t)


@inline
def is_fast(row, s):
    """Return whether a piece is that part of a slide of direction s against the side in which |ξ'| > V."""
    return row[DIRECTION] == s and row[MODE] == MOVING


@part
def velocity_zero(c, s, since, level, lo, hi):
    """Return the instant between lo and hi at which ξ' passes `level` in a slide, by Newton's method in a bracket."""
    falls = slide_velocity(c, s, since, lo) > level
    t = lo + 0.4 * (hi - lo)
    for _ in range(80):
        excess = slide_velocity(c, s, since, t) - level
        lo, hi = (t, hi) if (excess > 0.0) == falls else (lo, t)
        step = excess / (c.A * sincos(t)[0] - c.B - s)
        if abs(step) < 1e-15 * (1.0 + abs(t)):
            break
        t = t - step if lo < t - step < hi else 0.5 * (lo + hi)
    return t


@part
def bound_at(c, row, t):
    """Return the bound of side · ξ at t in a piece."""
    begin, since, s = row[BEGIN], row[SINCE], row[DIRECTION]
    if row[MODE] == STILL:
        return row[BOUND]
    h = t - begin
    sine, cosine = sincos(begin)
    if row[MODE] == STICKING:
        return row[BOUND] + 0.5 * c.V * ((1.0 - c.side * c.B) * h + c.side * c.A * (cosine - sincos(t)[1]))
    moved = c.A * (sincos(since)[1] * h + sine - sincos(t)[0]) - 0.5 * (c.B + s) * (t - since + (begin - since)) * h
    return row[BOUND] + c.side * moved + c.V * h


@part
def bound_zero(c, row, level, lo, hi):
    """Return the instant between lo and hi at which the bound passes `level`, by bisection."""
    above = bound_at(c, row, lo) > level
    while hi - lo > 1e-14 * (1.0 + abs(hi)):
        t = 0.5 * (lo + hi)
        lo, hi = (t, hi) if (bound_at(c, row, t) > level) == above else (lo, t)
    return 0.5 * (lo + hi)


@part
def fall_zero(c, row, above, lo, hi):
    """Return the instant between lo and hi at which the motion itself has fallen by `above` since lo."""
    free = Side(c.side, c.A, c.B, 0.0, c.up, c.down)
    return bound_zero(free, row, bound_at(free, row, lo) - c.side * above, lo, hi)


@inline
def write(rows, n, begin, since, s, mode, bound):
    rows[n, BEGIN], rows[n, SINCE], rows[n, DIRECTION], rows[n, MODE], rows[n, BOUND] = begin, since, s, mode, bound


@part
def trace(c, t, bound, end, rows):
    """Write the pieces from a rest at t to an instant after `end`, or to the end of `rows`. Return their number.

    H is at least 1 at t, and `bound` is the bound there. The row after the pieces contains the instant at which they
    end.
    """
    s, n = 1.0, 0
    while t < end and n + 5 < len(rows):
        peak = peak_of(c, s, t)
        if peak - t < PI and s * slide_velocity(c, s, t, peak) > 0.0:  # else the slide is shorter than rounding
            stop = velocity_zero(c, s, t, 0.0, peak, following(c.up if s > 0.0 else c.down, peak))
            first, last = t, stop
            if s != c.side and c.V > 0.0:
                fast = s * slide_velocity(c, s, t, peak) > c.V
                first = velocity_zero(c, s, t, s * c.V, t, peak) if fast else stop
                last = velocity_zero(c, s, t, s * c.V, peak, stop) if fast else stop
                write(rows, n, t, t, s, STILL, bound)
                n += 1
            if first < last:
                write(rows, n, first, t, s, MOVING, bound)
                bound = bound_at(c, rows[n], last)
                n += 1
            if last < stop:
                write(rows, n, last, t, s, STILL, bound)
                n += 1
            t = stop
        if s * (c.A * sincos(t)[0] - c.B) < -1.0:
            s = -s
            continue
        rises, falls = following(c.up, t), following(c.down, t)
        write(rows, n, t, t, 0.0, STICKING, bound)
        s, t = (1.0, rises) if rises < falls else (-1.0, falls)
        bound = bound_at(c, rows[n], t)
        n += 1
    write(rows, n, t, t, 0.0, STILL, bound)
    return n


@inline
def piece_at(rows, n, t):
    """Return the number of the piece at t."""
    i = 0
    while i + 1 < n and rows[i + 1, BEGIN] <= t:
        i += 1
    return i


@inline
def room(c, a, b):
    """Return the integral of 1 + H from a to b, the velocity that a fall loses."""
    return (1.0 - c.B) * (b - a) + c.A * (sincos(a)[1] - sincos(b)[1])


@part
def height_after_rest(c, first):
    """Return the bound of ξ at the phase at which H rises to 1, after a rest from `first` on; c is the motion above."""
    falls, back = c.down - TWO_PI, PI - c.down  # between them H < -1
    before = room(c, first, falls) if first < falls else 0.0
    after = max(first, back)
    return 0.5 * c.V * (before + (room(c, after, c.up) if after < c.up else 0.0))


@part
def fall_in_rest(c, m, first, end):
    """Return (speed, sound) for the part of a rest from `first` to `end`, in which H may be below -1.

    c is the motion below, and H >= -1 at `end`.

    speed : largest speed of a touch.
    sound : whether no mass falls faster than V at `end`, because one that still did would have touched before.
    """
    begin, back = max(first, c.down - TWO_PI), PI - c.down
    if c.V == 0.0 or begin >= back:
        return c.V, True
    height = 0.25 * c.V * c.V / (1.0 - m) + m / (1.0 - m) * c.V * (back - begin)
    if first < begin:
        height += 0.5 * c.V * (c.V + room(c, first, begin) + 2.0 * m * (begin - first))
    speed = c.V + math.sqrt(2.0 * (c.A + c.B - 1.0) * height)
    if room(c, begin, end) >= 0.0:
        return speed, True
    lo, hi = begin, back
    for _ in range(50):
        t = 0.5 * (lo + hi)
        lo, hi = (t, hi) if room(c, t, end) < 0.0 else (lo, t)
    d = end - hi
    sine, cosine = sincos(hi)
    moved = 0.5 * (1.0 - c.B) * d * d + c.A * (d * cosine - sincos(end)[0] + sine)
    return speed, height + moved + m * (end - begin) * (end - begin) < 0.0
