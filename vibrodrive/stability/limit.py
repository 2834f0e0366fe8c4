"""The limit k₂ of practically orbital stability (§1): the disturbance at which the orbital structure is lost.

A loss in ε has a narrow edge: kept below, lost above, and in between, looked at finely, sometimes in turn (A = 3.9,
B = 0.6: kept and lost alternate from 2.45e-3 to 2.54e-3). A loss in Δτ has none: structure is lost at isolated values
first and comes back, because a grid may happen to resolve all switches of this orbit, or to miss some. So a limit is
a band with two ends, the first loss and the last value kept.

Many searches run at the same time: each yields the disturbances it needs an answer for next, and the motions of all of
them are simulated on all cores (the kernels release Python's lock).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from vibrodrive.batch.sweep import check_threads
from vibrodrive.batch.trajectory import Trajectory, follow, simulate
from vibrodrive.jit.slices import Halt
from vibrodrive.model.keywords import MethodLike, ScanLike, as_written
from vibrodrive.model.parameters import COLUMNS, ETA, Method, bad, check, check_count
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.stability.limit_search import GRIDS, Band, BandSearch, search_band
from vibrodrive.stability.structure import ReferenceOrbit, Structure, compare_structure, gaps, keeps, reference_orbit

Disturbance: TypeAlias = Literal["eps", "dtau"]

CRITERIA = ("order", "gaps", "word")

SETTLING = 20_000
"""Transient periods of the undisturbed motion, at least: near a bifurcation it settles slowly, and it is cheap."""

WATCHED = 256
"""Periods of the undisturbed motion: enough to see the longest period (structure.LONGEST_PERIOD) four times."""

AT_A_TIME = 32
"""Searches carried on at the same time."""


@dataclass(frozen=True)
class Limit:
    """The limit of one orbit; a disturbance is a value of ε or of Δτ, both dimensionless.

    Attributes
    ----------
    A, disturbance, method, criterion
        the arguments.
    k2 : float
        the first loss: smallest disturbance found at which the criterion fails, bisected; inf if none was found up to
        `searched_to`, NaN if the undisturbed motion has no period (or, over many A, one longer than half the record).
    kept_below : float
        largest disturbance below k2 that was kept in the bisection.
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


@as_written
def limit(
    written: Mapping[str, Any],
    /,
    A: float,
    disturbance: Disturbance = "eps",
    method: MethodLike | None = None,
    criterion: str = "order and gaps",
    *,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = ETA,
    dtau: float | None = None,
    tol: float | None = 1e-7,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    transient: int = 1000,
    periods: int = 1500,
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
    criterion : str
        what must be kept, of "order", "gaps" and "word" (see structure.py), joined by "and".
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
        with one sentence naming the key, the value and what is allowed; also if `periods` are fewer than twice the
        period of the undisturbed motion: too few to see whether its structure is kept.

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
    if isinstance(disturbance, str) and written.get(disturbance) is not None:
        raise TypeError(bad(disturbance, written[disturbance], "left out, as it is what is sought"))
    search = _planned([check("A", A)], disturbance, method, criterion, threads, _of_simulate(written))
    ((_, found),) = search.run(strict=True)
    return found


@as_written
def limits(
    written: Mapping[str, Any],
    /,
    A: Sequence[float] | np.ndarray,
    disturbance: str = "eps",
    method: str | Method | None = None,
    criterion: str = "order and gaps",
    *,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = ETA,
    dtau: float | None = None,
    tol: float | None = 1e-7,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    transient: int = 1000,
    periods: int = 1500,
    section_phase: float = 0.0,
    scan: ScanLike = "skip",
    budget: int = 100_000,
    threads: int | None = None,
) -> Iterator[tuple[int, Limit]]:
    """Limits at many A, as they are found: (index into A, Limit). Arguments as in `limit`.

    Where `periods` are too few to decide, the Limit says so in `how`, without a number.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed; at once, before anything is computed.

    Examples
    --------
    >>> from vibrodrive.stability.limit import limits
    >>> found = dict(limits([1.5, 2.0], transient=50, periods=50))
    >>> [(found[i].A, found[i].n) for i in sorted(found)]
    [(1.5, 1), (2.0, 1)]
    """
    return _planned(list(A), disturbance, method, criterion, threads, _of_simulate(written)).run()


def _of_simulate(written: Mapping[str, Any]) -> dict[str, Any]:
    """Those of the arguments of `limit` that are meant for `simulate`."""
    own = ("A", "disturbance", "method", "criterion", "threads")
    return {name: value for name, value in written.items() if name not in own}


def _planned(
    A: list[float],
    disturbance: str,
    method: str | Method | None,
    criterion: str,
    threads: int | None,
    arguments: Mapping[str, Any],
) -> _Search:
    wanted = _criterion(criterion)
    if not isinstance(disturbance, str):
        raise TypeError(bad("disturbance", disturbance, "one of " + ", ".join(GRIDS)))
    if disturbance not in GRIDS:
        raise ValueError(bad("disturbance", disturbance, "one of " + ", ".join(GRIDS)))
    if method is None:
        method = "certified" if disturbance == "eps" else "fixed"
    plan = make_plan({"periods": 1500, **arguments, "A": A, "method": method, disturbance: 1e-3})
    for name, values in plan.axes.items():
        if name != "A":
            raise TypeError(bad(name, f"array of {len(values)} values", "a single number: only A may be an axis"))
    check_count("periods", plan.settings.periods, 2)
    chosen = Method(plan.settings.method)
    if disturbance == "dtau" and chosen == Method.CERTIFIED:
        raise ValueError(bad("method", "certified", "fixed or muller: the certified path has no Δτ to disturb it"))
    return _Search(plan, disturbance, chosen.name.lower(), criterion, wanted, check_threads(threads))


def _criterion(text: str) -> tuple[str, ...]:
    if not isinstance(text, str):
        raise TypeError(bad("criterion", text, "a text"))
    names = tuple(part.strip() for part in text.split(" and "))
    for name in names:
        if name not in CRITERIA:
            raise ValueError(bad("criterion", text, " and ".join(CRITERIA) + ", or some of them"))
    return names


@dataclass
class _Problem:
    """One search under way."""

    index: int
    point: dict[str, Any]  # arguments of `simulate`
    base: ReferenceOrbit
    search: BandSearch
    requested: np.ndarray  # the disturbances it needs an answer for


@dataclass(frozen=True)
class _Search:
    """The arguments of `limits`, checked."""

    plan: Plan
    disturbance: str
    method: str
    criterion: str
    wanted: tuple[str, ...]
    threads: int

    def run(self, strict: bool = False) -> Iterator[tuple[int, Limit]]:
        """(index, Limit) as they are found. strict: ValueError where the periods are too few to decide."""
        plan = self.plan
        evaluator = _Evaluator(plan, self.disturbance, self.wanted, self.threads)
        blank = Limit(math.nan, self.disturbance, self.method, self.criterion)
        waiting = list(range(plan.n_points))[::-1]
        active: list[_Problem] = []
        while waiting or active:
            while waiting and len(active) < AT_A_TIME:
                index = waiting.pop()
                point = plan.arguments(index)
                here = replace(blank, A=point["A"])
                base = evaluator.undisturbed(point)
                if base is None:
                    yield index, replace(here, how="the undisturbed motion has no period: nothing to lose")
                    continue
                if (periods := plan.settings.periods) < 2 * base.n:
                    twice = f">= {2 * base.n}, twice the period of the undisturbed motion at A = {here.A:g}"
                    if strict:
                        raise ValueError(bad("periods", periods, twice))
                    yield index, replace(here, n=base.n, how=bad("periods", periods, twice))
                    continue
                search = search_band(GRIDS[self.disturbance])
                active.append(_Problem(index, point, base, search, next(search)))
            if not active:
                return
            kept_flags = evaluator([(p.point, p.base, p.requested) for p in active])
            for problem, kept in zip(list(active), kept_flags, strict=True):
                try:
                    problem.requested = problem.search.send(kept)
                except StopIteration as end:
                    active.remove(problem)
                    yield problem.index, evaluator.explain(problem, end.value, blank)


class _Evaluator:
    """Decides for disturbed motions whether the structure is kept."""

    def __init__(self, plan: Plan, disturbance: str, wanted: tuple[str, ...], threads: int) -> None:
        self.settings = plan.settings
        self.column = COLUMNS.index(disturbance)
        self.disturbance = disturbance
        self.wanted = wanted
        self.threads = threads
        self.halt = Halt()

    def undisturbed(self, point: dict[str, Any]) -> ReferenceOrbit | None:
        exact = {"method": "certified", "eps": 0.0, "dtau": None}
        periods = {"transient": max(SETTLING, self.settings.transient), "periods": WATCHED}
        return reference_orbit(simulate(**(point | exact | periods)))

    def __call__(self, requests: list[tuple[dict[str, Any], ReferenceOrbit, np.ndarray]]) -> list[np.ndarray]:
        """For each (point, orbit, disturbances), a bool array: whether each disturbance keeps the structure."""

        def kept(task: tuple[dict[str, Any], ReferenceOrbit, float]) -> bool:
            point, base, value = task
            return keeps(base, self._trajectory(point, value), self.wanted)

        tasks = [(point, base, value) for point, base, values in requests for value in values.tolist()]
        with ThreadPoolExecutor(self.threads) as pool:
            try:
                flags = np.array(list(pool.map(kept, tasks)), dtype=bool)
            except BaseException:
                self.halt.call()
                raise
        return np.split(flags, np.cumsum([len(values) for _, _, values in requests])[:-1])

    def explain(self, problem: _Problem, band: Band, blank: Limit) -> Limit:
        """The Limit of a finished search, with the structure on both sides of the first loss."""
        found = replace(blank, A=problem.point["A"], **band._asdict(), n=problem.base.n)
        if not math.isfinite(band.k2):
            return replace(found, how=f"not lost up to {band.searched_to:g}")
        lost = self._trajectory(problem.point, band.k2)
        kept = self._trajectory(problem.point, band.kept_below) if band.kept_below > 0 else None
        structure = compare_structure(problem.base, lost)
        return replace(
            found,
            kept=compare_structure(problem.base, kept) if kept is not None else None,
            lost=structure,
            how=_how(self.wanted, structure, lost, problem.base),
        )

    def _trajectory(self, point: dict[str, Any], value: float) -> Trajectory:
        disturbed = point | {self.disturbance: float(value)}
        if self.settings.method == Method.CERTIFIED:
            disturbed["dtau"] = None
        return follow(make_plan(disturbed), self.halt)


def _how(wanted: tuple[str, ...], lost: Structure, motion: Trajectory, base: ReferenceOrbit) -> str:
    reasons = []
    if "order" in wanted and not lost.order:
        nearest = np.linalg.norm(motion.section[:, None, :] - base.points, axis=-1).argmin(axis=1)
        broken = np.flatnonzero(np.diff(nearest) % base.n != 1 % base.n)
        where = f"in recorded period {broken[0] + 2}, {len(broken)} times" if len(broken) else "not computed"
        reasons.append(f"order broken {where}")
    if "gaps" in wanted and not lost.gaps:
        seen = sorted(set(gaps(motion.switches, base.speed).tolist()))
        reasons.append(f"gaps {_listed(base.gaps)} became {_listed(seen)}")
    if "word" in wanted and not lost.word:
        reasons.append("other states between impacts")
    return "; ".join(reasons)


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers)) or "none"
