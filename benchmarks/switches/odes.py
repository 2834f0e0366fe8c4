"""The model as differential equations with events, for solvers of such equations.

The variables of a slide are ξ and ξ'. A slide from rest begins with ξ' = ±1e-16, because at ξ' = 0 some solvers report
the start as an event, and others miss the next event. If ε = 0, an arcsine gives the end of a wait (STICK or REST). If
ε > 0, H is integrated in a wait, so that the steps follow the disturbance.

Settings that are `advised` follow what manuals say about missed events: no step is longer than 0.9 half waves of the
fastest term (`longest`), and g′, the rate of the last variable, is a second event at which a step ends.
"""

import math
from collections.abc import Callable
from typing import Any

from benchmarks.switches.model import DOWN, REST, STICK, UP, force, force_rate, release
from benchmarks.switches.sums import departure, slope, value

NUDGE = 1e-16
TOLERANCES = [1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-13]

GROUND, SUM = 5, 6
"""Further kinds of search: a slide down that ends only at the obstacle, and a function of level 0 with y' = g'."""

EVENTS = {
    UP: [(1, 0.0, -1)],
    DOWN: [(1, 0.0, 1), (0, 0.0, -1)],
    STICK: [(0, 1.0, 1), (0, -1.0, -1)],
    REST: [(0, 1.0, 1)],
    GROUND: [(0, 0.0, -1)],
    SUM: [(0, 0.0, 0)],
}
"""Events that end each kind of search: (number of the variable, level that it crosses, direction: 1 up, −1 down, 0
both). In a wait, variable 0 is H."""


def rates(state: int, of: Any) -> Callable[[float, Any], tuple[float, ...]]:
    """Return the right-hand side of the differential equation of `state`, a function of (τ, variables).

    `of` is the Point with the parameters A, B, ε and η of the motion; for SUM it is the function g.
    """
    h, rate = force.py_func, (slope if state == SUM else force_rate).py_func
    if state in (STICK, REST, SUM):
        return lambda t, y: (rate(of, t),)
    sign = 1.0 if state == UP else -1.0
    return lambda t, y: (y[1], h(of, t) - sign)


def longest(of: Any) -> float:
    """Return 0.9 half waves of the fastest term of a Point or of a function of level 0."""
    fast = of.eps if hasattr(of, "eps") else of.b
    return 0.9 * math.pi / (max(1.0, of.eta) if fast != 0.0 else 1.0)


def first_value(function: Any) -> float:
    """Return g(0) or, if g(0) = 0, 1e-16 with the sign that g has just after 0."""
    return value(function, 0.0) or departure(function) * NUDGE


def locator(solve: Callable[..., Any], again: bool) -> Callable[..., tuple[float, bool, float]]:
    """Return the function `locate` that `event_loop` calls (loop.py).

    `solve(setting, state, point, tau, y, end)` returns (τ, variables, number of the event) at the first event of a
    state, or None if there is none. If a slide down ends at a reversal behind the obstacle, a step has hidden two zeros
    of ξ; the first is the impact. If `again` is True, this slide is computed again, to find the impact.
    """

    def locate(point, setting, state, tau, xi, dxi, end):
        if tau >= end or (state in (STICK, REST) and point.eps == 0.0):
            return (release(point, state, tau) if tau < end else math.inf), False, xi
        if state in (STICK, REST):
            met = solve(setting, state, point, tau, (force.py_func(point, tau),), end)
            return (met[0] if met else math.inf), False, xi
        start = xi, dxi or (NUDGE if state == UP else -NUDGE)
        met = solve(setting, state, point, tau, start, end)
        if not met:
            return math.inf, False, xi
        at, y, which = met
        if again and state == DOWN and which == 0 and y[0] < 0.0:
            (at, y, _), which = solve(setting, GROUND, point, tau, start, at) or met, 1
        return at, state == DOWN and which == 1, y[0]

    return locate
