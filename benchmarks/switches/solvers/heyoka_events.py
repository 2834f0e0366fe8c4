"""heyoka: Taylor integration with terminal events, restarted at each switch. At level 0 the events are not terminal.

Events have a direction, and no slide begins with ξ' exactly 0. From ξ' = 0 heyoka misses the next zero of the same step
without a message. From ξ' = ξ'' = 0 it reports the event at the start endlessly.
"""

import math
from functools import cache
from typing import Any

import heyoka as hy

from benchmarks.switches.loop import event_loop
from benchmarks.switches.model import DOWN, REST, STICK, UP
from benchmarks.switches.odes import EVENTS, TOLERANCES, first_value, locator, longest

NAME, PACKAGE = "heyoka", "heyoka"
SETTINGS: list[dict[str, Any]] = [{"tol": tol} for tol in (*TOLERANCES, 1e-15, 2.220446049250313e-16)]
SETTINGS += [{"tol": tol, "advised": True} for tol in (1e-8, 1e-13, 2.220446049250313e-16)]


@cache
def integrators(tol, advised, disturbed):
    """Return for each state (integrator, its variables, its parameters). The parameters are A, B and, with a
    disturbance, ε, η. If `advised`, a step also ends where the rate of the last variable is 0."""
    xi, dxi, level = hy.make_vars("xi", "dxi", "level")
    a, b, eps, eta = (hy.par[k] for k in range(4))
    h, rate = a * hy.sin(hy.time) - b, a * hy.cos(hy.time)
    if disturbed:
        h += a * eps * eta**2 * hy.sin(eta * hy.time)
        rate += a * eps * eta**3 * hy.cos(eta * hy.time)
    ways = {1: hy.event_direction.positive, -1: hy.event_direction.negative}

    def integrator(state, *system):
        passing = [(system[component][0] - at, ways[way]) for component, at, way in EVENTS[state]]
        events = [hy.t_event(function, direction=way) for function, way in passing]
        events += [hy.t_event(system[-1][1], callback=lambda ta, sign: True)] if advised else []
        pars = [0.0] * (4 if disturbed else 2)
        ta = hy.taylor_adaptive([*system], [0.0] * len(system), pars=pars, tol=tol, t_events=events)
        return ta, ta.state, ta.pars  # views of the integrator's data

    slides = {s: integrator(s, (xi, dxi), (dxi, h - sign)) for s, sign in ((UP, 1.0), (DOWN, -1.0))}
    return slides | {s: integrator(s, (level, rate)) for s in (STICK, REST) if disturbed}


def solve(setting, state, point, tau, y, end):
    """Return (τ, variables, number of the event) at the first event of a state, or None if there is no event."""
    tol, *advised = setting
    ta, variables, pars = integrators(tol, bool(advised), point.eps > 0.0)[state]
    pars[:] = point[: len(pars)]
    ta.time = tau
    for k, x in enumerate(y):
        variables[k] = x
    ta.reset_cooldowns()
    outcome = ta.propagate_until(end, max_delta_t=longest(point) if advised else math.inf)[0]
    return None if outcome == hy.taylor_outcome.time_limit else (ta.time, variables, -1 - int(outcome))


events = event_loop(locator(solve, again=False), compiled=False)


FOUND: list[float] = []


@cache
def counter(tol, advised):
    """Return the integrator of y' = g'(τ) that appends the zeros of y to FOUND."""
    y, t = hy.make_vars("y"), hy.time
    c1, c2, a, alpha, b, eta, beta = (hy.par[k] for k in range(7))
    rate = c1 + 2.0 * c2 * t + a * hy.cos(t + alpha) + b * eta * hy.cos(eta * t + beta)
    zero = hy.nt_event(y, lambda ta, time, sign: FOUND.append(time))
    turns = [hy.t_event(rate, callback=lambda ta, sign: True)] if advised else []
    return hy.taylor_adaptive([(y, rate)], [0.0], pars=[0.0] * 7, tol=tol, nt_events=[zero], t_events=turns)


def zeros(function, T, tol, advised=False):
    """Return the zeros of `function` in (0, T] for a tolerance of the Taylor series."""
    FOUND.clear()
    ta = counter(tol, advised)
    ta.pars[:] = function[1:8]
    ta.time, ta.state[0] = 0.0, first_value(function)
    ta.propagate_until(T, max_delta_t=longest(function) if advised else math.inf)
    return [z for z in FOUND if z > 0.0]
