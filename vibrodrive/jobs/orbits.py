"""`vibrodrive orbits CONFIG` over A: a table, a file and figures of all orbits."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vibrodrive.batch.sweep import collect
from vibrodrive.figures.orbits import bifurcation_diagram, multiplier_diagram
from vibrodrive.figures.style import styled
from vibrodrive.jobs.runner import Recipe, Work
from vibrodrive.model.choices import Method
from vibrodrive.model.config import Config
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.model.results import Results
from vibrodrive.periodic.family import family
from vibrodrive.periodic.search import check_period
from vibrodrive.store.layout import Origin
from vibrodrive.store.orbits import MAX_PERIOD, StoredOrbits, save

DIAGRAMS = ("bifurcation", "multipliers")


def check(config: Config, plan: Plan) -> dict[str, Any]:
    """Return {"max_period": longest period of the search}.

    Raises ValueError for an axis other than A, for a disturbance, and for a method other than `certified`.
    """
    if list(plan.axes) != ["A"]:
        raise ValueError(bad_axes(plan.axes, "A only, or A and B"))
    if len(np.unique(plan.axes["A"])) < 2:
        raise ValueError(bad("A", plan.axes["A"].tolist(), "at least two different values"))
    return check_undisturbed(config, plan)


def check_undisturbed(config: Config, plan: Plan) -> dict[str, Any]:
    """Return {"max_period": longest period of the search}.

    Raises ValueError for a disturbance, and for a method other than `certified`.
    """
    if plan.scalars["eps"] != 0.0:
        raise ValueError(bad("eps", plan.scalars["eps"], "0, because orbits are those of the undisturbed motion"))
    if plan.settings.method != Method.CERTIFIED:
        raise ValueError(bad("method", plan.settings.method_name, "certified"))
    return {"max_period": check_period("max_period", config.orbits.get("max_period", MAX_PERIOD))}


def make(work: Work) -> bool:
    """Find all orbits at the values of A of a plan, and save them with the section phase of the plan."""
    scalars = work.plan.scalars
    found = family(work.plan.axes["A"], scalars["B"], work.own["max_period"])
    save(work.path, found, Origin.of(work.config, "Orbits of a friction-impact oscillator"), scalars["section_phase"])
    return True


def brute_force(plan: Plan, threads: int | None) -> Results:
    """Simulate the undisturbed motions of a plan over A, and return results that contain their section points."""
    kept = {name: plan.scalars[name] for name in ("B", "xi0", "dxi0", "tau0", "section_phase")}
    s = plan.settings
    return collect(make_plan({"A": plan.axes["A"], **kept, "transient": s.transient, "periods": s.periods}), threads)


@styled
def drawn(
    stored: StoredOrbits,
    kind: str = "bifurcation",
    quantity: str = "dxi",
    *,
    ax: Any = None,
    threads: int | None = None,
) -> Figure:
    """Draw the "bifurcation" diagram of a file of orbits, or their "multipliers". Raises ValueError for another kind.

    If the configuration in the file matches the results, its motions are simulated again and drawn below the orbits.
    """
    if kind not in DIAGRAMS:
        raise ValueError(bad("kind", kind, "one of " + ", ".join(DIAGRAMS)))
    if kind == "multipliers":
        return multiplier_diagram(stored.family)
    plan, phase = stored.plan, stored.section_phase
    brute = brute_force(plan, threads) if plan is not None and plan.scalars["section_phase"] == phase else None
    return bifurcation_diagram(stored.family, brute, quantity, phase)


def listed(stored: StoredOrbits) -> dict[str, Any]:
    """Return the contents of `table` in types of JSON. Numbers may be NaN."""
    found = stored.family
    bifurcations = [
        {
            "A": b.A, "kind": b.kind, "period": b.orbit.period, "impacts": b.orbit.impacts,
            "multiplier_below": b.multiplier_below, "multiplier_above": b.multiplier_above, "word": b.orbit.word,
        } for b in found.bifurcations
    ]  # fmt: skip
    return {
        "B": found.B, "max_period": found.max_period, "values_of_A": len(found.A), "orbits": stored.facts()["orbits"],
        "bifurcations": bifurcations,
    }  # fmt: skip


def table(stored: StoredOrbits) -> str:
    """Return a line for each bifurcation, and a line with the numbers of bifurcations and orbits."""
    found = stored.family
    lines = [f"{'A':>18}  {'kind':<15}  {'period':>6}  {'impacts':>7}  {'multiplier below / above':<24}  word"]
    for b in found.bifurcations:
        orbit = f"{b.orbit.period:6d}  {b.orbit.impacts:7d}  {b.change:<24}  {b.orbit.word}"
        lines.append(f"{b.A:18.14f}  {b.kind:<15}  {orbit}")
    kinds = ", ".join(f"{n} {kind}" for kind, n in stored.facts()["orbits"].items()) or "none"
    lines.append(
        f"{len(found.bifurcations)} bifurcations; orbits of up to {found.max_period} periods at "
        f"{len(found.A)} values of A: {kinds}"
    )
    return "\n".join(lines)


def figures(stored: StoredOrbits, threads: int | None) -> list[Figure]:
    """Draw the bifurcation diagram over the simulated motions of the configuration, and the multipliers."""
    return [drawn(stored, kind, threads=threads) for kind in DIAGRAMS]


RECIPE = Recipe(check, make, figures, table, listed)
