"""Claims of the paper about limits of stability.

The results of the claims agree with other computations. If the configuration changes, the results change.
"""

import shutil

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.model.packaged import configurations
from vibrodrive.paper import claims_limits
from vibrodrive.paper.analysis import structures
from vibrodrive.paper.claim import CLAIMS, Verdict, judge
from vibrodrive.paper.run import run_paper
from vibrodrive.paper.session import Session
from vibrodrive.verdicts import NotApplicable


@pytest.fixture
def session(tmp_path):
    """Return a function that makes a session with changed configurations.

    Each keyword argument of the function is the name of a configuration; its value is a dict {old text: new text}.
    """

    def changed(**changes):
        configs = tmp_path / "configs"
        shutil.copytree(configurations(), configs, dirs_exist_ok=True)
        for name, replaced in changes.items():
            path = configs / f"{name}.toml"
            text = path.read_text()
            for old, new in replaced.items():
                assert old in text
                text = text.replace(old, new)
            path.write_text(text)
        return Session(configs, tmp_path, lambda line: None)

    return changed


def outcome(name, session):
    return judge(next(c for c in CLAIMS if c.id == name), session)


def axis(name):
    """Return the line of a configuration that defines its axis of A."""
    text = (configurations() / f"{name}.toml").read_text()
    return next(line for line in text.splitlines() if line.startswith("A = "))


@pytest.mark.jit
def test_alike_names_exceptions(session):
    found = outcome("alike", session(limits={axis("limits"): "A = [2.05, 2.4]"}))
    assert found.verdict == Verdict.NOT
    assert "A = 2.05, n = 1" in found.text
    assert "A = 2.4," not in found.text


@pytest.mark.jit
@pytest.mark.slow("7 s: limits at three frequencies and two amplitudes")
def test_any_frequency_is_corrected_if_the_limit_depends_on_eta(session, monkeypatch):
    monkeypatch.setattr(claims_limits, "TIMES_ETA", (1.0, 3.0, 10.0))
    verdict = {}
    for A in (2.4, 3.1):
        monkeypatch.setattr(claims_limits, "A_OF_PERIODS", (A,))
        verdict[A] = outcome("any-frequency", session()).verdict
    assert verdict == {2.4: Verdict.REPRODUCED, 3.1: Verdict.CORRECTED}


@pytest.mark.jit
def test_incline_changes_the_limit(session, monkeypatch):
    monkeypatch.setattr(claims_limits, "A_OF_INCLINES", (2.8,))
    monkeypatch.setattr(claims_limits, "INCLINES", (0.1, 0.2))
    found = outcome("any-incline", session())
    assert found.record["numbers"]["n"].tolist() == [2, 1]
    assert found.verdict == Verdict.REPRODUCED  # the limits as velocities are 0.24 and 0.3
    monkeypatch.setattr(claims_limits, "INCLINES", (0.1, 0.3))
    assert outcome("any-incline", session()).verdict == Verdict.CORRECTED


@pytest.mark.jit
def test_rational_frequency_gives_its_denominator(session):
    found = outcome("rational", session())
    assert found.verdict == Verdict.REPRODUCED
    assert found.record["numbers"]["period"] == [1, 2, 3, 5, 0]
    two = session(fig05={"A = 1.5": "A = 1.5\neta = 100.5"})
    assert (
        outcome("rational", two).verdict == Verdict.NOT
    )  # at this η, which replaces the paper's irrational η, the motion has a period


def test_points_repeat_after_the_smallest_number_of_periods():
    x = np.tile([[0.0, 1.0], [0.0, 1.0 + 1e-6], [0.0, 1.0]], (7, 1))
    assert claims_limits._repeats(x, 10) == 3
    assert claims_limits._repeats(x[:, ::-1] + np.arange(21)[:, None], 10) == 0


@pytest.mark.jit
@pytest.mark.slow("12 s: limits in ε and Δτ over a range of A")
def test_loss_of_sticking_is_located(session):
    some = {axis("fig03"): "A = {start = 1.905, stop = 1.975, num = 8}"}
    found = outcome("interruptions-and-limit", session(fig03=some))
    assert found.record["numbers"]["stick_vanishes"] == pytest.approx(1.945)
    assert (
        found.verdict == Verdict.CORRECTED
    )  # the loss of sticking has an effect on the limit in Δτ, but not on the limit in ε
    none = session(fig03={axis("fig03"): "A = [1.5, 1.6]"})
    assert "never vanishes" in outcome("interruptions-and-limit", none).text


@pytest.mark.jit
def test_coarse_step_costs_less_than_a_fine_one_and_more_than_exact_switches(session, monkeypatch):
    """The test prescribes the times, because measured times depend on other programs on the machine."""
    monkeypatch.setattr(claims_limits, "_seconds_per_period", lambda arguments: 1e-7 / arguments.get("dtau", 1.0))
    found = outcome("computing-time", session())
    assert found.record["numbers"]["seconds"] == pytest.approx(
        {"muller": 1e-2, "fixed": 1e-2, "coarse": 1e-6, "certified": 1e-7}
    )
    assert found.verdict == Verdict.CORRECTED
    assert outcome("computing-time", session(fig10={"dtau = 0.1": "dtau = 1e-5"})).verdict == Verdict.NOT


@pytest.mark.jit
def test_time_per_period_is_measured():
    point = {"A": np.linspace(3.0, 3.25, 2), "method": "fixed", "dtau": 0.1, "scan": "literal", "transient": 0}
    assert claims_limits._seconds_per_period(point | {"periods": 4}) > 0.0


@pytest.mark.jit
def test_alike_compares_velocities_without_a_figure(session, monkeypatch, tmp_path):
    configs = session(limits={axis("limits"): "A = [2.4]"}).configs
    monkeypatch.setattr("vibrodrive.paper.run.configurations", lambda: configs)
    monkeypatch.setattr("vibrodrive.paper.run.CLAIMS", [c for c in CLAIMS if c.id in ("alike", "two-solutions")])
    result = run_paper(tmp_path / "out", ["limits"])
    (found,) = result.claims
    assert (found.id, found.verdict) == ("alike", Verdict.REPRODUCED)
    eps, dtau = (vd.limit(2.4, kind).k2 for kind in ("eps", "dtau"))
    assert found.record["numbers"]["velocity_eps"] == pytest.approx([eps * 2.4 * 10 * np.sqrt(102)])
    assert found.record["numbers"]["ratio"] == pytest.approx([dtau / (eps * 2.4 * 10 * np.sqrt(102))])
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["claims.json", "claims.md"]


@pytest.mark.jit
def test_structures_omit_motions_without_a_period(session, monkeypatch):
    monkeypatch.setattr("vibrodrive.paper.analysis.SAMPLED", 3)
    level = {"B = 0.1": "B = 0.02"}  # for this B the motion at A = 2.8 has no period
    found = structures(session(fig10=level | {axis("fig10"): "A = [1.9, 2.8]"}), "fig10")
    assert len(found) == 2
    with pytest.raises(NotApplicable, match="no undisturbed motion has a period"):
        structures(session(fig10=level | {axis("fig10"): "A = [2.8, 2.8001]"}), "fig10")
    here = session(fig10={axis("fig10"): "A = [3.02, 3.03]"})
    naive = []
    for A in (3.02, 3.025, 3.03):
        motion = vd.simulate(A, method="fixed", dtau=0.1, transient=500, periods=500)
        after = motion.switches[motion.switches["after"] == vd.State.IMPACT]
        fast = after[after["dxi"] < -1]
        tau = 2 * np.pi * fast["period"] + fast["phase"]
        naive.append(bool((np.rint(np.diff(tau) / (2 * np.pi)) == 2).all()))
    assert [bool(f.impacts) for f in structures(here, "fig10")] == naive
