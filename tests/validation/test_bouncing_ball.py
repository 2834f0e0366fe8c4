"""For B → ∞ the mass is the inelastic bouncing ball. Its laws are compared with a plain ball and with the program."""

import math
from dataclasses import replace

import numpy as np
import pytest

import vibrodrive as vd
from examples.bouncing_ball import DOCS, figure
from vibrodrive.validation.bouncing_ball import MIDDLE, approach, laws, measure, table

pytestmark = pytest.mark.jit  # these tests compute about a thousand flights for every B


@pytest.fixture(scope="module")
def found():
    return approach()


def ball(phase, gamma):
    """Return (phase, speed) of the next impact of the completely inelastic ball that is launched at a phase.

    gamma : amplitude of the acceleration of the table, divided by gravity: A/B for B → ∞
    """

    def gap(h):
        return gamma * math.cos(phase) * h - 0.5 * h * h - gamma * (math.sin(phase + h) - math.sin(phase))

    h = 1e-3
    while gap(h) > 0.0:
        h += 1e-3
    low, high = h - 1e-3, h
    for _ in range(60):
        low, high = (middle, high) if gap(middle := 0.5 * (low + high)) > 0.0 else (low, middle)
    return phase + low - 2.0 * math.pi, low + gamma * (math.cos(phase + low) - math.cos(phase))


@pytest.mark.parametrize("gamma", [3.35, 3.5, 3.7])
def test_laws_agree_with_the_ball(gamma):
    phase = math.acos(math.pi / gamma)
    back, speed = ball(phase, gamma)
    assert back == pytest.approx(phase, abs=1e-12)
    assert speed == pytest.approx(2.0 * math.pi, abs=1e-12)
    slope = (ball(phase + 1e-6, gamma)[0] - ball(phase - 1e-6, gamma)[0]) / 2e-6
    assert slope == pytest.approx(1.0 - math.sqrt(gamma**2 - math.pi**2), abs=1e-8)


def test_laws_give_the_limits_of_gamma():
    rest, doubling = (law.limit for law in laws()[:2])
    assert rest * math.sin(math.acos(math.pi / rest)) == pytest.approx(1.0, abs=1e-14)
    assert 1.0 - math.sqrt(doubling**2 - math.pi**2) == pytest.approx(-1.0, abs=1e-14)


def test_laws_hold_with_an_error_of_1_over_B(found):
    for a in found:
        assert a.holds, a.law
        assert a.slope == pytest.approx(-1.0, abs=2e-3)


def test_remainder_of_the_first_order_is_of_second_order(found):
    for a in found:
        second = a.beyond[:5] * a.B[:5] ** 2  # up to B = 1e6
        assert second == pytest.approx(np.full(5, second[2]), rel=0.05)
        assert a.beyond.min() < 1e-14
        assert a.beyond[-1] < 1e-14


def test_wrong_law_fails(found):
    for a in found:
        assert not replace(a, law=replace(a.law, limit=a.law.limit * (1 + 1e-6))).holds
        assert not replace(a, law=replace(a.law, factor=a.law.factor * (1 + 1e-4))).holds
    wrong = [replace(a, law=replace(a.law, factor=0.5)) for a in found]
    assert sum("**fails**" in line for line in table(wrong)) == len(found)


@pytest.mark.parametrize("B", [1e2, 1e4, 1e6])
def test_simulated_motions_reach_the_found_orbit(B):
    """A motion simulated from rest, without the map, has the phase and speed of the orbit after 500 periods."""
    motion = vd.simulate(A=MIDDLE * B, B=B, transient=500, periods=20)
    _, _, phase, speed, _ = measure(B)
    assert motion.status == vd.Status.OK
    assert len(motion.impacts) == 20
    assert motion.impacts["phase"] == pytest.approx(np.full(20, phase), abs=1e-12)
    assert motion.impacts["speed"] / B == pytest.approx(np.full(20, speed), rel=1e-12)


def test_impact_speed_is_that_of_a_free_fall_of_one_period():
    alpha, g, period = 30.0, 9.81, 0.02
    mu = math.tan(math.radians(alpha)) / 1e6
    scene = vd.Scene(a0=1e-4, omega0=2 * math.pi / period, mu=mu, alpha=alpha, g=g)
    speed = scene.velocity(2.0 * math.pi * scene.B)
    assert speed == pytest.approx(g * math.sin(math.radians(alpha)) * period, rel=1e-12)


def test_page_shows_the_table(found):
    page = (DOCS / "bouncing_ball.md").read_text().splitlines()
    verdicts = list(table(found))[: 2 + len(found)]
    assert set(verdicts) <= set(page)


def test_figure_shows_every_law_with_a_line_of_slope_minus_one(found):
    (ax,) = figure(found).axes
    marks = [line for line in ax.lines if not line.get_label().startswith("_")]
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert sorted(line.get_ydata()[0] for line in marks) == sorted(a.error[0] for a in found)
    for mark, line in zip(marks, (line for line in ax.lines if line not in marks), strict=True):
        x, y = np.log(line.get_xdata()), np.log(line.get_ydata())
        assert (y[1] - y[0]) / (x[1] - x[0]) == pytest.approx(-1.0)
        assert mark.get_ydata()[-1] == pytest.approx(line.get_ydata()[-1], rel=1e-5)
