"""Muller's method (Muller 1956, reference [9] of the paper) on a bracket: the refinement of §4."""

from __future__ import annotations

import math

from vibrodrive.jit.branchless import choose, full, wide
from vibrodrive.jit.compile import inline, inline_each, part
from vibrodrive.jit.trig import arc, arc_of_product
from vibrodrive.kernels import first_zero, motion
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import BOTH, CLOSING_IN, COMPLETE, LEAVING, NONE_BEGUN, ZERO

ITERATIONS = 100
"""Bisection alone halves any bracket to nothing in this many steps, so the loop always ends by itself."""

MANY = 16
"""For fewer lanes no further step is taken abreast, which costs as much as for all: they wait for others."""


@inline_each("fast")
def function_at(w, i, h, fast):
    """The switching function searched in lane i, at h after the last switch, with a disturbance (`fast`) or without."""
    s, v, ds, dv, near = arc(h)
    if fast:
        sf, vf, dsf, dvf, near_fast = arc_of_product(w[r.ETA + i], h)
        near = near & near_fast
    g = motion.shape(near, h, first_zero.form_of(w, i), s, v, ds, dv)
    if fast:
        g += motion.fast_part(near, w[r.ALF + i], w[r.BEF + i], sf, vf, dsf, dvf)
    return w[r.BASE + i] + w[r.SIG + i] * g


@part
def value(w, i, h):
    """The same, disturbed or not; it is counted."""
    w[r.WORK + i] += 1.0
    if w[r.ETA + i] > 0.0:
        return function_at(w, i, h, True)
    return function_at(w, i, h, False)


@inline
def on_chord(low, high, g0, g1):
    """Where the straight line between the ends of a bracket is zero; its middle where that is not inside."""
    x = low + (high - low) * (g0 / (g0 - g1))
    return choose((low < x) & (x < high), x, 0.5 * (low + high))


@inline
def on_parabola(low, high, x0, g0, x1, g1, x2, g2):
    """The root next to x2 of the parabola through three points; the middle of the bracket where that is not inside."""
    f01 = (g1 - g0) / (x1 - x0)
    f12 = (g2 - g1) / (x2 - x1)
    f012 = (f12 - f01) / (x2 - x0)
    b = f12 + f012 * (x2 - x1)
    disc = b * b - 4.0 * g2 * f012
    root = math.sqrt(choose(disc > 0.0, disc, 0.0))
    x3 = x2 - 2.0 * g2 / choose(b > 0.0, b + root, b - root)
    return choose((low < x3) & (x3 < high), x3, 0.5 * (low + high))


@inline
def begin_between(low, high, g0, g1):
    """(x2, whether a zero is still to be left): where refinement looks first.

    A slide out of rest begins on a zero of its own, which is not the next switch: leave it first.
    """
    leaving = g0 <= 0.0
    return choose(leaving, 0.5 * (low + high), on_chord(low, high, g0, g1)), leaving


@inline
def close_in(low, high, leaving, x0, g0, x1, g1, x2, g2, tol):
    """(low, high, leaving, x3, whether x3 is the end) behind a step of refinement to x2."""
    below, met = g2 < 0.0, g2 == 0.0
    low, high = choose(below, low, x2), choose(below, x2, high)
    leaving = leaving & below
    x3 = choose(leaving, 0.5 * (low + high), on_parabola(low, high, x0, g0, x1, g1, x2, g2))
    done = met | (abs(x3 - x2) < tol) | (x3 == low) | (x3 == high)
    return low, high, leaving, choose(met, x2, x3), done


@part
def refine(w, i, low, high):
    """A zero of the switching function between low (not yet changed sign) and high (changed).

    Begins with the ends and where the straight line between them is zero. Each step is the root, next to the newest
    point, of the parabola through the last three points; a step that leaves the bracket is replaced by bisection. Ends
    when the step is below `tol`.
    """
    x0, x1 = low, high
    g0, g1 = w[r.BEFORE + i], w[r.VALUE + i]  # where the scan has been there already
    g0 = g0 if g0 == g0 else value(w, i, low)
    g1 = g1 if g1 == g1 else value(w, i, high)
    x2, leaving = begin_between(low, high, g0, g1)
    for _ in range(ITERATIONS):
        g2 = value(w, i, x2)
        low, high, leaving, x3, done = close_in(low, high, leaving, x0, g0, x1, g1, x2, g2, w[r.TOL + i])
        if done:
            return x3
        x0, g0 = x1, g1
        x1, g1 = x2, g2
        x2 = x3
    return x2


@inline
def under_way(w, i):
    """Whether lane i is between two steps of `refine`."""
    return w[r.REFINEMENT + i] >= LEAVING


@inline
def begin_refinement(w, i):
    """Lane i begins as `refine` does, if its scan has met a zero and knows the values at both sides of it.

    Where the segment begins the value is the constant of the shape; `refine` evaluates it, so it counts as evaluated.
    """
    met, cursor, dtau = w[r.OUTCOME + i], w[r.CURSOR + i], w[r.DTAU + i]
    on, first = not under_way(w, i), cursor == 1.0
    low, high = (cursor - 1.0) * dtau, cursor * dtau
    g0, g1 = choose(first, w[r.BASE + i] + w[r.SIG + i] * w[r.C0 + i], w[r.BEFORE + i]), w[r.VALUE + i]
    known = ((met == ZERO) | (met == BOTH)) & (g0 == g0) & (g1 == g1)
    newest, leaving = begin_between(low, high, g0, g1)
    w[r.REFINEMENT + i] = choose(
        on, choose(known, choose(leaving, LEAVING, CLOSING_IN), NONE_BEGUN), w[r.REFINEMENT + i]
    )
    w[r.LOWER + i], w[r.UPPER + i] = choose(on, low, w[r.LOWER + i]), choose(on, high, w[r.UPPER + i])
    w[r.OLDER + i], w[r.OLDER_VALUE + i] = choose(on, low, w[r.OLDER + i]), choose(on, g0, w[r.OLDER_VALUE + i])
    w[r.OLD + i], w[r.OLD_VALUE + i] = choose(on, high, w[r.OLD + i]), choose(on, g1, w[r.OLD_VALUE + i])
    w[r.NEWEST + i] = choose(on, newest, w[r.NEWEST + i])
    w[r.EVALUATED + i] = choose(on, choose(first, 1.0, 0.0), w[r.EVALUATED + i])


@inline
def refine_once(w, i):
    """One step of `refine` in lane i, if it is under way there."""
    on = under_way(w, i)
    x0, g0, x1, g1, x2 = w[r.OLDER + i], w[r.OLDER_VALUE + i], w[r.OLD + i], w[r.OLD_VALUE + i], w[r.NEWEST + i]
    g2 = function_at(w, i, x2, True)
    low, high, leaving, x3, done = close_in(
        w[r.LOWER + i], w[r.UPPER + i], w[r.REFINEMENT + i] == LEAVING, x0, g0, x1, g1, x2, g2, w[r.TOL + i]
    )  # fmt: skip
    done |= w[r.EVALUATED + i] >= ITERATIONS  # which is more than a batch of switches may take
    stage = choose(done, COMPLETE, choose(leaving, LEAVING, CLOSING_IN))
    w[r.REFINEMENT + i] = choose(on, stage, w[r.REFINEMENT + i])
    w[r.LOWER + i], w[r.UPPER + i] = choose(on, low, w[r.LOWER + i]), choose(on, high, w[r.UPPER + i])
    w[r.OLDER + i], w[r.OLDER_VALUE + i] = choose(on, x1, x0), choose(on, g1, g0)
    w[r.OLD + i], w[r.OLD_VALUE + i] = choose(on, x2, x1), choose(on, g2, g1)
    w[r.NEWEST + i] = choose(on, x3, x2)
    w[r.EVALUATED + i] += choose(on, 1.0, 0.0)


@part
def refine_abreast(w, n):
    """Go on with `refine`, with a disturbance, in those of the lanes 0..n-1 whose scan has met a zero.

    Steps are taken as long as there are MANY of them; the others go on with those of the next call.
    """
    wide()
    m = full(n)
    for i in range(m):
        begin_refinement(w, i)
    left = MANY
    while left >= MANY:
        left = 0
        for i in range(m):
            refine_once(w, i)
            left += choose(under_way(w, i), 1, 0)


@inline
def refined(w, i, otherwise):
    """(whether `refine` is at its end in lane i, where or else `otherwise`, evaluations that it took)."""
    done = w[r.REFINEMENT + i] == COMPLETE
    return done, choose(done, w[r.NEWEST + i], otherwise), w[r.EVALUATED + i]
