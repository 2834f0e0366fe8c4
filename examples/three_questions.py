"""Answer three open questions of the paper with the impact-phase map: the tables of docs/orbits.md.

(a) `chaos`: is there chaos between two values of A, or only windows of superstable and stable orbits?

(b) `what_sets_limit`: which property correlates with the limit k₂ of practical orbital stability: the multiplier, or
the distance to the nearest unstable orbit, grazing or border collision?

(c) `kinds_of`: which of the bifurcations that a diagram shows are period doublings, folds, border collisions, grazings?

    python -m examples.three_questions               # (a) and (c): some ten seconds; in the root of a clone
    python -m examples.three_questions limits.h5 limits_fixed.h5   # and (b), from the files of configs/limits.toml
    python -m examples.three_questions --num 40001   # (a) on a finer grid of A
"""

import argparse
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import vibrodrive as vd
from vibrodrive.model.parameters import bad
from vibrodrive.periodic.bifurcations import Bifurcation, bifurcations
from vibrodrive.periodic.continuation import BORDER_COLLISION, STICK
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import STABLE, SUPERSTABLE, UNSTABLE, orbits


@dataclass(frozen=True, eq=False)
class Chaos:
    """Answer to (a): the final motion from rest on a grid of A.

    A, exponent : the grid, and the Lyapunov exponent per period at each value of A. The exponent is -inf if the mass
        rests again, because the state after a rest does not depend on the earlier motion.
    """

    A: np.ndarray
    exponent: np.ndarray

    @property
    def shares(self) -> dict[str, float]:
        """Shares of the values of A: "superstable" if the mass rests, "irregular" if neighbouring motions diverge, else
        "stable"."""
        rests, stable = np.isneginf(self.exponent), self.exponent < 0.0
        kinds = {"superstable": rests, "stable": stable & ~rests, "irregular": ~stable}
        return {kind: float(where.mean()) for kind, where in kinds.items()}


def chaos(low: float = 3.15, high: float = 3.19, num: int = 4001, B: float = 0.1, transient: int = 5000) -> Chaos:
    """Answer question (a) on `num` values of A from low to high, over 500 periods after the transient."""
    A = np.linspace(low, high, num)
    found = vd.sweep(A=A, B=B, record="summary", transient=transient, periods=500)
    return Chaos(A, np.asarray(found.lyapunov))


MEASURES = ("multiplier", "unstable", "border", "grazing", "nearest")


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Distances in phase from the most stable orbit to the nearest unstable orbit and bifurcations, at each of A (n,).

    NaN means that there is no stable orbit, or nothing to which this distance could be measured.

    period : period of the most stable orbit, int64; 0 if no orbit up to the longest period of the search is stable.
    multiplier : modulus of its multiplier.
    unstable : distance in phase from one of its impacts to the nearest impact of an unstable orbit.
    border : distance from one of its impacts to the nearest end of the window, the phases with H > 1.
    grazing : distance from one of its launches (the mass leaves the obstacle) to the nearest grazing.
    nearest : the smallest of `unstable`, `border` and `grazing` that are not NaN.
    """

    A: np.ndarray
    period: np.ndarray
    multiplier: np.ndarray
    unstable: np.ndarray
    border: np.ndarray
    grazing: np.ndarray

    @property
    def nearest(self) -> np.ndarray:
        return np.fmin(np.fmin(self.unstable, self.border), self.grazing)


def surroundings(A: Iterable[float], B: float = 0.1, max_period: int = 6) -> Surroundings:
    """Return the surroundings of the most stable orbit, the one with the smallest |multiplier|, at each of A."""
    values = np.array(list(A), dtype=np.float64)
    rows = np.array([_around(a, B, max_period) for a in values.tolist()]).reshape(-1, 5)
    return Surroundings(values, rows[:, 0].astype(np.int64), *rows[:, 1:].T)


def _around(A: float, B: float, max_period: int) -> tuple[float, float, float, float, float]:
    found = orbits(A, B, max_period)
    stable = [o for o in found if o.kind in (STABLE, SUPERSTABLE)]
    if not stable:
        return 0, math.nan, math.nan, math.nan, math.nan
    orbit = min(stable, key=lambda o: (abs(o.multiplier), o.period))
    unstable = [p for o in found if o.kind == UNSTABLE for p in o.phases]
    system = ImpactMap(A, B)
    up, end = system.window
    grazing = [p for p, kind in zip(system.breakpoints, system.kinds, strict=True) if kind == "grazing"]
    launches = np.where((orbit.phases > up) & (orbit.phases < end), orbit.phases, up)
    return (
        orbit.period,
        abs(orbit.multiplier),
        distance(orbit.phases, unstable),
        distance(orbit.phases, [up, end]),
        distance(launches, grazing),
    )


def distance(some: Sequence[float] | np.ndarray, others: Sequence[float] | np.ndarray) -> float:
    """Return the smallest distance on the circle between two sets of phases; NaN if one is empty."""
    if not len(some) or not len(others):
        return math.nan
    apart = np.abs(np.subtract.outer(some, others))
    return float(np.minimum(apart, 2.0 * math.pi - apart).min())


def what_sets_limit(
    A: Sequence[float] | np.ndarray, k2: Sequence[float] | np.ndarray, B: float = 0.1, max_period: int = 6
) -> dict[str, tuple[float, int]]:
    """Answer question (b): return for the period and each of MEASURES its rank correlation with k₂, and the number of
    values of A used.

    `k2` contains the limit at each of A. NaN and infinite values are ignored; they mean that no limit was found.

    Raises
    ------
    ValueError
        if the lengths differ.
    """
    limits = np.asarray(k2, dtype=np.float64)
    if limits.shape != np.shape(A):
        raise ValueError(bad("k2", f"array of shape {limits.shape}", f"of the shape of A, {np.shape(A)}"))
    around = surroundings(A, B, max_period)
    known = np.isfinite(limits) & (around.period > 0)
    answer = {}
    for name in ("period", *MEASURES):
        values = getattr(around, name).astype(np.float64)
        use = known & np.isfinite(values)
        answer[name] = (rank_correlation(values[use], limits[use]), int(use.sum()))
    return answer


def rank_correlation(x: np.ndarray, y: np.ndarray) -> float:
    """Return Spearman's rank correlation. Equal values have equal ranks. The result is NaN if one array is constant."""
    if len(x) < 2:
        return math.nan
    a, b = (_ranks(v) - 0.5 * (len(v) - 1) for v in (x, y))
    scale = math.sqrt(float(a @ a) * float(b @ b))
    return float(a @ b) / scale if scale > 0.0 else math.nan


def _ranks(values: np.ndarray) -> np.ndarray:
    ordered = np.sort(values)
    return 0.5 * (np.searchsorted(ordered, values, "left") + np.searchsorted(ordered, values, "right") - 1)


def kinds_of(seen: Iterable[float], found: Sequence[Bifurcation]) -> dict[float, Bifurcation]:
    """Answer question (c): for every A at which a diagram changes, return the closest bifurcation that a diagram shows.

    A diagram shows no unstable orbit, and no bifurcation at which a stable orbit only begins to rest or to stick.
    """
    visible = [b for b in found if _shows(b)]
    if not visible:
        return {}
    values = np.array([b.A for b in visible])
    return {a: visible[int(np.argmin(np.abs(values - a)))] for a in seen}


def _shows(b: Bifurcation) -> bool:
    sides = np.abs([b.multiplier_below, b.multiplier_above])
    goes_on = b.kind in (BORDER_COLLISION, STICK) and not np.isnan(sides).any()
    return bool(np.nanmin(sides) < 1.0) and not goes_on


SEEN = (1.1, 2.604, 2.69, 3.057, 3.154, 3.19, 3.203)
"""Values of A at which the bifurcation diagram of Fig. 3 changes, read from the diagram that `vibrodrive sweep
configs/fig03.toml --plot` draws, with 1300 values of A."""


def chaos_table(num: int) -> Iterator[str]:
    """Return the table of question (a) as lines of Markdown."""
    answer = chaos(num=num)
    yield "| values of A | spacing | " + " | ".join(answer.shares) + " | largest exponent |"
    yield "|---" * (3 + len(answer.shares)) + "|"
    shares = " | ".join(f"{100 * share:.4g} %" for share in answer.shares.values())
    largest = answer.exponent[np.isfinite(answer.exponent)].max(initial=-math.inf)
    yield f"| {num} | {answer.A[1] - answer.A[0]:.1g} | {shares} | {largest:.2g} |"


def limit_table(files: Iterable[Path]) -> Iterator[str]:
    """Return the table of question (b) as lines of Markdown, for each file of a sweep of limits over A."""
    yield "| k₂ in, switches | " + " | ".join(("period", *MEASURES)) + " |"
    yield "|---" * (2 + len(MEASURES)) + "|"
    for found in map(vd.load, files):
        answer = what_sets_limit(found.axes["A"], found.k2, found.scalars["B"])
        cells = (f"{correlation:.2f} ({count})" for correlation, count in answer.values())
        yield f"| {found.plan.sought}, {found.settings.method_name} | " + " | ".join(cells) + " |"


def bifurcation_table(max_period: int = 6) -> Iterator[str]:
    """Return the table of question (c) as lines of Markdown."""
    yield "| seen at A ≈ | exactly | kind | period |"
    yield "|---|---|---|---|"
    for a, b in kinds_of(SEEN, bifurcations(max_period=max_period)).items():
        yield f"| {a:g} | {b.A:.14f} | {b.kind} | {b.orbit.period} |"


def main() -> None:
    parser = argparse.ArgumentParser(description="Print the tables of docs/orbits.md.")
    parser.add_argument("limits", nargs="*", type=Path, help="files of sweeps with the record limit over A")
    parser.add_argument("--num", type=int, default=4001, help="number of values of A in the search for chaos")
    arguments = parser.parse_args()
    print(*chaos_table(arguments.num), "", sep="\n")
    if arguments.limits:
        print(*limit_table(arguments.limits), "", sep="\n")
    print(*bifurcation_table(), sep="\n")


if __name__ == "__main__":
    main()
