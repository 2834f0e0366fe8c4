"""Limit in ε for all times, all starts and all phases of the disturbance, proved (§1).

After a main impact the mass is at rest at the obstacle, ξ = ξ' = 0. So its further motion depends on two numbers only:
the phase φ of the impact, and ψ = θ - ηφ, the phase of the disturbance at the beginning of this excitation period. An
orbit with m main impacts keeps its structure for ever if there is an interval of φ for each of them, such that from
each φ in it and for all ψ the next main impact has the gap and the order of the orbit (main_impacts.py) and lies in
the next interval. reach.py encloses the next main impacts for all φ of an interval, all ψ of a cell, and all
amplitudes of a *band*. Bands are added from 0 upwards, each with intervals of its own, until none is found for the next
one (docs/stability.md has the proof).

All ψ occur if η is irrational. If η is a fraction p/q, only q phases occur, because the disturbance may begin in any
excitation period.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np

from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.jit.trig import PI, TWO_PI
from vibrodrive.model.reasons import Unproved
from vibrodrive.stability.impulses import find_tolerated
from vibrodrive.stability.main_impacts import SHARE, ImpactCycle
from vibrodrive.stability.reach import CLOSED, INTERVALS, LATE, reach

FIRST = 0.1  # velocity εηA of the first band tried, as a share of A
STEPS = 0.5, 1.4  # factors of the width of a band after one that is not proved, and after one that is
THIN = 2e-3  # the search ends at bands of this share of what is proved,
LEAST = 1e-12  # or of this width,
BUDGET = 1e9  # or after so many evaluations of a motion, 40 s at η = 101
RIPPLES = 1e4  # largest number of periods of the disturbance in a period of the orbit
DENOMINATOR = 64  # largest q of η = p/q of which only q phases are taken
DRIFT = 1e-6  # half width of the cells of these phases
STARTS = 1.0  # starts tried: so far before and after the phases of the orbit, in radians,
SHARES = 1.0, 0.85, 0.7, 0.5, 0.25  # and shares of them, or of those of the bands before
TOUCHES = 1.0, 0.2, 0.0  # largest speeds of touches tried, as shares of the largest one allowed

SAMPLES = 16  # phases of the disturbance from which intervals grow, before they are proved
GROWTHS = 100  # most steps in which they grow
QUIET = 2  # number of steps without growth that end it
RATIO = 0.95  # largest ratio of two steps in the estimate of what is left of a growth,
SETTLED = 0.02  # which begins when steps are below this share of the width: larger steps do not reach beyond
AROUND = 2.0  # how far outside of an interval arrivals are seen while it grows
CELLS, HALVINGS = 8, 5  # least number of cells of the phase of the disturbance, and how often one is halved
DIVISIONS = math.inf, 0.125, 0.02  # lengths to which intervals are divided at least, in ripples of the disturbance
WORK = 2e6  # most evaluations for one of them

ROUNDING = 1e-12  # what rounding adds to an integral of the force, as a share of its size and of the time in ripples
FORCE = 1e-9  # and to a force


@dataclass(frozen=True)
class Always:
    """The amplitude up to which a structure is proved to be kept for all times, starts and phases of the disturbance.

    k2 : this ε; NaN if no proof is found.
    starts : first and last phase of the interval from which it is kept under *every* ε up to `k2`, for each main impact
        of the orbit; the first phase is in [0, 2π). Empty without a proof.
    beyond : why no larger amplitude is proved.
    """

    k2: float = math.nan
    starts: tuple[tuple[float, float], ...] = ()
    beyond: Unproved = Unproved.NO_IMPACTS

    @property
    def how(self) -> str:
        """Why no larger amplitude is proved, in words."""
        return self.beyond.meaning

    @property
    def kind(self) -> str:
        """What the number is: "proved", or "" if there is none."""
        return "proved" if self.starts else ""

    @property
    def starts_width(self) -> float:
        """Least width of the intervals in radians; NaN without a proof."""
        return min((last - first for first, last in self.starts), default=math.nan)


class _Fails(Exception):
    """Intervals do not return into themselves."""

    def __init__(self, why: Unproved) -> None:
        super().__init__(why.meaning)
        self.why = why


def find_always(A: float, B: float, eta: float, cycle: ImpactCycle | None, halt: Halt | None = None) -> Always:
    """Prove the limit for all times of an orbit with the main impacts `cycle`, if it has any.

    The structure is kept under every constant amplitude up to `k2`, and under amplitudes that change from one main
    impact to the next within one band. Raises Halted if `halt` is called.
    """
    if cycle is None:
        return Always()
    every = find_tolerated(A, B, cycle)
    sine = every.velocity / (2.0 * A * eta)  # the impulse of a sine over half of its period is 2Aεη
    kept = Always(sine, _from(*every.starts.T)) if sine > 0.0 else Always()
    if eta * cycle.n > RIPPLES:
        return replace(kept, beyond=Unproved.BUDGET)
    motions = _Motions(A, B, eta, cycle, halt or Halt())
    low, step, proved, beyond = 0.0, FIRST / eta, False, Unproved.BUDGET
    starts = np.tile((-STARTS, STARTS), (len(cycle.gaps), 1))
    while step > max(THIN * low, LEAST) and motions.work[0] < BUDGET:
        band = low, low + step
        try:
            inside = motions.proved(band, motions.grown(band, starts))
        except _Fails as reason:
            step, beyond = step * STEPS[0], reason.why
            continue
        starts = np.stack([np.maximum(starts[:, 0], inside[:, 0]), np.minimum(starts[:, 1], inside[:, 1])], axis=1)
        low, step, proved = low + step, step * STEPS[1], True
    if motions.work[0] >= BUDGET:
        beyond = Unproved.BUDGET
    if proved and not low <= kept.k2:
        kept = Always(low, _from(*(cycle.phase[:, None] + starts).T))  # each interval of a band contains the orbit
    return replace(kept, beyond=beyond)


def _from(first: np.ndarray, last: np.ndarray) -> tuple[tuple[float, float], ...]:
    """Return intervals of phases with their beginnings in [0, 2π)."""
    begin = first % TWO_PI
    return tuple(zip(begin.tolist(), (begin + (last - first)).tolist(), strict=True))


class _Motions:
    """Motions from main impacts to the next ones, at one point of the parameters.

    Intervals are float64 (m, 2), relative to the phases of the orbit. `work` counts evaluations.
    """

    def __init__(self, A: float, B: float, eta: float, cycle: ImpactCycle, halt: Halt) -> None:
        self.A, self.B, self.eta, self.cycle, self.m = A, B, eta, cycle, len(cycle.gaps)
        self._halt = halt
        after = np.roll(cycle.phase, -1)
        self.due = after + TWO_PI * (cycle.gaps - np.rint((after - cycle.phase) / TWO_PI))
        near = Fraction(eta).limit_denominator(DENOMINATOR)
        self.q = near.denominator if float(near) == eta else 0
        self.work = np.array([0.0, math.inf])
        self._touch, *_ = self._touches = [share * SHARE * float(cycle.speed.min()) for share in TOUCHES]
        self._worst: deque[float] = deque(maxlen=SAMPLES)
        self._out = np.empty(4)
        self._rests, self._pieces, self._rows = (np.empty((INTERVALS, n)) for n in (2, 2, 4))

    def grown(self, band: tuple[float, float], starts: np.ndarray) -> np.ndarray:
        """Return intervals that return into themselves for some cells, with as much as is found of the starts tried."""
        inside = self._least(band, np.zeros((self.m, 2)))
        for end, sign in enumerate((-1.0, 1.0)):
            for share in SHARES:
                wide = inside.copy()
                wide[:, end] = sign * np.maximum(sign * inside[:, end], sign * share * starts[:, end])
                if (wide == inside).all():
                    break
                try:
                    inside = self._least(band, wide)
                    break
                except _Fails:
                    pass
        return inside

    def proved(self, band: tuple[float, float], inside: np.ndarray) -> np.ndarray:
        """Return intervals around `inside` that are proved to return into themselves for all amplitudes of a band."""
        while True:
            try:
                self._prove(band, inside)
            except _Fails:
                before, inside = inside, self._least(band, inside)  # with the phase at which the proof has failed
                if (before == inside).all():
                    raise
            else:
                return inside

    def _prove(self, band: tuple[float, float], inside: np.ndarray) -> None:
        """Raise _Fails if the intervals do not return into themselves for all cells and all amplitudes of a band."""
        width = self._width(band)
        n = self.q or math.ceil(PI / width)
        whole = width if self.q else PI / n
        cells = [(TWO_PI * j / n, whole) for j in range(n)]
        while cells:
            psi, b = cells.pop()
            try:
                for k in range(self.m):
                    self._image(k, band, (psi, b), inside, 0.0)
            except _Fails:
                if self.q or b <= whole / 2**HALVINGS:
                    self._worst.append(psi)
                    raise
                cells += [(psi - 0.5 * b, 0.5 * b), (psi + 0.5 * b, 0.5 * b)]

    def _width(self, band: tuple[float, float]) -> float:
        """Return half the width of a cell that is as coarse as a band, in its effect on integrals of the force."""
        low, high = (eps * self.A * self.eta for eps in band)
        return DRIFT if self.q else min(PI / CELLS, 0.5 * (high - low) / min(high, self.A / self.eta))

    def _least(self, band: tuple[float, float], inside: np.ndarray) -> np.ndarray:
        """Return grown intervals for the first dividing speed with which they return into themselves."""
        for touch in list(self._touches):
            self._touch = touch
            try:
                grown = self._grown(band, self._width(band), inside)
            except _Fails as reason:
                failure = reason
            else:
                self._touches.sort(key=lambda speed: speed != touch)
                return grown
        self._touch = self._touches[0]
        raise failure

    def _grown(self, band: tuple[float, float], b: float, inside: np.ndarray) -> np.ndarray:
        """Return the least intervals around `inside` that return into themselves for some cells."""
        n, last, quiet = self.q or SAMPLES, np.zeros((self.m, 2)), 0
        for number in range(GROWTHS):
            turn = 0.0 if self.q else number * 0.6180339887 % 1.0
            cells = [(psi, b) for psi in (*(TWO_PI * (j + turn) / n for j in range(n)), *self._worst)]
            reached = np.array([self._images(band, cell, inside) for cell in cells])
            ends = np.stack([reached[..., 0].min(axis=0), reached[..., 1].max(axis=0)], axis=1)
            step = np.maximum((inside - ends) * (1.0, -1.0), 0.0)
            quiet = 0 if step.any() else quiet + 1
            if quiet == QUIET:
                return inside
            ratio = np.minimum(np.divide(step, last, out=np.zeros_like(step), where=last > 0.0), RATIO)
            remaining = ratio / (1.0 - ratio) if number > 12 and number % 4 == 0 else 0.1
            beyond = np.where(step < SETTLED * (np.ptp(inside, axis=1)[:, None] + step), remaining, 0.0)
            inside, last = inside + step * (1.0 + beyond) * (-1.0, 1.0), step if step.any() else last
            self._check_gaps(inside)
        raise _Fails(Unproved.DRIFT)

    def _images(self, band: tuple[float, float], cell: tuple[float, float], inside: np.ndarray) -> np.ndarray:
        """Return the arrivals of all main impacts, float64 (m, 2), also if they are outside of the intervals."""
        return np.roll([self._image(k, band, cell, inside, AROUND) for k in range(self.m)], 1, axis=0)

    def _check_gaps(self, inside: np.ndarray) -> None:
        """Raise _Fails if main impacts in the intervals may have other gaps than in the orbit."""
        start, due = self.cycle.phase[:, None] + inside, self.due[:, None] + np.roll(inside, -1, axis=0)
        turns = TWO_PI * self.cycle.gaps
        if (due[:, 1] - start[:, 0] >= turns + PI).any() or (due[:, 0] - start[:, 1] <= turns - PI).any():
            raise _Fails(Unproved.DRIFT)

    def _image(
        self, k: int, band: tuple[float, float], cell: tuple[float, float], inside: np.ndarray, around: float
    ) -> np.ndarray:
        """Return the first and the last arrival after main impact k, by the coarsest division of starts that closes."""
        for share in DIVISIONS:
            if self._halt.called:
                raise Halted
            if self.work[0] > BUDGET:
                raise _Fails(Unproved.BUDGET)
            self.work[1] = self.work[0] + WORK
            result, arrivals = self._reach(k, band, cell, inside, share * TWO_PI / self.eta, around)
            if result in (CLOSED, LATE):
                break
        if result != CLOSED:
            raise _Fails(Unproved(result))
        if self.m > 1 and not self._in_order((k + 1) % self.m, *arrivals, *self._out[2:]):
            raise _Fails(Unproved.ORDER)
        return arrivals

    def _reach(
        self, k: int, band: tuple[float, float], cell: tuple[float, float], inside: np.ndarray, finest: float,
        around: float,
    ) -> tuple[int, np.ndarray]:  # fmt: skip
        """Return the result of reach.py for the starts of main impact k, and the arrivals relative to the orbit."""
        (low, high), (psi, b) = (tuple(eps * self.A * self.eta for eps in band), cell)
        # motions of a cell are compared at one time, or at times at which they have one phase of the disturbance
        shift = b / self.eta if high * self.eta > self.A else 0.0
        start = self.cycle.phase[k] + inside[k] + (-shift, shift)
        due = self.due[k] + inside[(k + 1) % self.m] + (shift - around, around - shift)
        ripples, size = self.eta * (due[1] + 2.0 * TWO_PI), 1.0 + self.A + self.B + high
        slow = self.A * shift
        far, wide = slow if shift else b * high, 0.5 * (high - low)
        d = far + wide + ROUNDING * size * (1.0 + ripples)
        mu = (slow if shift else far * self.eta) + wide * self.eta + FORCE * (size + high * self.eta)
        line = np.array([self.A, self.B, 0.5 * (low + high), self.eta, psi, d, mu, slow, 1e-14 * size])
        near = -math.inf if self.m > 1 else min(start[0] + PI, due[0] + around - PI)
        self._rests[0] = start
        window = np.array([near, *due, self._touch])
        result = reach(line, window, finest, self._rests, self._pieces, self._rows, self._out, self.work)
        return int(result), self._out[:2] - self.due[k] + (-shift, shift)

    def _in_order(self, k: int, first: float, last: float, least: float, most: float) -> bool:
        """Return whether main impact k of the orbit is the nearest one to all impacts with such phases and speeds."""
        phase, speed = self.cycle.phase - self.cycle.phase[k], self.cycle.speed - self.cycle.speed[k]
        corners = np.array([(x, v - self.cycle.speed[k]) for x in (first, last) for v in (least, most)])
        for x, v in zip(phase, speed, strict=True):
            for turn in (-TWO_PI, 0.0, TWO_PI):
                away = np.array([x + turn, v])
                if away.any() and (corners @ away >= 0.5 * away @ away).any():
                    return False
        return True
