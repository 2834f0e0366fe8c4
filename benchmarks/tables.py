"""Writes the measured tables into README.md, each between its markers.

They are `<!-- benchmark:NAME -->` and `<!-- /benchmark:NAME -->`.

A table whose results have not been measured, or whose markers are not there, is left as it is, with a note.
"""

from __future__ import annotations

import argparse
import json
import math
import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from benchmarks.common import RESULTS, say

README = Path(__file__).parents[1] / "README.md"


def number(x: float | None) -> str:
    """Three significant digits, plain where that is short."""
    if x is None:
        return "n/a"
    if x == 0:
        return "0"
    if 1e-3 <= abs(x) < 1e4:
        digits = max(0, 2 - math.floor(math.log10(abs(x))))
        return f"{x:.{digits}f}"
    mantissa, exponent = f"{x:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def duration(seconds: float) -> str:
    """Seconds in the unit that reads best."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{number(seconds / size)} {unit}"
    return f"{number(seconds * 1e9)} ns"


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table."""
    head = list(head)
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def machine(data: dict[str, Any]) -> str:
    e = data["environment"]
    return f"{e['processor']}, {e['cores']} cores, Python {e['python']}, Numba {e['versions']['numba']}"


def throughput(data: dict[str, Any]) -> str:
    runs = data["one_thread"]
    names = list(dict.fromkeys(n for at in runs for n in at["periods_per_second"]))
    names.sort(key=lambda n: -runs[0]["periods_per_second"].get(n, 0.0))
    head = ["sweep over A = 3…3.25, one thread"]
    for at in runs:
        head += [f"periods/s, ε = {at['eps']:g}", "certified is faster by"]
    rows = []
    for name in names:
        row = [name]
        for at in runs:
            rate = at["periods_per_second"].get(name)
            over = at["certified_over"].get(name)
            row += [number(rate), f"{number(over)}×" if over else ""]
        rows.append(row)
    missing = sorted({m for at in runs for m in at["missing"]})
    notes = [machine(data)]
    if missing:
        notes.append("not installed, left out: " + ", ".join(missing))
    return table(head, rows) + "\n\n" + "; ".join(notes) + "."


def work_precision(data: dict[str, Any]) -> str:
    best = {(p["family"], p["A"], p["eps"]): p for p in data["best"]}
    scenes = list(dict.fromkeys((p["A"], p["eps"]) for p in data["best"]))
    first = scenes[0]
    families = sorted(
        dict.fromkeys(p["family"] for p in data["best"]),
        key=lambda f: best[f, *first]["seconds"] if (f, *first) in best else math.inf,
    )
    head = ["method, cheapest of its most accurate settings"]
    for A, eps in scenes:
        head += [f"A = {A:g}, ε = {eps:g}: error in τ", "time a period"]
    rows = []
    for family in families:
        row = [family]
        for scene in scenes:
            p = best.get((family, *scene))
            if p is None:
                row += ["", ""]
                continue
            wrong = f" ({p['wrong']} wrong)" if p["wrong"] else ""
            row += [number(p["error"]) + wrong, duration(p["seconds"])]
        rows.append(row)
    missing = "; not installed, left out: " + ", ".join(data["missing"]) if data["missing"] else ""
    return table(head, rows) + f"\n\nOver 20 periods from rest. {machine(data)}{missing}."


def refined_vs_fixed(data: dict[str, Any]) -> str:
    head = ["", "gaps and order of impacts first lost at Δτ", "last kept at", "word first lost at Δτ", "last kept at"]
    rows = []
    for at in data["single"]:
        for name, label in (("fixed", "fixed"), ("muller", "Muller")):
            ends = ("kept_first_lost", "kept_last", "word_first_lost", "word_last")
            values = (at[name][end] for end in ends)
            shown = ("never" if value is None else number(value) for value in values)
            rows.append([f"A = {at['A']:g}, {label}", *shown])
    costs = [[k, duration(v)] for k, v in data["seconds_per_period"].items()]
    return table(head, rows) + "\n\n" + table(["switching, 3 ≤ A ≤ 3.25", "time a period"], costs)


def scaling(data: dict[str, Any]) -> str:
    memory = data["memory_mib"]
    head = [f"{int(n):,} points".replace(",", " ") for n in memory]
    return table(["peak memory of a sweep", *head], [["MiB", *(f"{m:.0f}" for m in memory.values())]])


def compile_time(data: dict[str, Any]) -> str:
    rows = [[name, duration(value)] for name, value in data["seconds"].items()]
    return table(["process", "wall time"], rows)


TABLES: dict[str, Callable[[dict[str, Any]], str]] = {
    "throughput": throughput,
    "work_precision": work_precision,
    "refined_vs_fixed": refined_vs_fixed,
    "scaling": scaling,
    "compile_time": compile_time,
}


def fill(text: str, name: str, content: str) -> str | None:
    """`text` with the part between the markers of `name` replaced; None if the markers are not there."""
    begin, end = f"<!-- benchmark:{name} -->", f"<!-- /benchmark:{name} -->"
    pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
    if not pattern.search(text):
        return None
    return pattern.sub(lambda _: f"{begin}\n{content}\n{end}", text)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("-i", "--input", type=Path, default=RESULTS, help="directory of the JSON files")
    parser.add_argument("--readme", type=Path, default=README, help="the file to write into")
    options = parser.parse_args()
    text = options.readme.read_text(encoding="utf-8")
    for name, make in TABLES.items():
        source = options.input / f"{name}.json"
        if not source.exists():
            say(f"{name}: not measured, left as it is")
            continue
        filled = fill(text, name, make(json.loads(source.read_text(encoding="utf-8"))))
        if filled is None:
            say(f"{name}: no markers in {options.readme.name}")
            continue
        text = filled
        say(f"{name}: written")
    options.readme.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
