"""The event loop of all solvers that locate one switch at a time, and the loop of all solvers with fixed steps."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.switches.model import IMPACT, TWO_PI, decide, force, jit, start

CROWD = 2_000
"""Largest number of switches in one period. A solver with more is stopped; motions of the set have fewer than 100."""

MOST = 1 << 20
"""Largest number of switches of a motion; a solver with more is stopped."""

UNKNOWN = "rounding hides the first zero"
"""The error of a method that refuses a case, because it cannot decide whether there is a first zero, or where."""

Event = tuple[float, int, int]
"""τ, state before and state after a switch."""


def events_by(run: Callable[..., int]) -> Callable[..., list[Event]]:
    """Return a function `events(initial, point, **setting)`. It returns the switches of the motion that starts at τ
    with ξ and ξ' and ends at `end`; `initial` is (ξ, ξ', τ, end).

    `run(point, initial, values of the setting, times, before, after)` fills the three arrays with the switches up to
    the end, and returns the number of switches.
    """

    def events(initial: tuple[float, float, float, float], point: Any, **setting: Any) -> list[Event]:
        times, before, after = np.empty(MOST), np.empty(MOST, np.int8), np.empty(MOST, np.int8)
        count = run(point, initial, tuple(setting.values()), times, before, after)
        return list(zip(times[:count].tolist(), before[:count].tolist(), after[:count].tolist(), strict=True))

    return events


def event_loop(locate: Callable[..., Any], compiled: bool) -> Callable[..., list[Event]]:
    """Return the function `events` of a method that locates the end of each state.

    `locate(point, setting, state, tau, xi, dxi, end)` returns (τ of the end of the state, True at an impact, ξ at this
    τ). If the state does not end before `end`, this τ is greater than `end`. If the method cannot decide, τ is NaN; the
    motion ends there, and is refused if it has no switch yet. A compiled `locate` needs `compiled=True`. Otherwise the
    loop runs in Python and evaluates the formulas in Python, because calls of compiled functions would take longer.
    """
    h, first, decided = (force, start, decide) if compiled else (force.py_func, start.py_func, decide.py_func)

    def run(point, initial, setting, times, before, after):
        xi, dxi, tau, end = initial
        state = first(h(point, tau), xi, dxi)
        count = 0
        while count < len(times):
            impact = False
            if state != IMPACT:
                tau, impact, xi = locate(point, setting, state, tau, xi, dxi, end)
            if not tau <= end:
                if math.isnan(tau) and not count:
                    raise ArithmeticError(UNKNOWN)
                break
            next_state = decided(state, h(point, tau), impact)
            times[count], before[count], after[count] = tau, state, next_state
            count += 1
            if count > CROWD and tau - times[count - CROWD] < TWO_PI:
                break
            state, dxi = next_state, 0.0
            if impact:
                xi = 0.0
        return count

    return events_by(jit(run) if compiled else run)


def step_loop(advance: Callable[..., Any]) -> Callable[..., list[Event]]:
    """Return the function `events` of a method of fixed step, which does not locate switches.

    `advance(point, setting, state, xi, dxi, tau, level, ahead)` returns (ξ, ξ', state, True after an impact) at the end
    of a step of length setting[0]. H is `level` before the step and `ahead` after the step. A changed state is reported
    at the end of the step. An impact is reported as two switches.
    """

    def run(point, initial, setting, times, before, after):
        xi, dxi, tau0, end = initial
        level = force(point, tau0)
        state = start(level, xi, dxi)
        tau, count, k = tau0, 0, 0
        while tau < end and count < len(times) - 1:
            k += 1
            next_tau = tau0 + k * setting[0]
            ahead = force(point, next_tau)
            xi, dxi, next_state, landed = advance(point, setting, state, xi, dxi, tau, level, ahead)
            tau, level = next_tau, ahead
            if tau > end or not math.isfinite(xi):
                break
            if landed:
                times[count], before[count], after[count] = tau, state, IMPACT
                count, state = count + 1, IMPACT
            if next_state != state:
                times[count], before[count], after[count] = tau, state, next_state
                count, state = count + 1, next_state
                if count > CROWD and tau - times[count - CROWD] < TWO_PI:
                    break
        return count

    return events_by(jit(run))
