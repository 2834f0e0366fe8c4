"""Values in geometric progression, with the same bits on every processor."""

import math

import numpy as np


def geometric(low: float, high: float, num: int) -> np.ndarray:
    """Return `num` values from `low` to `high`, both > 0, whose ratios are equal, float64 (num,).

    `numpy.geomspace` takes another power function where the processor has AVX-512, and its values differ in the last
    bit. Disturbed motions near a limit would then differ, and a file begun there would not be continued here. These
    values are those of `numpy.geomspace` on other processors.

    >>> geometric(1.0, 8.0, 4).round(12).tolist()
    [1.0, 2.0, 4.0, 8.0]
    """
    exponents = np.linspace(math.log10(low), math.log10(high), num)
    values = np.array([10.0**x for x in exponents.tolist()])
    if num > 0:
        values[0] = low
    if num > 1:
        values[-1] = high
    return values
