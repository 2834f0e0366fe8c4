"""Sine, versine (vers x = 1 - cos x), arcsine and logarithm in plain arithmetic.

Their bits are the same on every machine, with the JIT or without, which is not true of the functions of libm and NumPy.
Sine and versine have no branches, so loops over them vectorise. A multiple of π/2 is subtracted from the argument (Cody
and Waite). For this subtraction π/2 is the sum of two numbers, and a fused multiply-add computes each product exactly.
Then polynomials on [-π/4, π/4] are evaluated. The absolute error of the sine is below 1.4e-16 for |x| < 1.6e6.
"""

import math

import numpy as np

from vibrodrive.jit.branchless import ROUND, choose, flip, fma, low_bits
from vibrodrive.jit.compile import formula, inline

TWO_PI = 6.283185307179586
TWO_PI_LOW = 2.4492935982947064e-16  # 2π = TWO_PI + TWO_PI_LOW to 107 bits
HALF_PI = 1.5707963267948966
HALF_PI_LOW = 6.123233995736766e-17
PI = 3.141592653589793
PI_LOW = 1.2246467991473532e-16

_TO_QUADRANT = 0.6366197723675814  # 2/π

# coefficients of (sin r - r) / r³ and (vers r - r²/2) / r⁴: Chebyshev fits in r² over |r| < π/4 (mpmath's chebyfit),
# with relative errors 1.2e-16 and 3e-17. So sin r - r and vers r - r²/2 are accurate to the last bit for any small r
_S1, _S2, _S3 = -0.16666666666666666, 0.008333333333330948, -0.00019841269836756774
_S4, _S5, _S6 = 2.7557316101617874e-06, -2.505113165023518e-08, 1.5918115263265974e-10
_C1, _C2, _C3 = -0.041666666666666664, 0.0013888888888887398, -2.480158729876456e-05
_C4, _C5, _C6 = 2.7557317271145144e-07, -2.087614614655861e-09, 1.1382623647474604e-11


@formula
def arc(x):
    """Return (sin x, vers x, sin x - x, vers x - x²/2, near), where `near` is true if |x| < π/4.

    If `near`, all four numbers have full *relative* accuracy. Otherwise the two differences have no meaning. The
    differences are needed for a motion shortly after its start, where the subtraction sin x - x would lose all digits.
    """
    t = fma(x, _TO_QUADRANT, ROUND)
    k = t - ROUND
    r = fma(k, -HALF_PI_LOW, fma(k, -HALF_PI, x))
    z = r * r
    zz = z * z
    # the polynomials are computed in independent halves, because the longest chain of dependent operations determines
    # the time
    zzz = z * zz
    ds = (r * z) * fma(zzz, fma(zz, _S6, fma(z, _S5, _S4)), fma(z, fma(z, _S3, _S2), _S1))
    dv = zz * fma(zzz, fma(zz, _C6, fma(z, _C5, _C4)), fma(z, fma(z, _C3, _C2), _C1))
    sine = r + ds
    half = 0.5 * z
    versine = half + dv
    w = 1.0 - half
    cosine = w + (((1.0 - w) - half) - dv)  # the second term corrects the rounding of w = 1 - z/2
    quadrant = low_bits(t)  # k mod 4 in its last two bits
    odd = quadrant & 1 != 0
    s = flip(choose(odd, cosine, sine), quadrant)
    c = flip(choose(odd, sine, cosine), quadrant + 1)
    near = k == 0.0
    v = choose(near, versine, 1.0 - c)
    return s, v, ds, dv, near


@formula
def sincos(x):
    """Return (sin x, cos x)."""
    s, v, _, _, _ = arc(x)
    return s, 1.0 - v


@inline
def _asin_kernel(t):
    """Return asin(sqrt(t)) / sqrt(t) - 1 for 0 <= t <= 1/4, by the approximation of fdlibm (Sun Microsystems, 1993)."""
    p = 7.91534994289814532176e-04 + t * 3.47933107596021167570e-05
    p = 2.01212532134862925881e-01 + t * (-4.00555345006794114027e-02 + t * p)
    p = t * (1.66666666666666657415e-01 + t * (-3.25565818622400915405e-01 + t * p))
    q = -6.88283971605453293030e-01 + t * 7.70381505559019352791e-02
    q = 1.0 + t * (-2.40339491173441421878e00 + t * (2.02094576023350569471e00 + t * q))
    return p / q


@inline
def arcsine(y, short):
    """Return asin(y) for 0 <= y <= 1. The caller must compute short = 1 - y without cancellation."""
    if y < 0.5:
        return y + y * _asin_kernel(y * y)
    t = 0.5 * short
    root = math.sqrt(t)
    return HALF_PI - (2.0 * (root + root * _asin_kernel(t)) - HALF_PI_LOW)


_LN_2, _LN_2_LOW = 0.6931471803691238, 1.9082149292705877e-10  # whole multiples of the first up to 1100 are exact


@formula
def log(x):
    """Return the natural logarithm of x > 0. The powers of two are few for a number that is neither huge nor tiny."""
    if x == math.inf:
        return x
    k = 0.0
    while x > 1.4142135623730951:
        x, k = 0.5 * x, k + 1.0
    while x < 0.7071067811865476:
        x, k = 2.0 * x, k - 1.0
    f = x - 1.0
    s, half, r = f / (2.0 + f), 0.5 * f * f, 0.0
    for n in range(19, 2, -2):  # log x = f - f²/2 + s (f²/2 + 2 s²/3 + 2 s⁴/5 + …)
        r = s * s * (r + 2.0 / n)
    return k * _LN_2 - ((half - (s * (half + r) + k * _LN_2_LOW)) - f)


@inline
def two_product(a, b):
    """Return (p, e): p is a * b rounded, and p + e is exactly a * b."""
    p = a * b
    return p, fma(a, b, -p)


@inline
def arc_of_product(a, x):
    """Return the results of `arc` for the product a x, corrected for the rounding of this product.

    Without this correction the sine would have the rounding error of the product, about 10⁻¹¹ for an angle of 10⁵.
    """
    product, rest = two_product(a, x)
    s, v, ds, dv, near = arc(product)
    return fma(rest, 1.0 - v, s), fma(rest, s, v), ds, dv, near


@inline
def dot(a, x, b, y):
    """Return a x + b y, where only b y and the result are rounded."""
    return fma(a, x, b * y)


@inline
def turns(high, low):
    """Return (n, φ, δ) such that high + low = 2π n + φ + δ. `low` must be small compared with 2π.

    n is an integer as a float, 0 <= φ < 2π, and δ is the part of the phase below the last bit of φ. In the code, `rest`
    is exact except for -π < high < 0. There its rounding error is added to δ.
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
