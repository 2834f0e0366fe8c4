"""Commands other than sweep: limits, orbits, failures, paper. Other tests check their numbers."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import vibrodrive as vd
from vibrodrive.cli.common import judge_idle
from vibrodrive.model.config import parse

LIMITS = """
title = "Two limits"
[sweep]
A = [2.5, 2.8]
[run]
transient = 60
periods = 100
[limits]
criterion = "word"
"""

ORBITS = """
title = "A doubling"
[sweep]
A = {start = 2.59, stop = 2.62, num = 4}
[run]
transient = 50
periods = 8
[orbits]
max_period = 2
"""


@pytest.fixture
def run(run):
    """Return the command line, in a directory with the configurations above."""
    Path("limits.toml").write_text(LIMITS)
    Path("orbits.toml").write_text(ORBITS)
    return run


@pytest.mark.jit
def test_limits_go_into_a_file_and_a_figure(run):
    code, out, err = run("limits", "limits.toml", "--threads", "1")
    assert code == 0, err
    assert "limits.h5 written; limits.png drawn" in err
    from vibrodrive.store.every_kind import load

    found = load("limits.h5")
    assert (found.title, found.criterion) == ("Two limits", "word")
    assert found.A.tolist() == [2.5, 2.8]
    one = vd.limit(2.8, "eps", criterion="word", transient=60, periods=100)
    assert found.numbers["k2"][0, 1] == one.k2
    line = out.splitlines()[2].split()
    assert line[:4] == ["2.8", "2", f"{one.k2:.4g}", f"{one.velocity:.4g}"]
    assert Path("limits.png").read_bytes()[:4] == b"\x89PNG"
    assert sorted(p.suffix for p in Path().iterdir()) == [".h5", ".png", ".toml", ".toml"]


def test_a_file_that_is_deleted_while_it_is_written_ends_limits(run, monkeypatch):
    from vibrodrive.jobs import limits
    from vibrodrive.stability.limit import Limit

    def found(quantity, arguments, disturbance, method, *rest):
        yield 0, Limit(2.5, 0.1, 101.0, disturbance, method, "impacts", k2=1e-3)
        Path("limits.h5").unlink()
        yield 1, Limit(2.5, 0.2, 101.0, disturbance, method, "impacts", k2=1e-3)

    monkeypatch.setattr(limits, "each_of", found)
    code, _, err = run("limits", "limits.toml", "--set", "A=[2.5]", "--set", "B=[0.1, 0.2]")
    assert (code, err) == (1, "vibrodrive: limits.h5: moved or deleted while it was written\n")


@pytest.mark.jit
def test_limits_over_two_axes_are_listed_drawn_and_described(run):
    two = ("--set", "eta=[20.3, 50.5]", "--set", "A=[2.5, 2.8]")
    code, out, err = run("limits", "limits.toml", *two)
    assert code == 0, err
    assert out.splitlines()[0].split()[:3] == ["A", "eta", "n"]
    assert len(out.splitlines()) == 6
    code, out, err = run("info", "limits.h5")
    assert code == 0, err
    assert "axis      A = 2.5 to 2.8, 2 values\naxis      eta = 20.3 to 50.5, 2 values\nfixed     B = 0.1\n" in out
    assert "eps       certified: 4 of 4 limits, " in out
    assert ", V = " in out


@pytest.mark.jit
def test_limits_of_a_scene_in_si_units_are_listed_in_mm_s(run):
    Path("scene.toml").write_text(
        "[physical]\na0 = 0.65e-3\nomega0 = 150\nmu = 0.6\nalpha = 3.4\n"
        "[sweep]\neta = [101.3]\n[run]\ntransient = 50\nperiods = 50\n"
    )
    code, out, err = run("limits", "scene.toml")
    assert code == 0, err
    head, line, _ = out.splitlines()
    assert head.count(", mm/s") == 2
    V, mm_s = (float(line.split()[k]) for k in (3, 6))  # columns: eta, n, k2(eps), V(eps), V(fixed), k2(muller), mm/s
    scene = vd.Scene(a0=0.65e-3, omega0=150, mu=0.6, alpha=3.4)
    assert mm_s == pytest.approx(1e3 * scene.velocity(V), rel=1e-3)
    code, out, _ = run("info", "scene.h5")
    assert out.count("mm/s)") == 3


@pytest.mark.jit
def test_orbits_are_listed_stored_and_drawn(run):
    code, out, err = run("orbits", "orbits.toml")
    assert code == 0, err
    (bifurcation,) = vd.bifurcations((2.59, 2.62), max_period=2)
    line = out.splitlines()[1].split()
    assert float(line[0]) == pytest.approx(bifurcation.A, abs=1e-13)
    assert line[1:3] == ["period", "doubling"]
    assert "period 1 to 2" in out.splitlines()[1]
    assert "orbits.h5 written; orbits.png and orbits_multipliers.png drawn" in err
    for name in ("orbits.png", "orbits_multipliers.png"):
        assert Path(name).read_bytes()[:4] == b"\x89PNG"


@pytest.mark.jit
def test_paper_draws_what_is_asked_for_and_judges_its_claims(run):
    code, out, err = run("paper", "--only", "fig02", "--only", "fig04", "-o", "there")
    assert (code, out) == (0, ""), err
    names = {p.name for p in Path("there").iterdir()}
    assert {"fig02.png", "fig02.pdf", "fig04.png", "fig04.pdf", "claims.json", "claims.md"} <= names
    claims = json.loads(Path("there/claims.json").read_text())["claims"]
    assert claims
    assert {c["figure"] for c in claims} <= {"fig02", "fig04"}
    assert f"{len(claims)} claims: " in err
    assert f"there: {len(names)} files written" in err


IDLE = "[sweep]\nA = 3.04\n[switching]\ndtau = 0.1\ntol = 1e-9\n[run]\ntransient = 1\nperiods = 1\n"


@pytest.mark.jit
def test_what_acts_on_nothing_is_named_or_refused(run):
    Path("idle.toml").write_text(IDLE)
    code, out, err = run("sweep", "idle.toml", "--dry-run", "--set", "dtau=[0.1, 0.01]")
    assert (code, out) == (2, "")
    assert "dtau = [0.1, 0.01]: must be left out with method = 'certified': used by fixed and muller only" in err
    for method, names in (("certified", ["dtau", "tol"]), ("fixed", ["tol"]), ("muller", [])):
        code, _, err = run("sweep", "idle.toml", "--method", method, "-o", f"{method}.h5")
        assert code == 0
        assert [line.split()[0] for line in err.splitlines() if "is ignored" in line] == names
    out = run("info", "certified.h5")[1]
    assert not any(f"{name} =" in out for name in ("dtau", "tol", "eta"))
    out = run("info", "muller.h5")[1]
    assert "tol = 1e-09" in out
    assert "eta =" not in out


def test_what_acts_on_nothing_and_is_the_default_is_not_named(capsys):
    """A configuration may give every key, as those that the explorer writes do."""
    judge_idle(parse(IDLE.replace("dtau = 0.1\ntol = 1e-9", "tol = 1e-7")))
    assert capsys.readouterr().err == ""
    judge_idle(parse(IDLE))
    assert capsys.readouterr().err.count("is ignored") == 2


@pytest.mark.jit
def test_commands_name_a_likely_slip_once_where_all_points_have_it(run):
    scene = "[physical]\na0 = 0.8\nomega0 = 150\nmu = 0.6\nalpha = 3.4\n[run]\ntransient = 0\nperiods = 1\n"
    Path("mm.toml").write_text(scene)
    options = {"all": [], "some": ["--set", "a0=[0.8e-3, 0.8]"], "none": ["--set", "a0=0.8e-3"]}
    for name, more in options.items():
        code, _, err = run("sweep", "mm.toml", "-o", f"{name}.h5", *more)
        assert code == 0
        assert err.count("not in SI units") == (name == "all")
