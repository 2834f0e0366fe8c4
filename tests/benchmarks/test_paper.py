"""The paper's figures and claims: their code and its few inner names, the drawings, the page and the command."""

import ast
import json
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
    assert len({c.id for c in CLAIMS}) == len(CLAIMS) == 42
    assert {c.figure for c in CLAIMS} <= set(program.SUBJECTS)


def test_page_has_a_row_for_each_claim():
    text = (HERE / "README.md").read_text()
    assert text.startswith(HEAD.partition("{counts}")[0])
    lines = [line.replace(r"\|", "|") for line in text.splitlines() if line.startswith("| ")]
    ordered = sorted(CLAIMS, key=lambda claim: program.SUBJECTS.index(claim.figure))
    assert [line.split(" | ")[:2] for line in lines[1:]] == [[f"| {claim.figure}", claim.says] for claim in ordered]


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


@pytest.mark.jit
@pytest.mark.slow("3 minutes: every figure and every claim")
def test_page_is_what_comes_out(tmp_path):
    paper, names = Paper(), list(program.SUBJECTS)
    program.draw(paper, names, tmp_path)
    assert {path.stem for path in tmp_path.iterdir()} == set(FIGURES)
    lines, stored = page(program.judge(paper, names)).splitlines(), (HERE / "README.md").read_text().splitlines()
    other = [line for line, kept in zip(lines, stored, strict=True) if line != kept]
    assert all("computing time" in line for line in other), "only measured times may differ"
