"""The cases of the set of switches satisfy the schema and can be made again, and score.py gives the right verdicts."""

import csv
import json
import math
import random
import re
import runpy
import shutil
import subprocess
import sys
from decimal import Decimal
from functools import cache
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import pytest
from jsonschema import Draft202012Validator

from benchmarks.switches import make, run, score
from benchmarks.switches.solvers import vibrodrive_paths

FOLDER = Path(score.__file__).parent
SCHEMA = Draft202012Validator(json.loads((FOLDER / "schema.json").read_text(encoding="utf-8")))
LEVELS = (0, 1, 2, 3)


@cache
def stored(level):
    """Return the cases of a level by their ids."""
    paths = sorted((FOLDER / "cases" / f"level{level}").glob("*.json"))
    return {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in paths}


def values(case):
    """Return the inputs of a case as doubles, by their names."""
    return {name: float.fromhex(value) for name, value in case["inputs_hex"].items()}


def digits(number):
    """Return the number of significant digits of a number given as text."""
    return len(re.sub(r"e.*|\D", "", number).lstrip("0"))


@pytest.mark.parametrize("level", LEVELS)
def test_every_case_matches_the_schema(level):
    for name, case in stored(level).items():
        assert SCHEMA.is_valid(case), name
        assert (case["id"], case["level"]) == (name, level)
        exact = values(case)
        assert [(key, float(value)) for key, value in case["inputs"].items()] == [*exact.items()], name
        numbers = [*case.get("zeros", []), *case.get("slopes", [])]
        numbers += [e[k] for e in case.get("events", []) for k in ("tau", "xi", "dxi", "slope", "nearest_other_zero")]
        assert {digits(n) for n in numbers if n and n != "0"} <= {30}, name


VIOLATIONS = [
    ("L0-plain-01", {"level": 4}), ("L0-plain-01", {"zeros": [1.5]}), ("L0-plain-01", {"verdict": "either"}),
    ("L0-plain-01", {"events": []}), ("L0-double-zero-17", {"answers": []}), ("L1-plain-01", {"zeros": []}),
    ("L1-plain-01", {"inputs_hex": {"A": "3.04"}}), ("L2-paper-01", {"events": [{"tau": "1.5"}]}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "change"), VIOLATIONS)
def test_violation_of_the_schema_is_found(name, change):
    assert not SCHEMA.is_valid(stored(int(name[1]))[name] | change)


def test_sizes_of_the_set_agree_with_its_readme():
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    assert [int(n) for n in re.findall(r"^\| [0-3] \| (\d+) \|", text, re.M)] == [
        len(stored(level)) for level in LEVELS
    ]
    assert sum(len(stored(level)) for level in LEVELS) == int(re.search(r"(\d+) problems", text)[1])
    for level in LEVELS:
        for family, (count, _) in make.DRAWN[level].items():
            assert len([c for c in stored(level).values() if c["family"] == family]) == count
            assert re.search(rf"^\| {family}( \(level {level}\))? \| (\d+, )?{count}(, \d+)? \|", text, re.M), family
    assert (FOLDER / "VERSION").read_text(encoding="utf-8") == f"{make.VERSION}\n"
    assert f"Version {make.VERSION}." in text


def test_zeros_are_in_order_and_their_slopes_agree():
    for name, case in stored(0).items():
        zeros, slopes, multiplicities = case["zeros"], case["slopes"], case["multiplicities"]
        assert len(zeros) == len(slopes) == len(multiplicities), name
        at = [Decimal(0), *map(Decimal, zeros)]
        assert all(a < b for a, b in pairwise(at)), name
        assert at[-1] <= Decimal(values(case)["T"]), name
        assert [s == "0" for s in slopes] == [m == 2 for m in multiplicities], name
        signs = [Decimal(s) > 0 for s, m in zip(slopes, multiplicities, strict=True) if m == 1]
        assert all(a != b for a, b in pairwise(signs)), name  # the function cannot cross 0 twice in one direction
        assert case.get("answers", [zeros])[0] == zeros, name


@pytest.mark.parametrize("level", [1, 2, 3])
def test_table_agrees_with_the_cases(level):
    with open(FOLDER / f"level{level}.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    events = [(name, e) for name, case in stored(level).items() for e in case["events"]]
    assert len(rows) == len(events)
    for row, (name, event) in zip(rows, events, strict=True):
        assert row.keys() == {"id", "tau", "before", "after", "xi", "dxi"}
        assert [row["id"], row["before"], row["after"]] == [name, event["before"], event["after"]]
        for key in ("tau", "xi", "dxi"):
            assert float(row[key]) == float(event[key])
        assert Decimal(event["slope"]) < 0 if event["slope"] else event["before"] == "IMPACT"
        assert not event["nearest_other_zero"] or Decimal(event["nearest_other_zero"]) > 0
    for case in stored(level).values():
        x = values(case)
        assert float(case["certain_until"]) <= x["tau0"] + 2 * math.pi * x["periods"] + 1e-6


def drawn():
    """Return the tasks that make ten random cases of levels 0 to 2, each within a second."""
    quick = [task for task in make.tasks() if task.name not in ("late", "known", "disturbed", "another incline")]
    pools = [[t for t in quick if t.level == level] for level in (0, 1)]
    pools.append([t for t in quick if t.level == 2 and t.name == "paper" and t.number in (1, 2, 3, 4)])
    draw = random.Random(33)
    return [task for pool, count in zip(pools, (5, 4, 1), strict=True) for task in draw.sample(pool, count)]


@pytest.mark.parametrize("task", drawn(), ids=lambda task: task.id)
def test_case_is_reproduced_to_the_byte(task):
    made, text = make.make(task)
    assert made == task
    path = FOLDER / "cases" / f"level{task.level}" / f"{task.id}.json"
    assert text.encode() == path.read_bytes()


@pytest.mark.jit
@pytest.mark.parametrize("name", ["L2-paper-07", "L3-hard-spot-01"])
def test_certified_method_agrees(name):
    case = stored(int(name[1]))[name]
    verdict = score.judge(case, run.answer(vibrodrive_paths, case["level"], values(case), {"method": "certified"}))
    assert verdict["verdict"] == "right"
    assert verdict["digits"] > 10


def test_answers_shorter_than_a_tick_take_time():
    """While a limit of CPU time is set, Linux counts the CPU time of a process in whole ticks."""

    class Sums:
        zeros = staticmethod(lambda function, T: [float(sum(range(1000)))])

    assert all(run.timed(Sums, 0, run.WAVES, {}, 2.0)[1] > 0.0 for _ in range(30))


FAR, PAIR = ["1.0", "3.0"], ["1.0", "1.0000003"]


def zero_case(zeros=FAR, **fields):
    """Return the fields of a case of level 0 that score.py reads, with T = 4."""
    return {"id": "L0-a", "level": 0, "family": "a", "inputs_hex": {"T": (4.0).hex()}, "zeros": zeros} | fields


def event(tau, before="UP", after="DOWN", near=None):
    """Return the fields of an event that score.py reads."""
    return {"tau": tau, "before": before, "after": after, "nearest_other_zero": near}


TWO = [event("1.0"), event("2.0", "DOWN", "STICK", near="0.0000003")]


def motion_case(events=TWO, level=2, **fields):
    """Return the fields of a case of levels 1 to 3 that score.py reads."""
    return {"id": "L2-a", "level": level, "family": "a", "events": events, "certain_until": "9.0"} | fields


NEAR = ["0.0000003"]  # the start counts as a zero, so the tolerance is smaller

ON_ZEROS = {
    "right": [
        (FAR, ["1.0000009", 3.0]), (FAR, [0.9999991, 3]), (FAR, [1]), (FAR, [1, 2, 3]), (FAR, [1, 3, 4.5]), ([], []),
        (PAIR, ["1.00000009", "1.0000003"]), (NEAR, ["0.00000039"]),
    ],
    "missed": [(FAR, [3]), (FAR, [1.0000011]), (FAR, []), (FAR, [5]), (PAIR, ["1.00000011"]), (NEAR, ["0.00000041"])],
    "invented": [
        (FAR, [0, 1, 3]), (FAR, [0.999998, 1, 3]), ([], [2]), (PAIR, ["0.99999989"]), (NEAR, ["0"]),
        (FAR, ["1e-1000000"]),
    ],
    "refused": [
        (FAR, answer) for answer in (None, 1, ["1,0"], [True], [None], ["nan"], [math.inf], ["1e1000000"], [[1]])
    ],
}  # fmt: skip
"""Pairs (zeros of a case, answer) by their verdict."""

ON_EVENTS = {
    "right": [
        [[1, "UP", "DOWN"], [2, "DOWN", "STICK"]],
        [[1.0000009, "UP", "DOWN"], ["2.00000009", "DOWN", "STICK"]],
        [[1, "UP", "DOWN"], [2, "DOWN", "STICK"], [9.5, "STICK", "UP"]],  # the last event is after certain_until
    ],
    "missed": [[[1, "UP", "DOWN"], ["2.00000011", "DOWN", "STICK"]], [[1, "UP", "DOWN"]], [], [[2, "DOWN", "STICK"]]],
    "invented": [
        [[1, "UP", "DOWN"], [1.5, "DOWN", "UP"], [2, "UP", "STICK"]],
        [[1, "UP", "DOWN"], [2, "DOWN", "STICK"], [3, "STICK", "UP"]],
        [[1, "UP", "DOWN"], ["1.99999989", "DOWN", "STICK"]],
    ],
    "wrong event": [[[1, "UP", "STICK"], [2, "STICK", "UP"]], [[1, "UP", "DOWN"], [2, "DOWN", "IMPACT"]]],
    "refused": [[[1, "UP"]], [1, 2], [["one", "UP", "DOWN"]], None],
}


@pytest.mark.parametrize("verdict", ON_ZEROS)
def test_verdicts(verdict):
    for zeros, answer in ON_ZEROS[verdict]:
        assert score.judge(zero_case(zeros), {"zeros": answer})["verdict"] == verdict, (zeros, answer)
    for answer in ON_EVENTS.get(verdict, ()):
        assert score.judge(motion_case(), {"events": answer})["verdict"] == verdict, answer


def test_all_zeros_and_the_first_event_are_judged_where_the_level_says_so():
    assert [score.judge(zero_case(), {"zeros": z})["all"] for z in ([1, 3], [1], [1, 2, 3])] == [True, False, False]
    case = motion_case(TWO[:1], level=1)
    assert score.judge(case, {"events": [[1, "UP", "DOWN"], [7, "DOWN", "REST"]]})["verdict"] == "right"
    assert score.judge(case, {"events": [[1, "UP", "STICK"]]})["verdict"] == "wrong event"


def test_each_answer_to_an_undecided_case_is_right():
    case = zero_case(verdict="either", answers=[FAR, []])
    for zeros, verdict in (([1, 3], "right"), ([], "right"), ([3], "missed")):
        assert score.judge(case, {"zeros": zeros})["verdict"] == verdict
    motion = motion_case(verdict="either", answers=[TWO[1:], []], certain_until="1.5")
    for events, verdict in (([[1, "UP", "DOWN"], [1.7, "a", "b"]], "right"), ([], "missed")):
        assert score.judge(motion, {"events": events})["verdict"] == verdict


def test_digits_are_of_the_relative_error():
    digits = [score.judge(zero_case(["2.0"]), {"zeros": [z]})["digits"] for z in ("2.00000002", "1.9999998", "2")]
    assert digits == pytest.approx([8.0, 7.0, 30.0], abs=1e-12)


@pytest.mark.parametrize("level", LEVELS)
def test_stored_answers_are_right(level):
    for name, case in stored(level).items():
        exact = case["events" if level else "zeros"]
        for known in [exact, *(case.get("answers", []) if level < 2 else [])]:
            answer = {"events": [[e["tau"], e["before"], e["after"]] for e in known]} if level else {"zeros": known}
            found = score.judge(case, answer)
            assert found["verdict"] == "right", name
            assert found["all"] == (level == 0), name
            if known == exact and known:
                assert found["digits"] > 27, name


BOTH = (zero_case(verdict="certain"), motion_case(verdict="certain"))


@pytest.fixture
def judged(tmp_path, monkeypatch, capsys):
    """Return a function that runs score.py on cases and an answers file and returns (exit code, stdout, stderr)."""

    def call(sent, *options, cases=BOTH):
        for case in cases:
            path = tmp_path / "cases" / f"level{case['level']}" / f"{case['id']}.json"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps(case), encoding="utf-8")
        answers = tmp_path / "answers.json"
        if sent is not None:
            answers.write_text(sent if isinstance(sent, str) else json.dumps(sent), encoding="utf-8")
        folder = str(tmp_path / "cases")
        monkeypatch.setattr(sys, "argv", ["score.py", str(answers), "--cases", folder, *map(str, options)])
        return score.main(), *capsys.readouterr()

    return call


def test_table_counts_verdicts(judged):
    sent = {"solver": "hand", "version": "2", "settings": "none", "seconds": {"L0-a": 0.25}}
    code, out, err = judged(sent | {"answers": {"L0-a": {"zeros": [1]}, "L2-a": {"events": []}, "L9-a": {}}})
    assert (code, err) == (0, "")
    lines = [re.split(r" {2,}", line.strip()) for line in out.splitlines()]
    assert ["hand 2 none"] in lines
    assert ["0", "a", "1", "1", "0", "0", "0", "0", "100.0", "0.0", "30.0", "30.0", "0.25"] in lines
    assert ["2", "all", "1", "0", "1", "0", "0", "0", "0.0"] in lines
    assert re.search(r"^L0-a +right +30\.0$", out, re.M)
    assert re.search(r"^L2-a +missed$", out, re.M)
    assert "1 answers have an id that no case has" in out


@pytest.mark.parametrize("sent", [None, "{", "[]", '{"answers": 1}', '{"answers": {}, "seconds": [1]}', "[" * 100_000])
def test_unreadable_file_ends_with_code_2(judged, sent):
    code, out, err = judged(sent)
    assert (code, out, "not readable as answers" in err) == (2, "", True)


def test_junit(judged, tmp_path):
    cases = [zero_case(id=f"L0-{name}") for name in "abc"]
    answers = {"L0-a": {"zeros": [1, 3]}, "L0-b": {"zeros": [3]}}
    code, _, _ = judged({"answers": answers, "seconds": {"L0-b": 2}}, "--junit", tmp_path / "out.xml", cases=cases)
    suite = ElementTree.parse(tmp_path / "out.xml").getroot()
    assert code == 0
    assert [suite.get(k) for k in ("tests", "failures", "skipped")] == ["3", "1", "1"]
    found = {test.get("name"): [(e.tag, e.get("message")) for e in test] for test in suite}
    assert found == {"L0-a": [], "L0-b": [("failure", "missed")], "L0-c": [("skipped", "refused")]}


@pytest.mark.integration
def test_score_runs_without_the_repository(tmp_path):
    """score.py runs without site-packages and away from the repository."""
    shutil.copy(FOLDER / "score.py", tmp_path)
    (tmp_path / "cases" / "level0").mkdir(parents=True)
    shutil.copy(FOLDER / "cases/level0/L0-plain-01.json", tmp_path / "cases/level0")
    zeros = stored(0)["L0-plain-01"]["zeros"]
    (tmp_path / "answers.json").write_text(json.dumps({"answers": {"L0-plain-01": {"zeros": zeros}}}))
    done = subprocess.run(
        [sys.executable, "-I", "-S", "score.py", "answers.json"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert re.search(r"^L0-plain-01 +right +30\.0$", done.stdout, re.M)


def test_solver_of_the_page_scores_as_shown(tmp_path, monkeypatch, capsys):
    text = (FOLDER.parents[1] / "docs" / "where_methods_fail.md").read_text(encoding="utf-8")
    (solver,) = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    assert len([line for line in solver.splitlines() if line]) == 20
    (tmp_path / "solver.py").write_text(solver, encoding="utf-8")
    (tmp_path / "cases").symlink_to(FOLDER / "cases")
    monkeypatch.chdir(tmp_path)
    runpy.run_path("solver.py")
    monkeypatch.setattr(sys, "argv", ["score.py", "answers.json", "--brief"])
    assert score.main() == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    shown = [line.split() for line in re.search(r"^```text\n.*?\n(.*?)^```", text, re.M | re.S)[1].splitlines()]
    assert shown
    for row in shown:
        assert row in [r[: len(row)] for r in rows]
