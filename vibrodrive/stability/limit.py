"""The limit k₂ of practically orbital stability (§1): the disturbance at which the orbital structure is lost.

A loss in ε has a narrow edge: kept below, lost above, and in between, looked at finely, sometimes in turn (A = 3.9,
B = 0.6: kept and lost alternate from 2.45e-3 to 2.54e-3). A loss in Δτ has none: structure is lost at isolated values
first and comes back, because a grid may happen to resolve all switches of this orbit, or to miss some. So a limit is
a band with two ends, the first loss and the last value kept.

Many searches run at the same time: each yields the disturbances it needs an answer for next, and the motions of all of
them are computed as one sweep (evaluate.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from vibrodrive.batch.sweep import check_threads
from vibrodrive.model import choices, kinds, names, size, slips
from vibrodrive.model.keywords import MethodLike, ScanLike, as_written
from vibrodrive.model.parameters import bad, check
from vibrodrive.model.plan import Plan, make_plan, refuse_idle
from vibrodrive.stability.criterion import IMPACTS, Criterion, parse_criterion
from vibrodrive.stability.evaluate import Evaluator, Motion, explain_loss
from vibrodrive.stability.limit_search import GRIDS, Band, BandSearch, check_disturbance, search_band
from vibrodrive.stability.structure import ReferenceOrbit, Structure

Disturbance: TypeAlias = Literal["eps", "dtau"]

AXES = ("A", "B", "eta")  # of limits
NO_PERIOD = "the undisturbed motion has no period: nothing to lose"
SEEN = 4  # times that a record must hold the period of the orbit: its first and last impacts are not judged
PERIODS = 1500  # recorded for a limit, unless given
AT_A_TIME = 256  # searches carried on at the same time: the batches stay long as more and more of them end
EXPLAINED_AT_A_TIME = 32  # limits whose motions on both sides are computed in one batch


@dataclass(frozen=True, repr=False)
class Found:
    """Arguments of a limit in ε or Δτ at one point."""

    A: float
    B: float
    eta: float
    disturbance: str
    method: str

    def as_velocity(self, value: float) -> float:
        """The amplitude of the velocity that a value of the disturbance adds to the motion, dimensionless.

        A disturbance ε sin ητ of the excitation is a velocity of amplitude εηA. A switch found late by Δτ is one of the
        order Δτ, as accelerations are of the order 1.
        """
        return value * (self.A * self.eta) if self.disturbance == "eps" else value


@dataclass(frozen=True, repr=False)
class Limit(Found):
    """The limit k₂ of one orbit (§1); a disturbance is a value of ε or Δτ, dimensionless.

    Attributes
    ----------
    A, disturbance, method, criterion
        the arguments.
    B, eta
        those of the motion.
    k2 : float
        the first loss: smallest disturbance found at which the criterion fails, bisected; an upper bound where
        `kept_below` is 0, as the smallest value tried was lost; inf if none was found up to `searched_to`, NaN if the
        undisturbed motion has no period (or, over many A, one longer than half the record).
    kept_below : float
        largest disturbance below k2 that was kept in the bisection; 0 if none was.
    last_kept : float
        largest value kept together with its lower neighbour on the grid (a single one kept among losses is chance);
        `kept_below` if nothing is kept above k2.
    share_kept : float
        share of the values tried between k2 and last_kept that are kept; 0 if there are none.
    searched_to : float
        largest disturbance that was tried.
    n : int
        period of the undisturbed orbit in excitation periods, 0 if it has none.
    kept, lost : Structure or None
        at kept_below and at k2.
    how : str
        how it was lost, in words.
    """

    criterion: str
    k2: float = math.nan
    kept_below: float = math.nan
    last_kept: float = math.nan
    share_kept: float = math.nan
    searched_to: float = math.nan
    n: int = 0
    kept: Structure | None = None
    lost: Structure | None = None
    how: str = ""

    def __repr__(self) -> str:
        found = f"k2 = {self.k2:.6g} in {self.disturbance} at A = {self.A:g}, B = {self.B:g}"
        how = f"{self.how}; kept up to {self.kept_below:.6g}" if math.isfinite(self.k2) else self.how
        return f"<Limit {found}: {how}; period {self.n}, {self.method}, criterion {self.criterion}>"

    @property
    def velocity(self) -> float:
        """k2 as a velocity amplitude, dimensionless as ξ', one unit for both disturbances: k2·η·A in ε, k2 in Δτ."""
        return self.as_velocity(self.k2)

    @property
    def velocity_last(self) -> float:
        """last_kept as a velocity amplitude."""
        return self.as_velocity(self.last_kept)

    @property
    def rho_kept(self) -> float:
        """Largest distance from the orbit at kept_below, of one disturbed motion; NaN if it is not known."""
        return self.kept.rho if self.kept is not None else math.nan

    @property
    def rho_lost(self) -> float:
        """Largest distance from the orbit at k2, of one disturbed motion; NaN if it is not known."""
        return self.lost.rho if self.lost is not None else math.nan


@as_written
def limit(
    written: Mapping[str, Any],
    /,
    A: float,
    disturbance: Disturbance = "eps",
    method: MethodLike | None = None,
    criterion: str = IMPACTS,
    *,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = names.ETA,
    dtau: float | None = None,
    tol: float | None = None,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    transient: int = 1000,
    periods: int = PERIODS,
    section_phase: float = 0.0,
    scan: ScanLike = "skip",
    budget: int = 100_000,
    threads: int | None = None,
) -> Limit:
    """Find the limit k₂ of practically orbital stability (§1) at one A.

    Parameters
    ----------
    A : float
        excitation amplitude, dimensionless as all that follows.
    disturbance : "eps" or "dtau"
        physical, eq. (9), or numerical (§5).
    method : "certified", "muller" or "fixed", optional
        how switches are found in the disturbed motion: "certified" by default for ε, "fixed" for Δτ, for which
        "certified" is refused. The undisturbed motion is always certified and has ε = 0.
    criterion : str, optional
        what must be kept: "impacts" (the main impacts follow each other as the orbit's), "word" (the states between
        them) or "rho < x" (x being k₃, the distance from the orbit as a curve), or some of them joined by "and".
    eps, dtau : float
        the one that is sought is left out. `dtau` is needed where ε is sought on a grid; `eps` disturbs the motion
        whose limit in Δτ is sought.
    B, eta, tol, xi0, dxi0, tau0, transient, periods, section_phase, scan, budget
        as in `simulate`, of each disturbed motion.
    threads : int, optional
        threads to use; all by default.

    Returns
    -------
    Limit
        with k2, kept_below, last_kept, share_kept, n, how, and the structures on both sides.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed; also if `periods` are fewer than four times
        the period of the undisturbed motion: too few to see whether its structure is kept.

    Warns
    -----
    UserWarning
        where a slip is likely: A <= 1 + B, so that nothing leaves the obstacle, ε above 0.1, or A above 100 and 100 B.

    Examples
    --------
    How large the disturbance ε may be at A = 1.5, over few periods:

    >>> import vibrodrive as vd
    >>> k = vd.limit(1.5, "eps", transient=50, periods=50)
    >>> k.n, k.kept_below < k.k2
    (1, True)
    >>> f"{k.k2:.3g}: {k.how}"
    '0.00388: gaps 1 became 1, 2'
    """
    plan = plan_at_one_point(written, disturbance, method, " (axes belong to `limits`)")
    search = _Search(plan, disturbance, parse_criterion(criterion), check_threads(threads))
    slips.warn_of_slip([slipping(plan)], depth=3)  # of the caller, two functions above
    with kinds.above("a line while it lasts")("limit"):
        ((_, found),) = search.run(strict=True)
    return found


def each_limit(
    arguments: Mapping[str, Any],
    disturbance: str = "eps",
    method: str | choices.Method | None = None,
    criterion: str | Criterion = IMPACTS,
    threads: int | None = None,
) -> Iterator[tuple[int, Limit]]:
    """Limits over axes of A, B and η, as they are found: (number of the point, Limit).

    `arguments` are those of `limit` for the motion. The points are those of the product of the axes, in the order in
    which the arguments are written, the last one running fastest. Where `periods` are too few to decide, the Limit
    says so in `how`, without a number. A Criterion may name what `parse_criterion` refuses.
    """
    plan = plan_over_axes(arguments, disturbance, method)
    return _Search(plan, disturbance, parse_criterion(criterion), check_threads(threads)).run()


def plan_at_one_point(written: Mapping[str, Any], disturbance: str, method: object, hint: str = "") -> Plan:
    """The plan of `limit` or `unique_limit`, from the arguments as written; `hint` ends the refusal of axes."""
    if isinstance(disturbance, str) and disturbance in GRIDS and written.get(disturbance) is not None:
        raise TypeError(bad(disturbance, written[disturbance], "left out, as it is what is sought"))
    if not hasattr(written["A"], "__len__"):
        check("A", written["A"])
    own = ("disturbance", "method", "criterion", "threads")
    arguments = {name: value for name, value in written.items() if name not in own}
    plan = plan_disturbed(arguments, disturbance, method, (), hint)
    refuse_idle(plan, written)
    return plan


def plan_over_axes(arguments: Mapping[str, Any], disturbance: object, method: object) -> Plan:
    """The plan of limits over axes."""
    return plan_disturbed(arguments, disturbance, method, AXES, f" (axes may be {', '.join(AXES)})")


def plan_disturbed(
    arguments: Mapping[str, Any], disturbance: object, method: object, axes: Sequence[str], hint: str
) -> Plan:
    """The checked plan of disturbed motions; its value of the disturbance is a placeholder."""
    name = check_disturbance(disturbance)
    if method is None:
        method = "fixed" if name == "dtau" else "certified"
    plan = make_plan({"periods": PERIODS, **arguments, "method": method, name: 1e-3})
    refuse_axes(plan, axes, hint)
    if name == "dtau" and plan.settings.method == choices.Method.CERTIFIED:
        raise ValueError(bad("method", "certified", "fixed or muller: the certified path has no Δτ to disturb it"))
    size.rows_that_fit(plan.settings.periods, 0)  # refuses what does not fit the memory
    return plan


def refuse_axes(plan: Plan, allowed: Sequence[str], hint: str = "") -> None:
    """Raise TypeError for an axis that is not among the allowed ones."""
    for name, values in plan.axes.items():
        if name not in allowed:
            raise TypeError(bad(name, f"array of {len(values)} values", f"a single number{hint}"))


def slipping(plan: Plan) -> tuple[float, float, float, float]:
    """A, B, ε and η of the one point of a plan."""
    A, B, eps, eta = (plan.scalars[name] for name in ("A", "B", "eps", "eta"))
    return A, B, eps, eta


@dataclass
class _Problem:
    """One search under way."""

    index: int  # of the point in the plan
    base: ReferenceOrbit
    search: BandSearch
    requested: np.ndarray  # the disturbances it needs an answer for


@dataclass(frozen=True)
class _Search:
    """The arguments of `each_limit`, checked."""

    plan: Plan
    disturbance: str
    wanted: Criterion
    threads: int

    def run(self, strict: bool = False) -> Iterator[tuple[int, Limit]]:
        """(number of the point, Limit) as they are found. strict: ValueError where the periods are too few."""
        plan = self.plan
        with Evaluator(plan, self.disturbance, self.threads) as evaluator:
            for start in range(0, plan.n_points, AT_A_TIME):
                active: list[_Problem] = []
                numbers = np.arange(start, min(start + AT_A_TIME, plan.n_points))
                for index, base in zip(numbers.tolist(), evaluator.undisturbed(numbers, self.wanted), strict=True):
                    if base is None:
                        how = NO_PERIOD
                    elif (periods := plan.settings.periods) < SEEN * base.n:
                        enough = f">= {SEEN * base.n}, {SEEN} times the period of the undisturbed motion"
                        how = bad("periods", periods, f"{enough} at A = {plan.arguments(index)['A']:g}")
                        if strict:
                            raise ValueError(how)
                    else:
                        search = search_band(GRIDS[self.disturbance])
                        active.append(_Problem(index, base, search, next(search)))
                        continue
                    yield index, self._limit(index, n=base.n if base is not None else 0, how=how)
                yield from self._searched(active, evaluator)

    def _searched(self, active: list[_Problem], evaluator: Evaluator) -> Iterator[tuple[int, Limit]]:
        """All these searches to their ends, at the same time."""
        ended: list[tuple[_Problem, Band]] = []
        while active:
            requests = [(p.index, p.base, p.requested) for p in active]
            answers = evaluator.answers(
                requests, lambda base, motion: motion.keeps(base, self.wanted), self.wanted.needs_switches
            )
            for problem, kept in zip(list(active), answers, strict=True):
                try:
                    problem.requested = problem.search.send(np.array(kept))
                except StopIteration as end:
                    active.remove(problem)
                    ended.append((problem, end.value))
            if len(ended) >= EXPLAINED_AT_A_TIME or not active:
                yield from self._explained(ended, evaluator)
                ended = []

    def _explained(self, ended: list[tuple[_Problem, Band]], evaluator: Evaluator) -> Iterator[tuple[int, Limit]]:
        """The Limits of finished searches, with the structures on both sides of the first loss."""

        def explain(base: ReferenceOrbit, motion: Motion) -> tuple[Structure, str]:
            found = motion.judge(base)
            return found, explain_loss(self.wanted, base, motion, found)

        # nothing is kept below some limits, and some are never reached: the motion at 0 stands for these
        values = [np.array([b.kept_below, b.lost if math.isfinite(b.lost) else 0.0]) for _, b in ended]
        requests = [(p.index, p.base, side) for (p, _), side in zip(ended, values, strict=True)]
        explained = evaluator.answers(requests, explain, self.wanted.needs_switches)
        for (problem, band), ((kept, _), (lost, how)) in zip(ended, explained, strict=True):
            if band.kept_below == 0.0:
                how = f"k2 is below the smallest value tried: {how}"
            sides: dict[str, Any] = {"kept": kept if band.kept_below > 0 else None, "lost": lost, "how": how}
            if not math.isfinite(band.lost):
                sides = {"how": f"not lost up to {band.searched_to:g}"}
            numbers = {"k2": band.lost, **band._asdict(), "n": problem.base.n}
            del numbers["lost"]
            yield problem.index, self._limit(problem.index, **numbers, **sides)

    def _limit(self, index: int, **found: Any) -> Limit:
        """The Limit at a point of the plan."""
        at = self.plan.arguments(index)
        method = choices.Method(self.plan.settings.method).name.lower()
        return Limit(at["A"], at["B"], at["eta"], self.disturbance, method, self.wanted.text, **found)
