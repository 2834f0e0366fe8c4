"""Comparison of motions with numbers for the paper's figures.

The numbers are the periods in Fig. 3, the orbits in Figs. 4 and 6, the bands in Figs. 5 to 10, and the motion on a
coarse grid in Fig. 12. Another program, which shares no code with vibrodrive, computed these numbers.
"""

from pathlib import Path

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive import State
from vibrodrive.model import config

pytestmark = pytest.mark.jit

CONFIGS = Path(__file__).parents[2] / "configs"

POINTS = np.array([[2.7733816327, -2.6101762195], [1.2155473776, -2.8904206661]])
"""Section points of the two-periodic motion at A = 3.04, at τ = 2πk."""


def swept(name):
    """Return the sweep of a configuration with section points at τ = 2πk, as in the numbers below."""
    return vd.sweep(**config.read(CONFIGS / f"{name}.toml", ["section_phase=0.0"]).arguments)


def period(points, longest=64, close=1e-8):
    """Return the period of a row of section points in excitation periods, 0 if it is longer than `longest`."""
    for n in range(1, longest + 1):
        if np.abs(points[n:] - points[:-n]).max() < close:
            return n
    return 0


def follows(points, orbit):
    """Return True if the motion follows the cycle of an orbit.

    From each of the section points `points` to the next, the nearest point of `orbit` must advance by one in the cycle.
    """
    nearest = np.linalg.norm(points[:, None] - orbit, axis=-1).argmin(axis=1)
    return bool((np.diff(nearest) % len(orbit) == 1 % len(orbit)).all())


def strong_impacts(motion):
    """Return the impacts that are faster than a tenth of the largest impact speed."""
    impacts = motion.switches[motion.switches["after"] == State.IMPACT]
    return impacts[np.abs(impacts["dxi"]) > 0.1 * np.abs(impacts["dxi"]).max()]


# Fig. 3: the route to chaos


def periods(A, transient=3000):
    """Return the period of the motion at each A. At the phase of this section the mass never rests for long."""
    found = vd.sweep(A=A, transient=transient, periods=160, section_phase=2.0)
    assert (found.status == vd.Status.OK).all()
    return [period(points) for points in found.section]


def test_fig03_between_the_onsets():
    for low, high, n in ((1.12, 2.60, 1), (2.61, 3.05, 2), (3.06, 3.15, 4), (3.19, 3.25, 3)):
        assert set(periods(np.linspace(low, high, 60))) == {n}


def test_fig03_one_impact_in_two_periods():
    found = vd.sweep(A=[2.61, 2.65, 2.68, 2.70, 2.80, 3.0], transient=3000, periods=100)
    assert found.switches[:, State.IMPACT].tolist() == [100, 100, 100, 50, 50, 50]


def test_fig03_windows_of_every_period_from_5_to_36():
    found = periods(np.linspace(3.156, 3.190, 4001))  # the narrowest periodic windows have a width of a few steps in A
    assert set(range(5, 37)) <= set(found)


# Figs. 4 and 6: two solutions of one orbit


def test_fig04_and_fig06_two_solutions_shifted_by_one_period():
    found = vd.sweep(A=3.04, xi0=[0.0, 0.5, 2.0, 5.0, 11.0], transient=1000, periods=1500).section
    shifts = []
    for points in found:
        shift = int(np.abs(points[0] - POINTS).sum(axis=1).argmin())
        expected = np.roll(POINTS, -shift, axis=0)[np.arange(1500) % 2]
        np.testing.assert_allclose(points, expected, rtol=0, atol=1e-10)
        shifts.append(shift)
    assert set(shifts) == {0, 1}


def test_fig06_the_limit_lies_between_153e_6_and_177e_6():
    found = vd.sweep(A=3.04, eps=[0.5e-4, 1.0e-4, 1.53e-4, 1.77e-4, 2.5e-4], transient=1000, periods=1500)
    assert [follows(points, POINTS) for points in found.section] == [True, True, True, False, False]
    rho = [np.linalg.norm(points[:, None] - POINTS, axis=-1).min(axis=1).max() for points in found.section]
    assert rho[0] < 0.2, "points must be near the two points of the orbit"
    assert rho[-1] > 5 * rho[0], "the points must form a cloud"


# Fig. 5: the disturbance adds many switches, but one main impact a period remains


@pytest.mark.parametrize(("eps", "switches"), [(0.0, 4.0), (5e-4, 83.0)])
def test_fig05_switches_a_period(eps, switches):
    motion = vd.simulate(A=1.5, eps=eps, transient=1000, periods=250)
    lasting = motion.switches["after"] != State.IMPACT  # an impact takes no time and is not counted as a state
    assert lasting.sum() / 250 == pytest.approx(switches, abs=0.5)
    main = vd.simulate(A=1.5, transient=10, periods=1).switches["dxi"].min()
    fast = (motion.switches["after"] == State.IMPACT) & (motion.switches["dxi"] < 0.8 * main)
    assert (np.diff(motion.switches["period"][fast]) == 1).all(), "there must be one main impact a period"
    assert fast.sum() == 250


# Figs. 7 and 10: the same disturbance in two forms


@pytest.fixture(scope="module")
def diagrams():
    """Return (A, period of the undisturbed motion, its section points, those at ε = 2e-4, those at Δτ = 0.1)."""
    physical, numerical = swept("fig07"), swept("fig10")
    for results in (physical, numerical):
        assert (results.status == vd.Status.OK).all()
    assert physical.axes["A"].tolist() == numerical.axes["A"].tolist()
    undisturbed = physical.section[:, 0]
    n = np.array([period(points) for points in undisturbed])
    return physical.axes["A"], n, undisturbed, physical.section[:, 1], numerical.section


def structure_kept(n, undisturbed, disturbed):
    """Return, for each A, True if the motion follows the undisturbed orbit, False if this orbit has no period."""
    return np.array([k > 0 and follows(x, orbit[:k]) for k, orbit, x in zip(n, undisturbed, disturbed, strict=True)])


def test_fig07_undisturbed(diagrams):
    A, n, *_ = diagrams
    for low, high, expected in ((3.0, 3.05, 2), (3.06, 3.15, 4), (3.19, 3.25, 3)):
        assert set(n[np.searchsorted(A, low) : np.searchsorted(A, high)].tolist()) == {expected}


def test_fig07_lines_become_bands_until_the_structure_is_lost(diagrams):
    A, n, undisturbed, disturbed, _ = diagrams
    kept = structure_kept(n, undisturbed, disturbed)
    assert kept[A < 3.02].all()
    assert not kept[(A > 3.03) & (A < 3.15)].any()
    band = [
        np.linalg.norm(x[:, None] - orbit[:2], axis=-1).min(axis=1).max()
        for x, orbit in zip(disturbed[A < 3.02], undisturbed[A < 3.02], strict=True)
    ]
    assert max(band) < 1.3
    assert min(band) > 0.3


def test_fig10_grid_and_disturbance_have_the_same_effect(diagrams):
    A, n, undisturbed, disturbed, grid = diagrams
    assert not structure_kept(n, undisturbed, grid).any(), "Δτ = 0.1 must exceed the limit for every A > 3"

    edges = np.linspace(-3.5, 0.5, 41)

    def filled(points):
        """Return the number of bins with points for each A. There are 40 bins over the velocity."""
        return np.array([np.count_nonzero(np.histogram(row, edges)[0]) for row in points[..., 1]])

    lost = (A > 3.03) & (A < 3.15)
    lines, physical, numerical = (np.median(filled(x[lost])) for x in (undisturbed, disturbed, grid))
    assert lines <= 4
    assert min(physical, numerical) > 2 * lines, "both must be clouds"
    apart = [np.histogram(x[..., 1], edges)[0] / x[..., 1].size for x in (disturbed, grid)]
    assert 0.5 * np.abs(apart[0] - apart[1]).sum() < 0.25, "both must cover the same velocities"


# Fig. 9: the printed step 0.5 must be 0.05


def test_fig09_near_the_limit():
    found = vd.sweep(A=3.04, method="fixed", dtau=[0.01, 0.05, 0.055, 0.1, 0.5], transient=1000, periods=1500)
    assert [follows(points, POINTS) for points in found.section] == [True, True, False, False, False]
    near = found.section[1]
    start = int(np.linalg.norm(near[0] - POINTS, axis=-1).argmin())
    shifted = np.roll(POINTS, -start, axis=0)[np.arange(1500) % 2]
    assert np.linalg.norm(near - shifted, axis=-1).max() == pytest.approx(0.87, abs=0.005)


# Figs. 11 and 12: a single motion that consists of pieces of 6×2π


def test_fig12_basic_motions_of_6_periods_and_transients_of_one():
    motion = vd.simulate(A=3.04, method="fixed", dtau=0.1, transient=1000, periods=1500)
    impacts = strong_impacts(motion)
    tau = 2 * np.pi * impacts["period"] + impacts["phase"]
    gaps = np.rint(np.diff(tau) / (2 * np.pi)).astype(int)
    assert set(gaps.tolist()) == {2, 3}
    threes = np.flatnonzero(gaps == 3)
    assert 5 <= len(threes) <= 30
    assert np.diff(threes).min() > 3, "gaps of three periods must be isolated between basic motions"
    steps = np.rint(tau / 0.1).astype(int)
    basic = steps[3:] - steps[:-3]
    values, counts = np.unique(basic, return_counts=True)
    assert values[counts.argmax()] == 377, "three gaps of 2 periods must be 377 steps of 0.1 (6×2π is 376.99)"
    assert counts.max() > 0.6 * len(basic)
