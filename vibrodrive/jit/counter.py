"""The next point for whichever thread is free: an atomic counter, so that no core idles while points remain."""

from __future__ import annotations

import threading

from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload


@intrinsic
def _fetch_add(typingctx, array):
    def codegen(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        return builder.atomic_rmw("add", view.data, ir.Constant(ir.IntType(64), 1), "monotonic")

    if isinstance(array, types.Array) and array.dtype == types.int64:
        return types.int64(array), codegen
    return None


_ONE_AT_A_TIME = threading.Lock()


def next_index(counter):
    """Return counter[0] and add one to it, as one operation. `counter` is int64 of length 1."""
    with _ONE_AT_A_TIME:
        value = int(counter[0])
        counter[0] += 1
    return value


@overload(next_index)
def _next_index(counter):
    return lambda counter: _fetch_add(counter)
