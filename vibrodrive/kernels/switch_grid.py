"""Switches on a grid at ε = 0 in all lanes of a batch, without branches. The results equal the results of a scan.

The end of a slide from rest, or of a wait, is a zero of its switching function. This zero is found as for certified
motions (undisturbed.py). A scan would stop at the grid point after the zero. A few values prove that it would not stop
earlier. The switching function rises up to a known phase and then falls. If it exceeds its rounding error at two
points, it also exceeds this error at all points in between. The second of the two points is the last grid point before
the zero. The first is the start of a wait, or the first grid point after the start of a slide. S4 has two sides, 1 - H
and 1 + H, and sticking ends when one of them is zero. The other side must exceed its rounding error, too. Either this
side grows until the end, so its least value is at the start. Or it is 1 - H, with the minimum 1 + B - A at the peak of
H.

The method `fixed` then switches at the grid point after the zero, eq. (10). Muller's method refines the zero from the
two grid points around the zero. So the bits equal those of a scan.

In all other cases the grid is scanned: a zero too close to a grid point, a refinement of more than two steps, and a
decision within rounding. `kernels/__init__.py` explains the terms.
"""

from typing import NamedTuple

import numpy as np

from vibrodrive.jit.branchless import choose, fma
from vibrodrive.jit.compile import inline, inline_each
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels import codes, first_zero, margins, motion, muller, switch, take_over, undisturbed
from vibrodrive.kernels import lane as r

CONFIRMED, REFINED = 2.0, 4.0
"""Numbers of evaluations that are counted for a zero that is found here: with `fixed`, and with Muller's method."""


class Cell(NamedTuple):
    """Two neighbouring grid points with a zero between them.

    number : number of the first point, counted from the last switch
    low, high : times of both points
    sure : true if a scan would certainly stop at the second point
    form, base, sig : the switching function is base + sig · shape, with coefficients `form`
    g0, g1 : its values at both points
    """

    number: float
    low: float
    high: float
    sure: bool
    form: motion.Form
    base: float
    sig: float
    g0: float
    g1: float


@inline
def cell_of(w, k, i, which):
    """Return the cell of the grid that contains the end of the state of lane i, at its cursor."""
    a, b, dtau = w[r.A + i], w[r.B + i], w[r.DTAU + i]
    number = np.floor(w[r.CURSOR + i] / dtau)
    low, high = number * dtau, (number + 1.0) * dtau
    shaped = first_zero.search_shape(w, i, which, high)
    form, base, noise = shaped.form, shaped.base, shaped.noise
    sig = choose(which == codes.S4, w[r.SIG + i], shaped.sig)
    g0 = muller.value_at(base, sig, form, low)
    g1 = muller.value_at(base, sig, form, high)
    first = fma(fma(-(1.0 / 6.0) * a, dtau, 0.5 * sig * w[r.P + i]), dtau, sig * w[r.A0 + i]) * dtau
    # S1 needs no check at the start: `apply_switch_on_grid` has checked ξ (`aside`)
    waited = choose(which == codes.S5, 1.0 - form.c0, 1.0 - abs(form.c0))
    start = choose(which >= codes.S4, waited, choose(which == codes.S1, codes.INFINITY, first))
    peak = choose((which == codes.S4) & (a <= 1.0 + b), (1.0 + b) - a, codes.INFINITY)
    sure = (g0 > noise) & (g1 < 0.0) & (switch.smaller(start, peak) > noise) & (low < TWO_PI)
    sure &= (high + dtau < motion.STRETCH) & (number < motion.LONGEST_SCAN)
    return Cell(number, low, high, sure, form, base, sig, g0, g1)


@inline
def refine_briefly(cell, tol):
    """Return (h, refined) after at most two steps of Muller's method, from the values at both ends of the cell.

    h is the zero. `refined` is true if `muller.refine` gives the same h.
    """
    base, sig, form, low, high, g0, g1 = cell.base, cell.sig, cell.form, cell.low, cell.high, cell.g0, cell.g1
    p0 = muller.on_chord(low, high, g0, g1)
    f0 = muller.value_at(base, sig, form, p0)
    below = f0 < 0.0
    lo, hi = choose(below, low, p0), choose(below, p0, high)
    p1 = muller.on_parabola(lo, hi, low, g0, high, g1, p0, f0)
    soon = abs(p1 - p0) < tol
    f1 = muller.value_at(base, sig, form, p1)
    below = f1 < 0.0
    p2 = muller.on_parabola(choose(below, lo, p1), choose(below, p1, hi), high, g1, p0, f0, p1, f1)
    refined = (f0 != 0.0) & (soon | ((p1 != lo) & (p1 != hi) & (f1 != 0.0) & (abs(p2 - p1) < tol)))
    return choose(soon, p1, p2), refined


@inline_each("fixed")
def end_in_cell(w, k, i, fixed, cell):
    """Return (h, refined, steps, arrival) of the end of a state in the cell at ε = 0.

    h, refined : time of the end since the last switch, as from `refine_briefly`. If `fixed`, h is the time of the
        second grid point, and `refined` is true
    steps : if `fixed`, number of the second grid point, counted from τ0; otherwise GRID
    arrival : motion and excitation at h
    """
    if fixed:
        h, refined = cell.high, True
        steps = k[r.GRID + i] + int(cell.number + 1.0)
        period, phi, low = motion.grid_time(w, k, i, steps)
        turned = float(period - k[r.PERIOD + i])
    else:
        h, refined = refine_briefly(cell, w[r.TOL + i])
        steps, low = k[r.GRID + i], 0.0
        turned, phi, _ = motion.advance_phase(w[r.PHI + i], w[r.LOW + i], h)
    x, v = motion.state_at(w, i, h, False)
    p, q = motion.excitation(w[r.A + i], phi, low)
    return h, refined, steps, motion.Arrival(x, v, turned, phi, low, p, q, 0.0, 0.0, 0.0)


@inline_each("fixed")
def apply_switch_on_grid(w, k, i, fixed, extent):
    """If the switch at the end of the state of lane i is ordinary, apply it. Otherwise the grid is scanned for it.

    If `fixed`, the switch is at the grid point after the zero. Otherwise Muller's method refines the zero.
    """
    which, mode, phi, x0 = k[r.SEARCH + i], w[r.SEARCH_MODE + i], w[r.PHI + i], w[r.X0 + i]
    falling, rising, dtau = which == codes.S2, which == codes.S3, w[r.DTAU + i]
    seen = w[r.OUTCOME + i] != codes.NOTHING
    met = (seen & (mode == codes.BRACKETED)) | (mode == codes.AT_ONCE)
    cell = cell_of(w, k, i, which)
    sure = met & cell.sure
    h, refined, steps, there = end_in_cell(w, k, i, fixed, cell)
    rate = undisturbed.rate_of(w[r.A0 + i], there.q - w[r.B + i] - choose(rising, 1.0, -1.0))

    # aside: ξ < 0 at the end of the slide, so the impact before this end is searched for. Within a grid step of its
    # minimum, ξ differs from the minimum by less than `slack`
    gap_form = motion.slide_shape(motion.segment_of(w, i), w[r.P + i], w[r.Q + i], True, 0.0)
    x_low = muller.value_at(0.0, 1.0, gap_form, cell.low)
    off, margin = margins.gap_rounding(w, i, h), w[r.MARGIN + i]
    slack = off + (w[r.A + i] + 1.0 + w[r.B + i]) * dtau * dtau
    aside = sure & falling & (x_low < -slack)
    guess_below = undisturbed.gap_guess(x0, x_low, cell.low)
    ordinary = sure & refined & ((there.x > slack) | (not falling))
    idle = not (met | seen)

    found = take_over.Found(h, which, there, 0.0, off, w[r.WORK + i], margin, ordinary, aside, margin, idle)
    begun = take_over.apply_ordinary(w, k, i, False, True, fixed, found, extent)
    over, to = begun.over, begun.to
    motion.commit_grid(k, i, over, steps)
    w[r.WORK + i] += choose(met, CONFIRMED if fixed else REFINED, 0.0)

    # begin the search for the end of the next state
    undisturbed.keep_guesses(w, i, over & rising, (over | aside) & falling, False, phi, h, rate)
    waiting, s = switch.waits(to), switch.direction(to)
    lo, hi, _, guess = undisturbed.bracket(w, i, s, there.phi, there.p, begun.segment.slope)
    wait, _, _, down = undisturbed.wait_end(w, i, to, there.phi)
    goal = choose(over, switch.terminating_function(to), codes.S1)
    cursor = choose(over, choose(waiting, wait, guess), guess_below)
    undisturbed.set_bracket(w, k, i, over | aside, goal, choose(over, lo, 0.0), choose(over, hi, cell.low), cursor)
    undisturbed.set_search_mode(w, i, over, choose(waiting, codes.AT_ONCE, codes.BRACKETED))
    undisturbed.set_side(w, i, over, down)
