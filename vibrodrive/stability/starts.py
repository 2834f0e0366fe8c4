"""Largest error of the start that does not change the final solution: k₁ of the definition in §1, at ε = 0.

The definition requires a bound of the error of the start below which the motion stays close to the undisturbed motion.
Without a disturbance an n-periodic orbit gives n solutions, which are this orbit shifted by 0 … n - 1 excitation
periods. Each solution attracts the starts in its basin. So an error of the start does no harm as long as the start
remains in the basin, and k₁ is the distance of the nearest edge of the basin along ξ, ξ' or τ. A start from which the
motion ends on any other orbit is outside the basin, too.

Along a coordinate a basin consists of intervals of all widths, its slices. They may accumulate next to an edge (A =
3.1, 3.25). The search for the edge begins with a scan of deviations. Finer and finer scans follow, each over a window
below the first deviation that leads to another solution. So the search finds a slice that the first scan missed if the
slice belongs to a sequence that accumulates at the edge. The search does not find a single slice that is narrower than
the step of the first scan, which is 2e-4 in τ and 2e-4 A in ξ and ξ'. Every edge found at A = 2.75, 3.04, 3.1 and 3.25
leads to an unstable orbit of the impact-phase map, as theory requires (tests).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from vibrodrive.batch.sweep import check_threads, collect
from vibrodrive.batch.trajectory import simulate
from vibrodrive.jit.trig import TWO_PI, turns
from vibrodrive.model import choices, names
from vibrodrive.model.parameters import bad, check
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.stability.limit import NO_PERIOD, refuse_axes
from vibrodrive.stability.structure import BLURRED, SETTLING, WATCHED, period, reference_orbit

Coordinate: TypeAlias = Literal["xi0", "dxi0", "tau0"]

COORDINATES = ("xi0", "dxi0", "tau0")

CLOSE = 0.5 * BLURRED  # largest distance of points of the same solution; different solutions differ by > BLURRED
PHASES = 8  # number of section phases that are tried; the search uses the first one that separates all solutions
LINEAR = 2**15  # number of equal steps of the first scan
GEOMETRIC = 512  # number of growing parts of the first of these steps, because an edge may be very close to the start
SMALLEST = 1e-12  # smallest deviation that is tried
PIECE = 4096  # number of deviations computed at a time
WINDOW = 64  # number of steps before the first value lost that the next, finer scan covers
EXACT = 1e-13  # the search ends if the interval that contains the edge has this relative width


class Edge(NamedTuple):
    """Edge of a basin in one direction from the start. All numbers are sizes of deviations.

    kept : largest deviation found below `lost`. With this deviation, and with all smaller deviations tried, the motion
        ends on the same solution.
    lost : smallest deviation found with which the motion ends on another solution; inf if there is none up to
        `searched_to`.
    searched_to : upper end of the deviations that the search covers if it finds no other solution.
    """

    kept: float
    lost: float
    searched_to: float


@dataclass(frozen=True, repr=False)
class StartLimit:
    """The limit k₁ along one coordinate of the start, dimensionless.

    Attributes
    ----------
    A, B, axis
        arguments of the search.
    n : int
        period of the undisturbed orbit in excitation periods, 0 if it has none.
    below, above : Edge
        edges of the basin on both sides of the start. `lost` is the smallest deviation found with which the motion ends
        on another solution; inf if there is none. `kept` is the largest deviation found below `lost` with which the
        motion ends on the same solution. `searched_to` is the upper end of the deviations that the search covers if it
        finds no other solution.
    """

    A: float
    B: float
    axis: str
    n: int
    below: Edge
    above: Edge

    def __repr__(self) -> str:
        found = f"k1 = {self.k1:.6g} in {self.axis} at A = {self.A:g}, B = {self.B:g}"
        return f"<StartLimit {found}: {self.how}; period {self.n}>"

    @property
    def near(self) -> Edge:
        """The nearer edge."""
        return min(self.below, self.above, key=lambda edge: (edge.lost, -edge.searched_to))

    @property
    def k1(self) -> float:
        """Distance of the nearer edge from the start; inf if no edge was found, NaN if there is no orbit."""
        return self.near.lost

    @property
    def kept_below(self) -> float:
        """Largest deviation found below k1; with this deviation the motion ends on the same solution."""
        return self.near.kept

    @property
    def searched_to(self) -> float:
        """Upper end of the deviations that the search covers if it finds no other solution."""
        return max(self.below.searched_to, self.above.searched_to)

    @property
    def how(self) -> str:
        """Description of the result."""
        if self.n == 0:
            return NO_PERIOD
        edges = {"below": self.below.lost, "above": self.above.lost}
        found = [f"{side} the start from {lost:.6g} on" for side, lost in edges.items() if math.isfinite(lost)]
        return f"another solution {', '.join(found)}" if found else f"the same solution up to {self.searched_to:.6g}"


NOWHERE = Edge(math.nan, math.nan, math.nan)


class Solution(NamedTuple):
    """The undisturbed motion.

    arguments : arguments of `simulate`.
    points : section points ξ, ξ', float64 (n, 2). Row k belongs to the excitation periods k, k + n, k + 2n and so on.
    """

    arguments: dict[str, Any]
    points: np.ndarray


def each_start_limit(
    arguments: Mapping[str, Any], axis: str, threads: int | None = None
) -> Iterator[tuple[int, StartLimit]]:
    """Return an iterator of (number of the point, StartLimit), in order, for the limits k₁ over axes of A and B."""
    plan = plan_of_starts(arguments, axis, ("A", "B"))
    count = check_threads(threads)
    return ((index, nearest_other(plan.arguments(index), axis, count)) for index in range(plan.n_points))


def plan_of_starts(arguments: Mapping[str, Any], axis: object, axes: Sequence[str]) -> Plan:
    if axis not in COORDINATES:
        kind = ValueError if isinstance(axis, str) else TypeError
        raise kind(bad("axis", axis, "one of " + ", ".join(COORDINATES)))
    plan = make_plan({**arguments, "method": choices.Method.CERTIFIED})
    refuse_axes(plan, axes, f" (axes may be {', '.join(axes)} for a limit in {axis}, where ε = 0)" if axes else "")
    if plan.scalars["eps"] != 0.0:
        raise ValueError(
            bad("eps", plan.scalars["eps"], f"left out for a limit in {axis}, because only the start changes")
        )
    return plan


def nearest_other(arguments: Mapping[str, Any], axis: str, threads: int | None = None) -> StartLimit:
    """Return the limit k₁ at a point. Arguments of `simulate` that give a disturbance or a grid are ignored."""
    solution = settled(arguments, threads)
    A, B = (check(name, arguments.get(name, names.PARAMETERS[name].default)) for name in ("A", "B"))
    if solution is None:
        return StartLimit(A, B, axis, 0, NOWHERE, NOWHERE)
    start = check(axis, solution.arguments[axis])
    reach = 2 * math.pi * (1.0 if axis == "tau0" else max(1.0, A))
    bit = float(np.spacing(abs(start)))

    def edge(sign: int) -> Edge:
        room = start - names.PARAMETERS[axis].low if sign < 0 else names.PARAMETERS[axis].high - start
        within = max(0.0, min(reach, room))
        return find_edge(lambda sizes: same_solution(solution, axis, sign * sizes, threads), within, bit)

    return StartLimit(A, B, axis, len(solution.points), edge(-1), edge(+1))


def find_edge(same: Callable[[np.ndarray], np.ndarray], reach: float, bit: float = 0.0) -> Edge:
    """Find the smallest deviation in (0, reach] for which `same` is False.

    The relative error is at most EXACT, or the absolute error is at most `bit`.

    same : function of ascending deviations, float64 (k,), that returns bool (k,); k is at most PIECE.
    """
    step = reach / LINEAR
    if step <= SMALLEST:
        return Edge(reach, math.inf, reach)
    scan = np.concatenate([np.geomspace(SMALLEST, step, GEOMETRIC, endpoint=False), step * np.arange(1, LINEAR + 1)])
    scan[-1] = reach
    for start in range(0, len(scan), PIECE):
        lost = np.flatnonzero(~same(scan[start : start + PIECE]))
        if len(lost):
            at = start + int(lost[0])
            break
    else:
        return Edge(reach, math.inf, reach)
    high = float(scan[at])
    low = float(scan[at - 1]) if at else 0.0
    while high - low > max(EXACT * high, bit):
        finer = np.linspace(max(0.0, high - WINDOW * (high - low)), high, PIECE + 1)
        lost = np.append(np.flatnonzero(~same(finer[1:-1])), PIECE - 1)  # `high` is lost
        if lost[0] == 0 and finer[0] > 0.0:  # the first value of the window is lost, too: move the window down
            low, high = float(finer[1]) - (high - low), float(finer[1])
        else:
            low, high = float(finer[lost[0]]), float(finer[lost[0] + 1])
    return Edge(low, high, reach)


def settled(arguments: Mapping[str, Any], threads: int | None = None) -> Solution | None:
    """Return the solution that the undisturbed motion ends on; None if this motion has no period or never moves."""
    kept = {name: value for name, value in arguments.items() if name in ("A", "B", "budget", "section_phase")}
    start = {name: arguments.get(name, names.PARAMETERS[name].default) for name in COORDINATES}
    long = max(SETTLING, arguments.get("transient", 0))
    exact = {"section_phase": 0.0, **kept, **start, "method": choices.Method.CERTIFIED, "transient": long}
    motion = simulate(**exact, periods=WATCHED)
    orbit = reference_orbit(motion)
    if orbit is None or motion.status == choices.Status.NEVER_LEAVES:
        return None
    n = orbit.n
    # at a section phase at which the orbit always rests, all solutions have equal section points
    phases = (exact["section_phase"] + TWO_PI / PHASES * np.arange(PHASES)) % TWO_PI
    sections = collect(make_plan(exact | {"section_phase": phases, "periods": WATCHED}), threads).section
    telling = np.flatnonzero(period(sections) == n)
    if len(telling) == 0:
        return None
    exact["section_phase"] = float(phases[telling[0]])
    found = sections[telling[0]]
    first = _first_section(exact["tau0"], exact["section_phase"]) + WATCHED - n
    points = np.empty((n, 2))
    points[(first + np.arange(n)) % n] = found[-n:]
    exact["transient"] += WATCHED - n
    return Solution(exact, points)


def same_solution(solution: Solution, axis: str, deviations: np.ndarray, threads: int | None = None) -> np.ndarray:
    """Return, for each deviation of one start coordinate, whether the motion ends on this solution: bool (k,).

    deviations : float64 (k,).
    """
    n = len(solution.points)
    starts = solution.arguments[axis] + deviations
    found = collect(make_plan(solution.arguments | {axis: starts, "periods": n}), threads)
    times = starts.tolist() if axis == "tau0" else [solution.arguments["tau0"]]
    first = np.array([_first_section(tau, solution.arguments["section_phase"]) for tau in times])
    expected = solution.points[(first[:, None] + WATCHED - n + np.arange(n)) % n]
    return np.abs(found.section - expected).max(axis=(-2, -1)) <= CLOSE


def _first_section(tau0: float, section_phase: float) -> int:
    """Return the number of the excitation period, from τ = 0, of the first section instant after τ0."""
    period0, phase0, _ = turns(tau0, 0.0)
    if -1.0 < tau0 < 0.0 and phase0 == 0.0:  # the start is before τ = 0, by less than the last bit of its phase
        return 0
    return int(period0) + (0 if turns(section_phase, 0.0)[1] > phase0 else 1)
