"""The event loop of all solvers that locate one switch at a time."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.switches.model import IMPACT, decide, force, jit, start

CROWD = 2_000
"""Switches in one period after which a solver is stopped: the motions of the set have fewer than a hundred."""


def event_loop(locate: Callable[..., Any], compiled: bool) -> Callable[..., int]:
    """Return `run(point, initial, setting, times, before, after)`, which follows a motion.

    It fills the three arrays with the switches up to the end or up to their length, and returns the number of switches.
    `locate(point, setting, state, tau, xi, dxi, end)` returns (τ of the end of a state, True at an impact, ξ there);
    τ > `end` if the state does not end before. A compiled `locate` needs `compiled=True`; a loop in Python
    evaluates the formulas itself, since a call of compiled code would take longer.
    """
    h, first, decided = (force, start, decide) if compiled else (force.py_func, start.py_func, decide.py_func)

    def run(point, initial, setting, times, before, after):
        xi, dxi, tau, end = initial
        state = first(h(point, tau), xi, dxi)
        count, last = 0, 0
        while count < len(times):
            impact = False
            if state != IMPACT:
                tau, impact, xi = locate(point, setting, state, tau, xi, dxi, end)
            if not tau <= end:
                break
            next_state = decided(state, h(point, tau), impact)
            times[count], before[count], after[count] = tau, state, next_state
            if count - last > CROWD:
                if tau - times[last] < 2.0 * math.pi:
                    break
                last = count
            count += 1
            state, dxi = next_state, 0.0
            if impact:
                xi = 0.0
        return count

    return jit(run) if compiled else run


Event = tuple[float, int, int]
"""τ, state before and state after a switch."""


def follow(
    run: Callable[..., int], initial: tuple[float, float, float, float], point: Any, setting: Any
) -> list[Event]:
    """Return the switches of a motion; `initial` is (ξ, ξ', τ, end)."""
    size = 4096
    while True:
        times, before, after = np.empty(size), np.empty(size, np.int8), np.empty(size, np.int8)
        count = run(point, initial, setting, times, before, after)
        if count < size:
            return list(zip(times[:count].tolist(), before[:count].tolist(), after[:count].tolist(), strict=True))
        size *= 8
