"""`vibrodrive validate`: each check holds, and each fails if the result that it checks is wrong."""

import json
import math
import sys
from importlib import import_module

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.cli import cli
from vibrodrive.model.plan import make_plan
from vibrodrive.validation import digits, energy, fingerprint, grazing, identity, peers, run
from vibrodrive.validation.check import Check, Finding, Verdict, judge
from vibrodrive.verdicts import NotApplicable


def verdict(id, seed=1):
    (check,) = [c for c in run.CHECKS if c.id == id]
    return judge(check, seed).verdict


HOLDS = [Finding("a number", 0.5, 1.0)]


@pytest.mark.parametrize(
    ("number", "bound", "holds"),
    [
        (0.5, 1.0, True), (1.0, 1.0, True), (1.5, 1.0, False), (0, 0, True), (1, 0, False), (math.nan, 1.0, False),
        (math.inf, 1.0, False), ("ab", "ab", True), ("ab", "ac", False),
    ],
)  # fmt: skip
def test_number_holds_up_to_its_bound_and_text_if_equal(number, bound, holds):
    assert Finding("", number, bound).holds is holds


def raising(error):
    def check():
        raise error

    return check


def test_verdicts():
    tests = {
        "good": lambda: HOLDS,
        "bad": lambda: [*HOLDS, Finding("another", 2.0, 1.0)],
        "empty": list,
        "broken": raising(ValueError("two\nlines")),
        "cannot": raising(NotApplicable("needs two threads")),
    }
    seen = {name: judge(Check(name, name, test), 1) for name, test in tests.items()}
    seen["lacking"] = judge(Check("lacking", "", list, needs=("math", "no_such_package")), 1)
    assert [str(judged.verdict) for judged in seen.values()] == ["holds", *["fails"] * 3, *["not done"] * 2]
    assert seen["broken"].text == "stopped with ValueError: two lines"
    assert seen["lacking"].text == "needs no_such_package"
    seeded = judge(Check("drawn", "", lambda seed: [Finding("seed", float(seed), 7.0)], drawn=True), 8)
    assert seeded.verdict is Verdict.FAILS


def test_command_writes_both_files_and_returns_1_after_a_failure(monkeypatch, tmp_path, capsys):
    checks = [Check("good", "A | B", lambda: HOLDS), Check("lacking", "Digits", list, ("no_such_package",))]
    monkeypatch.setattr(run, "CHECKS", checks)
    command = ["validate", "-o", str(tmp_path / "out"), "--seed", "5"]
    assert cli.main(command, standalone_mode=False) == 0
    document = json.loads((tmp_path / "out/validation.json").read_text())
    assert document["seed"] == 5
    assert [c["verdict"] for c in document["checks"]] == ["holds", "not done"]
    assert document["checks"][0]["findings"] == [{"what": "a number", "number": 0.5, "bound": 1.0, "holds": True}]
    page = (tmp_path / "out/validation.md").read_text()
    assert "Number of checks: 2 (holds: 1, fails: 0, not done: 1)" in page
    assert "**not done**: needs no_such_package" in page
    assert r"A \| B" in page
    checks.append(Check("bad", "Bad", lambda: [Finding("x", math.inf, 1.0)]))
    assert cli.main(command, standalone_mode=False) == 1
    assert json.loads((tmp_path / "out/validation.json").read_text())["checks"][2]["findings"][0]["number"] is None
    assert cli.main([*command, "--only", "good"], standalone_mode=False) == 0
    with pytest.raises(Exception, match=r"only = 'nonsense': must be one of good, lacking, bad"):
        cli.main([*command, "--only", "nonsense"], standalone_mode=False)


def test_ids_of_checks_are_different():
    assert len({c.id for c in run.CHECKS}) == len(run.CHECKS)


@pytest.mark.jit
@pytest.mark.parametrize("id", ["hash", "energy", "threads", "resume"])
def test_short_checks_hold(id):
    assert verdict(id) is Verdict.HOLDS


def test_hash_fails_for_another_sweep(monkeypatch):
    monkeypatch.setattr(fingerprint, "SCENES", {"A": [1.5], "eps": [0.0], "transient": 0, "periods": 1})
    assert verdict("hash") is Verdict.FAILS


@pytest.mark.jit
def test_fixed_scenes_hold_and_fail_for_a_slightly_different_scene(monkeypatch):
    monkeypatch.setattr(digits, "SCENES", {"one": {"A": 1.5, "periods": 5}})
    assert verdict("digits") is Verdict.HOLDS
    honest = vd.simulate

    def off(**arguments):
        return honest(**{**arguments, "A": arguments["A"] + 1e-9})

    monkeypatch.setattr("vibrodrive.validation.agreement.simulate", off)
    assert verdict("digits") is Verdict.FAILS


@pytest.mark.jit
def test_drawn_scenes_hold_and_fail_for_another_scene(monkeypatch):
    monkeypatch.setattr(digits, "draw", lambda seed, draw=digits.draw: draw(seed, 8))
    assert verdict("drawn", seed=3) is Verdict.HOLDS
    honest = vd.simulate
    monkeypatch.setattr("vibrodrive.validation.agreement.simulate", lambda **a: honest(**{**a, "A": a["A"] + 0.3}))
    states, residual = digits.drawn_scenes(3)
    assert not states.holds
    assert residual.holds
    monkeypatch.setattr(digits, "oscillator", lambda motion, of=digits.oscillator: of(honest(A=2.0, periods=1)))
    assert not digits.drawn_scenes(3)[1].holds


def test_drawn_scenes_follow_from_the_seed():
    assert digits.draw(1) == digits.draw(1)
    assert digits.draw(1) != digits.draw(2)


@pytest.mark.jit
def test_grazing_ladder_holds_and_fails_for_lower_flights(monkeypatch):
    monkeypatch.setattr(grazing, "THROWS", {k: grazing.THROWS[k] for k in ("undisturbed", "steep")})
    assert verdict("grazing") is Verdict.HOLDS
    honest = vd.simulate
    monkeypatch.setattr(grazing, "simulate", lambda **a: honest(**{**a, "xi0": a["xi0"] - 2e-4}))
    wrong, _ = grazing.grazing_ladder()
    assert not wrong.holds


@pytest.mark.jit
def test_phases_hold_and_fail_for_a_wrong_clock(monkeypatch):
    clocks = import_module("vibrodrive.validation.clocks")
    monkeypatch.setattr(clocks, "MILLION", 1000)
    assert verdict("million") is Verdict.HOLDS
    honest = vd.simulate

    def late(**arguments):
        motion = honest(**arguments)
        motion.switches["phase"] += 1e-11
        return motion

    monkeypatch.setattr(clocks, "simulate", late)
    assert verdict("million") is Verdict.FAILS


@pytest.mark.jit
@pytest.mark.parametrize("lost", ["friction_loss", "energy", "drive_work"])
def test_balance_fails_for_a_wrong_term(monkeypatch, lost):
    honest = energy.collect

    def off(plan):
        swept = honest(plan)
        getattr(swept, lost)[...] *= 1 + 1e-10
        return swept

    monkeypatch.setattr(energy, "PERIODS", 60)
    monkeypatch.setattr(energy, "collect", off)
    assert verdict("energy") is Verdict.FAILS


@pytest.mark.jit
def test_equality_to_the_bit_fails_for_one_bit(monkeypatch):
    results = vd.sweep(A=[3.04, 1.0], transient=0, periods=3)
    other = vd.sweep(A=[3.04, 1.0], transient=0, periods=3)
    assert identity.differing(results, other) == 0
    other.margin[0] = np.nextafter(other.margin[0], 1.0)
    assert identity.differing(results, other) == 1
    collect = identity.collect

    def one_off(plan, threads=None):
        swept = collect(plan, threads=threads)
        swept.section[0, 0, 0, 0] += 1e-15 if threads == 2 or plan.settings.scan == vd.Scan.LITERAL else 0.0
        return swept

    monkeypatch.setattr(identity, "collect", one_off)
    assert [verdict(id) for id in ("skip", "threads")] == [Verdict.FAILS] * 2


@pytest.mark.jit
def test_resuming_fails_for_other_points(monkeypatch):
    honest = identity.collect
    run = {"A": np.linspace(3.0, 3.25, 700), "eps": [0.0, 1e-4, 2e-4], "tau0": 1e-15, "transient": 5, "periods": 5}
    monkeypatch.setattr(identity, "collect", lambda plan: honest(make_plan(run)))
    lost, differing = identity.resumed_is_uninterrupted()
    assert lost.holds
    assert not differing.holds


@pytest.mark.jit
@pytest.mark.parametrize("id", ["scipy", "heyoka"])
def test_side_by_side(monkeypatch, id):
    pytest.importorskip(id)
    monkeypatch.setattr(peers, "PERIODS", 4)
    assert verdict(id) is Verdict.HOLDS
    honest = vd.simulate
    monkeypatch.setattr(peers, "simulate", lambda **a: honest(**{**a, "A": a["A"] + 1e-7}))
    assert verdict(id) is Verdict.FAILS


@pytest.mark.parametrize("tau", [0.3, 2.0, 4.0, 40.0])
@pytest.mark.parametrize("state", [vd.State.STICK, vd.State.REST])
def test_scan_for_the_end_of_a_rest_finds_the_arcsine(state, tau):
    A, B = 1.5, 0.1

    def H(t):
        return A * math.sin(t) - B

    lift, drop = math.asin((1.0 + B) / A), math.pi + math.asin((1.0 - B) / A)
    releases = [lift, drop] if state == vd.State.STICK else [lift]
    end = tau + min((at - tau) % math.tau for at in releases)
    if H(tau) < 1.0 and (state == vd.State.REST or H(tau) > -1.0):
        assert peers.scanned(H, 1.0)(state, tau) == pytest.approx(end, abs=1e-13)
    assert peers.scanned(lambda t: 0.5, 1.0)(state, tau) == math.inf


def test_checks_without_their_packages_are_not_done(monkeypatch):
    for name in ("scipy", "heyoka", "mpmath"):
        monkeypatch.setitem(sys.modules, name, None)
    assert [verdict(id) for id in ("scipy", "heyoka", "digits")] == [Verdict.NOT_DONE] * 3


def test_ball_laws_are_findings(monkeypatch):
    ball = import_module("vibrodrive.validation.bouncing_ball")
    good = ball.Approach(ball.Law("q", "f", 1.0, 2.0), np.array([1e2, 1e4]), np.array([1.02, 1.0002]))
    bad = ball.Approach(ball.Law("q", "f", 1.0, 3.0), good.B, good.found)
    for approach, holds in ((good, [True, True]), (bad, [True, False])):
        monkeypatch.setattr(ball, "approach", lambda found=approach: [found])
        assert [f.holds for f in ball.findings()] == holds
