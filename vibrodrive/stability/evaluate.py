"""Computation and evaluation of the many disturbed motions that a search for limits requests.

A point is one set of parameters of a plan (model/plan.py). All motions that are requested at a time are points of one
sweep, which records section points and main impacts (main_impacts.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from types import TracebackType
from typing import TypeVar

import numpy as np

from vibrodrive.batch.parallel import Pool
from vibrodrive.batch.records import Arrays
from vibrodrive.batch.sweep import fill
from vibrodrive.batch.trajectory import main_impacts
from vibrodrive.jit.slices import Halt
from vibrodrive.model.choices import Status
from vibrodrive.model.names import Settings
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.plan import Plan
from vibrodrive.model.reasons import How
from vibrodrive.stability.main_impacts import fastest, impact_gaps
from vibrodrive.stability.structure import SETTLING, WATCHED, ReferenceOrbit, Structure, keeps, reference_orbit

BATCH_BYTES = 48 << 20  # largest size of the results of motions computed together (a batch); at most two batches exist

T = TypeVar("T")
Owner = TypeVar("Owner")


@dataclass(frozen=True)
class Motion:
    """One motion.

    section : section points ξ, ξ', float64 (periods, 2).
    impacts : main impacts, as rows of `Trajectory.impacts`.
    """

    section: np.ndarray
    impacts: np.ndarray

    @property
    def complete(self) -> bool:
        """False if the motion has exceeded its budget, so that its last section points are NaN."""
        return bool(np.isfinite(self.section).all())

    def copy(self) -> Motion:
        """Return a copy, which does not keep the arrays of the motions computed together with this one in memory."""
        return replace(self, section=self.section.copy())

    def keeps(self, base: ReferenceOrbit) -> bool:
        """Return True if the motion keeps the structure of an orbit."""
        return keeps(base, self.section, self.impacts)


def compute_impacts(
    points: np.ndarray, settings: Settings, threads: int, halt: Halt, section: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return the statuses and main impacts of the motions at points, as kernels write them; fill `section`, if any."""
    n = len(points)
    status, impacts = np.empty(n, np.int8), np.empty((n, 2 * settings.periods, 4))
    fill(settings, points, threads, halt, Arrays(section, status, np.empty(n), np.empty((n, 5), np.int64), impacts))
    return status, impacts


class Evaluator:
    """Computation of the motions at points of a plan under disturbances of one kind.

    As a context manager the evaluator ends its threads on exit.
    """

    def __init__(self, plan: Plan, disturbance: str, threads: int, halt: Halt) -> None:
        self._plan = plan
        self._column = COLUMNS.index(disturbance)
        self._threads = threads
        self._halt = halt
        self._ahead = Pool(1, thread_name_prefix="limits")

    def __enter__(self) -> Evaluator:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: object, trace: TracebackType | None) -> None:
        if kind is not None:
            self._halt.call()
        self._ahead.shutdown()

    def undisturbed(self, numbers: np.ndarray) -> list[ReferenceOrbit | Status]:
        """Return the orbit on which the undisturbed motion settles, for each point, or the reason why there is none.

        `numbers` are the numbers of the points in the plan.
        """
        points = self._plan.rows(numbers)
        points[:, COLUMNS.index("eps")] = 0.0
        points[:, COLUMNS.index("dtau")] = math.nan
        s = self._plan.settings
        settings = Settings(transient=max(SETTLING, s.transient), periods=WATCHED, budget=s.budget)
        orbits: list[ReferenceOrbit | Status] = []
        for motion in self._motions(points, settings):
            orbit = reference_orbit(motion)
            orbits.append(orbit or (Status.NO_ORBIT if motion.complete else Status.BUDGET))
        return orbits

    def answers(
        self,
        requests: Sequence[tuple[int, Owner, np.ndarray]],
        ask: Callable[[Owner, Motion], T],
        **brief: int,
    ) -> list[list[T]]:
        """Return the results of ask(owner, motion), one list for each request, asked in the order of the disturbances.

        A request is (number of a point, its owner, such as an orbit, disturbances). The records may be `brief`, with a
        smaller `transient` or fewer `periods` than those of the plan.
        """
        settings = replace(self._plan.settings, **brief)
        owners = [owner for _, owner, values in requests for _ in values]
        points = np.concatenate([np.repeat(self._plan.points(at, at + 1), len(v), axis=0) for at, _, v in requests])
        points[:, self._column] = np.concatenate([values for _, _, values in requests])
        results = iter(list(map(ask, owners, self._motions(points, settings))))
        return [[next(results) for _ in values] for _, _, values in requests]

    def _motions(self, points: np.ndarray, settings: Settings) -> Iterator[Motion]:
        """Yield the motions at these points, in order. While one batch is evaluated, the next batch is computed."""
        most = max(1, BATCH_BYTES // (settings.periods * (16 + 2 * 32)))
        parts = np.array_split(points, max(1, -(-len(points) // most)))
        tasks = [self._ahead.submit(self._computed, part, settings) for part in parts[:1]]
        for n, part in enumerate(parts):
            section, impacts = tasks.pop().result()
            if n + 1 < len(parts):
                tasks.append(self._ahead.submit(self._computed, parts[n + 1], settings))
            for k in range(len(part)):
                yield Motion(section[k], main_impacts(impacts[k]))

    def _computed(self, points: np.ndarray, settings: Settings) -> tuple[np.ndarray, np.ndarray]:
        section = np.empty((len(points), settings.periods, 2))
        return section, compute_impacts(points, settings, self._threads, self._halt, section)[1]


def explain_loss(base: ReferenceOrbit, motion: Motion, structure: Structure) -> tuple[How, str]:
    """Return how the motion has lost the structure of the orbit, as a code and as a text."""
    if not motion.complete:
        return How.BUDGET, How.BUDGET.meaning
    if structure.gaps:
        return How.ORDER, "impacts in another order"
    usual: Sequence[int] = ()
    seen = impact_gaps(motion.impacts)
    if base.cycle is not None:
        cycle = base.cycle.gaps.tolist()
        usual = min(cycle[n:] + cycle[:n] for n in range(len(cycle)))
        seen = impact_gaps(fastest(base.cycle, motion.impacts, len(motion.section)))
    gaps = np.unique(seen).tolist()
    text = f"gaps {_listed(usual)} became {_listed(gaps)}"
    if gaps != sorted(set(usual)):
        return How.GAPS, text
    if len(gaps) > 1:
        return How.GAPS_IN_ANOTHER_ORDER, text + " in another order"
    return How.FEWER_IMPACTS, text + ", of fewer impacts"


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers)) or "none"
