"""`vibrodrive orbits` over A and B: a table, a file and a figure of curves."""

from pathlib import Path

import pytest

import vibrodrive as vd

CONFIG = """
title = "A doubling over B"
[sweep]
A = {start = 2.5, stop = 2.65, num = 100}
B = {start = 0.095, stop = 0.105, num = 2}
[orbits]
max_period = 1
"""


@pytest.fixture
def run(run):
    """Return the fixture `run` of conftest.py, in a directory with the configuration CONFIG."""
    Path("c.toml").write_text(CONFIG)
    return run


@pytest.mark.jit
def test_curves_are_listed_stored_drawn_and_loaded(run, monkeypatch):
    code, out, err = run("orbits", "c.toml")
    assert code == 0, err
    assert "c.h5 written; c.png drawn" in err
    lines = out.splitlines()
    assert [line.split()[0] for line in lines[1:]] == ["border", "period", "number"]
    assert lines[-1] == "number of curves: 2; points at which curves meet: 0"
    stored = vd.load("c.h5")
    assert (stored.A, stored.B, stored.max_period) == ((2.5, 2.65), (0.095, 0.105), 1)
    (doubling,) = (c for c in stored.curves if c.kind == "period doubling")
    (alone,) = vd.bifurcations((2.59, 2.62), 0.1, 1)
    assert abs(doubling.at(0.1)[0] - alone.A) < 1e-13

    def fail(*_, **__):
        raise AssertionError

    monkeypatch.setattr("vibrodrive.jobs.curves.curves", fail)
    picture = Path("c.png").read_bytes()
    assert run("orbits", "c.toml")[1] == out
    assert run("plot", "c.h5", "-o", "again.png")[0] == 0
    assert Path("again.png").read_bytes() == Path("c.png").read_bytes() == picture
    code, out, _ = run("info", "c.h5")
    assert code == 0
    assert "A doubling over B" in out
    assert "curves of bifurcations (vibrodrive orbits)" in out
    assert run("verify", "c.h5")[1].splitlines()[-1] == "complete and undamaged"
    code, out, err = run("orbits", "c.toml", "--set", "max_period=2")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "max_period is 1 in the file and 2 in the configuration" in err


SCENE = """
[physical]
mu = 0.6
alpha = 3.4
[sweep]
omega0 = {start = 100.0, stop = 160.0, num = 6}
a0 = {start = 0.5e-3, stop = 1e-3, num = 5}
[run]
transient = 20
periods = 10
record = ["summary", "impacts"]
"""


@pytest.mark.jit
def test_only_curves_are_drawn_over_a_map(run):
    Path("m.toml").write_text(SCENE)
    assert run("orbits", "c.toml")[0] == 0
    code, _, err = run("sweep", "m.toml")
    assert code == 0, err
    for options in (("--quantity", "energy"), ("--kind", "map"), ("--quantity", "kept")):
        code, _, err = run("plot", "m.h5", *options, "--over", "c.h5", "-o", "over.png")
        assert (code, "over.png drawn" in err) == (0, True), err
    assert "a0 = 0.5 to 1 mm, 5 values" in run("info", "m.h5")[1]
    refused = {
        ("m.h5", "--quantity", "impact_speed", "--over", "c.h5"): "must be map, because curves and limits need a map",
        ("m.h5", "--over", "c.h5", "--over", "c.h5"): "one of each",
        ("m.h5", "--over", "m.h5"): "must be another file than",
        ("c.h5", "--over", "m.h5"): "contains no sweep",
        ("m.h5", "--over", "m.toml"): "m.toml",
    }
    for arguments, told in refused.items():
        code, _, err = run("plot", *arguments, "-o", "x.png")
        assert (code, told in err, "Traceback" in err) == (2, True, False), err
        assert len([line for line in err.splitlines() if line.startswith("vibrodrive: ")]) == 1
    assert not Path("x.png").exists()
