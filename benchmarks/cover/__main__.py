"""Study: the largest amplitude of a sine below which a structure is *proved* to be kept for ever.

    python -m benchmarks.cover [A] [B] [ETA]

A cover of all motions between two main impacts (reach.py), for all phases of the disturbance and every amplitude of a
band, proves that intervals of the impact phases return into themselves; bands are added from 0 upwards. So the starts
that are printed hold for every amplitude below the number, also if it changes from one main impact to the next within
a band. At A = 1.5 the number is 0.0038365, 0.991 of k2 over 1500 periods, and the starts are 1.19 rad wide; at
A = 2.75, where two periods have one impact, it is not sharp yet (0.64 of k2). It is no part of the package until it is.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from fractions import Fraction
from time import process_time
from typing import NamedTuple

import numpy as np

import vibrodrive as vd
from benchmarks.cover.reach import CLOSED, INTERVALS, LATE, reach
from vibrodrive.jit.trig import PI, TWO_PI
from vibrodrive.stability.main_impacts import SHARE, ImpactCycle

LEAST, MOST, BEGIN, STRIDE, RATIO = 1e-12, 1.0, 1e-4, 8.0, 1.01  # amplitudes tried, and the ratio that ends a search
DENOMINATOR = 64  # largest q of η = p/q of which only q phases are taken
SAMPLES = 16  # phases of the disturbance from which intervals grow, before they are proved
GROWTHS, WIDEST = 100, 3.0
CELLS, HALVINGS = 8, 9  # cells of the phase of the disturbance, and how often one may be halved
AROUND = 2.0
TOUCHES = 1.0, 0.2, 0.0  # largest speeds of touches that are tried, as shares of a tenth of the main impacts
RUNGS, RUNG, THIN = 20, 0.8, 1.5e-3
BUDGET = 5e8  # most evaluations
ROUNDING = 1e-14
PADS = 0.1, 0.02, 0.004
DIVISIONS = math.inf, 0.125, 0.02
NARROW = PI / 200
WORDS = (
    "closed", "some motion has no main impact when it is due", "some impact is neither a touch nor a main impact",
    "too many intervals", "the cell is too large",
)  # fmt: skip


class Proof(NamedTuple):
    """Amplitude that is proved, NaN if none is; first and last phase of the starts; why a larger one is not proved."""

    eps: float
    starts: tuple[tuple[float, float], ...]
    how: str


class _Lost(Exception):
    pass


class _Motions:
    """Motions from main impacts to the next ones, at one point of the parameters."""

    def __init__(self, A: float, B: float, eta: float, cycle: ImpactCycle) -> None:
        self.A, self.B, self.eta, self.cycle, self.m = A, B, eta, cycle, len(cycle.gaps)
        after = np.roll(cycle.phase, -1)
        self.due = after + TWO_PI * (cycle.gaps - np.rint((after - cycle.phase) / TWO_PI))
        near = Fraction(eta).limit_denominator(DENOMINATOR)
        self.q = near.denominator if float(near) == eta else 0
        self.work = np.array([0.0, math.inf])
        self._out = np.empty(8)
        self._rests, self._pieces, self._rows = (np.empty((INTERVALS, n)) for n in (2, 2, 4))

    def reach(
        self, k: int, band: tuple[float, float], cell: tuple[float, float], inside: np.ndarray, touch: float,
        finest: float, around: float = 0.0,
    ) -> tuple[int, np.ndarray]:  # fmt: skip
        """Return the result of reach.py for the starts of main impact k, and the arrivals relative to the orbit."""
        (low, high), (psi, b) = (tuple(eps * self.A * self.eta for eps in band), cell)
        shift = b / self.eta if high * self.eta > self.A else 0.0
        far = self.A * shift if shift else b * high
        d = far + 0.5 * (high - low) + 1e4 * ROUNDING * (1.0 + self.A + self.B + high)
        mu = (far if shift else far * self.eta) + 0.5 * (high - low) * self.eta
        mu += 1e-9 * (1.0 + self.A + self.B + high * self.eta)
        tiny = ROUNDING * (1.0 + self.A + self.B + high)
        start = self.cycle.phase[k] + inside[k] + (-shift, shift)
        due = self.due[k] + inside[(k + 1) % self.m] + (shift - around, around - shift)
        self._rests[0] = start
        line = np.array([self.A, self.B, 0.5 * (low + high), self.eta, psi, d, mu, tiny])
        window = np.array([min(start[0] + PI, due[0] + around - PI), *due, touch, 0.0])
        result = reach(line, window, finest, self._rests, self._pieces, self._rows, self._out, self.work)
        return int(result), self._out[:2] - self.due[k] + (-shift, shift)

    def images(
        self, k: int, band: tuple[float, float], cell: tuple[float, float], inside: np.ndarray, touch: float,
        thorough: bool, around: float = 0.0,
    ) -> tuple[int, np.ndarray]:  # fmt: skip
        """Return the arrivals of one cell, by the coarsest division of starts that closes."""
        for share in DIVISIONS if thorough else DIVISIONS[:1]:
            self.work[1] = self.work[0] + 2e6
            result, arrivals = self.reach(k, band, cell, inside, touch, share * TWO_PI / self.eta, around)
            if result in (CLOSED, LATE):
                break
        return result, arrivals

    def sampled(self, eps: float, inside: np.ndarray, touch: float, offset: float) -> np.ndarray:
        """Return the hull of the arrivals at some phases of the disturbance, float64 (m, 2)."""
        n = self.q or SAMPLES
        reached = np.empty((self.m, 2))
        for k in range(self.m):
            ends = []
            for j in range(n):
                psi = TWO_PI * ((j + (0.0 if self.q else offset)) / n % 1.0)
                result, arrivals = self.images(k, (eps, eps), (psi, 0.0), inside, touch, True, AROUND)
                if result != CLOSED:
                    raise _Lost(WORDS[result])
                ends.append(arrivals)
            reached[(k + 1) % self.m] = np.min(ends, 0)[0], np.max(ends, 0)[1]
        return reached

    def padded(self, eps: float, touch: float) -> np.ndarray:
        """Return intervals that return into themselves at the phases tried, with some room at their ends."""
        inside = self.grown(eps, touch, np.zeros((self.m, 2)))
        for pad in PADS:
            try:
                far = pad * np.ptp(inside, axis=1)[:, None] + 1e-10
                return self.grown(eps, touch, inside + far * (-1.0, 1.0))
            except _Lost:
                pass
        raise _Lost("no room")

    def grown(self, eps: float, touch: float, inside: np.ndarray) -> np.ndarray:
        last, quiet = np.zeros((self.m, 2)), 0
        for number in range(GROWTHS):
            reached = self.sampled(eps, inside, touch, number * 0.6180339887 % 1.0)
            step = np.maximum((inside - reached) * (1.0, -1.0), 0.0)
            if not step.any():
                quiet += 1
                if quiet == 2:
                    return inside
                continue
            quiet = 0
            ratio = np.minimum(np.divide(step, last, out=np.zeros_like(step), where=last > 0.0), 0.95)
            rest = ratio / (1.0 - ratio) if number > 12 and number % 4 == 0 else 0.1
            inside = inside + step * (1.0 + rest) * (-1.0, 1.0)
            if np.ptp(inside, axis=1).max() > WIDEST:
                break
            last = step
        raise _Lost("impacts drift out of every interval")

    def proved(self, band: tuple[float, float], inside: np.ndarray, touch: float, thorough: bool) -> bool:
        """Return whether the intervals return into themselves for all phases and all amplitudes of a band."""
        n, half = (self.q, 0.0) if self.q else (CELLS, PI / CELLS)
        cells = [(TWO_PI * j / n + half, half) for j in range(n)]
        tried = 0
        while cells:
            psi, b = cells.pop()
            tried += 1
            fine = thorough and b <= NARROW
            if all(self.images(k, band, (psi, b), inside, touch, fine)[0] == CLOSED for k in range(self.m)):
                continue
            if b < PI / CELLS / 2**HALVINGS or self.work[0] > BUDGET or tried > (4096 if thorough else 600):
                return False
            cells += [(psi - 0.5 * b, 0.5 * b), (psi + 0.5 * b, 0.5 * b)]
        return True

    def climb(self, low: float, top: float, inside: np.ndarray, touch: float) -> float:
        """Return the largest amplitude up to which intervals are proved to return into themselves."""
        step = 0.1 * (top - low)
        while low < top and step > THIN * top:
            thorough = step < min(0.003 * low, 3.0 * THIN * top)
            if self.proved((low, min(low + step, top)), inside, touch, thorough):
                low, step = min(low + step, top), 1.5 * step
            else:
                step = min(step, top - low) / 3.0
        return low


class _Search:
    """Intervals by amplitude that return into themselves at the phases tried, with the speed of touches in them."""

    def __init__(self, motions: _Motions) -> None:
        self.motions, self.how = motions, ""
        self.known: dict[float, tuple[np.ndarray, float] | None] = {}
        self._touches = [share * SHARE * float(motions.cycle.speed.min()) for share in TOUCHES]

    def grown(self, eps: float) -> tuple[np.ndarray, float] | None:
        if eps not in self.known:
            self.known[eps] = None
            for touch in self._touches:
                try:
                    self.known[eps] = self.motions.padded(eps, touch), touch
                    break
                except _Lost as lost:
                    self.how = str(lost)
        return self.known[eps]

    def top(self) -> float:
        """Return the largest amplitude found that has intervals."""
        value = BEGIN
        if self.grown(value) is not None:
            while value < MOST and self.grown(min(value * STRIDE, MOST)) is not None:
                value = min(value * STRIDE, MOST)
            low, high = value, min(value * STRIDE, MOST)
        else:
            while value > LEAST and self.grown(value / STRIDE) is None:
                value /= STRIDE
            low, high = value / STRIDE, value
        while high > low * RATIO:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if self.grown(middle) is None else (middle, high)
        return low


def prove(A: float, B: float, eta: float, cycle: ImpactCycle) -> Proof:
    """Return what is proved of an orbit with the main impacts `cycle`."""
    motions = _Motions(A, B, eta, cycle)
    search = _Search(motions)
    top, kept, before = search.top(), 0.0, -1.0
    starts: np.ndarray | None = None
    while before < kept < top:
        before = kept
        for eps in (top * RUNG**rung for rung in range(RUNGS)):
            found = search.grown(eps) if eps > kept * 1.01 else None
            if found is None:
                continue
            inside, touch = found
            kept = motions.climb(kept, eps, inside, touch)
            if kept > before:
                ends = inside if starts is None else starts
                starts = np.stack([np.maximum(ends[:, 0], inside[:, 0]), np.minimum(ends[:, 1], inside[:, 1])], axis=1)
                break
    if starts is None:
        return Proof(math.nan, (), search.how)
    first = (cycle.phase + starts[:, 0]) % TWO_PI
    last = first + np.ptp(starts, axis=1)
    return Proof(kept, tuple(zip(first.tolist(), last.tolist(), strict=True)), search.how)


def main(written: Sequence[str]) -> None:
    A, B, eta = (float(text) for text in [*written, *("1.5", "0.1", repr(vd.ETA))[len(written) :]])
    k = vd.limit(A, B=B, eta=eta)
    if k.cycle is None:
        raise SystemExit(k.how)
    began = process_time()
    found = prove(A, B, eta, k.cycle)
    widths = ", ".join(f"{last - first:.3f}" for first, last in found.starts)
    print(f"A = {A:g}, B = {B:g}, η = {eta:g}: proved {found.eps:.6g}, {found.eps / k.k2:.3f} of k2 = {k.k2:.6g}")
    print(f"starts {widths} rad wide; {process_time() - began:.1f} s of CPU; beyond it: {found.how}")


if __name__ == "__main__":
    main(sys.argv[1:])
