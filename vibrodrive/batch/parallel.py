"""Kernels on threads: a loop of `numba.prange`, which Ctrl-C ends within a second.

Each thread runs the kernel with its own lanes and takes points from a shared counter, so that points of unequal cost
keep all cores busy. The loop calls kernels by address (kernels/arguments.py), so it is compiled once for all kernels; a
call by name would compile each kernel a second time together with the loop.

Compiled code cannot be interrupted. Therefore it runs in a separate thread, while the calling thread waits and can be
interrupted. The kernels end when a flag in memory is set.
"""

from __future__ import annotations

import os
import threading
from _thread import start_new_thread
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import typeof_impl

from vibrodrive.jit.compile import jit, prepare
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.kernels.arguments import Arguments, packed

LOOK = 0.05
"""Seconds between two checks for an early end of the computation: Ctrl-C, or a halt from another process."""

BRIEF = 1 << 14
"""Work up to which no thread is started, in undisturbed periods (model/plan.py): a few milliseconds on one thread."""

FORK_SAFE = "tbb", "workqueue"
"""Threading layers of Numba that work in a forked child of a process that has used them. With GNU's OpenMP the child
is aborted."""

_SIGNATURE = types.int64(types.int64)
_FUNCTION = types.FunctionType(_SIGNATURE)

# copied from numba.experimental, which takes a fifth of a second to import
typeof_impl.register(types.CompileResultWAP)(lambda kernel, context: _FUNCTION)

_COMPILES = not numba.config.DISABLE_JIT  # type: ignore[attr-defined]

_lock = threading.Lock()  # the layer `workqueue` aborts the process if two threads use it simultaneously
_alone = False
_workers: list[_Worker] = []
"""Idle threads."""


def _in_child() -> None:
    """Record in a forked child if the threading layer started by its parent fails there."""
    global _lock, _alone
    _lock = threading.Lock()
    _workers.clear()
    try:
        _alone = numba.threading_layer() not in FORK_SAFE
    except ValueError:  # no layer was started
        _alone = False


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_in_child)


@jit(parallel=True)
def run_on_threads(first, second, addresses):
    """Call `first` with each address in addresses[0], then `second` with that in addresses[1]; one thread a column.

    addresses : int64 (2, threads), as from `packed`; 0 if `second` has no work.
    """
    for thread in numba.prange(addresses.shape[1]):
        first(addresses[0, thread])
        if addresses[1, thread] != 0:
            second(addresses[1, thread])


@cache
def _by_address(kernel: Any) -> types.CompileResultWAP:
    """Return a kernel as a function that compiled code can call by its address."""
    return types.CompileResultWAP(kernel.overloads[_SIGNATURE.args])


def run(calls: Sequence[tuple[Any, Sequence[Arguments]]], halt: Halt, *, brief: bool = False) -> None:
    """Run one or two kernels, each with a set of arguments for each thread. All have ended when it returns or raises.

    Work that is `brief` runs in this thread, with the first set of arguments only: the start of threads would take
    longer. Raises Halted if `halt` is called.
    """
    threads = 1 if _alone or brief else len(calls[0][1])
    if _COMPILES:  # in this thread, which Ctrl-C can interrupt; the flag cannot halt the compiler
        for kernel, _ in calls:
            prepare(kernel, *_SIGNATURE.args)
        if threads > 1:
            prepare(run_on_threads, _FUNCTION, _FUNCTION, types.Array(types.int64, 2, "C"))
    here = brief or (threads == 1 and not halt.across and threading.get_ident() != threading.main_thread().ident)
    if here:
        _run(calls, threads, halt)
    else:
        _watch(lambda: _run(calls, threads, halt), halt)
    if halt.called:
        raise Halted


class _Worker:
    """A thread that runs one task after another.

    It is kept for later tasks, since OpenMP starts a team of threads for each thread that enters a loop, and ends the
    team with that thread.
    """

    def __init__(self) -> None:
        self.work: Callable[[], None]
        self.error: BaseException | None = None
        self.wanted, self.ended = threading.Lock(), threading.Lock()
        self.wanted.acquire()
        self.ended.acquire()
        start_new_thread(self._serve, ())  # not a Thread, which the interpreter would join at exit

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
    """Task of an idle worker. It keeps no arrays alive."""


def _watch(work: Callable[[], None], halt: Halt) -> None:
    """Call `work` in a separate thread. An interrupt of this thread halts it."""
    worker = _workers.pop() if _workers else _Worker()
    worker.work = work
    worker.wanted.release()
    try:
        while not worker.ended.acquire(timeout=LOOK):
            if halt.called:
                halt.call()  # the kernels read the flag of this process only
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
    if not _COMPILES:
        for kernel, sets in calls:
            for arguments in sets:
                kernel(arguments)
        return
    tables = [packed(sets[:threads]) for _, sets in calls]
    addresses = np.zeros((2, threads), np.int64)
    for row, table in zip(addresses, tables):  # noqa: B905
        row[:] = table.ctypes.data + table.strides[0] * np.arange(threads)
    if threads == 1:
        for (kernel, _), row in zip(calls, addresses):  # noqa: B905
            kernel(int(row[0]))
        return
    functions = [_by_address(kernel) for kernel, _ in calls]
    while not _lock.acquire(timeout=LOOK):
        if halt.called:
            return
    try:
        numba.set_num_threads(threads)  # applies to this thread only
        run_on_threads(functions[0], functions[-1], addresses)
    finally:
        _lock.release()
