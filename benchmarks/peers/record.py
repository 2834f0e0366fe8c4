"""Record that every peer returns, and its timing."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from benchmarks.peers.model import BUDGET, REST, STICK
from vibrodrive.model.names import ETA
from vibrodrive.validation.peers import Switch

TWO_PI = 2.0 * math.pi


class Unavailable(RuntimeError):
    """The package of a peer is not installed. The caller omits the peer and prints a note."""


@dataclass(frozen=True)
class Case:
    """One trajectory from rest at τ = 0. Everything is dimensionless; `section_phase` in [0, 2π)."""

    A: float
    eps: float = 0.0
    B: float = 0.1
    eta: float = ETA
    transient: int = 0
    periods: int = 20
    section_phase: float = 0.0

    @property
    def total(self) -> int:
        """Excitation periods computed."""
        return self.transient + self.periods

    @property
    def first_section(self) -> float:
        """First section instant after τ = 0; the others follow at distances of 2π."""
        return self.section_phase if self.section_phase > 0.0 else TWO_PI


@dataclass(frozen=True)
class Run:
    """Result of a peer for a case.

    With T = `transient` and P = `periods`, the n switches in (2πT, 2π(T + P)] are recorded in order: `period` int64
    (n,) and `phase` float64 (n,) with τ = 2π·period + phase, `before` and `after` int8 (n,) as `vibrodrive.State`.
    `section` is float64 (periods, 2) with ξ, ξ'. `seconds` is the CPU time per period without compilation, the median
    of the repetitions. `evaluations` is the number of evaluations of the equations of motion or of switching functions
    per period; None if they cannot be counted.
    """

    name: str
    case: Case
    period: np.ndarray
    phase: np.ndarray
    before: np.ndarray
    after: np.ndarray
    section: np.ndarray
    seconds: float = math.nan
    evaluations: float | None = None
    notes: tuple[str, ...] = ()


class Recorder:
    """Recorder of the switches and section points of a peer that runs in Python."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.rows: list[tuple[float, int, int]] = []
        self.section = np.full((case.periods, 2), np.nan)
        self._next = 0
        self.begin = TWO_PI * case.transient
        self.end = TWO_PI * case.total
        self.section_time = case.first_section

    def point(self, xi: float, dxi: float) -> None:
        """Record the state at `section_time`, and advance `section_time` by one period."""
        k = self._next - self.case.transient
        if 0 <= k < self.case.periods:
            self.section[k] = xi, dxi
        self._next += 1
        self.section_time = self.case.first_section + TWO_PI * self._next

    def follow(self, switches: Iterable[Switch]) -> int:
        """Record switches, and section points of the mass at rest, up to the end; return the completed periods."""
        begin, end = self.begin, self.end
        used, next_period, xi = 0, TWO_PI, 0.0
        for tau, before, after, gap in switches:
            if before == STICK or before == REST:
                self.rest(min(tau, end), xi)
            if tau > end:
                return self.case.total
            if tau >= next_period:
                used, next_period = 0, (math.floor(tau / TWO_PI) + 1.0) * TWO_PI
            used += 1
            if used > BUDGET:
                return int(tau / TWO_PI)
            if tau > begin:
                self.rows.append((tau, before, after))
            xi = gap
        self.rest(end, xi)
        return self.case.total

    def rest(self, until: float, xi: float) -> None:
        """Record the section points of a sticking or resting mass up to `until`."""
        while self.section_time <= until:
            self.point(xi, 0.0)

    def run(self, name: str, work: Callable[[], int], evaluations: int | None, repeats: int, *notes: str) -> Run:
        """Return the Run of the recorded data, with the time of `work`, which returns the completed periods."""
        done = max(work(), 1)
        seconds = cpu_seconds(work, repeats) / done
        per_period = None if evaluations is None else evaluations / done
        tau, before, after = np.array(self.rows, float).reshape(-1, 3).T
        period = np.floor(tau / TWO_PI).astype(np.int64)
        rows = period, tau - TWO_PI * period, before.astype(np.int8), after.astype(np.int8)
        return Run(name, self.case, *rows, self.section, seconds, per_period, (*notes, *gave_up(self.case, done)))


def gave_up(case: Case, done: int) -> list[str]:
    """Return a note if a peer did not reach the end of a case."""
    return [f"gave up after {done} of {case.total} periods: too many switches"] if done < case.total else []


def cpu_seconds(work: Callable[[], object], repeats: int) -> float:
    """Return the median CPU time of `work()` over `repeats` calls; the caller has called it before."""
    spent = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        spent.append(time.process_time() - start)
    return float(np.median(spent))


def run_kernel(
    name: str,
    case: Case,
    kernel: Callable[..., tuple[int, int, int]],
    arguments: tuple[float, ...],
    *,
    repeats: int = 3,
    least: float = 0.05,
    notes: tuple[str, ...] = (),
) -> Run:
    """Run and time a compiled peer.

    `kernel(A, B, eps, eta, *arguments, phi_s, transient, periods, section, period, phase, before, after)`
    fills the arrays and returns (switches in the window, evaluations, completed periods). Short cases are repeated
    until one measurement takes about `least` seconds, much longer than the resolution of the clock.
    """
    model = (case.A, case.B, case.eps, case.eta, *arguments)
    none = (np.empty(0, np.int64), np.empty(0), np.empty(0, np.int8), np.empty(0, np.int8))
    kernel(*model, 0.0, 0, 1, np.empty((1, 2)), *none)  # compiles

    section = np.full((case.periods, 2), np.nan)
    window = (case.section_phase, case.transient, case.periods, section)
    start = time.process_time()
    count, evaluations, done = kernel(*model, *window, *none)
    once = time.process_time() - start
    rows = (np.empty(count, np.int64), np.empty(count), np.empty(count, np.int8), np.empty(count, np.int8))
    kernel(*model, *window, *rows)

    loops = max(1, min(10_000, math.ceil(least / max(once, 1e-6))))

    def work() -> None:
        for _ in range(loops):
            kernel(*model, *window, *none)

    spent = once if once > 10.0 else cpu_seconds(work, repeats) / loops
    notes = (*notes, *gave_up(case, done))
    return Run(name, case, *rows, section, spent / max(done, 1), evaluations / max(done, 1), notes)
