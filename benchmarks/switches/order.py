"""Order of states and errors of times of the methods that do not locate events, on the motions of level 2.

The score of the set needs times with an error of at most 1e-6, so time-stepping and regularised methods score 0 there,
whatever else they do. This table has measures that fit them: at how many motions of 20 periods the order of all states
is right, how many events are in the right order before the first difference, the error of their times, and the CPU time
for all motions. An error that is proportional to the step has the order 1.

    python -m benchmarks.switches.order   # minutes; writes results/order.json
"""

import importlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.switches.run import WARM_UP, answer, cases_of, inputs, timed, written

HERE = Path(__file__).parent
SOLVERS = {"moreau_jean": "time-stepping (Moreau–Jean)", "regularised": "regularised"}
LEAST = 1e-5  # least step tried; a motion with a step of 1e-6 takes minutes


def compared(true: list[Any], found: list[Any]) -> tuple[int, float]:
    """Return the number of events before the first wrong state, and the largest error of their times."""
    count = 0
    for a, b in zip(true, found, strict=False):
        if a[1:] != b[1:]:
            break
        count += 1
    errors = [abs(a[0] - b[0]) for a, b in zip(true[:count], found, strict=False)]
    return count, max(errors, default=math.nan)


def judged(case: dict[str, Any], found: list[Any]) -> tuple[int, int, float]:
    """Return the number of events of a case, the number in the right order, and their largest error."""
    until = float(case["certain_until"])
    true = [(float(e["tau"]), e["before"], e["after"]) for e in case["events"] if float(e["tau"]) <= until]
    return (len(true), *compared(true, [tuple(e) for e in found]))


def measure() -> list[dict[str, Any]]:
    """Return a row for each setting of each method."""
    rows = []
    for name, label in SOLVERS.items():
        module = importlib.import_module(f"benchmarks.switches.solvers.{name}")
        for setting in (s for s in module.SETTINGS if s["step"] >= LEAST):
            for level, x in WARM_UP[1:]:
                answer(module, level, x, setting)
            results, seconds = [], 0.0
            for case in cases_of([2]):
                found, spent = timed(module, 2, inputs(case), setting, 0.0)
                assert isinstance(found, dict), found  # these solvers raise nothing
                results.append(judged(case, found["events"]))
                seconds += spent
            total, count, error = map(np.array, zip(*results, strict=True))
            kind = {True: ", implicit", False: ", explicit"}.get(setting.get("implicit", ""), "")
            numbers = {key: x for key, x in setting.items() if key != "implicit"}
            row = {
                "method": label + kind,
                "setting": numbers,
                "motions": len(total),
                "whole": int((count == total).sum()),
            }
            row |= {"share": float(np.median(count / total)), "error": float(np.nanmedian(error))}
            row["seconds"] = float(f"{seconds:.3g}")
            rows.append(row)
            print(f"{label + kind}  {written(numbers)}: {row['whole']} of {len(total)}", flush=True)
    return rows


def main() -> None:
    path = HERE / "results" / "order.json"
    path.write_text(json.dumps(measure(), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
