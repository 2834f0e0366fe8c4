"""The disturbance from which all starts end on one motion: k_u (§5, Fig. 11).

Without a disturbance the n solutions of an n-periodic orbit coexist, and the start decides which of them a motion ends
on. A disturbance leaves them apart as long as it is small. From some size on it carries motions from one to another,
and because a rest forgets all but the time, motions that once rest together are one from there on: then the start has
no effect on what is left after a while.

Nor is this size a sharp one, nor the last. At single steps Δτ above it several motions remain, and a larger ε may bring
an order of its own with as many solutions (A = 3.04: two up to 2.03e-4, one up to 4e-4, three at 5e-4). Where motions
merge slowly, several are left at the end of a short record (Δτ = 0.058: of 2500 periods, not of 5000).

Starts differ in ξ0 and ξ'0 and share τ0: a shift of τ0 would shift the grid, and so change the disturbance.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from vibrodrive.batch.sweep import collect
from vibrodrive.model.parameters import Method, bad, check, check_choice, check_count, real_array
from vibrodrive.model.plan import make_plan
from vibrodrive.stability.limit_search import GRIDS, Band, search_band
from vibrodrive.stability.starts import CLOSE, settled
from vibrodrive.stability.structure import LONGEST_PERIOD, deviation

COINCIDE = 1e-6
"""Section points within this are those of one motion: in exact steps two motions that meet differ by rounding, some
1e-12; on a fixed grid they meet to the bit, and no difference is allowed."""

SIDES = (5, 9, 17, 33)
"""Values of ξ0 and of ξ'0: the first of these lattices from which every solution is reached is taken."""

HIGHEST = 1.0
"""Largest ξ0 and |ξ'0|, times A."""


def lattice(A: float, side: int) -> tuple[np.ndarray, np.ndarray]:
    """ξ0 and ξ'0, float64 (side,) each: even steps from 0, or from below, up to HIGHEST A."""
    top = HIGHEST * max(1.0, A)
    return np.linspace(0.0, top, side), np.linspace(-top, top, side)


def starts_that_reach_all(
    arguments: Mapping[str, Any], threads: int | None = None
) -> tuple[int, int, tuple[np.ndarray, np.ndarray]]:
    """(n, how many of the n solutions are reached without a disturbance, the lattice of starts that reaches them).

    n is 0 if the undisturbed motion has no period. The lattice is the smallest of SIDES from which all are reached, or
    the largest of them.
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
    """Whether, at each value of a disturbance, motions from many starts are one at the end of the record.

    Parameters
    ----------
    arguments : mapping
        of `simulate`, of each disturbed motion but for ξ0, ξ'0 and the disturbance; method "fixed" for Δτ and
        "certified" for ε unless given. Over its last LONGEST_PERIOD periods the record is compared.
    disturbance : "eps" or "dtau"
    values : float64 (k,), dimensionless
    starts : (float64 (m,), float64 (l,)), optional
        values of ξ0 and of ξ'0, each with each; by default those from which all solutions are reached without a
        disturbance.
    threads : int, optional
        all by default.

    Returns
    -------
    bool (k,)
        False, too, where a motion was given up as chattering.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed.

    Examples
    --------
    At A = 3.04 two solutions remain with a small step, one with a large one (Fig. 11):

    >>> from vibrodrive.stability.unique_motion import ends_on_one
    >>> ends_on_one({"A": 3.04}, "dtau", [0.01, 0.1]).tolist()
    [False, True]
    """
    _check_disturbance(disturbance)
    xi0, dxi0 = starts_that_reach_all(arguments, threads)[2] if starts is None else starts
    settings = {"method": "fixed" if disturbance == "dtau" else "certified", "transient": 1000, "periods": 1500}
    point = {name: value for name, value in (settings | dict(arguments)).items() if value is not None}
    whole = check_count("transient", point["transient"], 0) + check_count("periods", point["periods"], 1)
    compared = min(LONGEST_PERIOD, point["periods"])
    swept: dict[str, Any] = {disturbance: real_array(disturbance, values, "numbers"), "xi0": xi0, "dxi0": dxi0}
    rest = {name: value for name, value in point.items() if name not in swept}  # axes lie in the order written
    rest |= {"transient": whole - compared, "periods": compared}
    section = collect(make_plan(swept | rest), threads).section
    ends = section.reshape(len(section), -1, compared, 2)
    allowed = 0.0 if check_choice("method", point["method"], Method) == Method.FIXED else COINCIDE
    return np.abs(ends - ends[:, :1]).max(axis=(1, 2, 3)) <= allowed


def unique_from(
    arguments: Mapping[str, Any],
    disturbance: str,
    starts: tuple[np.ndarray, np.ndarray] | None = None,
    threads: int | None = None,
) -> Band:
    """From which disturbance all starts end on one motion (k_u), as a band with two ends.

    The values tried are those of k₂; "kept" is that several motions remain. So `k2` is the first value at which all
    are one, `last_kept` the last, with its lower neighbour, at which they are not; inf where several remain at all
    values tried.

    Arguments as in `ends_on_one`, with the same errors.
    """
    _check_disturbance(disturbance)
    starts = starts_that_reach_all(arguments, threads)[2] if starts is None else starts
    search = search_band(GRIDS[disturbance])
    requested = next(search)
    while True:
        several = ~ends_on_one(arguments, disturbance, requested, starts, threads)
        try:
            requested = search.send(several)
        except StopIteration as end:
            return end.value


def _check_disturbance(disturbance: object) -> None:
    if not isinstance(disturbance, str) or disturbance not in GRIDS:
        kind = ValueError if isinstance(disturbance, str) else TypeError
        raise kind(bad("disturbance", disturbance, "one of " + ", ".join(GRIDS)))
