"""Atomic access to integers that threads share: the index of the next point, and the flag that ends a kernel early."""

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


@intrinsic
def _load(typingctx, array):
    def codegen(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        return builder.load_atomic(view.data, "monotonic", 8)  # atomic, so that each call reads memory, not a register

    if isinstance(array, types.Array) and array.dtype == types.int64:
        return types.int64(array), codegen
    return None


_ONE_AT_A_TIME = threading.Lock()


def next_index(counter):
    """Add 1 to counter[0] and return its earlier value, in one atomic operation. `counter` is int64 of length 1."""
    with _ONE_AT_A_TIME:
        value = int(counter[0])
        counter[0] += 1
    return value


@overload(next_index)
def _next_index(counter):
    return lambda counter: _fetch_add(counter)


def is_set(flag):
    """Return True if flag[0] is not zero. Another thread may set the flag. `flag` is int64 of length 1."""
    return flag[0] != 0


@overload(is_set)
def _is_set(flag):
    return lambda flag: _load(flag) != 0
