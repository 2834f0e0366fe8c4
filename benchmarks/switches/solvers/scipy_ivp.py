"""scipy.integrate.solve_ivp with terminal events, restarted at each switch. At level 0 the events are not terminal.

Without `first_step` the first step could contain a complete slide, and the end of the slide would be reported at its
start.

`advised`: no step is longer than 0.9 half waves of the fastest term, and the zeros of g′ are a second event, at which
the integration ends and begins again. So a step contains no extremum, and a pair of zeros is in two steps.
"""

import math
from typing import Any

from scipy.integrate import solve_ivp

from benchmarks.switches.loop import event_loop
from benchmarks.switches.odes import EVENTS, SUM, TOLERANCES, first_value, locator, rates

NAME, PACKAGE = "scipy solve_ivp", "scipy"
SETTINGS = [{"method": method, "rtol": rtol} for method in ("RK45", "DOP853", "LSODA") for rtol in TOLERANCES]
SETTINGS += [{"method": "DOP853", "rtol": rtol, "advised": True} for rtol in (1e-10,)]
FIRST_STEP = 1e-4
AFTER = 1e-9  # the sign of g′ after a restart is taken at this distance


def crossing(component, level, direction, terminal):
    """Return the event function for a variable that passes a level."""

    def passing(_tau, y):
        return y[component] - level

    event: Any = passing
    event.terminal, event.direction = terminal, float(direction)
    return event


CROSSINGS = {state: [crossing(*event, state != SUM) for event in events] for state, events in EVENTS.items()}


def turning(rate, tau, y):
    """Return the event of the next zero of the rate of the last variable, which is g′ of the functions that end a
    state."""

    def turn(t, y):
        return rate(t, y)[-1]

    event: Any = turn
    event.terminal, event.direction = True, -math.copysign(1.0, turn(tau + AFTER, y))
    return event


def integrate(setting, state, of, tau, y, end):
    """Yield the results of `solve_ivp`, one for each part of the motion between restarts at an extremum.

    Raises ArithmeticError if a step fails.
    """
    method, rtol, *advised = setting
    rate, crossings = rates(state, of), CROSSINGS[state]
    steps: dict[str, Any] = {"rtol": rtol, "atol": 1e-2 * rtol}
    fast = of.b != 0.0 if state == SUM else of.eps > 0.0
    if advised:
        steps["max_step"] = 0.9 * math.pi / (max(1.0, of.eta) if fast else 1.0)
    while tau < end:
        events = [*crossings, turning(rate, tau, y)] if advised else crossings
        found = solve_ivp(rate, (tau, end), y, method, events=events, first_step=min(FIRST_STEP, end - tau), **steps)
        if found.status < 0:
            raise ArithmeticError(found.message)
        yield found
        if found.status == 0 or (any(len(times) for times in found.t_events[: len(crossings)]) and state != SUM):
            return
        tau, y = float(found.t[-1]), found.y[:, -1]


def solve(*arguments):
    """Return (τ, variables, number of the event) at the first event of a state, or None if there is no event."""
    *_, found = integrate(*arguments)
    which = [k for k, times in enumerate(found.t_events[: len(CROSSINGS[arguments[1]])]) if len(times)]
    return (float(found.t[-1]), found.y[:, -1].tolist(), which[0]) if which else None


events = event_loop(locator(solve, again=True), compiled=False)


def zeros(function, T, *setting, **named):
    """Return the zeros in (0, T] of the solution of y' = g'(τ), y(0) = g(0), by a method with a relative tolerance."""
    parts = integrate((*setting, *named.values()), SUM, function, 0.0, (first_value(function),), T)
    return [z for found in parts for z in found.t_events[0].tolist() if z > 0.0]
