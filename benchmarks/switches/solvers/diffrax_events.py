"""diffrax: adaptive Runge-Kutta methods with an event, compiled by JAX for the processor, restarted at each switch.

Of two events in a step diffrax does not report the earlier one. So only one event is used here: the minimum of the
functions that end a state, with bisection to the last bit.

`advised`: ±g′, positive at first, is one more of these functions, so the integration also ends at an extremum, and
begins again. A step that hides a pair of zeros contains an extremum; their minimum is negative from the first zero on.
"""

import math
from functools import cache
from typing import Any

import diffrax as dfx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

from benchmarks.switches.loop import event_loop
from benchmarks.switches.model import REST, STICK, UP, Point
from benchmarks.switches.odes import EVENTS, NUDGE, SUM, TOLERANCES, first_value, locator, longest
from benchmarks.switches.sums import Sum

jax.config.update("jax_enable_x64", True)

NAME, PACKAGE = "diffrax", "diffrax"
SETTINGS: list[dict[str, Any]] = [
    {"method": method, "rtol": rtol} for method in ("Tsit5", "Dopri8") for rtol in TOLERANCES
]
SETTINGS += [{"method": method, "rtol": 1e-12, "advised": True} for method in ("Tsit5", "Dopri8")]
FIRST_STEP = 1e-4
AFTER = 1e-9  # the sign of g′ after a restart is taken at this distance
MOST = 100_000  # largest number of zeros of a function
BISECTION: Any = optx.Bisection  # Any, because its annotations require an argument that it does not have
ROOT = BISECTION(rtol=2.3e-16, atol=1e-16)


def rates(state, t, y, of):
    """Return the derivatives of the variables. `of` is the point, or the function g."""
    if state == SUM:
        rate = of.c1 + 2.0 * of.c2 * t + of.a * jnp.cos(t + of.alpha) + of.b * of.eta * jnp.cos(of.eta * t + of.beta)
        return (of.sign * rate,)
    fast = of.A * of.eps * of.eta**2
    if state in (STICK, REST):
        return (of.A * jnp.cos(t) + fast * of.eta * jnp.cos(of.eta * t),)
    sign = 1.0 if state == UP else -1.0
    return y[1], of.A * jnp.sin(t) - of.B + fast * jnp.sin(of.eta * t) - sign


def ends(state, y):
    """Return the values of the functions whose zeros end a state. They are positive before its end."""
    return jnp.stack([(y[component] - level) * -(way or -1) for component, level, way in EVENTS[state]])


@cache
def integrator(method, state, advised):
    """Return the compiled function of (τ, end, tolerance, longest step, point or g, variables).

    It returns τ, 1 at an event (else 0), the number of the event, and the variables. If `advised`, the last number is
    that of an extremum.

    The arguments are one array, and the results are one array. To pass the numbers one by one would take as long as the
    computation of a slide.
    """
    kind = Sum if state == SUM else Point
    term = dfx.ODETerm(lambda t, y, args: rates(state, t, y, args))

    def run(given):
        (tau, end, rtol, step), of, y = (
            given[:4],
            kind(*given[4 : 4 + len(kind._fields)]),
            given[4 + len(kind._fields) :],
        )
        way = jnp.sign(rates(state, tau + AFTER, y, of)[-1])

        def passed(t, y, args):
            turn = [way * rates(state, t, y, args)[-1]] if advised else []
            return jnp.append(ends(state, y), jnp.array(turn))

        event = dfx.Event(lambda t, y, args, **_: passed(t, y, args).min(), ROOT, direction=False)
        first, steps = jnp.minimum(FIRST_STEP, end - tau), dfx.PIDController(rtol, 1e-2 * rtol, dtmax=step)
        options = {"stepsize_controller": steps, "event": event, "max_steps": None, "throw": False}
        found = dfx.diffeqsolve(term, getattr(dfx, method)(), tau, end, first, tuple(y), of, **options)
        last = [x[-1] for x in found.ys]
        which = passed(found.ts[-1], last, of).argmin() * 1.0
        return jnp.stack([found.ts[-1], found.event_mask * 1.0, which, *last])

    return jax.jit(run)


def solve(setting, state, of, tau, y, end):
    """Return (τ, variables, number of the event) at the first event of a state, or None if there is no event."""
    method, rtol, *advised = setting
    run, step = integrator(method, state, bool(advised)), longest(of) if advised else math.inf
    while tau < end:
        tau, met, which, *y = np.asarray(run(np.array([tau, end, rtol, step, *of, *y]))).tolist()
        if met and which < len(EVENTS[state]):
            return tau, y, int(which)
    return None


events = event_loop(locator(solve, again=False), compiled=False)


def zeros(function, T, *setting, **named):
    """Return the zeros in (0, T] of the solution of y' = g'(τ), y(0) = g(0). The integration is restarted at each
    zero."""
    g = first_value(function)
    f, tau, y = function._replace(sign=1.0 if g > 0.0 else -1.0), 0.0, abs(g)
    found: list[float] = []
    while tau < T and len(found) < MOST and (met := solve((*setting, *named.values()), SUM, f, tau, (y,), T)):
        f, tau, y = f._replace(sign=-f.sign), met[0], NUDGE
        found.append(tau)
    return found
