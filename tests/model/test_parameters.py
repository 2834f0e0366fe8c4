"""Tests of the checks of arguments: allowed values and types, messages for other values, and scenes in SI units."""

import math
from fractions import Fraction

import numpy as np
import pytest

from vibrodrive.model.choices import Method, Scan, Status
from vibrodrive.model.names import PARAMETERS
from vibrodrive.model.parameters import check, check_choice, check_count
from vibrodrive.model.physical import Scene
from vibrodrive.model.slips import slip


def test_numbers_become_float64():
    for value in (3, 3.0, np.float32(3), np.int8(3), Fraction(3), np.float64(3)):
        x = check("A", value)
        assert type(x) is float
        assert x == 3.0


def test_minus_zero_becomes_zero():
    assert math.copysign(1.0, check("xi0", -0.0)) == 1.0
    assert math.copysign(1.0, check("tau0", -0.0)) == 1.0


@pytest.mark.parametrize("name", list(PARAMETERS))
def test_both_ends_of_every_range(name):
    p = PARAMETERS[name]
    assert check(name, p.high) == p.high
    low = math.nextafter(p.low, math.inf) if p.open_low else p.low
    assert check(name, low) == low
    below = p.low if p.open_low else math.nextafter(p.low, -math.inf)
    for outside in (math.nextafter(p.high, math.inf), below, math.nan, math.inf, 10**400):
        with pytest.raises(ValueError, match=f"^{name} = .*: must be ") as caught:
            check(name, outside)
        assert p.allowed in str(caught.value)
    for no_number in ("3", None, True, np.True_, 3 + 0j, [3]):
        with pytest.raises(TypeError, match=f"^{name} = .*: must be a number"):
            check(name, no_number)
    if p.default is not None and not math.isnan(p.default):
        assert check(name, p.default) == p.default


def test_counts():
    assert check_count("periods", np.int32(5), 1) == 5
    for wrong in (0, -3, 2**41):
        with pytest.raises(ValueError, match=f"^periods = {wrong}: must be an integer >= 1"):
            check_count("periods", wrong, 1)
    for wrong in (2.0, "2", None, True):
        with pytest.raises(TypeError, match=r"^periods = .*: must be an integer >= 1"):
            check_count("periods", wrong, 1)


def test_choices():
    assert check_choice("method", "Certified", Method) == 2
    assert check_choice("method", Method.FIXED, Method) == 0
    assert type(check_choice("scan", Scan.LITERAL, Scan)) is int
    with pytest.raises(ValueError, match=r"^method = 'newton': must be one of fixed, muller, certified"):
        check_choice("method", "newton", Method)
    for wrong in (2, None, Scan.LITERAL):
        with pytest.raises(TypeError, match=r"^method = "):
            check_choice("method", wrong, Method)


def test_every_status_has_different_advice():
    advice = [s.advice for s in Status]
    assert len(set(advice)) == len(Status)
    assert all(len(text) > 20 and "\n" not in text and not text.endswith(".") for text in advice)


SCENE = {"a0": 0.004, "omega0": 150.0, "mass": 250.0, "mu": 0.6, "alpha": 10.0, "g": 9.81}


def test_dimensionless_numbers_of_a_scene():
    scene = Scene(**SCENE)
    friction = 0.6 * 9.81 * math.cos(math.radians(10.0))
    assert pytest.approx(150.0**2 * 0.004 / friction, rel=1e-14) == scene.A
    assert pytest.approx(math.tan(math.radians(10.0)) / 0.6, rel=1e-14) == scene.B


def test_units_of_lengths_velocities_times_and_forces_are_consistent():
    """A slide of the model, ξ'' = H ∓ 1, obeys Newton's law in SI units."""
    scene = Scene(**SCENE)
    h = 1e-3
    xi = scene.A * math.sin(0.5) * h**2 / 2
    t = scene.time(h)
    assert scene.length(xi) == pytest.approx(0.5 * 0.004 * 150.0**2 * math.sin(0.5) * t**2, rel=1e-12)
    assert scene.length(xi) / t == pytest.approx(scene.velocity(xi / h), rel=1e-12)
    weight = 250.0 * 9.81 * math.sin(math.radians(10.0))
    assert scene.force(scene.B) == pytest.approx(weight, rel=1e-12)
    np.testing.assert_allclose(scene.length(np.array([1.0, 2.0])), scene.friction / 150.0**2 * np.array([1.0, 2.0]))


def test_scene_accepts_a_frequency_in_hertz_instead_of_omega0():
    rest = {name: value for name, value in SCENE.items() if name != "omega0"}
    scene = Scene(**rest, frequency=24.0)
    assert scene.omega0 == 48.0 * math.pi
    assert scene.frequency == 24.0
    assert scene == Scene(**rest, omega0=48.0 * math.pi)
    for given, words in (
        ({}, r"^omega0 is missing: must be given, .* in rad/s \(or give frequency in hertz\)$"),
        ({"omega0": 150.0, "frequency": 24.0}, "left out"),
    ):
        with pytest.raises(TypeError, match=words):
            Scene(**rest, **given)


def test_slip_is_named_if_all_points_have_it():
    odd = {
        "swapped": (0.1, 3.04, 0.0, 101.0),
        "per cent": (3.0, 0.1, 2.0, 101.0),
        "SI units": (340.0, 0.1, 0, 1),
    }
    for words, point in odd.items():
        assert words in slip([point])
        assert slip([point, (3.04, 0.1, 1e-4, 101.0)]) == ""
    assert slip([(2000.0, 1000.0, 0.0, 101.0)]) == ""  # the bouncing ball
    assert slip([(0.9, 0.1, 1e-3, 101.0)]) == ""  # the disturbance moves the mass


def test_scene_in_other_units_warns_once():
    with pytest.warns(UserWarning, match="not in SI units") as caught:
        scene = Scene(a0=0.8, omega0=150.0, mu=0.6, alpha=3.4)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert round(scene.A, 1) == 3064.5
