"""All periodic orbits of the undisturbed motion, stable and unstable, from the impact-phase map.

flight.py defines launch, flight, word and φ_up. After every rest the launch is at φ_up, so there is at most one orbit
with a rest. The motion from this launch gives this orbit without a search. In all other orbits a launch follows each
impact without a rest. An orbit of n impacts gives a fixed point of the n-fold map on a cell, an interval of launch
phases with one itinerary (itineraries.py). Every cell is searched (fixed_points.py). The multiplier of an orbit is the
derivative of the n-fold map. The map falls between any two neighbouring breakpoints (impact_map.py). So an orbit
with an odd number of impacts has a negative multiplier and can lose its stability only by period doubling. An orbit
with an even number of impacts has a positive multiplier and can lose its stability only in a fold.

If the mass never leaves the obstacle (A <= 1 + B), there is no orbit of the map, and the list is empty. Motions at
B = 0 that never return to the obstacle are not orbits of the map and are not listed, either.

**On the level (B = 0)** slides up and down cancel each other, and at every A > 1 exactly one motion returns to the
obstacle. This motion touches the obstacle once a period, without speed (flight.py). It is listed as "touching", and no
search is necessary. The same motion shifted up by any ξ is a periodic motion without impacts. After a later launch the
mass lands with some speed. So the touching motion is neither stable nor unstable, and it has no multiplier. If
`simulate` reaches this motion, the status is TOO_CLOSE.

**Close to the level** an orbit without a rest has an impact speed of about 10 B, and each of its flights multiplies a
difference of launch phases by about A/B. The launch phase of such an orbit is in an interval of width B/A divided by
the multiplier of the orbit. An orbit is left out if this interval contains hardly any float (STEEPEST), or if B <=
LEVEL A, because rounding would then determine whether the orbit is found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Unpack

import numpy as np

from vibrodrive.model.described import counted
from vibrodrive.model.keywords import Machine, takes
from vibrodrive.model.names import SCENE
from vibrodrive.model.parameters import bad, check_count
from vibrodrive.model.physical import Scene, scene_of
from vibrodrive.model.plan import plan_motion
from vibrodrive.model.slips import names_scene, slip, warn
from vibrodrive.model.states import State
from vibrodrive.periodic.fixed_points import CELL, CERTAIN, ROOT, fixed_points
from vibrodrive.periodic.flight import impacts
from vibrodrive.periodic.impact_map import HORIZON, ImpactMap, spell, states
from vibrodrive.periodic.itineraries import FLOWN, HIGH, LOW, NO_SLIDES, RESTS, cells_of, flights, flying

STABLE, UNSTABLE, SUPERSTABLE, UNDECIDED = "stable", "unstable", "superstable", "undecided"

TOUCHING = "touching"

LEVEL = 1e-7
"""Largest B/A at which an orbit without a rest cannot be distinguished from the touching orbit because of rounding."""

STEEPEST = 1e13
"""Smallest |multiplier| / (B/A) of orbits that are left out, because rounding would determine whether the search finds
them."""

SAME_LAUNCH = 1e-8
"""Launch phases of one orbit that differ by less than SAME_LAUNCH count as equal. Rounding separates equal launch
phases by about 1e-15 A/B. After a period doubling the launch phases of the two halves of the orbit differ by more than
SAME_LAUNCH, unless A differs from the A of the bifurcation by less than 1e-15."""

LONGEST_PERIOD = 100  # in excitation periods; the cost of a search grows at least with the square of the period

MOST_ITINERARIES = 400_000
"""Largest number of itineraries times periods in a search. Such a search takes about ten seconds. Where the motion is
irregular (A > 3.16 at B = 0.1), the number of itineraries grows exponentially with the period. At A = 5 the number
doubles with every period, so this limit allows 14 periods."""

FEW = 4  # largest number of phases in the text of an orbit


def beside(scene: Scene | None) -> str:
    """Return ", a₀ = 0.8 mm, f = 24 Hz", or "" without a scene."""
    if scene is None:
        return ""
    quantities = [(SCENE[name], scene.given[name]) for name in ("a0", "omega0", "frequency") if name in scene.given]
    return "".join(f", {row.symbol} = {value * row.scale:.10g} {row.shown}" for row, value in quantities)


@dataclass(frozen=True, eq=False, repr=False)
class Orbit:
    """One periodic orbit. Motions that differ only by a shift of 1, 2, … excitation periods are the same orbit.

    Attributes
    ----------
    period : period in excitation periods.
    impacts : number of impacts in one period.
    phases, speeds : phase and impact speed |ξ'| of each impact in order, float64 (impacts,), smallest phase
        first.
    gaps : number of excitation periods from each impact to the next, int64 (impacts,).
    multiplier : exact derivative of the map over all impacts of one period; the orbit is stable if |multiplier| < 1.
    kind : "stable", "unstable", "superstable" (the orbit has a rest, at which neighbouring motions merge), "undecided"
        (a fold or period doubling within rounding; the error of the phases may be 1e-7), or "touching" (B = 0: the
        impact has no speed, and the multiplier is NaN).
    word : states of one period, from the state after the first impact on, as text.
    A, B : parameters of the orbit.
    name : words of the flights, each with the number of periods to the next launch. The order of the words does not
        depend on the choice of the first impact. The name is the same for all A up to the next bifurcation.
    scene : machine in SI units, if it was given.
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
    scene: Scene | None = None

    def __repr__(self) -> str:
        phases = ", ".join(f"{phase:.4f}" for phase in self.phases[:FEW]) + (", …" if self.impacts > FEW else "")
        kind = f"{self.kind}, multiplier {self.multiplier:.6g}" if self.multiplier == self.multiplier else self.kind
        place = f"A = {self.A:.10g}, B = {self.B:g}{beside(self.scene)}"
        return f"<Orbit of period {self.period}: {kind}; {counted(self.impacts, 'impact')} at {phases}; {place}>"


@takes(Machine[float])
def orbits(
    written: Mapping[str, Any],
    /,
    A: float | None = None,
    B: float = 0.1,
    max_period: int = 3,
    **quantities: Unpack[Machine[float]],
) -> list[Orbit]:
    """Find all periodic orbits of up to `max_period` excitation periods at ε = 0, ordered by period, impacts and phase.

    The computing time grows with the number of *itineraries*, the possible sequences of states over the periods. A
    search for orbits of up to eight periods takes milliseconds for the parameters of the paper. A search that would
    take more than about ten seconds raises ValueError. For B = 0 there is one orbit at every A > 1, of the kind
    "touching". For 0 < B <= 1e-7 A only an orbit with a rest is listed.

    Parameters
    ----------
    A : float
        excitation amplitude, dimensionless. Required without a scene.
    B : float
        tan α / μ, dimensionless.
    max_period : int
        longest period in excitation periods, 1 to 100.
    **parameters

    Returns
    -------
    list of Orbit
        empty if A <= 1 + B.
        `period` is the period in excitation periods.
        `impacts` is the number of impacts in one period.
        `phases` (rad) and `speeds` (dimensionless) are those of the impacts, each float64 (impacts,).
        `multiplier` is the derivative of the map over one period.
        `kind` is the kind of stability, such as "stable" or "unstable".
        `word` gives the states of one period as text.
        `scene` is the machine, if there is one; ``scene.velocity(speeds)`` is in m/s.

    Raises
    ------
    TypeError, ValueError
        if an argument is not a number or is out of range, or if there are too many itineraries of up to `max_period`
        periods at this A and B.

    Warns
    -----
    UserWarning
        if A and B are probably swapped, or the quantities of a scene not in SI units.

    Examples
    --------
    The stable motion of period 2 in Fig. 4 of the paper, and an unstable motion of period 1 at the same A:

    >>> import vibrodrive as vd
    >>> for orbit in vd.orbits(3.04, max_period=2):
    ...     print(orbit.period, orbit.kind, round(orbit.multiplier, 4), orbit.phases.round(4))
    1 unstable -5.1036 [0.8181]
    2 stable -0.824 [0.474]
    """
    plan = plan_motion(written)
    system, machine = ImpactMap(plan.scalars["A"], plan.scalars["B"]), scene_of(plan.scalars)
    limit = check_period("max_period", max_period)
    if A is not None or names_scene(written, plan):
        warn(slip(plan.ends(), plan.scalars))
    return [replace(orbit, scene=machine) for orbit in orbits_of(system, limit)]


def orbits_of(system: ImpactMap, limit: int) -> list[Orbit]:
    """Return the `orbits` for checked arguments, without a warning."""
    if not system.moves:
        return []
    if system.B == 0.0:
        return [touching_orbit(system)]
    steep = STEEPEST * system.B / system.A
    launched = (o for o in launching(system, limit) if abs(o.multiplier) < steep)
    orbits = [*resting(system, limit), *launched]
    return sorted(orbits, key=lambda o: (o.period, o.impacts, *o.phases))


def check_period(name: str, value: object) -> int:
    """Return the longest period of a search as an int. Raises TypeError or ValueError if `value` is not allowed."""
    return check_count(name, value, 1, LONGEST_PERIOD)


def touching_orbit(system: ImpactMap) -> Orbit:
    """Return the only orbit on the level (B = 0)."""
    return replace(trace_orbit(system, system.touching, 1, True), kind=TOUCHING, multiplier=math.nan)


def resting(system: ImpactMap, limit: int) -> Iterator[Orbit]:
    """Yield the orbit with a rest, if it exists and its period is at most `limit` excitation periods."""
    up = system.window[0]
    _, periods, _, _, n, fate, _ = flights(up, limit + 1, system.A, system.B, limit, NO_SLIDES)
    if fate == RESTS and periods <= limit:
        yield trace_orbit(system, up, n, True)


def cells_to_search(system: ImpactMap, limit: int) -> np.ndarray:
    """Return the `itinerary_cells` for up to `limit` periods. Raises ValueError if too many of them are FLYING."""
    most = MOST_ITINERARIES // limit
    cells = itinerary_cells(system, limit if system.B > LEVEL * system.A else 0, limit, limit=most)
    if flying(cells) > most:
        place = f"A = {system.A!r} and B = {system.B!r}"
        raise ValueError(
            bad("max_period", limit, f"smaller, because more than {most} sequences of states exist at {place}")
        )
    return cells


def itinerary_cells(system: ImpactMap, flown: int, horizon: int, **choice: Any) -> np.ndarray:
    """Return the cells of up to `flown` flights after an impact without a rest; `choice` as in `cells_of`."""
    up, end = system.window
    inside = math.nextafter(up, end), math.nextafter(end, up)
    return cells_of(inside, flown, system.A, system.B, horizon, **choice)


def launching(system: ImpactMap, limit: int) -> Iterator[Orbit]:
    """Yield the orbits without a rest. Each orbit is found in the cell of its smallest launch phase."""
    for launches, certain in returning_launches(system, cells_to_search(system, limit)):
        if launches[0] == min(launches):
            yield trace_orbit(system, launches[0], len(launches), certain)


def returning_launches(system: ImpactMap, cells: np.ndarray, least: int = 1) -> Iterator[tuple[list[float], bool]]:
    """Yield (launches, certain) for every launch phase that returns to itself after n >= `least` flights, not earlier.

    launches : this launch phase and those of the n - 1 flights that follow
    certain : False if rounding determines whether this launch phase exists.
    """
    roots = fixed_points(cells, least, system.A, system.B)
    for row in np.unique(roots[:, CELL]).astype(int).tolist():
        low, high, n = cells[row, LOW], cells[row, HIGH], int(cells[row, FLOWN])
        in_cell = roots[roots[:, CELL] == row]
        for number, (psi, *following) in enumerate(in_cell[:, ROOT : ROOT + n].tolist()):
            # leave out an orbit of fewer impacts, which returns to this root after fewer flights
            if not any(
                abs(p - psi) < SAME_LAUNCH or (low <= p <= high and np.argmin(abs(in_cell[:, ROOT] - p)) == number)
                for p in following
            ):
                yield [psi, *following], bool(in_cell[number, CERTAIN])


def trace_orbit(system: ImpactMap, psi: float, n: int, certain: bool) -> Orbit:
    """Compute the orbit of n impacts through the launch phase `psi`. If not `certain`, its kind is "undecided"."""
    A, B = system.A, system.B
    up, end = system.window
    before = n if psi == up else 0  # impacts until the launch at φ_up follows one, after a rest
    motions, counts = np.empty((before + n, 3)), np.empty((before + n, 2), np.int64)
    impacts(np.array([psi]), A, B, HORIZON, motions, counts)
    phases = np.append(psi, motions[:-1, 0])[before:]
    (_, speeds, slopes), gaps = motions[before:].T, counts[before:, 0]
    words = []
    for phase in phases.tolist():
        rests = not up < phase < end
        words.append([State.REST] * rests + states(up if rests else phase, A, B))
    # exactly 0 if the orbit contains a rest
    multiplier = 0.0 if any(State.REST in word for word in words) else math.prod(slopes.tolist())
    late = (phases >= end).astype(np.int64)
    spans = gaps + np.roll(late, -1) - late  # periods between launches; a rest may begin before 2π and end after 2π
    names = [f"{spell(word)} {span}" for word, span in zip(words, spans, strict=True)]
    first = int(np.argmin(phases))
    words = words[first:] + words[:first]
    return Orbit(
        period=int(gaps.sum()),
        impacts=n,
        phases=np.roll(phases, -first),
        speeds=np.roll(speeds, 1 - first),
        gaps=np.roll(gaps, -first),
        multiplier=multiplier + 0.0,
        kind=kind_of(multiplier) if certain else UNDECIDED,
        word=spell([s for word in words for s in word]),
        A=A,
        B=B,
        name=min(tuple(names[i:] + names[:i]) for i in range(n)),
    )


def kind_of(multiplier: float) -> str:
    """Return the kind of stability of an orbit with this multiplier."""
    if multiplier == 0.0:
        return SUPERSTABLE
    return STABLE if abs(multiplier) < 1.0 else UNSTABLE
