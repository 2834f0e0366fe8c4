"""How long a sweep will take, measured on a sample of its points."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from time import monotonic
from typing import Any

import numpy as np

from vibrodrive.plan import Plan

SAMPLE_POINTS = 1024
"""Enough to keep all lanes of all threads busy, few enough for a second."""

SAMPLE_SECONDS = 0.5
"""A sample that took less says little about hours."""


def seconds(plan: Plan, threads: int | None) -> float:
    """Seconds the sweep will take here, kernels compiled.

    Every axis is thinned to values in the middle of equal parts of it; the number of periods grows until
    the sample takes long enough, and the time is scaled by points and periods: too much for periods that will be
    copied, not computed (recurrence.py).
    """
    sample = _thinned(plan)
    total = plan.settings.transient + plan.settings.periods
    _clock(_short(sample, 1), threads)  # loads the kernels
    periods = 1
    while True:
        periods = min(total, 4 * periods)
        took = _clock(_short(sample, periods), threads)
        if periods == total or took > SAMPLE_SECONDS:
            return took * (plan.n_points / sample.n_points) * (total / periods)


def _short(plan: Plan, periods: int) -> Plan:
    """The first `periods` periods of every point, recorded or not in the plan's proportion."""
    s = plan.settings
    recorded = max(1, math.ceil(periods * s.periods / (s.transient + s.periods)))
    return replace(plan, settings=replace(s, transient=periods - recorded, periods=recorded))


def _thinned(plan: Plan) -> Plan:
    lengths = list(plan.shape)
    while math.prod(lengths) > SAMPLE_POINTS:
        k = lengths.index(max(lengths))
        others = math.prod(lengths) // lengths[k]
        lengths[k] = max(1, min(lengths[k] - 1, SAMPLE_POINTS // others))
    axes = {
        name: a[((np.arange(n) + 0.5) * len(a) / n).astype(int)]
        for n, (name, a) in zip(lengths, plan.axes.items(), strict=True)
    }
    return replace(plan, axes=axes, tiling=None)


def _clock(plan: Plan, threads: int | None) -> float:
    from vibrodrive.sweep import run_blocks

    run: Callable[..., Any] = run_blocks
    began = monotonic()
    for _ in run(plan, threads=threads):
        pass
    return monotonic() - began
