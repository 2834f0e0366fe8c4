"""Properties of every motion, for all parameters and starts. Hypothesis always draws the same examples."""

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

import vibrodrive as vd
from tests.exact.agreement import check_above_obstacle, check_order, flagged, follow
from tests.exact.reference import ETA
from vibrodrive import State, Status

pytestmark = [pytest.mark.jit, pytest.mark.filterwarnings("ignore:A = .*swapped")]  # any scene, likely or not


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Return a strategy for numbers from 10**low to 10**high whose logarithm is distributed evenly."""
    return st.floats(low, high).map(lambda e: 10.0**e)


SCENES = st.fixed_dictionaries(
    {
        "A": st.one_of(st.floats(0, 4), st.floats(1, 3.3), st.floats(0, 30), st.sampled_from([1e-3, 1e6])),
        "B": st.one_of(st.just(0.1), st.floats(0, 1), st.floats(0, 3), st.sampled_from([0.0, 1.0])),
        "eps": st.one_of(st.just(0.0), powers(-6, -3), powers(-6, 0)),
        "eta": st.one_of(st.just(ETA), powers(-1, 2.5), st.integers(1, 12).map(float)),
        "xi0": st.one_of(st.just(0.0), st.floats(0, 5), powers(-6, 3), st.sampled_from([1e-300, 1e12])),
        "dxi0": st.one_of(st.just(0.0), st.floats(-4, 4), powers(-9, 2), powers(-9, 2).map(lambda v: -v)),
        "tau0": st.one_of(st.just(0.0), st.floats(0, 7), st.floats(-1e9, 1e9)),
    }
)
"""Scenes with usual amplitudes, with all inclines (level, moderate, too steep), disturbances and starts."""

MODEST = SCENES.map(
    lambda scene: (
        scene
        | {"A": min(scene["A"], 5.0), "tau0": scene["tau0"] % 7}
        | {"dxi0": scene["dxi0"] if abs(scene["dxi0"]) > 1e-20 else 0.0}  # v² must be visible in 50 digits
    )
)


FAINT = st.fixed_dictionaries(
    {
        "A": st.floats(0.9, 12),
        "B": st.one_of(st.just(0.0), st.floats(0, 1.3)),
        "eps": powers(-9, -4),
        "eta": st.sampled_from([37.0, ETA, 432.0, 1000.0, 1500.0]),
        "xi0": powers(-1, 1.5),
        "dxi0": st.one_of(st.just(0.0), powers(-1, 1.5).map(lambda v: -v), powers(-1, 1.5)),
        "tau0": st.floats(-3, 3),
    }
)
"""Scenes with disturbances that are large only in the high derivatives of a switching function."""


def motion(scene: dict[str, float], periods: int = 8) -> vd.Trajectory:
    return vd.simulate(**scene, transient=0, periods=periods, budget=3000)


@settings(max_examples=200, derandomize=True, deadline=None)
@given(SCENES)
@example(dict(A=1.0, B=0.400390625, eps=1e-4, eta=100.99504938362077, xi0=0.0, dxi0=5e-324, tau0=0.0))
@example(dict(A=1.1, B=1.3201919013162353, eps=1e-6, eta=100.99504938362077, xi0=0.0, dxi0=1e-47, tau0=1.0))
@example(dict(A=0.125, B=1.0, eps=1.0, eta=2.0, xi0=0.0, dxi0=2.0, tau0=0.0))
@example(dict(A=0.0, B=2.0, eps=0.0, eta=ETA, xi0=0.0, dxi0=3e-308, tau0=1.0))  # falls by 5e-324 in a time of 1e-162
def test_invariants_of_every_motion(scene):
    t = motion(scene, 20)
    check_order(t)
    check_above_obstacle(t)
    rows = t.switches
    before = np.flatnonzero(rows["after"] == State.IMPACT)
    touch = 1e-15 if t.status == Status.TOO_CLOSE else 0.0  # by rounding, ξ' may exceed 0 at an impact with speed 0
    assert (rows["dxi"][before] <= touch).all()
    assert (rows["xi"][before] == 0).all()
    leaving = np.flatnonzero(rows["before"] == State.IMPACT)
    assert (rows["dxi"][leaving] == 0).all()
    assert (rows["xi"][leaving] == 0).all()
    np.testing.assert_array_equal(before + 1, leaving if len(leaving) == len(before) else [*leaving, len(rows)])
    assert t.margin >= 0
    assert np.isnan(t.section).any() <= (t.status == Status.BUDGET)


@settings(max_examples=400, derandomize=True, deadline=None)
@given(st.one_of(MODEST, FAINT))
def test_certified_equals_the_reference(scene):
    """The states are those of the reference if all margins exceed 1e-9. If they differ, the motion is flagged."""
    assume(scene["xi0"] <= 1e3 or scene["B"] < 0.9)  # otherwise the mass falls for a million periods
    try:
        found = follow(scene, most=16, periods=12)
    except ArithmeticError:  # a zero of order three, which no number of digits decides
        assert flagged(motion(scene))
        return
    if found.agrees:
        return
    margins = [float(s.margin) for s in found.exact.switches[: found.same + 1]]
    assert flagged(found.ours)
    assert min([float(found.exact.margin), found.ours.margin, *margins]) <= 1e-9
