"""Sine and versine in plain arithmetic: without branches, so that loops over them vectorise, and with the same bits on
every machine, with the JIT or without.

Cody-Waite reduction by π/2 in two parts, each product exact inside a fused multiply-add, then polynomials on
[-π/4, π/4]. Absolute error of the sine below 1.4e-16 for |x| < 1.6e6.
"""

from __future__ import annotations

import math

import numpy as np

from vibrodrive.jit.branchless import ROUND, choose, flip, fma, low_bits
from vibrodrive.jit.compile import inline

TWO_PI = 6.283185307179586
TWO_PI_LOW = 2.4492935982947064e-16  # 2π = TWO_PI + TWO_PI_LOW to 107 bits
HALF_PI = 1.5707963267948966
HALF_PI_LOW = 6.123233995736766e-17
PI = 3.141592653589793
PI_LOW = 1.2246467991473532e-16

_TO_QUADRANT = 0.6366197723675814  # 2/π

# (sin r - r) / r³ and (vers r - r²/2) / r⁴ as Chebyshev fits in r² over |r| < π/4 (mpmath's chebyfit):
# relative errors 1.2e-16 and 3e-17, so the differences stay good to the last bit however small r is
_S1, _S2, _S3 = -0.16666666666666666, 0.008333333333330948, -0.00019841269836756774
_S4, _S5, _S6 = 2.7557316101617874e-06, -2.505113165023518e-08, 1.5918115263265974e-10
_C1, _C2, _C3 = -0.041666666666666664, 0.0013888888888887398, -2.480158729876456e-05
_C4, _C5, _C6 = 2.7557317271145144e-07, -2.087614614655861e-09, 1.1382623647474604e-11


@inline
def arc(x):
    """Return (sin x, vers x, sin x - x, vers x - x²/2, near) with vers x = 1 - cos x and near = |x| < π/4.

    All four have full *relative* accuracy if `near`; the two differences are meaningless otherwise. They describe a
    motion shortly after its start, where sin x - x would lose all digits by cancellation.
    """
    t = fma(x, _TO_QUADRANT, ROUND)
    k = t - ROUND
    r = fma(k, -HALF_PI_LOW, fma(k, -HALF_PI, x))
    z = r * r
    zz = z * z
    # independent halves of the polynomials: the longest chain of operations determines the time, not their number
    zzz = z * zz
    ds = (r * z) * fma(zzz, fma(zz, _S6, fma(z, _S5, _S4)), fma(z, fma(z, _S3, _S2), _S1))
    dv = zz * fma(zzz, fma(zz, _C6, fma(z, _C5, _C4)), fma(z, fma(z, _C3, _C2), _C1))
    sine = r + ds
    half = 0.5 * z
    versine = half + dv
    w = 1.0 - half
    cosine = w + (((1.0 - w) - half) - dv)  # corrected for the rounding of 1 - z/2
    quadrant = low_bits(t)  # k mod 4 in its last two bits
    odd = quadrant & 1 != 0
    s = flip(choose(odd, cosine, sine), quadrant)
    c = flip(choose(odd, sine, cosine), quadrant + 1)
    near = k == 0.0
    v = choose(near, versine, 1.0 - c)
    return s, v, ds, dv, near


@inline
def sincos(x):
    """Return (sin x, cos x)."""
    s, v, _, _, _ = arc(x)
    return s, 1.0 - v


@inline
def _asin_kernel(t):
    """Return asin(sqrt(t)) / sqrt(t) - 1 for 0 <= t <= 1/4: approximation of fdlibm (Sun Microsystems, 1993)."""
    p = 7.91534994289814532176e-04 + t * 3.47933107596021167570e-05
    p = 2.01212532134862925881e-01 + t * (-4.00555345006794114027e-02 + t * p)
    p = t * (1.66666666666666657415e-01 + t * (-3.25565818622400915405e-01 + t * p))
    q = -6.88283971605453293030e-01 + t * 7.70381505559019352791e-02
    q = 1.0 + t * (-2.40339491173441421878e00 + t * (2.02094576023350569471e00 + t * q))
    return p / q


@inline
def arcsine(y, short):
    """Return asin(y) for 0 <= y <= 1; short = 1 - y, which the caller can form without cancellation."""
    if y < 0.5:
        return y + y * _asin_kernel(y * y)
    t = 0.5 * short
    root = math.sqrt(t)
    return HALF_PI - (2.0 * (root + root * _asin_kernel(t)) - HALF_PI_LOW)


@inline
def two_product(a, b):
    """Return a * b exactly, as an unevaluated sum of two numbers."""
    p = a * b
    return p, fma(a, b, -p)


@inline
def arc_of_product(a, x):
    """Return `arc` of a x, corrected for the rounding of the product.

    For an angle of 10⁵ this rounding is 10⁻¹¹, which is too large an error of its sine.
    """
    product, rest = two_product(a, x)
    s, v, ds, dv, near = arc(product)
    return fma(rest, 1.0 - v, s), fma(rest, s, v), ds, dv, near


@inline
def dot(a, x, b, y):
    """Return a x + b y with one rounding less."""
    return fma(a, x, b * y)


@inline
def turns(high, low):
    """Return (n, φ, δ) with high + low = 2π n + φ + δ: n an integer as a float, 0 <= φ < 2π, δ the low-order part of φ.

    `low` must be small compared with 2π. `rest` is exact except for -π < high < 0, where its rounding goes to δ.
    """
    n = np.floor(high * (1.0 / TWO_PI))
    p, e = two_product(n, TWO_PI)
    rest = high - p
    small = low - fma(n, TWO_PI_LOW, e) + (high - (p + rest))
    below = rest + small < 0.0
    n = n - 1.0 if below else n
    small = small + TWO_PI_LOW if below else small
    rest = rest + TWO_PI if below else rest
    phase = rest + small
    delta = small - (phase - rest)
    above = phase >= TWO_PI
    n = n + 1.0 if above else n
    delta = delta - TWO_PI_LOW if above else delta
    phase = phase - TWO_PI if above else phase
    return n, phase, delta
