"""Tests of the checks of arguments: allowed values and types, messages for other values, and scenes in SI units."""

import math
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.model.choices import Method
from vibrodrive.model.config import read
from vibrodrive.model.names import PARAMETERS
from vibrodrive.model.packaged import configurations, titles
from vibrodrive.model.parameters import check, check_choice, check_count
from vibrodrive.model.physical import Scene
from vibrodrive.model.plan import make_plan
from vibrodrive.model.slips import unlikely


def test_numbers_become_float64():
    for value in (3, 3.0, np.float32(3), np.int8(3), Fraction(3), np.float64(3)):
        x = check("A", value)
        assert type(x) is float
        assert x == 3.0
    assert math.copysign(1.0, check("xi0", -0.0)) == 1.0
    assert type(check_count("periods", np.int32(5), 1)) is int
    assert check_choice("method", "Certified", Method) == check_choice("method", Method.CERTIFIED, Method) == 2


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
    if p.default is not None and not math.isnan(p.default):
        assert check(name, p.default) == p.default


SCENE = {"a0": 0.004, "omega0": 150.0, "mass": 250.0, "mu": 0.6, "alpha": 10.0, "g": 9.81}


def test_units_of_lengths_velocities_times_and_forces_are_consistent():
    """A slide of the model, ξ'' = H ∓ 1, obeys Newton's law in SI units."""
    scene = Scene(**SCENE)
    friction = 0.6 * 9.81 * math.cos(math.radians(10.0))
    assert pytest.approx(150.0**2 * 0.004 / friction, rel=1e-14) == scene.A
    assert pytest.approx(math.tan(math.radians(10.0)) / 0.6, rel=1e-14) == scene.B
    h = 1e-3
    xi = scene.A * math.sin(0.5) * h**2 / 2
    t = scene.time(h)
    assert scene.length(xi) == pytest.approx(0.5 * 0.004 * 150.0**2 * math.sin(0.5) * t**2, rel=1e-12)
    assert scene.length(xi) / t == pytest.approx(scene.velocity(xi / h), rel=1e-12)
    weight = 250.0 * 9.81 * math.sin(math.radians(10.0))
    assert scene.force(scene.B) == pytest.approx(weight, rel=1e-12)
    np.testing.assert_allclose(scene.length(np.array([1.0, 2.0])), scene.friction / 150.0**2 * np.array([1.0, 2.0]))


def test_a_scene_is_a_table_in_a_notebook():
    table = Scene(**SCENE)._repr_html_()
    for name, text in (("a0", "4 mm"), ("omega0", "150 rad/s"), ("mu", "0.6"), ("alpha", "10 °"), ("mass", "250 kg")):
        assert f"<tr><th>{name}</th><td>{text}</td></tr>" in table
    assert "<th>A</th>" in table
    assert "<th>A</th>" not in Scene(**SCENE | {"a0": 0.0})._repr_html_()  # such a scene gives only B and the units


ODD = [
    ({"section_phase": 90}, "section_phase = 90: a phase is in radians"),
    ({"section_phase": [0, -45]}, "section_phase = -45: a phase is in radians"),
    ({"A": [3.0, 3.1, 3.0]}, "A = 3: this value is more than once on the axis"),
    ({"method": "fixed", "dtau": 7}, "dtau = 7: the step of the grid is longer than the excitation period"),
    ({"method": "muller", "points": {"dtau": [0.1, 7.0]}}, "dtau = 7: the step"),
    ({"eps": 2}, "eps = 2: ε is a share of the excitation"),
    ({"eps": [1.5, 3.0]}, r"eps = 1\.5: ε is a share"),
    ({"tau0": 180}, "tau0 = 180: a time τ is in radians of the excitation"),
    ({"tau0": [0, -90]}, "tau0 = -90: a time"),
    ({"A": 0.1, "B": 3.04}, r"A = 0\.1, B = 3\.04: the mass cannot leave the obstacle, .* swapped"),
    ({"A": [0.1, 0.2], "points": {"B": [3.0, 4.0]}}, r"A = 0\.2, B = 3: the mass cannot leave the obstacle"),
    ({"eta": [3.0, 100.0]}, "eta = 3 to 100: no motion depends on it, because eps is 0 everywhere"),
    ({"points": {"eta": [3.0, 100.0]}}, "eta = 3 to 100: no motion"),
]
USUAL = [
    {"section_phase": [-math.pi, 7.0]},
    {"A": (2, 5, 300)},  # three values, as the bouncing ball has them
    {"A": 1.05},  # below the first motion
    {"A": 0.1, "B": 3.04, "eps": 5e-3},  # the disturbance moves the mass
    {"A": 2000.0, "B": 0.1},  # a conveyor at 20 kHz
    {"eta": [1.0, 10.0, 100.0], "eps": 1e-4},
    {"eta": [0.7, 40.0, 1500.0], "eps": 1e-4},
    {"A": np.linspace(2, 5, 300), "eps": [0.0, 1e-6, 1e-3]},
    {"points": {"A": [3.0, 3.0]}},
    {"method": "fixed", "dtau": np.geomspace(1e-3, 6.28, 9)},
    {"eps": np.geomspace(1e-6, 2.0, 9)},
    {"eps": 1.0, "eta": 2.0},  # two harmonics
    {"tau0": 1000 * math.tau},  # the end of a motion
    {"A": [0.1, 3.0], "B": 2.5},
    {"A": 1.5, "B": 2.0},  # no motion, but none with A and B swapped either
    {"eta": [3.0, 100.0], "eps": [0.0, 1e-4]},
    {"eta": [3.0, 100.0], "record": "limit"},
]


@pytest.mark.parametrize(("arguments", "told"), ODD)
def test_unlikely_values_of_a_plan_are_named_once(arguments, told):
    (said,) = unlikely(make_plan({"A": 3.0} | arguments if "A" not in arguments.get("points", ()) else arguments))
    assert re.match(told, said), said


@pytest.mark.parametrize("arguments", USUAL, ids=str)
def test_usual_values_of_a_plan_give_no_warning(arguments):
    assert unlikely(make_plan(({} if "points" in arguments else {"A": 3.0}) | arguments)) == []


SCENE_ODD = [
    (
        {"frequency": [0.02, 0.024]},
        r"A = .* of a0 = 0\.0008, frequency = 0\.02 to 0\.024, mu = .*: the mass cannot leave the obstacle, .* in Hz",
    ),
    ({"mu": [60.0, 80.0]}, "A = .* mu = 60 to 80, .*: the mass cannot leave"),
]


@pytest.mark.parametrize(("arguments", "told"), SCENE_ODD, ids=str)
def test_quantities_in_other_units_than_si_are_named_once(arguments, told):
    plan = make_plan({"scene": Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4)} | arguments)
    (said,) = unlikely(plan, of_scene=True)
    assert re.match(told, said), said
    assert unlikely(plan) == []  # `Scene` has judged its own quantities


@pytest.mark.integration
def test_warning_names_the_line_of_the_caller_once():
    short = dict(transient=0, periods=1)
    scene = vd.Scene(a0=0.8e-3, omega0=150.0, mu=0.6, alpha=3.4)
    swept = vd.sweep(A=[3.0, 3.1], eps=[0.0, 1e-4], **short)
    calls = {
        "A = 9: outside of the axis, 3 to 3.1; 3.1 is selected": lambda: swept.select("nearest", A=9),
        "eps = -0.1: outside": lambda: swept.select("nearest", A=3.19, eps=-0.1),
        "A = 3: ": lambda: vd.sweep(A=[3.0, 3.0], **short),
        "section_phase = 90: ": lambda: vd.simulate(3.0, section_phase=90, **short),
        "eps = 2: ": lambda: vd.limit(3.0, "dtau", eps=2.0, transient=5, periods=16),
        "A = 0.1, ": lambda: vd.orbits(0.1, 3.0),
        "A = 0.00306454, ": lambda: vd.Scene(a0=0.8e-6, omega0=150.0, mu=0.6, alpha=3.4),
        "A = 0.00871692, ": lambda: vd.sweep(scene=scene, omega0=[8.0, 10.0], **short),
        "A = 0.1, B = 3.04: ": lambda: vd.simulate(0.1, B=3.04, **short),
    }
    for told, call in calls.items():
        with pytest.warns(UserWarning, match=f"^{told}") as caught:
            call()
        assert [w.filename for w in caught] == [__file__]
    vd.simulate(scene.A, B=scene.B, **short)
    vd.simulate(scene.A, scene=replace(scene, a0=0.0), **short)  # which gives B
    swept.select("nearest", A=3.19)
    swept.select("nearest", 10.0, A=9)


def test_supplied_configurations_give_no_warning():
    for name in titles():
        plan = read(configurations() / f"{name}.toml").plan()
        assert unlikely(plan) == [], name
