"""Level 0 with the kernels of the package. The three methods search g in the same way as a switching function.

In the kernels a switching function is a shape in h = τ − t (kernels/motion.py). Here g is written as a shape, with its
fast wave as the disturbance. As in the computation of a motion, the shape gets a new origin t after each zero, and
otherwise after at most two excitation periods. After a zero, the certified method and Muller's method search a function
that is 0 at its start. The method `fixed` reports the grid point after the zero, so it searches g itself.
"""

import math

import numpy as np

from benchmarks.switches.sums import departure
from vibrodrive.jit.compile import jit
from vibrodrive.jit.trig import two_product
from vibrodrive.kernels import first_zero, motion, muller
from vibrodrive.kernels import lane as r
from vibrodrive.kernels.codes import CERTIFIED, FIXED, MULLER, NOTHING, S3, ZERO
from vibrodrive.kernels.single import follow_certified, follow_on_grid


@jit
def shape(f, t, on_zero, sign, limit):
    """Return ±g as a shape in h = τ − t, with the data of its search, as `first_zero.Search`.

    `on_zero` is true if g = 0 at t. If g = 0 at t > 0, the sign of the shape is the sign of g' at t. Otherwise it is
    `sign`. `limit` is the largest h of the search.
    """
    sin, cos = math.sin(t), math.cos(t)
    p = f.a * (math.cos(f.alpha) * cos - math.sin(f.alpha) * sin)
    q = f.a * (math.sin(f.alpha) * cos + math.cos(f.alpha) * sin)
    turned, rest = two_product(f.eta, t)  # add angles by sines and cosines, so that phases of 10⁹ lose no digit
    sin, cos = math.sin(turned) + rest * math.cos(turned), math.cos(turned) - rest * math.sin(turned)
    pf = f.b * (math.cos(f.beta) * cos - math.sin(f.beta) * sin)
    qf = f.b * (math.sin(f.beta) * cos + math.cos(f.beta) * sin)
    c0 = 0.0 if on_zero else f.c0 + (f.c1 + f.c2 * t) * t + q + qf
    c1 = f.c1 + 2.0 * f.c2 * t
    d1, d2 = c1 + p + f.eta * pf, f.c2 - 0.5 * (q + f.eta * f.eta * qf)
    if on_zero and t > 0.0:
        sign = 1.0 if d1 >= 0.0 else -1.0
    a, b = abs(f.a), abs(f.b)
    m2, m3 = 2.0 * abs(f.c2) + a + 1e-300, a + b * f.eta**3
    span = (a + b * f.eta**2) / m3 if b > 0.0 else 1.0
    sizes = abs(c0) + 2.0 * (a + b) + (abs(c1) + abs(f.c2) * limit) * limit
    noise = first_zero.NOISE_SHARE * (sizes + first_zero.LATE_SHARE * b * f.eta * limit)
    form = motion.Form(c0, d1, d2, c1, f.c2, p, -q)
    return first_zero.Search(form, pf, -qf, 0.0, sign, b, m2, m3, span, noise)


@jit
def first_cursor(search, on_zero, method, dtau, limit):
    """Return the position at which the search begins: h for the certified method, a number of grid steps for the
    others. It is after a zero at the start, so that this zero is not found again."""
    if method == CERTIFIED:
        return first_zero.first_cursor(search, limit) if on_zero else 0.0
    return first_zero.first_grid_point(search, dtau, limit) if on_zero else 1.0


@jit
def search_all(w, k, f, T, sign, method, dtau, found):
    """Fill `found` with the zeros of g in (0, T] in order, and return their number. `sign` is the sign of g just after
    0. `w` and `k` are the memory of one motion (vibrodrive.kernels.lane)."""
    count, t, on_zero = 0, 0.0, f.c0 + f.a * math.sin(f.alpha) + f.b * math.sin(f.beta) == 0.0
    point = 0  # index of the grid point at t
    while t < T and count < len(found):
        longest = min(T - t, motion.STRETCH, 1e6 / f.eta)
        limit = longest
        if method != CERTIFIED:
            limit = min(max(math.ceil(longest / dtau), 1.0), motion.LONGEST_SCAN)
        search = shape(f, t, on_zero, sign, longest)
        first_zero.set_limit(w, 0, True, limit)
        first_zero.set_search(w, k, 0, True, S3, search, first_cursor(search, on_zero, method, dtau, limit))
        first_zero.unknown_values(w, 0, True)
        w[r.OUTCOME], w[r.WORK_BOOKED] = NOTHING, w[r.WORK]
        while w[r.OUTCOME] == NOTHING:
            if method == CERTIFIED:
                follow_certified(w, k)
            else:
                follow_on_grid(w, True)
        sign, ended = search.sig, w[r.OUTCOME] == ZERO
        cursor, on_zero = w[r.CURSOR], ended and method != FIXED
        h = cursor if method == CERTIFIED else cursor * dtau
        if ended and method == MULLER:
            h = muller.refine(w, 0, (cursor - 1.0) * dtau, h)
        point += int(cursor)
        t = point * dtau if method == FIXED else t + h
        if ended:
            found[count], sign = t, -sign
            count += 1
    return count


def find(f, T, method, dtau, tol):
    """Return the zeros of g in (0, T] by a method (an integer of `vd.Method`). If the method has no grid, `dtau` is
    1."""
    w, k = np.zeros(r.ROWS_W * r.STRIDE), np.zeros(r.ROWS_K * r.STRIDE, np.int64)
    w[r.ETA], w[r.INVERSE], w[r.DTAU], w[r.TOL] = f.eta, 1.0 / f.eta, dtau, tol
    found = np.empty(100_000)
    count = search_all(w, k, f, T, departure(f), method, dtau, found)
    return [z for z in found[:count].tolist() if z <= T]
