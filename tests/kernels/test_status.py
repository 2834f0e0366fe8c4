"""Status and margin of single motions and of the points of a sweep."""

import itertools
import math

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.agreement import same
from vibrodrive import State, Status


@pytest.mark.parametrize("lowest", [1e-2, 1e-5, 1e-8, -1e-2, -1e-5, -1e-8])
def test_margin_is_the_distance_of_the_lowest_point_from_the_obstacle(lowest):
    """A slide down ends just above the obstacle, or, if it starts slightly lower, in an impact."""
    throw = {"A": 3.04, "dxi0": -2.0, "tau0": 2.5, "transient": 0, "periods": 1}
    drop = vd.simulate(**throw, xi0=64.0).switches[0]["xi"] - 64.0
    t = vd.simulate(**throw, xi0=lowest - drop)
    turn = t.switches[0]
    assert (turn["before"], turn["after"]) == (State.DOWN, State.UP if lowest > 0.0 else State.IMPACT)
    assert t.margin == pytest.approx(abs(lowest), abs=1e-13)
    assert lowest < 0.0 or (t.status, t.margin) == (Status.OK, turn["xi"])


def test_margin_of_a_start():
    """The start is the only decision. Its distance is |H - 1| at the obstacle and ||H| - 1| above it."""
    rest = vd.simulate(A=0.0, B=0.25, transient=0, periods=2)
    assert rest.margin == pytest.approx(1.25)
    stick = vd.simulate(A=0.0, B=0.25, xi0=1.0, transient=0, periods=2)
    assert stick.margin == pytest.approx(0.75)


@pytest.mark.parametrize("eps", [0.0, 1e-5])
def test_margin_of_a_wait_without_end(eps):
    """The margin is the smallest distance of H from its boundary, including the amplitude of the disturbance."""
    scene = dict(A=0.4, B=0.25, eps=eps, eta=100.0, transient=0, periods=2)
    reach = 0.4 * (1.0 + eps * 1e4)
    assert vd.simulate(**scene).margin == vd.sweep(**scene).margin == pytest.approx(1.25 - reach)
    assert vd.simulate(**scene, xi0=1.0).margin == vd.sweep(**scene, xi0=1.0).margin == pytest.approx(0.75 - reach)


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12])
def test_margin_of_a_wait_that_nearly_ends(gap):
    """H reaches 1 - gap and then falls. This tangency counts as a decision."""
    t = vd.simulate(A=1.5, B=0.5 + gap, transient=0, periods=3)
    assert t.status == Status.NEVER_LEAVES
    assert t.margin == pytest.approx(gap, rel=1e-3)


def test_never_leaves_is_a_valid_status():
    """The section has a row for every period, all equal, if the mass rests from the start or after some motion."""
    for start in ({}, {"xi0": 2.0, "dxi0": 1.0}, {"dxi0": 3.0}):
        t = vd.simulate(A=0.4, **start, transient=3, periods=5)
        assert t.status == Status.NEVER_LEAVES
        assert t.section.shape == (5, 2)
        assert (t.section == t.section[0]).all()
        assert (t.section[:, 1] == 0).all()


@pytest.mark.jit
def test_budget_is_per_period_and_configurable():
    """The motion has 83 switches in a period, and without the disturbance five. A budget of 100 suffices for all
    periods, a budget of 50 for none."""
    few = [vd.simulate(1.5, transient=0, periods=3, budget=budget).status for budget in (4, 5)]
    assert few == [Status.BUDGET, Status.OK]
    scene = {"A": 1.5, "eps": 5e-4, "transient": 0, "periods": 30}
    assert vd.simulate(**scene, budget=200).status == Status.OK
    spent = vd.simulate(**scene, budget=50)
    assert spent.status == Status.BUDGET
    assert 0 < len(spent.switches) <= 51
    full = vd.simulate(**scene)
    assert (spent.switches == full.switches[: len(spent.switches)]).all(), "switches before the end remain"
    assert np.isnan(spent.section).all()
    assert np.isnan(spent.sample(16).xi[-1]), "samples after the last switch are NaN"


@pytest.mark.jit
@pytest.mark.parametrize("scene", [dict(A=1.5), dict(A=1.5, eps=5e-4), dict(A=3.04, method="fixed", dtau=0.1)], ids=str)
def test_each_point_has_the_full_budget(scene):
    """A sweep computes many points in the same memory. Each point begins with the full budget, which just suffices."""
    run = dict(transient=0, periods=2)
    enough = next(b for b in range(1, 200) if vd.simulate(**scene, **run, budget=b).status == Status.OK)
    swept = vd.sweep(**scene, points={"xi0": [0.0] * 200}, **run, budget=enough, threads=1)
    assert (swept.status == Status.OK).all()


def test_samples_end_with_the_last_computed_switch():
    """All samples up to the last switch are finite. The motion after this switch is not known."""
    spent = vd.simulate(A=1.5, eps=5e-4, tau0=1.0, transient=0, periods=30, budget=50)
    last = spent.switches[-1]
    found = spent.sample(64)
    assert 2 < np.isfinite(found.xi).sum() < 64
    for values in (found.xi, found.dxi, found.H):
        assert np.array_equal(np.isfinite(values), found.tau <= 2 * math.pi * last["period"] + last["phase"])


@pytest.mark.jit
@pytest.mark.parametrize("method", ["fixed", "muller"])
def test_skipped_grid_points_do_not_count_in_the_budget(method):
    t = vd.simulate(A=1.5, method=method, dtau=1e-10, transient=0, periods=1, budget=20_000)  # a grid of 6e10 points
    assert t.status == Status.OK


@pytest.mark.parametrize("eps", [0.0, 1e-6])
def test_rounding_adds_up_over_waits(eps):
    """The mass slides down 51 times, each time into a stick.

    After the last slide the gap exceeds the error of one slide but not the sum of all errors.
    """
    scene = dict(A=1.0, eps=eps, transient=0)
    sticks = [row for row in vd.simulate(**scene, xi0=64.0, periods=60).switches if row["after"] == State.STICK]
    scene |= dict(xi0=64.0 - sticks[50]["xi"] + 5e-14, periods=int(sticks[50]["period"]) + 1)
    swept = vd.sweep(**scene)
    assert 1e-14 < swept.margin < 2e-13
    assert swept.status == Status.TOO_CLOSE
    assert vd.sweep(**dict(scene, xi0=scene["xi0"] + 1e-10)).status == Status.OK


@pytest.mark.jit
@pytest.mark.parametrize("eps", [0.0, 1e-6])
@pytest.mark.parametrize("path", [dict(), dict(method="muller", dtau=0.05, tol=1e-15)], ids=str)
def test_decision_within_rounding_is_too_close_in_lanes(path, eps):
    """At A = `less`, H is above -1 where UP ends, and the mass sticks. At the next double, `more`, it slides down."""
    scene = dict(eps=eps, transient=0, periods=1, **path)
    less, more = 1.5, 3.04
    while less < (A := 0.5 * (less + more)) < more:
        sticks = vd.simulate(A, **scene).switches["after"][1] == State.STICK
        less, more = (A, more) if sticks else (less, A)
    assert (vd.sweep(A=[less, more], **scene).status == Status.TOO_CLOSE).all()
    assert (vd.sweep(A=[less - 1e-9, more + 1e-9], **scene).status == Status.OK).all()


def test_sweep_continues_after_every_status():
    """In a sweep with points of every status, each point has the status, margin and section of its single motion."""
    A = [1.5, 0.4, 1.0, 3.04]
    r = vd.sweep(A=A, B=[0.0, 0.1], eps=[0.0, 5e-4], transient=0, periods=20, budget=60)
    assert r.status.shape == r.margin.shape == (4, 2, 2)
    assert set(np.unique(r.status)) == {Status.OK, Status.TOO_CLOSE, Status.BUDGET, Status.NEVER_LEAVES}
    for k, point in enumerate(itertools.product(A, [0.0, 0.1], [0.0, 5e-4])):
        alone = vd.simulate(*point[:1], B=point[1], eps=point[2], transient=0, periods=20, budget=60)
        assert same(r, np.unravel_index(k, r.shape), alone)


def test_motion_continues_after_too_close():
    """The motion before a decision within rounding is valid. After it, one of the two possible motions is computed."""
    t = vd.simulate(A=1.38, B=0.0, transient=0, periods=20)
    assert t.status == Status.TOO_CLOSE
    assert t.margin < 1e-14
    assert np.isfinite(t.section).all()
    assert t.switches["period"].max() == 19


def test_first_of_two_reasons_is_kept():
    """If the mass rests permanently after a decision within rounding error, the status is TOO_CLOSE."""
    t = vd.simulate(A=1.0, B=0.0, transient=0, periods=3)
    assert t.status == Status.TOO_CLOSE
    assert t.margin == 0.0


@pytest.mark.jit
@pytest.mark.parametrize(
    "start",
    [
        dict(A=2.0, B=0.99, tau0=1.4707546131833567),
        dict(A=1.1342130367421495, xi0=11.647921921935094, tau0=1.3245548131650067),
    ],
)
def test_margin_is_independent_of_an_earlier_tangency(start):
    """In the first slide, a very short one, ξ' comes close to zero. Margins of later switches do not depend on this."""
    window = dict(dxi0=1e-14, transient=0, periods=3)
    alone, swept = vd.simulate(**start, **window), vd.sweep(**start, **window)
    assert same(swept, (), alone)
    assert swept.status == Status.OK
