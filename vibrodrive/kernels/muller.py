"""Refinement of a zero in a bracket by Muller's method (§4; Muller 1956, reference [9] of the paper).

The bracket consists of two neighbouring grid points. The scan of the grid (first_zero.py) has found that the switching
function changes sign between them. `kernels/__init__.py` explains the terms.
"""

import math

from vibrodrive.jit.branchless import choose, full, put, wide
from vibrodrive.jit.compile import inline, inline_each, part
from vibrodrive.jit.trig import arc, arc_of_product
from vibrodrive.kernels import first_zero, motion
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import BOTH, CLOSING_IN, COMPLETE, LEAVING, NONE_BEGUN, ZERO

ITERATIONS = 100
"""Largest number of steps of a refinement. Bisection reduces any bracket to two neighbouring doubles in fewer steps, so
the loop always ends by convergence."""

MANY = 16
"""A step is done only if at least so many lanes need it. A step costs the same for any number of lanes, so fewer lanes
continue in a later call."""


@inline
def value_at(base, sig, form, h):
    """Return a switching function at h after the last switch at ε = 0: base + sig · shape, with coefficients `form`."""
    s, v, ds, dv, near = arc(h)
    return base + sig * motion.shape(near, h, form, s, v, ds, dv)


@inline_each("fast")
def function_at(w, i, h, fast):
    """Return the switching function of the search in lane i, h after the last switch, with a disturbance if `fast`."""
    base, sig, form = w[r.BASE + i], w[r.SIG + i], first_zero.form_of(w, i)
    if not fast:
        return value_at(base, sig, form, h)
    s, v, ds, dv, near = arc(h)
    sf, vf, dsf, dvf, near_fast = arc_of_product(w[r.ETA + i], h)
    near = near & near_fast
    g = motion.shape(near, h, form, s, v, ds, dv)
    return base + sig * (g + motion.fast_part(near, w[r.ALF + i], w[r.BEF + i], sf, vf, dsf, dvf))


@part
def value(w, i, h):
    """Return the switching function of the search in lane i at h, and count the evaluation."""
    w[r.WORK + i] += 1.0
    if w[r.ETA + i] > 0.0:
        return function_at(w, i, h, True)
    return function_at(w, i, h, False)


@inline
def on_chord(low, high, g0, g1):
    """Return the zero of the straight line between the ends of a bracket, or the midpoint if this zero is outside.

    g0 and g1 are the values of the function at the ends `low` and `high`.
    """
    x = low + (high - low) * (g0 / (g0 - g1))
    return choose((low < x) & (x < high), x, 0.5 * (low + high))


@inline
def on_parabola(low, high, x0, g0, x1, g1, x2, g2):
    """Return that root of the parabola through three points which is nearest to x2, or the midpoint of the bracket if
    this root is outside.
    """
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
    """Return (x2, leaving): the first new point of the refinement; `leaving` is true if the bracket begins on a zero.

    A slide from rest begins on a zero, which is not the next switch. Bisection first moves away from this zero.
    """
    leaving = g0 <= 0.0
    return choose(leaving, 0.5 * (low + high), on_chord(low, high, g0, g1)), leaving


@inline
def close_in(low, high, leaving, x0, g0, x1, g1, x2, g2, tol):
    """Do the part of a step that follows the evaluation g2 at x2. Return (low, high, leaving, x3, done).

    low, high : the new bracket
    leaving : true if the bracket still begins on a zero
    x3 : the next point, or the result if `done`
    done : true if the refinement is complete
    """
    below, met = g2 < 0.0, g2 == 0.0
    low, high = choose(below, low, x2), choose(below, x2, high)
    leaving = leaving & below
    x3 = choose(leaving, 0.5 * (low + high), on_parabola(low, high, x0, g0, x1, g1, x2, g2))
    done = met | (abs(x3 - x2) < tol) | (x3 == low) | (x3 == high)
    return low, high, leaving, choose(met, x2, x3), done


@part
def refine(w, i, low, high):
    """Return a zero of the switching function between `low` and `high`.

    The sign of the function has changed at `high`, but not at `low`. The first three points are the ends and the zero
    of the line between them. The next point is the root, nearest to the last point, of the parabola through the last
    three points. If this root is outside the bracket, the midpoint is used. The refinement ends if two successive
    points differ by less than TOL.
    """
    x0, x1 = low, high
    g0, g1 = w[r.BEFORE + i], w[r.VALUE + i]  # NaN if the scan has not evaluated them
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
    """Return whether a refinement in lane i has begun and is not complete."""
    return w[r.REFINEMENT + i] >= LEAVING


@inline
def put_bracket(w, i, where, low, high, older, older_value, old, old_value, newest):
    """Set the bracket of the refinement in lane i, and its last three points with the values at two of them."""
    put(w, r.LOWER + i, where, low)
    put(w, r.UPPER + i, where, high)
    put(w, r.OLDER + i, where, older)
    put(w, r.OLDER_VALUE + i, where, older_value)
    put(w, r.OLD + i, where, old)
    put(w, r.OLD_VALUE + i, where, old_value)
    put(w, r.NEWEST + i, where, newest)


@inline
def begin_refinement(w, i):
    """Begin a refinement in lane i if its scan has found a zero and has the values at the grid points on both sides.

    If the first of these grid points is the start of the segment, the value there follows from the constant c0 of the
    shape. This value counts as an evaluation, as in `refine`.
    """
    met, cursor, dtau = w[r.OUTCOME + i], w[r.CURSOR + i], w[r.DTAU + i]
    on, first = not under_way(w, i), cursor == 1.0
    low, high = (cursor - 1.0) * dtau, cursor * dtau
    g0, g1 = choose(first, w[r.BASE + i] + w[r.SIG + i] * w[r.C0 + i], w[r.BEFORE + i]), w[r.VALUE + i]
    known = ((met == ZERO) | (met == BOTH)) & (g0 == g0) & (g1 == g1)
    newest, leaving = begin_between(low, high, g0, g1)
    put(w, r.REFINEMENT + i, on, choose(known, choose(leaving, LEAVING, CLOSING_IN), NONE_BEGUN))
    put_bracket(w, i, on, low, high, low, g0, high, g1, newest)
    put(w, r.EVALUATED + i, on, choose(first, 1.0, 0.0))


@inline
def refine_once(w, i):
    """Do one step of the refinement in lane i, if one is under way."""
    on = under_way(w, i)
    x0, g0, x1, g1, x2 = w[r.OLDER + i], w[r.OLDER_VALUE + i], w[r.OLD + i], w[r.OLD_VALUE + i], w[r.NEWEST + i]
    g2 = function_at(w, i, x2, True)
    low, high, leaving, x3, done = close_in(
        w[r.LOWER + i], w[r.UPPER + i], w[r.REFINEMENT + i] == LEAVING, x0, g0, x1, g1, x2, g2, w[r.TOL + i]
    )  # fmt: skip
    done |= w[r.EVALUATED + i] >= ITERATIONS  # `event.py` applies a switch with so many evaluations (switch.STEEP_COST)
    stage = choose(done, COMPLETE, choose(leaving, LEAVING, CLOSING_IN))
    put(w, r.REFINEMENT + i, on, stage)
    put_bracket(w, i, on, low, high, x1, g1, x2, g2, x3)
    w[r.EVALUATED + i] += choose(on, 1.0, 0.0)


@part
def refine_lanes(w, n):
    """Do steps of the refinements in the lanes 0..n-1, with a disturbance, while at least MANY lanes need a step.

    The result in each lane is that of `refine`. Refinements that are not complete continue in the next call.
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
    """Return (done, h, evaluations) of the refinement in lane i.

    done : true if the refinement is complete
    h : the zero if `done`, else `otherwise`
    evaluations : number of evaluations of the switching function
    """
    done = w[r.REFINEMENT + i] == COMPLETE
    return done, choose(done, w[r.NEWEST + i], otherwise), w[r.EVALUATED + i]
