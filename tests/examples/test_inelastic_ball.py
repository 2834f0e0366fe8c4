"""For B → ∞ the mass is the inelastic bouncing ball. Its laws are compared with a plain ball and with the program."""

import math

import numpy as np
import pytest

import vibrodrive as vd
from examples.inelastic_ball import DECADES, MIDDLE, figure, laws, measure, table


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


@pytest.mark.jit
@pytest.mark.slow("10 s: a search for bifurcations at each of seven values of B")
def test_errors_of_the_laws_decrease_as_1_over_B_with_the_derived_factor():
    found = np.array([measure(B) for B in DECADES.tolist()])
    for law, values in zip(laws(), found.T, strict=True):
        beyond = (values - law.limit - law.factor / DECADES) / law.limit
        assert (values[-1] - law.limit) * DECADES[-1] == pytest.approx(law.factor, rel=1e-5), law
        second = beyond[:5] * DECADES[:5] ** 2  # the remainder is of second order, up to B = 1e6
        assert second == pytest.approx(np.full(5, second[2]), rel=0.05), law
        assert abs(beyond[-1]) < 1e-14, law
    assert all(float(line.split()[0]) == pytest.approx(-1.0, abs=2e-3) for line in table(found).splitlines()[1:])
    (ax,) = figure(found).axes
    lines, marks = ax.lines[::2], ax.lines[1::2]
    for mark, line in zip(marks, lines, strict=True):
        assert mark.get_ydata()[-1] == pytest.approx(line.get_ydata()[-1], rel=1e-5)


@pytest.mark.jit
@pytest.mark.parametrize("B", [1e2, 1e4, 1e6])
def test_simulated_motions_reach_the_found_orbit(B):
    """A motion simulated from rest, without the map, has the phase and speed of the orbit after 500 periods."""
    motion = vd.simulate(A=MIDDLE * B, B=B, transient=500, periods=20)
    _, _, phase, speed, _ = measure(B)
    assert motion.status == vd.Status.OK
    assert motion.impacts["phase"] == pytest.approx(np.full(20, phase), abs=1e-12)
    assert motion.impacts["speed"] / B == pytest.approx(np.full(20, speed), rel=1e-12)


def test_impact_speed_is_that_of_a_free_fall_of_one_period():
    alpha, g, period = 30.0, 9.81, 0.02
    mu = math.tan(math.radians(alpha)) / 1e6
    scene = vd.Scene(a0=1e-4, omega0=2 * math.pi / period, mu=mu, alpha=alpha, g=g)
    speed = scene.velocity(2.0 * math.pi * scene.B)
    assert speed == pytest.approx(g * math.sin(math.radians(alpha)) * period, rel=1e-12)
