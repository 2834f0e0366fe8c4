"""Every periodic orbit of the undisturbed motion, stable or not, from the impact-phase map.

An orbit that ever rests is launched at φ_up, and all that do are one: it is followed, not searched. The
others launch at every impact; each gives a fixed point of the n-fold map on a cell of one itinerary, and
every cell is searched with a bracket (orbit_cells.py, orbit_roots.py). Since the map falls on every branch,
an orbit of an odd number of impacts has a negative multiplier and can only lose its stability by period
doubling, one of an even number a positive multiplier and can only do so in a fold.

Not an orbit of the map, and not listed: the mass at rest for good (A <= 1 + B), or in the air for good (B =
0).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from vibrodrive.orbit_cells import FLYING, NOTHING, RESTS, flights, intervals
from vibrodrive.orbit_map import ImpactMap, spell, states
from vibrodrive.orbit_roots import fixed_points
from vibrodrive.parameters import State, check_count

STABLE, UNSTABLE, SUPERSTABLE, UNDECIDED = "stable", "unstable", "superstable", "undecided"


@dataclass(frozen=True, eq=False)
class Orbit:
    """One periodic orbit; the `period` orbits that differ by whole excitation periods only are one.

    Attributes
    ----------
    period : whole excitation periods.
    impacts : number of impacts in one period.
    phases, speeds : phase and impact speed |ξ'| of each impact in order, float64 (impacts,), smallest phase
        first.
    gaps : whole excitation periods from each impact to the next, int64 (impacts,).
    multiplier : derivative of the impacts-fold map, exact; its modulus decides on stability.
    kind : "stable", "unstable", "superstable" (it rests: whatever is close joins it), or "undecided" (a fold
        or doubling closer than rounding can tell; then the phases are good to some 1e-7 only).
    word : the states of one period, after the first impact, as text.
    A, B : where.
    name : the word of each flight with the number of windows it spans, in a rotation that does not depend on
        where the orbit is said to begin: what stays the same until a bifurcation is met as A moves.
    """

    period: int
    impacts: int
    phases: np.ndarray
    speeds: np.ndarray
    gaps: np.ndarray
    multiplier: float
    kind: str
    word: str
    A: float
    B: float
    name: tuple[str, ...] = field(repr=False)


def orbits(A: float, B: float = 0.1, max_period: int = 3) -> list[Orbit]:
    """Every periodic orbit of up to `max_period` excitation periods at ε = 0, by period, impacts and phase.

    The effort grows with the number of itineraries: milliseconds up to some eight periods in the paper's
    range.

    Raises
    ------
    TypeError, ValueError
        if an argument is no number or out of range.
    """
    system = ImpactMap(A, B)
    limit = check_count("max_period", max_period, 1)
    if not system.moves:
        return []
    found = [*resting(system, limit), *launching(system, limit)]
    return sorted(found, key=lambda o: (o.period, o.impacts, *o.phases))


def resting(system: ImpactMap, limit: int) -> Iterator[Orbit]:
    """The orbit that rests, if its period is at most `limit`: none or one."""
    up = system.window[0]
    _, periods, _, _, n, fate, _ = flights(up, limit + 1, system.A, system.B, limit, NOTHING)
    if fate == RESTS and periods <= limit:
        yield follow(system, up, n, True)


def launching(system: ImpactMap, limit: int) -> Iterator[Orbit]:
    """The orbits that launch at every impact."""
    for cell in cells(system, limit):
        yield from closed(system, *cell)


def cells(system: ImpactMap, limit: int, only: Sequence[int] | None = None) -> Iterator[tuple[float, float, int, int]]:
    """(low, high, n, periods) of every interval of ψ with one itinerary of n flights and launches.

    `only` those whose itineraries of 1, 2, … flights are the given numbers.
    """
    A, B = system.A, system.B
    up, end = system.window
    alive = [(math.nextafter(up, end), math.nextafter(end, up))]
    for n in range(1, (limit if only is None else len(only)) + 1):
        above = alive
        alive = []
        for low, high in above:
            for a, b in intervals(low, high, n, A, B, limit):
                itinerary, periods, _, _, _, fate, _ = flights(a, n, A, B, limit, NOTHING)
                if fate == FLYING and (only is None or itinerary == only[n - 1]):
                    alive.append((a, b))
                    yield a, b, n, periods


def closed(system: ImpactMap, low: float, high: float, n: int, periods: int) -> Iterator[Orbit]:
    """The orbits of n impacts with their smallest launch phase in the cell [low, high]."""
    for psi, certain in returns(system, low, high, n, periods):
        if psi == min(launches(system, psi, n, periods)):
            yield follow(system, psi, n, certain)


def returns(system: ImpactMap, low: float, high: float, n: int, periods: int) -> Iterator[tuple[float, bool]]:
    """(ψ, certain) of every launch phase in the cell that returns after n flights, and not before."""
    phases, certain = fixed_points(low, high, n, system.A, system.B, periods)
    for own, psi in enumerate(phases.tolist()):
        later = launches(system, psi, n, periods)[1:]
        # flights of an orbit of fewer impacts lead back to the very root before the n-th
        if not any(low <= p <= high and np.argmin(abs(phases - p)) == own for p in later):
            yield psi, bool(certain[own])


def launches(system: ImpactMap, psi: float, n: int, periods: int) -> list[float]:
    """The n launch phases of the orbit through ψ."""
    path = [psi]
    for _ in range(n - 1):
        path.append(flights(path[-1], 1, system.A, system.B, periods, NOTHING)[2])
    return path


def follow(system: ImpactMap, psi: float, n: int, certain: bool) -> Orbit:
    """The orbit of n impacts through the launch phase ψ."""
    A, B = system.A, system.B
    up, end = system.window
    phases, speeds, gaps, words = np.empty(n), np.empty(n), np.empty(n, dtype=np.int64), []
    multiplier = 1.0
    phase = psi
    if psi == up:
        for _ in range(n):
            phase = float(system(phase).phase)
    for i in range(n):
        step = system(phase)
        phases[i] = phase
        gaps[i] = step.periods
        multiplier *= float(step.derivative)
        rests = not up < phase < end
        words.append([State.REST] * rests + states(up if rests else phase, A, B))
        phase = float(step.phase)
        speeds[(i + 1) % n] = step.speed
    late = (phases >= end).astype(np.int64)
    spans = gaps + np.roll(late, -1) - late  # counted from launch to launch: a rest may last over the turn 2π
    names = [f"{spell(word)} {span}" for word, span in zip(words, spans, strict=True)]
    first = int(np.argmin(phases))
    words = words[first:] + words[:first]
    return Orbit(
        period=int(gaps.sum()),
        impacts=n,
        phases=np.roll(phases, -first),
        speeds=np.roll(speeds, -first),
        gaps=np.roll(gaps, -first),
        multiplier=multiplier + 0.0,
        kind=kind_of(multiplier) if certain else UNDECIDED,
        word=spell([s for word in words for s in word]),
        A=A,
        B=B,
        name=min(tuple(names[i:] + names[:i]) for i in range(n)),
    )


def kind_of(multiplier: float) -> str:
    """Stability by the multiplier."""
    if multiplier == 0.0:
        return SUPERSTABLE
    return STABLE if abs(multiplier) < 1.0 else UNSTABLE
