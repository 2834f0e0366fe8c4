"""Literal scan: evaluation of the switching function at every grid point, as in the paper and in most contact codes.

The grid is divided into blocks. The grid points of a block are h_b + x, with a constant h_b. Tables contain the sines
and versines of x. In a block, a shape (motion.py) becomes

    c0' + c1 x + α' sin x + β' vers x + fast part

with coefficients that are constant in the block. S1, which has a quadratic term, is never scanned, because the scan for
S2 also computes ξ. A value that exceeds the rounding error of this form has the correct sign. The few other values are
computed again, by the closed form of motion.py, which a search that skips grid points also uses. So both give the same
results to the bit. `kernels/__init__.py` explains the terms.
"""

from typing import NamedTuple

from vibrodrive.jit.branchless import fma
from vibrodrive.jit.compile import inline, part
from vibrodrive.jit.trig import arc, arc_of_product, dot
from vibrodrive.kernels import lane as r
from vibrodrive.kernels import motion, muller
from vibrodrive.kernels.codes import BOTH, FALLEN, LIMIT_MET, S1, S2, S4, ZERO

BLOCK = 896
"""Number of grid points of a block. The five tables (`fill_tables`) take 36 kB and remain in the first-level cache."""


@part
def fill_tables(table, dtau, eta):
    """Write five tables, one after the other, into `table`, float64 (5 · BLOCK,): sin x, vers x, sin ηx, vers ηx and x
    at x = Δτ, 2Δτ, …
    """
    for j in range(BLOCK):
        x = float(j + 1) * dtau
        s, v, _, _, _ = arc(x)
        table[j] = s
        table[BLOCK + j] = v
        s, v, _, _, _ = arc_of_product(eta, x)
        table[2 * BLOCK + j] = s
        table[3 * BLOCK + j] = v
        table[4 * BLOCK + j] = x


@inline
def turned(a, b, rate, h):
    """Return (value, a', b') with a sin k(h + x) + b vers k(h + x) = value + a' sin kx + b' vers kx; k = `rate`."""
    s, v, _, _, _ = arc_of_product(rate, h)
    c = 1.0 - v
    return dot(a, s, b, v), dot(a, c, b, s), dot(b, c, -a, s)


class Block(NamedTuple):
    """Coefficients of a switching function in a block: c0', c1, α', β', and α_f', β_f' of its fast part."""

    c0: float
    c1: float
    al: float
    be: float
    alf: float
    bef: float


@inline
def tabled(table, j, f):
    """Return the slow part of the switching function with the coefficients f at grid point j of the block."""
    return fma(f.al, table[j], fma(f.be, table[BLOCK + j], fma(f.c1, table[4 * BLOCK + j], f.c0)))


@inline
def tabled_ripple(table, j, f):
    """Return the switching function with the coefficients f, including the fast part, at grid point j of the block."""
    return fma(f.alf, table[2 * BLOCK + j], fma(f.bef, table[3 * BLOCK + j], tabled(table, j, f)))


@part
def suspects(table, n, bound, two_sided, f, fast):
    """Return the number of suspect values of a switching function at the first n grid points of a block.

    f is a Block with the coefficients of the function. A value below `bound` is suspect, because the switching function
    may be negative there. If `two_sided`, the function is H, and both sides of S4 are checked. A value is then suspect
    if its modulus is above `bound`.
    """
    count = 0
    if two_sided:
        for j in range(n):
            count += 1 if abs(tabled_ripple(table, j, f)) > bound else 0
    elif fast:
        for j in range(n):
            count += 1 if tabled_ripple(table, j, f) < bound else 0
    else:
        for j in range(n):
            count += 1 if tabled(table, j, f) < bound else 0
    return count


CLOSE = 16  # largest number of values before a suspect value that are evaluated one by one


@inline
def clear_values(table, n, bound, two_sided, f, fast):
    """Return a number of values at the beginning of a block that are not suspect.

    Bisection finds a number such that the first suspect value is one of the next CLOSE values.
    """
    clear = 0
    while n - clear > CLOSE:
        half = (clear + n) // 2
        if suspects(table, half, bound, two_sided, f, fast) > 0:
            n = half
        else:
            clear = half
    return clear


@inline
def least_clear_gap(w, i, first, n, dtau):
    """Return a bound such that ξ > 0 at n successive grid points if ξ exceeds the bound at the last of them.

    Requires ξ' < 0 at these points. The bound is the rounding error of ξ plus the largest rise of ξ over these points.
    Between two neighbouring points with ξ' < 0, ξ' is at most Δτ²/8 times the bound of its second derivative.
    """
    h = (first + float(n)) * dtau
    rounding = 1e-12 * (w[r.X0 + i] + w[r.A + i] + (abs(w[r.XC1 + i]) + abs(w[r.XC2 + i]) * h) * h)
    third = w[r.A + i] + w[r.AF + i] * w[r.ETA + i]
    return rounding + float(n) * dtau * (third * dtau * dtau * 0.125)


@inline
def clear_gaps(w, i, first, n, dtau, fast):
    """Return a number of grid points at the beginning of a block at which ξ is certainly positive.

    Bisection finds a number that is at most CLOSE too small.
    """
    margin = least_clear_gap(w, i, first, n, dtau)
    clear = 0
    while n - clear > CLOSE:
        half = (clear + n) // 2
        x, _ = motion.state_at(w, i, (first + float(half)) * dtau, fast)
        if x > margin:
            clear = half
        else:
            n = half
    return clear


@part
def scan(w, k, i, table):
    """Do the complete search in lane i by evaluation at every grid point.

    Set OUTCOME, and set CURSOR to the grid point of the outcome.
    """
    which = k[r.SEARCH + i]
    dtau, limit, noise = w[r.DTAU + i], w[r.LIMIT + i], w[r.NOISE + i]
    eta, base = w[r.ETA + i], w[r.BASE + i]
    fast = eta > 0.0
    two_sided = which == S4
    sig = 1.0 if two_sided else w[r.SIG + i]
    offset = 0.0 if two_sided else base
    bound = 1.0 - noise if two_sided else noise
    first = w[r.CURSOR + i] if which == S1 else 1.0  # the cursor of other searches may have skipped points
    while first <= limit:
        left = limit - first + 1.0
        n = BLOCK if left > float(BLOCK) else int(left)
        h = (first - 1.0) * dtau
        slow, al, be = turned(w[r.AL + i], w[r.BE + i], 1.0, h)
        quick, alf, bef = turned(w[r.ALF + i], w[r.BEF + i], eta, h)
        c1 = w[r.C1 + i]
        c0 = offset + sig * (w[r.C0 + i] + c1 * h + slow + quick)
        f = Block(c0, sig * c1, sig * al, sig * be, sig * alf, sig * bef)
        count = suspects(table, n, bound, two_sided, f, fast)
        fallen = False
        if which == S2:
            # in a block with ξ' < 0, ξ decreases, so the last value of ξ suffices
            x, _ = motion.state_at(w, i, (first + float(n - 1)) * dtau, fast)
            fallen = x < least_clear_gap(w, i, first, n, dtau)
        start = n
        if count > 0 or fallen:
            if count > 0:
                start = clear_values(table, n, bound, two_sided, f, fast)
            if which == S2:
                start = clear_gaps(w, i, first, start, dtau, fast)  # ξ' < 0 at the points before `start`
        for j in range(start, n):
            cursor = first + float(j)
            met = exact(w, i, cursor * dtau, which, fast)
            if met != 0.0:
                w[r.OUTCOME + i] = met
                w[r.CURSOR + i] = cursor
                w[r.LAST_NONNEGATIVE + i] = cursor - 1.0
                w[r.WORK + i] += float(j)
                return
        w[r.WORK + i] += float(n)
        first += float(n)
    w[r.OUTCOME + i] = LIMIT_MET
    w[r.CURSOR + i] = limit


@inline
def exact(w, i, h, which, fast):
    """Return the outcome at h, eq. (10): NOTHING, ZERO, FALLEN or BOTH (codes.py).

    A search that skips grid points computes the outcome by the same formulas.
    """
    g = muller.value(w, i, h)
    if which == S4 and g >= 0.0:
        w[r.SIG + i] = -w[r.SIG + i]
        g = muller.value(w, i, h)
    zero = g < 0.0
    if which == S2:
        x, _ = motion.state_at(w, i, h, fast)
        if x < 0.0:
            return BOTH if zero else FALLEN
    return ZERO if zero else 0.0
