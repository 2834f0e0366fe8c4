"""Numba's side of the operations of branchless.py and atomic.py, each by the name of its function there.

This module is imported when a kernel is compiled.
"""

from contextlib import suppress

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from vibrodrive.jit.branchless import ROUND
from vibrodrive.jit.compiler import OTHER_NUMBA, processor

AVX512 = "+avx512dq" in processor()[2]
"""True if kernels are compiled for a processor with AVX-512: registers of eight lanes, and masks for stores."""

_INT = ir.IntType(64)
_ROUND_BITS = _INT(0x4338000000000000)  # those of the float ROUND


@intrinsic
def choose(typingctx, c, a, b):
    whole = isinstance(a, types.Integer) and isinstance(b, types.Integer)
    kind = types.boolean if a == b == types.boolean else (types.int64 if whole else types.float64)

    def codegen(context, builder, signature, args):
        sides = [
            context.cast(builder, value, given, kind) for value, given in zip(args[1:], signature.args[1:], strict=True)
        ]
        return builder.select(context.cast(builder, args[0], signature.args[0], types.boolean), *sides)

    return kind(c, a, b), codegen


@intrinsic
def held(typingctx, x):
    def codegen(context, builder, signature, args):
        if AVX512:
            return args[0]
        with suppress(*OTHER_NUMBA):
            frozen = ir.instructions.Instruction(builder.block, args[0].type, "freeze", args)
            builder._insert(frozen)
            return frozen
        return args[0]

    return x(x), codegen


@intrinsic
def low_bits(typingctx, t):
    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], _INT)

    return types.int64(types.float64), codegen


@intrinsic
def _whole(typingctx, x):
    def codegen(context, builder, signature, args):
        return builder.sub(builder.bitcast(builder.fadd(args[0], ir.DoubleType()(ROUND)), _INT), _ROUND_BITS)

    return types.int64(types.float64), codegen


@intrinsic
def _real(typingctx, n):
    def codegen(context, builder, signature, args):
        shifted = builder.bitcast(builder.add(args[0], _ROUND_BITS), ir.DoubleType())
        return builder.fsub(shifted, ir.DoubleType()(ROUND))

    return types.float64(types.int64), codegen


whole = int if AVX512 else _whole
real = float if AVX512 else _real


@intrinsic
def flip(typingctx, x, bits):
    def codegen(context, builder, signature, args):
        sign = builder.and_(builder.shl(args[1], _INT(62)), _INT(-(2**63)))
        return builder.bitcast(builder.xor(builder.bitcast(args[0], _INT), sign), ir.DoubleType())

    return types.float64(types.float64, types.int64), codegen


@intrinsic
def fma(typingctx, a, b, c):
    def codegen(context, builder, signature, args):
        given = zip(args, signature.args, strict=True)
        return builder.fma(*(context.cast(builder, value, kind, types.float64) for value, kind in given))

    return types.float64(a, b, c), codegen


@intrinsic
def wide(typingctx):
    def codegen(context, builder, signature, args):
        with suppress(*OTHER_NUMBA):
            for attribute in ('"prefer-vector-width"="512"', '"stackrealign"'):
                set.add(builder.function.attributes, attribute)  # llvmlite's `add` refuses these names
        return context.get_dummy_value()

    return types.none(), codegen


def _is_counter(array):
    return isinstance(array, types.Array) and array.dtype == types.int64


@intrinsic
def next_index(typingctx, counter):
    def codegen(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        return builder.atomic_rmw("add", view.data, _INT(1), "monotonic")

    return (types.int64(counter), codegen) if _is_counter(counter) else None


@intrinsic
def is_set(typingctx, flag):
    def codegen(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        # atomic, so that each call reads memory, not a register
        return builder.icmp_signed("!=", builder.load_atomic(view.data, "monotonic", 8), _INT(0))

    return (types.boolean(flag), codegen) if _is_counter(flag) else None


@intrinsic
def publish(typingctx, array, index, value):
    def codegen(context, builder, signature, args):
        view = context.make_array(signature.args[0])(context, builder, args[0])
        item = context.cast(builder, args[2], signature.args[2], array.dtype)
        place = builder.gep(view.data, [args[1]])
        builder.store_atomic(item, place, "release", context.get_abi_sizeof(item.type))
        return context.get_dummy_value()

    if isinstance(array, types.Array) and array.ndim == 1 and isinstance(index, types.Integer):
        return types.void(array, types.int64, value), codegen
    return None
