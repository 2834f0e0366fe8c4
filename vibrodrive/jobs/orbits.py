"""`vibrodrive orbits CONFIG`: all periodic orbits over A and their bifurcations, as a table and as a figure.

With several values of B only the bifurcations are found; `plot --over` draws their table over a map.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from vibrodrive.batch.sweep import collect
from vibrodrive.figures.orbits import bifurcation_diagram
from vibrodrive.figures.plane import plane_figure
from vibrodrive.model.choices import Method
from vibrodrive.model.config import Config
from vibrodrive.model.described import counted
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import SECTION
from vibrodrive.periodic.bifurcations import Bifurcation, bifurcations
from vibrodrive.periodic.family import Family, family
from vibrodrive.periodic.search import check_period

MAX_PERIOD = 3  # default of the longest period of orbits, in excitation periods

COLUMNS = (
    "kind", "A", "B", "period", "impacts", "multiplier", "multiplier_below", "multiplier_above", "phase", "speed",
    "word",
)  # fmt: skip
"""Columns of the table: an orbit at one A has `multiplier`, a bifurcation the multipliers below and above it. `phase`
and `speed` are those of the first impact."""


class Found(NamedTuple):
    """Result of a search: the orbits at the values of A, or None with several values of B, and the bifurcations."""

    plan: Plan
    max_period: int
    family: Family | None
    bifurcations: list[Bifurcation]


def check(config: Config) -> tuple[Plan, int]:
    """Return the plan and the longest period of a search.

    Raises ValueError for axes other than A, or A and B, for a disturbance, and for a method other than `certified`.
    """
    plan = config.plan()
    if list(plan.axes) not in (["A"], ["A", "B"], ["B", "A"]):
        raise ValueError(bad_axes(plan.axes, "A only, or A and B"))
    for name, values in plan.axes.items():
        if len(np.unique(values)) < 2:
            raise ValueError(bad(name, values.tolist(), "at least two different values"))
    if plan.scalars["eps"] != 0.0:
        raise ValueError(bad("eps", plan.scalars["eps"], "0, because orbits are those of the undisturbed motion"))
    if plan.settings.method != Method.CERTIFIED:
        raise ValueError(bad("method", plan.settings.method_name, "certified"))
    return plan, check_period("max_period", config.orbits.get("max_period", MAX_PERIOD))


def find(plan: Plan, max_period: int) -> Found:
    """Find all orbits at the values of A and their bifurcations or, with several values of B, all bifurcations."""
    A = plan.axes["A"]
    if "B" in plan.axes:
        found = bifurcations((A.min(), A.max()), plan.axes["B"], max_period)
        return Found(plan, max_period, None, found)
    there = family(A, plan.scalars["B"], max_period)
    return Found(plan, max_period, there, there.bifurcations)


def rows(found: Found) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of the table, in the order of A: first all orbits, then all bifurcations."""
    for orbit in (orbit for there in (found.family.orbits if found.family else []) for orbit in there):
        first = orbit.phases[0], orbit.speeds[0]
        yield (
            f"{orbit.kind} orbit",
            orbit.A,
            orbit.B,
            orbit.period,
            orbit.impacts,
            orbit.multiplier,
            "",
            "",
            *first,
            orbit.word,
        )
    for b in found.bifurcations:
        o, sides = b.orbit, (b.multiplier_below, b.multiplier_above)
        first = (o.phases[0], o.speeds[0]) if len(o.phases) else ("", "")
        yield b.kind, b.A, b.B, o.period, o.impacts, "", *("" if math.isnan(m) else m for m in sides), *first, o.word


def printed(found: Found) -> str:
    """Return a line for each bifurcation, and a line with the numbers of bifurcations and orbits."""
    several = found.family is None
    incline = f"{'B':>18}  " if several else ""
    lines = [f"{'A':>18}  {incline}{'kind':<15}  {'period':>6}  {'impacts':>7}  {'multiplier below / above':<24}  word"]
    for b in found.bifurcations:
        at = f"{b.A:18.14f}  " + (f"{b.B:18.14f}  " if several else "")
        lines.append(f"{at}{b.kind:<15}  {b.orbit.period:6d}  {b.orbit.impacts:7d}  {b.change:<24}  {b.orbit.word}")
    said = counted(len(found.bifurcations), "bifurcation")
    if found.family is None:
        return "\n".join([*lines, f"{said} at {counted(len(found.plan.axes['B']), 'value')} of B"])
    counts = Counter(orbit.kind for there in found.family.orbits for orbit in there)
    kinds = ", ".join(f"{n} {kind}" for kind, n in sorted(counts.items())) or "none"
    values = f"{len(found.family.A)} values of A"
    return "\n".join([*lines, f"{said}; orbits of up to {counted(found.max_period, 'period')} at {values}: {kinds}"])


def drawn(found: Found, **look: Any) -> Figure:
    """Draw the orbits over simulated motions; with several values of B the plane of A and B."""
    if found.family is None:
        return plane_figure(found.bifurcations, found.max_period, **look)
    simulated = collect(replace(found.plan, record=(SECTION,))).dimensionless()
    return bifurcation_diagram(found.family, simulated, **look)
