"""Muller's method (Muller 1956, reference [9] of the paper) on a bracket: the refinement of §4."""

from __future__ import annotations

import math

from vibrodrive.jit.branchless import choose
from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import arc, arc_of_product
from vibrodrive.kernels.lane import AL, ALF, BASE, BE, BEF, BEFORE, C0, C1, C2, D1, D2, ETA, SIG, TOL, VALUE, WORK
from vibrodrive.kernels.motion import fast_part, shape

ITERATIONS = 100
"""Bisection alone halves any bracket to nothing in this many steps, so the loop always ends by itself."""


@part
def value(w, i, h):
    """The switching function searched in lane i, at h after the last switch."""
    s, v, ds, dv, near = arc(h)
    fast = 0.0
    if w[ETA + i] > 0.0:
        sf, vf, dsf, dvf, near_fast = arc_of_product(w[ETA + i], h)
        near = near & near_fast
        fast = fast_part(near, w[ALF + i], w[BEF + i], sf, vf, dsf, dvf)
    c0, d1, d2, c1, c2 = w[C0 + i], w[D1 + i], w[D2 + i], w[C1 + i], w[C2 + i]
    g = shape(near, h, c0, d1, d2, c1, c2, w[AL + i], w[BE + i], s, v, ds, dv) + fast
    w[WORK + i] += 1.0
    return w[BASE + i] + w[SIG + i] * g


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


@part
def refine(w, i, low, high):
    """A zero of the switching function between low (not yet changed sign) and high (changed).

    Begins with the ends and where the straight line between them is zero. Each step is the root, next to the newest
    point, of the parabola through the last three points; a step that leaves the bracket is replaced by bisection. Ends
    when the step is below `tol`.
    """
    tol = w[TOL + i]
    x0, x1 = low, high
    g0, g1 = w[BEFORE + i], w[VALUE + i]  # where the scan has been there already
    g0 = g0 if g0 == g0 else value(w, i, low)
    g1 = g1 if g1 == g1 else value(w, i, high)
    # a slide out of rest begins on a zero of its own, which is not the next switch: leave it first
    leaving = g0 <= 0.0
    x2 = 0.5 * (low + high) if leaving else on_chord(low, high, g0, g1)
    for _ in range(ITERATIONS):
        g2 = value(w, i, x2)
        if g2 < 0.0:
            high = x2
        else:
            low = x2
            leaving = False
        if g2 == 0.0 and not leaving:
            return x2
        x3 = 0.5 * (low + high) if leaving else on_parabola(low, high, x0, g0, x1, g1, x2, g2)
        if abs(x3 - x2) < tol or x3 in (low, high):
            return x3
        x0, g0 = x1, g1
        x1, g1 = x2, g2
        x2 = x3
    return x2
