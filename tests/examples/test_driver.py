"""Tests of the vibratory driver in SI units (`vd.driver`, examples/driver.py) against `vd.simulate` and `vd.limit`."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import vibrodrive as vd
from examples.driver import DRIVER, course, figure, limit_velocity


@pytest.mark.jit
def test_course_equals_single_motions():
    found = course([85.0, 120.0, 150.0])
    assert found.power[0] == found.blows[0] == 0.0, "at the first frequency the mass must not leave the obstacle"
    for i in (1, 2):
        scene = vd.Scene(omega0=found.omega0[i], **DRIVER)
        motion = vd.simulate(scene.A, B=scene.B, transient=1000, periods=60)
        hits = motion.switches[motion.switches["after"] == vd.State.IMPACT]
        seconds = scene.time(2.0 * np.pi * 60)
        speeds = scene.velocity(-hits["dxi"])
        assert found.blows[i] == pytest.approx(len(hits) / seconds, rel=1e-9)
        assert found.speed[i] == pytest.approx(speeds.max(), rel=1e-6)
        assert found.power[i] == pytest.approx(0.5 * scene.mass * (speeds**2).sum() / seconds, rel=1e-6)


@pytest.mark.jit
def test_limit_velocity_is_in_metres_per_second():
    scene = vd.Scene(omega0=150.0, **DRIVER)
    k = vd.limit(scene.A, "eps", B=scene.B, transient=1000, periods=1500)
    assert limit_velocity(150.0) == pytest.approx(k.k2 * vd.ETA * DRIVER["a0"] * 150.0, rel=1e-12)


@pytest.mark.jit
def test_figure_shows_millimetres_per_second():
    found = course([85.0, 120.0])
    _, _, limit = figure(found, [120.0, 130.0], [0.012, 0.01]).axes
    assert list(limit.lines[0].get_ydata()) == pytest.approx([12.0, 10.0])


SCENE = vd.Scene(a0=0.8e-3, omega0=150.0, mu=0.6, alpha=3.4, mass=250.0)


def free_velocity(A: float, B: float, steps: int = 20_000) -> float:
    """Return the mean ξ' in the twelfth period of a mass without an obstacle, by explicit Euler steps (error 1e-3)."""
    dxi, mean, h = 0.0, 0.0, 2.0 * math.pi / steps
    for k in range(12 * steps):
        if k >= 11 * steps:
            mean += dxi / steps
        H = A * math.sin(k * h) - B
        if dxi != 0.0:
            after = dxi + h * (H - math.copysign(1.0, dxi))
            dxi = 0.0 if after * dxi < 0.0 else after
        elif abs(H) > 1.0:
            dxi = h * (H - math.copysign(1.0, H))
    return mean


@pytest.mark.jit
def test_driver_equals_its_motion_in_si_units():
    found = vd.driver(SCENE)
    motion = vd.simulate(SCENE.A, B=SCENE.B, transient=1000, periods=252)
    hits = motion.switches[motion.switches["after"] == vd.State.IMPACT]
    speeds, seconds = SCENE.velocity(-hits["dxi"]), SCENE.time(2.0 * math.pi * 252)
    assert found.blows == pytest.approx(len(hits) / seconds, rel=1e-9)
    assert (found.speed, found.speed_mean) == pytest.approx((speeds.max(), speeds.mean()), rel=1e-9)
    assert found.power == pytest.approx(0.5 * SCENE.mass * (speeds**2).sum() / seconds, rel=1e-9)
    assert found.power + found.friction == pytest.approx(found.drive, rel=1e-12)
    period = round(found.period * SCENE.omega0 / (2.0 * math.pi))
    assert np.allclose(motion.section[period:], motion.section[:-period], atol=1e-9)
    assert not np.allclose(motion.section[period // 2 :], motion.section[: -(period // 2)], atol=1e-3)
    more = replace(SCENE, omega0=SCENE.omega0 * 1.01)
    assert replace(found.beside["omega0"][1], beside={}) == replace(vd.driver(more), beside={})
    assert f"{found.beside['mu'][0].power:.4g}" in str(found)


@pytest.mark.jit
@pytest.mark.parametrize("a0", [0.4e-3, 0.8e-3])
def test_mass_without_an_obstacle_is_conveyed_down_the_incline(a0):
    scene = replace(SCENE, a0=a0)
    free = vd.driver(scene).conveying
    assert free == pytest.approx(scene.velocity(free_velocity(scene.A, scene.B)), rel=3e-3)
    assert free < 0.0
    assert vd.driver(vd.Scene.quiet(**vars(scene) | {"alpha": 40.0})).conveying == -math.inf


@pytest.mark.jit
def test_command_prints_the_result_of_the_call(run):
    Path("d.toml").write_text("[physical]\n" + "".join(f"{key} = {value}\n" for key, value in vars(SCENE).items()))
    found = vd.driver(SCENE)
    assert run("driver", "d.toml")[:2] == (0, f"{found}\n")
    told = json.loads(run("driver", "d.toml", "--json", "--set", "a0=[0.8e-3]")[1])
    assert told["power"] == found.power
    assert told["beside"]["alpha"][1]["scene"]["alpha"] == pytest.approx(1.01 * SCENE.alpha)
