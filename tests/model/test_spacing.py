"""Values in geometric progression: their exact values, and no function of NumPy that depends on the processor."""

import math
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


def test_no_power_is_taken_by_numpy(monkeypatch):
    expected = [10.0**x for x in np.linspace(math.log10(1e-6), math.log10(0.3), 50).tolist()][1:-1]
    for name in ("power", "log10", "exp", "log", "geomspace", "logspace"):
        monkeypatch.setattr(np, name, None)
    assert spacing.geometric(1e-6, 0.3, 50)[1:-1].tolist() == expected
