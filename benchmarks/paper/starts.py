"""k₁: the smallest error of the start after which the undisturbed motion settles on another solution (§1).

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

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import vibrodrive as vd
from vibrodrive.stability.structure import period, reference_orbit

COORDINATES = ("xi0", "dxi0", "tau0")

WATCHED = 256  # recorded periods of an undisturbed motion
SETTLING = 20_000  # transient periods of an undisturbed motion; near a bifurcation it settles slowly
CLOSE = 5e-5  # largest distance of points of the same solution; those of different solutions are twice as far apart
PHASES = 8  # number of section phases that are tried; the search uses the first one that separates all solutions
LINEAR = 2**15  # number of equal steps of the first scan
GEOMETRIC = 512  # number of growing parts of the first of these steps, because an edge may be very close to the start
SMALLEST = 1e-12  # smallest deviation that is tried
PIECE = 4096  # number of deviations computed at a time
WINDOW = 64  # number of steps before the first value lost that the next, finer scan covers
EXACT = 1e-13  # the search ends if the interval that contains the edge has this relative width


class Solution(NamedTuple):
    """The undisturbed motion.

    arguments : arguments of `simulate`.
    points : section points ξ, ξ', float64 (n, 2). Row k belongs to the excitation periods k, k + n, k + 2n and so on.
    """

    arguments: dict[str, Any]
    points: np.ndarray


class Edge(NamedTuple):
    """Edge of a basin in one direction from the start, as sizes of deviations.

    lost : smallest deviation found with which the motion ends on another solution; inf if there is none.
    kept : largest deviation found below `lost`; with it the motion ends on the same solution.
    """

    kept: float
    lost: float


def start_limit(A: float, coordinate: str, **start: float) -> tuple[Edge, Edge] | None:
    """Return the edges of the basin below and above the start along a coordinate; k₁ is the smaller `lost`.

    `start` gives B, xi0, dxi0 and tau0, with the defaults of `simulate`. The deviations are up to 2π in τ0, and up to
    2π max(1, A) in ξ0 >= 0 and ξ'0. The result is None if the undisturbed motion has no period or never moves.
    """
    solution = settled(A, **start)
    if solution is None:
        return None
    at = solution.arguments[coordinate]
    reach = math.tau * (1.0 if coordinate == "tau0" else max(1.0, A))
    bit = float(np.spacing(abs(at)))
    below = min(reach, at) if coordinate == "xi0" else reach
    return (
        find_edge(lambda sizes: same_solution(solution, coordinate, -sizes), below, bit),
        find_edge(lambda sizes: same_solution(solution, coordinate, sizes), reach, bit),
    )


def find_edge(same: Callable[[np.ndarray], np.ndarray], reach: float, bit: float = 0.0) -> Edge:
    """Find the smallest deviation in (0, reach] for which `same` is False.

    The relative error is at most EXACT, or the absolute error is at most `bit`.

    same : function of ascending deviations, float64 (k,), that returns bool (k,); k is at most PIECE.
    """
    step = reach / LINEAR
    if step <= SMALLEST:
        return Edge(reach, math.inf)
    scan = np.concatenate([np.geomspace(SMALLEST, step, GEOMETRIC, endpoint=False), step * np.arange(1, LINEAR + 1)])
    scan[-1] = reach
    for start in range(0, len(scan), PIECE):
        lost = np.flatnonzero(~same(scan[start : start + PIECE]))
        if len(lost):
            at = start + int(lost[0])
            break
    else:
        return Edge(reach, math.inf)
    high = float(scan[at])
    low = float(scan[at - 1]) if at else 0.0
    while high - low > max(EXACT * high, bit):
        finer = np.linspace(max(0.0, high - WINDOW * (high - low)), high, PIECE + 1)
        lost = np.append(np.flatnonzero(~same(finer[1:-1])), PIECE - 1)  # `high` is lost
        if lost[0] == 0 and finer[0] > 0.0:  # the first value of the window is lost, too: move the window down
            low, high = float(finer[1]) - (high - low), float(finer[1])
        else:
            low, high = float(finer[lost[0]]), float(finer[lost[0] + 1])
    return Edge(low, high)


def settled(A: float, **start: float) -> Solution | None:
    """Return the solution that the undisturbed motion ends on; None if this motion has no period or never moves."""
    point: dict[str, Any] = (
        dict.fromkeys(COORDINATES, 0.0) | start | {"A": A, "transient": SETTLING, "periods": WATCHED}
    )
    motion = vd.simulate(**point)
    orbit = reference_orbit(motion)
    if orbit is None or motion.status == vd.Status.NEVER_LEAVES:
        return None
    n = orbit.n
    # at a section phase at which the orbit always rests, all solutions have equal section points
    phases = math.tau / PHASES * np.arange(PHASES)
    sections = vd.sweep(section_phase=phases, **point).section
    telling = np.flatnonzero(period(sections) == n)
    if len(telling) == 0:
        return None
    phase, found = float(phases[telling[0]]), sections[telling[0]]
    first = _first_section(point["tau0"], phase) + WATCHED - n
    points = np.empty((n, 2))
    points[(first + np.arange(n)) % n] = found[-n:]
    return Solution(point | {"section_phase": phase, "transient": SETTLING + WATCHED - n, "periods": n}, points)


def same_solution(solution: Solution, coordinate: str, deviations: np.ndarray) -> np.ndarray:
    """Return, for each deviation of one start coordinate, whether the motion ends on this solution: bool (k,)."""
    at, n = solution.arguments, len(solution.points)
    starts = at[coordinate] + deviations
    found = vd.sweep(**at | {coordinate: starts})
    times = starts.tolist() if coordinate == "tau0" else [at["tau0"]]
    first = np.array([_first_section(tau, at["section_phase"]) for tau in times])
    expected = solution.points[(first[:, None] + WATCHED - n + np.arange(n)) % n]
    return np.abs(found.section - expected).max(axis=(-2, -1)) <= CLOSE


def _first_section(tau0: float, phase: float) -> int:
    """Return the number of the excitation period, from τ = 0, of the first section instant after τ0."""
    return math.floor((tau0 - phase) / math.tau) + 1
