"""CVODE of SUNDIALS in scikit-sundae: Adams' method and its search for roots, restarted at each switch.

A result contains the events of all restarts. The last row of `i_events` belongs to the present restart.
"""

from functools import cache
from typing import Any

from sksundae.cvode import CVODE

from benchmarks.switches.loop import event_loop
from benchmarks.switches.odes import EVENTS, SUM, TOLERANCES, first_value, locator, longest, rates

NAME, PACKAGE = "CVODE", "scikit-sundae"
SETTINGS: list[dict[str, Any]] = [{"rtol": rtol} for rtol in TOLERANCES]
SETTINGS += [{"rtol": rtol, "advised": True} for rtol in (1e-8, 1e-10, 1e-12)]
ROOT = 2  # CV_ROOT_RETURN, the status of a step that ends at an event
MOST = 100_000  # largest number of zeros of a function


@cache
def solver(state, step, rtol, advised=False):
    """Return (solver, list whose only item is the right-hand side of the differential equation). `step` is the longest
    step, 0 for any."""
    rate: list[Any] = [None]

    def right(t, y, dy):
        dy[:] = rate[0](t, y)

    def crossings(t, y, g):
        for k, (component, level, _) in enumerate(EVENTS[state]):
            g[k] = y[component] - level
        if advised:
            g[-1] = rate[0](t, y)[-1]

    passing: Any = crossings
    passing.direction = [direction for _, _, direction in EVENTS[state]] + [0] * advised
    options = {"method": "Adams", "rtol": rtol, "atol": 1e-2 * rtol, "max_num_steps": 10**8, "max_step": step}
    return CVODE(right, eventsfn=passing, num_events=len(passing.direction), **options), rate


def begin(setting, state, of, tau, y):
    """Return the solver of a state, started at τ."""
    cvode, rate = solver(state, longest(of) if len(setting) > 1 else 0.0, *setting)
    rate[0] = rates(state, of)
    cvode.init_step(tau, y)
    return cvode


def next_event(cvode, end, state):
    """Return the result at the next event, or None if there is no event before the end. Raises ArithmeticError if a
    step fails."""
    while True:
        result = cvode.step(end, tstop=end)
        if not result.success:
            raise ArithmeticError(result.message)
        if result.status != ROOT:
            return None
        if any(result.i_events[-1][: len(EVENTS[state])]):
            return result
        cvode.init_step(result.t, result.y)  # at a zero of g′ without a restart CVODE may fail: root very near t


def solve(setting, state, point, tau, y, end):
    """Return (τ, variables, number of the event) at the first event of a state, or None if there is no event."""
    met = next_event(begin(setting, state, point, tau, y), end, state)
    return met and (met.t, met.y.tolist(), int(abs(met.i_events[-1][: len(EVENTS[state])]).argmax()))


events = event_loop(locator(solve, again=True), compiled=False)


def zeros(function, T, *setting, **named):
    """Return the zeros in (0, T] of the solution of y' = g'(τ), y(0) = g(0), for a relative tolerance."""
    found: list[float] = []
    cvode = begin((*setting, *named.values()), SUM, function, 0.0, (first_value(function),))
    while len(found) < MOST and (met := next_event(cvode, T, SUM)):
        found.append(met.t)
    return found
