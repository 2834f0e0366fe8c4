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

from collections.abc import Mapping
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.paper.limits import band
from benchmarks.paper.motions import NotApplicable
from benchmarks.paper.starts import CLOSE, settled
from vibrodrive.stability.structure import deviation

COINCIDE = 1e-6
"""Largest distance of the section points of two motions that count as one, for the methods "certified" and "muller".
Motions that have merged still differ by rounding, about 1e-12. With the method "fixed" merged motions are equal in
every bit, so no difference is allowed."""

SIDES = (5, 9, 17, 33)  # numbers of values of ξ0, and of ξ'0; the smallest lattice that reaches every solution is used
COMPARED = 64  # last periods of the records that are compared
RECORDED = {"transient": 1000, "periods": 1500}

Starts = tuple[np.ndarray, np.ndarray]  # values of ξ0, values of ξ'0


def lattice(A: float, side: int) -> Starts:
    """Return (values of ξ0 in [0, a], values of ξ'0 in [-a, a]), evenly spaced, float64 (side,), with a = max(1, A)."""
    top = max(1.0, A)
    return np.linspace(0.0, top, side), np.linspace(-top, top, side)


def sufficient_starts(A: float, B: float = 0.1) -> tuple[int, int, Starts]:
    """Return (n, reached, starts): the period, the number of solutions reached, and the lattice of starts.

    Without a disturbance, motions from these starts end in `reached` of the n solutions. The lattice is the smallest
    one in SIDES that reaches all solutions, or the largest one if no lattice does.
    Raises NotApplicable if the undisturbed motion has no period.
    """
    solution = settled(A, B=B)
    if solution is None:
        raise NotApplicable(f"the undisturbed motion at A = {A:g} has no period")
    n, reached = len(solution.points), 0
    for side in SIDES:
        xi0, dxi0 = starts = lattice(A, side)
        found = vd.sweep(**solution.arguments | {"xi0": xi0, "dxi0": dxi0})
        distance, shift = deviation(solution.points, found.section)
        reached = len(np.unique(shift[distance <= CLOSE]))
        if reached == n:
            break
    return n, reached, starts


def is_unique(point: Mapping[str, Any], disturbance: str, values: Any, starts: Starts) -> np.ndarray:
    """Return, for each value of a disturbance, whether the motions from all starts become one motion: bool (k,).

    The result is False at a value at which any motion has the status BUDGET. `point` are arguments of `simulate`
    without ξ0, ξ'0 and the disturbance. The default method is "fixed" for Δτ and "certified" for ε.
    """
    at = {**RECORDED, "method": "fixed" if disturbance == "dtau" else "certified", **point}
    compared = min(COMPARED, at["periods"])
    at |= {"transient": at["transient"] + at["periods"] - compared, "periods": compared}
    swept = vd.sweep(**{disturbance: values, "xi0": starts[0], "dxi0": starts[1]}, **at)
    ends = swept.section.reshape(len(values), -1, compared, 2)
    allowed = 0.0 if at["method"] == "fixed" else COINCIDE
    return np.abs(ends - ends[:, :1]).max(axis=(1, 2, 3)) <= allowed


def unique_limit(disturbance: str, A: float, B: float = 0.1, **point: Any) -> Any:
    """Return the `band` of k_u: `lost` is k_u, and "kept" means that several motions remain.

    Raises NotApplicable if the undisturbed motion has fewer than two solutions.
    """
    n, _, starts = sufficient_starts(A, B)
    if n < 2:
        raise NotApplicable(f"there is one solution only at A = {A:g}")
    return band(disturbance, lambda values: ~is_unique({"A": A, "B": B, **point}, disturbance, values, starts))
