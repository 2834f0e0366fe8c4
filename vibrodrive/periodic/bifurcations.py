"""Values of A at which a periodic orbit appears, disappears or changes, to the precision of floats.

Flight and launch are defined in flight.py. The multiplier of an orbit is the derivative of the impact-phase map
(impact_map.py) over all impacts of one period.

The orbits at neighbouring values of a grid of A are compared. If they differ, one of the differing orbits is followed
(continuation.py). It is identified by its itinerary, the sequence of its states, so the other orbits are not computed
again. The A at which this orbit ends is bisected to neighbouring floats. The way in which the orbit ends, for example
with a multiplier of -1, determines the kind of the bifurcation. Then the orbits in the rest of the interval are
compared again. So every change between the orbits of two grid points is found. An orbit that exists only between two
grid points is not found. The grid is even up to A = 4. Above A = 4 its spacing is proportional to A, like every other
distance in A (continuation.scale_of). There the grid has about a thousand values between A and e·A.

An orbit can end or change only at one of these conditions:

* A = 1 + B. The mass begins to move (*onset*).
* The multiplier of the orbit is -1 (*period doubling*, possible for an odd number of impacts).
* The multiplier of the orbit is +1 (*fold*, possible for an even number of impacts). At a fold two orbits coincide.
* One impact of the orbit is at a breakpoint of the impact-phase map (impact_map.py). At an end of the window of the map
  a rest appears or vanishes (a border collision, called *border* in files). At another breakpoint the flight after the
  impact just touches the obstacle (*grazing*), or has a sticking of no duration (*stick*). At a stick the word of the
  flight, which is the sequence of its states (flight.py), changes, but the derivative of the map is continuous.

Flights with a launch on one side of a grazing have an impact. Flights with a launch on the other side pass just above
the obstacle. On the side with the impact the map behaves like a square root at the breakpoint. So the slope of the map
and the multiplier of the orbit tend to minus infinity. The launch of the orbit becomes equal to the breakpoint within
float precision long before A reaches the bifurcation. Near the bifurcation the search therefore follows another motion,
on which the touch of the obstacle is an impact (`Continuation._touching`).
"""

from __future__ import annotations

import itertools
import math
import numbers
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Unpack

import numpy as np

from vibrodrive.jit.trig import log
from vibrodrive.kernels.release import moves, onset
from vibrodrive.model.described import counted
from vibrodrive.model.keywords import Axis, Machine, takes
from vibrodrive.model.names import SCENE
from vibrodrive.model.parameters import bad, bad_axes, check, real_number
from vibrodrive.model.physical import AMPLITUDES, INCLINES, Scene, amplitude_axis, scene_of, with_A_and_B
from vibrodrive.model.plan import Plan, make_plan, of_motion
from vibrodrive.model.slips import slip, warn
from vibrodrive.model.spacing import geometric
from vibrodrive.periodic.continuation import DOUBLING, SCALE_FROM, Continuation, scale_of
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.itineraries import flying
from vibrodrive.periodic.search import STABLE, UNSTABLE, Orbit, beside, cells_to_search, check_period, orbits_of

ONSET = "onset"

STEP = 1.0 / 256.0  # default of the largest spacing of the grid of A, in units of `scale_of`
MOST_VALUES = 100_000  # largest number of values of A on a grid whose spacing the caller gives
MOST_WORK = 10_000_000
"""Largest product of two numbers: values of A, and itineraries at the highest A. Such a search takes about an hour."""

# APART and AGAIN are distances in A, in units of `scale_of`.
APART = 1e-10
"""Distance from a bifurcation at which the orbits below and above it are compared. Two bifurcations that are closer to
each other than this distance are reported as one."""

SAME_ORBIT = 1e-3  # largest distance in rad between the impact phases of one orbit below and above a bifurcation

AGAIN = 1e-8
"""Largest distance of two results that count as one bifurcation. A period doubling is found from each of its two
orbits, so there are two results."""


@dataclass(frozen=True, eq=False, repr=False)
class Bifurcation:
    """One value of A at which an orbit appears, disappears or changes.

    Attributes
    ----------
    A, B : excitation amplitude and tan α / μ at the bifurcation.
    kind : "onset", "period doubling", "fold", "border" (a rest appears or vanishes), "grazing" or "stick" (a sticking
        without duration).
    orbit : the orbit that ends or changes. It is computed at the value closest to A at which floats still distinguish
        it from the orbit with which it merges or which it becomes.
    multiplier_below, multiplier_above : multiplier of the orbit a little below A and a little above A (by 1e-10 in
        units of `scale_of`); NaN on a side on which the orbit does not exist.
    scene : machine in SI units at the bifurcation, if it was given.
    """

    A: float
    kind: str
    orbit: Orbit
    multiplier_below: float
    multiplier_above: float
    scene: Scene | None = None

    @property
    def B(self) -> float:
        return self.orbit.B

    @property
    def change(self) -> str:
        """Text with the two periods of a period doubling or, for other kinds, with the multipliers below and above."""
        if self.kind == DOUBLING:
            return f"period {self.orbit.period} to {2 * self.orbit.period}"
        below, above = ("-" if m != m else f"{m + 0.0:.4g}" for m in (self.multiplier_below, self.multiplier_above))
        return f"{below} / {above}"

    def __repr__(self) -> str:
        o, label = self.orbit, "" if self.kind == DOUBLING else "multiplier below / above "
        whose = f"orbit of period {o.period}, {counted(o.impacts, 'impact')}"
        place = f"A = {self.A:.12g}, B = {self.B:g}{beside(self.scene)}"
        return f"<{self.kind} at {place}: {label}{self.change}; {whose}>"


@takes(Machine[Axis])
def bifurcations(
    written: Mapping[str, Any],
    /,
    A: tuple[float, float] = (1.05, 3.25),
    B: float | Sequence[float] | np.ndarray = 0.1,
    max_period: int = 3,
    *,
    step: float | None = None,
    **quantities: Unpack[Machine[Axis]],
) -> list[Bifurcation]:
    """Find all bifurcations between A[0] and A[1] of the orbits of up to `max_period` excitation periods.

    For a machine, two numbers for a0, omega0 or frequency are the range, in place of A; mu or alpha may be a sequence,
    like B.

    For B = 0 there is only one orbit, and it changes at A = √(1 + π²/4). For 0 < B <= 1e-7 A the search follows only
    the orbit with a rest.

    Parameters
    ----------
    A : two floats
        range of the excitation amplitude, dimensionless, the smaller value first.
    B : float, or sequence of float
        tan α / μ, dimensionless. With a sequence, the bifurcations at each of its values; `plot(over=…)` joins them to
        lines over a map.
    max_period : int
        longest period in excitation periods, 1 to 100.
    step : float, optional
        largest spacing of the values of A whose orbits are compared. The default is 1/256 up to A = 4, and A/1024 above
        A = 4.
    **parameters

    Returns
    -------
    list of Bifurcation
        in the order of B (of mu or alpha) and, at each B, of A.
        `A` is the excitation amplitude at the bifurcation.
        `kind` is the kind of the bifurcation, such as "fold" or "period doubling".
        `orbit` is the orbit that ends or changes there.
        `multiplier_below` and `multiplier_above` are the multipliers of the orbit a little below and above `A`.
        `scene` is the machine at the bifurcation, if there is one, with its a0 and frequency.

    Raises
    ------
    TypeError, ValueError
        if an argument is not a number or is out of range, if `step` gives more than 100 000 values of A, or if the
        search would have to examine too many orbits of up to `max_period` periods (see `orbits`).

    Warns
    -----
    UserWarning
        if the quantities of a scene are probably not in SI units.

    Examples
    --------
    The period doubling of the motion of one period:

    >>> import vibrodrive as vd
    >>> for found in vd.bifurcations((2.55, 2.65), max_period=1):
    ...     print(f"{found.kind} at A = {found.A:.10f}")
    period doubling at A = 2.6040806377

    The same bifurcation of a machine, over its frequency in hertz:

    >>> machine = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4)
    >>> (doubling,) = vd.bifurcations(scene=machine, frequency=(21.9, 23), max_period=1)
    >>> round(doubling.scene.frequency, 6)
    21.985888
    """
    all_ways = ways(_plan(of_motion(written), A, B))
    limit = check_period("max_period", max_period)
    if step is not None:
        least = max(max(way.values) - min(way.values) for way in all_ways) / MOST_VALUES
        allowed = f"a number >= {least:.3g}, because at most {MOST_VALUES} values of A are compared"
        if not least <= real_number("step", step, allowed) < math.inf:
            raise ValueError(bad("step", step, allowed))
    if (first := all_ways[0].scene(min(all_ways[0].values))) is not None:
        warn(slip([(A, way.B, 0.0, 1.0) for way in all_ways for A in way.values], first.given))
    return [b for way in all_ways for b in way.bifurcations(limit, step)]


class Way(NamedTuple):
    """Values of A at one B.

    values : values of the axis `over`, which gives A, by A.
    known : with a scene, its other quantities by name.
    """

    B: float
    values: Mapping[float, float]
    over: str
    known: Mapping[str, Any]

    def scene(self, A: float) -> Scene | None:
        """Return the machine at an A; None without a scene."""
        value = self.values.get(A) or amplitude_axis(self.over, A, self.known)
        return scene_of({**self.known, self.over: value})

    def bifurcations(self, limit: int, step: float | None = None) -> list[Bifurcation]:
        """Return the bifurcations between the smallest and the largest A, with their machines."""
        search = Search(self.B, limit)
        return [in_scene(b, self.scene) for b in search.between(min(self.values), max(self.values), step)]


def ways(plan: Plan) -> list[Way]:
    """Return the ways along the axis of a plan that gives A, one at each value of the axis that gives B, if any.

    Raises ValueError for other axes.
    """
    over, along = ([name for name in plan.axes if name in names] for names in (AMPLITUDES, INCLINES))
    if len(over) != 1 or len(along) != len(plan.axes) - 1 or len(along) > 1:
        first, second = (", ".join(names) for names in (AMPLITUDES, INCLINES))
        raise ValueError(bad_axes(plan.axes, f"one of {first}, alone or with one of {second}"))
    (name,), made = over, []
    for incline in [{along[0]: value} for value in plan.axes[along[0]].tolist()] if along else [{}]:
        known = {**plan.scalars, **incline}
        points = with_A_and_B({**known, name: plan.axes[name]})
        values = dict(zip(points["A"].tolist(), plan.axes[name].tolist(), strict=True))
        made.append(Way(points["B"], values, name, known))
    return made


def _plan(arguments: Mapping[str, Any], A: Any, B: Any) -> Plan:
    """Return the plan with a range as its axis of A. `arguments` are those that give A, B and a scene."""
    if not {"scene", *SCENE} & arguments.keys():
        return make_plan({"A": check_range("A", A), "B": B})
    over = [name for name in AMPLITUDES if name in arguments and not isinstance(arguments[name], numbers.Real)]
    if len(over) != 1:
        needed = f"one of {', '.join(AMPLITUDES[1:])} as a range (low, high), in which bifurcations are found"
        raise TypeError(f"range = {', '.join(over) or 'none'}: must be {needed}")
    return make_plan({**arguments, over[0]: check_range(over[0], arguments[over[0]])})


def in_scene(bifurcation: Bifurcation, scene: Callable[[float], Scene | None]) -> Bifurcation:
    """Return a bifurcation with the machine at its A."""
    orbit = replace(bifurcation.orbit, scene=scene(bifurcation.orbit.A))
    return replace(bifurcation, scene=scene(bifurcation.A), orbit=orbit)


def check_range(name: str, value: Any) -> tuple[float, float]:
    """Return the ends (low, high) of a range as floats. Raises TypeError or ValueError for invalid values."""
    allowed = "two numbers in ascending order"
    try:
        first, last = value
    except (TypeError, ValueError):
        raise TypeError(bad(name, value, allowed)) from None
    low, high = check(name, first), check(name, last)
    if not low < high:
        raise ValueError(bad(name, (first, last), allowed))
    return low, high


def spread(low: float, high: float, step: float | None) -> np.ndarray:
    """Return values of A from low to high, whose spacing is at most `step`.

    If `step` is None, the spacing near A is at most STEP × scale_of(A).
    """
    if step is not None:
        return np.linspace(low, high, 1 + math.ceil((high - low) / step))
    turn = min(max(low, SCALE_FROM), high)
    near = np.linspace(low, turn, 1 + math.ceil((turn - low) / STEP))
    # a constant ratio makes the spacing proportional to A
    far = geometric(turn, high, 1 + math.ceil(log(high / turn) * SCALE_FROM / STEP))
    return np.append(near, far[1:])


class Search:
    """One search for bifurcations of orbits of up to `limit` periods at one B, and the bifurcations found so far."""

    def __init__(self, B: float, limit: int):
        self.B, self.limit = B, limit
        self.found: list[Bifurcation] = []

    def orbits(self, A: float) -> list[Orbit]:
        return orbits_of(ImpactMap(A, self.B), self.limit)

    def between(self, low: float, high: float, step: float | None) -> list[Bifurcation]:
        least = onset(self.B)
        if not moves(high, self.B):
            return []
        begin = min(least + APART * scale_of(least), high)
        starts = low < least
        low = max(low, begin)
        grid = spread(low, high, step).tolist()
        self.check_effort(high, len(grid))
        below = self.orbits(grid[0])
        if starts:
            self.found += [Bifurcation(least, ONSET, o, math.nan, o.multiplier) for o in below]
        for a, b in itertools.pairwise(grid):
            above = self.orbits(b)
            self.find_between(a, below, b, above)
            below = above
        return sorted(self.found, key=lambda f: f.A)

    def check_effort(self, high: float, values: int) -> None:
        """Raise ValueError if a search at so many values of A would take too long.

        The number of itineraries at the highest A is used for all values of A.
        """
        itineraries = flying(cells_to_search(ImpactMap(high, self.B), self.limit))
        if itineraries * values > MOST_WORK:
            work = f"{itineraries} sequences of states at each of {values} values of A are more than {MOST_WORK} in all"
            raise ValueError(bad("max_period", self.limit, f"smaller, or the range of A shorter, because {work}"))

    def find_between(self, a: float, below: Sequence[Orbit], b: float, above: Sequence[Orbit]) -> None:
        """Add to `found` the bifurcations between a, with the orbits `below`, and b, with the orbits `above`."""
        waiting = [(a, below, b, above)]
        while waiting:
            a, below, b, above = waiting.pop()
            change = self.change(a, below, b, above)
            if change is None:
                continue
            A, kind, last, orbit = change
            apart = APART * scale_of(A)
            first, last = min(A, last) - apart, max(A, last) + apart
            before, after = self.orbits(first), self.orbits(last)
            if not any(f.kind == kind and abs(f.A - A) < AGAIN * scale_of(A) for f in self.found):
                sides = _multiplier(orbit, before), _multiplier(orbit, after)
                self.found.append(Bifurcation(A, kind, orbit, *sides))
            if last < b:
                waiting.append((last, after, b, above))
            if first > a:
                waiting.append((a, below, first, before))

    def change(
        self, a: float, below: Sequence[Orbit], b: float, above: Sequence[Orbit]
    ) -> tuple[float, str, float, Orbit] | None:
        """Return (A, kind, last, orbit) of one bifurcation between a and b; None if no bifurcation is found.

        A, kind : value of A and kind of the bifurcation.
        last : last A at which floats distinguish the orbit from the orbit with which it merges or which it becomes. If
            an orbit only changes its stability, `last` is A.
        orbit : for a period doubling, the orbit at A that doubles; otherwise the orbit at `last`. If this orbit is not
            found, it is replaced by the same orbit at a or b.
        """
        for ends, below_only in _ending(below, above):
            branch = Continuation.of(ends)
            inside, outside = (a, b) if below_only else (b, a)
            if len(branch.starts(inside)) <= len(branch.starts(outside)):
                continue  # the orbit is so close to the end of its interval that rounding determines its itinerary
            A, kind, last = branch.end(inside, outside)
            orbit = (branch.parent.orbit(A) if kind == DOUBLING else None) or branch.orbit(last)
            return A, kind, last, orbit or ends
        if (changing := _changing(below, above)) is not None:
            branch = Continuation.of(changing)
            A = branch.doubling(a, b)
            return A, DOUBLING, A, branch.orbit(A) or changing
        return None


def _ending(below: Sequence[Orbit], above: Sequence[Orbit]) -> Iterator[tuple[Orbit, bool]]:
    """Yield (orbit, True) if its name is more frequent in `below`, and (orbit, False) if more frequent in `above`."""
    count = Counter(o.name for o in below)
    count.subtract(o.name for o in above)
    for side, sign in ((below, 1), (above, -1)):
        for orbit in side:
            if sign * count[orbit.name] > 0:
                yield orbit, side is below


def _changing(below: Sequence[Orbit], above: Sequence[Orbit]) -> Orbit | None:
    """Return an orbit of `below` that is stable on one side and unstable on the other side; None if there is none."""
    kinds = {(o.name, o.kind) for o in above}
    opposite = {STABLE: UNSTABLE, UNSTABLE: STABLE}
    changed = (o for o in below if (o.name, o.kind) not in kinds and (o.name, opposite.get(o.kind)) in kinds)
    return next(changed, None)


def _multiplier(orbit: Orbit, orbits: Sequence[Orbit]) -> float:
    """Return the multiplier of the same orbit in `orbits`; NaN if this orbit is missing there.

    It is an orbit of equal period whose phases differ by less than SAME_ORBIT, if possible with the same name.
    """
    near = [o for o in orbits if o.period == orbit.period and gap_between(orbit, o) < SAME_ORBIT]
    same = min(near, key=lambda o: (o.name != orbit.name, gap_between(orbit, o)), default=None)
    return same.multiplier if same else math.nan


def gap_between(a: Orbit, b: Orbit) -> float:
    """Return the largest distance, in rad, from an impact phase of one orbit to the closest one of the other orbit.

    The maximum is taken over the impacts of the orbit with fewer impacts.
    """
    few, many = sorted((a.phases, b.phases), key=len)
    apart = abs(few[:, None] - many[None, :])
    return float(np.minimum(apart, 2.0 * math.pi - apart).min(axis=1).max())
