"""`vibrodrive orbits CONFIG`: a table, a file and figures of all orbits over a range of A."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vibrodrive.batch.sweep import collect
from vibrodrive.figures.orbits import bifurcation_diagram, multiplier_diagram
from vibrodrive.figures.style import save, styled
from vibrodrive.model.parameters import Method, bad
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.model.results import Results
from vibrodrive.periodic.family import Family, family
from vibrodrive.periodic.search import check_period
from vibrodrive.store.file import made_already
from vibrodrive.store.layout import Origin
from vibrodrive.store.orbits import StoredOrbits, load_orbits, save_family

MAX_PERIOD = 3

DIAGRAMS = ("bifurcation", "multipliers")
"""Figures of orbits over A."""

UNTOLD = Origin("")
"""What was not made from a configuration."""


def run_orbits(
    plan: Plan,
    out: Path,
    *,
    max_period: int = MAX_PERIOD,
    origin: Origin = UNTOLD,
    figure: Path | None = None,
    threads: int | None = None,
    overwrite: bool = False,
) -> Family:
    """Find all orbits over the A of a plan, write them to `out` and draw them.

    A file that is there and was made from the same is drawn and listed again.

    Parameters
    ----------
    plan : Plan
        a sweep of the undisturbed motion over A alone; its transient, periods and section phase are those of
        the brute-force points under the diagram.
    out : Path
        HDF5 file.
        The figures stand beside it: its name with the ending of `figure` (or .png), and the same
        with `_multipliers`.
    max_period : int
        longest period sought, in excitation periods.
    origin : Origin
        the configuration, verbatim, with the options that replaced parts of it, and a title, for the file.
    figure : Path, optional
        the bifurcation diagram, if not beside `out`.
    threads : int, optional
        of the brute-force sweep.
    overwrite : bool
        replace a result file that is there.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed.
    Different
        if `out` was made from another configuration.
    NoResult
        if `out` is there and is no file of orbits; with `overwrite`: no result file of this program.
    OSError
        if a file cannot be written.
    """
    longest = check_period("max_period", max_period)
    check_plan(plan)
    B, phase = plan.scalars["B"], plan.scalars["section_phase"]
    if not overwrite and made_already(out, "orbits", plan, max_period=longest):
        found = load_orbits(out).family
    else:
        found = family(plan.axes["A"], B, longest)
        save_family(out, found, origin._replace(title=origin.title or "Orbits of a friction-impact oscillator"), phase)
    diagram = figure or out.with_suffix(".png")
    save(bifurcation_diagram(found, brute_force(plan, threads), section_phase=phase), diagram)
    save(multiplier_diagram(found), diagram.with_stem(diagram.stem + "_multipliers"))
    return found


def check_plan(plan: Plan) -> None:
    """Refuse what orbits over A do not have: another axis than A, a disturbance, another way to find switches."""
    if list(plan.axes) != ["A"]:
        raise ValueError(bad("axes", ", ".join(plan.axes) or "none", "A alone, or A and B"))
    if len(np.unique(plan.axes["A"])) < 2:
        raise ValueError(bad("A", plan.axes["A"].tolist(), "at least two values"))
    check_undisturbed(plan)


def check_undisturbed(plan: Plan) -> None:
    """Refuse a disturbance, and another way to find switches."""
    if plan.scalars["eps"] != 0.0:
        raise ValueError(bad("eps", plan.scalars["eps"], "0: only the undisturbed motion is a map"))
    if plan.settings.method != Method.CERTIFIED:
        raise ValueError(bad("method", Method(plan.settings.method).name.lower(), "certified"))


def brute_force(plan: Plan, threads: int | None) -> Results:
    """The section points of the plan's own motion."""
    kept = {name: plan.scalars[name] for name in ("B", "xi0", "dxi0", "tau0", "section_phase")}
    s = plan.settings
    return collect(make_plan({"A": plan.axes["A"], **kept, "transient": s.transient, "periods": s.periods}), threads)


@styled
def drawn(stored: StoredOrbits, kind: str = "bifurcation", quantity: str = "dxi", *, ax: Any = None) -> Figure:
    """A figure of what a file of orbits holds: "bifurcation" or "multipliers", as `run_orbits` draws them.

    The brute-force points are computed anew from the configuration in the file, if that fits the file. `ax`: where to
    draw, one for each panel. Raises ValueError for another kind or quantity.
    """
    if kind not in DIAGRAMS:
        raise ValueError(bad("kind", kind, "one of " + ", ".join(DIAGRAMS)))
    if kind == "multipliers":
        return multiplier_diagram(stored.family)
    plan, phase = stored.plan, stored.section_phase
    brute = brute_force(plan, None) if plan is not None and plan.scalars["section_phase"] == phase else None
    return bifurcation_diagram(stored.family, brute, quantity, phase)


def listed(found: Family) -> dict[str, Any]:
    """The same as `table` for other programs, of types that JSON knows (NaN among the numbers)."""
    bifurcations = [
        {
            "A": b.A, "kind": b.kind, "period": b.orbit.period, "impacts": b.orbit.impacts,
            "multiplier_below": b.multiplier_below, "multiplier_above": b.multiplier_above, "word": b.orbit.word,
        } for b in found.bifurcations
    ]  # fmt: skip
    return {
        "B": found.B, "max_period": found.max_period, "values_of_A": len(found.A), "orbits": _kinds(found),
        "bifurcations": bifurcations,
    }  # fmt: skip


def _kinds(found: Family) -> dict[str, int]:
    """How many orbits of each kind there are, over all A."""
    return dict(sorted(Counter(o.kind for there in found.orbits for o in there).items()))


def table(found: Family) -> str:
    """The bifurcations, a line each, and how many orbits there are."""
    lines = [f"{'A':>18}  {'kind':<15}  {'period':>6}  {'impacts':>7}  {'multiplier below / above':<24}  word"]
    for b in found.bifurcations:
        orbit = f"{b.orbit.period:6d}  {b.orbit.impacts:7d}  {b.change:<24}  {b.orbit.word}"
        lines.append(f"{b.A:18.14f}  {b.kind:<15}  {orbit}")
    kinds = ", ".join(f"{n} {kind}" for kind, n in _kinds(found).items()) or "none"
    lines.append(
        f"{len(found.bifurcations)} bifurcations; orbits of up to {found.max_period} periods at "
        f"{len(found.A)} values of A: {kinds}"
    )
    return "\n".join(lines)
