"""The predicted limits beside a grazing: sums of the closed form against differences, and one measured limit."""

import math

import pytest

import vibrodrive as vd
from benchmarks.grazing import late_switches, limit_at_distance, rise, slides_to_touch, slopes
from vibrodrive import State

pytestmark = pytest.mark.jit

GRAZING = 3.202814239942078  # n = 3, two slides up and two slides down before the touch


def test_depth_grows_as_predicted():
    at, impacts = slides_to_touch(GRAZING - 1e-6, 0.1, 3)
    further, _ = slides_to_touch(GRAZING - 3e-6, 0.1, 3, at.states)
    assert (impacts, at.states) == (2, [State.UP, State.DOWN] * 2)
    assert (further.depth - at.depth) / 2e-6 == pytest.approx(slopes(at, vd.ETA)["depth_per_A"], rel=1e-4)


def test_late_switch_moves_the_lowest_point_as_predicted():
    """The slides after the first reversal are computed again, from a reversal that is late by 1e-6."""
    slides, _ = slides_to_touch(GRAZING - 1e-6, 0.1, 3)
    A, late = slides.A, 1e-6

    def end(sign, begin, xi):
        at = begin + 3.1
        for _ in range(60):
            h = at - begin
            at -= (-(0.1 + sign) * h - A * (math.cos(at) - math.cos(begin))) / (A * math.sin(at) - 0.1 - sign)
        h = at - begin
        return at, xi + A * math.cos(begin) * h - (0.1 + sign) * h * h / 2 - A * (math.sin(at) - math.sin(begin))

    lowest = []
    for delay in (0.0, late):
        begin, xi = end(1.0, slides.times[0], 0.0)
        begin += delay
        for sign in (-1.0, 1.0, -1.0):
            begin, xi = end(sign, begin, xi)
        lowest.append(xi)
    assert lowest[0] == pytest.approx(-slides.depth, abs=1e-9)
    assert (lowest[1] - lowest[0]) / late == pytest.approx(late_switches(slides)[0], rel=1e-3)
    assert rise(slides, lambda t: 0.0, lambda t: 0.0) == 0.0


@pytest.mark.parametrize(("eta", "over_slope"), [(vd.ETA, 0.93), (100 + 1 / 3, 3.1), (101.0, 2.1)])
def test_measured_limit_is_the_predicted_one(eta, over_slope):
    """The end of the rest is not linear. At a rational η the force meets the touch at one phase only."""
    A = GRAZING - 1e-3
    slides, _ = slides_to_touch(A, 0.1, 3)
    predicted = limit_at_distance(slides, eta)
    assert vd.limit(A, eta=eta, periods=600).velocity == pytest.approx(predicted, rel=0.02)
    assert predicted / (1e-3 * slopes(slides, eta)["eps"]) == pytest.approx(over_slope, rel=0.05)
