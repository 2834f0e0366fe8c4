"""Claims about single switches on a grid. Their results agree with other computations and depend on configurations."""

import math

import numpy as np
import pytest

import vibrodrive as vd
from tests.paper.test_claims_limits import axis, outcome, session  # noqa: F401 (a fixture)
from vibrodrive.model.plan import make_plan
from vibrodrive.paper import claims_limits, claims_switches, zeros
from vibrodrive.paper.claim import Verdict
from vibrodrive.paper.figures import FIGURES
from vibrodrive.stability.failures import compared

DTAU = 'dtau = {start = 1e-3, stop = 2.0, num = 40, scale = "log"}'


@pytest.mark.jit
def test_skipped_sticking_is_found_in_the_sequence_of_states(session):  # noqa: F811
    found = outcome("skipped", session())
    assert found.verdict == Verdict.CORRECTED
    motion = vd.simulate(1.5, method="fixed", dtau=0.7, transient=999, periods=claims_switches.LONG)
    states = "".join("UDSRI"[s] for s in motion.switches["after"])
    assert states.count("UDIR") == found.record["numbers"]["without"]
    assert states.count("USDIR") + states.count("UDIR") == claims_switches.LONG
    kept = outcome("skipped", session(fig08={"dtau = [0.5, 0.7]": "dtau = [0.5, 0.6]"}))
    assert kept.record["numbers"]["without"] == 0
    assert kept.verdict == Verdict.NOT


@pytest.mark.jit
@pytest.mark.slow("5 s: two maps of failures, each failure followed")
def test_zeros_in_a_step_depend_on_the_parity(session):  # noqa: F811
    found = outcome("zeros-in-step", session(atlas_undisturbed={DTAU: "dtau = [0.7, 1.2, 1.9]"}))
    numbers = found.record["numbers"]
    assert all(n.get("missed, even", 0) + n.get("late, even", 0) > 0 for n in numbers.values())
    assert numbers["fixed"]["wrong, one"] > 0
    assert [zeros.name_of_zeros(n) for n in ([1], [1, 0], [1, 1], [1, 2], [3, 1])] == [
        "one",
        "one",
        "both",
        "even",
        "odd",
    ]
    assert f"{numbers['muller']['judged']} switches with the method muller" in found.text
    assert found.verdict == Verdict.CORRECTED
    fine = {DTAU: "dtau = [1e-4, 1e-3]"}
    assert outcome("zeros-in-step", session(atlas_undisturbed=fine)).verdict == Verdict.NOT  # no switch fails


@pytest.mark.jit
def test_figure_marks_each_failure_by_its_zeros(session):  # noqa: F811
    few = {DTAU: "dtau = [0.7, 1.2, 1.9]", axis("atlas_undisturbed"): "A = [1.3, 1.9]"}
    made = session(atlas_undisturbed=few)
    numbers = outcome("zeros-in-step", made).record["numbers"]
    fixed, muller = FIGURES["zeros"].draw(made).axes
    drawn = {name: set(zip(*line.get_data(), strict=True)) for name, line in zip(zeros.ZEROS, fixed.lines, strict=True)}
    assert (1.9, 0.7) in drawn["one"], "sticking is so short at A = 1.9 that the step passes over it"
    assert not drawn["odd"]
    for name, line in zip(zeros.ZEROS, muller.lines, strict=True):
        count = sum(n for found in numbers.values() for key, n in found.items() if key.endswith(f", {name}"))
        assert line.get_label().endswith(f"({count} switches)")


@pytest.mark.jit
@pytest.mark.parametrize("A", [1.5, 3.04])
def test_step_of_a_fine_grid_has_one_zero(A):
    """In the small step in which a state ends, the switching functions of this state have one zero in total."""
    plan = make_plan({"A": A, "method": "fixed", "dtau": 1e-3, "transient": 200, "periods": 4})
    found = compared(plan)
    for k in range(len(found.behind)):
        assert sum(zeros.zeros_of_step(plan, found, k)) == 1


@pytest.mark.jit
def test_jumps_of_the_state_grow_with_the_step(session):  # noqa: F811
    numbers = outcome("disturbed-switches", session()).record["numbers"]
    assert numbers["Δτ = 0.01"]["dxi"][1] < numbers["Δτ = 0.05"]["dxi"][1] < numbers["Δτ = 0.242"]["dxi"][1]
    assert numbers["Δτ = 0.05"]["dxi"][1] <= 0.05 * (
        3.04 + 1.1
    )  # change of ξ' within one step at the largest acceleration
    assert numbers["Muller's method at Δτ = 1e-05 and tol = 1e-07"]["dxi"][1] < 1e-14


@pytest.mark.jit
def test_fixed_step_misses_a_touch_shallower_than_the_arc_of_a_step(session):  # noqa: F811
    numbers = outcome("touching", session()).record["numbers"]
    assert numbers["certified"] == pytest.approx(1e-13)
    for step in (1e-3, 0.1):
        arc = (
            (3.04 + 1.1) * step**2 / 2
        )  # change of ξ within one step from the lowest point, at the largest acceleration
        assert numbers[f"fixed Δτ = {step:g}"] < 10 * arc


@pytest.mark.jit
def test_two_solutions_have_the_same_section(session):  # noqa: F811
    numbers = outcome("invisible-shift", session()).record["numbers"]
    assert numbers["section"] < 1e-13
    assert numbers["curve"] < 1e-13
    one = session(fig04={"xi0 = [0.0, 2.0]": "xi0 = [0.0, 0.1]"})
    assert "the same solution" in outcome("invisible-shift", one).text


@pytest.mark.jit
def test_bands_are_as_wide_as_the_motions_differ(session):  # noqa: F811
    numbers = outcome("band-beside-band", session()).record["numbers"]
    motion = vd.simulate(1.5, method="fixed", dtau=0.5, transient=999, periods=250)
    sample = motion.sample(200)
    at = [sample.dxi[k:-1:200] for k in range(200)]
    assert numbers["Δτ"]["dxi"] == pytest.approx(np.mean([v.max() - v.min() for v in at]))


@pytest.mark.jit
@pytest.mark.slow("5 s: two searches for a limit, each over a lattice of starts")
def test_limit_of_uniqueness_separates_one_motion_from_several(session):  # noqa: F811
    numbers = outcome("unique-limit", session()).record["numbers"]

    def ends(dtau):
        start = {"xi0": [0.0, 0.5, 2.0, 5.0], "method": "fixed", "dtau": dtau}
        return len(np.unique(vd.sweep(A=3.04, **start, transient=2400, periods=64).section, axis=0))

    assert ends(numbers["dtau"]["ku"]) == 1
    assert ends(0.9 * numbers["dtau"]["ku"]) == 2


@pytest.mark.jit
def test_start_and_disturbance_share_one_distance(session, monkeypatch):  # noqa: F811
    for name, value in {"SHARES_OF_K2": (0.0, 0.9), "HALVINGS": 6, "AFTER": 40}.items():
        monkeypatch.setattr(claims_limits, name, value)
    calm, disturbed = outcome("jointly", session()).record["numbers"]["k1"]
    assert 0 < disturbed < calm < math.inf
    monkeypatch.setattr(claims_limits, "DISTANCE", 0.1)
    assert outcome("jointly", session()).record["numbers"]["k1"][0] < calm


def test_errors_of_the_start_have_one_size_and_all_signs():
    errors = claims_limits._directions()
    sizes = [math.hypot(e["xi0"], e["dxi0"]) + abs(e["tau0"]) for e in errors]
    assert sizes == pytest.approx([1.0] * len(errors))
    signs = {tuple(np.sign(np.round(list(e.values()), 9)).tolist()) for e in errors}
    assert len(signs) == 3**3 - 1, "each combination of signs except (0, 0, 0) must occur"
