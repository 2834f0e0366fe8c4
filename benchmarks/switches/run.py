"""Run all solvers over the set: `python -m benchmarks.switches.run` writes the verdicts of each to `results`.

Each solver runs in a process of its own, every setting over all cases; what it raises, and what takes longer than the
limit, counts as refused. Before a setting is timed it answers warm-up questions, so that nothing is compiled later.
Seconds are CPU time; of a case that takes less than 0.05 s the least of three runs. At level 1 a solver is asked for
one period, and if it finds no event there for all of them.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import json
import os
import pkgutil
import sys
import time
from collections import Counter
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from benchmarks.switches import solvers
from benchmarks.switches.model import STATES, TWO_PI, Point
from benchmarks.switches.score import judge
from benchmarks.switches.sums import Sum

HERE = Path(__file__).parent
NAMES = sorted(module.name for module in pkgutil.iter_modules(solvers.__path__))
SHORT = 0.05
COMPILING = 600.0  # seconds allowed for the warm-up of a setting

WAVES = {"c0": 1.0, "c1": -0.3, "c2": 0.0, "a": 0.5, "alpha": 1.0, "b": 0.1, "eta": 7.0, "beta": 2.0, "T": 8.0}
MOTION = {"A": 1.5, "B": 0.1, "eps": 0.0, "eta": 100.0, "xi0": 0.3, "dxi0": 0.1, "tau0": 0.0, "periods": 2.0}
WARM_UP = [(0, WAVES), (2, MOTION), (2, MOTION | {"eps": 1e-4})]

Answer = dict[str, list[Any]]


def answer(module: Any, level: int, x: dict[str, float], setting: dict[str, Any]) -> Answer:
    """Return what a solver finds for a case, of which it gets the inputs alone."""
    if level == 0:
        return {"zeros": module.zeros(Sum(**{k: v for k, v in x.items() if k != "T"}), x["T"], **setting)}
    point = Point(x["A"], x["B"], x["eps"], x["eta"])
    found: list[tuple[float, int, int]] = []
    for periods in (1.0, x["periods"]) if level == 1 else (x["periods"],):
        if not found:
            start = (x["xi0"], x["dxi0"], x["tau0"], x["tau0"] + TWO_PI * periods)
            found = module.events(start, point, **setting)
    return {"events": [[tau, STATES[before], STATES[after]] for tau, before, after in found]}


def timed(module: Any, level: int, x: dict[str, float], setting: dict[str, Any]) -> tuple[Answer | str, float]:
    """Return the answer, or the error as a text, and the seconds."""
    spent: list[float] = []
    while not spent or (len(spent) < 3 and spent[0] < SHORT):
        begin = time.process_time()
        try:
            given: Answer | str = answer(module, level, x, setting)
        except Exception as error:  # whatever a solver raises, it has no answer
            given = f"{type(error).__name__}: {error}"
        spent.append(time.process_time() - begin)
    return given, min(spent)


def serve(name: str, channel: Any) -> None:
    """Answer questions in a process of its own, without what libraries print."""
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)
    module = importlib.import_module(f"{solvers.__name__}.{name}")
    for question in iter(channel.recv, None):
        channel.send(timed(module, *question))


class Solver:
    """A solver in a process, which is begun anew after it has taken too long."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.process: Any = None
        self.warm: list[Any] = []

    def ask(self, level: int, x: dict[str, float], setting: Any, limit: float) -> tuple[Answer | str, float]:
        """Return the answer, or why there is none, and the seconds."""
        if self.process is None:
            context = get_context("spawn")
            self.channel, other = context.Pipe()
            self.process = context.Process(target=serve, args=(self.name, other), daemon=True)
            self.process.start()
            other.close()
            self.warm = []
        try:
            self.channel.send((level, x, setting))
            if self.channel.poll(limit):
                return self.channel.recv()
            why = f"longer than {limit:g} s"
        except (EOFError, OSError):
            why = "the process ended"
        self.end()
        return why, limit

    def warm_up(self, setting: Any, levels: list[int]) -> None:
        """Let the solver compile what a setting needs, once in each process."""
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


def run(module: Any, cases: list[dict], limits: dict[int, float], answers: Path | None) -> dict[str, Any]:
    """Return the verdicts of a solver at all its settings, and write its answers into a folder."""
    name = module.__name__.rpartition(".")[2]
    head = {"solver": module.NAME, "version": importlib.metadata.version(module.PACKAGE) if module.PACKAGE else ""}
    able = [c for c in cases if hasattr(module, "events" if c["level"] else "zeros")]
    levels = sorted({c["level"] for c in able})
    solver, runs = Solver(name), []
    for number, setting in enumerate(module.SETTINGS):
        given: dict[str, tuple[Answer | str, float]] = {}
        for case in able:
            solver.warm_up(setting, levels)
            x = {key: float.fromhex(value) for key, value in case["inputs_hex"].items()}
            given[case["id"]] = solver.ask(case["level"], x, setting, limits[case["level"]])
        judged = [judge(case, given[case["id"]][0]) for case in able]
        runs.append(
            {
                "settings": setting,
                "verdict": [j["verdict"] for j in judged],
                "digits": [None if j["digits"] is None else round(j["digits"], 1) for j in judged],
                "all": [int(j["all"]) if case["level"] == 0 else None for j, case in zip(judged, able, strict=True)],
                "seconds": [float(f"{given[case['id']][1]:.3g}") for case in able],
                "refused": {i: a[:120] for i, (a, _) in given.items() if isinstance(a, str)},
            }
        )
        right = Counter(case["level"] for j, case in zip(judged, able, strict=True) if j["verdict"] == "right")
        of = Counter(case["level"] for case in able)
        share = "  ".join(f"level {level}: {right[level]}/{of[level]}" for level in levels)
        print(f"{module.NAME}  {written(setting) or '':32}  {share}", flush=True)
        if answers:
            said = {i: a for i, (a, _) in given.items() if not isinstance(a, str)}
            seconds = {i: spent for i, (_, spent) in given.items()}
            full = head | {"settings": written(setting), "answers": said, "seconds": seconds}
            answers.mkdir(parents=True, exist_ok=True)
            (answers / f"{name}-{number + 1:02}.json").write_text(json.dumps(full) + "\n", encoding="utf-8")
    solver.end()
    return head | {"cases": [case["id"] for case in able], "runs": runs}


def dump(result: dict[str, Any]) -> str:
    """Return a result as JSON, a line for each list."""
    runs = ",\n".join(
        "{" + ",\n ".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in r.items()) + "}"
        for r in result["runs"]
    )
    head = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in result.items() if key != "runs"]
    return "{" + ",\n".join(head) + f',\n"runs": [\n{runs}\n]' + "}\n"


def main(arguments: list[str] | None = None) -> int:
    """Run the solvers and write their results."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=NAMES, metavar="SOLVER", help=", ".join(NAMES))
    parser.add_argument("--levels", nargs="+", type=int, choices=range(4), default=[0, 1, 2, 3])
    parser.add_argument(
        "--limit",
        nargs=2,
        type=float,
        default=[10.0, 60.0],
        metavar=("SHORT", "LONG"),
        help="seconds for a case of levels 0 and 1, and of levels 2 and 3 (10 and 60)",
    )
    parser.add_argument("--results", type=Path, default=HERE / "results", help="where to write")
    parser.add_argument("--answers", type=Path, metavar="FOLDER", help="write full answers files (score.py) there, too")
    options = parser.parse_args(arguments)
    paths = sorted(p for level in options.levels for p in (HERE / "cases" / f"level{level}").glob("*.json"))
    cases = [json.loads(path.read_text(encoding="utf-8")) for path in paths]
    limits = dict(zip(range(4), (options.limit[0], options.limit[0], *2 * options.limit[1:]), strict=True))
    from benchmarks.common import environment  # here, because every process of a solver imports this module

    about = {"environment": environment(), "limits": options.limit}
    left_out = {}
    for name in options.only or NAMES:
        try:
            module = importlib.import_module(f"{solvers.__name__}.{name}")
        except ImportError as error:
            left_out[name] = str(error)
            continue
        result = run(module, cases, limits, options.answers)
        if result["cases"]:
            options.results.mkdir(parents=True, exist_ok=True)
            (options.results / f"{name}.json").write_text(dump(about | result), encoding="utf-8")
    for name, why in left_out.items():
        print(f"{name} is left out: {why}", file=sys.stderr)
    return 0


if __name__ == "__main__":
    sys.exit(main())
