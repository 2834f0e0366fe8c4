"""Carried sweeps: each value of the first axis starts from the last state of its neighbour, so that hysteresis shows.

The last section point (ξ, ξ' at τ = section_phase + 2πk) is the whole state of a motion. The neighbour's motion begins
with it at τ0 = section_phase, in the first turn: the excitation repeats there, while the disturbance of eq. (9) and a
grid of Δτ begin anew with each value. A motion that was given up has no last point: its neighbour starts as the first.

A layer is the points of one value of the first axis: they do not depend on each other, and each on one of the layer
before. Carried up, layers follow in the order of the axis, carried down in the opposite one.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.plan import Plan

XI0, DXI0, TAU0, SECTION_PHASE = (COLUMNS.index(name) for name in ("xi0", "dxi0", "tau0", "section_phase"))

States = Callable[[int, int], np.ndarray]
"""The last section points of the points start to stop, float64 (stop - start, 2), where they were computed before."""


def layers(plan: Plan, start: int, stop: int) -> list[tuple[int, int]]:
    """Points start to stop of a plan as (start, stop) of each layer, or part of one, in the order of computation."""
    width = math.prod(plan.shape[1:])
    first, last = start // width, (stop - 1) // width
    found = [(max(start, k * width), min(stop, (k + 1) * width)) for k in range(first, last + 1)]
    return found if plan.carry == "up" else found[::-1]


def continued(points: np.ndarray, states: np.ndarray | None) -> np.ndarray:
    """Points (rows of COLUMNS) that start from states (n, 2), or as they are where those are unknown (NaN, None)."""
    if states is None:
        return points
    known = np.isfinite(states).all(axis=1)
    points[known, XI0] = np.maximum(states[known, 0], 0.0)  # on a grid an impact may not have been noticed yet
    points[known, DXI0] = states[known, 1]
    points[known, TAU0] = points[known, SECTION_PHASE]
    return points


class Carried:
    """What the blocks of a carried sweep start from. They have to come in the order of the layers.

    `stored` answers for what is computed already when a sweep is gone on with.
    """

    def __init__(self, plan: Plan, stored: States | None = None) -> None:
        self._plan = plan
        self._stored = stored
        self._step = math.prod(plan.shape[1:]) * (1 if plan.carry == "up" else -1)
        self._last: dict[tuple[int, int], np.ndarray] = {}

    def before(self, start: int, stop: int) -> np.ndarray | None:
        """The states that the first layer of a block starts from; None: it has no neighbour before it."""
        first, end = layers(self._plan, start, stop)[0]
        span = first - self._step, end - self._step
        if span[0] < 0 or span[1] > self._plan.n_points:
            return None
        if span in self._last:
            return self._last.pop(span)
        if self._stored is None:
            raise LookupError(f"points {span[0]} to {span[1]} are not computed yet")
        return self._stored(*span)

    def keep(self, start: int, stop: int, section: np.ndarray) -> None:
        """Remember the last layer of a block that is finished, from its section."""
        first, end = layers(self._plan, start, stop)[-1]
        self._last[first, end] = section[first - start : end - start, -1].copy()

    def chain(self, start: int) -> int:
        """Blocks of one number here wait for each other; those of another are free of them."""
        return start % abs(self._step)
