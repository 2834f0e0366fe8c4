"""Thread that runs one task at a time. More urgent kinds of work run first; within one kind, the newest request runs
first.

There is one slot for each kind of work of each page. A new request replaces the waiting or running request in its slot.
A new request also halts the running task of another slot if this task is not more urgent. The halted task is started
again later and continues from its stored results (`Work`). A task itself may make a request (`follow`). Such a request
runs after the task, and halts no other task.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

from vibrodrive.jit.slices import Halt, Halted


class Rank(IntEnum):
    """Kinds of work, the most urgent first: curves of the selected motion, picture, file to save, exact results."""

    MOTION = 0
    PICTURE = 1
    EXPORT = 2
    EXACT = 3


class Slot(NamedTuple):
    """Page and kind of work of a request."""

    page: int
    rank: Rank


Task = Callable[[Halt], None]
"""Function that returns early or raises Halted as soon as its flag `Halt` is set. It can be called again later."""


class Worker:
    """Worker thread, and the requests that wait for it."""

    def __init__(self, failed: Callable[[Slot, BaseException], None]) -> None:
        self._failed = failed
        self._waiting: dict[Slot, Task] = {}  # the newest request is the last
        self._current: tuple[Slot, Task, Halt] | None = None
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="explorer", daemon=True)
        self._thread.start()

    def request(self, slot: Slot, task: Task, instead_of: tuple[Rank, ...] = ()) -> None:
        """Run this task in place of the earlier task in its slot.

        Cancel the tasks of the same page whose rank is in `instead_of`.
        """
        with self._changed:  # in one step, so that a halted task cannot add requests
            if instead_of:
                self.cancel(slot.page, *instead_of)
            if self._current is not None:
                running, halted, halt = self._current
                if slot.rank <= running.rank and not halt.called:  # a cancelled task is not restarted
                    self._waiting.setdefault(running, halted)
                    halt.call()
            self._waiting.pop(slot, None)
            self._waiting[slot] = task
            self._changed.notify_all()

    def follow(self, halt: Halt, slot: Slot, task: Task) -> None:
        """Run `task` after the running task, which calls this method with its `halt`.

        `task` is ignored if the running task was halted, or if another task waits in this slot.
        """
        with self._changed:
            if not halt.called:
                self._waiting.setdefault(slot, task)

    def cancel(self, page: int, *ranks: Rank) -> None:
        """Cancel the work of a page that has these ranks. Without `ranks`, cancel all work of the page."""
        with self._changed:
            chosen = {Slot(page, rank) for rank in ranks or Rank}
            for slot in chosen:
                self._waiting.pop(slot, None)
            if self._current is not None and self._current[0] in chosen:
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
            slot, task, halt = chosen
            try:
                task(halt)
            except Halted:
                pass
            except BaseException as error:
                self._failed(slot, error)

    def _next(self) -> tuple[Slot, Task, Halt] | None:
        with self._changed:
            self._current = None
            self._changed.wait_for(lambda: self._waiting or self._closed)
            if self._closed:
                return None
            first = min(reversed(self._waiting), key=lambda slot: slot.rank)
            self._current = first, self._waiting.pop(first), Halt()
            return self._current
