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
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from vibrodrive.batch.sweep import check_threads
from vibrodrive.model.above import above
from vibrodrive.model.keywords import Axis, MethodLike, ScanLike, as_written
from vibrodrive.model.parameters import ETA, Method, bad, check
from vibrodrive.model.plan import Plan, make_plan, refuse_idle
from vibrodrive.model.size import rows_that_fit
from vibrodrive.model.slips import warn_of_slip
from vibrodrive.stability.criterion import SEVERAL, SOLUTION, Criterion, parse_criterion
from vibrodrive.stability.evaluate import Evaluator, Motion, explain_loss
from vibrodrive.stability.limit_search import GRIDS, Band, BandSearch, search_band
from vibrodrive.stability.starts import COORDINATES, nearest_other
from vibrodrive.stability.structure import ReferenceOrbit, Structure
from vibrodrive.stability.unique_motion import starts_that_reach_all, unique_from
from vibrodrive.stability.velocity import as_velocity

Disturbance: TypeAlias = Literal["eps", "dtau", "xi0", "dxi0", "tau0"]

AXES = ("A", "B", "eta")
"""What limits may be sought over."""

DISTURBANCES = "one of " + ", ".join((*GRIDS, *COORDINATES))

NO_PERIOD = "the undisturbed motion has no period: nothing to lose"

SEEN = 4
"""How often a record must hold the period of the orbit: its first and last impacts are not judged."""

PERIODS = 1500
"""Recorded for a limit, unless given."""

AT_A_TIME = 256
"""Searches carried on at the same time: the batches stay long as more and more of them end."""

TOLD_AT_A_TIME = 32
"""Limits found that are told together, in one batch of motions on both sides of each."""


@dataclass(frozen=True, repr=False)
class Limit:
    """The limit of one orbit; a disturbance is a value of ε or Δτ, or of ξ0, ξ'0 or τ0, all dimensionless.

    It is k₂ of the definition in §1. Where the start is disturbed it is k₁ (starts.py): `k2` is then how far the nearer
    edge is beyond which the undisturbed motion ends on another solution. With the criterion "several" it is k_u
    (unique_motion.py): the first value at which all starts end on one motion, and `last_kept` the last at which
    several remain.

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

    A: float
    B: float
    eta: float
    disturbance: str
    method: str
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
        name = "k1" if self.disturbance in COORDINATES else "ku" if self.criterion == SEVERAL else "k2"
        found = f"{name} = {self.k2:.6g} in {self.disturbance} at A = {self.A:g}, B = {self.B:g}"
        how = f"{self.how}; kept up to {self.kept_below:.6g}" if math.isfinite(self.k2) else self.how
        return f"<Limit {found}: {how}; period {self.n}, {self.method}, criterion {self.criterion}>"

    @property
    def velocity(self) -> float:
        """k2 as a velocity amplitude, dimensionless as ξ' (velocity.py), one unit for both disturbances; else NaN."""
        return float(as_velocity(self.disturbance, self.k2, self.A, self.eta))


@as_written
def limit(
    written: Mapping[str, Any],
    /,
    A: float,
    disturbance: Disturbance = "eps",
    method: MethodLike | None = None,
    criterion: str | None = None,
    *,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = ETA,
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
    disturbance : "eps", "dtau", "xi0", "dxi0" or "tau0"
        physical, eq. (9), numerical (§5), or an error of the start, for which the limit is k₁.
    method : "certified", "muller" or "fixed", optional
        how switches are found in the disturbed motion: "certified" by default for ε, "fixed" for Δτ, for which
        "certified" is refused. The undisturbed motion is always certified and has ε = 0.
    criterion : str, optional
        what must be kept, of "impacts" (the default), "gaps", "order", "word" (structure.py) and "rho < x" (x being k₃,
        the distance from the orbit as a curve: orbit_curve.py), joined by "and". "order" is that at one section, of
        phase `section_phase`; the others are properties of the motion. Or "several": more than one of the solutions
        that the start decides between. A start is judged by "solution" alone.
    eps, dtau : float
        the one that is sought is left out. `dtau` is needed where ε is sought on a grid; `eps` disturbs the motion
        whose limit in Δτ is sought. Where the start is disturbed, xi0, dxi0 and tau0 are what it is disturbed from.
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

    How far the start may be off in time before the motion at A = 3.04 ends a period earlier or later:

    >>> round(vd.limit(3.04, "tau0").k2, 6)
    0.818096
    """
    if isinstance(disturbance, str) and disturbance in GRIDS and written.get(disturbance) is not None:
        raise TypeError(bad(disturbance, written[disturbance], "left out, as it is what is sought"))
    if not hasattr(A, "__len__"):  # an array is referred to `limits` below
        check("A", A)
    search = _planned(disturbance, method, criterion, threads, _of_simulate(written), axes=())
    refuse_idle(search.plan, written)
    warn_of_slip([_slipping(search.plan)], depth=3)  # of the caller, two functions above
    with above("jobs.progress").under_way("limit"):
        ((_, found),) = search.run(strict=True)
    return found


@as_written
def each_limit(
    written: Mapping[str, Any],
    /,
    A: Axis,
    disturbance: str = "eps",
    method: str | Method | None = None,
    criterion: str | None = None,
    *,
    B: Axis = 0.1,
    eps: float = 0.0,
    eta: Axis = ETA,
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
) -> Iterator[tuple[int, Limit]]:
    """Limits over axes of A, B and η, as they are found: (number of the point, Limit). Arguments as in `limit`.

    The points are those of the product of the axes, in the order in which the keywords are written, the last one
    running fastest. Where `periods` are too few to decide, the Limit says so in `how`, without a number.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed; at once, before anything is computed.

    Examples
    --------
    >>> from vibrodrive.stability.limit import each_limit
    >>> found = dict(each_limit([1.5, 2.0], transient=50, periods=50))
    >>> [(found[i].A, found[i].n) for i in sorted(found)]
    [(1.5, 1), (2.0, 1)]
    """
    return _planned(disturbance, method, criterion, threads, _of_simulate(written), AXES).run()


def _slipping(plan: Plan) -> tuple[float, float, float, float]:
    """A, B, ε and η of the one point of a plan, as far as they were not sought."""
    A, B, eps, eta = (plan.scalars[name] for name in ("A", "B", "eps", "eta"))
    return A, B, eps, eta


def _of_simulate(written: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the arguments of `limit` that are meant for `simulate`."""
    own = ("disturbance", "method", "criterion", "threads")
    return {name: value for name, value in written.items() if name not in own}


def _planned(
    disturbance: str,
    method: str | Method | None,
    criterion: str | None,
    threads: int | None,
    arguments: Mapping[str, Any],
    axes: Sequence[str],
) -> _Search | _OneByOne:
    if not isinstance(disturbance, str):
        raise TypeError(bad("disturbance", disturbance, DISTURBANCES))
    if criterion is not None and not isinstance(criterion, str):
        raise TypeError(bad("criterion", criterion, "a text"))
    start = disturbance in COORDINATES
    if disturbance not in GRIDS and not start:
        raise ValueError(bad("disturbance", disturbance, DISTURBANCES))
    if start and criterion not in (None, SOLUTION):
        raise ValueError(bad("criterion", criterion, f'"{SOLUTION}" where {disturbance} is disturbed'))
    if method is None:
        method = "fixed" if disturbance == "dtau" else "certified"
    sought = {} if start else {disturbance: 1e-3}
    plan = make_plan({"periods": PERIODS, **arguments, "method": method, **sought})
    for name, values in plan.axes.items():
        if name not in axes:
            only = f" (axes may be {', '.join(axes)})" if axes else " (axes belong to `limits`)"
            raise TypeError(bad(name, f"array of {len(values)} values", f"a single number{only}"))
    if start and "eta" in plan.axes:
        allowed = f"a single number: with {disturbance} disturbed, ε = 0"
        raise TypeError(bad("eta", f"array of {len(plan.axes['eta'])} values", allowed))
    chosen = Method(plan.settings.method)
    if disturbance == "dtau" and chosen == Method.CERTIFIED:
        raise ValueError(bad("method", "certified", "fixed or muller: the certified path has no Δτ to disturb it"))
    if start and (chosen != Method.CERTIFIED or plan.scalars["eps"] != 0.0):
        name, value = ("eps", plan.scalars["eps"]) if chosen == Method.CERTIFIED else ("method", chosen.name.lower())
        raise ValueError(bad(name, value, f"left out: with {disturbance} disturbed nothing else is"))
    rows_that_fit(plan.settings.periods, 0)  # refuses what does not fit the memory
    count = check_threads(threads)
    if start or criterion == SEVERAL:
        return _OneByOne(plan, disturbance, chosen.name.lower(), criterion or SOLUTION, count)
    wanted = parse_criterion("impacts" if criterion is None else criterion)
    return _Search(plan, disturbance, chosen.name.lower(), wanted.text, count, wanted)


def _blank(search: _OneByOne | _Search, index: int) -> Limit:
    """A Limit that says which point it is of, and nothing else yet."""
    point = search.plan.arguments(index)
    return Limit(point["A"], point["B"], point["eta"], search.disturbance, search.method, search.criterion)


@dataclass(frozen=True)
class _OneByOne:
    """The checked arguments of limits that are sought point by point: of starts (k₁), and of uniqueness (k_u)."""

    plan: Plan
    disturbance: str
    method: str
    criterion: str
    threads: int

    def run(self, strict: bool = False) -> Iterator[tuple[int, Limit]]:
        """(number of the point, Limit), in order; `strict` asks for nothing here."""
        for index in range(self.plan.n_points):
            yield index, self._k_u(index) if self.criterion == SEVERAL else self._k1(index)

    def _k1(self, index: int) -> Limit:
        found = nearest_other(self.plan.arguments(index), self.disturbance, self.threads)
        blank = _blank(self, index)
        if found.n == 0:
            return replace(blank, how=NO_PERIOD)
        edges = {"below": found.below, "above": found.above}
        near = min(edges.values(), key=lambda edge: (edge.lost, -edge.searched_to))
        told = [f"{side} from {edge.lost:.6g} on" for side, edge in edges.items() if math.isfinite(edge.lost)]
        how = "another solution " + ", ".join(told) if told else f"the same solution up to {near.searched_to:.6g}"
        return replace(
            blank, k2=near.lost, kept_below=near.kept, last_kept=near.kept, share_kept=0.0,
            searched_to=max(edge.searched_to for edge in edges.values()), n=found.n, how=how,
        )  # fmt: skip

    def _k_u(self, index: int) -> Limit:
        arguments = self.plan.arguments(index)
        n, _, starts = starts_that_reach_all(arguments, self.threads)
        blank = replace(_blank(self, index), n=n)
        if n < 2:
            return replace(blank, k2=0.0 if n else math.nan, how="there is one solution only" if n else NO_PERIOD)
        band = unique_from(arguments, self.disturbance, starts, self.threads)
        how = (
            "all starts end on one motion" if math.isfinite(band.k2) else f"several motions up to {band.searched_to:g}"
        )
        return replace(blank, **band._asdict(), how=how)


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
    method: str
    criterion: str
    threads: int
    wanted: Criterion

    def run(self, strict: bool = False) -> Iterator[tuple[int, Limit]]:
        """(number of the point, Limit) as they are found. strict: ValueError where the periods are too few."""
        plan = self.plan
        evaluator = Evaluator(plan, self.disturbance, self.threads)
        with evaluator:
            for start in range(0, plan.n_points, AT_A_TIME):
                active: list[_Problem] = []
                numbers = np.arange(start, min(start + AT_A_TIME, plan.n_points))
                for index, base in zip(numbers.tolist(), evaluator.undisturbed(numbers, self.wanted), strict=True):
                    if base is None:
                        how = NO_PERIOD
                    elif (periods := plan.settings.periods) < SEEN * base.n:
                        enough = f">= {SEEN * base.n}, {SEEN} times the period of the undisturbed motion"
                        how = bad("periods", periods, f"{enough} at A = {_blank(self, index).A:g}")
                        if strict:
                            raise ValueError(how)
                    else:
                        search = search_band(GRIDS[self.disturbance])
                        active.append(_Problem(index, base, search, next(search)))
                        continue
                    yield index, replace(_blank(self, index), n=base.n if base is not None else 0, how=how)
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
            if len(ended) >= TOLD_AT_A_TIME or not active:
                yield from self._explained(ended, evaluator)
                ended = []

    def _explained(self, ended: list[tuple[_Problem, Band]], evaluator: Evaluator) -> Iterator[tuple[int, Limit]]:
        """The Limits of finished searches, with the structures on both sides of the first loss."""

        def explain(base: ReferenceOrbit, motion: Motion) -> tuple[Structure, str]:
            found = motion.judge(base)
            return found, explain_loss(self.wanted, base, motion, found)

        # nothing is kept below some limits, and some are never reached: the motion at 0 stands for these
        sides = [np.array([b.kept_below, b.k2 if math.isfinite(b.k2) else 0.0]) for _, b in ended]
        requests = [(p.index, p.base, side) for (p, _), side in zip(ended, sides, strict=True)]
        explained = evaluator.answers(requests, explain, self.wanted.needs_switches)
        for (problem, band), ((kept, _), (lost, how)) in zip(ended, explained, strict=True):
            found = replace(_blank(self, problem.index), **band._asdict(), n=problem.base.n)
            if band.kept_below == 0.0:
                how = f"k2 is below the smallest value tried: {how}"
            if not math.isfinite(band.k2):
                found = replace(found, how=f"not lost up to {band.searched_to:g}")
            else:
                found = replace(found, kept=kept if band.kept_below > 0 else None, lost=lost, how=how)
            yield problem.index, found
