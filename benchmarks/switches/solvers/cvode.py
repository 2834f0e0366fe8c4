"""CVODE of SUNDIALS in scikit-sundae: Adams' method and its search for roots, restarted at each switch.

A result contains the events of all restarts. The last row of `i_events` belongs to the present restart.
"""

from functools import cache
from typing import Any

from sksundae.cvode import CVODE

from benchmarks.switches.loop import event_loop
from benchmarks.switches.odes import EVENTS, SUM, TOLERANCES, first_value, locator, rates

NAME, PACKAGE = "CVODE", "scikit-sundae"
SETTINGS = [{"rtol": rtol} for rtol in TOLERANCES]
ROOT = 2  # CV_ROOT_RETURN, the status of a step that ends at an event
MOST = 100_000  # largest number of zeros of a function


@cache
def solver(state, rtol):
    """Return (solver, list whose only item is the right-hand side of the differential equation)."""
    rate: list[Any] = [None]

    def right(t, y, dy):
        dy[:] = rate[0](t, y)

    def crossings(t, y, g):
        for k, (component, level, _) in enumerate(EVENTS[state]):
            g[k] = y[component] - level

    passing: Any = crossings
    passing.direction = [direction for _, _, direction in EVENTS[state]]
    options = {"method": "Adams", "rtol": rtol, "atol": 1e-2 * rtol, "max_num_steps": 10**8}
    return CVODE(right, eventsfn=passing, num_events=len(EVENTS[state]), **options), rate


def begin(setting, state, of, tau, y):
    """Return the solver of a state, started at τ."""
    cvode, rate = solver(state, *setting)
    rate[0] = rates(state, of)
    cvode.init_step(tau, y)
    return cvode


def next_event(cvode, end):
    """Return the result at the next event, or None if there is no event before the end. Raises ArithmeticError if a
    step fails."""
    result = cvode.step(end, tstop=end)
    if not result.success:
        raise ArithmeticError(result.message)
    return result if result.status == ROOT else None


def solve(setting, state, point, tau, y, end):
    """Return (τ, variables, number of the event) at the first event of a state, or None if there is no event."""
    met = next_event(begin(setting, state, point, tau, y), end)
    return met and (met.t, met.y.tolist(), int(abs(met.i_events[-1]).argmax()))


events = event_loop(locator(solve, again=True), compiled=False)


def zeros(function, T, rtol):
    """Return the zeros in (0, T] of the solution of y' = g'(τ), y(0) = g(0), for a relative tolerance."""
    found: list[float] = []
    cvode = begin((rtol,), SUM, function, 0.0, (first_value(function),))
    while len(found) < MOST and (met := next_event(cvode, T)):
        found.append(met.t)
    return found
