"""The state machine of the set in plain Python, the archive, and the exit code of the score below a share."""

import json
import sys
import tarfile

import pytest

from benchmarks.switches import archive, machine, score
from benchmarks.switches.run import cases_of


@pytest.mark.parametrize(("level", "least"), [(1, 80), (2, 22)])
def test_machine_answers_the_motions_of_the_set(level, least):
    """With the scan of its example, which misses pairs within a step."""
    verdicts = [score.judge(case, machine.answer(case, machine.scan))["verdict"] for case in cases_of([level])]
    assert verdicts.count("right") >= least
    assert set(verdicts) <= {"right", "missed"}


@pytest.mark.parametrize(
    ("main", "arguments", "words"),
    [
        (machine.main, ["nothere:f"], "No module named 'nothere'"),
        (machine.main, ["benchmarks.switches.machine:nothere"], "has no attribute 'nothere'"),
        (machine.main, ["benchmarks.switches.machine:scan", "-o", "nowhere/a.json"], "nowhere/a.json"),
        (machine.main, ["--levels", "0"], "--levels: invalid choice: 0"),
        (score.main, ["answers.json", "--levels", "7"], "--levels: invalid choice: 7"),
        (score.main, [], "answers"),
    ],
)
def test_mistakes_are_one_line_and_code_2(monkeypatch, capsys, main, arguments, words):
    monkeypatch.setattr(sys, "argv", ["tool.py", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    out, err = capsys.readouterr()
    assert (end.value.code, out, err.count("\n")) == (2, "", 1), err
    assert words in err


def test_machine_is_short_and_the_archive_is_complete_and_the_same_each_time(tmp_path, monkeypatch):
    assert len((archive.HERE / "machine.py").read_text().splitlines()) <= 120
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        archive.write(tmp_path / name / "switches-1.0.tar.gz")
    first, second = ((tmp_path / name / "switches-1.0.tar.gz").read_bytes() for name in ("a", "b"))
    assert first == second
    with tarfile.open(tmp_path / "a" / "switches-1.0.tar.gz") as tar:
        tar.extraction_filter = getattr(tarfile, "data_filter", None)  # Python has it from 3.11.4 on
        tar.extractall(tmp_path)
    folder = tmp_path / "switches-1.0"
    assert len(list(folder.glob("cases/*/*.json"))) == 367
    (folder / "answers.json").write_text(json.dumps({"answers": {"L1-plain-01": None}}))
    for under, code in (("0", 0), ("1", 1)):
        command = ["score.py", str(folder / "answers.json"), "--cases", str(folder / "cases"), "--levels", "1"]
        monkeypatch.setattr(sys, "argv", [*command, "--fail-under", under])
        assert score.main() == code
