"""Claims of the paper: their numbers agree with other computations, and other configurations give other verdicts."""

import shutil

import pytest

from benchmarks.paper.__main__ import CLAIMS
from benchmarks.paper.claim import Verdict
from benchmarks.paper.motions import CONFIGS, Paper


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


@pytest.mark.jit
@pytest.mark.parametrize(
    ("claim", "verdict", "changes"),
    [
        ("two-solutions", Verdict.REPRODUCED, {"fig04": {"xi0 = [0.0, 2.0]": "xi0 = [0.0, 0.1]"}}),
        ("skipped", Verdict.CORRECTED, {"fig08": {"dtau = [0.5, 0.7]": "dtau = [0.5, 0.6]"}}),
        ("basic-motion", Verdict.REPRODUCED, {"fig12": {"dtau = 0.1": "dtau = 0.09"}}),
        ("rational", Verdict.REPRODUCED, {"fig05": {"A = 1.5": "A = 1.5\neta = 100.5"}}),  # this motion has a period
    ],
)
def test_another_configuration_gives_another_verdict(paper, claim, verdict, changes):
    assert outcome(claim, paper()).verdict == verdict
    assert outcome(claim, paper(**changes)).verdict == Verdict.NOT


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
