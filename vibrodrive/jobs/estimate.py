"""Estimate of the time of a sweep, from the measured time of a wave: some of its points, computed together."""

import math
from dataclasses import replace
from time import monotonic
from typing import NamedTuple

import numpy as np

from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.plan import POINT, Plan

SECONDS = 0.4  # least measured time of the wave from which the time of the sweep is extrapolated
GROWTH = 4  # factor by which the number of periods grows from one attempt to the next


class Estimate(NamedTuple):
    """Times in seconds: `computing` for all points, `loading` for the compiled kernels."""

    computing: float
    loading: float


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

    A wave of points, spread evenly over the sweep, is computed repeatedly, each time for more periods, until one
    attempt takes at least SECONDS or computes all periods. Late periods take less time than early periods, because the
    kernels copy periods that repeat. So each remaining period is assumed to take as long as a period in the last three
    quarters of the longest attempt.
    """
    from vibrodrive.batch.sweep import compute

    total = plan.settings.transient + plan.settings.periods
    rows = plan.rows(np.unique(np.linspace(0, plan.n_points - 1, min(plan.n_points, plan.wave_points)).astype(int)))
    points = dict(zip(COLUMNS, rows.T, strict=True))
    at, before, took = 0, 0.0, 0.0
    while at < total and took < SECONDS:
        before, last, at = took, at, min(total, max(1, GROWTH * at))
        recorded = max(1, math.ceil(at * plan.settings.periods / total))
        settings = replace(plan.settings, transient=at - recorded, periods=recorded)
        wave = Plan({POINT: np.arange(len(rows))}, {}, settings, record=plan.record, together=points)
        began = monotonic()
        compute(wave, 0, len(rows), threads)
        took = monotonic() - began
    later = max(0.0, took - before) / (at - last) * (total - at)
    return (took + later) * plan.n_points / len(rows)
