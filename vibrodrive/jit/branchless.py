"""LLVM operations for loops over lanes: selection without a branch, fused multiply-add, sign bits, wide registers.

A lane is the memory of one motion in arrays with many motions (kernels/lane.py).

Each operation here is a version in plain Python, which is used if the JIT is disabled, and a version of the same bits
for Numba in operations.py.
"""

import ctypes
import os

from vibrodrive.jit.compile import COMPILED, OPERATIONS, inline, operation

ROUND = 6755399441055744.0  # 1.5 * 2**52: (x + ROUND) - ROUND is x rounded to the nearest integer

_fma = ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fma
"""`fma` of the C library. `math.fma` (Python 3.13) raises an error instead of returning infinity or NaN."""
_fma.argtypes, _fma.restype = 3 * [ctypes.c_double], ctypes.c_double


@operation(OPERATIONS)
def choose(c, a, b):
    """Return a if c else b, where both a and b are computed.

    From `a if c else b` the compiler would make a branch, and would move the computation of a and b into its two sides.
    If such a computation reads an address that depends on the lane, the loop does not vectorise.
    """
    return a if c else b


@operation(OPERATIONS)
def fma(a, b, c):
    """Return a b + c, rounded once: one instruction instead of two, with the same bits on every machine.

    The compiler must not choose which products to fuse (fastmath), because its choice would differ between the kernels
    of single motions and of batches.
    """
    return _fma(a, b, c)


@operation(OPERATIONS)
def held(x):
    """Return x, which LLVM does not recognise as x, except with AVX-512."""
    return x


@operation(OPERATIONS)
def low_bits(t):
    """Return an integer with the same last bits as the integer n, where t = n + ROUND."""
    return int(t - ROUND)


@operation(OPERATIONS)
def whole(x):
    """Return the integer x, given as a float below 2**51.

    Only AVX-512 has an instruction that converts integers of 64 bits in all lanes. This operation, and `real`, need
    only an addition and a subtraction.
    """
    return int(x)


@operation(OPERATIONS)
def real(n):
    """Return the integer n, below 2**51, as a float."""
    return float(n)


@operation(OPERATIONS)
def flip(x, bits):
    """Return -x if the second-lowest bit of `bits` is set, else x."""
    return -x if bits & 2 else x


@operation(OPERATIONS)
def wide():
    """Compile the calling function for the widest registers of the processor.

    By default LLVM uses half this width, because wide registers slow down code that is not vectorised. The stack is
    aligned for these registers, so that each value stored on the stack is in one cache line.
    """


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
