"""LLVM operations for loops over lanes: selection without a branch, fused multiply-add, sign bits, wide registers.

Each has a version in plain Python that gives the same bits. It is used if the JIT is disabled.
"""

from __future__ import annotations

import ctypes
import os
from typing import Any

from llvmlite import ir
from numba import config, types
from numba.extending import intrinsic

from vibrodrive.jit.compile import inline

_INT = ir.IntType(64)

ROUND = 6755399441055744.0  # 1.5 * 2**52: adding and subtracting it rounds to the nearest integer


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


def _low_bits(t):
    return int(t - ROUND)


@intrinsic
def _bits(typingctx, t):
    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], _INT)

    return types.int64(types.float64), codegen


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
    """Return `fma` of the C library. `math.fma` (Python 3.13) raises where this gives an infinity or a NaN."""
    function = ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fma
    function.argtypes, function.restype = 3 * [ctypes.c_double], ctypes.c_double
    return function


def _nothing():
    pass


@intrinsic
def _prefer_wide(typingctx):
    def codegen(context, builder, signature, args):
        for attribute in ('"prefer-vector-width"="512"', '"stackrealign"'):
            set.add(builder.function.attributes, attribute)  # llvmlite's `add` refuses these names
        return context.get_dummy_value()

    return types.none(), codegen


COMPILED = not config.DISABLE_JIT  # type: ignore[attr-defined]

choose: Any = _select if COMPILED else _choose
"""choose(c, a, b): a if c else b, with both computed. In a branch, the compiler would move operations into the side
that needs them. A read that is moved in this way, and whose address depends on the lane, prevents vectorisation of the
loop."""

fma: Any = _fused if COMPILED else _libm_fma()
"""fma(a, b, c): a b + c, rounded once: one instruction instead of two, and the same bits on every machine. The compiler
must not choose which products to fuse (fastmath): its choice would differ between the kernels of single motions and of
batches."""

low_bits: Any = _bits if COMPILED else _low_bits
"""low_bits(t): an integer whose last bits are those of the integer n in t = n + ROUND."""

flip: Any = _xor_sign if COMPILED else _flip  # flip(x, bits): -x if the second-lowest bit of `bits` is set, else x

wide: Any = _prefer_wide if COMPILED else _nothing
"""wide(): compile the calling function for the widest registers of the processor. LLVM's default is half that width, to
protect code that is not vectorised; loops over lanes are vectorised. The stack is aligned for these registers, so that
each access to a spilled value stays in one cache line."""


@inline
def full(n):
    """Return the number of lanes to loop over if n are in use: n rounded up to a full register, since a remainder loop
    costs more than eight lanes.

    Lanes from n on are padding; their contents are ignored.
    """
    return (n + 7) & -8 if COMPILED and n > 3 else n
