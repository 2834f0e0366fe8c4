"""Tests of examples/audit.py, which compares the switches of another program with certified switches.

Certified switches pass, and each error is reported at the switch at which it occurs.
"""

import dataclasses
import sys

import numpy as np
import pytest

import vibrodrive as vd
from examples import audit as example
from examples.audit import MISSED, OTHER, RIGHT, Switch, audit, read, report


def certified(A, eps=0.0, periods=6):
    """Return the switches of a certified motion, impacts left out, as `Switch` with the state that begins there."""
    rows = vd.simulate(A, eps=eps, transient=0, periods=periods).switches
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


def test_late_switch_is_counted_once():
    switches = certified(1.5)
    late = dataclasses.replace(switches[4], tau=switches[4].tau + 1e-3)
    judged = audit([*switches[:4], late, *switches[5:]], 1.5)
    assert [j.verdict for j in judged] == [RIGHT] * len(judged)
    assert judged[3].late == pytest.approx(1e-3, abs=1e-9)
    assert sum(abs(j.late) > 1e-4 for j in judged) == 1


def test_omitted_switch_is_missed_and_wrong_state_is_reported():
    switches = certified(1.5)
    without = audit([*switches[:5], *switches[7:]], 1.5)
    assert [j.verdict for j in without if j.verdict != RIGHT] == [MISSED]
    wrong = dataclasses.replace(switches[5], state="DOWN" if switches[5].state != "DOWN" else "UP")
    first = next(j for j in audit([*switches[:5], wrong, *switches[6:]], 1.5) if j.verdict != RIGHT)
    assert (first.verdict, first.switch) == (OTHER, wrong)


def test_file_is_read_and_reported(tmp_path, monkeypatch, capsys):
    path = tmp_path / "mine.csv"
    switches = certified(1.5)
    lines = [f"{s.tau!r},{s.xi!r},{s.dxi!r}, {s.state}" for s in switches]
    path.write_text("\n".join(["tau,xi,dxi,state", *lines]).replace("np.float64(", "").replace(")", ""))
    assert read(str(path)) == switches
    monkeypatch.setattr(sys, "argv", ["audit", str(path), "--A", "1.5"])
    example.main()
    assert capsys.readouterr().out.startswith(f"{len(switches) - 1} switches: {len(switches) - 1} right, 0 missed, 0")
    assert "first at" in report(audit([switches[0], *switches[3:]], 1.5))
