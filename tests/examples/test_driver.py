"""Tests of the example of a vibratory driver in SI units, examples/driver.py, against `vd.simulate` and `vd.limit`."""

import numpy as np
import pytest

import vibrodrive as vd
from examples.driver import DRIVER, course, figure, limit_velocity

pytestmark = pytest.mark.jit


def test_course_equals_single_motions():
    found = course([13.5, 19.0, 24.0])
    assert found.impact_power[0] == found.impacts[0] == 0.0, "at the first frequency the mass does not leave"
    for i in (1, 2):
        scene = vd.Scene(a0=0.8e-3, frequency=float(found.frequency[i]), mu=0.6, alpha=3.4, mass=250.0)
        motion = vd.simulate(scene.A, B=scene.B, transient=1000, periods=60)
        hits = motion.switches[motion.switches["after"] == vd.State.IMPACT]
        seconds = 60 / scene.frequency
        speeds = scene.velocity(-hits["dxi"])
        assert found.impacts[i] == pytest.approx(len(hits) / seconds, rel=1e-9)
        assert found.impact_speed_max[i] == pytest.approx(speeds.max(), rel=1e-6)
        assert found.impact_power[i] == pytest.approx(0.5 * scene.mass * (speeds**2).sum() / seconds, rel=1e-6)


def test_limit_velocity_is_in_metres_per_second():
    k = vd.limit(DRIVER.A, "eps", B=DRIVER.B, transient=1000, periods=1500)
    assert limit_velocity(24.0) == pytest.approx(k.k2 * vd.ETA * 0.8e-3 * 2.0 * np.pi * 24.0, rel=1e-12)


def test_figure_shows_millimetres_per_second():
    found = course([14.0, 19.0])
    _, _, limit = figure(found, [19.0, 20.0], [0.012, 0.01]).axes
    assert list(limit.lines[0].get_ydata()) == pytest.approx([12.0, 10.0])
