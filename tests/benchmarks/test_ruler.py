"""Tests of benchmarks/ruler.py, which compares the limits of five disturbances as velocities.

Motions under small disturbances approach the undisturbed motion, and the stored limits are complete.
"""

import json
import math

import numpy as np
import pytest

import vibrodrive as vd
from benchmarks import ruler
from benchmarks.common import RESULTS
from benchmarks.switches.model import Point

PERIODS = 40


def impacts(name, value):
    """Return a row (τ, speed) for each main impact at A = 3.04, from rest, under disturbance `name` of size `value`."""
    found = np.empty((2 * PERIODS, 2))
    way = ruler.OWN[name]
    count = way.follow(Point(3.04, 0.1, 0.0, 1.0), way.argument(value), 0.0, 2 * math.pi * PERIODS, found)
    return found[:count]


@pytest.mark.jit
@pytest.mark.slow("5 s: compiles the three motions, whose machine code is not kept")
@pytest.mark.parametrize("name", list(ruler.OWN))
def test_motions_approach_the_undisturbed_one(name):
    exact = vd.simulate(3.04, transient=0, periods=PERIODS).impacts
    tau = 2 * math.pi * exact["period"] + exact["phase"]
    errors = []
    for value in (1e-2, 1e-3):
        found = impacts(name, value)
        assert len(found) == len(tau)
        errors.append([np.abs(found[:, 0] - tau).max(), np.abs(found[:, 1] - exact["speed"]).max()])
    assert (np.array(errors[1]) < 0.2 * np.array(errors[0])).all()
    assert max(errors[1]) < 0.05


def test_impact_agrees_with_the_integrated_spring():
    """The spring is integrated by small steps: x'' = 1 - k x - 2 √k x', from x' = -1 at x = 0 until x = 0 again."""
    for root in (0.3, 0.05):
        w, x, v, step = 1 / root, 0.0, -1.0, 1e-5
        tau = 0.0
        while x < 0.0 or v < 0.0:
            half = v + 0.5 * step * (1.0 - w * w * x - 2 * w * v)
            x, v = x + step * half, v + step * (1.0 - w * w * (x + 0.5 * step * v) - 2 * w * half)
            tau += step
        assert ruler.velocity_loss(root) == pytest.approx(tau - v, rel=1e-3)


def test_stored_limits_are_complete():
    data = json.loads((RESULTS / "ruler.json").read_text(encoding="utf-8"))
    assert data["A"] == list(ruler.AMPLITUDES)
    assert set(data["limits"]) == set(ruler.NAMES)
    for found in data["limits"].values():
        assert len(found["points"]) == len(data["A"])
        assert all(row["k2"] > row["kept_below"] > 0 for row in found["points"] if row)
    assert ruler.markdown(data) in ruler.PAGE.read_text(encoding="utf-8")


@pytest.mark.jit
def test_stored_limit_equals_that_of_the_package():
    data = json.loads((RESULTS / "ruler.json").read_text(encoding="utf-8"))
    row = data["limits"]["dtau"]["points"][data["A"].index(ruler.PAPER)]
    found = vd.limit(ruler.PAPER, "dtau")
    assert (row["k2"], row["last_kept"]) == pytest.approx((found.k2, found.last_kept))
