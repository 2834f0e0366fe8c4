"""`vd.limit`, and the search for limits k₂ (§1): the disturbances at which the structure of an orbit is lost.

structure.py defines the structure. A value of the disturbance is *kept* if the motion under this disturbance still has
the main impacts of the undisturbed orbit, in their gaps and order, and *lost* if the motion does not.

In ε the loss has a narrow edge: the structure is kept below the edge and lost above it. Within the edge, on a fine
scale, kept and lost values sometimes alternate (at A = 3.9, B = 0.6 from ε = 2.45e-3 to 2.54e-3). In Δτ the loss has no
such edge. The structure is first lost at isolated values of Δτ and is kept again above them, because a grid may by
chance resolve all switches of an orbit or miss some of them. So a limit is a curve: the share of values kept, from the
first value lost to the value above which less than a half is kept. Single values are kept far above.

Many searches run at the same time. Each search yields the disturbances that it needs next, and one sweep computes the
motions of all searches (evaluate.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any, Literal, TypeAlias, Unpack

import numpy as np

from vibrodrive.batch.sweep import check_threads
from vibrodrive.jit.slices import Halt
from vibrodrive.model.above import above
from vibrodrive.model.choices import Method, MethodLike, Status
from vibrodrive.model.keywords import Point, takes
from vibrodrive.model.parameters import bad, real_number
from vibrodrive.model.physical import Scene, scene_of
from vibrodrive.model.plan import Plan, make_plan, refuse_axes
from vibrodrive.model.reasons import How
from vibrodrive.model.records import LIMIT
from vibrodrive.model.size import fitting_rows
from vibrodrive.model.slips import names_scene, unlikely, warn
from vibrodrive.stability.always import Always, find_always
from vibrodrive.stability.evaluate import Evaluator, Motion, explain_loss
from vibrodrive.stability.impulses import Tolerated, find_tolerated, velocity_beside
from vibrodrive.stability.limit_search import GRIDS, Band, BandSearch, search_band
from vibrodrive.stability.main_impacts import LEAST_BEGINNINGS, ImpactCycle, never_follows
from vibrodrive.stability.structure import ReferenceOrbit, Structure, compare_structure

Disturbance: TypeAlias = Literal["eps", "dtau"]

NO_PERIOD = "the undisturbed motion has no period, so there is no structure to lose"
SEEN = 4
"""Shortest record, in periods of the orbit (n excitation periods each). More than one period is needed, because the
comparison omits the first and the last impact of a record."""

AT_A_TIME = 128
"""Number of simultaneous searches. When half of them have ended, others begin, so that each sweep has many motions."""

TOGETHER = 16
"""Least number of motions in a sweep: two registers of lanes. Few searches ask for more values each, in advance."""

BRIEF_PERIODS = 160
"""Length of a brief record in periods. It proves nine of ten losses, in half the time of a record of 1500 periods after
a transient of 1000. It serves for values above the first loss, whose motions appear in no result, if these are so many
that one more sweep leaves few lanes empty, and if it saves at least half of the time."""

GLANCES = np.array([GRIDS["eps"].value(k) for k in range(0, 64, 8)])
"""Values of ε, from 1e-6 to 2.5e-3, whose brief records tell where a search for `k2` begins: at BELOW_GLANCE times the
largest one below which all are kept. So half of the values up to the first loss are not tried. No value of the grid
below the beginning was lost: at the 205 values of configs/limits.toml, and at 300 random A, B and η."""

BELOW_GLANCE = 0.5
BRIEF_TRANSIENT = 64  # largest transient of these records in periods; at most the transient of the motion


@dataclass(frozen=True, repr=False)
class Limit:
    """The limit k₂ of one orbit (§1).

    A disturbance is a dimensionless value of ε or Δτ. It is *kept* if the motion under it keeps the structure, and
    *lost* if the motion does not.

    Attributes
    ----------
    A, disturbance, method
        arguments of the search.
    B, eta
        parameters of the motion.
    k2 : float
        smallest disturbance found that is lost, refined by bisection. If `kept_below` is 0, even the smallest value
        tried was lost, so `k2` is only an upper bound. It is inf if no value up to `searched_to` is lost. It is NaN if
        the undisturbed motion has no period or, over axes, if the record is too short.
    kept_below : float
        largest disturbance below `k2` that the bisection found to be kept; 0 if there is none.
    half_kept : float
        largest disturbance tried that is kept and at which the share kept is at least a half. The share at a value is
        that of this value and the five next values tried on each side. Above `half_kept` the share stays below a half
        up to `searched_to`, but single values may be kept. At least `kept_below`.
    kept_at : dict
        the curve: for each value of the grid that was tried, in ascending order, True if it is kept.
    last_kept : float
        the largest value on the grid of disturbances that is kept and whose lower neighbour on this grid is kept, too.
        Single values above it may be kept. If no such value is above `k2`, `last_kept` equals `kept_below`.
    share_kept : float
        share of the grid values between `k2` and `last_kept` that are kept, 0 to 1; 0 if there are no such values.
    searched_to : float
        largest disturbance that was tried.
    n : int
        period of the undisturbed orbit in excitation periods, 0 if it has none.
    kept, lost : Structure or None
        comparisons of the motions at `kept_below` and at `k2` with the undisturbed orbit.
    how : str
        description of the loss, or the reason why there is no `k2`.
    code : int
        the loss as a `How` (model/records.py), -1 without a search.
    status : Status
        OK, or the reason why there is no `k2`: NO_ORBIT, TOO_SHORT, BUDGET.
    always : Always or None
        limit for all times, starts and phases of the disturbance, proved (always.py), with the intervals of starts;
        None for another disturbance than ε, another method than certified, or without a periodic orbit. It is computed
        when it is first asked for, which takes 1 to 45 s at η = 101, and up to three minutes for large η.
    k2_always : float
        an ε up to which the structure is proved to be kept for all times, for all starts in these intervals, and for
        all phases of the disturbance; NaN without a proof, with the reason in `always.how`. It is a lower bound of the
        limit over any number of periods, and `k2` an upper one.
    starts_width : float
        least width of the intervals of starts, as a phase in radians; NaN without a proof.
    scene : Scene or None
        machine in SI units, if it was given.
    find_always : function or None
        computes `always`.
    cycle : ImpactCycle or None
        main impacts of the undisturbed orbit.
    tolerated : Tolerated
        what *every* disturbance may be (impulses.py), computed when it is first asked for. The main impacts follow each
        other as in the orbit for ever, whatever the disturbance, if its impulse over any span of time stays below
        `velocity_any`, or if it is a force below `force_any`. Both are NaN where nothing is proved; `any_how` says what
        is not proved beyond `velocity_any`, or at all.
    tolerated_gaps : Tolerated
        the same for the gaps alone, where main impacts may change places, such as two that are nearly alike.
    """

    A: float
    B: float
    eta: float
    disturbance: str
    method: str
    k2: float = math.nan
    kept_below: float = math.nan
    last_kept: float = math.nan
    share_kept: float = math.nan
    searched_to: float = math.nan
    half_kept: float = math.nan
    kept_at: dict[float, bool] = field(default_factory=dict)
    n: int = 0
    kept: Structure | None = None
    lost: Structure | None = None
    how: str = ""
    code: int = -1
    status: Status = Status.OK
    scene: Scene | None = None
    find_always: Callable[[], Always] | None = field(default=None, repr=False, compare=False)
    cycle: ImpactCycle | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        si = f" ({1e3 * self.velocity_si:.4g} mm/s)" if self.scene is not None else ""
        limit = f"k2 = {self.k2:.6g}{si} in {self.disturbance} at A = {self.A:g}, B = {self.B:g}"
        how = f"{self.how}; kept up to {self.kept_below:.6g}" if math.isfinite(self.k2) else self.how
        return f"<Limit {limit}: {how}; period {self.n}, {self.method}>"

    def as_velocity(self, value: float) -> float:
        """Return the dimensionless amplitude of the velocity that a value of the disturbance adds to the motion.

        The velocity of the disturbance ξ_p = -ε A sin ητ, eq. (9), has the amplitude εηA. A switch that is late by Δτ
        changes the velocity by about Δτ, because accelerations are of the order 1.
        """
        return value * (self.A * self.eta) if self.disturbance == "eps" else value

    @cached_property
    def always(self) -> Always | None:
        return None if self.find_always is None else self.find_always()

    @property
    def k2_always(self) -> float:
        return math.nan if self.always is None else self.always.k2

    @property
    def starts_width(self) -> float:
        return math.nan if self.always is None else self.always.starts_width

    @cached_property
    def tolerated(self) -> Tolerated:
        return find_tolerated(self.A, self.B, self.cycle)

    @cached_property
    def tolerated_gaps(self) -> Tolerated:
        return find_tolerated(self.A, self.B, self.cycle, ordered=False)

    @property
    def velocity_any(self) -> float:
        return self.tolerated.velocity

    @property
    def force_any(self) -> float:
        return self.tolerated.force

    @property
    def any_how(self) -> str:
        return self.tolerated.beyond.meaning if self.n else self.how

    @property
    def velocity_any_si(self) -> float:
        """`velocity_any` in m/s; NaN without a scene. A mass m takes a blow of m times this impulse."""
        return math.nan if self.scene is None else float(self.scene.velocity(self.velocity_any))

    @property
    def force_any_si(self) -> float:
        """`force_any` in N, without a mass in N/kg; NaN without a scene."""
        return math.nan if self.scene is None else float(self.scene.force(self.force_any))

    def velocity_any_at(self, force: float) -> float:
        """Return `velocity_any` for disturbances to which any force of at most `force` is added; NaN if none is proved.

        `force` is dimensionless, from 0 to `force_any`; near `force_any`, or well below it, no V > 0 may be proved.
        """
        number = real_number("force", force, "a number >= 0")
        return math.nan if self.cycle is None else velocity_beside(self.A, self.B, self.cycle, number)

    @property
    def velocity(self) -> float:
        """`k2` as a velocity amplitude, dimensionless like ξ': k2·η·A for ε, and k2 for Δτ.

        In this unit limits in ε and in Δτ can be compared.
        """
        return self.as_velocity(self.k2)

    @property
    def velocity_si(self) -> float:
        """`velocity` in m/s; NaN without a scene."""
        return math.nan if self.scene is None else float(self.scene.velocity(self.velocity))

    @property
    def velocity_last(self) -> float:
        """`last_kept` as a velocity amplitude."""
        return self.as_velocity(self.last_kept)


@takes(Point[float], periods=1500)
def limit(
    written: Mapping[str, Any],
    /,
    A: float | None = None,
    disturbance: Disturbance = "eps",
    method: MethodLike | None = None,
    *,
    threads: int | None = None,
    **parameters: Unpack[Point[float]],
) -> Limit:
    """Find the limit k₂ of practically orbital stability (§1) at one A.

    k₂ is the smallest disturbance at which a motion loses the structure of the undisturbed orbit, that is, at which its
    main impacts (docs/stability.md) no longer follow each other as in the orbit. All parameters apply
    to each disturbed motion, except the quantity that `disturbance` names, which is left out. For a limit in ε, the
    methods "muller" and "fixed" need `dtau`. For a limit in Δτ, a value of `eps` disturbs the motion in addition.

    Parameters
    ----------
    A : float
        excitation amplitude, dimensionless like all parameters. Required without a scene.
    disturbance : "eps" or "dtau"
        the quantity whose limit is computed: the physical disturbance ε, eq. (9), or the step Δτ of the numerical
        disturbance (§5).
    method : "certified", "muller" or "fixed", optional
        method that finds the switches of the disturbed motion. The default is "certified" for a limit in ε and "fixed"
        for a limit in Δτ. A limit in Δτ cannot have the method "certified", which has no grid. The undisturbed motion
        is always computed with ε = 0 and the method "certified".
    threads : int, optional
        number of threads; by default the number of threads of Numba (`numba.set_num_threads`).
    **parameters

    Returns
    -------
    Limit
        `k2` is the smallest disturbance found at which the structure is lost, dimensionless.
        `kept_below` is the largest disturbance found below `k2` at which it is kept.
        `half_kept` is the value above which it is kept at less than half of the values around any value tried.
        `kept_at` is the curve behind it: whether the structure is kept, for each value tried.
        `last_kept` is the largest value at which it is kept together with its lower neighbour, and
        `share_kept` the share of the values between `k2` and `last_kept` at which it is kept, 0 to 1.
        `k2_always` is a value up to which it is proved to be kept for all times, starts and phases of the disturbance.
        `n` is the period of the undisturbed orbit in excitation periods.
        `how` is a text that describes the loss.
        `kept` and `lost` are the structures of the motions at `kept_below` and at `k2`.
        `velocity_any` and `force_any` are the impulse and the force below which no disturbance destroys the structure.
        `velocity_si` is the limit as a velocity in m/s, if there is a scene.

    Raises
    ------
    TypeError, ValueError
        if an argument is invalid. The message is one sentence: name, value and allowed values of the argument.
    ValueError
        if `periods` is less than four times the period of the undisturbed motion. Such a record is too short for a
        comparison of the structure.

    Warns
    -----
    UserWarning
        for values that are probably a mistake: those of `simulate`.

    Examples
    --------
    The limit in ε at A = 1.5, from records of 50 periods:

    >>> import vibrodrive as vd
    >>> k = vd.limit(1.5, "eps", transient=50, periods=50)
    >>> k.n, k.kept_below < k.k2
    (1, True)
    >>> f"{k.k2:.3g}: {k.how}"
    '0.00388: gaps 1 became 1, 2'
    """
    names = ("disturbance", "method", "threads")
    plan = plan_limits({name: value for name, value in written.items() if name not in names}, disturbance, method)
    refuse_axes(plan.axes, ' (for axes use `sweep` with record = "limit")')
    search = LimitSearch(plan, check_threads(threads))
    warn(unlikely(plan, names_scene(written, plan)))
    with above("the progress of a call")("limit"):
        ((_, result),) = search.run([0])
    if result.status == Status.TOO_SHORT:
        raise ValueError(result.how)
    return result


def plan_limits(arguments: Mapping[str, Any], disturbance: object = "eps", method: object = None) -> Plan:
    """Return the checked plan of limits in a disturbance: that of a sweep with the record "limit"."""
    if not isinstance(disturbance, str) or disturbance not in GRIDS:
        kind = ValueError if isinstance(disturbance, str) else TypeError
        raise kind(bad("disturbance", disturbance, "one of " + ", ".join(GRIDS)))
    if arguments.get(disturbance) is not None:
        raise TypeError(bad(disturbance, arguments[disturbance], "left out, because its limit is computed"))
    if method is None:
        method = "fixed" if disturbance == "dtau" else "certified"
    plan = make_plan({**arguments, "method": method, "record": LIMIT})
    if disturbance != plan.sought:
        if disturbance == "dtau":
            allowed = "fixed or muller for a limit in dtau, because certified has no grid"
            raise ValueError(bad("method", "certified", allowed))
        name = plan.settings.method_name
        raise ValueError(f"dtau is missing: must be given for a limit in eps with method = {name!r}")
    fitting_rows(plan.settings.periods, 0)  # raises an error if the record does not fit in memory
    return plan


class _Problem:
    """One search in progress, with the motions at the two values between which the structure is lost.

    index : number of the point in the plan.
    requested : disturbances that the search needs next, without those that brief records prove to be lost.
    lost, kept : the least value found to be lost and the largest value kept below it, with the motions at these values.
    """

    def __init__(self, index: int, base: ReferenceOrbit, search: BandSearch) -> None:
        self.index, self.base = index, base
        self.kept: tuple[float, Motion | None] = (0.0, None)
        self.lost: tuple[float, Motion | None] = (math.inf, None)
        self._search = search

    def begin(self) -> None:
        self._request(next(self._search))

    def _request(self, values: np.ndarray) -> None:
        self._asked = values
        self._compute(values)

    def _compute(self, values: np.ndarray) -> None:
        """Let the motions at these of the values asked for be computed."""
        self.requested = values
        self._order = iter(values.tolist())

    @property
    def beyond(self) -> np.ndarray:
        """Requested disturbances above one that is lost."""
        return self.requested[self.requested > self.lost[0]]

    def is_lost(self, motion: Motion) -> bool:
        """Return whether the brief record of a motion proves that the structure is lost."""
        return self.base.cycle is not None and never_follows(self.base.cycle, motion.impacts, BRIEF_PERIODS)

    def drop(self, lost: Sequence[bool]) -> None:
        """Remove from the request those of the values `beyond` that are lost."""
        self._compute(self.requested[~np.isin(self.requested, self.beyond[np.array(lost, dtype=bool)])])

    def take(self, motion: Motion) -> bool:
        """Return whether the next of the requested motions keeps the structure."""
        value = next(self._order)
        keeps = motion.keeps(self.base)
        if keeps and self.kept[0] < value < self.lost[0]:
            self.kept = value, motion.copy()
        elif not keeps and value < self.lost[0]:
            self.lost = value, motion.copy()
        return keeps

    def go_on(self, answers: Sequence[bool]) -> Band | None:
        """Give the search its answers; values removed from the request are lost. Return the band at the end."""
        answered = dict(zip(self.requested.tolist(), answers, strict=True))
        try:
            self._request(self._search.send(np.array([answered.get(value, False) for value in self._asked.tolist()])))
        except StopIteration as end:
            return end.value
        return None


@dataclass(frozen=True)
class LimitSearch:
    """Searches for the limits in the disturbance `plan.sought` at points of a plan."""

    plan: Plan
    threads: int = field(default_factory=lambda: check_threads(None))
    halt: Halt = field(default_factory=Halt)

    def run(self, points: Sequence[int] | None = None) -> Iterator[tuple[int, Limit]]:
        """Yield (number of the point, Limit) for points of the plan (None: all), in the order in which they are found.

        If `periods` is too small at a point, the numbers of its Limit are NaN, and `how` gives the reason.
        """
        active: list[_Problem] = []
        waiting = list(range(self.plan.n_points) if points is None else points)
        with Evaluator(self.plan, self.plan.sought, self.threads, self.halt) as evaluator:
            while waiting or active:
                if waiting and len(active) <= AT_A_TIME // 2:
                    n = AT_A_TIME - len(active)
                    first, waiting = waiting[:n], waiting[n:]
                    yield from self._begun(first, active, evaluator)
                yield from self._advanced(active, evaluator)

    def _begun(
        self, points: Sequence[int], active: list[_Problem], evaluator: Evaluator
    ) -> Iterator[tuple[int, Limit]]:
        """Add searches at these points to `active`. Yield (number of the point, Limit) where there is no search."""

        def ahead() -> int:
            return TOGETHER // len(active)

        begun = []
        for index, base in zip(points, evaluator.undisturbed(np.array(points)), strict=True):
            if isinstance(base, Status):
                how = NO_PERIOD if base == Status.NO_ORBIT else base.advice
                yield index, self._limit(index, how=how, status=base)
            elif (periods := self.plan.settings.periods) < SEEN * base.n:
                enough = f">= {SEEN * base.n} ({SEEN} times the period of the undisturbed motion"
                how = bad("periods", periods, f"{enough} at A = {self.plan.arguments(index)['A']:g})")
                yield index, self._limit(index, n=base.n, how=how, status=Status.TOO_SHORT)
            else:
                begun.append((index, base))
        for (index, base), begin in zip(begun, self._beginnings(begun, evaluator), strict=True):
            active.append(_Problem(index, base, search_band(GRIDS[self.plan.sought], ahead, begin)))
        for problem in active[len(active) - len(begun) :]:
            problem.begin()

    @property
    def _of_force(self) -> bool:
        """Whether limits are those of certified motions in ε."""
        return (self.plan.sought, self.plan.settings.method) == ("eps", Method.CERTIFIED)

    def _beginnings(self, begun: Sequence[tuple[int, ReferenceOrbit]], evaluator: Evaluator) -> list[float]:
        """Return the disturbance at which the search for the limit of each orbit begins."""
        if not begun or not self._of_force:
            return [0.0] * len(begun)
        answers = evaluator.answers(
            [(index, base, GLANCES) for index, base in begun],
            lambda base, motion: motion.keeps(base),
            transient=min(self.plan.settings.transient, BRIEF_TRANSIENT),
            periods=min(self.plan.settings.periods, BRIEF_PERIODS),
        )
        return [BELOW_GLANCE * GLANCES[: [*kept, False].index(False)].max(initial=0.0) for kept in answers]

    def _always(self, index: int, base: ReferenceOrbit) -> Callable[[], Always] | None:
        """Return a function that finds the limit of an orbit for all times, where it is defined."""
        if not self._of_force:
            return None
        at = self.plan.arguments(index)
        return partial(find_always, at["A"], at["B"], at["eta"], base.cycle)

    def _advanced(self, active: list[_Problem], evaluator: Evaluator) -> Iterator[tuple[int, Limit]]:
        """Compute what the searches request. Remove those that end, and yield (number of the point, Limit) for each."""
        if not active:
            return
        beyond = [(p.index, p, p.beyond) for p in active]
        if self._saves_time(sum(len(values) for _, _, values in beyond)):
            brief = evaluator.answers(beyond, _Problem.is_lost, periods=BRIEF_PERIODS)
            for problem, lost in zip(active, brief, strict=True):
                problem.drop(lost)
        requests = [(p.index, p, p.requested) for p in active]
        answers = evaluator.answers(requests, _Problem.take)
        for problem, kept in zip(list(active), answers, strict=True):
            band = problem.go_on(kept)
            if band is not None:
                active.remove(problem)
                yield problem.index, self._explained(problem, band)

    def _saves_time(self, motions: int) -> bool:
        """Return whether brief records of this number of motions are possible and save time."""
        enough, s = motions >= 4 * TOGETHER, self.plan.settings
        half = s.periods >= max(s.transient + 2 * BRIEF_PERIODS, LEAST_BEGINNINGS * BRIEF_PERIODS)
        return enough and half

    def _explained(self, problem: _Problem, band: Band) -> Limit:
        """Return the limit of a search that has ended."""
        base = problem.base
        numbers = {"k2": band.lost, **band._asdict(), "n": base.n, "cycle": base.cycle}
        numbers["find_always"] = self._always(problem.index, base)
        del numbers["lost"]
        if (motion := problem.lost[1]) is None:
            how: dict[str, Any] = {"how": f"the structure is kept up to {band.searched_to:g}", "code": How.KEPT}
            return self._limit(problem.index, **numbers, **how)
        lost = compare_structure(problem.base, motion)
        code, text = explain_loss(problem.base, motion, lost)
        if (below := problem.kept[1]) is None:
            text = f"k2 is below the smallest value tried: {text}"
        kept = None if below is None else compare_structure(problem.base, below)
        return self._limit(problem.index, **numbers, kept=kept, lost=lost, code=code, how=text)

    def _limit(self, index: int, **fields: Any) -> Limit:
        """Return the Limit at a point of the plan."""
        plan, at = self.plan, self.plan.arguments(index)
        way = plan.sought, plan.settings.method_name
        return Limit(at["A"], at["B"], at["eta"], *way, scene=scene_of(plan.scalars), **fields)
