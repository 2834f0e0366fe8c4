"""The bound that sine and cosine set: what one pair costs in a loop that vectorises, and from libm.

This is the one place in the benchmarks that looks inside vibrodrive: the bound is that of its own sine.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from benchmarks.common import paired
from vibrodrive.jit.trig import sincos

LANES = 64
PASSES = 20_000


@njit(error_model="numpy")
def _ours(x, s, c, passes):
    for k in range(passes):
        shift = 1e-4 * k
        for i in range(x.size):
            s[i], c[i] = sincos(x[i] + shift)


@njit(error_model="numpy")
def _libm(x, s, c, passes):
    for k in range(passes):
        shift = 1e-4 * k
        for i in range(x.size):
            s[i], c[i] = math.sin(x[i] + shift), math.cos(x[i] + shift)


def sincos_seconds(repeats: int = 5) -> dict[str, float]:
    """Seconds a pair: `ours` vectorised, `libm` as it comes."""
    x = np.linspace(0.0, 6.0, LANES)
    s, c = np.empty(LANES), np.empty(LANES)
    times = paired({"ours": lambda: _ours(x, s, c, PASSES), "libm": lambda: _libm(x, s, c, PASSES // 10)}, repeats)
    return {
        "ours": times["ours"].seconds / (LANES * PASSES),
        "libm": times["libm"].seconds / (LANES * (PASSES // 10)),
    }
