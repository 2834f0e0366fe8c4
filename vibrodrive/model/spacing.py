"""Values in geometric progression, with the same bits on every machine.

The last bits of the functions of libm and NumPy depend on the processor and on the version; `decimal` rounds correctly.
"""

from decimal import Context, Decimal

import numpy as np

DIGITS = Context(prec=30)
LN_10 = 2.302585092994046


def geometric(low: float, high: float, num: int) -> np.ndarray:
    """Return `num` values from `low` to `high`, both > 0, whose ratios are equal, float64 (num,).

    >>> geometric(1.0, 8.0, 4).round(12).tolist()
    [1.0, 2.0, 4.0, 8.0]
    """
    first, last = (float(DIGITS.log10(Decimal(end))) for end in (low, high))
    values = _powers_of_10(np.linspace(first, last, num))
    if num > 0:
        values[0] = low
    if num > 1:
        values[-1] = high
    return values


def _powers_of_10(x: np.ndarray) -> np.ndarray:
    """Return 10**x for each value of x, with an error below 0.6 in the last place. Whole powers are exact."""
    near, inverse = np.unique(np.rint(32.0 * x) / 32.0, return_inverse=True)
    exact = [DIGITS.power(10, Decimal(exponent)) for exponent in near.tolist()]
    head = np.array([float(value) for value in exact])
    tail = np.array([float(DIGITS.subtract(value, Decimal(float(value)))) for value in exact])
    t, expm1 = LN_10 * (x - near[inverse]), np.zeros_like(x)
    for n in range(8, 0, -1):  # e**t - 1 = t (1 + t/2 (1 + t/3 (…)))
        expm1 = t / n * (1.0 + expm1)
    return head[inverse] + (tail[inverse] + head[inverse] * expm1)
