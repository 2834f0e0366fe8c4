"""Estimate of the time of a sweep, from the measured time of a sample of its points."""

import math
from dataclasses import dataclass, field, replace
from time import monotonic
from typing import NamedTuple

import numpy as np

from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.plan import Plan

POINTS = 1024  # largest number of points of the sample, which then has different motions and takes a few seconds
SECONDS = 0.4  # least measured time of the sample from which the time of the sweep is extrapolated
GROWTH = 4  # factor by which the number of periods grows from one attempt to the next


class Estimate(NamedTuple):
    """Times in seconds: `computing` for all points, `loading` for the compiled kernels."""

    computing: float
    loading: float


@dataclass(frozen=True)
class _Wave(Plan):
    """A plan reduced to some of its points, which are given as float64 (n, len(COLUMNS))."""

    some: np.ndarray = field(default_factory=lambda: np.empty((0, len(COLUMNS))))

    def points(self, start: int, stop: int) -> np.ndarray:
        return self.some[start:stop]


def estimate(plan: Plan, threads: int | None) -> Estimate:
    """Estimate the time of a sweep on this machine. Compiles the kernels if they are not on the disk."""
    began = monotonic()
    from vibrodrive.batch.sweep import check_threads, load_kernels
    from vibrodrive.jit.compile import compilation

    before = compilation.seconds
    load_kernels(plan)
    loading = monotonic() - began - (compilation.seconds - before)
    return Estimate(_computing(plan, check_threads(threads)), loading)


def _computing(plan: Plan, threads: int) -> float:
    """Return the seconds for all points and periods.

    A sample of points, spread evenly over the sweep, is computed repeatedly, each time for more periods, until one
    attempt takes at least SECONDS or computes all periods. Late periods take less time than early periods, because the
    kernels copy periods that repeat. So each remaining period is assumed to take as long as a period in the last three
    quarters of the longest attempt.
    """
    from vibrodrive.batch.sweep import compute

    total = plan.settings.transient + plan.settings.periods
    rows = plan.rows(np.unique(np.linspace(0, plan.n_points - 1, min(POINTS, plan.wave_points)).astype(int)))
    at, before, took = 0, 0.0, 0.0
    while at < total and took < SECONDS:
        before, last, at = took, at, min(total, max(1, GROWTH * at))
        recorded = max(1, math.ceil(at * plan.settings.periods / total))
        settings = replace(plan.settings, transient=at - recorded, periods=recorded)
        wave = _Wave({}, plan.scalars, settings, record=plan.record, some=rows)
        began = monotonic()
        compute(wave, 0, len(rows), threads)
        took = monotonic() - began
    later = max(0.0, took - before) / (at - last) * (total - at)
    return (took + later) * plan.n_points / len(rows)
