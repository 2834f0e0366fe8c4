"""The motions of a view, computed a level at a time: first what a frame has time for, in the end all of them.

Each level computes points of the one sweep that the view's configuration describes; a point's bits depend on nothing
else, so what is there when all have been computed is that sweep. Only where even few of them would take too long, the
first picture is a sketch: fewer periods, replaced as soon as there is something better.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from vibrodrive.batch.sweep import check_threads, fill_records
from vibrodrive.explorer.pace import FEWEST, Pace, length
from vibrodrive.jit.slices import Halt
from vibrodrive.model.plan import Plan
from vibrodrive.model.results import Results

FRAME_SECONDS = 0.03  # of the first level: with the drawing, some 15 frames a second
LEVEL_SECONDS = 0.15  # of each later level
STRIDES = (16, 8, 4, 2, 1)
COARSEST_DIAGRAM = 4  # largest stride of a diagram: with a larger one, its lines cannot be followed
GROWTH = 4.0  # most times that a level may have the points of the one before
SHORTEST = 8  # periods of a sketch, at least: left out, and recorded


class Part(NamedTuple):
    """Results of each way to find switches, of which the points `done` (bool, flat) are computed."""

    results: list[Results]
    done: np.ndarray


class Level(NamedTuple):
    """Motions of the sweep, and a sketch of fewer periods, if any, in place of those still missing."""

    sweep: Part
    sketch: Part | None

    @property
    def share(self) -> float:
        return float(self.sweep.done.mean())

    @property
    def complete(self) -> bool:
        return bool(self.sweep.done.all())


@dataclass
class Work:
    """All motions of one sweep, or of two that differ in how switches are found alone."""

    plans: list[Plan]
    threads: int | None
    order: np.ndarray = field(init=False)
    steps: np.ndarray = field(init=False)
    part: Part = field(init=False)

    def __post_init__(self) -> None:
        plan = self.plans[0]
        self.order, self.steps = coarse_first(plan.shape)
        self.part = Part([Results.uncomputed(p) for p in self.plans], np.zeros(plan.n_points, bool))

    def levels(self, pace: Pace, halt: Halt) -> Iterator[Level]:
        """Compute what is not there yet; a Level whenever there is more to be drawn. Raises Halted."""
        done, sketch = self.part.done, None
        first = not done.any()
        if first:
            sketch = self._sketch(pace, halt)
        if not first or sketch is not None:
            yield Level(self.part, sketch)
        waiting = self.order[~done[self.order]]
        count = self._at_once(pace, LEVEL_SECONDS)
        if first and sketch is None:
            affordable = self._at_once(pace, FRAME_SECONDS)
            count = max(n for n in self.steps.tolist() if n <= affordable)
        while waiting.size:
            began = perf_counter()
            for plan, results in zip(self.plans, self.part.results, strict=True):
                compute_into(results, plan, waiting[:count], self.threads, halt, pace)
            done[waiting[:count]] = True
            waiting = waiting[count:]
            # from what this one took, not from the pace: what does not grow with the points would feed on itself
            longer = LEVEL_SECONDS / max(perf_counter() - began, 1e-4)
            count = max(FEWEST, int(count * min(GROWTH, longer)))
            yield Level(self.part, sketch)

    def _at_once(self, pace: Pace, seconds: float) -> int:
        """How many points of each plan can be computed in that time."""
        each = sum(length(plan) / pace.of(plan) for plan in self.plans)
        return max(1, int(seconds / each))

    def _sketch(self, pace: Pace, halt: Halt) -> Part | None:
        """The coarsest level with fewer periods, where there is no time for all of them."""
        least = int(self.steps[0])
        share = self._at_once(pace, FRAME_SECONDS) / least
        if share >= 1.0:
            return None
        s = self.plans[0].settings
        transient = min(s.transient, max(SHORTEST, int(share * s.transient)))
        periods = min(s.periods, max(SHORTEST, int(share * s.periods)))
        plans = [replace(p, settings=replace(p.settings, transient=transient, periods=periods)) for p in self.plans]
        sketch = Part([Results.uncomputed(plan) for plan in plans], np.zeros_like(self.part.done))
        for plan, results in zip(plans, sketch.results, strict=True):
            compute_into(results, plan, self.order[:least], self.threads, halt, pace)
        sketch.done[self.order[:least]] = True
        return sketch


def coarse_first(shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """All points of a product of axes, the coarse grid first: (their numbers, how many each finer grid has)."""
    strides = STRIDES if len(shape) > 1 else [s for s in STRIDES if s <= COARSEST_DIAGRAM]
    finest = np.zeros(shape, np.int64)
    for k, stride in enumerate(reversed(strides)):
        finest[tuple(slice(None, None, stride) for _ in shape)] = k
    order = np.argsort(-finest.reshape(-1), kind="stable")
    counts = np.bincount(finest.reshape(-1), minlength=len(strides))[::-1]
    return order, np.cumsum(counts)


def compute_into(results: Results, plan: Plan, which: np.ndarray, threads: int | None, halt: Halt, pace: Pace) -> None:
    """Compute the points of these numbers, in any order, and put them in their places. Raises Halted."""
    began, n = perf_counter(), len(which)
    whole = results.rows(0, plan.n_points)
    section, status, margin, counts = (None if array is None else np.empty((n, *array.shape[1:]), array.dtype)
                                       for array in whole)  # fmt: skip
    assert status is not None
    assert margin is not None
    assert counts is not None
    records = fill_records(plan, plan.rows(which), check_threads(threads), halt, section, status, margin, counts)
    for array, part in zip(whole, (section, status, margin, counts), strict=True):
        if array is not None:
            array[which] = part
    for name, values in records.items():
        array = getattr(results, name)
        array.reshape(-1, *array.shape[len(plan.shape) :])[which] = values
    pace.learn(plan, n, perf_counter() - began)
