"""Tests of the impact-phase map: comparison with 50 digits, limits at the ends of its window, breakpoints.

After an impact at a phase in the window, from φ_up to π - φ_up, H > 1 and the mass slides up. At a breakpoint the word,
the sequence of states to the next impact, changes.
"""

import math
import sys

import numpy as np
import pytest

from tests.support.mp_flight import next_impact, slope
from vibrodrive.periodic.impact_map import ImpactMap, impact_map

PLACES = [(1.3, 0.1), (1.5, 0.1), (3.04, 0.1), (3.25, 0.1), (5.0, 0.1), (2.0, 0.02), (3.3, 0.5), (2.5, 1.0),
          (3.0, 1.3), (9.0, 2.0)]  # fmt: skip
"""Values (A, B) inside and outside the range of the paper. For B >= 1 the mass slides down even without excitation."""


def inner(system, count: int, seed: int) -> np.ndarray:
    """Return phases at least 1e-4 from each breakpoint, half of them drawn from the window."""
    rng = np.random.default_rng(seed)
    phi = np.concatenate([rng.uniform(0, 2 * math.pi, count), rng.uniform(*system.window, count)])
    return phi[np.abs(phi[:, None] - system.breakpoints).min(axis=1) > 1e-4]


@pytest.mark.parametrize(("A", "B"), PLACES)
def test_next_impact_equals_the_reference(A, B):
    system = impact_map(A, B)
    phi = inner(system, 6, 1)
    found = system(phi)
    for i, start in enumerate(phi.tolist()):
        exact = next_impact(A, B, start)
        assert found.periods[i] == exact.periods
        assert found.phase[i] == pytest.approx(float(exact.phase), abs=1e-12)
        assert found.speed[i] == pytest.approx(-float(exact.velocity), abs=1e-12)
        assert found.word[i] == exact.word


@pytest.mark.parametrize(("A", "B"), PLACES[1::2])
def test_derivative_equals_the_difference_quotient_of_the_reference(A, B):
    system = impact_map(A, B)
    phi = inner(system, 5, 2)
    found = system(phi)
    assert found.periods.min() >= 0
    for i, start in enumerate(phi.tolist()):
        assert found.derivative[i] == pytest.approx(float(slope(A, B, start)), rel=1e-9, abs=1e-12)


def test_derivative_vanishes_after_a_rest_and_not_after_a_stick():
    system = impact_map(3.04)
    rests, sticks, slides = system([5.0, 2.5, 1.0]), system(2.5), system(1.0)
    assert rests.word[0].startswith("REST")
    assert rests.derivative[0] == 0.0
    assert str(sticks.word) == "UP STICK DOWN IMPACT"
    assert sticks.derivative < -1.0
    assert "STICK" not in str(slides.word)


@pytest.mark.parametrize(("A", "B"), [(3.04, 0.1), (2.0, 0.4), (4.0, 1.5)])
def test_limits_at_the_ends_of_the_window(A, B):
    """At φ_up the slope tends to 0. At π - φ_up the rise of the mass vanishes, and the slope tends to -(4 k/m)^⅓.

    From π - φ_up - δ on the mass slides up with ξ'' = -k (τ - π + φ_up) to ξ = (2/3) k δ³. Then, from H = -1 on, it
    slides down with ξ'' = -m (τ - φ_down).
    """
    system = impact_map(A, B)
    up, end = system.window
    assert abs(float(system(up + 1e-7).derivative)) < 1e-5
    k = A * math.cos(up)
    m = math.sqrt(A**2 - (1 - B) ** 2)
    assert float(system(end - 1e-5).derivative) == pytest.approx(-((4 * k / m) ** (1 / 3)), rel=1e-3)
    down = math.pi + math.asin((1 - B) / A)
    assert float(system(end - 1e-9).phase) == pytest.approx(down, abs=1e-8)


@pytest.mark.parametrize(("A", "B"), PLACES)
def test_map_falls_with_one_word_between_breakpoints(A, B):
    system = impact_map(A, B)
    points = system.breakpoints
    assert points[0] == system.window[0]
    assert points[-1] == system.window[1]
    assert np.all(np.diff(points) > 0)
    for a, b, word in zip(points[:-1], points[1:], system.words, strict=True):
        inside = system(np.linspace(a, b, 303)[1:-1])
        assert set(inside.word) == {word}
        assert np.all(np.diff(2 * math.pi * inside.periods + inside.phase) < 0)
        assert inside.derivative.max() < 0


@pytest.mark.parametrize(("A", "B"), [(3.04, 0.1), (3.25, 0.1), (5.0, 0.1), (9.0, 2.0)])
def test_word_of_the_reference_changes_at_breakpoints(A, B):
    system = impact_map(A, B)
    inner_points = zip(system.breakpoints[1:-1], system.kinds[1:-1], strict=True)
    for point, kind in inner_points:
        before, behind = (next_impact(A, B, point + d) for d in (-1e-12, 1e-12))
        assert before.word != behind.word
        jump = abs(float(before.phase - behind.phase) + 2 * math.pi * (before.periods - behind.periods))
        assert (jump > 0.1) == (kind == "grazing")


def test_permanent_rest_has_no_next_impact():
    system = impact_map(1.05, 0.1)
    found = system([0.3, 1.5])
    assert np.isnan(found.phase).all()
    assert (found.periods == -1).all()
    assert set(found.word) == {"REST"}
    assert len(system.breakpoints) == 0


@pytest.mark.jit
@pytest.mark.parametrize("A", [1.2, 1.8, 1.8621, 1.9, 2.93, 7.0, 1e3])
def test_launch_on_the_level_lands_in_its_first_fall_or_never(A):
    """For B = 0 a mass launched at the phase ψ never lands if A cos ψ > π/2, and lands in its first fall if not."""
    system = impact_map(A, 0.0)
    low, high = system.window
    edge = max(low, math.acos(min(0.5 * math.pi / A, 1.0)))
    before, after = np.linspace(low, edge - 1e-12, 200)[1:], np.linspace(edge + 1e-12, high, 200)[:-1]
    away = system(before[before < edge])
    assert ((away.periods == -1).all() and np.isnan(away.derivative).all()) or edge == low
    landed = system(after)
    assert np.isin(landed.word, ["UP DOWN IMPACT", "UP STICK DOWN IMPACT"]).all()
    assert (landed.derivative <= 0.0).all()
    rested = system(0.0)
    assert float(rested.speed) == 0.0 if edge == low else int(rested.periods) == -1
    kinds = {"grazing", "stick"} if edge > low else set()
    assert set(system.kinds[1:-1]) == kinds


@pytest.mark.jit
def test_breakpoints_close_to_the_level_belong_to_short_flights():
    """There are tens of thousands of breakpoints, one for each possible number of periods of a flight. By default only
    some of these breakpoints are computed.
    """
    points = impact_map(3.0, 1e-5).breakpoints
    assert 90 < len(points) < 220
    assert np.all(np.diff(points) > 0)


def test_map_accepts_any_shape_and_any_number_of_turns():
    system = impact_map(3.17)
    phi = np.linspace(0, 2 * math.pi, 12, endpoint=False).reshape(3, 4)
    found = system(phi)
    assert found.phase.shape == found.word.shape == found.derivative.shape == (3, 4)
    assert float(system(phi[1, 2]).phase) == found.phase[1, 2]
    np.testing.assert_allclose(system(phi + 20 * math.pi).phase, found.phase, atol=1e-12)


@pytest.mark.jit
def test_million_evaluations_need_few_kernel_calls(monkeypatch):
    system, calls = impact_map(3.04), []
    phi = np.linspace(0, 2 * math.pi, 1_000_000)
    system(phi[:10])
    module = sys.modules[ImpactMap.__module__]
    kernel = module.impacts
    monkeypatch.setattr(module, "impacts", lambda *arguments: calls.append(len(arguments[0])) or kernel(*arguments))
    system(phi)
    assert sum(calls) == len(phi)
    assert len(calls) < 1000
