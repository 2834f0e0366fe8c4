"""Missed, late and wrong switches of `fixed` and `muller`, by certified motions that restart at each switch."""

import itertools

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.model.states import State
from vibrodrive.stability.failures import Comparison, compared, count_failures, next_switches

SLOW = {"A": 1.05, "eps": 0.9, "eta": 0.3}


def motion(method, **arguments):
    return vd.simulate(method=method, **{"transient": 20, "periods": 10, **arguments})


@pytest.mark.jit
@pytest.mark.parametrize("method", ["fixed", "muller"])
@pytest.mark.parametrize("arguments", [{"A": 3.04}, SLOW | {"periods": 30}, SLOW | {"transient": 25, "periods": 5}])
def test_fine_grid_has_no_failures(method, arguments):
    """Zeros of these motions are more than 0.001 apart, and all margins are larger than 0.001.

    Under the slow disturbance the mass rests for several periods at a time, in the last case longer than the numbers of
    the periods of any two successive switches differ.
    """
    verdict = count_failures(motion(method, dtau=1e-3, **arguments))
    assert verdict.judged > 2
    assert verdict[1:] == (0, 0, 0)


@pytest.mark.jit
@pytest.mark.parametrize("method", ["fixed", "muller"])
def test_two_zeros_in_one_step_are_counted(method):
    """At ε = 5e-4 and A = 1.5 there are 83 switches in a period, so methods with the step 0.1 miss many."""
    found = compared(motion(method, A=1.5, eps=5e-4, dtau=0.1))
    assert np.count_nonzero(~found.in_time) > 0.05 * len(found.in_time)
    assert max(found.behind[found.in_time]) <= 0.1001 < min(found.behind[~found.in_time])
    assert min(found.behind[~found.in_time]) < 0.2, "later than a step, and less than two steps"


def test_kinds_of_failures_are_those_of_the_module():
    """Four switches: the certified one; the same one later; another one in time; another one later."""
    same, in_time = np.array([True, True, False, False]), np.array([True, False, True, False])
    found = Comparison(*[np.zeros(4)] * 5, same, in_time)
    assert [found.of(kind).nonzero()[0].tolist() for kind in ("late", "wrong", "missed")] == [[1], [2], [3]]


@pytest.mark.jit
def test_wrong_decisions_are_mostly_of_the_fixed_method():
    """`fixed` decides by H at the next grid point, `muller` by H at the refined zero."""
    arguments = dict(A=1.5, eps=2e-4, dtau=0.004)
    fixed, muller = count_failures(motion("fixed", **arguments)), count_failures(motion("muller", **arguments))
    assert fixed.wrong > 0
    assert muller.wrong < fixed.wrong


@pytest.mark.jit
@pytest.mark.parametrize("dtau", [0.003, 0.05, 0.4])
@pytest.mark.parametrize(("method", "early"), [("fixed", 1e-11), ("muller", 1e-6)])
def test_no_method_switches_before_the_first_zero(method, early, dtau):
    """No delay is negative, even after a slide that ended late, below the obstacle, and none is infinite."""
    for A in (1.5, 1.8, 2.6, 3.04):
        behind = compared(motion(method, A=A, eps=2e-4, dtau=dtau)).behind
        assert len(behind) > 20
        assert min(behind) > -early
        assert max(behind) < 10


@pytest.mark.jit
def test_restart_finds_the_next_switch_of_the_motion():
    """A certified motion that starts at a switch of another certified motion has the same next switch."""
    p = motion("fixed", A=3.04, dtau=1.0)
    rows = vd.simulate(A=3.04, transient=20, periods=10).switches
    for row, following in itertools.pairwise(rows):
        if row["after"] == State.IMPACT:
            continue
        xi = 0.0 if row["before"] == State.IMPACT else row["xi"]
        tau, state = 2 * np.pi * row["period"] + row["phase"], int(row["after"])
        (period,), (phase,), (to,) = next_switches(p, np.array([tau]), np.array([xi]), np.array([state]), 2)
        assert (period, to) == (following["period"], following["after"])
        assert abs(phase - following["phase"]) < 1e-11
