"""Thread that runs one task at a time, for the page that asked last.

There is one task for each page. A new request replaces the task of its page, and halts the running task. If this is the
task of another page, it is started again later, and continues from its stored results (`Work`).
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from vibrodrive.jit.slices import Halt, Halted

Task = Callable[[Halt], None]
"""Function that returns early or raises Halted as soon as its flag `Halt` is set. It can be called again later."""


class Worker:
    """Worker thread, and the requests that wait for it, by the numbers of their pages."""

    def __init__(self, failed: Callable[[int, BaseException], None]) -> None:
        self._failed = failed
        self._waiting: dict[int, Task] = {}  # the newest request is the last
        self._current: tuple[int, Task, Halt] | None = None
        self._changed = threading.Condition()
        self._closed = False
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
            self._waiting[page] = task
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
            try:
                task(halt)
            except Halted:
                pass
            except BaseException as error:
                self._failed(page, error)

    def _next(self) -> tuple[int, Task, Halt] | None:
        with self._changed:
            self._current = None
            self._changed.wait_for(lambda: self._waiting or self._closed)
            if self._closed:
                return None
            page, task = self._waiting.popitem()
            self._current = page, task, Halt()
            return self._current
