"""scipy.integrate.solve_ivp with terminal events, restarted at each switch.

DOP853 at ε = 0 and LSODA for ε > 0 are its best methods here. `first_step` keeps the first step from
swallowing a short slide, whose event would then be placed at its start. At ε = 0 sticking and resting end at
arcsines; for ε > 0 the end is bracketed on a grid, vectorised, and found by brentq.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from benchmarks.peers.model import BUDGET, DOWN, IMPACT, REST, STICK, UP
from benchmarks.peers.record import TWO_PI, Case, Recorder, Run, Unavailable, cpu_seconds

try:
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq
except ImportError:
    solve_ivp = None

NAME = "scipy solve_ivp"
FIRST_STEP = 1e-4
WAIT_STEP = 1e-4  # grid on which the end of sticking is bracketed, ε > 0
WAIT_BLOCK = 0.05


def stopping(direction: float, component: int):
    """A terminal event: component 0 (ξ) or 1 (ξ') passes zero in `direction`."""

    def event(_tau, y):
        return y[component]

    marked: Any = event
    marked.terminal = True
    marked.direction = direction
    return marked


GROUND = [stopping(-1.0, 0)]
EVENTS = {UP: [stopping(-1.0, 1)], DOWN: [stopping(1.0, 1), *GROUND]}


def decide(state: int, force: float, impact: bool) -> int:
    """Fig. 2, as `benchmarks.peers.model.decide`, uncompiled."""
    if state == IMPACT:
        return UP if force > 1.0 else REST
    if state == REST:
        return UP
    if state == STICK:
        return UP if force > 0.0 else DOWN
    if state == DOWN and impact:
        return IMPACT
    if force > 1.0:
        return UP
    return DOWN if force < -1.0 else STICK


def arcsine_end(case: Case, state: int, tau: float) -> float:
    """When STICK or REST ends at ε = 0; inf if never."""
    ends = []
    if case.A >= 1.0 + case.B:
        ends.append(math.asin((1.0 + case.B) / case.A))
    if state == STICK and abs(1.0 - case.B) <= case.A:
        ends.append(math.pi + math.asin((1.0 - case.B) / case.A))
    return min((tau + (end - tau) % TWO_PI for end in ends), default=math.inf)


def solve(case: Case, method: str, rtol: float, atol: float) -> tuple[Recorder, int, int]:
    """The trajectory: what was recorded, evaluations, completed periods."""
    out = Recorder(case)
    A, B, eps, eta = case.A, case.B, case.eps, case.eta
    fast = A * eps * eta * eta
    sin = math.sin
    evaluations = 0

    def force(tau):
        return A * sin(tau) - B + fast * sin(eta * tau)

    def excess(tau, level):
        return force(tau) - level

    def down(tau, y):
        return (y[1], A * sin(tau) - B + fast * sin(eta * tau) + 1.0)

    def up(tau, y):
        return (y[1], A * sin(tau) - B + fast * sin(eta * tau) - 1.0)

    def wait_end(state, tau):
        while tau <= out.end:
            grid = np.arange(tau, tau + WAIT_BLOCK + WAIT_STEP, WAIT_STEP)
            h = A * np.sin(grid) - B + fast * np.sin(eta * grid)
            over = h >= 1.0
            if state == STICK:
                over |= h <= -1.0
            over[0] = False
            if over.any():
                k = int(np.argmax(over))
                side = 1.0 if h[k] >= 1.0 else -1.0
                return brentq(excess, grid[k - 1], grid[k], args=(side,), xtol=1e-15, rtol=1e-15)
            tau = grid[-1]
        return math.inf

    state, tau, xi = REST, 0.0, 0.0
    used, done = 0, 0
    while True:
        impact = False
        if state == IMPACT:
            end = tau
        elif state in (STICK, REST):
            end = wait_end(state, tau) if eps > 0.0 else arcsine_end(case, state, tau)
            while out.section_time <= min(end, out.end):
                out.point(xi, 0.0)
        else:
            y = (xi, 0.0)
            stop = tau
            while True:
                # a slide that reaches a section instant is continued there
                until = min(out.section_time, out.end + 1.0)
                piece = solve_ivp(
                    up if state == UP else down, (stop, until), y, method=method, events=EVENTS[state],
                    rtol=rtol, atol=atol, first_step=min(FIRST_STEP, until - stop),
                )  # fmt: skip
                evaluations += piece.nfev
                if state == DOWN and piece.status == 1 and piece.y[0, -1] < -atol:
                    # ξ dipped below 0 and came back within one step, unseen: again, up to the lowest point
                    lowest = piece.t[-1]
                    piece = solve_ivp(
                        down, (stop, lowest), y, method=method, events=GROUND, rtol=rtol, atol=atol,
                        first_step=min(FIRST_STEP, lowest - stop),
                    )  # fmt: skip
                    evaluations += piece.nfev
                stop, y = piece.t[-1], piece.y[:, -1]
                if piece.status == 1 or stop < until:
                    break
                out.point(*y)
                if out.section_time > out.end:
                    return out, evaluations, case.total
            end = stop
            impact = state == DOWN and len(piece.t_events[-1]) > 0
            xi = 0.0 if impact else y[0]
        whole = int(min(end, out.end) / TWO_PI)
        if whole > done:
            done, used = whole, 0
        used += 1
        if end > out.end or used > BUDGET:
            return out, evaluations, min(done, case.total)
        following = decide(state, force(end), impact)
        out.switch(end, state, following)
        state, tau = following, end


def run(case: Case, rtol: float = 1e-10, atol: float = 1e-12, method: str | None = None, repeats: int = 1) -> Run:
    """The case; by default DOP853 at ε = 0, LSODA for ε > 0. Raises Unavailable without scipy."""
    if solve_ivp is None:
        raise Unavailable("scipy is not installed")
    method = method or ("LSODA" if case.eps > 0.0 else "DOP853")
    out, evaluations, done = solve(case, method, rtol, atol)
    seconds = cpu_seconds(lambda: solve(case, method, rtol, atol), repeats)
    notes: tuple[str, ...] = (f"{method}, rtol = {rtol:g}, atol = {atol:g}",)
    if done < case.total:
        notes = (*notes, f"gave up after {done} of {case.total} periods: too many switches")
    return out.run(NAME, seconds / max(done, 1), evaluations / max(done, 1), notes)
