"""Where the usual methods fail: every switch of a motion compared with the certified path.

At each switch of a fixed or Muller motion the certified path starts anew from the very same state, and the next
switches of the two are compared. So a failure affects no later comparison. The method's switch is

    missed   more than Δτ after the certified one, and another transition: the true switch was passed over
    late     more than Δτ after it, but the same transition: a zero was passed over and a later one taken
    wrong    in time, but into another state
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vibrodrive.batch.trajectory import simulate
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.kernels.event import SMALLEST
from vibrodrive.kernels.lane import new_lanes
from vibrodrive.kernels.single import single
from vibrodrive.model.parameters import COLUMNS, Method
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.model.states import State

KINDS = ("missed", "late", "wrong")
METHODS = ("fixed", "muller")

AHEAD = 2
"""Periods the certified path is followed from a restart: no sticking or rest that ends at all is longer."""

ROWS = 8
"""Certified switches looked at after a restart; an impact, or a start within rounding of a boundary, takes extra."""


class SwitchCounts(NamedTuple):
    """How the switches of one motion were found: how many were looked at (judged), and how many failed in each way."""

    judged: int
    missed: int
    late: int
    wrong: int


class Certified:
    """The certified path from any state: what comes next, and when."""

    def __init__(self, plan: Plan) -> None:
        self._point = plan.points(0, 1)
        self._lanes = new_lanes(1)
        self._order = np.zeros(1, np.int64)
        self._counters = np.zeros((2, 1), np.int64)
        self._results = (
            np.empty((1, AHEAD, 2)), np.empty((1, 0, 4)), None, None, None, np.empty(1, np.int8), np.empty(1),
            np.zeros((1, 5), np.int64), np.empty(1),
        )  # fmt: skip
        self._rows = np.zeros((ROWS, 3), np.int64), np.zeros((ROWS, 3))

    def after(self, tau: float, xi: float, state: int) -> tuple[int, float, int] | None:
        """(period, phase, next state) of the switch that ends `state`, begun at τ from ξ at rest; None: never."""
        for name, value in (("xi0", xi), ("dxi0", 0.0), ("tau0", tau)):
            self._point[0, COLUMNS.index(name)] = value
        self._counters[:] = 0
        w, k = self._lanes
        single(int(Method.CERTIFIED))(
            w[0], k[0], self._point, self._order, self._counters[0], 0, AHEAD, ROWS, *self._results, False,
            *self._rows, self._counters[1],
        )  # fmt: skip
        whole, real = self._rows
        for row in range(1, min(int(self._counters[1, 0]), ROWS)):
            if whole[row, 1] == state:
                return int(whole[row, 0]), float(real[row, 0]), int(whole[row, 2])
        return None


def compared(plan: Plan) -> Iterator[tuple[float, bool]]:
    """How far behind the certified switch the method's is, and whether it is the same transition, switch by switch.

    inf and False where the certified path has no further switch. Never negative but for rounding and `tol`:
    no method finds a zero before the first.
    """
    rows = simulate(**(plan.arguments(0) | {"scan": "skip"})).switches
    certified = Certified(plan)
    for row, following in pairwise(rows):
        state = int(row["after"])
        if state == State.IMPACT:
            continue
        at_obstacle = state == State.REST or row["before"] == State.IMPACT
        # a slide found over late may have sunk below the obstacle: the next state is then judged just above it
        xi = 0.0 if at_obstacle else max(float(row["xi"]), SMALLEST)
        true = certified.after(TWO_PI * int(row["period"]) + float(row["phase"]), xi, state)
        if true is None:
            yield np.inf, False
        else:
            period, phase, to = true
            behind = TWO_PI * (int(following["period"]) - period) + (float(following["phase"]) - phase)
            yield behind, to == int(following["after"])


def count_failures(plan: Plan) -> SwitchCounts:
    """Hold every switch of the one motion of a plan (method fixed or muller) against the certified path."""
    in_time = plan.scalars["dtau"] * (1 + 1e-6)
    judged = missed = late = wrong = 0
    for behind, same in compared(plan):
        judged += 1
        missed += behind > in_time and not same
        late += behind > in_time and same
        wrong += behind <= in_time and not same
    return SwitchCounts(judged, missed, late, wrong)


def failures_of_methods(plan: Plan, periods: int) -> Iterator[tuple[int, int, SwitchCounts]]:
    """(method, point, counts) for every point of a plan and both methods, `periods` excitation periods of each."""
    for m, method in enumerate(METHODS):
        for at in range(plan.n_points):
            yield m, at, count_failures(make_plan(plan.arguments(at) | {"method": method, "periods": periods}))
