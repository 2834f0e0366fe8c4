"""Division of long work into short slices, so that Ctrl-C takes effect: Python handles signals between kernel calls.

A compiled kernel cannot be interrupted. So each call of a kernel does a limited number of steps, stores its state in
arrays, and returns. The cost of a step differs by a factor of a thousand between kernels. So the number of steps of a
call is computed from the duration of the call before. The results do not depend on the slices.
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
"""Wanted duration of a slice in seconds. Ctrl-C must take effect within a second, and a slice may take several times
the wanted duration. The value is large compared with the few microseconds of a call, and with the 5 ms for which
another thread may hold the GIL."""

FIRST = 256  # default number of steps of the first slice
GROWTH = 16  # largest ratio of the steps of a slice to those of the slice before


class Halt:
    """A flag that ends work in other threads. Kernels check the flag.

    With a `sign`, the name of a file, pickled copies of a Halt also end work in other processes of this machine: work
    ends as soon as this file exists.
    """

    def __init__(self, sign: str | None = None) -> None:
        self._sign = sign
        self.flag = np.zeros(1, np.int64)  # kernels read this array

    def __reduce__(self) -> tuple[type[Halt], tuple[str | None]]:
        return Halt, (self._sign,)

    @property
    def across(self) -> bool:
        """True if a process with a copy of this Halt may end the work of this process."""
        return self._sign is not None

    @property
    def called(self) -> bool:
        return bool(self.flag[0]) or (self._sign is not None and os.path.exists(self._sign))

    def call(self) -> None:
        """Halt the work in this process."""
        self.flag[0] = 1

    def call_across(self, tasks: Collection[Future[Any]]) -> None:
        """Halt work in other processes, too. The file `sign` exists until all `tasks`, which run there, have ended."""
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
    """Raised if work has ended early because its `Halt` was called. The result of the work is discarded."""


def in_slices(advance: Callable[[int], bool], first: int = FIRST) -> None:
    """Call `advance` repeatedly, each time with the number of steps to do, until it returns True (finished)."""
    if advance(first):
        return
    steps = first
    began = perf_counter()
    while not advance(steps):
        now = perf_counter()
        steps = max(1, int(steps * min(GROWTH, SECONDS / (now - began + 1e-9))))
        began = now
