"""Pass rates on the set of switches, read from its stored results, for tables and the chart over difficulty."""

import json
import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from benchmarks.switches.run import HERE, LATE, cases_of

RESULTS = HERE / "results"

NAMES = {
    "vibrodrive certified": "certified (ours)",
    "vibrodrive muller": "Muller on a grid (ours)",
    "vibrodrive fixed": "fixed Δτ (ours)",
    "scan + Newton": "scan + Newton",
    "scan of g and g′": "scan of g and g′",
    "branch and prune": "branch and prune",
    "branch and prune, Arb": "branch and prune with Arb",
    "scipy brentq on a grid": "brentq on a grid",
    "NumPy Chebyshev roots": "Chebyshev roots",
    "RK4 + bisection": "RK4 + bisection",
    "heyoka": "heyoka",
    "scipy solve_ivp RK45": "scipy RK45",
    "scipy solve_ivp DOP853": "scipy DOP853",
    "scipy solve_ivp LSODA": "scipy LSODA",
    "CVODE": "CVODE",
    "diffrax Tsit5": "diffrax Tsit5",
    "diffrax Dopri8": "diffrax Dopri8",
    "Moreau-Jean": "time-stepping (Moreau–Jean)",
    "regularised friction, penalty contact explicit": "regularised, explicit",
    "regularised friction, penalty contact implicit": "regularised, implicit",
}
"""Methods in the order of the tables, and their labels in the tables. Those with the ADVISED settings follow."""

ADVISED = ", as advised"


class Method(NamedTuple):
    """A method of a solver. For each setting, `right` maps the id of a case to True if its answer is right, `seconds` a
    level to its CPU time, if it was stored, and `late` a level to the number of its time-outs."""

    label: str
    program: str
    version: str
    settings: list[dict[str, Any]]
    right: list[dict[str, bool]]
    seconds: list[dict[int, float]]
    late: list[dict[int, int]]

    def rates(self, ids: set[str]) -> list[float]:
        """Return the share of right answers to these cases at each setting. A setting without results for these cases
        is left out."""
        rows = [[right for name, right in row.items() if name in ids] for row in self.right]
        return [sum(row) / len(row) for row in rows if row]

    def grid(self) -> str:
        """Return as text the values of each parameter of the settings."""
        values: dict[str, dict[str, None]] = {}
        for setting in self.settings:
            for name, x in setting.items():
                if isinstance(x, float):
                    values.setdefault(name, {})[f"{x:.2g}".replace("e-0", "e-").replace("e+0", "e")] = None
        return "; ".join(f"{name} {', '.join(found)}" for name, found in values.items())


def key(solver: str, setting: dict[str, Any]) -> str:
    """Return the name of a method: the solver, and the parts of its setting that are not numbers."""
    kind = setting.get("method") or {True: "implicit", False: "explicit"}.get(setting.get("implicit", ""), "")
    return f"{solver} {kind}".strip() + (ADVISED if setting.get("advised") else "")


def methods() -> list[Method]:
    """Return all methods with stored results, in the order of NAMES."""
    found: dict[str, Method] = {}
    for result in results():
        ids = [case["id"] for case in cases_of([result["level"]])]
        for run in result["runs"]:
            name = key(result["solver"], run["settings"])
            label = NAMES.get(base := name.removesuffix(ADVISED), base) + name[len(base) :]
            method = found.setdefault(name, Method(label, result["solver"], result["version"], [], [], [], []))
            if run["settings"] not in method.settings:
                method.settings.append(run["settings"])
                method.right.append({})
                method.seconds.append({})
                method.late.append({})
            k = method.settings.index(run["settings"])
            if "seconds" in run:
                method.seconds[k][result["level"]] = run["seconds"]
            late = [ids for reason, ids in run["refused"].items() if reason.startswith(LATE)]
            method.late[k][result["level"]] = sum(map(len, late))
            method.right[k].update({i: letter in "rR" for i, letter in zip(ids, run["verdicts"], strict=True)})
    order = {name + way: (k, way) for k, name in enumerate(NAMES) for way in ("", ADVISED)}
    return [found[name] for name in sorted(found, key=lambda n: order.get(n, (math.inf, "")))]


def best(method: Method, ids: set[str], level: int) -> int | None:
    """Return the number of the setting with the most right answers to these cases, the quickest of equal ones.

    A setting without results for these cases does not count. None if no setting has any.
    """
    known = [k for k, row in enumerate(method.right) if ids & row.keys()]
    if not known:
        return None
    return max(known, key=lambda k: (sum(method.right[k][i] for i in ids), -method.seconds[k].get(level, math.inf), -k))


def written(setting: dict[str, Any]) -> str:
    """Return the numbers of a setting as text, and whether it follows the manual's advice."""
    numbers = [f"{name} {x:.2g}".replace("e-0", "e-") for name, x in setting.items() if isinstance(x, float)]
    return ", ".join(numbers) or "–"


def in_seconds(seconds: float) -> str:
    """Return a time in seconds with two digits, and whole seconds from ten on."""
    return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.2g} s"


def percent(method: Method, k: int, ids: set[str]) -> str:
    return f"{100 * sum(method.right[k][i] for i in ids) / len(ids):.0f}"


def table(level: int) -> tuple[list[str], list[list[str]]]:
    """Return head and rows of the table of a level: each method at its best setting, with its cost and pass rates.

    The best setting is that with the most right answers to the whole level. Its cost is the CPU time for the level, to
    which each time-out adds the limit of time.
    """
    families: dict[str, set[str]] = {}
    for case in cases_of([level]):
        families.setdefault(case["family"], set()).add(case["id"])
    ids = set().union(*families.values())
    rows = []
    for method in methods():
        if method.program.startswith("regularised") or (k := best(method, ids, level)) is None:
            continue
        right = sum(method.right[k][i] for i in ids)
        cost, late = in_seconds(method.seconds[k][level]), str(method.late[k][level])
        cells = [percent(method, k, family) for family in families.values()]
        rows.append([method.label, written(method.settings[k]), f"{right} of {len(ids)}", cost, late, *cells])
    head = ["method", "best setting", "right", "CPU time", "time-outs"]
    return head + [f"{name} ({len(family)})" for name, family in families.items()], rows


def orders() -> tuple[list[str], list[list[str]]]:
    """Return head and rows of the table of methods that do not locate events: the best three settings of each."""
    measured = json.loads((RESULTS / "order.json").read_text(encoding="utf-8"))
    rows = []
    for name in dict.fromkeys(row["method"] for row in measured):
        here = [row for row in measured if row["method"] == name]
        for row in sorted(here, key=lambda r: (-r["whole"], -r["share"], r["error"]))[:3]:
            whole = f"{row['whole']} of {row['motions']}"
            error = f"{row['error']:.1e}".replace("e-0", "e-")
            cost = in_seconds(row["seconds"])
            rows.append([name, written(row["setting"]), whole, cost, f"{100 * row['share']:.0f} %", error])
    head = ["method", "setting", "motions with the right order of all states", "CPU time"]
    return [*head, "events before the first wrong state", "largest error of their times (median of the motions)"], rows


def grids() -> tuple[list[str], list[list[str]]]:
    """Return head and rows of the table of settings."""
    rows = [[m.label, str(len(m.settings)), m.grid() or "none"] for m in methods()]
    return ["method", "number of settings", "numerical parameters of the settings"], rows


def by_difficulty(edges: list[int], families: Sequence[str]) -> list[set[str]]:
    """Return the ids of the cases of level 0 in each interval of difficulty. Only cases of `families` with the verdict
    `certain` count."""
    cases = [c for c in cases_of([0]) if c["family"] in families and c["difficulty"] and c["verdict"] == "certain"]
    return [{c["id"] for c in cases if a <= c["difficulty"] < b} for a, b in pairwise(edges)]


def over_difficulty(method: Method, edges: list[int], families: Sequence[str]) -> list[list[float]]:
    """Return the pass rates of all settings in each interval of `by_difficulty`."""
    return [method.rates(ids) for ids in by_difficulty(edges, families)]


def results() -> list[dict[str, Any]]:
    """Return the stored results of all solvers."""
    return [json.loads(path.read_text(encoding="utf-8")) for path in sorted(RESULTS.glob("level*/*.json"))]


def span(values: Iterable[Any]) -> str:
    """Return the least and the largest value as a text."""
    found = sorted(set(values))
    return " to ".join(dict.fromkeys(f"{x:g}" if isinstance(x, float) else x for x in (found[0], found[-1])))


def dates() -> str:
    """Return the first and the last date of the measurements."""
    return span(result["environment"]["measured"] for result in results())


def limits() -> tuple[str, str]:
    """Return the limits of CPU time as text: for a case of levels 0 and 1, and for a case of levels 2 and 3."""
    found = [(result["level"], result["limit"]) for result in results()]
    return span(limit for level, limit in found if level < 2), span(limit for level, limit in found if level > 1)
