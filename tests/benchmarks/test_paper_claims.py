"""Claims of the paper: their numbers agree with other computations, and other configurations give other verdicts."""

import math
import shutil

import numpy as np
import pytest

import vibrodrive as vd
from benchmarks.paper import claims_limits, claims_switches, figures, grids, motions
from benchmarks.paper.__main__ import CLAIMS
from benchmarks.paper.claim import Verdict
from benchmarks.paper.motions import CONFIGS, NotApplicable, Paper, find_phase_slip, structures
from vibrodrive.stability.failures import compared
from vibrodrive.stability.structure import reference_orbit


@pytest.fixture
def paper(tmp_path):
    """Return a function that makes a Paper with changed configurations.

    Each keyword argument of the function is the name of a configuration; its value is a dict {old text: new text}.
    """

    def changed(**changes):
        configs = tmp_path / "configs"
        shutil.copytree(CONFIGS, configs, dirs_exist_ok=True)
        for name, replaced in changes.items():
            path = configs / f"{name}.toml"
            text = path.read_text()
            for old, new in replaced.items():
                assert old in text
                text = text.replace(old, new)
            path.write_text(text)
        return Paper(configs)

    return changed


def outcome(name, paper):
    return next(c for c in CLAIMS if c.id == name).judge(paper)


def axis(name):
    """Return the line of a configuration that defines its axis of A."""
    return next(line for line in (CONFIGS / f"{name}.toml").read_text().splitlines() if line.startswith("A = "))


@pytest.mark.jit
@pytest.mark.parametrize(
    ("claim", "verdict", "changes"),
    [
        ("two-solutions", Verdict.REPRODUCED, {"fig04": {"xi0 = [0.0, 2.0]": "xi0 = [0.0, 0.1]"}}),
        ("step-lost", Verdict.REPRODUCED, {"fig08": {"dtau = [0.5, 0.7]": "dtau = [0.5, 0.6]"}}),
        ("skipped", Verdict.CORRECTED, {"fig08": {"dtau = [0.5, 0.7]": "dtau = [0.5, 0.6]"}}),
        ("basic-motion", Verdict.REPRODUCED, {"fig12": {"dtau = 0.1": "dtau = 0.09"}}),
        ("rational", Verdict.REPRODUCED, {"fig05": {"A = 1.5": "A = 1.5\neta = 100.5"}}),  # this motion has a period
    ],
)
def test_another_configuration_gives_another_verdict(paper, claim, verdict, changes):
    assert outcome(claim, paper()).verdict == verdict
    assert outcome(claim, paper(**changes)).verdict == Verdict.NOT


@pytest.mark.jit
@pytest.mark.slow("8 s: two searches for limits in Δτ")
def test_step_of_fig_09_lacks_a_zero(paper):
    found = outcome("near-limit", paper())
    near = found.numbers
    assert near["rho"] == pytest.approx(0.87, abs=0.005)
    assert (near["kept_printed"], near["kept_drawn"], found.verdict) == (False, True, Verdict.CORRECTED)
    assert 0.01 < near["k2_at_section"] < 0.05 < near["last_kept_at_section"]  # 0.01 and 0.05 are drawn in Fig. 9


@pytest.mark.jit
def test_configuration_without_a_period_is_judged(paper):
    changes = {"transient = 1000": "transient = 0", "A = 3.04": "A = 3.057"}
    found = outcome("basic-motion", paper(fig12=changes))
    assert found.verdict == Verdict.NOT
    assert "no period" in found.text


@pytest.mark.jit
def test_basic_motions_precede_and_follow_the_slip_of_fig_12():
    motion = vd.simulate(A=3.04, method="fixed", dtau=0.1, periods=300)
    slip = find_phase_slip(motion, reference_orbit(vd.simulate(A=3.04, transient=1000, periods=16)))
    assert (slip.usual, slip.odd, slip.basic) == (2, 3, 6)
    spans = [np.diff(s)[0] / (2 * np.pi) for s in (slip.before, slip.during, slip.after)]
    assert np.round(spans).tolist() == [6, 3, 6]
    assert (slip.before[1], slip.during[1]) == (slip.during[0], slip.after[0])


@pytest.mark.jit
def test_alike_names_exceptions_and_compares_velocities(paper, monkeypatch):
    monkeypatch.setattr(claims_limits, "OVER_A", [2.05, 2.4])
    found = outcome("alike", paper())
    assert found.verdict == Verdict.NOT
    assert "A = 2.05, n = 1" in found.text
    assert "A = 2.4," not in found.text
    eps, dtau = (vd.limit(2.4, kind).k2 for kind in ("eps", "dtau"))
    assert found.numbers["velocity_eps"][1] == pytest.approx(eps * 2.4 * 10 * np.sqrt(102))
    assert found.numbers["ratio"][1] == pytest.approx(dtau / (eps * 2.4 * 10 * np.sqrt(102)))


@pytest.mark.jit
@pytest.mark.slow("7 s: limits at three frequencies and two amplitudes")
def test_any_frequency_is_corrected_if_the_limit_depends_on_eta(paper, monkeypatch):
    monkeypatch.setattr(claims_limits, "TIMES_ETA", (1.0, 3.0, 10.0))
    verdict = {}
    for A in (2.4, 3.1):
        monkeypatch.setattr(claims_limits, "A_OF_PERIODS", (A,))
        verdict[A] = outcome("any-frequency", paper()).verdict
    assert verdict == {2.4: Verdict.REPRODUCED, 3.1: Verdict.CORRECTED}


@pytest.mark.jit
def test_incline_changes_the_limit(paper, monkeypatch):
    monkeypatch.setattr(claims_limits, "A_OF_INCLINES", (2.8,))
    monkeypatch.setattr(claims_limits, "INCLINES", (0.1, 0.2))
    found = outcome("any-incline", paper())
    assert found.numbers["n"].tolist() == [2, 1]
    assert found.verdict == Verdict.REPRODUCED  # the limits as velocities are 0.24 and 0.3
    monkeypatch.setattr(claims_limits, "INCLINES", (0.1, 0.3))
    assert outcome("any-incline", paper()).verdict == Verdict.CORRECTED


def test_points_repeat_after_the_smallest_number_of_periods():
    x = np.tile([[0.0, 1.0], [0.0, 1.0 + 1e-6], [0.0, 1.0]], (7, 1))
    assert claims_limits._repeats(x, 10) == 3
    assert claims_limits._repeats(x[:, ::-1] + np.arange(21)[:, None], 10) == 0


@pytest.mark.jit
@pytest.mark.slow("12 s: limits in ε and Δτ over a range of A")
def test_loss_of_sticking_is_located(paper):
    some = {axis("fig03"): "A = {start = 1.905, stop = 1.975, num = 8}"}
    found = outcome("interruptions-and-limit", paper(fig03=some))
    assert found.numbers["stick_vanishes"] == pytest.approx(1.945)
    assert found.verdict == Verdict.CORRECTED, "the loss of sticking affects the limit in Δτ, not the limit in ε"
    none = paper(fig03={axis("fig03"): "A = [1.5, 1.6]"})
    assert "never vanishes" in outcome("interruptions-and-limit", none).text


@pytest.mark.jit
def test_coarse_step_costs_less_than_a_fine_one_and_more_than_exact_switches(paper, monkeypatch):
    """The test prescribes the times, because measured times depend on other programs on the machine."""
    monkeypatch.setattr(claims_limits, "_seconds_per_period", lambda arguments: 1e-7 / arguments.get("dtau", 1.0))
    found = outcome("computing-time", paper())
    assert found.numbers["seconds"] == pytest.approx({"fine": 1e-2, "coarse": 1e-6, "certified": 1e-7})
    assert found.verdict == Verdict.CORRECTED
    assert outcome("computing-time", paper(fig10={"dtau = 0.1": "dtau = 1e-5"})).verdict == Verdict.NOT


@pytest.mark.jit
def test_structures_omit_motions_without_a_period(paper, monkeypatch):
    monkeypatch.setattr(motions, "SAMPLED", 3)
    level = {"B = 0.1": "B = 0.02"}  # for this B the motion at A = 2.8 has no period
    assert len(structures(paper(fig10=level | {axis("fig10"): "A = [1.9, 2.8]"}), "fig10")) == 2
    with pytest.raises(NotApplicable, match="no undisturbed motion has a period"):
        structures(paper(fig10=level | {axis("fig10"): "A = [2.8, 2.8001]"}), "fig10")
    naive = []
    for A in (3.02, 3.025, 3.03):
        motion = vd.simulate(A, method="fixed", dtau=0.1, transient=500, periods=500)
        fast = motion.switches[(motion.switches["after"] == vd.State.IMPACT) & (motion.switches["dxi"] < -1)]
        tau = 2 * np.pi * fast["period"] + fast["phase"]
        naive.append(bool((np.rint(np.diff(tau) / (2 * np.pi)) == 2).all()))
    here = paper(fig10={axis("fig10"): "A = [3.02, 3.03]"})
    assert [bool(f.impacts) for f in structures(here, "fig10")] == naive


@pytest.mark.jit
def test_skipped_sticking_is_found_in_the_sequence_of_states(paper):
    found = outcome("skipped", paper())
    motion = vd.simulate(1.5, method="fixed", dtau=0.7, transient=999, periods=motions.LONG)
    states = "".join("UDSRI"[s] for s in motion.switches["after"])
    assert states.count("UDIR") == found.numbers["without"]
    assert states.count("USDIR") + states.count("UDIR") == motions.LONG


@pytest.mark.jit
@pytest.mark.slow("5 s: each failure over A and Δτ followed")
def test_zeros_in_a_step_are_counted_and_marked(paper, monkeypatch):
    few, fine = ((1.3, 1.9), (0.7, 1.2, 1.9)), ((1.3, 1.9), (1e-4, 1e-3))
    count = grids.failures_by_zeros
    for module in (claims_switches, figures):
        monkeypatch.setattr(module, "failures_by_zeros", lambda method: count(method, *few))
    found = outcome("zeros-in-step", paper())
    numbers = found.numbers
    assert all(n.get("missed, even", 0) + n.get("late, even", 0) > 0 for n in numbers.values())
    assert numbers["fixed"]["wrong, one"] > 0
    assert found.verdict == Verdict.CORRECTED
    fixed, muller = figures.zeros(paper()).axes
    drawn = {name: set(zip(*line.get_data(), strict=True)) for name, line in zip(grids.ZEROS, fixed.lines, strict=True)}
    assert (1.9, 0.7) in drawn["one"], "sticking is so short at A = 1.9 that the step passes over it"
    assert not drawn["odd"]
    for name, line in zip(grids.ZEROS, muller.lines, strict=True):
        total = sum(n for each in numbers.values() for key, n in each.items() if key.endswith(f", {name}"))
        assert line.get_label().endswith(f"({total} switches)")
    monkeypatch.setattr(claims_switches, "failures_by_zeros", lambda method: count(method, *fine))
    assert outcome("zeros-in-step", paper()).verdict == Verdict.NOT  # no switch fails


def test_numbers_of_zeros_have_names():
    counts = ([1], [1, 0], [1, 1], [1, 2], [3, 1])
    assert [grids.name_of_zeros(n) for n in counts] == ["one", "one", "both", "even", "odd"]


@pytest.mark.jit
@pytest.mark.parametrize("A", [1.5, 3.04])
def test_step_of_a_fine_grid_has_one_zero(A):
    """In the small step in which a state ends, the switching functions of this state have one zero in total."""
    motion = vd.simulate(A, method="fixed", dtau=1e-3, transient=200, periods=4)
    found = compared(motion)
    assert {sum(grids.zeros_of_step(motion, found, k)) for k in range(len(found.behind))} == {1}


@pytest.mark.jit
def test_jumps_of_the_state_grow_with_the_step(paper):
    numbers = outcome("disturbed-switches", paper()).numbers
    assert numbers["Δτ = 0.01"]["dxi"][1] < numbers["Δτ = 0.05"]["dxi"][1] < numbers["Δτ = 0.242"]["dxi"][1]
    assert numbers["Δτ = 0.05"]["dxi"][1] <= 0.05 * (3.04 + 1.1)  # change of ξ' in a step at the largest acceleration
    assert numbers["Muller's method at Δτ = 1e-05 and tol = 1e-07"]["dxi"][1] < 1e-14


@pytest.mark.jit
def test_fixed_step_misses_a_touch_shallower_than_the_arc_of_a_step(paper):
    numbers = outcome("touching", paper()).numbers
    assert numbers["certified"] == pytest.approx(1e-13)
    for step in (1e-3, 0.1):
        arc = (3.04 + 1.1) * step**2 / 2  # change of ξ in a step from the lowest point, at the largest acceleration
        assert numbers[f"fixed Δτ = {step:g}"] < 10 * arc


@pytest.mark.jit
def test_two_solutions_have_the_same_section(paper):
    numbers = outcome("invisible-shift", paper()).numbers
    assert max(numbers["section"], numbers["curve"]) < 1e-13
    one = paper(fig04={"xi0 = [0.0, 2.0]": "xi0 = [0.0, 0.1]"})
    assert "the same solution" in outcome("invisible-shift", one).text


@pytest.mark.jit
def test_bands_are_as_wide_as_the_motions_differ(paper):
    numbers = outcome("band-beside-band", paper()).numbers
    sample = vd.simulate(1.5, method="fixed", dtau=0.5, transient=999, periods=250).sample(200)
    at = [sample.dxi[k:-1:200] for k in range(200)]
    assert numbers["Δτ"]["dxi"] == pytest.approx(np.mean([v.max() - v.min() for v in at]))


@pytest.mark.jit
@pytest.mark.slow("5 s: two searches for a limit, each over a lattice of starts")
def test_limit_of_uniqueness_separates_one_motion_from_several(paper):
    numbers = outcome("unique-limit", paper()).numbers

    def ends(dtau):
        start = {"xi0": [0.0, 0.5, 2.0, 5.0], "method": "fixed", "dtau": dtau}
        return len(np.unique(vd.sweep(A=3.04, **start, transient=2400, periods=64).section, axis=0))

    assert ends(numbers["dtau"]["ku"]) == 1
    assert ends(0.9 * numbers["dtau"]["ku"]) == 2


@pytest.mark.jit
@pytest.mark.slow("6 s: two searches for a limit and for the error of a start")
def test_start_and_disturbance_share_one_distance(paper, monkeypatch):
    for name, value in {"SHARES_OF_K2": (0.0, 0.9), "HALVINGS": 6, "AFTER": 40}.items():
        monkeypatch.setattr(claims_limits, name, value)
    calm, disturbed = outcome("jointly", paper()).numbers["k1"]
    assert 0 < disturbed < calm < math.inf
    monkeypatch.setattr(claims_limits, "DISTANCE", 0.1)
    assert outcome("jointly", paper()).numbers["k1"][0] < calm


def test_errors_of_the_start_have_one_size_and_all_signs():
    errors = claims_limits._directions()
    sizes = [math.hypot(e["xi0"], e["dxi0"]) + abs(e["tau0"]) for e in errors]
    assert sizes == pytest.approx([1.0] * len(errors))
    signs = {tuple(np.sign(np.round(list(e.values()), 9)).tolist()) for e in errors}
    assert len(signs) == 3**3 - 1, "each combination of signs except (0, 0, 0) must occur"
