"""`vibrodrive orbits CONFIG` over A and B: a table, a file and a figure of the curves of bifurcations."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from vibrodrive.figures.style import save
from vibrodrive.jobs.orbits import MAX_PERIOD, UNTOLD, check_undisturbed
from vibrodrive.model.parameters import bad
from vibrodrive.model.plan import Plan
from vibrodrive.periodic.curves import NUM, Curve, curves
from vibrodrive.periodic.meetings import meeting_points
from vibrodrive.periodic.search import check_period
from vibrodrive.store.curves import StoredCurves, load_curves, save_curves
from vibrodrive.store.file import made_already
from vibrodrive.store.layout import Origin


def run_curves(
    plan: Plan,
    out: Path,
    *,
    max_period: int = MAX_PERIOD,
    origin: Origin = UNTOLD,
    figure: Path | None = None,
    overwrite: bool = False,
) -> list[Curve]:
    """Find the curves of bifurcations in the ranges of a plan, write them to `out` and draw them.

    A file that is there and was made from the same is drawn and listed again.

    Parameters
    ----------
    plan : Plan
        a sweep of the undisturbed motion over A and B; of its axes only the ranges count, and the number of values
        of B, up to 17: at so many bifurcations are sought.
    out : Path
        HDF5 file.
    max_period : int
        longest period sought, in excitation periods.
    origin : Origin
        the configuration, verbatim, with the options that replaced parts of it, and a title, for the file.
    figure : Path, optional
        the figure, if not beside `out`.
    overwrite : bool
        replace a result file that is there.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed.
    Different
        if `out` was made from another configuration.
    NoResult
        if `out` is there and is no file of curves; with `overwrite`: no result file of this program.
    OSError
        if a file cannot be written.
    """
    longest = check_period("max_period", max_period)
    check_plane(plan)
    if not overwrite and made_already(out, "curves", plan, max_period=longest):
        found = load_curves(out)
    else:
        A, B = _ends(plan, "A"), _ends(plan, "B")
        found = StoredCurves(curves(A, B, longest, num=min(len(plan.axes["B"]), NUM)), longest, A, B)
        save_curves(out, found, origin._replace(title=origin.title or "Bifurcations of a friction-impact oscillator"))
    save(found.plot(), figure or out.with_suffix(".png"))
    return found.curves


def check_plane(plan: Plan) -> None:
    """Refuse what the map does not describe: other axes than A and B, a disturbance, another way to find switches."""
    if set(plan.axes) != {"A", "B"}:
        raise ValueError(bad("axes", ", ".join(plan.axes) or "none", "A alone, or A and B"))
    for name, values in plan.axes.items():
        if not values.min() < values.max():
            raise ValueError(bad(name, values.tolist(), "at least two values"))
    check_undisturbed(plan)


def _ends(plan: Plan, name: str) -> tuple[float, float]:
    values = plan.axes[name]
    return float(values.min()), float(values.max())


def listed(found: list[Curve]) -> dict[str, Any]:
    """The same as `table` for other programs, of types that JSON knows; curves are numbered from 0."""
    curves = [
        {
            "kind": c.kind, "period": c.period, "impacts": c.impacts, "word": c.word, "ends": list(c.ends),
            "A": c.A.tolist(), "B": c.B.tolist(),
        } for c in found
    ]  # fmt: skip
    return {
        "curves": curves,
        "meetings": [{"A": A, "B": B, "curves": list(several)} for A, B, several in meeting_points(found)],
    }


def table(found: list[Curve]) -> str:
    """The curves, a line each: where they begin and end, and why; then the points where two meet."""
    head = f"{'kind':<15}  {'period':>6}  {'from A':>12}  {'B':>12}  {'to A':>12}  {'B':>12}  {'ends':<19}  word"
    lines = [head]
    for c in found:
        ends = "  ".join(f"{c.A[i]:12.8f}  {c.B[i]:12.8f}" for i in (0, -1))
        lines.append(f"{c.kind:<15}  {c.period:6d}  {ends}  {', '.join(c.ends):<19}  {c.word}")
    points = meeting_points(found)
    for A, B, several in points:
        lines.append(f"lines {', '.join(str(i + 1) for i in several)} meet at A = {A:.12f}, B = {B:.12f}")
    lines.append(f"{len(found)} curves; points where they meet: {len(points)}")
    return "\n".join(lines)
