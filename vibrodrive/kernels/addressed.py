"""Numba's side of `arguments_at` (arguments.py): the arrays of a kernel from the integers that describe them.

This module is imported when a kernel is compiled.
"""

from itertools import count

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from vibrodrive.jit.compiler import OTHER_NUMBA
from vibrodrive.kernels.arguments import CELLS, KINDS, Arguments


@intrinsic
def _at_address(typingctx, address):
    arrays = [numba.typeof(np.empty((0,) * dimensions, dtype)) for _, dtype, dimensions in KINDS]
    result = types.NamedTuple(arrays, Arguments)

    def codegen(context, builder, signature, args):
        integer = ir.IntType(64)
        cells = builder.inttoptr(args[0], integer.as_pointer())
        numbers = count()

        def cell():
            return builder.load(builder.gep(cells, [integer(next(numbers))]))

        found = []
        for kind in arrays:
            array = context.make_array(kind)(context, builder)
            data, shape = cell(), [cell() for _ in range(kind.ndim)]
            itemsize = integer(context.get_abi_sizeof(context.get_data_type(kind.dtype)))
            strides = [itemsize]
            for length in reversed(shape[1:]):
                strides.insert(0, builder.mul(strides[0], length))
            pointer = builder.inttoptr(data, array.data.type)
            populate_array(array, data=pointer, shape=shape, strides=strides, itemsize=itemsize, meminfo=None)
            found.append(array._getvalue())
        return context.make_tuple(builder, result, found)

    return result(types.int64), codegen


@intrinsic
def _pointer(typingctx, address):
    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], ir.IntType(8).as_pointer())

    return types.voidptr(types.int64), codegen


def _by_carray():
    """Return a function like `_at_address`, for a Numba without `populate_array`.

    Its source is made here, because Numba compiles no loop over arrays of several types.
    """
    cells, arrays = count(), []
    for k, (_, _, dimensions) in enumerate(KINDS):
        data, *shape = (f"cells[{next(cells)}]" for _ in range(1 + dimensions))
        arrays.append(f"carray(pointer({data}), ({', '.join(shape)},), dtype{k})")
    source = (
        "def arguments(address):\n"
        f" cells = carray(pointer(address), ({CELLS},), int64)\n"
        f" return Arguments({', '.join(arrays)})\n"
    )
    names = {f"dtype{k}": dtype for k, (_, dtype, _) in enumerate(KINDS)}
    names |= {"carray": numba.carray, "pointer": _pointer, "int64": np.int64, "Arguments": Arguments}
    exec(source, names)
    return names["arguments"]


try:
    from numba.np.arrayobj import populate_array

    arguments_at = _at_address
except OTHER_NUMBA:
    arguments_at = numba.njit(_by_carray())
