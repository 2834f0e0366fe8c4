"""Make the set of switches: `python -m benchmarks.switches.make` writes every case, `--only ID` writes some cases.

A case does not depend on the machine, the day or another case, so two runs write the same bytes.
"""

import argparse
import csv
import io
import json
import math
import sys
from collections.abc import Iterator
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.switches import level0, level1, motions, scenes
from benchmarks.switches.draw import Draw
from tests.exact.reference import mp

VERSION = "1.0"  # README.md lists the changes that need a new version
HERE = Path(__file__).parent
DRAWN = {0: level0.FAMILIES, 1: level1.FAMILIES, 2: scenes.LEVEL2, 3: scenes.LEVEL3}
FEWER = 100  # at levels 2 and 3 times must agree within tolerance / FEWER, because errors grow over many events


class Task(NamedTuple):
    """A case to be made: its level, the number of its family, and its number in the family."""

    level: int
    family: int
    number: int

    @property
    def name(self) -> str:
        """Return the name of the family."""
        return list(DRAWN[self.level])[self.family]

    @property
    def id(self) -> str:
        """Return the id, which is also the name of the file."""
        return f"L{self.level}-{self.name.replace(' ', '-')}-{self.number + 1:02}"


class Sequence(NamedTuple):
    """Solution for one set of inputs: times, their tolerances (`within`), the states before and after each event (None
    at level 0), and the fields of the file."""

    times: list[Any]
    within: list[Any]
    states: list[Any]
    fields: dict[str, Any]


def tasks() -> list[Task]:
    """Return all cases in order."""
    return [
        Task(level, f, i)
        for level, families in DRAWN.items()
        for f, (count, _) in enumerate(families.values())
        for i in range(count)
    ]


def text(x: Any, digits: int = 30) -> str:
    """Return a number as a string of `digits` digits."""
    return mp.nstr(x, digits, strip_zeros=False) if x else "0"


def tolerance(distance: Any) -> Any:
    """Return the largest error of a right time, by the rule of score.py. `distance` is that to the nearest other zero,
    or None if there is none."""
    widest = mp.mpf(10) ** -6
    return widest if distance is None else min(widest, distance / 3)


def solve(level: int, x: dict[str, float]) -> Sequence:
    """Return the solution for these inputs, which are exact numbers: the zeros (level 0) or the events."""
    if level == 0:
        zeros = level0.solve(x)
        at = [mp.zero, *(z.at for z in zeros)]
        gaps = [b - a for a, b in pairwise(at)]
        within = [tolerance(min(gaps[i : i + 2])) for i in range(len(zeros))]
        fields = {
            "zeros": [text(z.at) for z in zeros],
            "slopes": [text(z.slope) for z in zeros],
            "multiplicities": [z.multiplicity for z in zeros],
        }
        return Sequence(at[1:], within, [None] * len(zeros), fields)
    events = motions.solve(x, 1 if level == 1 else None)
    written = [
        {key: x if x is None or isinstance(x, str) else text(x) for key, x in e._asdict().items()} for e in events
    ]
    states = [(e.before, e.after) for e in events]
    within = [tolerance(e.nearest_other_zero) for e in events]
    return Sequence([e.tau for e in events], within, states, {"events": written})


def neighbours(x: dict[str, float]) -> Iterator[dict[str, float]]:
    """Yield the inputs with one input changed by an ulp.

    An input of 0 is not changed, because it means a start at rest or at the obstacle, or no disturbance.
    """
    for name, value in x.items():
        if value and name != "periods":
            yield x | {name: math.nextafter(value, math.inf)}
            yield x | {name: math.nextafter(value, -math.inf)}


def parting(a: Sequence, b: Sequence, part: int) -> int | None:
    """Return the index of the first difference of two sequences, or None if they agree. Times agree if their distance
    is at most the tolerance / `part`."""
    for i, (s, t, within) in enumerate(zip(a.times, b.times, a.within, strict=False)):
        if a.states[i] != b.states[i] or abs(s - t) > within / part:
            return i
    return None if len(a.times) == len(b.times) else min(len(a.times), len(b.times))


def verdict(level: int, x: dict[str, float], exact: Sequence, start: Any, end: Any) -> dict[str, Any]:
    """Return the fields verdict, answers (if there are several) and certain_until (the time up to which they agree)."""
    part = FEWER if level > 1 else 1
    several, until, until_index = [exact], end, len(exact.times)
    for moved in neighbours(x):
        other = solve(level, moved)
        i = parting(exact, other, part)
        if i is None:
            continue
        if all(parting(known, other, part) is not None for known in several):
            several.append(other)
        first = min(s.times[i] for s in (exact, other) if i < len(s.times))
        common = [(j, t) for j, t in enumerate(exact.times[:i]) if t < first - 2 * exact.within[j]]
        j, last = common[-1] if common else (-1, start)
        if (last + first) / 2 < until:
            until, until_index = (last + first) / 2, j + 1
    if len(several) == 1:
        return {"verdict": "certain", "certain_until": text(end)}
    key = "zeros" if level == 0 else "events"
    answers = [s.fields[key] for s in several]
    if level > 1:  # store only a few events from the first difference on; later events are unrelated
        answers = [a for n, s in enumerate(answers) if (a := s[until_index : until_index + 4]) not in answers[:n]]
    return {"verdict": "either", "answers": answers, "certain_until": text(until, 17)}


def smallest_distance(level: int, x: dict[str, float], exact: Sequence) -> Any:
    """Return the smallest distance between two zeros of one search; None if no search has two zeros."""
    if level:
        near = (e["nearest_other_zero"] for e in exact.fields["events"])
        return min((mp.mpf(n) for n in near if n), default=None)
    at = [*exact.times]
    if not level0.function(x).at(mp.zero)[0]:
        at.insert(0, mp.zero)
    if 2 in exact.fields["multiplicities"]:
        return mp.mpf(10) ** -30  # the distance of a double zero is 0
    return min((b - a for a, b in pairwise(at)), default=None)


def case(task: Task) -> dict[str, Any]:
    """Return the fields of a case: draw its inputs, solve it, and solve it again with each input changed by an ulp."""
    level = task.level
    mp.dps = level0.DIGITS
    x, tags, why = DRAWN[level][task.name][1](Draw(level, task.family, task.number), task.number)
    exact = solve(level, x)
    distance = smallest_distance(level, x, exact)
    start = mp.mpf(0 if level == 0 else x["tau0"])
    end = mp.mpf(x["T"]) if level == 0 else start + 2 * mp.pi * mp.mpf(x["periods"])
    return {
        "id": task.id,
        "level": level,
        "family": task.name,
        "tags": tags,
        "difficulty": None if distance is None else float(mp.nstr(-mp.log10(mp.mpf(distance)), 4)),
        "why": why,
        "inputs": {name: f"{value:.17g}" for name, value in x.items()},
        "inputs_hex": {name: float(value).hex() for name, value in x.items()},
        **exact.fields,
        **verdict(level, x, exact, start, end),
    }


def dump(case: dict[str, Any]) -> str:
    """Return a case as JSON: a line for each field, and for each event."""
    lines = []
    for key, value in case.items():
        if key in ("events", "answers") and value:
            items = ",\n".join(f"  {json.dumps(item, ensure_ascii=False)}" for item in value)
            lines.append(f"{json.dumps(key)}: [\n{items}\n]")
        else:
            lines.append(f"{json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def make(task: Task) -> tuple[Task, str]:
    """Return the task and the JSON text of its case. Separate processes call this function."""
    return task, dump(case(task))


COLUMNS = ("tau", "before", "after", "xi", "dxi")


def write_tables(folder: Path) -> None:
    """Write the events of levels 1 to 3 as CSV: times, states, ξ and ξ' from the cases, rounded to doubles."""
    for level in (1, 2, 3):
        paths = sorted((folder / "cases" / f"level{level}").glob("*.json"))
        if not paths:
            continue
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["id", *COLUMNS])
        for path in paths:
            known = json.loads(path.read_text(encoding="utf-8"))
            writer.writerows(
                [known["id"], *(e[c] if e[c].isalpha() else float(e[c]) for c in COLUMNS)] for e in known["events"]
            )
        (folder / f"level{level}.csv").write_text(out.getvalue(), encoding="utf-8")


def main(arguments: list[str] | None = None) -> int:
    """Make cases and write them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--only", nargs="+", metavar="ID", help="ids of the cases to make, or beginnings of ids")
    parser.add_argument("--folder", type=Path, default=HERE, help="where to write")
    parser.add_argument("--workers", type=int, default=1, help="processes (default 1)")
    options = parser.parse_args(arguments)
    wanted = [t for t in tasks() if not options.only or t.id.startswith(tuple(options.only))]
    if not wanted:
        parser.error("no case has such an id")
    with get_context("spawn").Pool(options.workers) as pool:
        for task, written in (pool.imap if options.workers > 1 else map)(make, wanted):
            path = options.folder / "cases" / f"level{task.level}" / f"{task.id}.json"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(written, encoding="utf-8")
            print(path.name, flush=True)
    write_tables(options.folder)
    (options.folder / "VERSION").write_text(f"{VERSION}\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
