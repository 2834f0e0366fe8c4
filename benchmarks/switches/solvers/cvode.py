"""CVODE of SUNDIALS by scikit-sundae: Adams' method and its search for roots, restarted at each switch.

A slide begins with ξ' = ±1e-16. Waits end at arcsines if ε = 0, and for ε > 0 at events on H, integrated from H'. A
slide down that would stop behind the obstacle is done again up to there for its impact. Of the events that the solver
keeps from all its restarts the last row is that of the present one.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from sksundae.cvode import CVODE

from benchmarks.switches.loop import event_loop, follow
from benchmarks.switches.model import DOWN, REST, STICK, UP, force, force_rate, release
from benchmarks.switches.sums import departure, slope, value

NAME, PACKAGE = "CVODE", "scikit-sundae"
SETTINGS = [{"rtol": float(f"1e-{k}")} for k in range(4, 14)]
NUDGE = 1e-16
ROOT = 2  # CV_ROOT_RETURN
MOST = 100_000  # zeros of a function
GROUND, SUM = 5, 6
"""Beside the states: a slide down that ends at the obstacle alone, and a function of level 0."""

LIFT, FALL = (0, 1.0, 1), (0, 0.0, -1)
EVENTS = {
    UP: [(1, 0.0, -1)], DOWN: [(1, 0.0, 1), FALL], STICK: [LIFT, (0, -1.0, -1)], REST: [LIFT], GROUND: [FALL],
    SUM: [(0, 0.0, 0)],
}  # fmt: skip
"""The variable, the level that it passes, and the direction."""


@cache
def solver(state, rtol):
    """Return (solver, list of the point or function that it is to use)."""
    h, level_rate, rate = force.py_func, force_rate.py_func, slope.py_func
    data, sign = [None], 1.0 if state == UP else -1.0

    def slide(t, y, dy):
        dy[0], dy[1] = y[1], h(data[0], t) - sign

    def wait(t, y, dy):
        dy[0] = level_rate(data[0], t)

    def plain(t, y, dy):
        dy[0] = rate(data[0], t)

    def crossings(t, y, g):
        for k, (component, level, _) in enumerate(EVENTS[state]):
            g[k] = y[component] - level

    passing: Any = crossings
    passing.direction = [direction for _, _, direction in EVENTS[state]]
    events = {"eventsfn": passing, "num_events": len(EVENTS[state])}
    right = plain if state == SUM else wait if state in (STICK, REST) else slide
    tolerances = {"rtol": rtol, "atol": 1e-2 * rtol, "max_num_steps": 10**8}
    return CVODE(right, method="Adams", **tolerances, **events), data


def next_event(cvode, end):
    """Return the result at the next event, None without one before the end; raise ArithmeticError if a step fails."""
    result = cvode.step(end, tstop=end)
    if not result.success:
        raise ArithmeticError(result.message)
    return result if result.status == ROOT else None


def begin(state, rtol, used, tau, *y):
    """Return the solver of a state at τ with its variables, and with the point or function that it is to use."""
    cvode, data = solver(state, rtol)
    data[0] = used
    cvode.init_step(tau, y)
    return cvode


def locate(point, rtol, state, tau, xi, dxi, end):
    if tau == end:
        return math.inf, False, xi
    if state in (STICK, REST):
        if point.eps == 0.0:
            return release(point, state, tau), False, xi
        met = next_event(begin(state, rtol, point, tau, force.py_func(point, tau)), end)
        return (met.t if met else math.inf), False, xi
    start = xi, dxi or (NUDGE if state == UP else -NUDGE)
    met = next_event(begin(state, rtol, point, tau, *start), end)
    if met is None:
        return math.inf, False, xi
    impact = state == DOWN and met.i_events[-1][1] != 0
    if state == DOWN and not impact and met.y[0] < -1e-2 * rtol:
        met, impact = next_event(begin(GROUND, rtol, point, tau, *start), met.t) or met, True
    return met.t, impact, float(met.y[0])


RUN = event_loop(locate, compiled=False)


def events(start, point, rtol):
    """Return the switches at a tolerance."""
    return follow(RUN, start, point, rtol)


def zeros(function, T, rtol):
    """Return the zeros of y' = g'(τ), y(0) = g(0) in (0, T] at a tolerance."""
    y = value(function, 0.0) or departure(function) * NUDGE
    found: list[float] = []
    cvode = begin(SUM, rtol, function, 0.0, y)
    while len(found) < MOST and (met := next_event(cvode, T)):
        found.append(met.t)
    return found
