"""LLVM operations for loops over lanes: selection without a branch, fused multiply-add, sign bits, wide registers.

A lane is the memory of one motion in arrays with many motions (kernels/lane.py).

Each operation also has a version in plain Python, which is used if the JIT is disabled and gives the same bits.
"""

import ctypes
import os
from contextlib import suppress
from typing import Any

from llvmlite import ir
from numba import config, types
from numba.extending import intrinsic

from vibrodrive.jit.compile import OTHER_NUMBA, inline, processor

_INT = ir.IntType(64)

COMPILED = not config.DISABLE_JIT  # type: ignore[attr-defined]

AVX512 = "+avx512dq" in processor()[2]
"""True if kernels are compiled for a processor with AVX-512: registers of eight lanes, and masks for stores."""

ROUND = 6755399441055744.0  # 1.5 * 2**52: (x + ROUND) - ROUND is x rounded to the nearest integer


def _choose(c, a, b):
    return a if c else b


@intrinsic
def _select(typingctx, c, a, b):
    whole = isinstance(a, types.Integer) and isinstance(b, types.Integer)
    kind = types.boolean if a == b == types.boolean else (types.int64 if whole else types.float64)

    def codegen(context, builder, signature, args):
        sides = [
            context.cast(builder, value, given, kind) for value, given in zip(args[1:], signature.args[1:], strict=True)
        ]
        return builder.select(context.cast(builder, args[0], signature.args[0], types.boolean), *sides)

    return kind(c, a, b), codegen


@inline
def _same(x):
    return x


@intrinsic
def _freeze(typingctx, x):
    def codegen(context, builder, signature, args):
        with suppress(*OTHER_NUMBA):
            frozen = ir.instructions.Instruction(builder.block, args[0].type, "freeze", args)
            builder._insert(frozen)
            return frozen
        return args[0]

    return x(x), codegen


def _low_bits(t):
    return int(t - ROUND)


@intrinsic
def _bits(typingctx, t):
    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], _INT)

    return types.int64(types.float64), codegen


_ROUND_BITS = _INT(0x4338000000000000)  # those of the float ROUND


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


def _flip(x, bits):
    return -x if bits & 2 else x


@intrinsic
def _xor_sign(typingctx, x, bits):
    def codegen(context, builder, signature, args):
        sign = builder.and_(builder.shl(args[1], _INT(62)), _INT(-(2**63)))
        return builder.bitcast(builder.xor(builder.bitcast(args[0], _INT), sign), ir.DoubleType())

    return types.float64(types.float64, types.int64), codegen


@intrinsic
def _fused(typingctx, a, b, c):
    def codegen(context, builder, signature, args):
        given = zip(args, signature.args, strict=True)
        return builder.fma(*(context.cast(builder, value, kind, types.float64) for value, kind in given))

    return types.float64(a, b, c), codegen


def _libm_fma():
    """Return `fma` of the C library. `math.fma` (Python 3.13) raises an error instead of returning infinity or NaN."""
    function = ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fma
    function.argtypes, function.restype = 3 * [ctypes.c_double], ctypes.c_double
    return function


def _nothing():
    pass


@intrinsic
def _prefer_wide(typingctx):
    def codegen(context, builder, signature, args):
        with suppress(*OTHER_NUMBA):
            for attribute in ('"prefer-vector-width"="512"', '"stackrealign"'):
                set.add(builder.function.attributes, attribute)  # llvmlite's `add` refuses these names
        return context.get_dummy_value()

    return types.none(), codegen


choose: Any = _select if COMPILED else _choose
"""choose(c, a, b): a if c else b, where both a and b are computed. From `a if c else b` the compiler would make a
branch, and would move the computation of a and b into its two sides. If such a computation reads an address that
depends on the lane, the loop does not vectorise."""

fma: Any = _fused if COMPILED else _libm_fma()
"""fma(a, b, c): a b + c, rounded once. It is one instruction instead of two, with the same bits on every machine. The
compiler must not choose which products to fuse (fastmath), because its choice would differ between the kernels of
single motions and of batches."""

held: Any = _freeze if COMPILED and not AVX512 else _same  # held(x): x, which LLVM does not recognise as x

low_bits: Any = _bits if COMPILED else _low_bits
"""low_bits(t): an integer with the same last bits as the integer n, where t = n + ROUND."""

whole: Any = _whole if COMPILED and not AVX512 else int
"""whole(x): the integer x, given as a float below 2**51. Only AVX-512 has an instruction that converts integers of 64
bits in all lanes. This operation, and `real`, need only an addition and a subtraction."""

real: Any = _real if COMPILED and not AVX512 else float  # real(n): the integer n, below 2**51, as a float

flip: Any = _xor_sign if COMPILED else _flip  # flip(x, bits): -x if the second-lowest bit of `bits` is set, else x

wide: Any = _prefer_wide if COMPILED else _nothing
"""wide(): compile the calling function for the widest registers of the processor. By default LLVM uses half this width,
because wide registers slow down code that is not vectorised. The stack is aligned for these registers, so that each
value stored on the stack is in one cache line."""


@inline
def put(rows, at, where, value):
    """Set rows[at] to `value` if `where` is true.

    LLVM makes a masked store of such a selection. With AVX-512 this is fast. With AVX2 on processors of AMD it takes
    four times as long as reading, selecting and storing, and `held` prevents it.
    """
    rows[at] = choose(where, value, held(rows[at]))


@inline
def full(n):
    """Return the number of lanes of a loop if n lanes are in use.

    This number is n rounded up to full registers of eight lanes, because a separate loop over the remaining lanes would
    cost more. Lanes >= n are padding; their contents are ignored.
    """
    return (n + 7) & -8 if COMPILED and n > 3 else n
