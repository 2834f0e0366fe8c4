"""The claims of the paper are tested, files are written, and another configuration gives another verdict."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.batch.trajectory import simulate
from vibrodrive.figures.model import ALPHA, drawing
from vibrodrive.figures.scheme import scheme
from vibrodrive.model.packaged import configurations
from vibrodrive.model.plain import plain
from vibrodrive.model.states import TRANSITIONS, State
from vibrodrive.paper.analysis import PhaseSlip, find_phase_slip
from vibrodrive.paper.claim import CLAIMS, Verdict, judge
from vibrodrive.paper.figures import FIGURES
from vibrodrive.paper.run import SUBJECTS, run_paper
from vibrodrive.paper.session import Session
from vibrodrive.stability.structure import reference_orbit

ROOT = Path(__file__).parents[2]


def test_claims_are_complete_and_have_different_ids():
    assert {f"fig{n:02d}" for n in range(1, 13)} <= set(FIGURES)
    modules = {path.stem for path in (ROOT / "vibrodrive" / "paper").glob("claims_*.py")}
    assert modules == {c.test.__module__.rpartition(".")[2] for c in CLAIMS}  # run.py imports all of them
    assert f"Number of claims: {len(CLAIMS)} (" in (ROOT / "docs" / "claims.md").read_text()
    assert len({c.id for c in CLAIMS}) == len(CLAIMS)
    assert {c.figure for c in CLAIMS} <= set(SUBJECTS)


def test_drawing_shows_each_quantity_and_its_direction():
    ax = drawing().axes[0]
    labels = " ".join(t.get_text() for t in ax.texts)
    for shown in ("gap $x$", r"\xi", "F_H", r"\mu", r"\alpha", "mg", r"a_0 \sin", "obstacle", "$m$"):
        assert shown in labels, shown
    # the xy of an annotation is the head of the arrow, and xyann is the tail
    ways = [
        math.degrees(math.atan2(a.xy[1] - a.xyann[1], a.xy[0] - a.xyann[0]))
        for a in ax.texts
        if getattr(a, "arrow_patch", None) is not None
    ]
    # directions in degrees: adhesive force down the incline, weight, and ξ, ξ' and y up the incline
    assert sorted(ways) == pytest.approx([ALPHA - 180, -90, ALPHA, ALPHA, ALPHA])


def test_scheme_shows_exactly_the_transitions():
    ax = scheme({(State.UP, State.STICK)}).axes[0]
    arrows = [a for a in ax.texts if getattr(a, "arrow_patch", None) is not None]
    assert len(arrows) == len(TRANSITIONS)
    thick = [a for a in arrows if a.arrow_patch.get_linewidth() > 1]
    assert len(thick) == 1
    labels = [t.get_text() for t in ax.texts]
    for function in ("S_1", "S_2", "S_3", "S_4", "S_5"):
        assert any(function in text for text in labels)
    heads = np.array([a.xy for a in arrows])
    apart = np.linalg.norm(heads[:, None] - heads, axis=2) + 9 * np.eye(len(heads))
    assert apart.min() > 0.15, "the heads of two arrows must be apart"


def test_numbers_become_json():
    numbers = [
        np.float64(1.5),
        np.int64(2),
        np.bool_(True),
        np.nan,
        [np.inf, (1,)],
        np.array([1.0, np.nan]),
        np.array(3),
    ]
    assert plain(numbers) == [1.5, 2, True, None, [None, [1]], [1.0, None], 3]
    json.dumps(plain(numbers), allow_nan=False)


def test_unknown_figure_is_named_and_nothing_is_written(tmp_path):
    with pytest.raises(ValueError, match=r"figure = 'fig99': must be one of fig01, "):
        run_paper(tmp_path / "out", ["fig99"])
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def some(tmp_path_factory):
    """Return (folder, result, printed lines) of a run of the fast figures with the original configurations."""
    out = tmp_path_factory.mktemp("paper")
    lines = []
    return out, run_paper(out, ["fig02", "fig04", "fig08", "fig09", "fig12"], lines.append), lines


def verdicts(result):
    return {j.id: j.verdict for j in result.claims}


@pytest.mark.jit
def test_files_are_written_and_can_be_read(some):
    out, result, lines = some
    for name in ("fig02", "fig04", "fig08", "fig09", "fig12"):
        for ending in (".png", ".pdf"):
            assert (out / f"{name}{ending}").stat().st_size > 1000
    assert all(path.exists() for path in result.files)
    sections = vd.load(out / "fig09.h5")
    assert sections.section.shape == (3, 1500, 2)
    assert any(line.startswith("fig09") for line in lines)
    assert any("near-limit" in line for line in lines)
    table = (out / "claims.md").read_text()
    for judged in result.claims:
        assert judged.title in table
    document = json.loads((out / "claims.json").read_text())
    assert [c["id"] for c in document["claims"]] == [j.id for j in result.claims]
    assert all(c["verdict"] in list(Verdict) for c in document["claims"])


@pytest.mark.jit
def test_verdicts_of_some_claims(some):
    _, result, _ = some
    found = verdicts(result)
    assert found["two-solutions"] == Verdict.REPRODUCED
    assert found["step-kept"] == Verdict.REPRODUCED
    assert found["step-lost"] == Verdict.REPRODUCED
    assert found["near-limit"] == Verdict.CORRECTED
    assert found["basic-motion"] == Verdict.REPRODUCED
    assert found["transient"] == Verdict.REPRODUCED
    near = next(j for j in result.claims if j.id == "near-limit").record["numbers"]
    assert near["rho"] == pytest.approx(0.87, abs=0.005)
    assert (near["kept_printed"], near["kept_drawn"]) == (False, True)
    assert 0.01 < near["k2_at_section"] < 0.05 < near["last_kept_at_section"]  # 0.01 and 0.05 are drawn in Fig. 9


@pytest.mark.jit
@pytest.mark.slow("7 s: four figures with their claims")
def test_changed_configurations_change_verdicts(some, tmp_path, monkeypatch):
    configs = tmp_path / "configs"
    shutil.copytree(configurations(), configs)

    def change(name, old, new):
        path = configs / f"{name}.toml"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))

    change("fig04", "xi0 = [0.0, 2.0]", "xi0 = [0.0, 0.1]")
    change("fig08", "dtau = [0.5, 0.7]", "dtau = [0.5, 0.6]")
    change("fig09", "dtau = [0.01, 0.05, 0.242]", "dtau = [0.01, 0.07, 0.242]")
    change("fig12", "dtau = 0.1", "dtau = 0.09")
    monkeypatch.setattr("vibrodrive.paper.run.configurations", lambda: configs)
    before = verdicts(some[1])
    after = verdicts(run_paper(tmp_path / "out", ["fig04", "fig08", "fig09", "fig12"]))
    assert before["two-solutions"] != after["two-solutions"] == Verdict.NOT
    assert before["step-lost"] != after["step-lost"] == Verdict.NOT
    assert before["near-limit"] != after["near-limit"] == Verdict.NOT
    assert before["basic-motion"] != after["basic-motion"] == Verdict.NOT
    assert before["step-kept"] == after["step-kept"] == Verdict.REPRODUCED


@pytest.mark.jit
def test_configuration_without_a_period_is_judged(tmp_path):
    configs = tmp_path / "configs"
    shutil.copytree(configurations(), configs)
    path = configs / "fig12.toml"
    path.write_text(path.read_text().replace("transient = 1000", "transient = 0").replace("A = 3.04", "A = 3.057"))
    session = Session(configs, tmp_path, lambda line: None)
    claim = next(c for c in CLAIMS if c.id == "basic-motion")
    outcome = judge(claim, session)
    assert outcome.verdict == Verdict.NOT
    assert "no period" in outcome.text


@pytest.mark.jit
def test_basic_motions_precede_and_follow_the_slip_of_fig_12():
    motion = simulate(A=3.04, method="fixed", dtau=0.1, periods=300)
    base = reference_orbit(simulate(A=3.04, transient=1000, periods=16))
    slip = find_phase_slip(motion, base)
    assert isinstance(slip, PhaseSlip)
    assert (slip.usual, slip.odd, slip.basic) == (2, 3, 6)
    spans = [np.diff(s)[0] / (2 * np.pi) for s in (slip.before, slip.during, slip.after)]
    assert np.round(spans).tolist() == [6, 3, 6]
    assert slip.before[1] == slip.during[0]
    assert slip.during[1] == slip.after[0]


@pytest.mark.jit
@pytest.mark.slow("60 s: every figure and every claim")
def test_verdicts_of_the_whole_paper(tmp_path):
    result = run_paper(tmp_path)
    assert len(result.claims) == len(CLAIMS)
    found = verdicts(result)
    assert all("cannot be tested" not in j.text for j in result.claims)
    for name in (
        "interruptions",
        "two-points",
        "small-epsilon",
        "limit-epsilon",
        "unique",
        "n-solutions",
        "why-six",
        "rational",
        "all-times",
    ):
        assert found[name] == Verdict.REPRODUCED, name
    for name in ("structure-kept", "near-limit", "precision", "alike", "any-frequency", "computing-time"):
        assert found[name] == Verdict.CORRECTED, name
