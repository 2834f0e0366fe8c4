"""Tests of the configuration file: allowed contents, and the message of one line for other contents."""

import math
from pathlib import Path

import numpy as np
import pytest

from vibrodrive.errors import ConfigError
from vibrodrive.model.choices import Method
from vibrodrive.model.config import parse, read

CONFIGS = Path(__file__).parents[2] / "configs"

MINIMAL = "[sweep]\nA = 3.04\n"


def test_every_form_of_an_axis():
    plan = parse(
        "[sweep]\n"
        "A = {start = 3.0, stop = 3.25, num = 6}\n"
        "eps = [0, 2e-4]\n"
        'dtau = {start = 1e-3, stop = 0.1, num = 3, scale = "log"}\n'
        "B = 0.2\n"
    ).plan()
    assert list(plan.axes) == ["A", "eps", "dtau"]  # in the order written
    np.testing.assert_allclose(plan.axes["A"], [3.0, 3.05, 3.1, 3.15, 3.2, 3.25])
    np.testing.assert_allclose(plan.axes["dtau"], [0.001, 0.01, 0.1])
    assert plan.axes["eps"].tolist() == [0.0, 2e-4]
    assert plan.scalars["B"] == 0.2


def test_axis_has_exact_ends():
    for scale in ("linear", "log"):
        axis = parse(f'[sweep]\nA = {{start = 0.1, stop = 0.7, num = 1000, scale = "{scale}"}}\n').plan().axes["A"]
        assert (axis[0], axis[-1], len(axis)) == (0.1, 0.7, 1000)


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


def test_physical_units_give_a_and_b():
    config = parse("[physical]\na0 = 0.02\nomega0 = 40\nmu = 0.5\nalpha = 3\ng = 9.81\n")
    scalars = config.plan().scalars
    # A = Ω0² a0 / (μ g cos α), B = tan α / μ
    friction = 0.5 * 9.81 * math.cos(math.radians(3))
    assert scalars["A"] == pytest.approx(1600 * 0.02 / friction, rel=1e-15)
    assert scalars["B"] == pytest.approx(math.tan(math.radians(3)) / 0.5, rel=1e-15)


def test_scene_without_a0_needs_an_axis_A_and_gives_B_and_units():
    scene = "[physical]\nomega0 = 40\nmu = 0.5\nalpha = 3\n"
    config = parse(scene + "[sweep]\nA = [1.5, 2.0]\n")
    assert config.plan().axes["A"].tolist() == [1.5, 2.0]
    assert config.plan().scalars["B"] == pytest.approx(math.tan(math.radians(3)) / 0.5, rel=1e-15)
    friction = 0.5 * 9.80665 * math.cos(math.radians(3))
    assert config.physical.velocity(2.0) == pytest.approx(2.0 * friction / 40, rel=1e-15)
    with pytest.raises(ConfigError, match=r"^A is missing: must be given, a number >= 0"):
        parse(scene).plan()


def test_options_override_the_file():
    text = "[model]\nB = 0.2\neps = 1e-4\n[sweep]\nA = {start = 1, stop = 2, num = 5}\n[run]\nperiods = 9\n"
    plan = parse(
        text,
        ["run.periods=4", "eps=[0, 1e-3]", "A.num=3", "method=fixed", "dtau=0.1", "tol=1e-3", "tol=1e-4"],
    ).plan()
    assert plan.settings.periods == 4
    assert plan.settings.method == Method.FIXED
    assert plan.axes["A"].tolist() == [1.0, 1.5, 2.0]
    assert plan.axes["eps"].tolist() == [0.0, 1e-3]  # the number in [model] is replaced
    assert plan.scalars["tol"] == 1e-4
    assert parse(text, ["A=3", "sweep.B=[0.1, 0.3]"]).plan().axes["B"].tolist() == [0.1, 0.3]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[modl]\nB = 1\n", ["table", "modl", "model"]),
        ("B = 1\n", ["table", "'B'", "sweep"]),
        ("model = 3\n", ["model", "3", "table"]),
        ("[model]\nbeta = 1\n", ["[model]", "beta", "eta"]),
        ("[sweep]\nA = '3'\n", ["A", "'3'", "number"]),
        ("[sweep]\nA = true\n", ["A", "True", "number"]),
        ("[sweep]\nA = 1979-05-27\n", ["A", "number"]),
        ("[sweep]\nA = []\n", ["A", "[]", "at least one"]),
        ("[sweep]\nA = [1, 'x']\n", ["A[1]", "'x'", "number"]),
        ("[sweep]\nA = [[1, 2]]\n", ["A[0]", "[1, 2]", "number"]),
        ("[sweep]\nA = {start = 1, stop = 2}\n", ["sweep.A.num", "missing"]),
        ("[sweep]\nA = {start = 1, stop = 2, num = 0}\n", ["sweep.A.num", "0", ">= 1"]),
        ("[sweep]\nA = {start = 1, stop = 2, num = 2.5}\n", ["sweep.A.num", "2.5", "integer"]),
        ("[sweep]\nA = {start = 1, stop = inf, num = 2}\n", ["sweep.A.stop", "inf", "number"]),
        ("[sweep]\nA = {start = 1, stop = 2, num = 3, step = 1}\n", ["sweep.A", "step", "num"]),
        ("[sweep]\nA = {start = 1, stop = 2, num = 3, scale = 'cubic'}\n", ["sweep.A.scale", "cubic", "log"]),
        ("[sweep]\nA = {start = 0, stop = 2, num = 3, scale = 'log'}\n", ["sweep.A.start", "0", "> 0"]),
        ("[sweep]\nA = {start = 1, stop = 2, num = 1000000000000}\n", ["sweep.A.num", "memory", "TB"]),
        ("[sweep]\nperiods = 3\n", ["[sweep]", "periods", "A"]),
        ("[model]\nA = [1, 2]\n", ["A", "[1, 2]", "number"]),
        ("[model]\nA = 1\n[sweep]\nA = 2\n", ["sweep.A", "[model]"]),
        ("[physical]\na0 = 1\nomega0 = 1\nmu = 1\n", ["physical.alpha", "missing"]),
        ("[physical]\na0 = 1\nomega0 = 1\nmu = 1\nalpha = 90\n", ["physical.alpha", "90", "< 90"]),
        ("[physical]\na0 = 1\nomega0 = 'fast'\nmu = 1\nalpha = 0\n", ["physical.omega0", "fast", "number"]),
        ("[physical]\na0 = 1\nomega0 = 1\nmu = 1\nalpha = 0\n[sweep]\nA = 1\n", ["sweep.A", "physical"]),
        ("[physical]\nomega0 = 1\nmu = 1\nalpha = 0\n[sweep]\nB = 1\n", ["sweep.B", "physical"]),
        ("[physical]\na0 = 1e300\nomega0 = 1e9\nmu = 1\nalpha = 0\n", ["A", "number"]),
        (MINIMAL + "[switching]\nmethod = 'fixed'\n", ["dtau", "missing", "fixed"]),
        (MINIMAL + "[figure]\nkind = 'pie'\n", ["figure.kind", "pie", "poincare"]),
        (MINIMAL + "[figure]\ncolour = 'red'\n", ["[figure]", "colour", "kind"]),
        (MINIMAL + "[orbits]\nperiods = 3\n", ["[orbits]", "periods", "max_period"]),
        (MINIMAL + "[figure]\nkind = ['pie']\n", ["figure.kind", "pie", "poincare"]),
        (MINIMAL + "[figure]\nlimits = [2, 1]\n", ["figure.limits", "[2, 1]", "ascending order"]),
        (MINIMAL + "[figure]\nlimits = [1, 1]\n", ["figure.limits", "[1, 1]", "ascending order"]),
        (MINIMAL + "[figure]\nlimits = ['a', 'b']\n", ["figure.limits", "ascending order"]),
        (MINIMAL + "[trajectory]\ncurves = 'phase'\n", ["trajectory.curves", "phase"]),
        ("title = 3\n" + MINIMAL, ["title", "3", "string"]),
        ('title = "a\\u0000b"\n' + MINIMAL, ["title", r"a\x00b", "one line"]),
        ('title = "a\\nb"\n' + MINIMAL, ["title", r"a\nb", "one line"]),
        (MINIMAL + "[run]\nrecord = ['section', 'section']\n", ["record", "section", "once"]),
        (".".join("a" * 20_000) + " = 1\n", ["invalid TOML", "at most 100 parts"]),
        ("[model]\nB = 0.1\n", ["A is missing"]),
        ("[sweep\nA = 1\n", ["invalid TOML", "line 1"]),
        ("[sweep]\nA = 1\nA = 2\n", ["invalid TOML", "line 3"]),
    ],
)
def test_bad_input_is_one_line_with_key_value_and_what_is_allowed(text, expected):
    with pytest.raises(ConfigError) as caught:
        parse(text).plan()
    message = str(caught.value)
    assert "\n" not in message
    assert [word for word in expected if word not in message] == []


@pytest.mark.parametrize(
    "option", ["periods", "=3", "run.=3", "nonsense=3", "run=3", "A=1\nB=2", "run.periods.x=3", "title=\udcff"]
)
def test_bad_option_is_named(option):
    with pytest.raises(ConfigError) as caught:
        parse(MINIMAL + "[run]\nperiods = 3\n", [option]).plan()
    assert "\n" not in str(caught.value)


def test_byte_order_mark_is_ignored(tmp_path):
    (tmp_path / "c.toml").write_bytes(b"\xef\xbb\xbf" + MINIMAL.encode())
    assert read(tmp_path / "c.toml").text == MINIMAL


def test_unreadable_files_are_refused(tmp_path, monkeypatch):
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe[sweep]")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "large.toml").write_text("#" * 999)
    monkeypatch.setattr("vibrodrive.model.config.MOST_BYTES", 998)
    for name in ("missing.toml", "binary.toml", "folder.toml", "large.toml"):
        with pytest.raises(ConfigError, match=name):
            read(tmp_path / name)


def test_configurations_of_the_repository_are_valid():
    plans = {path.stem: read(path).plan() for path in CONFIGS.glob("*.toml") if "sweep" in path.read_text()}
    a = plans["fig03"].axes["A"]
    assert a[0] > 0
    assert a[-1] == 3.25
    assert plans["fig03"].settings.transient == 1000
    for name in ("fig07", "fig07_paper", "fig10"):
        a, s = plans[name].axes["A"], plans[name].settings
        assert (a[0], a[-1], s.transient, s.periods) == (3.0, 3.25, 500, 500)
    assert plans["fig07"].axes["eps"].tolist() == [0.0, 2e-4]
    assert plans["fig07"].settings.method == Method.CERTIFIED
    paper = plans["fig07_paper"]
    assert (paper.settings.method, paper.scalars["dtau"], paper.scalars["tol"]) == (Method.MULLER, 1e-5, 1e-7)
    assert (plans["fig10"].settings.method, plans["fig10"].scalars["dtau"]) == (Method.FIXED, 0.1)
    assert plans["quickstart"].n_points <= 1000


@pytest.mark.parametrize(
    ("text", "overrides", "meant"),
    [
        ("[swep]\nA = 3\n", [], "sweep"),
        (MINIMAL + "[run]\ntransiet = 3\n", [], "transient"),
        (MINIMAL + "[sweep.points]\nEPS = [0.0]\n", [], "eps"),
        ("[sweep]\nA = {start = 3, stop = 4, nun = 3}\n", [], "num"),
        (MINIMAL, ["transiet=3"], "transient"),
        (MINIMAL, ["run.peroids=3"], "periods"),
    ],
)
def test_misspelt_name_is_refused_with_a_suggestion(text, overrides, meant):
    with pytest.raises(ConfigError, match=rf"must be one of .*\. Did you mean {meant}\?$"):
        parse(text, overrides)
    with pytest.raises(ConfigError, match=r"must be one of [^.]*$"):
        parse(MINIMAL, ["zzz=3"])
