"""Comparison of the main impacts that kernels record with the main impacts that a plain loop selects from switches."""

import math

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive import State
from vibrodrive.batch.trajectory import MAIN_IMPACT

PATHS = {
    "undisturbed": {},
    "disturbed": {"eps": 2e-4},
    "muller": {"method": "muller", "dtau": 1e-3},
    "muller, disturbed": {"method": "muller", "dtau": 1e-3, "eps": 1e-4},
    "fixed": {"method": "fixed", "dtau": 0.05},
    "fixed, disturbed": {"method": "fixed", "dtau": 0.05, "eps": 1e-4},
    "from another phase": {"tau0": 2.5},
    "from the air": {"xi0": 0.3, "dxi0": -0.2, "tau0": 12.0},
    "steep": {"B": 3.0},
}


def picked(switches):
    """Return the main impacts. If an impact follows the last main impact within π, the faster of the two is kept."""
    found = []
    for row, switch in enumerate(switches):
        if switch["after"] != State.IMPACT:
            continue
        speed = -switch["dxi"]
        if found:
            last = switches[found[-1]]
            since = int(switch["period"] - last["period"]) * (2 * math.pi) + (switch["phase"] - last["phase"])
            if since <= math.pi:
                if speed > -last["dxi"]:
                    found[-1] = row
                continue
        found.append(row)
    out = np.empty(len(found), MAIN_IMPACT)
    out["row"], out["period"], out["phase"] = found, switches["period"][found], switches["phase"][found]
    out["speed"] = -switches["dxi"][found]
    return out


def assert_recorded(A, **arguments):
    """Assert that a sweep records the main impacts of single motions, and -1 or NaN where there are no more.

    States are counted from the main impact before, of which the first one has none.
    """
    swept = vd.sweep(A=A, **arguments, record="impacts")
    for at, a in enumerate(A):
        motion = vd.simulate(a, **arguments)
        wanted = picked(motion.switches)
        n = len(wanted)
        assert wanted.tobytes() == motion.impacts.tobytes(), a
        for name in ("period", "phase", "speed"):
            assert swept[f"impact_{name}"][at][:n].tolist() == wanted[name].tolist(), a
        assert swept.impact_states[at][:n].tolist() == [-1, *(np.diff(wanted["row"]) - 1)][:n]
        assert (swept.impact_period[at][n:] == -1).all()
        assert np.isnan(swept.impact_phase[at][n:]).all()


@pytest.mark.parametrize("name", PATHS)
@pytest.mark.parametrize(
    ("motions", "transient", "periods"), [(2, 1, 4), pytest.param(24, 40, 60, marks=pytest.mark.jit)]
)
def test_batches_record_the_main_impacts_of_single_motions(name, motions, transient, periods):
    A = np.random.default_rng(11).uniform(1.0, 4.0, motions) * (1.2 * PATHS[name].get("B", 1 / 1.2))
    assert_recorded(A.tolist(), transient=transient, periods=periods, **PATHS[name])


@pytest.mark.jit
def test_impacts_of_a_repeating_motion_are_copied():
    """In a sweep, long records at ε = 0 are copied cycle by cycle. `simulate` computes every switch."""
    assert_recorded([0.5, 1.5, 2.65, 3.04, 3.1, 3.17, 3.2, 3.25, 3.9], transient=300, periods=3000)


@pytest.mark.jit
def test_touches_are_left_out():
    motion = vd.simulate(1.5, eps=5e-4, transient=100, periods=50)
    touches = np.count_nonzero(motion.switches["after"] == State.IMPACT)
    assert touches > 3 * len(motion.impacts)
    apart = 2 * math.pi * np.diff(motion.impacts["period"]) + np.diff(motion.impacts["phase"])
    assert apart.min() > math.pi
    at = motion.switches[motion.impacts["row"]]
    assert (at["after"] == State.IMPACT).all()
    assert (-at["dxi"] == motion.impacts["speed"]).all()
