"""Show for several criteria how k₂, the smallest disturbance that destroys the structure, depends on arbitrary choices.

    python -m examples.limit_definition   # in the root of a clone

prints the tables of benchmarks/paper/CRITERION.md; docs/stability.md defines the terms. They contain k₂ over three
choices: the phase of the section; the dividing speed between touches and main impacts, prescribed or below a bound;
the length of the record and the start. The tables are the reason to use the main impacts as the criterion.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from vibrodrive.batch.sweep import check_threads
from vibrodrive.jit.slices import Halt
from vibrodrive.model.plan import make_plan
from vibrodrive.stability.evaluate import Evaluator, Motion
from vibrodrive.stability.limit import LimitSearch, plan_limits
from vibrodrive.stability.limit_search import GRIDS, search_band
from vibrodrive.stability.main_impacts import are_main_impacts, follow_cycle
from vibrodrive.stability.structure import ReferenceOrbit, keeps, order

A = (1.3, 2.4, 2.65, 2.7, 2.75, 3.04, 3.1, 3.15, 3.17, 3.2, 3.25)
PHASES = (0.0, 0.8, math.pi / 2, 2.4, math.pi, 4.0, 4.8, 5.6)
SHARES = (0.05, 0.1, 0.2, 0.3)

Kept = Callable[[ReferenceOrbit, Motion], bool]  # returns True if the motion keeps the structure of the orbit


CRITERIA: dict[str, Kept] = {
    "order": lambda base, motion: bool(order(base.points, motion.section)),
    "gaps": lambda base, motion: keeps(base, motion.section, motion.impacts, ordered=False),
    "impacts": lambda base, motion: keeps(base, motion.section, motion.impacts),  # that of `vd.limit`
}


def with_free_speed(share: float) -> Kept:
    """Return the criterion of impacts with `share` in place of its default.

    An impact can be a touch only if it is slower than `share` times the speed of the slowest main impact of the orbit.
    """
    return lambda base, motion: (
        base.cycle is not None
        and follow_cycle(base.cycle, motion.impacts, len(motion.section), share=share) is not None
    )


def with_given_speed(share: float) -> Kept:
    """Return the criterion of impacts with a prescribed dividing speed between touches and main impacts.

    The dividing speed is `share` times the speed of the slowest main impact of the orbit.
    """

    def kept(base: ReferenceOrbit, motion: Motion) -> bool:
        if base.cycle is None:
            return False
        main = motion.impacts[are_main_impacts(base.cycle, motion.impacts, share)]
        chosen = follow_cycle(base.cycle, main, len(motion.section), share=0.0)
        return chosen is not None and len(chosen) == len(main) - 2

    return kept


def k2(kept: Kept, amplitudes: Sequence[float] = A, **arguments: float) -> np.ndarray:
    """Return k₂(ε) for the criterion `kept`: float64 (A,)."""
    plan = make_plan({"A": list(amplitudes), "eps": 1e-3, "periods": 1500, **arguments})
    found = np.full(plan.n_points, np.nan)
    with Evaluator(plan, "eps", check_threads(None), Halt()) as evaluator:
        orbits = evaluator.undisturbed(np.arange(plan.n_points))
        searches = {i: search_band(GRIDS["eps"]) for i, base in enumerate(orbits) if isinstance(base, ReferenceOrbit)}
        wanted = {i: next(search) for i, search in searches.items()}
        while wanted:
            requests = [(i, orbits[i], values) for i, values in wanted.items()]
            for i, answers in zip(list(wanted), evaluator.answers(requests, kept), strict=True):
                try:
                    wanted[i] = searches[i].send(np.array(answers))
                except StopIteration as end:
                    found[i] = end.value.lost
                    del wanted[i]
    return found


def over_window(disturbance: str, amplitudes: Sequence[float] = A) -> dict[str, np.ndarray]:
    """Return k₂, and the last value at which the structure is kept, for two lengths of the record and two starts.

    The keys are the titles of the rows, the values float64 (A,).
    """
    windows = {"1500 periods": {}, "20 000 periods": {"periods": 20_000}, "from τ0 = 2π": {"tau0": 2 * math.pi}}
    rows = {}
    for name, window in windows.items():
        found = dict(LimitSearch(plan_limits({"A": list(amplitudes), "periods": 1500, **window}, disturbance)).run())
        for end in ("k2", "last_kept"):
            rows[f"{name}, {end}"] = np.array([getattr(found[i], end) for i in range(len(amplitudes))])
    return rows


def table(name: str, rows: dict[str, np.ndarray]) -> str:
    """Return a Markdown table with a row for each entry and a column for each A.

    The last row is the ratio of the largest to the least value of each column.
    """
    values = np.array(list(rows.values()))
    spread = values.max(axis=0) / values.min(axis=0)
    lines = [
        f"| {name} | " + " | ".join(f"{a:g}" for a in A) + " |",
        "|---" * (len(A) + 1) + "|",
        *(f"| {key} | " + " | ".join(f"{v:.3g}" for v in row) + " |" for key, row in rows.items()),
        "| largest / least | " + " | ".join(f"{s:.3g}" for s in spread) + " |",
    ]
    return "\n".join(lines)


def main() -> None:
    for name, criterion in CRITERIA.items():
        print(f"\n{name}, over the phase of the section\n")
        print(table("φ_s", {f"{phase:.3g}": k2(criterion, section_phase=phase) for phase in PHASES}))
    for name, criterion_of in (("prescribed", with_given_speed), ("free below the share", with_free_speed)):
        print(f"\nimpacts, the dividing speed {name}\n")
        print(table("share", {f"{share:g}": k2(criterion_of(share)) for share in SHARES}))
    for disturbance, symbol in (("eps", "ε"), ("dtau", "Δτ")):
        print(f"\nimpacts, k₂({symbol}) over the record and the solution reached\n")
        print(table("", over_window(disturbance)))


if __name__ == "__main__":
    main()
