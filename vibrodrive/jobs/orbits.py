"""`vibrodrive orbits CONFIG`: all periodic orbits over A and their bifurcations, as a table and as a figure.

The amplitude or the frequency of a machine may be the axis in place of A. With several values of B, or of a quantity
that gives B, only the bifurcations are found; `plot --over` draws their table over a map.
"""

from __future__ import annotations

import itertools
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
from vibrodrive.model.figure import DIMENSIONLESS
from vibrodrive.model.names import SCENE
from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import INCLINES, UNITS, column, has_units
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import SECTION
from vibrodrive.periodic.bifurcations import Bifurcation, ways
from vibrodrive.periodic.family import Family, family
from vibrodrive.periodic.search import Orbit, check_period

MAX_PERIOD = 3  # default of the longest period of orbits, in excitation periods


class Result(NamedTuple):
    """Result of a search: the orbits at the values of A, or None with several values of B, and the bifurcations.

    si : True if there is a scene, and its quantities are shown in SI units.
    """

    plan: Plan
    max_period: int
    si: bool
    family: Family | None
    bifurcations: list[Bifurcation]

    @property
    def varied(self) -> list[str]:
        """The quantities of the scene that vary."""
        return [name for name in self.plan.axes if name in SCENE]


def check(config: Config) -> tuple[Plan, int, bool]:
    """Return the plan and the longest period of a search, and whether its results are in SI units.

    Raises ValueError for axes that do not give A, or A and B, for a disturbance, and for a method other than
    `certified`.
    """
    plan = config.plan()
    ways(plan)
    for name, values in plan.axes.items():
        if len(np.unique(values)) < 2:
            raise ValueError(bad(name, values.tolist(), "at least two different values"))
    if plan.scalars["eps"] != 0.0:
        raise ValueError(bad("eps", plan.scalars["eps"], "0, because orbits are those of the undisturbed motion"))
    if plan.settings.method != Method.CERTIFIED:
        raise ValueError(bad("method", plan.settings.method_name, "certified"))
    si = has_units(plan.values) and config.figure.get("units") != DIMENSIONLESS
    return plan, check_period("max_period", config.orbits.get("max_period", MAX_PERIOD)), si


def find(plan: Plan, max_period: int, si: bool) -> Result:
    """Find all orbits at the values of A and their bifurcations or, with several values of B, all bifurcations."""
    all_ways = ways(plan)
    if len(plan.axes) > 1:
        return Result(plan, max_period, si, None, [b for way in all_ways for b in way.bifurcations(max_period)])
    orbits = family([*all_ways[0].values], all_ways[0].B, max_period, all_ways[0].scene)
    return Result(plan, max_period, si, orbits, orbits.bifurcations)


def columns(result: Result) -> list[str]:
    """Return the columns of the table: an orbit at one A has `multiplier`, a bifurcation the multipliers below and
    above it. `phase` and `speed` are those of the first impact."""
    sides = ["multiplier_below", "multiplier_above"]
    speed = column("speed", UNITS["velocity"].si if result.si else "1")
    return ["kind", *result.varied, "A", "B", "period", "impacts", "multiplier", *sides, "phase", speed, "word"]


def rows(result: Result) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of the table, in the order of A: first all orbits, then all bifurcations."""
    for orbit in itertools.chain(*(result.family.orbits if result.family else [])):
        yield f"{orbit.kind} orbit", *_at(result, orbit), orbit.multiplier, "", "", *_impact(result, orbit)
    for b in result.bifurcations:
        sides = ("" if math.isnan(m) else m for m in (b.multiplier_below, b.multiplier_above))
        yield b.kind, *_at(result, b), "", *sides, *_impact(result, b.orbit)


def _at(result: Result, item: Orbit | Bifurcation) -> tuple[Any, ...]:
    orbit = item.orbit if isinstance(item, Bifurcation) else item
    varied = (item.scene.given[name] for name in result.varied) if item.scene else ()
    return *varied, item.A, item.B, orbit.period, orbit.impacts


def _impact(result: Result, orbit: Orbit) -> tuple[Any, ...]:
    speed = orbit.speeds[0]
    return orbit.phases[0], orbit.scene.velocity(speed) if result.si and orbit.scene else speed, orbit.word


def printed(result: Result) -> str:
    """Return a line for each bifurcation, and a line with the numbers of bifurcations and orbits."""
    several = result.family is None
    names = [*result.varied, "A", *(["B"] if several else [])]
    lines = [
        "  ".join(
            [
                *(f"{name:>18}" for name in names),
                f"{'kind':<15}  {'period':>6}  {'impacts':>7}  {'multiplier below / above':<24}  word",
            ]
        )
    ]
    for b in result.bifurcations:
        at = "  ".join(f"{number:18.14f}" for number in _at(result, b)[: len(names)])
        lines.append(f"{at}  {b.kind:<15}  {b.orbit.period:6d}  {b.orbit.impacts:7d}  {b.change:<24}  {b.orbit.word}")
    count = counted(len(result.bifurcations), "bifurcation")
    if result.family is None:
        (along,) = (name for name in result.plan.axes if name in INCLINES)
        return "\n".join([*lines, f"{count} at {counted(len(result.plan.axes[along]), 'value')} of {along}"])
    counts = Counter(orbit.kind for orbit in itertools.chain(*result.family.orbits))
    kinds = ", ".join(f"{n} {kind}" for kind, n in sorted(counts.items())) or "none"
    values = f"{len(result.family.A)} values of A"
    return "\n".join([*lines, f"{count}; orbits of up to {counted(result.max_period, 'period')} at {values}: {kinds}"])


def drawn(result: Result, **look: Any) -> Figure:
    """Draw the orbits over simulated motions; with several values of B the plane of both axes."""
    if result.family is None:
        return plane_figure(result.bifurcations, result.plan, result.max_period, **look)
    simulated = collect(replace(result.plan, record=(SECTION,)))
    return bifurcation_diagram(result.family, simulated if result.si else simulated.dimensionless(), **look)
