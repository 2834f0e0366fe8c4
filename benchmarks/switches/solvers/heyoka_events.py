"""heyoka: Taylor integration with terminal events, restarted at each switch; at level 0 events that do not stop it.

A slide begins with ξ' = ±1e-16, and its events have a direction: from ξ' (or y at level 0) exactly 0 the next zero of
the same step is lost without notice, and a departure with ξ' = ξ'' = 0 triggers its own event without end. Waits end
at arcsines if ε = 0, and for ε > 0 at events on H, integrated from H'.
"""

from __future__ import annotations

import math
from functools import cache

import heyoka as hy

from benchmarks.switches.loop import event_loop, follow
from benchmarks.switches.model import DOWN, REST, STICK, UP, force, release
from benchmarks.switches.sums import departure, value

NAME, PACKAGE = "heyoka", "heyoka"
SETTINGS = [{"tol": float(f"1e-{k}")} for k in range(4, 16)] + [{"tol": 2.220446049250313e-16}]
NUDGE = {UP: 1e-16, DOWN: -1e-16}


@cache
def integrators(tol, disturbed):
    """Return for each state (integrator, its variables, its parameters A, B, and with a disturbance ε, η)."""
    xi, dxi, level = hy.make_vars("xi", "dxi", "level")
    a, b, eps, eta = (hy.par[k] for k in range(4))
    h, rate = a * hy.sin(hy.time) - b, a * hy.cos(hy.time)
    if disturbed:
        h += a * eps * eta**2 * hy.sin(eta * hy.time)
        rate += a * eps * eta**3 * hy.cos(eta * hy.time)
    falling, rising = hy.event_direction.negative, hy.event_direction.positive
    lift, drop = hy.t_event(level - 1.0, direction=rising), hy.t_event(level + 1.0, direction=falling)
    back, ground = hy.t_event(dxi, direction=rising), hy.t_event(xi, direction=falling)
    models = {
        UP: ([(xi, dxi), (dxi, h - 1.0)], [hy.t_event(dxi, direction=falling)]),
        DOWN: ([(xi, dxi), (dxi, h + 1.0)], [back, ground]),
    } | ({STICK: ([(level, rate)], [lift, drop]), REST: ([(level, rate)], [lift])} if disturbed else {})
    pars = [0.0] * (4 if disturbed else 2)
    made = [hy.taylor_adaptive(s, [0.0] * len(s), pars=pars, tol=tol, t_events=events) for s, events in models.values()]
    return {state: (ta, ta.state, ta.pars) for state, ta in zip(models, made, strict=True)}  # live views


def locate(point, tol, state, tau, xi, dxi, end):
    disturbed, slides = point.eps > 0.0, state in (UP, DOWN)
    if not (disturbed or slides):
        return release(point, state, tau), False, xi
    ta, y, pars = integrators(tol, disturbed)[state]
    pars[:] = point[: len(pars)]
    ta.time, y[0] = tau, xi if slides else force.py_func(point, tau)
    if slides:
        y[1] = dxi or NUDGE[state]
    ta.reset_cooldowns()
    outcome = ta.propagate_until(end)[0]
    if outcome == hy.taylor_outcome.time_limit:
        return math.inf, False, xi
    return ta.time, state == DOWN and int(outcome) == -2, y[0] if slides else xi


RUN = event_loop(locate, compiled=False)


def events(start, point, tol):
    """Return the switches at a tolerance of the Taylor series."""
    return follow(RUN, start, point, tol)


FOUND: list[float] = []


@cache
def counter(tol):
    """Return the integrator of y' = g'(τ) that appends the zeros of y to FOUND."""
    y, t = hy.make_vars("y"), hy.time
    c1, c2, a, alpha, b, eta, beta = (hy.par[k] for k in range(7))
    rate = c1 + 2.0 * c2 * t + a * hy.cos(t + alpha) + b * eta * hy.cos(eta * t + beta)
    zero = hy.nt_event(y, lambda ta, time, sign: FOUND.append(time))
    return hy.taylor_adaptive([(y, rate)], [0.0], pars=[0.0] * 7, tol=tol, nt_events=[zero])


def zeros(function, T, tol):
    """Return the zeros of `function` in (0, T] at a tolerance of the Taylor series."""
    FOUND.clear()
    ta = counter(tol)
    ta.pars[:] = function[1:8]
    ta.time, ta.state[0] = 0.0, value(function, 0.0) or departure(function) * NUDGE[UP]
    ta.propagate_until(T)
    return [z for z in FOUND if z > 0.0]
