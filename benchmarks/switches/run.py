"""Run all solvers over the set: `python -m benchmarks.switches.run` writes a file for each solver at each level.

Each solver runs in a separate process and is asked every case at every setting. An error and an answer that takes
longer than the limit count as refused. Warm-up runs before each setting exclude compilation from the times. Seconds are
CPU time; for a case of less than 0.02 s they are the shortest of three runs, and for one that takes too long they are
the limit. At level 1 a solver computes the first period of the motion. It computes all periods only if the first period
has no event.
"""

import argparse
import importlib
import importlib.metadata
import json
import lzma
import os
import pkgutil
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from benchmarks.switches import solvers
from benchmarks.switches.model import STATES, TWO_PI, Point
from benchmarks.switches.score import VERDICTS, judge
from benchmarks.switches.sums import Sum

HERE = Path(__file__).parent
NAMES = sorted(module.name for module in pkgutil.iter_modules(solvers.__path__))
SHORT = 0.02
COMPILING = 600.0  # seconds allowed for the warm-up of a setting
LATE, ENDED = "longer than", "the process ended"
LETTERS = dict(zip(VERDICTS, "rmiw-", strict=True)) | {"all": "R"}  # "R": at level 0 the later zeros are right, too

WAVES = {"c0": 1.0, "c1": -0.3, "c2": 0.0, "a": 0.5, "alpha": 1.0, "b": 0.1, "eta": 7.0, "beta": 2.0, "T": 8.0}
MOTION = {"A": 1.5, "B": 0.1, "eps": 0.0, "eta": 100.0, "xi0": 0.3, "dxi0": 0.1, "tau0": 0.0, "periods": 2.0}
WARM_UP = [(0, WAVES), (2, MOTION), (2, MOTION | {"eps": 1e-4})]

Answer = dict[str, list[Any]]
Firsts = dict[str, list[list[Any] | None]]
"""For each case a list with one entry for each setting: [first zero or event], [] if there is none, None if refused."""


def cases_of(levels: list[int]) -> list[dict[str, Any]]:
    """Return the cases of some levels, in the order of the verdicts of a result."""
    paths = [p for level in levels for p in sorted((HERE / "cases" / f"level{level}").glob("*.json"))]
    return [json.loads(path.read_text(encoding="utf-8")) for path in paths]


def inputs(case: dict[str, Any]) -> dict[str, float]:
    """Return the inputs of a case. A solver gets only this part of the case."""
    return {key: float.fromhex(value) for key, value in case["inputs_hex"].items()}


def answer(module: Any, level: int, x: dict[str, float], setting: dict[str, Any]) -> Answer:
    """Return the zeros or events that a solver finds for the inputs of a case."""
    if level == 0:
        return {"zeros": module.zeros(Sum(**{k: v for k, v in x.items() if k != "T"}), x["T"], **setting)}
    point = Point(x["A"], x["B"], x["eps"], x["eta"])
    found: list[tuple[float, int, int]] = []
    for periods in (1.0, x["periods"]) if level == 1 else (x["periods"],):
        start = (x["xi0"], x["dxi0"], x["tau0"], x["tau0"] + TWO_PI * periods)
        found = found or module.events(start, point, **setting)
    return {"events": [[tau, STATES[before], STATES[after]] for tau, before, after in found]}


def cpu_time() -> float:
    """Return the CPU time of this process in seconds.

    While a limit of CPU time is set, and up to a tick later, Linux adds the time of a thread only at its ticks. Asking
    for the time of this thread adds it now; otherwise most answers of less than a tick would take 0 s.
    """
    time.thread_time()
    return time.process_time()


def timed(module: Any, level: int, x: dict[str, float], setting: Any, limit: float) -> tuple[Answer | str, float]:
    """Return (answer, seconds): the answer, or the error as a text, and the CPU time. The system ends this process
    if the limit is exceeded."""
    spent: list[float] = []
    while not spent or (len(spent) < 4 and spent[0] < SHORT):
        signal.setitimer(signal.ITIMER_PROF, 0.0 if spent else limit)
        begin = cpu_time()
        try:
            given: Answer | str = answer(module, level, x, setting)
        except Exception as error:  # a solver may raise anything
            given = f"{type(error).__name__}: {error}"
        spent.append(cpu_time() - begin)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    return given, min(spent[1:] or spent)


def serve(name: str, channel: Any) -> None:
    """Main function of the process of a solver: answer cases from `channel`, and discard the output of libraries."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    module = importlib.import_module(f"{solvers.__name__}.{name}")
    for question in iter(channel.recv, None):
        channel.send(timed(module, *question))


class Solver:
    """A solver in a process. If an answer takes too long, a new process replaces the old one."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.process: Any = None
        self.warm: list[Any] = []

    def ask(self, level: int, x: dict[str, float], setting: Any, limit: float) -> tuple[Answer | str, float]:
        """Return (answer, seconds): the answer, or the reason why there is none, and the CPU time."""
        if self.process is None:
            context = get_context("spawn")
            self.channel, other = context.Pipe()
            self.process = context.Process(target=serve, args=(self.name, other), daemon=True)
            self.process.start()
            other.close()
            self.warm = []
        try:
            self.channel.send((level, x, setting, limit))
            return self.channel.recv()
        except (EOFError, OSError):
            self.process.join()
            late = self.process.exitcode == -signal.SIGPROF
            self.process = None
            return f"{LATE} {limit:g} s" if late else ENDED, limit

    def warm_up(self, setting: Any, levels: list[int]) -> None:
        """Compile all code of a setting, once in each process."""
        if self.process is None or setting not in self.warm:
            for level, x in WARM_UP:
                if level in levels or (level and max(levels)):
                    self.ask(level, x, setting, COMPILING)
            self.warm.append(setting)

    def end(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.join()
            self.process = None


def written(setting: dict[str, Any]) -> str:
    """Return a setting as a text."""
    return ", ".join(f"{key} {x:g}" if isinstance(x, float) else f"{key} {x}" for key, x in setting.items())


def summary(cases: list[dict[str, Any]], given: dict[str, tuple[Answer | str, float]]) -> dict[str, Any]:
    """Return a dict with the verdicts (a letter for each case), digits of right answers, and reasons of refusals."""
    judged = [judge(case, given[case["id"]][0]) for case in cases]
    refused: dict[str, list[str]] = {}
    for case in cases:
        if isinstance(answered := given[case["id"]][0], str):
            refused.setdefault(answered[:80], []).append(case["id"])
    return {
        "verdicts": "".join(LETTERS["all" if j["all"] else j["verdict"]] for j in judged),
        "digits": " ".join("-" if j["digits"] is None else f"{j['digits']:.0f}" for j in judged),
        "seconds": float(f"{sum(given[case['id']][1] for case in cases):.3g}"),
        "refused": refused,
    }


def run(
    module: Any, cases: list[dict[str, Any]], limits: list[float], answers: Path | None
) -> Iterator[dict[int, tuple[dict[str, Any], Firsts]]]:
    """Run a solver with all its settings. After each setting, yield the results of all settings so far.

    The yielded dict has a pair (result, firsts) for each level: the fields of the result file, and the first zero or
    event of each case. The complete answers are written into the folder `answers`.
    """
    name = module.__name__.rpartition(".")[2]
    head = {"solver": module.NAME, "version": importlib.metadata.version(module.PACKAGE) if module.PACKAGE else ""}
    able = [c for c in cases if hasattr(module, "events" if c["level"] else "zeros")]
    levels = {level: [c for c in able if c["level"] == level] for level in sorted({c["level"] for c in able})}
    found: dict[int, tuple[dict[str, Any], Firsts]] = {
        level: (head | {"runs": []}, {c["id"]: [] for c in group}) for level, group in levels.items()
    }
    solver = Solver(name)
    for number, setting in enumerate(module.SETTINGS if able else []):
        given: dict[str, tuple[Answer | str, float]] = {}
        for case in able:
            solver.warm_up(setting, [*levels])
            given[case["id"]] = solver.ask(case["level"], inputs(case), setting, limits[case["level"] > 1])
        for level, group in levels.items():
            result, firsts = found[level]
            result["runs"].append({"settings": setting, **summary(group, given)})
            for i, kept in firsts.items():
                kept.append(None if isinstance(a := given[i][0], str) else next(iter(a.values()))[:1])
            right = result["runs"][-1]["verdicts"].lower().count("r")
            print(f"{module.NAME}  {written(setting):32}  level {level}: {right} of {len(group)} right", flush=True)
        if answers:
            answered = {i: a for i, (a, _) in given.items() if not isinstance(a, str)}
            seconds = {i: spent for i, (_, spent) in given.items()}
            full = head | {"settings": written(setting), "answers": answered, "seconds": seconds}
            answers.mkdir(parents=True, exist_ok=True)
            (answers / f"{name}-{number + 1:02}.json").write_text(json.dumps(full) + "\n", encoding="utf-8")
        yield found
    solver.end()


def with_stored(path: Path, result: dict[str, Any], firsts: Firsts) -> tuple[dict[str, Any], Firsts]:
    """Return a result and its first answers, with those of the stored settings before them."""
    if not path.exists():
        return result, firsts
    stored = json.loads(path.read_text(encoding="utf-8"))
    if result["level"] < 2:
        with lzma.open(path.with_suffix(".answers.json.xz"), "rt", encoding="utf-8") as file:
            firsts = {i: answered + firsts[i] for i, answered in json.load(file).items()}
    return result | {"runs": stored["runs"] + result["runs"]}, firsts


def lacking(module: Any, folder: Path) -> list[dict[str, Any]]:
    """Return the settings of a solver that its stored results lack."""
    name = module.__name__.rpartition(".")[2]
    paths = folder.glob(f"level*/{name}.json")
    known = [run["settings"] for path in paths for run in json.loads(path.read_text(encoding="utf-8"))["runs"]]
    return [setting for setting in module.SETTINGS if setting not in known]


def dump(result: dict[str, Any]) -> str:
    """Return a result as JSON, a line for each field."""
    runs = ["{" + ",\n ".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in r.items()) + "}" for r in result["runs"]]
    head = [f"{json.dumps(k)}: {json.dumps(v)}" for k, v in result.items() if k != "runs"]
    return "{" + ",\n".join(head) + ',\n"runs": [\n' + ",\n".join(runs) + "\n]}\n"


def main(arguments: list[str] | None = None) -> int:
    """Run the solvers and write their results."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    add = parser.add_argument
    add("--only", nargs="+", choices=NAMES, metavar="SOLVER", help=", ".join(NAMES))
    add("--levels", nargs="+", type=int, choices=range(4), default=[0, 1, 2, 3])
    help_limit = "CPU seconds for a case of levels 0 and 1, and of levels 2 and 3 (2 and 20)"
    add("--limit", nargs=2, type=float, default=[2.0, 20.0], metavar=("SHORT", "LONG"), help=help_limit)
    add("--results", type=Path, default=HERE / "results", help="folder of the results")
    add("--answers", type=Path, metavar="FOLDER", help="folder for the full answers files, which score.py reads")
    add("--missing", action="store_true", help="only run settings that the stored results lack, and keep these")
    options = parser.parse_args(arguments)
    from benchmarks.common import environment  # imported here, because the process of each solver imports this module

    version = (HERE / "VERSION").read_text(encoding="utf-8").strip()
    cases = cases_of(options.levels)
    for name in options.only or NAMES:
        try:
            module: Any = importlib.import_module(f"{solvers.__name__}.{name}")
        except ImportError as error:
            print(f"{name} is left out: {error}", file=sys.stderr)
            continue
        old = options.results
        if options.missing:
            module.SETTINGS = lacking(module, options.results)
            old = Path(tempfile.mkdtemp())
            shutil.copytree(options.results, old, dirs_exist_ok=True)
        for found in run(module, cases, options.limit, options.answers):
            for level, (result, firsts) in found.items():
                folder = options.results / f"level{level}"
                folder.mkdir(parents=True, exist_ok=True)
                about = {
                    "set": version,
                    "level": level,
                    "limit": options.limit[level > 1],
                    "environment": environment(),
                }
                result, firsts = about | result, firsts
                if options.missing:
                    result, firsts = with_stored(old / f"level{level}" / f"{name}.json", result, firsts)
                (folder / f"{name}.json").write_text(dump(result), encoding="utf-8")
                if level < 2:
                    with lzma.open(folder / f"{name}.answers.json.xz", "wt", encoding="utf-8") as file:
                        json.dump(firsts, file)
    return 0


if __name__ == "__main__":
    sys.exit(main())
