"""Tests of the convergents of Δτ/2π: pairs of a number of steps and a nearly equal number of periods.

Some are known, and no smaller number of periods is a better approximation.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibrodrive.stability.commensurability import closing, convergents, returning


def test_grid_of_fig_12_nearly_closes_after_six_periods():
    found = {(c.steps, c.periods): c.miss for c in convergents(0.1)}
    assert found[377, 6] == pytest.approx(37.7 - 12 * math.pi, abs=1e-12)
    assert list(found) == [(62, 1), (63, 1), (314, 5), (377, 6), (6723, 107), (7100, 113)]


@given(dtau=st.floats(1e-3, 20.0))
def test_convergents_are_the_closest_approximations(dtau):
    miss = closing(dtau, 200)
    for c in convergents(dtau, 200):
        assert c.steps * dtau - c.periods * 2 * math.pi == pytest.approx(c.miss, abs=1e-9)
        if c.periods > 1:
            assert abs(c.miss) == pytest.approx(miss[c.periods - 1], abs=1e-9)
            assert abs(c.miss) <= miss[: c.periods].min() + 1e-9


def test_step_that_divides_the_period_closes_after_one_period():
    miss = {(c.steps, c.periods): c.miss for c in convergents(2 * math.pi / 50, 1000)}
    assert abs(miss[50, 1]) < 1e-14


@pytest.mark.parametrize(("dtau", "longest"), [(0.0, 10), (-1.0, 10), (math.nan, 10), (0.1, 0)])
def test_values_out_of_range_are_named(dtau, longest):
    with pytest.raises(ValueError, match="must be"):
        convergents(dtau, longest)


def test_returning_ignores_single_outliers():
    section = np.tile(np.array([[0.0, 1.0], [1.0, 0.0], [2.0, 3.0]]), (100, 1))
    section[150] += 5.0
    assert np.flatnonzero(returning(section, 10) == 0).tolist() == [2, 5, 8]
