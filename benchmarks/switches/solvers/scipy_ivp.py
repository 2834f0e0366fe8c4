"""scipy.integrate.solve_ivp with terminal events, restarted at each switch. At level 0 the events are not terminal.

Without `first_step` the first step could contain a complete slide, and the end of the slide would be reported at its
start.

`advised`: the integration ends at an extremum and begins again. At an extremum behind the zero the last step has hidden
a pair of zeros, so the part is computed again up to the extremum, where its last step now ends.
"""

import math
from typing import Any

from scipy.integrate import solve_ivp

from benchmarks.switches.loop import event_loop
from benchmarks.switches.odes import EVENTS, SUM, TOLERANCES, first_value, locator, longest, rates

NAME, PACKAGE = "scipy solve_ivp", "scipy"
SETTINGS = [{"method": method, "rtol": rtol} for method in ("RK45", "DOP853", "LSODA") for rtol in TOLERANCES]
SETTINGS += [{"method": method, "rtol": 1e-10, "advised": True} for method in ("RK45", "DOP853", "LSODA")]
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
    if advised:
        steps["max_step"] = longest(of)

    def part(end, events):
        found = solve_ivp(rate, (tau, end), y, method, events=events, first_step=min(FIRST_STEP, end - tau), **steps)
        if found.status < 0:
            raise ArithmeticError(found.message)
        return found

    while tau < end:
        found = part(end, [*crossings, turning(rate, tau, y)] if advised else crossings)
        at, last = float(found.t[-1]), found.y[:, -1]
        if advised and any(
            passed(at, last) * passed(tau, y) < 0.0 and not len(times)
            for passed, times in zip(crossings, found.t_events, strict=False)
        ):
            found = part(at, crossings)
        yield found
        if at >= end or (any(len(times) for times in found.t_events[: len(crossings)]) and state != SUM):
            return
        tau, y = at, last


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
