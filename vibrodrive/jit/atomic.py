"""Atomic access to integers that threads share.

These are the index of the next point, the flag that ends a kernel early, and the status that shows that a point is
finished.
"""

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


@intrinsic
def _store(typingctx, array, index, value):
    def codegen(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        item = context.cast(builder, args[2], signature.args[2], array.dtype)
        place = builder.gep(view.data, [args[1]])
        builder.store_atomic(item, place, "release", context.get_abi_sizeof(item.type))
        return context.get_dummy_value()

    if isinstance(array, types.Array) and array.ndim == 1 and isinstance(index, types.Integer):
        return types.void(array, types.int64, value), codegen
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


def publish(array, index, value):
    """Set array[index] so that a thread that reads the value also reads everything that this thread has written before.

    `array` contains integers and has one dimension.
    """
    array[index] = value


@overload(publish)
def _publish(array, index, value):
    return lambda array, index, value: _store(array, index, value)
