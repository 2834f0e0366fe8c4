"""Resources that all pages of a server share: the worker thread, the measured speed, and the limits found.

Numba is imported after the first page has been built. While the browser loads this page, the worker loads the kernels.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from typing import Any

from vibrodrive.explorer.worker import Worker
from vibrodrive.model import records, size
from vibrodrive.model.plan import Plan

WARMING = -1  # belongs to no page, because pages are numbered from 0
FEWEST = 64  # least number of points of a level (work.py); a kernel computes this number of motions together
LARGEST = 2 * 10**9  # largest number of bytes of the results of one view
KEPT = 1000  # largest number of known limits, which take some hundred bytes each


class Pace:
    """Measured number of excitation periods computed per second, for each kind of motion."""

    FIRST = 5e5  # excitation periods per second before the first measurement

    def __init__(self) -> None:
        self._measured: dict[tuple[int, bool, bool], float] = {}

    def of(self, plan: Plan) -> float:
        return self._measured.get(self._kind(plan), self.FIRST)

    def learn(self, plan: Plan, points: int, seconds: float) -> None:
        """Replace the value for this kind of motion by the mean of the old value and a new measurement.

        So a short load by other programs has less effect. The measurement is the time in `seconds` for `points` points.
        """
        if points < FEWEST:  # `seconds` is then mostly the time to start the threads
            return
        periods = points * length(plan)
        new = periods / max(seconds, 1e-4)
        old = self._measured.get(self._kind(plan), new)
        self._measured[self._kind(plan)] = 0.5 * (old + new)

    @staticmethod
    def _kind(plan: Plan) -> tuple[int, bool, bool]:
        disturbed = "eps" in plan.axes or plan.scalars["eps"] > 0.0
        return plan.settings.method, disturbed, records.SECTION in plan.record


def length(plan: Plan) -> int:
    return plan.settings.transient + plan.settings.periods


class Engine:
    """Computation for all pages, which are identified by numbers. `tasks` imports and returns the module tasks, which
    imports Numba."""

    def __init__(self, threads: int | None, tasks: Callable[[], Any]) -> None:
        self.threads = threads
        self.tasks = tasks
        self.worker = Worker(self._failed)
        self.pace = Pace()
        self.pages: dict[int, Any] = {}
        self.limits: dict[str, dict[str, Any]] = {}  # known limits k₂, at most KEPT, by their arguments

    def warm(self) -> None:
        """Load all modules and kernels that the first picture needs."""
        self.worker.request(WARMING, lambda halt: self.tasks().warm_picture(self, halt))

    def _failed(self, number: int, error: BaseException) -> None:
        page = self.pages.get(number)
        if page is not None:
            page.later(partial(page.refuse, error))

    def compiling(self) -> float:
        """Return the seconds that this process has compiled, 0 if it does not compile now."""
        module = sys.modules.get("vibrodrive.jit.compile")  # imported by the first task
        compilation = getattr(module, "compilation", None)
        return float(compilation.seconds) if compilation is not None and compilation.running else 0.0

    def make_room(self, need: int, what: str) -> None:
        """Delete results of pages, the oldest page first, until all results and `need` fit into half of the free
        memory.

        `need` is the number of bytes of a new view. Raises ValueError if `need` exceeds LARGEST or half of the free
        memory; the message begins with `what`.
        """
        holders = [page for page in self.pages.values() if page.work is not None]
        used = sum(page.work.bytes for page in holders)
        most = (size.available_memory() + used) // 2
        if need > min(most, LARGEST):
            sizes = f"{size.human(need)}, and {size.human(min(most, LARGEST))} are allowed"
            raise ValueError(f"{what}: must be small enough for memory; the results of this view take {sizes}")
        for page in holders:
            if used + need > most:
                used, page.work = used - page.work.bytes, None
