"""A mass that never lands has the mean velocity of Blekhman's law, with a correction that is known exactly."""

import pytest

from examples.free_sliding import exact, law, measure


@pytest.mark.jit
@pytest.mark.parametrize(("A", "B"), [(10.0, 0.1), (100.0, 0.1), (30.0, 0.5), (30.0, 0.8)])
def test_mean_velocity_is_the_derived_one(A, B):
    mean = measure(A, B)
    assert mean == pytest.approx(exact(A, B), rel=1e-9)
    assert 0 < (1 - mean / law(A, B)) * A**2 < 2
