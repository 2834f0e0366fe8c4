"""scipy.integrate.solve_ivp with terminal events, restarted at each switch; at level 0 events that do not stop it.

Without `first_step` a first step could hold a whole slide, and its end would be found at its start. Waits end at
arcsines if ε = 0, and for ε > 0 at events on H, integrated from H'. A slide down that would stop behind the obstacle is
done again up to there for its impact, which two zeros of ξ within a step have hidden.
"""

from __future__ import annotations

import math
from typing import Any

from scipy.integrate import solve_ivp

from benchmarks.switches.loop import event_loop, follow
from benchmarks.switches.model import DOWN, REST, STICK, UP, force, force_rate, release
from benchmarks.switches.sums import departure, slope, value

NAME, PACKAGE = "scipy solve_ivp", "scipy"
SETTINGS = [
    {"method": method, "rtol": float(f"1e-{k}")} for method in ("RK45", "DOP853", "LSODA") for k in range(4, 14)
]
FIRST_STEP, NUDGE = 1e-4, 1e-16


def stopping(component, level, direction):
    """Return a terminal event: a variable passes a level in a direction."""

    def passing(_tau, y):
        return y[component] - level

    event: Any = passing
    event.terminal, event.direction = True, direction
    return event


GROUND, LIFT = stopping(0, 0.0, -1.0), stopping(0, 1.0, 1.0)
EVENTS = {
    UP: [stopping(1, 0.0, -1.0)],
    DOWN: [stopping(1, 0.0, 1.0), GROUND],
    STICK: [LIFT, stopping(0, -1.0, -1.0)],
    REST: [LIFT],
}


def solve(rate, tau, end, y, events, method, rtol):
    """Return the result of `solve_ivp`; raise ArithmeticError if a step fails."""
    first = min(FIRST_STEP, end - tau)
    found = solve_ivp(rate, (tau, end), y, method, events=events, rtol=rtol, atol=1e-2 * rtol, first_step=first)
    if found.status < 0:
        raise ArithmeticError(found.message)
    return found


def locate(point, setting, state, tau, xi, dxi, end):
    slides, h, rate = state in (UP, DOWN), force.py_func, force_rate.py_func
    if tau == end:
        return math.inf, False, xi
    if not slides:
        if point.eps == 0.0:
            return release(point, state, tau), False, xi
        found = solve(lambda t, y: (rate(point, t),), tau, end, (h(point, tau),), EVENTS[state], *setting)
        return (float(found.t[-1]) if found.status == 1 else math.inf), False, xi
    sign = 1.0 if state == UP else -1.0
    y = xi, dxi or NUDGE * sign

    def fall(t, y):
        return y[1], h(point, t) - sign

    found = solve(fall, tau, end, y, EVENTS[state], *setting)
    if found.status == 0:
        return math.inf, False, xi
    impact = state == DOWN and len(found.t_events[1]) > 0
    if state == DOWN and not impact and found.y[0, -1] < -1e-2 * setting[1]:
        found, impact = solve(fall, tau, float(found.t[-1]), y, [GROUND], *setting), True
    return float(found.t[-1]), impact, float(found.y[0, -1])


RUN = event_loop(locate, compiled=False)


def events(start, point, method, rtol):
    """Return the switches by a method at a tolerance."""
    return follow(RUN, start, point, (method, rtol))


def zeros(function, T, method, rtol):
    """Return the zeros of y' = g'(τ), y(0) = g(0) in (0, T] by a method at a tolerance."""
    rate, y = slope.py_func, (value(function, 0.0) or departure(function) * NUDGE,)
    found = solve(lambda t, y: (rate(function, t),), 0.0, T, y, [lambda t, y: y[0]], method, rtol)
    return [z for z in found.t_events[0].tolist() if z > 0.0]
