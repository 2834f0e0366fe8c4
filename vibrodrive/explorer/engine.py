"""Resources that all pages of a server share: the worker thread, the measured speed, and the limits found.

The worker runs one task at a time, for the page that asked last. A new request replaces the task of its page, and halts
the running task. If this is the task of another page, it is started again later, and continues from its stored results
(`Work`). Tasks that last take turns, so that no page waits for the end of another. Numba is imported after the first
page has been built; while the browser loads it, the worker loads kernels.
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

from vibrodrive.explorer.controls import title_of
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.model import size
from vibrodrive.model.plan import Plan

WARMING = 0  # belongs to no page: pages are numbered from 1, and what a page saves has its number with a minus
FEWEST = 64  # least number of points of a level (work.py); a kernel computes this number of motions together
LARGEST = 2 * 10**9  # largest number of bytes of the results of one view
TURN = 1.0  # seconds of the first turn of a task for which another waits; each further turn is twice as long
KEPT = 1000  # largest number of known limits, which take some hundred bytes each


Task = Callable[[Halt], None]
"""Function that returns early or raises Halted as soon as its flag `Halt` is set. It can be called again later."""


class Worker:
    """Worker thread, and the requests that wait for it, by the numbers of their pages."""

    def __init__(self, failed: Callable[[int, BaseException], None], waits: Callable[[int, int], None]) -> None:
        self._failed, self._waits = failed, waits  # called with a page and its error, or the page for which it waits
        self._waiting: dict[int, Task] = {}  # the newest request is the last
        self._current: tuple[int, Task, Halt] | None = None
        self._changed = threading.Condition()
        self._closed, self._turn = False, TURN
        self._thread = threading.Thread(target=self._run, name="explorer", daemon=True)
        self._thread.start()

    def request(self, page: int, task: Task) -> None:
        """Run this task in place of the earlier task of its page."""
        with self._changed:
            if self._current is not None:
                running, halted, halt = self._current
                if not halt.called:  # a cancelled task is not restarted
                    self._waiting.setdefault(running, halted)
                    halt.call()
            self._waiting.pop(page, None)
            self._waiting[page], self._turn = task, TURN
            self._changed.notify_all()

    def cancel(self, page: int) -> None:
        """Cancel the task of a page."""
        with self._changed:
            self._waiting.pop(page, None)
            if self._current is not None and self._current[0] == page:
                self._current[2].call()
                self._changed.notify_all()

    def pause(self, halt: Halt, seconds: float) -> None:
        """Wait inside a task for these seconds. Raises Halted as soon as the task is halted."""
        with self._changed:
            self._changed.wait_for(lambda: halt.called or self._closed, seconds)
        if halt.called:
            raise Halted

    def idle(self) -> bool:
        """Return True if no task is running or waiting."""
        with self._changed:
            return self._current is None and not self._waiting

    def close(self, seconds: float = 1.0) -> None:
        """End the thread. Wait at most these seconds until it has ended."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            if self._current is not None:
                self._current[2].call()
            self._changed.notify_all()
        self._thread.join(seconds)

    def _run(self) -> None:
        while (chosen := self._next()) is not None:
            page, task, halt = chosen
            turn = threading.Timer(self._turn, self._end_turn, chosen)
            turn.daemon = True  # or the end of the program would wait for it
            turn.start()
            try:
                task(halt)
            except Halted:
                pass
            except BaseException as error:
                self._failed(page, error)
            turn.cancel()

    def _next(self) -> tuple[int, Task, Halt] | None:
        with self._changed:
            self._current = None
            self._changed.wait_for(lambda: self._waiting or self._closed)
            if self._closed:
                return None
            page, task = self._waiting.popitem()
            self._current = page, task, Halt()
            for other in self._waiting:
                self._waits(other, page)
        return self._current

    def _end_turn(self, page: int, task: Task, halt: Halt) -> None:
        with self._changed:
            if self._waiting and not halt.called:
                self._waiting, self._turn = {page: task, **self._waiting}, 2.0 * self._turn
                halt.call()
                self._changed.notify_all()


class Pace:
    """Measured number of excitation periods computed per second, for each kind of motion; at first FIRST."""

    FIRST = 5e5

    def __init__(self) -> None:
        self._measured: dict[tuple[int, bool, bool], float] = {}

    def of(self, plan: Plan) -> float:
        return self._measured.get(self._kind(plan), self.FIRST)

    def learn(self, plan: Plan, points: int, seconds: float) -> None:
        """Take the mean of the old value and of a new one, so that a short load by other programs has less effect."""
        if points >= FEWEST:  # for fewer points `seconds` is mostly the time to start the threads
            new = points * length(plan) / max(seconds, 1e-4)
            self._measured[self._kind(plan)] = 0.5 * (new + self._measured.get(self._kind(plan), new))

    @staticmethod
    def _kind(plan: Plan) -> tuple[int, bool, bool]:
        disturbed = "eps" in plan.axes or plan.scalars["eps"] > 0.0
        return plan.settings.method, disturbed, plan.sectioned


def length(plan: Plan) -> int:
    return plan.settings.transient + plan.settings.periods


class Engine:
    """Computation for all pages, which are identified by numbers. `tasks` imports and returns the module tasks, which
    imports Numba."""

    def __init__(self, threads: int | None, tasks: Callable[[], Any]) -> None:
        self.threads = threads
        self.tasks = tasks
        self.worker = Worker(self._failed, self._waits)
        self.pace = Pace()
        self.pages: dict[int, Any] = {}
        self.limits: dict[str, dict[str, Any]] = {}  # known limits k₂, at most KEPT, by their arguments

    def warm(self) -> None:
        """Load the modules that the first picture needs."""
        self.worker.request(WARMING, lambda halt: self.tasks())

    def _failed(self, number: int, error: BaseException) -> None:
        page = self.pages.get(abs(number))
        if page is not None:
            page.later(partial(page.refuse, error))

    def _waits(self, number: int, other: int) -> None:
        page, first = self.pages.get(number), self.pages.get(abs(other))
        if page is not None and first is not None:
            page.later(partial(page.news, {"waits": title_of(first.view)[0]}))

    def compiling(self) -> float:
        """Return the seconds that this process has compiled, 0 if it does not compile now."""
        module = sys.modules.get("vibrodrive.jit.compilation")  # imported by the first task
        compilation = getattr(module, "compilation", None)
        return float(compilation.seconds) if compilation is not None and compilation.running else 0.0

    def make_room(self, need: int, what: str) -> None:
        """Delete results of pages, the oldest page first, until all results and the `need` bytes of a new view fit into
        half of the free memory. Raises ValueError, with a message that begins with `what`, if they are too many."""
        holders = [page for page in self.pages.values() if page.work is not None]
        used = sum(page.work.bytes for page in holders)
        most = (size.available_memory() + used) // 2
        if need > min(most, LARGEST):
            sizes = f"{size.human(need)}, and {size.human(min(most, LARGEST))} are allowed"
            raise ValueError(f"{what}: must be small enough for memory; the results of this view take {sizes}")
        for page in holders:
            if used + need > most:
                used, page.work = used - page.work.bytes, None
