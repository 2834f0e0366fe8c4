"""Tests of the configuration file: allowed contents. test_refusals.py has the refusals."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from vibrodrive.errors import ConfigError
from vibrodrive.model.choices import Method
from vibrodrive.model.config import parse, read
from vibrodrive.model.physical import Scene

CONFIGS = Path(__file__).parents[2] / "configs"

MINIMAL = "[sweep]\nA = 3.04\n"


def test_numbers_of_options_may_lack_digits_on_one_side():
    found = [parse("[sweep]\nA = 3\n", [f"eps={text}"]).arguments["eps"] for text in (".5", "5.", "+.5e-3", "1.5E-3")]
    assert found == [0.5, 5.0, 0.0005, 0.0015]


def test_every_form_of_an_axis():
    plan = parse(
        "[sweep]\n"
        "A = {start = 3.0, stop = 3.25, num = 6}\n"
        "eps = [0, 2e-4]\n"
        'dtau = {start = 1e-3, stop = 0.1, num = 3, scale = "log"}\n'
        'B = 0.2\n[switching]\nmethod = "fixed"\n'
    ).plan()
    assert list(plan.axes) == ["A", "eps", "dtau"]  # in the order written
    np.testing.assert_allclose(plan.axes["A"], [3.0, 3.05, 3.1, 3.15, 3.2, 3.25])
    np.testing.assert_allclose(plan.axes["dtau"], [0.001, 0.01, 0.1])
    assert [(plan.axes[name][0], plan.axes[name][-1]) for name in ("A", "dtau")] == [(3.0, 3.25), (1e-3, 0.1)]
    assert plan.axes["eps"].tolist() == [0.0, 2e-4]
    assert plan.scalars["B"] == 0.2


def test_every_table():
    config = parse(
        'title = "T"\n[model]\nB = 0.2\neta = 50\ntau0 = 1\n[sweep]\nA = 3\n'
        '[switching]\nmethod = "muller"\ndtau = 1e-3\ntol = 1e-9\n'
        "[run]\ntransient = 7\nperiods = 8\nsection_phase = 0.5\nbudget = 99\n"
        '[figure]\nkind = "poincare"\nquantity = "xi"\nlimits = [-1, 2]\nx = "A"\n'
        '[trajectory]\nperiods = 3\ncurves = ["phase"]\n'
    )
    plan = config.plan()
    s = plan.settings
    assert (s.method, s.transient, s.periods, s.budget) == (Method.MULLER, 7, 8, 99)
    expected = {"B": 0.2, "eta": 50.0, "tau0": 1.0, "dtau": 1e-3, "tol": 1e-9, "section_phase": 0.5}
    assert {k: plan.scalars[k] for k in expected} == expected
    assert config.title == "T"
    assert config.figure == {"kind": "poincare", "quantity": "xi", "limits": (-1.0, 2.0), "x": "A"}
    assert config.trajectory == {"periods": 3, "curves": ["phase"]}


def test_options_override_the_file():
    text = "[model]\nB = 0.2\neps = 1e-4\n[sweep]\nA = {start = 1, stop = 2, num = 5}\n[run]\nperiods = 9\n"
    plan = parse(
        text,
        ["run.periods=4", "eps=[0, 1e-3]", "A.num=3", "method=muller", "dtau=0.1", "tol=1e-3", "tol=1e-4"],
    ).plan()
    assert plan.settings.periods == 4
    assert plan.settings.method == Method.MULLER
    assert plan.axes["A"].tolist() == [1.0, 1.5, 2.0]
    assert plan.axes["eps"].tolist() == [0.0, 1e-3]  # the number in [model] is replaced
    assert plan.scalars["tol"] == 1e-4
    assert parse(text, ["A=3", "sweep.B=[0.1, 0.3]"]).plan().axes["B"].tolist() == [0.1, 0.3]
    config = parse(text, ["x=eps", "curves=['time']", "max_period=2"])
    assert (config.figure, config.trajectory, config.orbits) == ({"x": "eps"}, {"curves": ["time"]}, {"max_period": 2})


def test_options_move_a_quantity_of_a_scene_between_the_tables():
    quantities = {"a0": 0.8e-3, "mu": 0.6, "alpha": 3.4}
    fixed = "[physical]\n" + "".join(f"{name} = {value}\n" for name, value in quantities.items())
    plain, over = f"{fixed}omega0 = 150\n", f"{fixed}[sweep]\nomega0 = [100, 200]\n"
    rise = "{{start = {}, stop = {}, num = 3}}"
    assert parse(plain, [f"omega0={rise.format(100, 200)}"]).plan().axes["omega0"].tolist() == [100.0, 150.0, 200.0]
    for option in ("omega0=160", "physical.omega0=160"):
        plan = parse(over, [option]).plan()
        assert (plan.axes, plan.scalars["A"]) == ({}, Scene(**quantities, omega0=160.0).A)
    in_hertz = parse(plain, ["frequency=24"]).plan().scalars
    assert "omega0" not in in_hertz
    assert (in_hertz["frequency"], in_hertz["A"]) == (24.0, Scene(**quantities, frequency=24.0).A), "stored as given"
    over_hertz = parse(over, [f"frequency={rise.format(20, 30)}"])
    assert over_hertz.plan().axes["frequency"].tolist() == [20.0, 25.0, 30.0]
    assert parse(over.replace("omega0", "frequency"), ["omega0=[150]"]).plan().axes["omega0"].tolist() == [150.0]


@pytest.mark.parametrize("options", list(itertools.permutations(["method=fixed", "dtau=0.1", "periods=3"])))
def test_order_of_options_for_different_keys_does_not_matter(options):
    """The method removes dtau and tol of the file, never those of another option."""
    text = MINIMAL + '[switching]\nmethod = "muller"\ndtau = 0.01\ntol = 1e-9\n'
    assert parse(text, options).arguments == {"A": 3.04, "method": "fixed", "dtau": 0.1, "periods": 3}
    assert parse(text, ["method=certified"]).arguments.keys() == {"A", "method"}
    with pytest.raises(ConfigError, match=r"^tol = 0\.001: must be left out with method = 'fixed'"):
        parse(text, [*options, "tol=1e-3"])


def test_byte_order_mark_is_ignored(tmp_path):
    (tmp_path / "c.toml").write_bytes(b"\xef\xbb\xbf" + MINIMAL.encode())
    assert read(tmp_path / "c.toml").text == MINIMAL
