"""The limit k_u: the smallest disturbance found at which all starts end in one motion (§5, Fig. 11).

Without a disturbance the n solutions of an n-periodic orbit coexist, and the start determines the solution in which a
motion ends. A small disturbance leaves the solutions separate. A larger disturbance moves motions from one solution to
another. The state at the end of a rest depends only on the time, so two motions that rest at the same time are equal
after this rest. In the end one motion remains, which does not depend on the start.

The limit is not sharp, and several motions may return above it. At single steps Δτ above k_u several motions remain. At
a larger ε there may again be several solutions: at A = 3.04 there are two up to ε = 2.03e-4, one up to 4e-4, and three
at 5e-4. If motions merge slowly, several are left at the end of a short record: at Δτ = 0.058 several motions are left
after 2500 periods, and one after 5000.

The starts form a lattice: each of several ξ0 is combined with each of several ξ'0. All starts have the same τ0, because
another τ0 would shift the grid and so change the disturbance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibrodrive.batch.sweep import check_threads, collect
from vibrodrive.model import choices
from vibrodrive.model.parameters import check, check_choice, check_count, real_array
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.stability import limit
from vibrodrive.stability.limit import NO_PERIOD, Found
from vibrodrive.stability.limit_search import GRIDS, Band, check_disturbance, search_band
from vibrodrive.stability.starts import CLOSE, settled
from vibrodrive.stability.structure import LONGEST_PERIOD, deviation

COINCIDE = 1e-6
"""Largest distance of the section points of two motions that count as one, for the methods "certified" and "muller".
Motions that have merged still differ by rounding, about 1e-12. With the method "fixed" merged motions are equal in
every bit, so no difference is allowed."""

SIDES = (5, 9, 17, 33)  # numbers of values of ξ0, and of ξ'0; the smallest lattice that reaches every solution is used


def lattice(A: float, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Return (values of ξ0 in [0, a], values of ξ'0 in [-a, a]), evenly spaced, float64 (side,), with a = max(1, A)."""
    top = max(1.0, A)
    return np.linspace(0.0, top, side), np.linspace(-top, top, side)


def sufficient_starts(
    arguments: Mapping[str, Any], threads: int | None = None
) -> tuple[int, int, tuple[np.ndarray, np.ndarray]]:
    """Return (n, reached, starts): the period, the number of solutions reached, and the lattice of starts.

    Without a disturbance, motions from these starts end in `reached` of the n solutions. n is 0 if the undisturbed
    motion has no period. The lattice is the smallest one in SIDES that reaches all solutions, or the largest one if no
    lattice does. `starts` is (values of ξ0, values of ξ'0).
    """
    solution = settled(arguments, threads)
    A = check("A", arguments["A"])
    if solution is None:
        return 0, 0, lattice(A, SIDES[0])
    n, reached = len(solution.points), 0
    for side in SIDES:
        xi0, dxi0 = starts = lattice(A, side)
        found = collect(make_plan(solution.arguments | {"xi0": xi0, "dxi0": dxi0, "periods": n}), threads)
        distance, shift = deviation(solution.points, found.section)
        reached = len(np.unique(shift[distance <= CLOSE]))
        if reached == n:
            break
    return n, reached, starts


def is_unique(
    arguments: Mapping[str, Any],
    disturbance: str,
    values: np.ndarray,
    starts: tuple[np.ndarray, np.ndarray] | None = None,
    threads: int | None = None,
) -> np.ndarray:
    """Return, for each value of a disturbance, whether the motions from all starts become one motion: bool (k,).

    The comparison covers the last LONGEST_PERIOD periods of the records. The result is False at a value at which any
    motion has the status BUDGET.

    arguments : arguments of `simulate` without ξ0, ξ'0 and the disturbance. The default method is "fixed" for Δτ and
        "certified" for ε.
    values : values of the disturbance, float64 (k,).
    starts : (values of ξ0, values of ξ'0). Every ξ0 is combined with every ξ'0. The default is the lattice of
        `sufficient_starts`.
    """
    check_disturbance(disturbance)
    xi0, dxi0 = sufficient_starts(arguments, threads)[2] if starts is None else starts
    settings = {"method": "fixed" if disturbance == "dtau" else "certified", "transient": 1000, "periods": 1500}
    point = {name: value for name, value in (settings | dict(arguments)).items() if value is not None}
    whole = check_count("transient", point["transient"], 0) + check_count("periods", point["periods"], 1)
    compared = min(LONGEST_PERIOD, point["periods"])
    swept: dict[str, Any] = {disturbance: real_array(disturbance, values, "numbers"), "xi0": xi0, "dxi0": dxi0}
    rest = {name: value for name, value in point.items() if name not in swept}  # the axes have the order of the keys
    rest |= {"transient": whole - compared, "periods": compared}
    section = collect(make_plan(swept | rest), threads).section
    ends = section.reshape(len(section), -1, compared, 2)
    allowed = 0.0 if check_choice("method", point["method"], choices.Method) == choices.Method.FIXED else COINCIDE
    return np.abs(ends - ends[:, :1]).max(axis=(1, 2, 3)) <= allowed


@dataclass(frozen=True, repr=False)
class UniqueLimit(Found):
    """The limit k_u: the smallest disturbance found at which all starts end in one motion, dimensionless.

    Attributes
    ----------
    A, B, eta, disturbance, method
        arguments of the search.
    ku : float
        smallest disturbance found at which all starts end in one motion, refined by bisection. If `several_below` is 0,
        `ku` is only an upper bound. It is inf if several motions remain at every disturbance up to `searched_to`, 0 if
        there is only one solution without a disturbance, and NaN if the undisturbed motion has no period.
    several_below : float
        largest disturbance below `ku` at which the bisection found several motions; 0 if there is none.
    last_several : float
        upper end of the band: the largest value on the grid of disturbances at which several motions remain and at
        whose lower neighbour on this grid several motions remain, too.
    share_several : float
        share of the grid values between `ku` and `last_several` at which several motions remain, 0 to 1.
    searched_to : float
        largest disturbance that was tried.
    n : int
        number of solutions without a disturbance. It equals the period of the undisturbed orbit; 0 if the undisturbed
        motion has no period.
    how : str
        description of the result.
    """

    ku: float
    several_below: float = math.nan
    last_several: float = math.nan
    share_several: float = math.nan
    searched_to: float = math.nan
    n: int = 0
    how: str = ""

    def __repr__(self) -> str:
        found = f"ku = {self.ku:.6g} in {self.disturbance} at A = {self.A:g}, B = {self.B:g}"
        return f"<UniqueLimit {found}: {self.how}; period {self.n}, {self.method}>"

    @property
    def velocity(self) -> float:
        """`ku` as a velocity amplitude, dimensionless like ξ': ku·η·A for ε, and ku for Δτ."""
        return self.as_velocity(self.ku)

    @property
    def velocity_last(self) -> float:
        """`last_several` as a velocity amplitude."""
        return self.as_velocity(self.last_several)


def each_unique_limit(
    arguments: Mapping[str, Any], disturbance: str, method: str | None = None, threads: int | None = None
) -> Iterator[tuple[int, UniqueLimit]]:
    """Return an iterator of (number of the point, UniqueLimit), in order, for limits k_u over axes of A, B and η."""
    plan = limit.plan_over_axes(arguments, disturbance, method)
    count = check_threads(threads)
    return ((index, unique_at(plan, index, disturbance, count)) for index in range(plan.n_points))


def unique_at(plan: Plan, index: int, disturbance: str, threads: int) -> UniqueLimit:
    at = plan.arguments(index)
    n, _, starts = sufficient_starts(at, threads)
    point = at["A"], at["B"], at["eta"], disturbance, plan.settings.method_name
    if n < 2:
        return UniqueLimit(*point, 0.0 if n else math.nan, n=n, how="there is one solution only" if n else NO_PERIOD)
    band = unique_from(at, disturbance, starts, threads)
    several = f"several motions remain up to {band.searched_to:g}"
    how = "all starts end in one motion" if math.isfinite(band.lost) else several
    return UniqueLimit(*point, *band, n, how)


def unique_from(
    arguments: Mapping[str, Any],
    disturbance: str,
    starts: tuple[np.ndarray, np.ndarray] | None = None,
    threads: int | None = None,
) -> Band:
    """Find the band of k_u. A value is kept if several motions remain, and lost if all starts end in one motion.

    The search uses the same grid of disturbances as the search for k₂. The arguments are those of `is_unique`.
    """
    check_disturbance(disturbance)
    starts = sufficient_starts(arguments, threads)[2] if starts is None else starts
    search = search_band(GRIDS[disturbance])
    requested = next(search)
    while True:
        several = ~is_unique(arguments, disturbance, requested, starts, threads)
        try:
            requested = search.send(several)
        except StopIteration as end:
            return end.value
