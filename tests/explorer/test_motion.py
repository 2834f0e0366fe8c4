"""Curves of one motion: one curve for each state, with enough points to show the disturbance. One motion rests
permanently, and the computation of another was stopped."""

import math
import warnings

import numpy as np
import pytest

import vibrodrive as vd

pytest.importorskip("bokeh")

from vibrodrive.explorer.motion import MOST_POINTS, forces, lines
from vibrodrive.model.states import LASTING

pytestmark = pytest.mark.jit


@pytest.mark.parametrize("eps", [0.0, 2e-4])
def test_curves_of_the_states_make_up_the_motion(eps):
    motion = vd.simulate(3.04, eps=eps, transient=50, periods=6)
    found = lines(motion)
    sample = motion.sample(4001)
    time = (sample.tau - sample.tau[0]) / (2.0 * math.pi)
    ripple = 3.04 * eps * motion.arguments["eta"]
    for state, at, curve in zip(LASTING, found["time"], found["dxi"], strict=False):
        own, there = sample.state == state, ~np.isnan(curve)
        if own.any():
            wrong = np.abs(np.interp(time[own], at[there], curve[there]) - sample.dxi[own]).max()
            assert wrong < 0.002 + 0.1 * ripple


def test_fastest_disturbance_is_drawn_over_fewer_periods():
    found = lines(vd.simulate(3.04, eps=1e-6, eta=400.0, transient=5, periods=12))
    assert {len(curve) for curves in found.values() for curve in curves} == {MOST_POINTS}
    assert 5.0 < found["time"][0][-1] < 7.0


def test_excitation_is_drawn_in_the_lowest_third():
    found = lines(vd.simulate(3.04, transient=50, periods=6))
    *states, drive = found["xi"]
    high = np.nanmax(states)
    assert drive.min() == pytest.approx(0.0, abs=1e-3)
    assert drive.max() == pytest.approx(high / 3.0, rel=1e-3)
    assert np.corrcoef(drive, np.sin(2.0 * math.pi * found["time"][-1]))[0, 1] == pytest.approx(1.0)


@pytest.mark.parametrize(("A", "status"), [(0.5, "NEVER_LEAVES"), (3.04, "BUDGET")])
def test_motion_at_rest_or_unknown_has_an_excitation(A, status):
    motion = vd.simulate(A, transient=5, periods=3, budget=1)
    assert motion.status.name == status
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drive = lines(motion)["xi"][-1]
    assert drive.max() - drive.min() == pytest.approx(1.0 / 3.0, rel=1e-3)


@pytest.mark.parametrize("eps", [0.0, 2e-4])
def test_forces_equal_those_of_the_motion_and_states_begin_at_switches(eps):
    motion = vd.simulate(3.04, eps=eps, tau0=0.3, transient=50, periods=4)
    found = forces(motion)
    tau = 0.3 + 2.0 * math.pi * (50 + found["time"])
    disturbed = eps * motion.arguments["eta"] ** 2 * np.sin(motion.arguments["eta"] * tau)
    assert found["H"] == pytest.approx(3.04 * (np.sin(tau) + disturbed) - 0.1, abs=1e-7)
    assert found["sine"] == pytest.approx(np.sin(tau), abs=1e-9)
    assert len(found["begins"]) == len(motion.switches) + 1
    sample = motion.sample(500)
    assert np.array_equal(found["xi"], motion.sample((len(found["xi"]) - 1) // 4).xi)
    time = (sample.tau - sample.tau[0]) / (2.0 * math.pi)
    for begin, state, end in zip(found["begins"], found["states"], found["begins"][1:], strict=False):
        inside = (time > begin + 1e-9) & (time < end - 1e-9)
        assert (sample.state[inside] == (LASTING[state] if state >= 0 else -1)).all()
