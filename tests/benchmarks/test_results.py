"""The stored results of the set of switches are complete and of this version, and the tables of the pages show them."""

import json
import lzma
import re

import numpy as np
import pytest

import vibrodrive as vd
from benchmarks import draw, own_scene, passes, ruler, tables
from benchmarks.common import RESULTS
from benchmarks.switches import run, score
from benchmarks.switches.solvers import scan_newton

PATHS = sorted(passes.RESULTS.glob("level*/*.json"))
STORED = [pytest.param(path, id=f"{path.parent.name}-{path.stem}") for path in PATHS]
DECISIVE = [param for param in STORED if param.id.startswith(("level0", "level1"))]


@pytest.mark.parametrize("path", STORED)
def test_every_case_was_asked_and_has_a_verdict(path):
    result = json.loads(path.read_text(encoding="utf-8"))
    cases = run.cases_of([result["level"]])
    assert path.parts[-2:] == (f"level{result['level']}", f"{path.stem}.json")
    assert path.stem in run.NAMES
    assert result["set"] == (run.HERE / "VERSION").read_text().strip()
    for found in result["runs"]:
        digits = found["digits"].split()
        assert len(found["verdicts"]) == len(digits) == len(cases)
        assert set(found["verdicts"]) <= set(run.LETTERS.values())
        refused = sorted(name for names in found["refused"].values() for name in names)
        assert refused == [c["id"] for c, letter in zip(cases, found["verdicts"], strict=True) if letter == "-"]
        ends = (
            rf"{run.LATE} {result['limit']:g} s|{run.ENDED}|\w+: .*"  # what a solver that was asked can do but answer
        )
        assert all(re.fullmatch(ends, reason, re.DOTALL) for reason in found["refused"])
        assert all(letter in "rR" for letter, d in zip(found["verdicts"], digits, strict=True) if d != "-")


@pytest.mark.parametrize("name", sorted({path.stem for path in PATHS}))
def test_every_setting_was_asked_at_every_level(name):
    results = [json.loads(path.read_text(encoding="utf-8")) for path in PATHS if path.stem == name]
    first, *others = [[found["settings"] for found in result["runs"]] for result in results]
    assert all(settings == first for settings in others)
    assert {result["level"] for result in results} in ({0}, {1, 2, 3}, {0, 1, 2, 3})


def test_every_case_is_asked_at_every_setting_and_a_time_out_costs_its_limit(monkeypatch):
    """Also after many time-outs in a family, which once ended the questions to it."""
    module, cases = scan_newton, run.cases_of([0])
    monkeypatch.setattr(module, "SETTINGS", [{}, {}])
    monkeypatch.setattr(run.Solver, "warm_up", lambda *_: None)
    asked = []
    monkeypatch.setattr(run.Solver, "ask", lambda *given: (asked.append(given[2]), (f"{run.LATE} 2 s", 2.0))[1])
    *_, found = run.run(module, cases, [2.0, 20.0], None)
    assert asked == [run.inputs(case) for case in cases] * 2
    for one in found[0][0]["runs"]:
        assert (one["seconds"], one["refused"]) == (2.0 * len(cases), {f"{run.LATE} 2 s": [c["id"] for c in cases]})


@pytest.mark.parametrize("path", DECISIVE)
def test_stored_answers_give_the_stored_verdicts(path):
    result = json.loads(path.read_text(encoding="utf-8"))
    with lzma.open(path.with_suffix(".answers.json.xz"), "rt", encoding="utf-8") as file:
        answers = json.load(file)
    cases = run.cases_of([result["level"]])
    assert answers.keys() == {case["id"] for case in cases}
    for case, *letters in zip(cases, *(found["verdicts"] for found in result["runs"]), strict=True):
        key = "events" if case["level"] else "zeros"
        for letter, first in zip(letters, answers[case["id"]], strict=True):
            verdict = score.judge(case, first if first is None else {key: first})["verdict"]
            assert run.LETTERS[verdict] == letter.lower(), (case["id"], first)


def test_words_about_heyoka_follow_from_its_results():
    result = json.loads((passes.RESULTS / "level0" / "heyoka_events.json").read_text(encoding="utf-8"))
    decidable = [case["verdict"] == "certain" for case in run.cases_of([0])]
    found = {one["settings"]["tol"]: one for one in result["runs"] if "advised" not in one["settings"]}
    wrong = {
        tol: [sure for sure, letter in zip(decidable, one["verdicts"], strict=True) if letter in "miw"]
        for tol, one in found.items()
    }
    assert (wrong[1e-13], [len(names) for names in found[1e-13]["refused"].values()]) == ([False] * 7, [3])
    assert (sum(wrong[1e-10]), sum(wrong[1e-8])) == (6, 17)


def stored(name):
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


MEASURED = ["failures", "accuracy_speed", "first_difference"]


@pytest.mark.parametrize("name", [*(name for name, place in tables.TABLES.items() if not place.source), *MEASURED])
def test_tables_of_the_page_show_the_stored_results(name):
    place = tables.TABLES[name]
    text = place.page.read_text(encoding="utf-8")
    assert re.search(f"<!-- benchmark:{name} -->", text)
    assert tables.fill(text, name, place.make(stored(name) if name in MEASURED else {})) == text


@pytest.mark.jit
def test_no_method_is_its_own_reference():
    at = {"A": 2.4, "B": 0.2, "eps": 0.0, "eta": vd.ETA}
    point = next(own_scene.points(at))
    assert (point["method"], point["right"]) == ("certified", True)
    assert 0.0 < point["error"] < 1e-12


@pytest.mark.jit
@pytest.mark.parametrize("name", ["pair_missed", "wrong_of_three"])
def test_example_of_a_failure_is_reproduced(name):
    pytest.importorskip("mpmath")
    from benchmarks import failures

    made, kept = getattr(failures, name)(), stored("failures")["examples"][name]
    assert all(made[key] == kept[key] for key in ("title", "case", "caption"))


def test_examples_name_cases_of_the_set():
    ids = {case["id"] for case in run.cases_of([0, 1, 2, 3])}
    assert {example["case"] for example in stored("failures")["examples"].values()} <= ids


def test_labels_of_the_chart_cover_neither_each_other_nor_a_mark():
    fig = draw.chart(draw.stored_dated("accuracy_speed"))
    fig.draw_without_rendering()
    for ax in fig.axes:
        boxes = {text.get_text(): text.get_window_extent().shrunk(0.98, 0.9) for text in ax.texts}
        marks = np.concatenate([ax.transData.transform(line.get_xydata()) for line in ax.lines])
        for name, box in boxes.items():
            assert not [other for other in boxes if other != name and box.overlaps(boxes[other])], name
            assert not [at for at in marks if box.contains(*at)], name
    draw.plt.close(fig)


def test_stored_limits_of_five_disturbances_are_complete():
    data = stored("ruler")
    assert data["A"] == list(ruler.AMPLITUDES)
    assert set(data["limits"]) == set(ruler.NAMES)
    for found in data["limits"].values():
        assert len(found["points"]) == len(data["A"])
        assert all(row["k2"] > row["kept_below"] > 0 for row in found["points"] if row)
    assert ruler.markdown(data) in ruler.PAGE.read_text(encoding="utf-8")


@pytest.mark.jit
def test_stored_limit_equals_that_of_the_package():
    data = stored("ruler")
    row = data["limits"]["dtau"]["points"][data["A"].index(ruler.PAPER)]
    found = vd.limit(ruler.PAPER, "dtau")
    assert (row["k2"], row["last_kept"]) == pytest.approx((found.k2, found.last_kept))
