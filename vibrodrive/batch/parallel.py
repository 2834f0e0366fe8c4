"""Computation on several threads by a loop of `numba.prange` that calls kernels. Ctrl-C ends this loop within a second.

Each thread runs the kernel with its own lanes (memory of motions, kernels/lane.py) and takes points from a shared
counter. So all cores are in use although the cost of points differs. The loop calls kernels by address
(kernels/arguments.py), so it is compiled only once. If it called kernels by name, Numba would compile each kernel a
second time, together with the loop.

Compiled code cannot be interrupted. Therefore the loop runs in a separate thread, while the calling thread waits and
can be interrupted. The kernels end when a flag in memory is set.
"""

from __future__ import annotations

import os
import threading
from _thread import start_new_thread
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import typeof_impl

from vibrodrive.jit.branchless import COMPILED
from vibrodrive.jit.compile import OTHER_NUMBA, jit, prepare
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.kernels.arguments import Arguments, packed
from vibrodrive.kernels.lane import address_of

LOOK = 0.05  # time in seconds between two checks for Ctrl-C, for a halt from another process, and for finished blocks

BRIEF = 5000.0
"""Largest work, in microseconds (`Settings.work` in model/names.py), that runs in the calling thread."""

FORK_SAFE = "tbb", "workqueue"
"""Threading layers of Numba that also work in a forked child of a process that has used them. GNU's OpenMP aborts such
a child."""

SPINS = "10000"
"""Number of times that an idle thread of GNU's OpenMP looks for work before it sleeps. By default it looks for some
milliseconds after each sweep. In a loop of short sweeps with pauses this doubles the CPU time, and takes a core from
other programs."""

_SIGNATURE = types.int64(types.int64)
_FUNCTION: Any = None  # for a Numba that calls no function by its address: threads of Python then call the kernels

with suppress(*OTHER_NUMBA):
    # copied from numba.experimental, whose import would take a fifth of a second
    typeof_impl.register(types.CompileResultWAP)(lambda kernel, context: _FUNCTION)
    _FUNCTION = types.FunctionType(_SIGNATURE)

_lock = threading.Lock()  # the layer `workqueue` aborts the process if two threads use it simultaneously
_single_threaded = False
_workers: list[_Worker] = []  # idle threads


def _in_child() -> None:
    """Store whether the threading layer of the parent fails in this forked child. The child then uses one thread."""
    global _lock, _single_threaded
    _lock = threading.Lock()
    _workers.clear()
    try:
        _single_threaded = numba.threading_layer() not in FORK_SAFE
    except ValueError:  # no layer was started
        _single_threaded = False


os.register_at_fork(after_in_child=_in_child)


@jit(parallel=True)
def run_on_threads(first, second, addresses):
    """Call the kernel `first`, then the kernel `second`, in each thread.

    addresses : int64 (2, threads): for each thread, the addresses of the arguments of `first` in row 0 and of `second`
    in row 1, as `packed` returns these arguments. An address 0 in row 1 means that `second` has no work.
    """
    for thread in numba.prange(addresses.shape[1]):
        first(addresses[0, thread])
        if addresses[1, thread] != 0:
            second(addresses[1, thread])


@cache
def _by_address(kernel: Any) -> Any:
    """Return a kernel as a function that compiled code can call by its address."""
    return types.CompileResultWAP(kernel.overloads[_SIGNATURE.args])


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
    threads = 1 if _single_threaded or brief else len(calls[0][1])
    if COMPILED:  # compile in the calling thread, which Ctrl-C can interrupt; `halt` does not end a compilation
        for kernel, _ in calls:
            prepare(kernel, *_SIGNATURE.args)
        if threads > 1 and _FUNCTION is not None:
            if "OMP_WAIT_POLICY" not in os.environ:
                os.environ.setdefault("GOMP_SPINCOUNT", SPINS)  # read when the first sweep starts the threads
            prepare(run_on_threads, _FUNCTION, _FUNCTION, types.Array(types.int64, 2, "C"))
    watched = look is not None or halt.across or threading.get_ident() == threading.main_thread().ident
    if brief or (threads == 1 and not watched):
        _run(calls, threads, halt)
    else:
        _watch(lambda: _run(calls, threads, halt), halt, look)
    if halt.called:
        raise Halted


class _Worker:
    """A thread that runs one task after another.

    A worker is reused for later tasks, because OpenMP starts a team of threads for each thread that enters a parallel
    loop, and ends this team when the thread ends.
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


def _watch(work: Callable[[], None], halt: Halt, look: Callable[[], None] | None = None) -> None:
    """Run `work` in a worker thread and wait for its end. Meanwhile call `look` periodically.

    An interrupt of the calling thread halts the work.
    """
    worker = _workers.pop() if _workers else _Worker()
    worker.work = work
    worker.wanted.release()
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
    error, worker.error = worker.error, None
    _workers.append(worker)
    if error is not None:
        raise error


def _run(calls: Sequence[tuple[Any, Sequence[Arguments]]], threads: int, halt: Halt) -> None:
    if not COMPILED:
        for kernel, sets in calls:
            for arguments in sets:
                kernel(arguments)
        return
    tables = [packed(sets[:threads]) for _, sets in calls]

    def call(thread: int) -> None:
        for (kernel, _), table in zip(calls, tables):  # noqa: B905
            kernel(address_of(table) + table.strides[0] * thread)

    if threads == 1:
        call(0)
        return
    if _FUNCTION is None:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(call, range(threads)))
        return
    addresses = np.zeros((2, threads), np.int64)
    for row, table in zip(addresses, tables):  # noqa: B905
        row[:] = address_of(table) + table.strides[0] * np.arange(threads)
    functions = [_by_address(kernel) for kernel, _ in calls]
    while not _lock.acquire(timeout=LOOK):
        if halt.called:
            return
    try:
        numba.set_num_threads(threads)  # applies to this thread only
        run_on_threads(functions[0], functions[-1], addresses)
    finally:
        _lock.release()
