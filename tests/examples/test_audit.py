"""Tests of examples/audit.py, which compares the switches of another program with certified switches.

Certified switches pass, and each error is reported at the switch at which it occurs. What is not understood is refused.
"""

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest

import vibrodrive as vd
from examples import audit as example
from examples.audit import MISSED, OTHER, RIGHT, Switch, audit, read, report, suspect


def certified(A, eps=0.0, periods=6, B=0.1):
    """Return the switches of a certified motion, impacts left out, as `Switch` with the state that begins there."""
    rows = vd.simulate(A, B=B, eps=eps, transient=0, periods=periods).switches
    rows = rows[rows["after"] != vd.State.IMPACT]
    landed = rows["before"] == vd.State.IMPACT
    return [
        Switch(2.0 * np.pi * row["period"] + row["phase"], 0.0 if hit else row["xi"], 0.0, vd.State(row["after"]).name)
        for row, hit in zip(rows, landed, strict=True)
    ]


@pytest.mark.parametrize(("A", "eps"), [(1.5, 0.0), (3.04, 0.0), (3.04, 2e-5)])
def test_certified_switches_are_right(A, eps):
    judged = audit(certified(A, eps), A, eps=eps)
    assert len(judged) > 8
    assert {j.verdict for j in judged} == {RIGHT}
    assert max(abs(j.late) for j in judged) < 1e-9


def test_late_omitted_and_wrong_switches_are_counted_once():
    switches = certified(1.5)
    late = dataclasses.replace(switches[4], tau=switches[4].tau + 1e-3)
    judged = audit([*switches[:4], late, *switches[5:]], 1.5)
    assert [j.verdict for j in judged] == [RIGHT] * len(judged)
    assert judged[3].late == pytest.approx(1e-3, abs=1e-9)
    assert sum(abs(j.late) > 1e-4 for j in judged) == 1
    without = audit([*switches[:5], *switches[7:]], 1.5)
    assert [j.verdict for j in without if j.verdict != RIGHT] == [MISSED]
    wrong = dataclasses.replace(switches[5], state="DOWN" if switches[5].state != "DOWN" else "UP")
    first = next(j for j in audit([*switches[:5], wrong, *switches[6:]], 1.5) if j.verdict != RIGHT)
    assert (first.verdict, first.switch) == (OTHER, wrong)


def test_file_is_read_and_reported(tmp_path, monkeypatch, capsys):
    switches = certified(1.5)
    written(tmp_path / "mine.csv", "tau,xi,dxi,state", [(s.tau, s.xi, s.dxi, s.state) for s in switches])
    assert read(str(tmp_path / "mine.csv")) == switches
    assert run(monkeypatch, capsys, tmp_path / "mine.csv", "--A", "1.5").startswith(all_right(switches))
    assert "first at" in report(audit([switches[0], *switches[3:]], 1.5))


SCENE = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4)
TOML = "[physical]\n" + "".join(f"{name} = {value}\n" for name, value in SCENE.given.items())


def written(path, head, rows):
    path.write_text("\n".join([head, *(",".join(map(str, row)) for row in rows)]))


def run(monkeypatch, capsys, *arguments):
    """Return the output of the script."""
    monkeypatch.setattr(sys, "argv", ["audit", *map(str, arguments)])
    example.main()
    return capsys.readouterr().out


def all_right(switches):
    return f"{len(switches) - 1} switches: {len(switches) - 1} right, 0 missed, 0 another state\n"


HEADS = {
    "t_s,x_m,v_m_per_s,state": 1.0, "t_s,x_m,v_m_s,state": 1.0, "t [s],x [m],v [m/s],State": 1.0,
    "t_ms,x_mm,v_mm_per_s,state": 1e3, "t (ms),x (mm),v (mm/s),state": 1e3,
}  # fmt: skip


@pytest.mark.parametrize(("head", "milli"), HEADS.items())
def test_switches_in_si_units_are_those_of_the_scene(tmp_path, monkeypatch, capsys, head, milli):
    """The scene gives A, B and the units. Its frequency and gravity convert, without the functions of the package."""
    switches, omega = certified(SCENE.A, B=SCENE.B), 2 * np.pi * 24.0
    v = milli * 0.6 * 9.80665 * np.cos(np.radians(3.4)) / omega
    rows = [(milli * s.tau / omega, s.xi * v / omega, s.dxi * v, s.state.lower()) for s in switches]
    written(tmp_path / "mine.csv", head, rows)
    (tmp_path / "scene.toml").write_text(TOML)
    out = run(monkeypatch, capsys, tmp_path / "mine.csv", "--scene", tmp_path / "scene.toml")
    assert out.startswith(all_right(switches))
    assert abs(float(out.splitlines()[1].split()[2])) < 1e-9


@pytest.mark.parametrize("method", [{}, {"method": "fixed", "dtau": 0.01}])
@pytest.mark.parametrize("in_si", [True, False])
def test_tables_of_the_program_are_read(tmp_path, method, in_si):
    motion = vd.simulate(scene=SCENE, transient=30, periods=10, **method)
    table = (motion if in_si else motion.dimensionless()).to_dataframe()
    table.to_csv(tmp_path / "switches.csv", index=False)
    judged = audit(read(str(tmp_path / "switches.csv"), SCENE.given), SCENE.A, SCENE.B)
    assert len(judged) == (table.after != "IMPACT").sum() - 1
    assert {j.verdict for j in judged} == {RIGHT}
    late = [j.late for j in judged]
    assert (min(late) > 0 and max(late) < 0.01) if method else max(map(abs, late)) < 1e-9


def test_comments_and_empty_lines_are_left_out_and_one_switch_is_counted_as_one(tmp_path):
    rows = [(0.5, 0, 0, "UP"), ("#",), (2.5, 0.5, 0, "STICK")]
    written(tmp_path / "mine.csv", "# of MATLAB\n\ntau,xi,dxi,state", rows)
    assert read(str(tmp_path / "mine.csv")) == [Switch(0.5, 0.0, 0.0, "UP"), Switch(2.5, 0.5, 0.0, "STICK")]
    assert report(audit(certified(1.5)[:2], 1.5)).startswith("1 switch: 1 right")


def test_states_are_known_names_in_any_case():
    switches = certified(1.5)
    assert [dataclasses.replace(s, state=f" {s.state.lower()} ") for s in switches] == switches
    struck = dataclasses.replace(switches[3], state="impact")
    assert audit([*switches[:3], struck, *switches[3:]], 1.5) == audit(switches, 1.5)
    with pytest.raises(ValueError, match=r"^state = 1: must be one of UP, DOWN, STICK, REST, IMPACT$"):
        dataclasses.replace(switches[0], state=1)


def test_numbers_in_other_units_are_suspected(tmp_path, monkeypatch, capsys):
    switches = certified(SCENE.A, B=SCENE.B)
    rows = [(SCENE.time(s.tau), SCENE.length(s.xi), SCENE.velocity(s.dxi), s.state) for s in switches]
    written(tmp_path / "mine.csv", "tau,xi,dxi,state", rows)
    out = run(monkeypatch, capsys, tmp_path / "mine.csv", "--A", SCENE.A, "--B", SCENE.B)
    assert "switches in 0.037 periods: is τ in seconds? Columns: tau, xi, dxi or, with --scene, t_s" in out
    disturbed = certified(1.5, eps=2e-4, periods=50)  # it has a hundred switches in a period
    assert not suspect(switches, 0.0, vd.ETA)
    assert not suspect(disturbed, 2e-4, vd.ETA)


ROWS = "tau,xi,dxi,state\n0.5,0,0,UP\n2.5,0.5,0,STICK\n"
REFUSED = {
    "0.5,0.1,0,UP\n2.5,0.5,0,STICK\n3,0.5,0,UP\n": "columns = '0.5, 0.1, 0, UP': must be state, and tau",
    "t,x,v,mode\n1,2,3,UP\n1,2,3,UP\n": "columns = 't, x, v, mode': must be state, and tau",
    ROWS.replace("tau,xi,dxi", "t_s,x_m,v_m_per_s"): "columns = 't_s, x_m, v_m_per_s, state': must be state, and tau",
    ROWS.replace(",", ";"): "separator = ';': must be a comma",
    ROWS.replace(",", "\t"): r"separator = '\t': must be a comma",
    ROWS.replace("0.5,0,", "0,5,0,"): "line 2 = '0,5,0,0,UP': must be 4 cells",
    ROWS.replace("0.5,0,0,UP", "0.5,0"): "line 2 = '0.5,0': must be 4 cells",
    ROWS.replace("UP", "1"): "state in line 2 = '1': must be one of UP, DOWN, STICK, REST, IMPACT",
    ROWS.replace("2.5,0.5", "2.5,a"): "xi in line 3 = 'a': must be a finite number",
    ROWS.replace("2.5", "nan"): "tau in line 3 = 'nan': must be a finite number",
    ROWS.replace("2.5", "0.4"): "tau in line 3 = '0.4': must be at least that of the line before",
    ROWS.replace("0.5,0,0", "1e20,0,0").replace("2.5", "2e20"): "tau0 = 1e+20: must be",
    ROWS.replace("\n0.5", "\n# mine\n\n0.5").replace("UP", "1"): "state in line 4 = '1': must be one of UP",
    ROWS.replace("tau,xi,dxi", "t_ms,x_mm,v_mm_per_s"): "columns = 't_ms, x_mm, v_mm_per_s, state': must be state, and",
    ROWS.replace("xi,dxi", "xi,xi"): "columns = 'tau, xi, xi, state': must be different names, but xi is there twice",
    ROWS.partition("\n")[2]: "columns = '0.5, 0, 0, UP': must be different names, but 0 is there twice",
    ROWS[:27]: "1 switch: must be at least 2",
    "": "must be a table (CSV in UTF-8)",
    "\xff\xfe": "must be a table (CSV in UTF-8)",
}


@pytest.mark.parametrize("text", REFUSED)
def test_files_that_are_not_understood_are_refused_in_one_line(tmp_path, monkeypatch, capsys, text):
    (tmp_path / "mine.csv").write_bytes(text.encode("latin-1"))
    refused(monkeypatch, capsys, REFUSED[text], tmp_path / "mine.csv", "--A", "1.5")


def refused(monkeypatch, capsys, words, *arguments):
    with pytest.raises(SystemExit) as end:
        run(monkeypatch, capsys, *arguments)
    out, err = capsys.readouterr()
    assert (end.value.code, out, err.count("\n")) == (2, "", 1), err
    assert words in err


def test_a_wrong_model_or_scene_is_refused_in_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("mine.csv").write_text(ROWS)
    Path("scene.toml").write_text(TOML)
    Path("sweep.toml").write_text(TOML + "[sweep]\neps = [0, 1e-4]\n")
    for words, *arguments in (
        ("missing.csv: No such file", "missing.csv", "--A", "1"),
        ("missing.toml: No such file", "mine.csv", "--scene", "missing.toml"),
        ("A is missing", "mine.csv"),
        ("A = 'x': must be", "mine.csv", "--A", "x"),
        ("must be left out, because [physical] already gives A", "mine.csv", "--scene", "scene.toml", "--A", "3"),
        ("sweep.toml: axes = eps: must be of one value each", "mine.csv", "--scene", "sweep.toml"),
    ):
        refused(monkeypatch, capsys, words, *arguments)
