"""A loop of `numba.prange` that calls kernels which Numba has compiled, on the threads of Numba.

The loop calls kernels by address (kernels/arguments.py), so it is compiled only once. If it called kernels by name,
Numba would compile each kernel a second time, together with the loop.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import typeof_impl

from vibrodrive.jit.compile import Kernel, jit
from vibrodrive.jit.compiler import OTHER_NUMBA, prepare_for
from vibrodrive.jit.slices import Halt

SPINS = "10000"
"""Number of times that an idle thread of GNU's OpenMP looks for work before it sleeps. By default it looks for some
milliseconds after each sweep. In a loop of short sweeps with pauses this doubles the CPU time, and takes a core from
other programs."""

_SIGNATURE = types.int64(types.int64)
_FUNCTION: Any = None  # for a Numba that calls no function by its address

with suppress(*OTHER_NUMBA):
    # copied from numba.experimental, whose import would take a fifth of a second
    typeof_impl.register(types.CompileResultWAP)(lambda kernel, context: _FUNCTION)
    _FUNCTION = types.FunctionType(_SIGNATURE)

_lock = threading.Lock()  # the layer `workqueue` aborts the process if two threads use it simultaneously


def _in_child() -> None:
    global _lock
    _lock = threading.Lock()


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


def works() -> bool:
    """Compile or load the loop. Return False for a Numba that cannot call functions by their addresses."""
    if _FUNCTION is None:
        return False
    if "OMP_WAIT_POLICY" not in os.environ:
        os.environ.setdefault("GOMP_SPINCOUNT", SPINS)  # read when the first sweep starts the threads
    prepare_for(run_on_threads.dispatcher, _FUNCTION, _FUNCTION, types.Array(types.int64, 2, "C"))
    return True


def run(kernels: Sequence[Kernel], addresses: np.ndarray, halt: Halt) -> None:
    """Run one or two kernels with the arguments at these addresses, int64 (2, threads), unless `halt` is called."""
    functions = [_by_address(kernel) for kernel in kernels]
    while not _lock.acquire(timeout=0.05):
        if halt.called:
            return
    try:
        numba.set_num_threads(addresses.shape[1])  # applies to this thread only
        run_on_threads.dispatcher(functions[0], functions[-1], addresses)
    finally:
        _lock.release()


@cache
def _by_address(kernel: Kernel) -> Any:
    """Return a kernel as a function that compiled code can call by its address."""
    return types.CompileResultWAP(kernel.dispatcher.overloads[_SIGNATURE.args])
