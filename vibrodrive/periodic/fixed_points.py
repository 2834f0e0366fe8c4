"""All launch phases that return to themselves after n flights, each found inside a bracket.

Launches and flights: flight.py. On a cell (an interval of one itinerary, itineraries.py) the n-fold impact-phase map G
is continuous and monotone. It falls for odd n and grows for even n. For odd n, G(ψ) - ψ falls, so there is one root or
none, and the signs at the ends of the cell decide. For even n the cell is halved until the result is known for each
piece:

* A piece has no root if the images of its ends, or its value in the middle and its slope, exclude a root.
* A piece has one root or none if the slope is above 1, or below 1, on the entire piece. The signs at its ends then
  decide.
* A piece is undecided if G(ψ) - ψ differs from 0, and the slope from 1, only by rounding. This is a tangency (a fold or
  a period doubling) within the precision of floats.

The slope on a piece is enclosed, not sampled. Every time and phase in the formula of the slope is monotone in ψ, so the
values at the two ends of the piece give bounds of the slope.

In all functions n is the number of flights, and `horizon` is their longest duration in excitation periods.
"""

import math

import numpy as np

from vibrodrive.jit.compile import array, inline, jit, part
from vibrodrive.jit.slices import in_slices
from vibrodrive.jit.trig import HALF_PI, PI, TWO_PI, sincos, turns
from vibrodrive.periodic.flight import FROM_GROUND, FROM_REVERSAL, FROM_STICK
from vibrodrive.periodic.itineraries import FATE, FEW, FLOWN, FLYING, HIGH, LOW, PERIODS, enlarged, flights

SLACK = 1e-12  # share by which bounds of the slope are widened, much larger than the rounding errors of their terms
NOISE = 2e-14  # largest rounding error of G(ψ) - ψ, for phases of order 1

ROWS = 64  # number of rows of the stack of pieces; 53 halvings of a cell give at most 54 pieces

CELL, CERTAIN, ROOT = range(3)
"""Columns of roots, float64: row of the cell; 0 for an undecided root, else 1; the root"""


@inline
def force_between(one, other, falling, A, B):
    """Return (low, high), bounds of |H| between two phases of one half wave, in whose middle |H| has its only peak.

    |H| >= 1 at both phases, so a bound below 1 is due to rounding and is set to 1.
    """
    peak = 3.0 * HALF_PI if falling else HALF_PI
    sign = -1.0 if falling else 1.0
    h_one = sign * (A * sincos(one)[0] - B)
    h_other = sign * (A * sincos(other)[0] - B)
    low, high = min(h_one, h_other), max(h_one, h_other)
    if (one - peak) * (other - peak) < 0.0:
        high = A - sign * B
    return max(low, 1.0), max(high, 1.0)


@inline
def cosine_between(low, high):
    """Return (least, most), bounds of the cosine on [low, high]."""
    one, other = sincos(turns(low, 0.0)[1])[1], sincos(turns(high, 0.0)[1])[1]
    least, most = min(one, other), max(one, other)
    if math.floor((high - PI) / TWO_PI) > math.floor((low - PI) / TWO_PI):
        least = -1.0
    if math.floor(high / TWO_PI) > math.floor(low / TWO_PI):
        most = 1.0
    return least, most


@part
def slope_between(one, other, count, A, B):
    """Return (low, high), bounds of |dG/dψ| between two launches.

    The slides of their flights are the first `count` rows of `one` and of `other`.
    """
    low, high = 1.0, 1.0
    w_low, w_high, s_low, s_high = 0.0, 0.0, 0.0, 0.0
    falling = False
    for i in range(count):
        tau_a, h_a, begun = one[i, 0], one[i, 1], int(one[i, 2])
        tau_b, h_b = other[i, 0], other[i, 1]
        if begun == FROM_GROUND:
            falling = False
            s_low, s_high = 0.0, 0.0
        elif begun == FROM_STICK:
            falling = tau_a > HALF_PI
            w_low, w_high = 0.0, 0.0
        else:
            falling = not falling
        if begun != FROM_STICK:
            least, most = force_between(tau_a, tau_b, falling, A, B)
            if begun == FROM_REVERSAL:
                w_low *= (least - 1.0) / (least + 1.0)
                w_high *= (most - 1.0) / (most + 1.0)
            else:
                w_low, w_high = least - 1.0, most - 1.0
        lands = i == count - 1 or int(one[i + 1, 2]) == FROM_GROUND
        if not lands:
            s_low += w_low * min(h_a, h_b)
            s_high += w_high * max(h_a, h_b)
            continue
        first, last = min(tau_a, tau_b), max(tau_a, tau_b)
        early, late = min(tau_a + h_a, tau_b + h_b), max(tau_a + h_a, tau_b + h_b)
        s_low += w_low * max(early - last, 0.0)
        s_high += w_high * (late - first)
        c_first, c_last = cosine_between(first, last)
        c_early, c_late = cosine_between(early, late)
        drift = (1.0 - B) * (early - last), (1.0 - B) * (late - first)
        slow = max(A * (c_early - c_last) - max(drift), 0.0)
        fast = A * (c_late - c_first) - min(drift)
        low *= s_low / fast if fast > 0.0 else 0.0
        high *= s_high / slow if slow > 0.0 else math.inf
    return low * (1.0 - SLACK), high * (1.0 + SLACK)


@part
def bisect(a, ga, b, n, A, B, horizon, no_slides):
    """Return the root of G(ψ) - ψ in [a, b] by bisection to neighbouring floats; ga is G(a) - a."""
    while True:
        middle = 0.5 * (a + b)
        if middle <= a or middle >= b:
            break
        g = flights(middle, n, A, B, horizon, no_slides)[2] - middle
        if (g > 0.0) == (ga > 0.0):
            a, ga = middle, g
        else:
            b = middle
    gb = flights(b, n, A, B, horizon, no_slides)[2] - b
    return a if abs(ga) < abs(gb) else b


@inline
def one_root(even, ga, gb):
    """Return whether there is a root on a piece with one root or none; ga and gb are G(ψ) - ψ at its ends."""
    if even:
        return (ga > 0.0) != (gb > 0.0) or ga == 0.0 or gb == 0.0
    return not (ga < 0.0 or gb > 0.0)


@part
def keep(psi, certain, cell, n, A, B, horizon, number, found):
    """Write the root ψ and the launch phases that follow it to row `number`. Return the number of the next row."""
    one = np.int64(1)  # for a literal, `flights` would be compiled again
    found[number, CELL], found[number, CERTAIN], found[number, ROOT] = cell, certain, psi
    for i in range(ROOT + 1, ROOT + n):
        found[number, i] = flights(found[number, i - 1], one, A, B, horizon, found[:0])[2]
    return number + 1


@jit(like=(array(2), 0, 0.0, 0.0, 0, (0, 0, 0), array(2), array(2), array(3)), _nrt=False)
def roots(cells, least, A, B, steps, under_way, found, stack, slides):
    """Write all ψ with G(ψ) = ψ in the FLYING `cells` of `least` flights or more to `found`, in each cell ascending.

    One call takes up to `steps` steps: it processes a piece, or passes to the next cell. `under_way` contains the
    number of pieces on the stack (-1: the cell is not begun), the number of roots found, and the row of the cell: -1,
    0, 0 before the first call. Return the same for the next call. The search is complete if the row is the number of
    cells. If `found` is full, the caller must enlarge it before the next call.

    stack : ends of the pieces that are not searched yet, float64 (ROWS, 2).
    slides : slides of the flights from the two ends of a piece, float64 (2, any, 3), with columns as in `flight`.
    """
    one, other, no_slides = slides[0], slides[1], cells[:0]
    top, number, cell = under_way
    for _ in range(steps):
        if cell == len(cells) or number == len(found):
            break
        n, horizon = int(cells[cell, FLOWN]), int(cells[cell, PERIODS])
        if top == 0 or n < least or cells[cell, FATE] != FLYING:
            top = -1
            cell += 1
            continue
        if top < 0:
            stack[0, 0], stack[0, 1] = cells[cell, LOW], cells[cell, HIGH]
            top = 1
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        _, _, end_a, _, _, _, count = flights(a, n, A, B, horizon, one)
        _, _, end_b, _, _, _, _ = flights(b, n, A, B, horizon, other)
        even, ga, gb = n % 2 == 0, end_a - a, end_b - b
        if even and (end_a > b or end_b < a):
            continue
        low, high = slope_between(one, other, count, A, B)
        first = number == 0 or found[number - 1, CELL] != cell
        if not even or high < 1.0 or low > 1.0:
            if one_root(even, ga, gb):
                root = bisect(a, ga, b, n, A, B, horizon, no_slides)
                if first or root > found[number - 1, ROOT]:
                    number = keep(root, 1, cell, n, A, B, horizon, number, found)
            continue
        middle = 0.5 * (a + b)
        g = flights(middle, n, A, B, horizon, no_slides)[2] - middle
        reach = max(high - 1.0, 1.0 - low) * 0.5 * (b - a)
        if abs(g) > reach + NOISE:
            continue
        if reach <= NOISE or middle <= a or middle >= b:
            if first or found[number - 1, CERTAIN]:
                number = keep(middle, 0, cell, n, A, B, horizon, number, found)
            continue
        stack[top, 0] = middle
        stack[top, 1] = b
        stack[top + 1, 0] = a
        stack[top + 1, 1] = middle
        top += 2
    return top, number, cell


def fixed_points(cells: np.ndarray, least: int, A: float, B: float) -> np.ndarray:
    """Return all roots in the FLYING cells of `least` flights or more, in the order of the cells, (roots, any).

    The columns are CELL, CERTAIN, and from ROOT on the launch phases: the root, and those that follow it.
    """
    flown, periods = cells[:, FLOWN : PERIODS + 1].max(axis=0).astype(int).tolist()
    slides = np.empty((2, 2 * periods + 4, 3))  # a period contains at most one slide up and one slide down
    found, stack = np.empty((64, ROOT + max(1, flown))), np.empty((ROWS, 2))
    under_way = -1, 0, 0

    def advance(steps: int) -> bool:
        nonlocal found, under_way
        if under_way[1] == len(found):
            found = enlarged(found)
        under_way = roots(cells, least, A, B, steps, under_way, found, stack, slides)
        return under_way[2] == len(cells)

    in_slices(advance, first=FEW)
    return found[: under_way[1]]
