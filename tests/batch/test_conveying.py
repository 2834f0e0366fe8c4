"""The mean velocity without an obstacle equals a closed form for large A, or is unknown."""

import math

import pytest

from vibrodrive.batch import conveying
from vibrodrive.batch.conveying import conveying_velocity


@pytest.mark.jit
@pytest.mark.parametrize("A", [100.0, 800.0, 3388.0, 80821.0])
@pytest.mark.parametrize("B", [0.0, 0.1, 0.44, 1.0])
def test_velocity_of_a_strong_excitation_is_the_closed_form(A, B):
    """From rest the motion needs many times A/4 periods. After 1000 it was 57 % off at A = 3388, and up the incline at
    A = 80821. The remaining terms of the closed form are of order 1/A."""
    assert conveying_velocity(A, B) == pytest.approx(-A * math.sin(math.pi * B / 2), rel=2 / A**2 + 1e-6, abs=1e-9 * A)


@pytest.mark.jit
def test_velocity_that_has_not_settled_is_unknown(monkeypatch):
    assert conveying_velocity(3.0, 0.1, 2e-4) == pytest.approx(-0.4059, abs=1e-4), (
        "mean of two records of 4096 periods that differ by 2e-5"
    )
    monkeypatch.setattr(conveying, "LONGEST", conveying.SHORTEST)
    assert math.isnan(conveying_velocity(3.0, 0.1, 2e-4))
    assert conveying_velocity(3.0, 1.2) == -math.inf
