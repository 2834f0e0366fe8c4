"""One thread that computes one thing at a time: the newest request wins, and the dearer waits for the cheaper.

Requests stand in slots, one for each kind of work of each page. A new request takes the place of the one in its slot,
whether that waits or is under way. What is under way is halted, too, by a request of the same or a higher rank from
another page, and begun again afterwards: what it has computed stays in the Work that it goes on with. What a task
itself asks for follows it, and halts nothing.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable
from enum import IntEnum
from typing import NamedTuple

from vibrodrive.jit.slices import Halt, Halted


class Rank(IntEnum):
    """Kinds of work, the most urgent first."""

    MOTION = 0
    PICTURE = 1
    EXPORT = 2
    EXACT = 3


class Slot(NamedTuple):
    """Whose work, and of which kind."""

    page: int
    rank: Rank


Task = Callable[[Halt], None]
"""Work that ends early, with Halted or not, once the flag is set, and may be called again then."""


class Request(NamedTuple):
    """A task in its slot; later ones have higher numbers."""

    slot: Slot
    number: int
    task: Task


class Worker:
    """The thread, and what waits for it.

    Attributes
    ----------
    computations, most_at_once : int
        how many tasks have been begun, and how many of them were under way at the same time.
    """

    def __init__(self, failed: Callable[[Slot, BaseException], None]) -> None:
        self._failed = failed
        self._waiting: dict[Slot, Request] = {}
        self._current: tuple[Request, Halt] | None = None
        self._changed = threading.Condition()
        self._numbers = itertools.count()
        self._closed = False
        self._at_once = 0
        self.computations = self.most_at_once = 0
        self._thread = threading.Thread(target=self._run, name="explorer", daemon=True)
        self._thread.start()

    def request(self, slot: Slot, task: Task, instead_of: tuple[Rank, ...] = ()) -> None:
        """Compute this, instead of what was asked for in this slot before, or in others of the page."""
        with self._changed:  # both at once: nothing follows what is halted
            if instead_of:
                self.cancel(slot.page, *instead_of)
            self._waiting[slot] = Request(slot, next(self._numbers), task)
            if self._current is not None:
                running, halt = self._current
                if slot.rank <= running.slot.rank and not halt.called:  # one that was cancelled must not come again
                    self._waiting.setdefault(running.slot, running)
                    halt.call()
            self._changed.notify_all()

    def follow(self, halt: Halt, slot: Slot, task: Task) -> None:
        """Compute this after the running task, which calls this with its flag; not where something newer is wanted."""
        with self._changed:
            if not halt.called:
                self._waiting.setdefault(slot, Request(slot, next(self._numbers), task))

    def cancel(self, page: int, *ranks: Rank) -> None:
        """Forget these kinds of work of a page, all of them unless named."""
        with self._changed:
            chosen = {Slot(page, rank) for rank in ranks or Rank}
            for slot in chosen:
                self._waiting.pop(slot, None)
            if self._current is not None and self._current[0].slot in chosen:
                self._current[1].call()
                self._changed.notify_all()

    def pause(self, halt: Halt, seconds: float) -> None:
        """Wait, in a task, whether somebody asks for something newer. Raises Halted as soon as that is so."""
        with self._changed:
            self._changed.wait_for(lambda: halt.called or self._closed, seconds)
        if halt.called:
            raise Halted

    def idle(self) -> bool:
        """Whether there is nothing to be done."""
        with self._changed:
            return self._current is None and not self._waiting

    def close(self, seconds: float = 1.0) -> None:
        """End the thread, at most so late."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            if self._current is not None:
                self._current[1].call()
            self._changed.notify_all()
        self._thread.join(seconds)

    def _run(self) -> None:
        while (chosen := self._next()) is not None:
            request, halt = chosen
            self._at_once += 1
            self.computations += 1
            self.most_at_once = max(self.most_at_once, self._at_once)
            try:
                request.task(halt)
            except Halted:
                pass
            except BaseException as error:
                self._failed(request.slot, error)
            finally:
                self._at_once -= 1

    def _next(self) -> tuple[Request, Halt] | None:
        with self._changed:
            self._current = None
            self._changed.wait_for(lambda: self._waiting or self._closed)
            if self._closed:
                return None
            first = min(self._waiting.values(), key=lambda r: (r.slot.rank, -r.number))
            self._current = self._waiting.pop(first.slot), Halt()
            return self._current
