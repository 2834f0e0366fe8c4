"""The disturbance from which all starts end on one motion: k_u (§5, Fig. 11).

Without a disturbance the n solutions of an n-periodic orbit coexist, and the start determines the solution that a
motion ends on. A small disturbance keeps the solutions separate. From a certain size on it moves motions from one
solution to another. The state at the end of a rest depends only on the time, so two motions that rest at the same time
are equal from then on. In the end one motion remains, which does not depend on the start.

This size is neither sharp nor final. At single steps Δτ above it several motions remain. A larger ε may have a
structure of its own with several solutions (A = 3.04: two up to 2.03e-4, one up to 4e-4, three at 5e-4). If motions
merge slowly, several remain at the end of a short record (Δτ = 0.058: after 2500 periods, but not after 5000).

Starts differ in ξ0 and ξ'0 and share τ0, because another τ0 would shift the grid and so change the disturbance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from vibrodrive.batch.sweep import check_threads, collect
from vibrodrive.model import choices, kinds, names, slips
from vibrodrive.model.keywords import MethodLike, ScanLike, as_written
from vibrodrive.model.parameters import check, check_choice, check_count, real_array
from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.stability import limit
from vibrodrive.stability.limit import NO_PERIOD, PERIODS, Disturbance, Found
from vibrodrive.stability.limit_search import GRIDS, Band, check_disturbance, search_band
from vibrodrive.stability.starts import CLOSE, settled
from vibrodrive.stability.structure import LONGEST_PERIOD, deviation

COINCIDE = 1e-6
"""Largest distance of section points of one motion without a grid: two motions that merge differ by rounding, about
1e-12. On a fixed grid merged motions are equal in every bit, and no difference is allowed."""

SIDES = (5, 9, 17, 33)  # numbers of values of ξ0 and of ξ'0; the first lattice that reaches every solution is used


def lattice(A: float, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Return evenly spaced values of ξ0 from 0 to max(1, A), and of ξ'0 from -max(1, A) to it, float64 (side,) each."""
    top = max(1.0, A)
    return np.linspace(0.0, top, side), np.linspace(-top, top, side)


def starts_that_reach_all(
    arguments: Mapping[str, Any], threads: int | None = None
) -> tuple[int, int, tuple[np.ndarray, np.ndarray]]:
    """Return (n, the number of the n solutions that are reached without a disturbance, the lattice of starts).

    n is 0 if the undisturbed motion has no period. The lattice is the smallest one in SIDES that reaches all solutions,
    or the largest one if none does.
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


def ends_on_one(
    arguments: Mapping[str, Any],
    disturbance: str,
    values: np.ndarray,
    starts: tuple[np.ndarray, np.ndarray] | None = None,
    threads: int | None = None,
) -> np.ndarray:
    """Return True for each value of a disturbance at which motions from all starts have become one motion: bool (k,).

    The last LONGEST_PERIOD periods of the records are compared. `arguments` are those of `simulate` without ξ0, ξ'0 and
    the disturbance; by default the method is "fixed" for Δτ and "certified" for ε. `starts` are values of ξ0 and of
    ξ'0, which are combined to a lattice; by default one that reaches all solutions without a disturbance. The result is
    False if any motion has the status BUDGET.
    """
    check_disturbance(disturbance)
    xi0, dxi0 = starts_that_reach_all(arguments, threads)[2] if starts is None else starts
    settings = {"method": "fixed" if disturbance == "dtau" else "certified", "transient": 1000, "periods": 1500}
    point = {name: value for name, value in (settings | dict(arguments)).items() if value is not None}
    whole = check_count("transient", point["transient"], 0) + check_count("periods", point["periods"], 1)
    compared = min(LONGEST_PERIOD, point["periods"])
    swept: dict[str, Any] = {disturbance: real_array(disturbance, values, "numbers"), "xi0": xi0, "dxi0": dxi0}
    rest = {name: value for name, value in point.items() if name not in swept}  # the order of axes is that of the keys
    rest |= {"transient": whole - compared, "periods": compared}
    section = collect(make_plan(swept | rest), threads).section
    ends = section.reshape(len(section), -1, compared, 2)
    allowed = 0.0 if check_choice("method", point["method"], choices.Method) == choices.Method.FIXED else COINCIDE
    return np.abs(ends - ends[:, :1]).max(axis=(1, 2, 3)) <= allowed


@dataclass(frozen=True, repr=False)
class UniqueLimit(Found):
    """The limit k_u: the disturbance from which all starts end on one motion, dimensionless.

    Attributes
    ----------
    A, B, eta, disturbance, method
        arguments of the search.
    ku : float
        smallest disturbance found from which all starts end on one motion, refined by bisection. It is an upper bound
        if `several_below` is 0, inf if several motions remain up to `searched_to`, 0 if there is only one solution, and
        NaN if the undisturbed motion has no period.
    several_below : float
        largest disturbance below ku at which the bisection found several motions; 0 if there is none.
    last_several : float
        largest value at which, and at its lower neighbour on the grid, several motions remain.
    share_several : float
        share of the values tried between ku and last_several at which several motions remain.
    searched_to : float
        largest disturbance that was tried.
    n : int
        number of solutions without a disturbance: the period of the orbit; 0 if it has none.
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
        """ku as a velocity amplitude, dimensionless like ξ': ku·η·A in ε, ku in Δτ."""
        return self.as_velocity(self.ku)

    @property
    def velocity_last(self) -> float:
        """last_several as a velocity amplitude."""
        return self.as_velocity(self.last_several)


@as_written
def unique_limit(
    written: Mapping[str, Any],
    /,
    A: float,
    disturbance: Disturbance = "eps",
    method: MethodLike | None = None,
    *,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = names.ETA,
    dtau: float | None = None,
    tol: float | None = None,
    tau0: float = 0.0,
    transient: int = 1000,
    periods: int = PERIODS,
    scan: ScanLike = "skip",
    budget: int = 100_000,
    threads: int | None = None,
) -> UniqueLimit:
    """Find the disturbance k_u from which all starts end on one motion (§5, Fig. 11).

    Parameters
    ----------
    A : float
        excitation amplitude, dimensionless like all parameters.
    disturbance, method, eps, dtau
        as in `limit`.
    B, eta, tol, tau0, transient, periods, scan, budget
        as in `simulate`, for each disturbed motion; ξ0 and ξ'0 are those of a lattice of starts. The last 64 recorded
        periods are compared.
    threads : int, optional
        threads to use; all by default.

    Returns
    -------
    UniqueLimit
        with ku, several_below, last_several, share_several, n and how.

    Raises
    ------
    TypeError, ValueError
        in one sentence with the key, its value and the allowed values.

    Warns
    -----
    UserWarning
        as `limit`, for values that are probably a mistake.

    Examples
    --------
    The two solutions at A = 3.04 become one:

    >>> import vibrodrive as vd
    >>> k = vd.unique_limit(3.04, "dtau", transient=50, periods=50)
    >>> k.n, k.several_below < k.ku
    (2, True)
    """
    plan = limit.plan_at_one_point(written, disturbance, method)
    count = check_threads(threads)
    slips.warn_of_slip([limit.slipping(plan)], depth=3)  # the warning names the line of the caller, two functions above
    with kinds.above("a line while it lasts")("unique_limit"):
        return _unique_limit(plan, 0, disturbance, count)


def each_unique_limit(
    arguments: Mapping[str, Any], disturbance: str, method: str | None = None, threads: int | None = None
) -> Iterator[tuple[int, UniqueLimit]]:
    """Return an iterator of (number of the point, UniqueLimit) over the limits k_u on axes of A, B and η, in order."""
    plan = limit.plan_over_axes(arguments, disturbance, method)
    count = check_threads(threads)
    return ((index, _unique_limit(plan, index, disturbance, count)) for index in range(plan.n_points))


def _unique_limit(plan: Plan, index: int, disturbance: str, threads: int) -> UniqueLimit:
    at = plan.arguments(index)
    n, _, starts = starts_that_reach_all(at, threads)
    point = at["A"], at["B"], at["eta"], disturbance, choices.Method(plan.settings.method).name.lower()
    if n < 2:
        return UniqueLimit(*point, 0.0 if n else math.nan, n=n, how="there is one solution only" if n else NO_PERIOD)
    band = unique_from(at, disturbance, starts, threads)
    several = f"several motions up to {band.searched_to:g}"
    how = "all starts end on one motion" if math.isfinite(band.lost) else several
    return UniqueLimit(*point, *band, n, how)


def unique_from(
    arguments: Mapping[str, Any],
    disturbance: str,
    starts: tuple[np.ndarray, np.ndarray] | None = None,
    threads: int | None = None,
) -> Band:
    """Find the band of k_u: a value is kept if several motions remain, and lost if all starts end on one motion.

    The grid of values is that of k₂. Arguments as in `ends_on_one`.
    """
    check_disturbance(disturbance)
    starts = starts_that_reach_all(arguments, threads)[2] if starts is None else starts
    search = search_band(GRIDS[disturbance])
    requested = next(search)
    while True:
        several = ~ends_on_one(arguments, disturbance, requested, starts, threads)
        try:
            requested = search.send(several)
        except StopIteration as end:
            return end.value
