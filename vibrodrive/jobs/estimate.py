"""Estimate of the time of a sweep, from the CPU time of samples of its points.

CPU time hardly depends on other programs that run at the same time.
"""

import math
import statistics
from dataclasses import replace
from time import monotonic, process_time
from typing import NamedTuple

import numpy as np

from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.plan import BLOCK_WORK, LEAST_POINTS, Plan
from vibrodrive.model.variables import POINT, along

SAMPLES = 4  # largest number of samples; their differences show how sure the estimate is
SECONDS = 0.3  # least CPU time of a sample from which the time of its remaining periods is extrapolated
GROWTH = 4  # factor by which the number of periods grows from one attempt to the next
DOUBT = 0.25  # relative uncertainty of a measured time: the speed of a core is not constant


class Estimate(NamedTuple):
    """Times in seconds, if no other program uses the cores: `computing` for all points, which probably lies between
    `least` and `most`, and `loading` for the compiled kernels."""

    computing: float
    least: float
    most: float
    loading: float


def estimate(plan: Plan, threads: int | None) -> Estimate:
    """Estimate the time of a sweep on this machine. Compiles the kernels if they are not on the disk."""
    began = monotonic()
    from vibrodrive.batch.sweep import busy_threads, check_threads, load_kernels
    from vibrodrive.jit.compilation import compilation

    before = compilation.seconds
    load_kernels(plan)
    loading = monotonic() - began - (compilation.seconds - before)
    alone = plan.settings.one_by_one(plan.bounded)
    return Estimate(*_computing(plan, busy_threads(check_threads(threads), plan.n_points, alone)), loading)


def _computing(plan: Plan, threads: int) -> tuple[float, float, float]:
    """Return the seconds for all points and periods, and bounds between which they probably lie.

    The points of each sample are spread evenly over the sweep. They are computed together, like a wave, so that the
    threads and their lanes are as busy as in the sweep.
    """
    size = max(8 * LEAST_POINTS * threads, int(BLOCK_WORK // plan.point_work))
    size = min(size, plan.n_points, plan.wave_points)
    samples = min(SAMPLES, max(1, plan.n_points // size))
    numbers = np.unique(np.linspace(0, plan.n_points - 1, samples * size).astype(int))
    measured, costs = zip(*(_cost(plan, plan.rows(numbers[k::samples]), threads) for k in range(samples)), strict=True)
    mean = statistics.fmean(costs)
    doubt = DOUBT + 0.5 * (1.0 - statistics.fmean(measured) / mean)
    if samples > 1:
        doubt += 3.2 * statistics.stdev(costs) / mean / math.sqrt(samples)  # 95 % of Student's distribution
    seconds = mean * plan.n_points / threads
    return seconds, seconds / (1.0 + doubt), seconds * (1.0 + doubt)


def _cost(plan: Plan, rows: np.ndarray, threads: int) -> tuple[float, float]:
    """Return the CPU time of a point in seconds, the measured part and all, for points float64 (n, len(COLUMNS)).

    The sample is computed repeatedly, each time for more periods, until one attempt takes at least SECONDS or computes
    all periods. Late periods take less time than early periods, because the kernels copy periods that repeat. So each
    remaining period is assumed to take as long as a period in the last three quarters of the longest attempt.
    """
    from vibrodrive.batch.sweep import compute

    total = plan.settings.transient + plan.settings.periods
    points = dict(zip(COLUMNS, rows.T, strict=True))
    at, before, took = 0, 0.0, 0.0
    while at < total and took < SECONDS:
        before, last, at = took, at, min(total, max(1, GROWTH * at))
        recorded = max(1, math.ceil(at * plan.settings.periods / total))
        settings = replace(plan.settings, transient=at - recorded, periods=recorded)
        wave = Plan(along(POINT, points), settings, record=plan.record)
        began = process_time()
        compute(wave, 0, len(rows), threads)
        took = process_time() - began
    later = max(0.0, took - before) / (at - last) * (total - at)
    return took / len(rows), (took + later) / len(rows)
