"""Measured speed of the computation, from which the number of points of a frame or level follows."""

from __future__ import annotations

from vibrodrive.model.plan import Plan
from vibrodrive.model.records import SECTION

FEWEST = 64  # points of a level, at least; as many as a kernel advances together


class Pace:
    """Measured number of excitation periods computed per second, for each kind of motion."""

    FIRST = 5e5  # before the first measurement

    def __init__(self) -> None:
        self._measured: dict[tuple[int, bool, bool], float] = {}

    def of(self, plan: Plan) -> float:
        return self._measured.get(self._kind(plan), self.FIRST)

    def learn(self, plan: Plan, points: int, seconds: float) -> None:
        """Average the old value and a new measurement, so that a short load by other programs has less effect."""
        if points < FEWEST:  # mostly the time to start the threads
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
