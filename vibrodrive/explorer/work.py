"""Computation of a view (view.py) in levels, each of which refines the picture.

The first level has as many points as the time of a frame (FRAME_SECONDS) allows. The last level completes the sweep.

Every level computes points of the sweep that the configuration of the view describes. The result at a point does not
depend, to the last bit, on the other points. So the results equal the results of the complete sweep.

If even a coarse grid takes too long for a frame, the first picture is a sketch: the coarse grid with fewer periods.
Later levels replace the sketch.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

import vibrodrive as vd
from vibrodrive.batch import sweep
from vibrodrive.explorer.engine import FEWEST, Pace, length
from vibrodrive.jit.slices import Halt
from vibrodrive.model import size
from vibrodrive.model.plan import Plan

FRAME_SECONDS = 0.03  # time for the first level; together with the drawing about 15 frames per second are possible
LEVEL_SECONDS = 0.15  # time for each later level
STRIDES = (16, 8, 4, 2, 1)  # spacings of successive grids, as multiples of the spacing of the sweep
COARSEST_DIAGRAM = 4  # largest stride of a diagram; a larger stride would break up its lines
GROWTH = 4.0  # largest ratio of the numbers of points of two successive levels
SHORTEST = 8  # least number of transient and of recorded periods of a sketch


class Part(NamedTuple):
    """Results of each method. `done` (bool, flat) marks the computed points."""

    results: list[vd.Results]
    done: np.ndarray


class Level(NamedTuple):
    """Computed part of the sweep, and optionally a sketch with fewer periods for the missing points, which will take
    about `left` seconds (0 if that is not yet known)."""

    sweep: Part
    sketch: Part | None
    left: float = 0.0

    @property
    def share(self) -> float:
        return float(self.sweep.done.mean())

    @property
    def complete(self) -> bool:
        return bool(self.sweep.done.all())


class Work:
    """All motions of one sweep, or of two sweeps that differ only in the method that locates switches."""

    def __init__(self, plans: list[Plan], threads: int | None) -> None:
        self.plans, self.threads = plans, threads
        self.order, self.steps = coarse_first(plans[0].shape)
        self.seconds = 0.0  # that the computed points have taken
        self.part = Part([vd.Results.uncomputed(p) for p in plans], np.zeros(plans[0].n_points, bool))

    @property
    def bytes(self) -> int:
        return sum(map(size.result_bytes, self.plans))

    def levels(self, pace: Pace, halt: Halt) -> Iterator[Level]:
        """Compute the missing points and yield a Level after each step. Raises Halted."""
        done, sketch = self.part.done, None
        first = not done.any()
        if first:
            sketch = self._sketch(pace, halt)
        if not first or sketch is not None:
            yield Level(self.part, sketch, self._left())
        waiting = self.order[~done[self.order]]
        count = self._points_within(pace, LEVEL_SECONDS)
        if first and sketch is None:
            affordable = self._points_within(pace, FRAME_SECONDS)
            count = max(n for n in self.steps.tolist() if n <= affordable)
        while waiting.size:
            began = perf_counter()
            for plan, results in zip(self.plans, self.part.results, strict=True):
                compute_into(results, plan, waiting[:count], self.threads, halt, pace)
            done[waiting[:count]] = True
            waiting = waiting[count:]
            # scale by the time of this level: the measured pace of a small level is too low, because of fixed costs
            took = perf_counter() - began
            self.seconds += took
            count = max(FEWEST, int(count * min(GROWTH, LEVEL_SECONDS / max(took, 1e-4))))
            yield Level(self.part, sketch, self._left())

    def _points_within(self, pace: Pace, seconds: float) -> int:
        """Return n, at least 1: n points of every plan take this time in total."""
        each = sum(length(plan) / pace.of(plan) for plan in self.plans)
        return max(1, int(seconds / each))

    def _left(self) -> float:
        """Return the seconds that the missing points will take, at the mean rate of the others, once that is known."""
        done = self.part.done
        return self.seconds / done.sum() * (~done).sum() if self.seconds > LEVEL_SECONDS else 0.0

    def _sketch(self, pace: Pace, halt: Halt) -> Part | None:
        """Return the results of the coarsest grid with fewer periods.

        Return None if all periods of this grid can be computed within the time of one frame.
        """
        least = int(self.steps[0])
        share = self._points_within(pace, FRAME_SECONDS) / least
        if share >= 1.0:
            return None
        s = self.plans[0].settings
        transient = min(s.transient, max(SHORTEST, int(share * s.transient)))
        periods = min(s.periods, max(SHORTEST, int(share * s.periods)))
        plans = [replace(p, settings=replace(p.settings, transient=transient, periods=periods)) for p in self.plans]
        sketch = Part([vd.Results.uncomputed(plan) for plan in plans], np.zeros_like(self.part.done))
        for plan, results in zip(plans, sketch.results, strict=True):
            compute_into(results, plan, self.order[:least], self.threads, halt, pace)
        sketch.done[self.order[:least]] = True
        return sketch


def coarse_first(shape: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return (indices, counts): the flat indices of the points of a product of axes, coarse grids first, and the number
    of points of each grid. A grid contains all coarser grids, and its own points mixed, so that their mean rate is that
    of the rest."""
    strides = STRIDES if len(shape) > 1 else [s for s in STRIDES if s <= COARSEST_DIAGRAM]
    finest = np.zeros(shape, np.int64)
    for k, stride in enumerate(reversed(strides)):
        finest[tuple(slice(None, None, stride) for _ in shape)] = k
    order = np.random.default_rng(0).permutation(finest.size)
    order = order[np.argsort(-finest.reshape(-1)[order], kind="stable")]
    counts = np.bincount(finest.reshape(-1), minlength=len(strides))[::-1]
    return order, np.cumsum(counts)


def compute_into(
    results: vd.Results, plan: Plan, which: np.ndarray, threads: int | None, halt: Halt, pace: Pace
) -> None:
    """Compute the points with these indices, in any order, and store them in `results`. Raises Halted."""
    began, n = perf_counter(), len(which)
    block = sweep.compute_points(plan, which, sweep.check_threads(threads), halt)
    computed = block.section, block.status, block.margin, block.switches
    for array, part in zip(results.rows(0, plan.n_points), computed, strict=True):
        if array is not None:
            array[which] = part
    for name, values in block.records.items():
        array = getattr(results, name)
        array.reshape(-1, *array.shape[len(plan.shape) :])[which] = values
    pace.learn(plan, n, perf_counter() - began)
