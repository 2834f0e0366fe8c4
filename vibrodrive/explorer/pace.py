"""How fast motions are computed: what a frame, or a level, can afford follows from it."""

from __future__ import annotations

from vibrodrive.model.plan import Plan
from vibrodrive.model.records import SECTION

FEWEST = 64  # points of a level, at least: as many as the kernels advance together


class Pace:
    """Excitation periods computed a second, as measured, for each kind of motion."""

    FIRST = 5e5  # before anything has been measured

    def __init__(self) -> None:
        self._measured: dict[tuple[int, bool, bool], float] = {}

    def of(self, plan: Plan) -> float:
        return self._measured.get(self._kind(plan), self.FIRST)

    def learn(self, plan: Plan, points: int, seconds: float) -> None:
        """Take what was just measured, half of it: a machine that others use is slower for a moment only."""
        if points < FEWEST:  # that was the time of starting
            return
        periods = points * length(plan)
        new = periods / max(seconds, 1e-4)
        old = self._measured.get(self._kind(plan), new)
        self._measured[self._kind(plan)] = 0.5 * (old + new)

    @staticmethod
    def _kind(plan: Plan) -> tuple[int, bool, bool]:
        disturbed = "eps" in plan.axes or plan.scalars["eps"] > 0.0
        return plan.settings.method, disturbed, SECTION in plan.record


def length(plan: Plan) -> int:
    return plan.settings.transient + plan.settings.periods
