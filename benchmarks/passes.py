"""Pass rates on the set of switches, read from its stored results, for tables and the chart over difficulty."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from benchmarks.switches.run import HERE, cases_of

RESULTS = HERE / "results"

NAMES = {
    "vibrodrive certified": "certified (ours)",
    "vibrodrive muller": "Muller on a grid (ours)",
    "vibrodrive fixed": "fixed Δτ (ours)",
    "scan + Newton": "scan + Newton",
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
"""Methods in the order of the tables, and their labels there."""


class Method(NamedTuple):
    """A method of a solver: its cases, whether each is right at each setting, and the settings."""

    label: str
    program: str
    version: str
    cases: list[dict[str, Any]]
    right: list[list[bool]]  # by setting, by case
    settings: list[dict[str, Any]]

    def rates(self, ids: set[str]) -> list[float]:
        """Return the share of right answers to some cases at each setting; an empty list without such cases."""
        chosen = [i for i, case in enumerate(self.cases) if case["id"] in ids]
        return [sum(row[i] for i in chosen) / len(chosen) for row in self.right] if chosen else []


def key(solver: str, setting: dict[str, Any]) -> str:
    """Return the name of a method: the solver, and the parts of its setting that are not numbers."""
    kind = setting.get("method") or {True: "implicit", False: "explicit"}.get(setting.get("implicit", ""), "")
    return f"{solver} {kind}".strip()


def methods() -> list[Method]:
    """Return all methods with stored results, in the order of NAMES."""
    found: dict[str, Method] = {}
    for result in results():
        cases = cases_of(result["levels"])
        for run in result["runs"]:
            name = key(result["solver"], run["settings"])
            method = found.setdefault(
                name, Method(NAMES.get(name, name), result["solver"], result["version"], cases, [], [])
            )
            method.right.append([letter in "rR" for letter in run["verdicts"]])
            method.settings.append(run["settings"])
    order = {name: k for k, name in enumerate(NAMES)}
    return [found[name] for name in sorted(found, key=lambda n: order.get(n, math.inf))]


def cell(rates: list[float]) -> str:
    """Return the mean and the best rate of all settings, in percent."""
    if not rates:
        return ""
    mean, best = 100 * sum(rates) / len(rates), 100 * max(rates)
    return f"{mean:.0f}" if len(rates) == 1 else f"{mean:.0f} ({best:.0f})"


def table(level: int) -> tuple[list[str], list[list[str]]]:
    """Return head and rows of the table of pass rates of a level, method × family."""
    families: dict[str, set[str]] = {}
    for case in cases_of([level]):
        families.setdefault(case["family"], set()).add(case["id"])
    rows = []
    for method in methods():
        cells = [cell(method.rates(ids)) for ids in families.values()]
        if any(cells):
            rows.append([method.label, str(len(method.right)), *cells])
    return ["method", "settings", *(f"{family} ({len(ids)})" for family, ids in families.items())], rows


def over_difficulty(method: Method, edges: list[int], families: Sequence[str]) -> list[list[float]]:
    """Return the pass rates of all settings in each interval of difficulty, over certain cases of some families."""
    cases = [c for c in method.cases if c["family"] in families and c["difficulty"] and c["verdict"] == "certain"]
    return [method.rates({c["id"] for c in cases if a <= c["difficulty"] < b}) for a, b in pairwise(edges)]


def results() -> list[dict[str, Any]]:
    """Return the stored results of all solvers."""
    return [json.loads(path.read_text(encoding="utf-8")) for path in sorted(RESULTS.glob("*.json"))]


def span(values: Iterable[Any]) -> str:
    """Return the least and the largest value as a text."""
    found = sorted(set(values))
    return " to ".join(dict.fromkeys(f"{x:g}" if isinstance(x, float) else x for x in (found[0], found[-1])))


def dates() -> str:
    """Return the first and the last date of the measurements."""
    return span(result["environment"]["measured"] for result in results())


def limits() -> tuple[str, str]:
    """Return the limits of CPU time, for a case of levels 0 and 1 and for one of levels 2 and 3."""
    short, long = zip(*(result["limits"] for result in results()), strict=True)
    return span(short), span(long)
