"""Arb, through python-flint: `branch_prune`, repeated with 50 digits where double precision does not decide.

Level 0 only. The boxes and the start rule are the same, so exact double zeros remain undecided.
"""

import numpy as np
from flint import arb, ctx

from benchmarks.switches.loop import UNKNOWN
from benchmarks.switches.solvers import branch_prune
from benchmarks.switches.solvers.branch_prune import above, add, all_by, below, first_by, spread, taylor

NAME, PACKAGE = "branch and prune, Arb", "python-flint"
SETTINGS: list[dict[str, float]] = [{}]
DIGITS = 50


def outwards(x):
    """Return bounds of a real ball as doubles. 0 remains 0."""
    low, high = float(x.lower()), float(x.upper())
    return low and below(low), high and above(high)


def enclose(f, m, rho):
    """Return bounds of g at m, and of g, g′ and g″ in m ± rho."""
    at, box = arb(m), arb(m, rho)
    g, d, b = f.c0 + (f.c1 + f.c2 * at) * at, f.c1 + 2 * f.c2 * at, arb(2 * f.c2)
    for a, w, phase in ((arb(f.a), arb(1), f.alpha), (arb(f.b), arb(f.eta), f.beta)):
        sin, cos = (w * at + phase).sin_cos()
        g, d, b = g + a * sin, d + a * w * cos, b - a * w**2 * (w * box + phase).sin()
    g, d, b = outwards(g), outwards(d), outwards(b)
    return g, taylor(g, d, b, rho), add(d, spread(b, rho)), b


def not_compiled(search):
    """Return a search that calls Arb, and so runs in Python."""
    return search


fill = all_by(enclose, first_by(enclose, not_compiled), not_compiled)


def zeros(function, T):
    """Return the zeros of `function` in (0, T], or those before the first that is undecided."""
    found, whole = branch_prune.search(function, T)
    if not whole:
        ctx.dps = DIGITS
        room = np.empty(100_000)
        count, whole = fill(function, T, room)
        found = room[:count].tolist()
    if not found and not whole:
        raise ArithmeticError(UNKNOWN)
    return found
