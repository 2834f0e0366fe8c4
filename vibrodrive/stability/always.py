"""Limit in ε for all times, starts and phases of the disturbance: an interval that returns into itself (§1).

After a main impact the mass is at rest at the obstacle, ξ = ξ' = 0. So its further motion depends on two numbers only:
the phase φ of the impact, and the phase θ = ητ of the disturbance. An orbit with m main impacts keeps its structure for
ever if there is an interval of φ for each of them, such that from each φ in it and for *all* θ the next main impact has
the gap and the order of the orbit (main_impacts.py) and lies in the next interval. The smallest such intervals are
found by iteration: they begin as the phases of the orbit and grow by the phases of the next main impacts until these
stay inside.

Phases are sampled, the ends of the intervals included. A sample proves nothing about what lies between two of them, so
`Always.kind` is "sampled". Twice as many phases of both kinds change the limit by -2 to +0.5 %
(benchmarks/for_all_times.py).

All θ occur if η is irrational. If η is p/q, an impact at φ meets q phases only, and these are taken: the
disturbance may begin in any period.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vibrodrive.jit.slices import Halt
from vibrodrive.jit.trig import PI, TWO_PI
from vibrodrive.kernels.record import PHASE, SPEED, TIME
from vibrodrive.model.choices import Status
from vibrodrive.model.names import Settings
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.stability.evaluate import compute_impacts
from vibrodrive.stability.main_impacts import SHARE, ImpactCycle, nearest

EPS, ETA, TAU0 = (COLUMNS.index(name) for name in ("eps", "eta", "tau0"))
START = [COLUMNS.index(name) for name in ("xi0", "dxi0")]

BEGIN, LEAST, MOST = 1e-4, 1e-12, 1.0  # first, smallest and largest ε tried
STRIDE = 8.0  # ratio of two values tried until the limit lies between them
BELOW = (0.9, 0.7, 0.5)  # shares of a limit that must be kept, too
GROWTHS = 150  # most steps in which intervals grow
REACH = 0.02  # share of their width by which growing intervals grow in addition
SLOW = 60  # after so many steps, each twelfth extrapolates what is left of a growth as a geometric series,
RATIO = 0.95  # whose ratio is at most this
PERIODS = 4096  # number of periods among which phases of the disturbance are looked up
CLOSED = 1e-9  # least distance of two of its phases, as a share of a cycle
FARTHEST = 2**26  # largest number of periods before an impact


class Samples(NamedTuple):
    """Numbers of phases of an impact and of the disturbance, and the ratio of two values of ε that ends a search.

    If fewer phases of the disturbance occur, there are as many more phases of the impact.
    """

    impact: int
    disturbance: int
    ratio: float


ROUGH = Samples(4, 24, 1.02)
FINE = Samples(12, 96, 1.005), Samples(24, 384, 1.005), Samples(48, 768, 1.005)


@dataclass(frozen=True)
class Always:
    """The largest ε found at which a structure is kept for all times, starts and phases of the disturbance.

    k2 : this ε; 0 if there is none above the smallest value tried.
    starts : first and last phase of the interval from which it is kept, for each main impact of the orbit; the first
        phase is in [0, 2π).
    kind : "sampled", because what lies between two phases tried is not proven.
    how : what is lost at the next larger ε tried.
    """

    k2: float
    starts: tuple[tuple[float, float], ...]
    kind: str = "sampled"
    how: str = ""

    @property
    def starts_width(self) -> float:
        """Least width of the intervals in radians."""
        return min(last - first for first, last in self.starts)


def find_always(point: np.ndarray, cycle: ImpactCycle, settings: Settings, threads: int, halt: Halt) -> Always:
    """Find the limit for all times of an orbit with the main impacts `cycle`.

    `point` is a row of parameters (`Plan.rows`), of which ε and the start are not used, and `settings` are those of the
    disturbed motions.
    """
    flights = _Flights(point, cycle, settings, threads, halt)
    search = _Search(flights, ROUGH)
    kept = search.between(*search.around(BEGIN))
    while kept > 0.0 and (lost := [share for share in BELOW if search.intervals(share * kept) is None]):
        kept = search.between(*search.around(lost[-1] * kept))
    for samples in FINE if kept > 0.0 else ():
        search, before = _Search(flights, samples, search), kept
        kept = search.beside(kept)
        if samples != FINE[0] and kept * samples.ratio >= before:  # more samples change nothing
            break
    inside = search.kept[kept]
    first = (cycle.phase + inside[:, 0]) % TWO_PI
    last = first + np.ptp(inside, axis=1)
    return Always(kept, tuple(zip(first.tolist(), last.tolist(), strict=True)), how=search.how)


@lru_cache(maxsize=16)
def turns(eta: float, count: int) -> np.ndarray:
    """Return numbers of excitation periods after which the phase of the disturbance takes `count` values over a cycle.

    They are fewer if η = p/q with a small q, so that q phases occur only.

    >>> turns(100.25, 24).tolist()
    [0, 1, 2, 3]
    """
    phase = eta * np.arange(PERIODS) % 1.0
    phase[phase > 1.0 - CLOSED] = 0.0
    wanted = np.arange(count) / count
    known, first = np.unique(np.round(phase / CLOSED), return_index=True)
    apart = np.diff(known, append=1.0 / CLOSED).max() * CLOSED
    if apart > 0.5 / count and len(known) == PERIODS:  # the phase drifts slowly: take many of its smallest steps
        back = phase > 0.5
        step = np.where(back, 1.0 - phase, phase)
        least = 1 + int(step[1:].argmin())
        many = np.round(np.where(back[least], -wanted % 1.0, wanted) / step[least]) * least
        return many[many <= FARTHEST].astype(np.int64)
    at = np.unique(np.searchsorted(known * CLOSED, wanted).clip(max=len(known) - 1))
    return np.sort(first[at])


class _Flights:
    """Flights from a main impact to the next one, at one point of the parameters."""

    def __init__(self, point: np.ndarray, cycle: ImpactCycle, settings: Settings, threads: int, halt: Halt) -> None:
        self.cycle, self._point, self._threads, self._halt = cycle, point.copy(), threads, halt
        self._point[START] = 0.0
        self._settings = replace(settings, transient=0, periods=int(cycle.gaps.max()) + 2)

    def reached(self, eps: float, inside: np.ndarray, samples: Samples) -> np.ndarray | str:
        """Return the least and the largest phase of the main impacts that follow those of intervals, float64 (m, 2).

        Phases are relative to those of the orbit. If a gap or the order is another one than in the orbit, or if no
        speed separates main impacts from touches, the answer is a text that says so.
        """
        cycle, m = self.cycle, len(self.cycle.gaps)
        periods = turns(float(self._point[ETA]), samples.disturbance)
        share = np.linspace(0.0, 1.0, samples.impact * samples.disturbance // len(periods))
        phase = cycle.phase[:, None] + inside[:, :1] + np.ptp(inside, axis=1)[:, None] * share
        tau0 = np.add.outer(phase % TWO_PI, TWO_PI * periods).ravel()
        impacts = self._impacts(eps, tau0)
        if impacts is None:
            return Status.BUDGET.words
        at = np.repeat(np.arange(m), tau0.size // m)
        later = TWO_PI * impacts[..., TIME] + impacts[..., PHASE] - tau0[:, None]
        later[~(later > PI)] = np.nan  # those of the first half period belong to the impact at the start
        gap, speed = np.rint(later / TWO_PI), impacts[..., SPEED]
        due = gap == cycle.gaps[at][:, None]
        if not due.any(axis=1).all():
            return "no impact after the gap of the orbit"
        main = np.where(due, speed, -1.0).argmax(axis=1)[:, None]
        phase, fast = (np.take_along_axis(impacts[..., column], main, 1)[:, 0] for column in (PHASE, SPEED))
        touch = np.where(later < np.take_along_axis(later, main, 1), speed, 0.0).max()
        if touch > SHARE * cycle.speed.min() or touch >= fast.min():
            return "touches as fast as main impacts"
        rows = np.empty(len(phase), [("phase", float), ("speed", float)])
        rows["phase"], rows["speed"] = phase, fast
        after = (at + 1) % m
        if (nearest(cycle, rows) != after).any():
            return "impacts in another order"
        away = (phase - cycle.phase[after] + PI) % TWO_PI - PI
        return np.array([(away[after == k].min(), away[after == k].max()) for k in range(m)])

    def _impacts(self, eps: float, tau0: np.ndarray) -> np.ndarray | None:
        """Return the main impacts after a start from rest at each of the times `tau0`, as kernels write them."""
        points = np.repeat(self._point[None], len(tau0), axis=0)
        points[:, EPS], points[:, TAU0] = eps, tau0
        status, impacts = compute_impacts(points, self._settings, self._threads, self._halt)
        return None if (status == Status.BUDGET).any() else impacts


class _Search:
    """Search for the largest ε with intervals that return into themselves, with one choice of samples.

    `before` is a search with fewer samples: intervals grow from those that it has found at a smaller ε.

    kept : intervals by the value of ε, float64 (m, 2), relative to the phases of the orbit.
    how : what was lost at the last ε that was lost.
    """

    def __init__(self, flights: _Flights, samples: Samples, before: _Search | None = None) -> None:
        self._flights, self._samples = flights, samples
        self.kept: dict[float, np.ndarray] = (
            before.kept.copy() if before else {0.0: np.zeros((len(flights.cycle.gaps), 2))}
        )
        self.how: str = before.how if before else ""

    def around(self, value: float) -> tuple[float, float]:
        """Return an ε that is kept and a larger one that is lost, or twice an end of the range that has none beyond."""
        if self.intervals(value) is not None:
            while value < MOST:
                value, above = min(value * STRIDE, MOST), value
                if self.intervals(value) is None:
                    return above, value
            return MOST, MOST
        while value > LEAST:
            value /= STRIDE
            if self.intervals(value) is not None:
                return value, value * STRIDE
        return 0.0, 0.0

    def between(self, low: float, high: float) -> float:
        """Return the largest ε found to be kept between one that is kept and one that is lost."""
        while high > low * self._samples.ratio:
            middle = math.sqrt(low * high)
            low, high = (low, middle) if self.intervals(middle) is None else (middle, high)
        return low

    def beside(self, value: float) -> float:
        """Return the largest ε found to be kept, from the one that fewer samples have found."""
        ratio = self._samples.ratio
        if self.intervals(value) is not None:
            while value < MOST and self.intervals(value * ratio) is not None:
                value *= ratio
            return value
        while value > LEAST:
            above, value, ratio = value, value / ratio, ratio * ratio
            if self.intervals(value) is not None:
                return self.between(value, above)
        return 0.0

    def intervals(self, eps: float) -> np.ndarray | None:
        """Return intervals that return into themselves at ε, or None if there are none."""
        inside = self.kept[max(known for known in self.kept if known <= eps)]
        last = np.zeros_like(inside)
        for number in range(1, GROWTHS + 1):
            reached = self._flights.reached(eps, inside, self._samples)
            if isinstance(reached, str):
                self.how = reached
                return None
            step = np.maximum((inside - reached) * (1.0, -1.0), 0.0)
            if not step.any():
                self.kept[eps] = inside
                return inside
            ratio = np.minimum(np.divide(step, last, out=np.zeros_like(step), where=last > 0.0), RATIO)
            rest = ratio / (1.0 - ratio) if number > SLOW and number % 12 == 0 else 0.0
            far = step * (1.0 + rest) + REACH * (np.ptp(inside, axis=1)[:, None] + step)
            inside = inside + np.where(step > 0.0, far, 0.0) * (-1.0, 1.0)
            last = step
        self.how = "impacts drift out of every interval"
        return None
