"""The event loop of all solvers that locate one switch at a time, and the loop of those that only step."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.switches.model import IMPACT, TWO_PI, decide, force, jit, start

CROWD = 2_000
"""Switches within one period after which a solver is stopped: the motions of the set have fewer than a hundred."""

MOST = 1 << 20
"""Switches of a motion after which a solver is stopped."""

Event = tuple[float, int, int]
"""τ, state before and state after a switch."""


def events_by(run: Callable[..., int]) -> Callable[..., list[Event]]:
    """Return `events(initial, point, **setting)`: the switches from `initial`, which is (ξ, ξ', τ, end).

    `run(point, initial, values of the setting, times, before, after)` fills the three arrays with the switches up to
    the end, and returns their number.
    """

    def events(initial: tuple[float, float, float, float], point: Any, **setting: Any) -> list[Event]:
        times, before, after = np.empty(MOST), np.empty(MOST, np.int8), np.empty(MOST, np.int8)
        count = run(point, initial, tuple(setting.values()), times, before, after)
        return list(zip(times[:count].tolist(), before[:count].tolist(), after[:count].tolist(), strict=True))

    return events


def event_loop(locate: Callable[..., Any], compiled: bool) -> Callable[..., list[Event]]:
    """Return the function `events` of a method that locates the end of each state.

    `locate(point, setting, state, tau, xi, dxi, end)` returns (τ of the end of a state, True at an impact, ξ there);
    τ > `end` if the state does not end before. A compiled `locate` needs `compiled=True`; a loop in Python
    evaluates the formulas itself, since a call of compiled code would take longer.
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

    `advance(point, setting, state, xi, dxi, tau, level, ahead)` returns (ξ, ξ', state, True if the mass has landed)
    after the step setting[0]; H is `level` before the step and `ahead` after it. A changed state is reported at the
    end of the step, a landing as the two switches of an impact.
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
