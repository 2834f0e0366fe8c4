"""The paper's figures and claims: their code and its few inner names, the drawings, the page and the command."""

import ast
import json
from collections import Counter
from pathlib import Path

import pytest

from benchmarks.paper import __main__ as program
from benchmarks.paper.claim import CLAIMS, HEAD, Verdict, page
from benchmarks.paper.figures import FIGURES
from benchmarks.paper.motions import Paper

HERE = Path(program.__file__).parent

INNER = {
    "figures": {"sheet"},
    "model.config": {"read"},
    "model.states": {"TRANSITIONS"},
    "stability.failures": {"compared"},
    "stability.limit": {"LimitSearch", "plan_limits"},
    "stability.limit_search": {"GRIDS", "search_band"},
    "stability.main_impacts": {"are_main_impacts", "impact_gaps"},
    "stability.structure": {"compare_structure", "deviation", "order", "period", "reference_orbit"},
}
"""Names within the package that the paper's code uses besides the public ones: at most fifteen."""


def test_paper_uses_the_public_face_and_few_inner_names():
    used: dict[str, set[str]] = {}
    for path in HERE.glob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text())))
        plain = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
        assert [name for name in plain if name.startswith("vibrodrive.")] == []
        for node in (n for n in nodes if isinstance(n, ast.ImportFrom) and n.module.startswith("vibrodrive.")):
            used.setdefault(node.module.removeprefix("vibrodrive."), set()).update(a.name for a in node.names)
    assert used == INNER
    assert sum(map(len, INNER.values())) <= 15


def test_claims_are_complete_and_have_different_ids():
    assert {f"fig{n:02d}" for n in range(1, 13)} <= set(FIGURES)
    assert {path.stem for path in HERE.glob("claims_*.py")} == {c.test.__module__.split(".")[-1] for c in CLAIMS}
    assert len({c.id for c in CLAIMS}) == len(CLAIMS) == 45
    assert {c.figure for c in CLAIMS} <= set(program.SUBJECTS)


def test_page_has_a_row_for_each_claim():
    text = (HERE / "README.md").read_text()
    assert text.startswith(HEAD.partition("{counts}")[0])
    lines = [line.replace(r"\|", "|") for line in text.splitlines() if line.startswith("| ")]
    ordered = sorted(CLAIMS, key=lambda claim: program.SUBJECTS.index(claim.figure))
    assert [line.split(" | ")[:2] for line in lines[1:]] == [[f"| {claim.figure}", claim.says] for claim in ordered]
    counts = Counter(line.split("**")[-2] for line in lines[1:])
    assert f"Number of claims: {len(CLAIMS)} ({', '.join(f'{v}: {counts[v]}' for v in Verdict)})." in text


@pytest.mark.jit
def test_command_writes_figures_and_claims(tmp_path, capsys):
    program.main(["-o", str(tmp_path), *(f"--only={name}" for name in ("fig02", "fig04", "fig12"))])
    drawn = {f"{name}{ending}" for name in ("fig02", "fig04", "fig12") for ending in (".png", ".pdf")}
    assert {path.name for path in tmp_path.iterdir()} == drawn | {"claims.json"}
    assert all((tmp_path / name).stat().st_size > 1000 for name in drawn)
    claims = json.loads((tmp_path / "claims.json").read_text())["claims"]
    verdicts = {claim["id"]: claim["verdict"] for claim in claims}
    assert list(verdicts) == ["touching", "two-solutions", "invisible-shift", "basic-motion", "transient"]
    assert set(verdicts.values()) == {Verdict.REPRODUCED}
    with pytest.raises(SystemExit):
        program.main(["-o", str(tmp_path), "--only", "fig99"])
    assert "fig99" in capsys.readouterr().err


MANY_LIMITS = {
    "alike",
    "all-times",
    "any-frequency",
    "any-incline",
    "interruptions-and-limit",
    "precision",
    "sensitivity",
}
"""Claims about many limits, or about every switch of many motions"""


def assert_is_what_comes_out(paper, claims, patch):
    patch.setattr(program, "CLAIMS", claims)
    rows = page(program.judge(paper, list(program.SUBJECTS))).splitlines()[len(HEAD.splitlines()) :]
    other = set(rows) - set((HERE / "README.md").read_text().splitlines())
    assert len(rows) == len(claims)
    assert all("computing time" in row for row in other), "only measured times may differ"


@pytest.mark.jit
@pytest.mark.slow("2 minutes: every figure, and all claims but those about many limits")
def test_page_is_what_comes_out(tmp_path, monkeypatch):
    paper = Paper()
    program.draw(paper, list(program.SUBJECTS), tmp_path)
    assert {path.stem for path in tmp_path.iterdir()} == set(FIGURES)
    assert_is_what_comes_out(paper, [claim for claim in CLAIMS if claim.id not in MANY_LIMITS], monkeypatch)


@pytest.mark.jit
@pytest.mark.release
@pytest.mark.slow("2 minutes: many limits")
def test_claims_about_many_limits_are_what_comes_out(monkeypatch):
    assert_is_what_comes_out(Paper(), [claim for claim in CLAIMS if claim.id in MANY_LIMITS], monkeypatch)
