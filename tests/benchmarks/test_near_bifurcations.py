"""The multiplier under a force of fixed phase, by which the beat of η against an integer moves a motion."""

import numpy as np
import pytest

import vibrodrive as vd
from benchmarks.near_bifurcations import B, multiplier, swing

pytestmark = pytest.mark.jit

A = 2.605


def test_multiplier_without_a_force_is_that_of_the_orbit():
    (orbit,) = vd.orbits(A, B, max_period=1)
    assert multiplier(A, 0.0, 0.0, 101) == pytest.approx(orbit.multiplier, rel=1e-7)


def test_multiplier_under_a_force_is_that_of_a_simulated_motion():
    """At an integer η the disturbed motion has one period. Its multiplier follows from the decay of a transient."""
    V, below = 2e-4, 2.59
    motion = vd.simulate(below, B=B, eps=V / (101 * below), eta=101.0, transient=20, periods=60)
    steps = np.diff(motion.impacts["phase"])
    assert steps[30] / steps[29] == pytest.approx(multiplier(below, V, 0.0, 101), rel=1e-4)
    assert abs(steps[30] / steps[29] - multiplier(below, 0.0, 0.0, 101)) > 0.01


def test_swing_bounds_the_change_of_the_multiplier():
    change = np.log(multiplier(A, 1e-6, 0.7, 101) / multiplier(A, 0.0, 0.0, 101)) / 1e-6
    assert 0 < abs(change) <= 1.001 * swing(A, 101)
