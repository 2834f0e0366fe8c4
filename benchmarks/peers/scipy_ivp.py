"""scipy.integrate.solve_ivp with terminal events, restarted at each switch.

DOP853 at ε = 0 and LSODA for ε > 0 are the best of its methods here. Without `first_step` the first step could contain
a short slide completely, and the end of the slide would be located at its start. At ε = 0 the ends of sticking and
resting are arcsines. For ε > 0 these ends are bracketed on a grid by NumPy and found by brentq.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.peers.record import Case, Recorder, Run, Unavailable
from vibrodrive.validation.peers import DOWN, STICK, UP, End, follow, release, stopping

try:
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq
except ImportError:
    solve_ivp = None

NAME = "scipy solve_ivp"
FIRST_STEP = 1e-4
WAIT_STEP = 1e-4  # grid on which the end of sticking is bracketed, ε > 0
WAIT_BLOCK = 0.05

GROUND = [stopping(0, -1.0)]
EVENTS = {UP: [stopping(1, -1.0)], DOWN: [stopping(1, 1.0), *GROUND]}


@dataclass
class Solver:
    """One run of a case: its recorder, and the number of evaluations of the equations of motion so far."""

    case: Case
    method: str
    rtol: float
    atol: float
    evaluations: int = 0
    out: Recorder = field(init=False)

    def run(self) -> int:
        """Compute the case from its beginning; return the completed periods."""
        self.out, self.evaluations = Recorder(self.case), 0
        wait = self.wait if self.case.eps > 0.0 else release(self.case.A, self.case.B)
        return self.out.follow(follow(self.slide, wait, self.force))

    def section(self) -> np.ndarray:
        """Return the section points of a run."""
        self.run()
        return self.out.section

    def force(self, tau: Any) -> Any:
        c = self.case
        return c.A * np.sin(tau) - c.B + c.A * c.eps * c.eta * c.eta * np.sin(c.eta * tau)

    def wait(self, state: int, tau: float) -> float:
        while tau <= self.out.end:
            grid = np.arange(tau, tau + WAIT_BLOCK + WAIT_STEP, WAIT_STEP)
            h = self.force(grid)
            over = (h >= 1.0) | ((h <= -1.0) if state == STICK else False)
            over[0] = False
            if over.any():
                k = int(np.argmax(over))
                side = 1.0 if h[k] >= 1.0 else -1.0
                return brentq(lambda t, side: self.force(t) - side, grid[k - 1], grid[k], (side,), 1e-15, 1e-15)
            tau = grid[-1]
        return math.inf

    def slide(self, state: int, tau: float, xi: float) -> End:
        out, y = self.out, (xi, 0.0)
        while True:
            # stop at a section instant, and continue the slide from there
            until = min(out.section_time, out.end + 1.0)
            piece = self.solve(state, tau, until, y, EVENTS[state])
            if state == DOWN and piece.status == 1 and piece.y[0, -1] < -self.atol:
                # ξ < 0 within one step went undetected: repeat the step up to the lowest point
                piece = self.solve(state, tau, piece.t[-1], y, GROUND)
            tau, y = piece.t[-1], piece.y[:, -1]
            if piece.status == 1 or tau < until:
                break
            out.point(*y)
            if until >= out.end:
                return math.inf, 0.0, False
        impact = state == DOWN and len(piece.t_events[-1]) > 0
        return float(tau), 0.0 if impact else float(y[0]), impact

    def solve(self, state: int, start: float, stop: float, y: Any, events: list[Any]) -> Any:
        c, sin = self.case, math.sin
        fast, pull = c.A * c.eps * c.eta * c.eta, c.B + (1.0 if state == UP else -1.0)
        piece = solve_ivp(
            lambda t, y: (y[1], c.A * sin(t) - pull + fast * sin(c.eta * t)), (start, stop), y, method=self.method,
            events=events, rtol=self.rtol, atol=self.atol, first_step=min(FIRST_STEP, stop - start),
        )  # fmt: skip
        self.evaluations += piece.nfev
        return piece


def run(case: Case, rtol: float = 1e-10, atol: float = 1e-12, method: str | None = None, repeats: int = 1) -> Run:
    """Run the case; by default DOP853 at ε = 0, LSODA for ε > 0. Raises Unavailable without scipy."""
    if solve_ivp is None:
        raise Unavailable("scipy is not installed")
    solver = Solver(case, method or ("LSODA" if case.eps > 0.0 else "DOP853"), rtol, atol)
    solver.run()
    note = f"{solver.method}, rtol = {rtol:g}, atol = {atol:g}"
    return solver.out.run(NAME, solver.run, solver.evaluations, repeats, note)
