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


# Fig. 3: the route to chaos


def periods(A, transient=3000):
    """Return the period of the motion at each A. At the phase of this section the mass never rests for long."""
    found = vd.sweep(A=A, transient=transient, periods=160, section_phase=2.0)
    assert (found.status == vd.Status.OK).all()
    return [period(points) for points in found.section]


def test_fig03_between_the_onsets():
    for low, high, n in ((1.12, 2.60, 1), (2.61, 3.05, 2), (3.06, 3.15, 4), (3.19, 3.25, 3)):
        assert set(periods(np.linspace(low, high, 60))) == {n}


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


def test_fig07_and_fig10_lines_become_bands_and_then_clouds():
    """Before A = 3.02 the structure is kept at ε = 2e-4; above 3.03, both disturbances give clouds of equal places."""
    # in both, the section points are those at τ = 2πk
    (physical, numerical) = (
        vd.sweep(**config.read(CONFIGS / f"{name}.toml", ["section_phase=0.0"]).arguments)
        for name in ("fig07", "fig10")
    )
    A, exact, disturbed, grid = physical.axes["A"], physical.section[:, 0], physical.section[:, 1], numerical.section
    n = np.array([period(points) for points in exact])
    for low, high, expected in ((3.0, 3.05, 2), (3.06, 3.15, 4), (3.19, 3.25, 3)):
        assert set(n[np.searchsorted(A, low) : np.searchsorted(A, high)].tolist()) == {expected}

    def kept(motions):
        return np.array([k > 0 and follows(x, orbit[:k]) for k, orbit, x in zip(n, exact, motions, strict=True)])

    lost = (A > 3.03) & (A < 3.15)
    assert kept(disturbed)[A < 3.02].all()
    assert not kept(disturbed)[lost].any()
    assert not kept(grid).any(), "Δτ = 0.1 must exceed the limit for every A > 3"
    shares = [
        np.histogram(x[lost][..., 1], np.linspace(-3.5, 0.5, 41))[0] / x[lost][..., 1].size for x in (disturbed, grid)
    ]
    assert 0.5 * np.abs(shares[0] - shares[1]).sum() < 0.25, "both must cover the same velocities"


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
    tau = 2 * np.pi * motion.impacts["period"] + motion.impacts["phase"]
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
