"""Tests of the stored results of the set of switches (benchmarks/switches).

The results are complete and belong to this version. The tables of the pages show these results.
"""

import json
import lzma
import re

import pytest

from benchmarks import draw, passes, tables
from benchmarks.common import RESULTS
from benchmarks.switches import run, score

PATHS = sorted(passes.RESULTS.glob("level*/*.json"))
STORED = [pytest.param(path, id=f"{path.parent.name}-{path.stem}") for path in PATHS]
DECISIVE = [param for param in STORED if param.id.startswith(("level0", "level1"))]


@pytest.mark.parametrize("path", STORED)
def test_result_has_a_verdict_for_each_case(path):
    result = json.loads(path.read_text(encoding="utf-8"))
    cases = run.cases_of([result["level"]])
    assert path.parts[-2:] == (f"level{result['level']}", f"{path.stem}.json")
    assert path.stem in run.NAMES
    assert result["set"] == (run.HERE / "VERSION").read_text().strip()
    for found in result["runs"]:
        digits = found["digits"].split()
        assert len(found["verdicts"]) == len(digits) == len(cases)
        assert set(found["verdicts"]) <= set(run.LETTERS.values())
        refused = {name for names in found["refused"].values() for name in names}
        letters = dict(zip((case["id"] for case in cases), found["verdicts"], strict=True))
        assert refused <= {name for name, letter in letters.items() if letter == "-"}
        assert all(letter in "rR" for letter, d in zip(found["verdicts"], digits, strict=True) if d != "-")


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


def test_every_method_has_a_label_and_a_row():
    assert {m.label for m in passes.methods()} <= set(passes.NAMES.values())
    _, rows = passes.table(0)
    assert len({row[0] for row in rows}) == len(rows) >= 3


@pytest.mark.parametrize("name", [name for name in tables.TABLES if name.startswith("switches")])
def test_tables_of_the_page_show_the_stored_results(name):
    place = tables.TABLES[name]
    text = place.page.read_text(encoding="utf-8")
    assert re.search(f"<!-- benchmark:{name} -->", text)
    assert tables.fill(text, name, place.make({})) == text


CASE = {"level": 0, "family": "a", "inputs_hex": {"T": (4.0).hex()}, "zeros": ["1.0", "3.0"]}


def test_summary_of_answers():
    answers = {
        "a": ({"zeros": [1.0, 3.0]}, 0.5),
        "b": ({"zeros": [1.0]}, 0.25),
        "c": ({"zeros": [3.0]}, 0.25),
        "d": ("ValueError: no", 0.0),
    }
    cases = [CASE | {"id": name} for name in answers]
    found = run.summary(cases, answers | {"of another level": ("ValueError: no", 0.0)})
    assert found["verdicts"] == "Rrm-"
    assert found["digits"] == "30 30 - -"
    assert found["refused"] == {"ValueError: no": ["d"]}


def test_error_of_a_solver_does_not_end_the_run():
    class Broken:
        @staticmethod
        def zeros(function, T):
            raise ZeroDivisionError("by nothing")

    given, _ = run.timed(Broken, 0, run.WAVES, {}, 0.0)
    assert given == "ZeroDivisionError: by nothing"


def stored(name):
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", ["failures", "accuracy_speed", "first_difference"])
def test_page_shows_the_stored_measurements(name):
    place = tables.TABLES[name]
    text = place.page.read_text(encoding="utf-8")
    assert tables.fill(text, name, place.make(stored(name))) == text


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


def test_points_of_the_chart_have_an_error_if_right():
    data = stored("accuracy_speed")
    for p in data["points"]:
        assert (p["error"] is not None) == p["right"] == (p["until"] == data["periods"])


@pytest.mark.parametrize("chart", draw.charts(), ids=lambda chart: chart.picture.name)
def test_picture_shows_the_stored_measurements(chart):
    assert draw.fingerprint(chart.load()).encode() in chart.picture.read_bytes()


def test_every_wrong_setting_of_the_chart_has_a_cause():
    wrong = [(p["eps"], p["method"], p["value"]) for p in stored("accuracy_speed")["points"] if not p["right"]]
    rows = stored("first_difference")["rows"]
    assert sorted((row["eps"], row["method"], row["value"]) for row in rows) == sorted(wrong)
    assert {row["cause"] for row in rows} <= set(tables.CAUSES)
    assert all(row["depth"] > 0.0 for row in rows if row["cause"] == "sunk")


@pytest.mark.jit
@pytest.mark.parametrize(("method", "value"), [("scan + Newton", 0.001), ("time-stepping", 0.0001)])
def test_cause_of_a_wrong_setting_is_reproduced(method, value):
    pytest.importorskip("mpmath")
    from benchmarks import first_difference

    kept = next(r for r in stored("first_difference")["rows"] if (r["method"], r["value"]) == (method, value))
    made = first_difference.row(next(m for m in first_difference.methods(2e-4) if m.name == method), 2e-4, value)
    assert {key: x for key, x in made.items() if not isinstance(x, float)} == {
        key: x for key, x in kept.items() if not isinstance(x, float)
    }
    assert made["period"] == kept["period"]
