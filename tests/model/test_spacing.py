"""Values in geometric progression, compared with their exact values."""

from decimal import Decimal, localcontext

import numpy as np
import pytest

from vibrodrive.model import spacing


@pytest.mark.parametrize(("low", "high", "num"), [(1e-6, 1e-3, 9), (0.0028, 0.0033, 9), (1e3, 2.5, 100), (7.0, 7.0, 3)])
def test_values_are_those_of_exact_arithmetic(low, high, num):
    with localcontext(prec=40):
        ratio = Decimal(high) / Decimal(low)
        exact = [float(Decimal(low) * ratio ** (Decimal(k) / (num - 1))) for k in range(num)]
    values = spacing.geometric(low, high, num)
    assert np.abs(values / exact - 1.0).max() < 4e-15
    assert (values[0], values[-1]) == (low, high)


@pytest.mark.parametrize(("num", "values"), [(0, []), (1, [2.0]), (2, [2.0, 3.0])])
def test_few_values(num, values):
    assert spacing.geometric(2.0, 3.0, num).tolist() == values
