"""How far a start may be off, the k₁ of the definition in §1, at ε = 0.

The definition asks for a bound on the error of the start below which the motion stays with the one it is compared with.
Without a disturbance the n solutions of an n-periodic orbit are that orbit shifted by whole excitation periods, each
attracting the starts around it. So a start may be off until it lies on the edge of another solution's basin, and k₁ is
the distance of the nearest edge, along ξ, ξ' or τ. A motion that ends on any other orbit counts as lost, too.

A basin has slices of all widths: next to an edge they may follow each other ever closer (A = 3.1, 3.25). The edge is
found by a scan, then in windows below the first value lost, finer each time, so that a slice the scan passed over is
found where it belongs to a sequence that closes in on the edge. A slice on its own, narrower than the scan, is not:
that is 2e-4 in τ and 2e-4 A in ξ and ξ'. Every edge found at A = 2.75, 3.04, 3.1 and 3.25 leads to an unstable orbit of
the impact-phase map, as it has to (tests).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from vibrodrive.batch.sweep import collect
from vibrodrive.batch.trajectory import simulate
from vibrodrive.jit.trig import TWO_PI, turns
from vibrodrive.model.parameters import PARAMETERS, Method, Status, bad, check, real_array
from vibrodrive.model.plan import make_plan
from vibrodrive.stability.structure import BLURRED, SETTLING, WATCHED, period, reference_orbit

COORDINATES = ("xi0", "dxi0", "tau0")

CLOSE = 0.5 * BLURRED
"""Section points within this are those of the same solution: two solutions are further apart than BLURRED."""

PHASES = 8
"""Section phases of which one is taken that tells all solutions apart."""

LINEAR = 2**15
"""Equal steps of the scan; the first is divided geometrically, as edges may be anywhere near the start."""

GEOMETRIC = 512

SMALLEST = 1e-12
"""Deviations below this are not told from none."""

PIECE = 4096
"""Deviations computed at a time."""

WINDOW = 64
"""Steps of a scan that the next, finer one goes back from the first value lost."""

EXACT = 1e-13
"""Relative width at which the search for an edge ends."""


class Edge(NamedTuple):
    """Where, in one direction, starts begin to end elsewhere; as sizes of deviations.

    kept : largest deviation found that ends on the same solution, with all that were tried below it.
    lost : smallest one found that does not; inf if there is none up to `searched_to`.
    """

    kept: float
    lost: float
    searched_to: float


class StartLimit(NamedTuple):
    """k₁ along one coordinate: the edges below and above the start. n is the period of the orbit, 0 if it has none."""

    coordinate: str
    n: int
    below: Edge
    above: Edge

    @property
    def k1(self) -> float:
        """The distance of the nearer edge; inf where none was found, NaN where there is no orbit."""
        return math.nan if self.n == 0 else min(self.below.lost, self.above.lost)


NOWHERE = Edge(math.nan, math.nan, math.nan)


class Solution(NamedTuple):
    """The undisturbed motion: arguments, and the points of its orbit by excitation period mod n, float64 (n, 2)."""

    arguments: dict[str, Any]
    points: np.ndarray


def same_solution(
    arguments: Mapping[str, Any], coordinate: str, deviations: np.ndarray, threads: int | None = None
) -> np.ndarray:
    """Whether undisturbed motions whose starts are off by `deviations` in one coordinate end where that start does.

    Parameters
    ----------
    arguments : mapping
        of `simulate`, with the start (xi0, dxi0, tau0); disturbance, method, step and tolerance are not used.
    coordinate : "xi0", "dxi0" or "tau0"
    deviations : float64 (k,), dimensionless, added to the coordinate
    threads : int, optional
        all by default.

    Returns
    -------
    bool (k,)

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed; also if the undisturbed motion has no period.

    Examples
    --------
    At A = 3.04 a start from rest 0.4 above the obstacle ends where one at the obstacle does, one from 0.6 a period
    off:

    >>> from vibrodrive.stability.starts import same_solution
    >>> same_solution({"A": 3.04}, "xi0", [0.4, 0.6]).tolist()
    [True, False]
    """
    _check_coordinate(coordinate)
    solution = settled(arguments, threads)
    if solution is None:
        raise ValueError("the undisturbed motion has no period: there is no solution to end on")
    return _same(solution, coordinate, real_array("deviations", deviations, "numbers"), threads)


def nearest_other(arguments: Mapping[str, Any], coordinate: str, threads: int | None = None) -> StartLimit:
    """How far one coordinate of the start may be off before the undisturbed motion ends on another solution (k₁).

    `arguments` and `threads` as in `same_solution`. τ0 is searched up to 2π either way, where for n > 1 each start
    leads to another solution, ξ0 and ξ'0 up to 2π A, and ξ0 not below 0. Each edge is good to 1e-13 of the deviation,
    or to the last bit of the coordinate.

    Raises
    ------
    TypeError, ValueError
        with one sentence naming the key, the value and what is allowed.

    Examples
    --------
    >>> from vibrodrive.stability.starts import nearest_other
    >>> found = nearest_other({"A": 3.04}, "tau0")
    >>> found.n, round(found.above.lost, 3), round(found.below.lost, 3), round(found.k1, 3)
    (2, 0.818, 5.465, 0.818)
    """
    _check_coordinate(coordinate)
    solution = settled(arguments, threads)
    if solution is None:
        return StartLimit(coordinate, 0, NOWHERE, NOWHERE)
    start = check(coordinate, solution.arguments[coordinate])
    reach = 2 * math.pi * (1.0 if coordinate == "tau0" else max(1.0, solution.arguments["A"]))
    bit = float(np.spacing(abs(start)))

    def edge(sign: int) -> Edge:
        room = start - PARAMETERS[coordinate].low if sign < 0 else PARAMETERS[coordinate].high - start
        return find_edge(
            lambda sizes: _same(solution, coordinate, sign * sizes, threads), max(0.0, min(reach, room)), bit
        )

    return StartLimit(coordinate, len(solution.points), edge(-1), edge(+1))


def find_edge(same: Callable[[np.ndarray], np.ndarray], reach: float, bit: float = 0.0) -> Edge:
    """The smallest deviation in (0, reach] for which `same` says no, narrowed down to EXACT of it or to `bit`.

    same : takes ascending deviations (k,), gives bool (k,); it is asked for at most PIECE at a time.
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
        lost = np.append(np.flatnonzero(~same(finer[1:-1])), PIECE - 1)  # `high` is known to be lost
        if lost[0] == 0 and finer[0] > 0.0:  # lost as far back as the window: move it on
            low, high = float(finer[1]) - (high - low), float(finer[1])
        else:
            low, high = float(finer[lost[0]]), float(finer[lost[0] + 1])
    return Edge(low, high, reach)


def _check_coordinate(coordinate: object) -> None:
    if coordinate not in COORDINATES:
        kind = ValueError if isinstance(coordinate, str) else TypeError
        raise kind(bad("coordinate", coordinate, "one of " + ", ".join(COORDINATES)))


def _undisturbed(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of the undisturbed motion, certified, with what tells its start and its section."""
    kept = {name: value for name, value in arguments.items() if name in ("A", "B", "budget", "section_phase")}
    start = {name: arguments.get(name, PARAMETERS[name].default) for name in COORDINATES}
    long = max(SETTLING, arguments.get("transient", 0))
    return {"section_phase": 0.0, **kept, **start, "method": Method.CERTIFIED, "transient": long}


def settled(arguments: Mapping[str, Any], threads: int | None) -> Solution | None:
    """The solution that the undisturbed motion ends on; None if it has no period or never moves."""
    exact = _undisturbed(arguments)
    motion = simulate(**exact, periods=WATCHED)
    orbit = reference_orbit(motion)
    if orbit is None or motion.status == Status.NEVER_LEAVES:
        return None
    n = orbit.n
    # a section in which the orbit rests every time cannot tell its solutions apart
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


def _same(solution: Solution, coordinate: str, deviations: np.ndarray, threads: int | None) -> np.ndarray:
    """`same_solution`, of a solution that is known."""
    n = len(solution.points)
    starts = solution.arguments[coordinate] + deviations
    found = collect(make_plan(solution.arguments | {coordinate: starts, "periods": n}), threads)
    times = starts.tolist() if coordinate == "tau0" else [solution.arguments["tau0"]]
    first = np.array([_first_section(tau, solution.arguments["section_phase"]) for tau in times])
    expected = solution.points[(first[:, None] + WATCHED - n + np.arange(n)) % n]
    return np.abs(found.section - expected).max(axis=(-2, -1)) <= CLOSE


def _first_section(tau0: float, section_phase: float) -> int:
    """The excitation period (since τ = 0) of the first section instant after τ0."""
    period0, phase0, _ = turns(tau0, 0.0)
    if -1.0 < tau0 < 0.0 and phase0 == 0.0:  # as in kernels/setup.py
        return 0
    return int(period0) + (0 if turns(section_phase, 0.0)[1] > phase0 else 1)
