"""Long work in short slices, so that Ctrl-C is answered: Python looks at its signals between two calls of a kernel.

A compiled kernel can't be interrupted. So no call of one lasts: each takes a number of steps, keeps what it needs to
go on in arrays, and returns. What a step costs differs a thousandfold from kernel to kernel; the number of steps of the
next call follows from how long the last one took. Results don't depend on where the slices lie.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Collection
from concurrent.futures import Future
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

SECONDS = 0.05
"""What a slice is to take: a small part of the second in which Ctrl-C is to be answered, as a step may soon cost
several times what it costs now; long beside the few microseconds of a call, and beside the 5 ms for which another
thread may keep Python to itself."""

FIRST = 256
"""Steps of the first slice, where the caller says nothing."""

GROWTH = 16
"""How many times longer a slice may be than the one before."""


class Halt:
    """A flag that ends work in other threads: kernels look at it.

    With a `sign` also in other processes of this machine that were given a copy: a file of that name means halt.
    """

    def __init__(self, sign: str | None = None) -> None:
        self._sign = sign
        self.flag = np.zeros(1, np.int64)  # for kernels, which look at it themselves

    def __reduce__(self) -> tuple[type[Halt], tuple[str | None]]:
        return Halt, (self._sign,)

    @property
    def across(self) -> bool:
        """Whether another process may call it."""
        return self._sign is not None

    @property
    def called(self) -> bool:
        return bool(self.flag[0]) or (self._sign is not None and os.path.exists(self._sign))

    def call(self) -> None:
        """Halt the work in this process."""
        self.flag[0] = 1

    def call_across(self, tasks: Collection[Future[Any]]) -> None:
        """Halt it in other processes, too: the sign stands until the last of the `tasks` there has ended."""
        self.call()
        if self._sign is None or not tasks:
            return
        waited_for = set(tasks)
        with contextlib.suppress(OSError):
            Path(self._sign).touch()

        def ended(task: Future[Any]) -> None:
            waited_for.discard(task)
            if not waited_for:
                Path(str(self._sign)).unlink(missing_ok=True)

        for task in tasks:
            task.add_done_callback(ended)


class Halted(Exception):
    """What work ends with whose flag was set: nobody waits for its result."""


def in_slices(advance: Callable[[int], bool], first: int = FIRST) -> None:
    """Call `advance` with a number of steps until it returns True (finished)."""
    if advance(first):  # as most do
        return
    steps = first
    began = perf_counter()
    while not advance(steps):
        now = perf_counter()
        steps = max(1, int(steps * min(GROWTH, SECONDS / (now - began + 1e-9))))
        began = now
