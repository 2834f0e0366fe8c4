"""scipy.integrate.solve_ivp with terminal events, restarted at each switch. At level 0 the events are not terminal.

Without `first_step` the first step could contain a complete slide, and the end of the slide would be reported at its
start.
"""

from typing import Any

from scipy.integrate import solve_ivp

from benchmarks.switches.loop import event_loop
from benchmarks.switches.odes import EVENTS, SUM, TOLERANCES, first_value, locator, rates

NAME, PACKAGE = "scipy solve_ivp", "scipy"
SETTINGS = [{"method": method, "rtol": rtol} for method in ("RK45", "DOP853", "LSODA") for rtol in TOLERANCES]
FIRST_STEP = 1e-4


def crossing(component, level, direction, terminal):
    """Return the event function for a variable that passes a level."""

    def passing(_tau, y):
        return y[component] - level

    event: Any = passing
    event.terminal, event.direction = terminal, float(direction)
    return event


CROSSINGS = {state: [crossing(*event, state != SUM) for event in events] for state, events in EVENTS.items()}


def integrate(setting, state, of, tau, y, end):
    """Return the result of `solve_ivp`. Raises ArithmeticError if a step fails."""
    method, rtol = setting
    steps = {"rtol": rtol, "atol": 1e-2 * rtol, "first_step": min(FIRST_STEP, end - tau)}
    found = solve_ivp(rates(state, of), (tau, end), y, method, events=CROSSINGS[state], **steps)
    if found.status < 0:
        raise ArithmeticError(found.message)
    return found


def solve(*arguments):
    """Return (τ, variables, number of the event) at the first event of a state, or None if there is no event."""
    found = integrate(*arguments)
    which = [k for k, times in enumerate(found.t_events) if len(times)]
    return (float(found.t[-1]), found.y[:, -1].tolist(), which[0]) if which else None


events = event_loop(locator(solve, again=True), compiled=False)


def zeros(function, T, method, rtol):
    """Return the zeros in (0, T] of the solution of y' = g'(τ), y(0) = g(0), by a method with a relative tolerance."""
    found = integrate((method, rtol), SUM, function, 0.0, (first_value(function),), T)
    return [z for z in found.t_events[0].tolist() if z > 0.0]
