"""The driver in SI units: against a single motion, and against the limit that `vd.limit` gives."""

from __future__ import annotations

import numpy as np
import pytest

import vibrodrive as vd
from examples.driver import DRIVER, course, figure, stands


@pytest.mark.jit
def test_the_course_is_that_of_single_motions():
    found = course([85.0, 120.0, 150.0])
    assert found.power[0] == found.blows[0] == 0.0, "too slow to leave the obstacle"
    for i in (1, 2):
        scene = vd.Physical(omega0=found.omega0[i], **DRIVER)
        motion = vd.simulate(scene.A, B=scene.B, transient=1000, periods=60)
        hits = motion.switches[motion.switches["after"] == vd.State.IMPACT]
        seconds = scene.time(2.0 * np.pi * 60)
        speeds = scene.velocity(-hits["dxi"])
        assert found.blows[i] == pytest.approx(len(hits) / seconds, rel=1e-9)
        assert found.speed[i] == pytest.approx(speeds.max(), rel=1e-6)
        assert found.power[i] == pytest.approx(0.5 * scene.mass * (speeds**2).sum() / seconds, rel=1e-6)


@pytest.mark.jit
def test_what_it_stands_is_the_limit_in_metres_a_second():
    scene = vd.Physical(omega0=150.0, **DRIVER)
    k = vd.limit(scene.A, "eps", B=scene.B, transient=200, periods=200)
    assert stands(150.0) == pytest.approx(k.k2 * vd.ETA * DRIVER["a0"] * 150.0, rel=1e-12)


@pytest.mark.jit
def test_the_figure_shows_millimetres_a_second():
    found = course([85.0, 120.0])
    _, _, limit = figure(found, [120.0, 130.0], [0.012, 0.01]).axes
    assert list(limit.lines[0].get_ydata()) == pytest.approx([12.0, 10.0])
