"""`vibrodrive orbits CONFIG` over A and B: a table, a file and a figure of the curves of bifurcations."""

from typing import Any

from vibrodrive.jobs.orbits import check_undisturbed
from vibrodrive.jobs.runner import Recipe, Work
from vibrodrive.model.config import Config
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.plan import Plan
from vibrodrive.periodic.curves import NUM, curves
from vibrodrive.periodic.meetings import meeting_points
from vibrodrive.store.curves import StoredCurves, save
from vibrodrive.store.layout import Origin


def check(config: Config, plan: Plan) -> dict[str, Any]:
    """Return {"max_period": longest period of the search}.

    Raises ValueError for axes other than A and B, for a disturbance, and for a method other than `certified`.
    """
    if set(plan.axes) != {"A", "B"}:
        raise ValueError(bad_axes(plan.axes, "A only, or A and B"))
    for name, values in plan.axes.items():
        if not values.min() < values.max():
            raise ValueError(bad(name, values.tolist(), "at least two different values"))
    return check_undisturbed(config, plan)


def make(work: Work) -> bool:
    """Find the curves of bifurcations in the ranges of a plan.

    The ends of the axes are the ranges of A and B. The number of values on the axis of B, but at most 17, is the number
    of values of B at which the search for bifurcations starts. The values between the ends are not used.
    """
    plan, longest = work.plan, work.own["max_period"]
    A, B = ((float(plan.axes[name].min()), float(plan.axes[name].max())) for name in "AB")
    found = StoredCurves(curves(A, B, longest, num=min(len(plan.axes["B"]), NUM)), longest, A, B)
    save(work.path, found, Origin.of(work.config, "Bifurcations of a friction-impact oscillator"))
    return True


def listed(found: StoredCurves) -> dict[str, Any]:
    """Return the contents of `table` in types of JSON; curves are numbered from 0."""
    curves = [
        {
            "kind": c.kind, "period": c.period, "impacts": c.impacts, "word": c.word, "ends": list(c.ends),
            "A": c.A.tolist(), "B": c.B.tolist(),
        } for c in found.curves
    ]  # fmt: skip
    return {
        "curves": curves,
        "meetings": [{"A": A, "B": B, "curves": list(several)} for A, B, several in meeting_points(found.curves)],
    }


def table(found: StoredCurves) -> str:
    """Return a line for each curve, with both ends and their reasons, and a line for each point where curves meet."""
    head = f"{'kind':<15}  {'period':>6}  {'from A':>12}  {'B':>12}  {'to A':>12}  {'B':>12}  {'ends':<19}  word"
    lines = [head]
    for c in found.curves:
        ends = "  ".join(f"{c.A[i]:12.8f}  {c.B[i]:12.8f}" for i in (0, -1))
        lines.append(f"{c.kind:<15}  {c.period:6d}  {ends}  {', '.join(c.ends):<19}  {c.word}")
    points = meeting_points(found.curves)
    for A, B, several in points:
        lines.append(f"curves {', '.join(str(i + 1) for i in several)} meet at A = {A:.12f}, B = {B:.12f}")
    lines.append(f"number of curves: {len(found.curves)}; points at which curves meet: {len(points)}")
    return "\n".join(lines)


RECIPE = Recipe(check, make, lambda found, threads: [found.plot()], table, listed)
