"""How long a sweep will take, measured on a sample of its points."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field, replace
from time import monotonic
from typing import NamedTuple

import numpy as np

from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import point_bytes
from vibrodrive.model.size import file_bytes

SAMPLE_POINTS = 1024
"""Enough to show how much points differ, few enough for a second."""

SAMPLE_WAVES = 8
"""Where only a few points are computed together, whole waves of them: at least so many."""

SAMPLE_SECONDS = 0.4
"""A sample that took less is too short to extrapolate to hours."""

GROWTH = 4
"""Ratio of the periods of one sample to those of the one before; the added three quarters give the rate that is
extrapolated."""

LONG_PERIOD = 1e-3
"""Seconds for one period of one point beyond which fewer points are sampled; most take a thousandth of it."""

REPEATS, REPEAT_SECONDS = 5, 0.05
"""A group is computed this many times, or for this long, and the shortest time counts."""

FIRST_SECONDS = 3e-3
BYTES_PER_SECOND = 1e9
BLOCK_SECONDS = 0.7e-3
"""Measured times of the writer: to start, for the data, and in addition for every block."""

LAYOUT_SECONDS = 0.04
LAYOUT_BLOCK_SECONDS = 0.4e-3
LAYOUT_BYTES_PER_SECOND = 1e9
"""The same for laying out the file at the start and closing it at the end."""


class Estimate(NamedTuple):
    """Seconds: `computing` and writing all points, as the sweep's last line will say; before that `loading` the kernels
    (which are compiled by then), and `layout`, for laying out and closing the file."""

    computing: float
    loading: float
    layout: float


@dataclass(frozen=True)
class _Sample(Plan):
    """Some points of a plan, in the place of all of them: float64 (n, len(COLUMNS))."""

    some: np.ndarray = field(default_factory=lambda: np.empty((0, len(COLUMNS))))

    def points(self, start: int, stop: int) -> np.ndarray:
        return self.some[start:stop]


def estimate(plan: Plan, threads: int | None) -> Estimate:
    """Measure what a sweep will take here. Compiles the kernels if they are not on the disk."""
    began = monotonic()
    from vibrodrive.batch.sweep import check_threads, load_kernels
    from vibrodrive.jit.compile import compilation

    before = compilation.seconds
    load_kernels(plan)
    loading = monotonic() - began - (compilation.seconds - before)
    count, blocks = check_threads(threads), len(plan.blocks())
    computing, waves = _computing(plan, count)
    writing = (
        FIRST_SECONDS
        + point_bytes(plan.record, plan.settings.periods) * plan.n_points / BYTES_PER_SECOND
        + BLOCK_SECONDS * blocks
    )
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if count < cores:  # one is left for the writer, which works on one wave while the next is computed
        writing -= min(writing, computing) * (1 - 1 / waves)
    layout = LAYOUT_SECONDS + LAYOUT_BLOCK_SECONDS * blocks + file_bytes(plan) / LAYOUT_BYTES_PER_SECOND
    return Estimate(computing + writing, loading, layout)


def _computing(plan: Plan, threads: int) -> tuple[float, int]:
    """Seconds for all points and all periods; and the number of waves in which they are computed.

    The number of periods grows until the sample takes long enough, then that of points. Motions settle, and periods
    may come to be copied (recurrence.py): the rest of the periods is taken to go on like the last three quarters of
    the longest sample.
    """
    from vibrodrive.kernels.lane import LANES

    most = max(SAMPLE_POINTS, 4 * LANES * threads)
    groups, waves = _groups(plan, threads, most)
    total = plan.settings.transient + plan.settings.periods
    at, took = 0, 0.0
    while True:
        n, periods = _size(groups), min(total, max(1, GROWTH * at))
        short = _short(plan, periods)
        now = sum(_clock(short, rows, threads) for rows in groups)
        if periods == total and now < SAMPLE_SECONDS:
            most *= GROWTH
            groups, waves = _groups(plan, threads, most)
            if _size(groups) > n:
                continue
        if periods == total or now > SAMPLE_SECONDS:
            later = max(0.0, now - took) / (periods - at) * (total - periods) if periods < total else 0.0
            return (now + later) * plan.n_points / n, waves
        at, took = periods, now


def _size(groups: list[np.ndarray]) -> int:
    return sum(map(len, groups))


def _groups(plan: Plan, threads: int, most: int) -> tuple[list[np.ndarray], int]:
    """At most about so many points of a plan, in groups to be computed together; and the number of waves in which the
    whole plan is computed.

    Groups are as large as the waves of the sweep (or so large that all lanes are busy most of the time): what a
    point costs depends on how many there are beside it.
    """
    from vibrodrive.batch.sweep import waves_of

    waves = waves_of(plan)
    largest = max(stop - start for start, stop in waves)
    random = np.random.default_rng(0)  # the same sample for the same plan
    if plan.n_points <= most:
        spans: list[np.ndarray] = [np.arange(start, stop) for start, stop in waves]
    elif largest * SAMPLE_WAVES <= most:
        chosen = _spread(len(waves), most // largest, random)
        spans = [np.arange(*waves[k]) for k in chosen]
    else:
        spans = np.array_split(_spread(plan.n_points, most, random), math.ceil(most / largest))
    groups = [plan.rows(span) for span in spans]
    # where a single period of a point takes long (a fine grid visited point by point), fewer points have to do
    rows = np.concatenate(groups)
    few = rows[[0, len(rows) // 2, -1]]
    once = _short(plan, 1)
    alone = (_clock(once, few, 1) - _clock(once, few[:0], 1)) / len(few)
    step = math.ceil(len(rows) * alone / (threads * SAMPLE_SECONDS)) if alone > LONG_PERIOD else 1
    return [group[::step] for group in groups], len(waves)


def _spread(n: int, count: int, random: np.random.Generator) -> np.ndarray:
    """One index of each of `count` equal parts of range(n), at random, for axes have a rhythm of their own."""
    return ((np.arange(count) + random.random(count)) * n / count).astype(int)


def _short(plan: Plan, periods: int) -> Plan:
    """The first `periods` periods of every point, recorded or not in the plan's proportion."""
    s = plan.settings
    recorded = max(1, math.ceil(periods * s.periods / (s.transient + s.periods)))
    return replace(plan, settings=replace(s, transient=periods - recorded, periods=recorded))


def _clock(plan: Plan, rows: np.ndarray, threads: int) -> float:
    """Seconds for some points of a plan."""
    from vibrodrive.batch.sweep import compute

    sample = _Sample({}, plan.scalars, plan.settings, record=plan.record, some=rows)
    shortest, began = math.inf, monotonic()
    for _ in range(REPEATS):  # what takes milliseconds is easily disturbed
        start = monotonic()
        compute(sample, 0, len(rows), threads)
        shortest = min(shortest, monotonic() - start)
        if monotonic() - began > REPEAT_SECONDS:
            break
    return shortest
