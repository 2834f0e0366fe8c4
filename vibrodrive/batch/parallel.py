"""Computation on several threads, which Ctrl-C ends within a second.

Each thread runs the kernel with its own lanes (memory of motions, kernels/lane.py) and takes points from a shared
counter. So all cores are in use although the cost of points differs. Kernels that Numba has compiled run in a loop of
`numba.prange` (prange.py), and those that came with the package in threads of Python, which they do not block.

Compiled code cannot be interrupted. Therefore it runs in a separate thread, while the calling thread waits and can be
interrupted. The kernels end when a flag in memory is set.
"""

from __future__ import annotations

import os
import sys
import threading
from _thread import start_new_thread
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from typing import Any, TypeVar

import numpy as np

from vibrodrive.jit.compile import COMPILED
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.kernels.arguments import Arguments, packed
from vibrodrive.kernels.lane import address_of

LOOK = 0.05  # time in seconds between two checks for Ctrl-C, for a halt from another process, and for finished blocks

BRIEF = 5000.0
"""Largest work, in microseconds (`Settings.work` in model/names.py), that runs in the calling thread."""

R = TypeVar("R")

Loop = Callable[[Sequence[Any], np.ndarray, Halt], None]
"""Function like `_run_in_workers`."""

_workers: list[_Worker] = []  # idle threads
_one_thread = False

FORK_SAFE = "tbb", "workqueue"
"""Threading layers of Numba that also work in a forked child of a process that has used them. GNU's OpenMP aborts such
a child."""


def _in_child() -> None:
    """Store whether the threading layer of the parent fails in this forked child. The child then uses one thread."""
    global _one_thread
    _workers.clear()
    numba: Any = sys.modules.get("numba")
    with suppress(AttributeError, ValueError):  # Numba is not loaded, or no layer was started
        _one_thread = numba.threading_layer() not in FORK_SAFE


os.register_at_fork(after_in_child=_in_child)


def run(
    calls: Sequence[tuple[Any, Sequence[Arguments]]],
    halt: Halt,
    *,
    brief: bool = False,
    look: Callable[[], None] | None = None,
) -> None:
    """Run one or two kernels. Each element of `calls` is a kernel with its sets of arguments, one set for each thread.

    All kernels have ended when this function returns or raises an exception. If the work is `brief`, it runs in the
    calling thread with the first set of arguments only, because starting threads would take longer than the work.
    Otherwise `look` is called about every LOOK seconds while the kernels run. Raises Halted if `halt` is called.
    """
    threads = 1 if brief else len(calls[0][1])
    loop = _run_in_workers
    if COMPILED:  # compile in the calling thread, which Ctrl-C can interrupt; `halt` does not end a compilation
        for kernel, _ in calls:
            kernel.prepare()
        if threads > 1 and not any(kernel.shipped for kernel, _ in calls):
            from vibrodrive.batch import prange

            if _one_thread:
                threads = 1
            elif prange.works():
                loop = prange.run
    watched = look is not None or halt.across or threading.get_ident() == threading.main_thread().ident
    if brief or (threads == 1 and not watched):
        _run(calls, threads, halt, loop)
    else:
        _watch(partial(_run, calls, threads, halt, loop), partial(_run, calls, 1, halt, loop), halt, look)
    if halt.called:
        raise Halted


class _Worker:
    """A thread that runs one task after another.

    A worker is reused for later tasks, because to start a thread takes longer than a short task, and because OpenMP, in
    the loop of Numba, starts a team of threads for each thread that enters it.
    """

    def __init__(self) -> None:
        self.work: Callable[[], None]
        self.error: BaseException | None = None
        self.wanted, self.ended = threading.Lock(), threading.Lock()
        self.wanted.acquire()
        self.ended.acquire()
        start_new_thread(self._serve, ())  # at exit the interpreter would wait for the end of a `Thread`

    def _serve(self) -> None:
        while True:
            self.wanted.acquire()
            try:
                self.work()
            except BaseException as error:
                self.error = error
            self.work = _nothing
            self.ended.release()


def _nothing() -> None:
    """Do nothing. An idle worker has this task, so that it holds no reference to the arrays of its last task."""


def _take(work: Callable[[], None]) -> _Worker:
    """Return a worker that has begun this work."""
    worker = _workers.pop() if _workers else _Worker()
    worker.work = work
    worker.wanted.release()
    return worker


def _give_back(worker: _Worker) -> None:
    """Make a worker whose work has ended available again. Raises the exception that the work has raised."""
    error, worker.error = worker.error, None
    _workers.append(worker)
    if error is not None:
        raise error


class Pool(ThreadPoolExecutor):
    """Threads of Python. If no further one can be started, a task runs in the calling thread."""

    def submit(self, task: Callable[..., R], /, *args: Any, **kwargs: Any) -> Future[R]:
        future, taken = Future[R](), threading.Lock()

        def run() -> None:
            if taken.acquire(blocking=False) and future.set_running_or_notify_cancel():
                try:
                    future.set_result(task(*args, **kwargs))
                except BaseException as error:
                    future.set_exception(error)

        try:
            super().submit(run)
        except RuntimeError:  # the task is in the queue all the same, from which another thread may have taken it
            run()
        return future


def _watch(
    work: Callable[[], None], alone: Callable[[], None], halt: Halt, look: Callable[[], None] | None = None
) -> None:
    """Run `work` in a worker thread and wait for its end. Meanwhile call `look` periodically.

    An interrupt of the calling thread halts the work. If no thread can be started, this thread runs `alone`, whose end
    an interrupt awaits.
    """
    try:
        worker = _take(work)
    except RuntimeError:  # no thread can be started
        return alone()
    try:
        while not worker.ended.acquire(timeout=LOOK):
            if halt.called:
                halt.call()  # sets the flag in memory that kernels read
            elif look is not None:
                look()
    except BaseException:
        halt.call()
        while not worker.ended.acquire(timeout=LOOK):
            pass
        worker.error = None
        _workers.append(worker)
        raise
    _give_back(worker)


def _run_in_workers(kernels: Sequence[Any], addresses: np.ndarray, halt: Halt) -> None:
    """Run one or two kernels with the arguments at these addresses, int64 (2, threads), in as many threads."""

    def call(thread: int) -> None:
        for kernel, address in zip(kernels, addresses[:, thread].tolist(), strict=False):
            kernel(address)

    workers: list[_Worker] = []
    try:
        with suppress(RuntimeError):  # no more threads can be started: the others take all points from the counter
            for thread in range(1, addresses.shape[1]):
                workers.append(_take(partial(call, thread)))
        call(0)
    except BaseException:
        halt.call()
        raise
    finally:
        for worker in workers:  # the arrays behind the addresses must exist until all kernels have ended
            worker.ended.acquire()
    for worker in workers:
        _give_back(worker)


def _run(calls: Sequence[tuple[Any, Sequence[Arguments]]], threads: int, halt: Halt, loop: Loop) -> None:
    kernels = [kernel for kernel, _ in calls]
    if not COMPILED:
        for kernel, sets in calls:
            for arguments in sets:
                kernel(arguments)
        return
    tables = [packed(sets[:threads]) for _, sets in calls]
    if threads == 1:
        for kernel, table in zip(kernels, tables, strict=True):
            kernel(address_of(table))
        return
    addresses = np.zeros((2, threads), np.int64)
    for row, table in zip(addresses, tables):  # noqa: B905
        row[:] = address_of(table) + table.strides[0] * np.arange(threads)
    loop(kernels, addresses, halt)
