"""Write the measured tables, and that of all quantities, into README.md and pages of docs, between their markers.

The markers are `<!-- benchmark:NAME -->` and `<!-- /benchmark:NAME -->`. If a table has no measured results or no
markers, its page is not changed and a note is printed.
"""

import argparse
import json
import math
import re
import statistics
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks import passes
from benchmarks.common import RESULTS, plt, say
from vibrodrive.model.keywords import number_text
from vibrodrive.model.names import PARAMETERS, SCENE, SETTINGS, Name
from vibrodrive.model.physical import UNITS
from vibrodrive.model.quantities import MARGIN, QUANTITIES, STATUS
from vibrodrive.model.records import RECORDS

ROOT = Path(__file__).parents[1]


def number(x: float | None) -> str:
    """Return a number with three significant digits, or with two digits and an exponent if it is large or small."""
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
    """Return seconds in a suitable unit."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{number(seconds / size)} {unit}"
    return f"{number(seconds * 1e9)} ns"


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a Markdown table."""
    head = list(head)
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)


def machine(data: dict[str, Any]) -> str:
    e = data["environment"]
    return f"{e['processor']}, {e['cores']} cores, Python {e['python']}, Numba {e['versions']['numba']}"


def rates(data: dict[str, Any], labels: dict[str, str]) -> str:
    """Return the table of periods per second on one thread, with a column for each ε and each kind of vectors.

    `labels` contains the labels of the programs by their names in the results. The other programs are also compared
    with the certified sweep: the median of the ratios of times.
    """
    runs = [(name, at) for name, run in sorted(data["vectors"].items()) for at in run["one_thread"]]
    rows = []
    for name, label in labels.items():
        row = [label]
        for _, at in runs:
            rate, behind = at["periods_per_second"].get(name), at["certified_over"].get(name)
            row.append((number(rate) if rate else "") + (f" ({number(behind)}× slower)" if behind else ""))
        if any(row[1:]):
            rows.append(row)
    head = ["periods per second on one core, A = 3…3.25", *(f"ε = {at['eps']:g}, {name}" for name, at in runs)]
    missing = sorted({m for _, at in runs for m in at["missing"]})
    notes = list(dict.fromkeys(machine(run) for run in data["vectors"].values()))
    if missing:
        notes.append("not measured, because not installed: " + ", ".join(missing))
    return table(head, rows) + "\n\n" + "; ".join(notes) + "."


def throughput(data: dict[str, Any]) -> str:
    """Return the table with all programs, in the order of their speed at ε = 0."""
    found: dict[str, float] = {}
    for _, run in sorted(data["vectors"].items()):
        for at in run["one_thread"]:
            found = at["periods_per_second"] | found
    return rates(data, {name: name for name in sorted(found, key=lambda n: -found[n])})


RIVALS = {
    "certified": "vibrodrive, certified",
    "certified, one motion at a time": "vibrodrive, certified, one motion at a time",
    "scan + Newton": "hand-written Numba: scan + Newton",
    "heyoka": "heyoka, terminal events",
    "scipy solve_ivp": "scipy `solve_ivp`",
}
"""Programs in the table of the README: name in the results, and label in the table."""


def speed(data: dict[str, Any]) -> str:
    """Return the table of the README, with the five programs of RIVALS."""
    return rates(data, RIVALS)


def accuracy_speed(data: dict[str, Any]) -> str:
    """Return the table of methods: number of right settings, and error and time of the fastest setting whose error is
    at most ten times the smallest error."""
    points: dict[tuple[float, str], list[dict[str, Any]]] = {}
    for p in data["points"]:
        points.setdefault((p["eps"], p["method"]), []).append(p)
    levels = sorted({eps for eps, _ in points})
    head = ["method"]
    for eps in levels:
        head += [f"ε = {eps:g}: settings right", "error in τ", "time a period"]
    rows = []
    for name in dict.fromkeys(name for _, name in points):
        row = [name]
        for eps in levels:
            here = points.get((eps, name), [])
            right = [p for p in here if p["right"]]
            row.append(f"{len(right)} of {len(here)}" if here else "")
            if right:
                best = min(p["error"] for p in right)
                cheapest = min((p for p in right if p["error"] <= max(10 * best, 1e-13)), key=lambda p: p["seconds"])
                row += [number(cheapest["error"]), duration(cheapest["seconds"])]
            else:
                row += ["", ""]
        rows.append(row)
    about = (
        f"A = {data['A']:g}, {data['periods']} periods from rest. {machine(data)}, {data['environment']['measured']}."
    )
    return table(head, rows) + f"\n\nError and time: fastest setting with at most ten times the smallest error. {about}"


def scaling(data: dict[str, Any]) -> str:
    memory = data["memory_mib"]
    head = [f"{int(n):,} points".replace(",", " ") for n in memory]
    return table(["peak memory of a sweep", *head], [["MiB", *(f"{m:.0f}" for m in memory.values())]])


def compile_time(data: dict[str, Any]) -> str:
    """Return the table of CPU times and memory of processes, from a clone and from a wheel with machine code."""
    rows = []
    for name in data["processes"]:
        row = [name]
        for place in data["places"]:
            cold, warm, peak = (found[f"{name}, {place}"] for found in data["found"].values())
            row += [duration(cold), duration(warm), f"{peak:.0f}"]
        rows.append(row)
    head = [f"{place}: {what}" for place in data["places"] for what in ("cold", "warm", "MiB")]
    return table(["process", *head], rows)


def explorer(data: dict[str, Any]) -> str:
    """Return the table of picture rates and delays: medians, and 95th percentiles in parentheses."""

    def milliseconds(found: dict[str, float]) -> str:
        return f"{found['median']:.0f} ms ({found['p95']:.0f})"

    head = ["1000 columns", "pictures a second", "lag", "complete picture after the mouse stops"]
    rows = [
        [name.replace(", 1000 × (", ", ").replace(")", " periods"), f"{row['frames_per_second']:.1f}",
         milliseconds(row["milliseconds"]), f"{row['settled_seconds']:.1f} s"]
        for name, row in data["scenes"].items()
    ]  # fmt: skip
    memory = data["memory"]
    notes = (
        f"The curves of a motion appear {milliseconds(data['click_milliseconds'])} after the click. During "
        f"{memory['frames']} pictures the server's memory grows by {memory['grown_MiB']:.1f} MiB. {machine(data)}."
    )
    return table(head, rows) + "\n\n" + notes


def first_picture(data: dict[str, Any]) -> str:
    """Return the sentence about the time to the first picture."""
    seconds = data["picture painted"]
    return (
        f"The first picture appears {statistics.median(seconds):.1f} s after the command (median of {len(seconds)} "
        f"starts, at most {max(seconds):.1f} s), with page and kernels in their caches. With an empty cache picture, "
        f"motion and limit are there after {data['compiled']:.0f} s."
    )


def pass_rates(level: int) -> Callable[[dict[str, Any]], str]:
    """Return the function that makes the table of pass rates of a level, from the results stored with the set."""
    return lambda _: table(*passes.table(level))


def close_pairs(_: dict[str, Any]) -> str:
    """Return the table of the best settings at level 0, with the pass rate of the family that most methods fail, and
    a sentence with the best of each kind of rival at this family."""
    head, rows = passes.table(0)
    pair = next(k for k, name in enumerate(head) if name.startswith("close pair"))
    kinds: dict[str, list[list[str]]] = {"scan of g and g′": [], "integrator as advised": [], "other rival": []}
    bounded = [row for row in rows if row[0].startswith("branch and prune")]
    for row in (row for row in rows if "(ours)" not in row[0] and row not in bounded):
        kind = row[0] if row[0] in kinds else "integrator as advised" if passes.ADVISED in row[0] else "other rival"
        kinds[kind].append(row)
    best = {kind: max(found, key=lambda row: int(row[pair])) for kind, found in kinds.items()}
    scan, *others = best.items()
    told = [f"{row[0]} {row[pair]} %" for row in bounded]
    told += [f"the best {kind} {row[pair]} % ({row[0].removesuffix(passes.ADVISED)})" for kind, row in others]
    words = f"Of the close pairs, the {scan[0]} finds {scan[1][pair]} %, {', '.join(told[:-1])} and {told[-1]}."
    shown = [head.index(name) for name in ("method", "right", "CPU time", "time-outs")] + [pair]
    return table([head[k] for k in shown], [[row[k] for k in shown] for row in rows]) + f"\n\n{words}"


def measured_switches(_: dict[str, Any]) -> str:
    """Return the sentence about the stored results: programs with versions, number of settings, and dates."""
    found = passes.methods()
    programs = dict.fromkeys(f"{m.program} ({m.version})" for m in found if m.version)
    settings = sum(len(m.right) for m in found)
    short, long = passes.limits()
    return (
        f"Measured {passes.dates()} with {settings} settings in total. Programs, with their versions in parentheses: "
        f"{', '.join(programs)}; the other methods are hand-written. Each is asked every case of its levels at every "
        f"setting. An answer that takes more than {short} s of CPU time (levels 0, 1) or {long} s (levels 2, 3) is a "
        "time-out: it counts as refused, and this limit as its time."
    )


def failures(data: dict[str, Any]) -> str:
    """Return a section for each kind of failure: its picture, its cause with the measured numbers, and its case."""
    sections = [
        f"### {e['title']}\n\n![{e['title']}](failures/{name}.png)\n\n{e['caption']} Case: `{e['case']}`."
        for name, e in data["examples"].items()
    ]
    return "\n\n".join(sections)


CAUSES = {
    "pair": "[a pair missed in a step](#a-pair-missed-in-a-step): the next zero or event is {distance} later",
    "start": "[the zero at the start found again](#a-zero-at-the-start-found-again-or-the-next-one-lost): the slide "
    "ends {took} after its start",
    "touch": "[nearly a touch](#the-time-of-an-impact-that-is-nearly-a-touch): the slide would reverse {distance} "
    "after the impact",
    "threshold": "H decides which state follows, and is ±1 at a time {distance} from the switch; the error of the "
    "switching time is {error}",
    "sunk": "[the mass is below the obstacle](#below-the-obstacle-at-fixed-steps), so it rests: the true ξ is {xi}, "
    "its depth below the obstacle is {depth}",
    "drift": "errors of earlier times, up to {error}, have changed the motion",
}
"""Texts of the causes in `benchmarks.first_difference`, with links to the examples of EXAMPLES."""

EXAMPLES = "../../docs/where_methods_fail.md"


def extent(values: Iterable[float], show: Callable[[float], str] = number) -> str:
    """Return the least and the largest value as a text."""
    found = sorted(values)
    return " … ".join(dict.fromkeys(show(x) for x in (found[0], found[-1])))


def first_differences(data: dict[str, Any]) -> str:
    """Return the table of all wrong settings: a row for each ε, method and cause."""
    groups: dict[tuple[float, str, str], list[dict[str, Any]]] = {}
    for row in data["rows"]:
        groups.setdefault((row["eps"], row["method"], row["cause"]), []).append(row)
    rows = []
    for (eps, method, cause), found in groups.items():
        numbers = {key: extent(r[key] for r in found) for key, x in found[0].items() if isinstance(x, float)}
        values = ", ".join(f"{r['value']:g}".replace("e-0", "e-") for r in found)
        switches = dict.fromkeys(f"{r['true']} / {r['reported']}" for r in found)
        periods = extent((r["period"] for r in found), lambda x: f"{math.floor(x)}")
        setting = f"{found[0]['setting']} {values}"
        rows.append([method, f"{eps:g}", setting, periods, "; ".join(switches), CAUSES[cause].format(**numbers)])
    head = ["method", "ε", "wrong settings", "period", "true / reported switch", "cause"]
    return table(head, rows).replace("](#", f"]({EXAMPLES}#")


def quantities(_: dict[str, Any]) -> str:
    """Return the table of all quantities with a number for each point, from their rows."""
    of = {name: f"`{one}`" for one in RECORDS.values() for name in (*(q.name for q in one.quantities), *one.maps)}
    rows = []
    for q in QUANTITIES.values():
        if not q.along and (q.name in of or q is MARGIN or q is STATUS):
            meaning = q.meaning.replace("|", r"\|")
            unit = UNITS[q.scales].si if q.scales else "" if q.unit == "1" else q.unit
            rows.append([f"`{q.name}`", of.get(q.name, "every"), meaning, unit])
    return table(["quantity", "record", "meaning", "unit with a scene"], rows)


def keys(_: dict[str, Any]) -> str:
    """Return the table of the keys of a motion: all parameters, settings and quantities of a scene, from their rows."""
    rows = [
        [f"`[{row.table}]`", f"`{name}`", f"{row.meaning}. {row.note}".rstrip(" .").replace("``", "`"), *values_of(row)]
        for row_table in ("model", "physical", "switching", "run")
        for name, row in (SETTINGS | PARAMETERS | SCENE).items()
        if row.table == row_table
    ]
    shown = [["" if rows[k][0] == rows[k - 1][0] and k else row[0], *row[1:]] for k, row in enumerate(rows)]
    return table(["table", "key", "meaning", "values", "default"], shown)


def values_of(row: Name) -> tuple[str, str]:
    """Return (allowed values, default) of a key as texts."""
    if row.choices:
        return ", ".join(
            f'"{one.name.lower()}"' for one in row.choices
        ), f'"{row.choices(int(row.default or 0)).name.lower()}"'
    default = "none" if row.default is None or math.isnan(row.default) else number_text(row.default)
    if row.table == "physical":
        return "a number" if row.unit == "1" else f"a number in {row.unit_text}", default
    if row.high == math.inf:
        return f"an integer ≥ {row.low:g}", default
    return f"{number_text(row.low)} to {number_text(row.high)}", default


class Place(NamedTuple):
    """A table: its page, the name of its JSON file ("" if it has none), and the function that makes the table."""

    page: Path
    source: str
    make: Callable[[dict[str, Any]], str]


PAGE = ROOT / "docs" / "benchmarks.md"
FAILURES = ROOT / "docs" / "where_methods_fail.md"
RATES = ROOT / "benchmarks" / "switches" / "RATES.md"

TABLES = {
    "speed": Place(ROOT / "README.md", "throughput", speed),
    "throughput": Place(PAGE, "throughput", throughput),
    "accuracy_speed": Place(PAGE, "accuracy_speed", accuracy_speed),
    "scaling": Place(PAGE, "scaling", scaling),
    "compile_time": Place(PAGE, "compile_time", compile_time),
    "explorer": Place(ROOT / "docs" / "explorer.md", "explorer", explorer),
    "first_picture": Place(ROOT / "docs" / "explorer.md", "first_picture", first_picture),
    "failures": Place(FAILURES, "failures", failures),
    "keys": Place(ROOT / "docs" / "commands.md", "", keys),
    "quantities": Place(ROOT / "docs" / "maps.md", "", quantities),
    "first_difference": Place(RATES, "first_difference", first_differences),
    "switches_pairs": Place(FAILURES, "", close_pairs),
    "switches_measured": Place(RATES, "", measured_switches),
    "switches_order": Place(RATES, "", lambda _: table(*passes.orders())),
    "switches_grids": Place(RATES, "", lambda _: table(*passes.grids())),
    "switches_level_0": Place(RATES, "", pass_rates(0)),
    "switches_level_1": Place(RATES, "", pass_rates(1)),
    "switches_level_2": Place(RATES, "", pass_rates(2)),
    "switches_level_3": Place(RATES, "", pass_rates(3)),
}


def fill(text: str, name: str, content: str) -> str | None:
    """Return `text` with the part between the markers of `name` replaced; None without markers."""
    begin, end = f"<!-- benchmark:{name} -->", f"<!-- /benchmark:{name} -->"
    pattern = re.compile(re.escape(begin) + ".*?" + re.escape(end), re.DOTALL)
    if not pattern.search(text):
        return None
    return pattern.sub(lambda _: f"{begin}\n{content}\n{end}", text)


def show(page: Path, contents: Mapping[str, str], picture: Path, fig: Any) -> None:
    """Save a figure as `picture`, print tables by name, and write them into a page that has their markers."""
    fig.savefig(picture)
    plt.close(fig)
    write_into(page, contents)


def write_into(page: Path, contents: Mapping[str, str]) -> None:
    """Print tables by name, and write them into a page that has their markers."""
    text = page.read_text(encoding="utf-8")
    for name, content in contents.items():
        print(content, end="\n\n")
        text = fill(text, name, content) or text
    page.write_text(text, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("-i", "--input", type=Path, default=RESULTS, help="directory of the JSON files")
    options = parser.parse_args()
    for name, place in TABLES.items():
        source = options.input / f"{place.source}.json"
        if place.source and not source.exists():
            say(f"{name}: not measured, left as it is")
            continue
        data = json.loads(source.read_text(encoding="utf-8")) if place.source else {}
        text = place.page.read_text(encoding="utf-8")
        filled = fill(text, name, place.make(data))
        if filled is None:
            say(f"{name}: no markers in {place.page.name}")
            continue
        place.page.write_text(filled, encoding="utf-8")
        say(f"{name}: written to {place.page.name}")


if __name__ == "__main__":
    main()
