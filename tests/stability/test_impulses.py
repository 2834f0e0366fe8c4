"""Every disturbance: attacks by a simulator of its own, single motions with a constant force, and sines."""

import math

import numpy as np
import pytest

import vibrodrive as vd
from tests.stability.test_always import cycle_of
from tests.support.blows import attack, main_impacts, strike
from vibrodrive.model.reasons import Beyond
from vibrodrive.stability.impulses import find_tolerated
from vibrodrive.stability.main_impacts import follow_cycle

pytestmark = pytest.mark.jit

TWO_PI = 2.0 * math.pi
BRIEF = {"transient": 20, "periods": 100}


def lost(A, B, V, m=0.0, count=20, periods=10, steps=1200):
    """Return how many of `count` disturbances destroy the structure at each of several V."""
    cycle = cycle_of(A, B)
    blows = attack(V, m, cycle, count, np.random.default_rng(1))
    found = strike(A, B, float(cycle.phase[0]), periods, blows, steps)
    losses = [follow_cycle(cycle, main_impacts(one), periods) is None for one in found]
    return np.reshape(losses, (len(V), count)).sum(axis=1).tolist()


@pytest.mark.parametrize(
    ("A", "B", "above", "how"),
    [
        pytest.param(1.5, 0.1, 1.15, {}, id="rests, small steps down in flight"),
        pytest.param(3.4, 0.46, 1.06, {}, id="rests, touches"),
        pytest.param(2.8, 0.1, 1.15, {"periods": 24, "steps": 3000}, id="n = 2", marks=pytest.mark.slow("20 s: long")),
        pytest.param(1.3, 0.1, 1.15, {"periods": 24, "steps": 6000, "count": 60}, id="touches in a rest",
                     marks=pytest.mark.slow("60 s: small steps")),
        pytest.param(2.65, 0.1, 1.3, {"periods": 150, "steps": 6000, "count": 8}, id="two main impacts",
                     marks=pytest.mark.slow("90 s: long, with small steps")),
    ],
)  # fmt: skip
def test_attacks_destroy_the_structure_above_the_impulse_only(A, B, above, how):
    V = find_tolerated(A, B, cycle_of(A, B)).velocity
    below, beyond = lost(A, B, [0.99 * V, above * V], **how)
    assert below == 0
    assert beyond > 0


def test_attacks_beside_a_force_destroy_the_structure_above_the_pair_only():
    A, B = 3.4, 0.46
    k = vd.limit(A, B=B, **BRIEF)
    m = 0.5 * k.force_any
    below, beyond = lost(A, B, [0.99 * k.velocity_any_at(m), 1.15 * k.velocity_any_at(m)], m)
    assert below == 0
    assert beyond > 0


def reached(A, B, first, last, m):
    """Return the ends of the interval of the next impacts under any force up to m; None if one is not in time.

    The velocity grows with the force, so the motions with the least and the largest force alone decide.
    """
    ends = []
    for phase, force in ((last, -m), (first, m)):
        impacts = vd.simulate(A, B=B - force, tau0=phase % TWO_PI, transient=0, periods=2).impacts
        later = impacts["phase"][0] + TWO_PI * impacts["period"][0] - phase % TWO_PI if len(impacts) else math.nan
        if not math.pi < later < 3.0 * math.pi:
            return None
        ends.append(phase + later - TWO_PI)
    return ends


@pytest.mark.parametrize(("A", "B"), [(2.0, 0.1), (2.2, 0.2), (2.5, 0.1), (3.0, 0.4), (3.2, 0.5)])
def test_force_is_that_at_which_motions_with_a_constant_force_leave_the_interval(A, B):
    cycle = cycle_of(A, B)
    found = find_tolerated(A, B, cycle)
    assert found.beyond_force == Beyond.MISSED
    for share, kept in ((0.995, True), (1.005, False)):
        first = last = float(cycle.phase[0])
        for _ in range(60):
            ends = reached(A, B, first, last, share * found.force)
            if ends is None:
                break
            first, last = min(first, ends[0]), max(last, ends[1])
        assert (ends is not None) == kept


@pytest.mark.parametrize("eta", [0.7, 3.3, 21.0])
def test_no_sine_destroys_the_structure_below_the_impulse(eta):
    """The impulse of a sine over half of its period is 2 A ε η."""
    r = vd.sweep(A=[1.3, 2.0, 2.4, 2.8], eta=eta, record="limit", **BRIEF)
    of_every = vd.sweep(A=r.axes["A"], record="impulses").velocity_any
    assert (2.0 * r.velocity >= of_every).all()


def test_numbers_of_a_limit_fall_with_the_force_and_are_those_of_the_record():
    scene = vd.Scene(a0=0.8e-3, frequency=20.0, mu=0.6, alpha=3.4, mass=250.0)
    k = vd.limit(scene=scene, **BRIEF)
    r = vd.sweep(scene=scene, record="impulses")
    assert (r.velocity_any, r.force_any) == (k.velocity_any, k.force_any)
    assert Beyond(r.any_how.item()).meaning == k.any_how
    assert k.velocity_any_si == pytest.approx(k.velocity_any * scene.friction / scene.omega0)
    assert k.force_any_si == pytest.approx(250.0 * k.force_any * scene.friction)
    beside = [k.velocity_any_at(share * k.force_any) for share in (0.0, 0.3, 0.6, 0.9)]
    assert beside[0] == k.velocity_any
    assert (np.diff(beside) < 0.0).all()
    assert math.isnan(k.velocity_any_at(1.01 * k.force_any))
    (interval,) = k.tolerated.starts
    assert interval[0] < (k.cycle.phase[0] + math.pi) % TWO_PI - math.pi < interval[1]


def test_two_impacts_that_may_change_places_have_a_larger_impulse_by_their_gaps_alone():
    k = vd.limit(2.62, "dtau", **BRIEF)
    assert k.any_how == Beyond.DRIFT.meaning
    assert [len(one.starts) for one in (k.tolerated, k.tolerated_gaps)] == [2, 1]
    assert k.tolerated_gaps.velocity > 10.0 * k.velocity_any > 0.0
    assert k.tolerated_gaps.force > 10.0 * k.force_any > 0.0


@pytest.mark.parametrize(
    ("arguments", "status", "how"),
    [
        ({"A": 1.05}, vd.Status.OK, Beyond.NO_IMPACTS),  # the mass rests
        ({"A": 3.5, "B": 1.1}, vd.Status.OK, Beyond.NO_IMPACTS),
        ({"A": 2.8, "B": 0.02}, vd.Status.NO_ORBIT, -1),  # chaotic
        ({"A": 2.0, "B": 0.1, "budget": 1}, vd.Status.BUDGET, -1),
    ],
)
def test_what_is_not_proved_is_no_number_and_has_its_reason(arguments, status, how):
    r = vd.sweep(record="impulses", **arguments)
    assert (r.status, r.any_how) == (status, how)
    assert np.isnan([r.velocity_any, r.force_any]).all()


def test_nearly_every_orbit_of_a_diagram_has_its_numbers():
    r = vd.sweep(A=np.linspace(1.11, 3.25, 40), record="impulses")
    has_orbit = r.status == vd.Status.OK
    assert has_orbit.sum() > 35
    assert (r.velocity_any[has_orbit] > 0.0).all()
    assert (r.force_any[has_orbit] > 0.0).all()
