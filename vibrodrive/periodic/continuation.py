"""Continuation of one orbit in A, up to its end. The orbit is identified by its itinerary (itineraries.py).

Other terms: flight, launch and φ_up (flight.py), breakpoint of the impact-phase map (impact_map.py), kinds of
bifurcations and multiplier (bifurcations.py).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vibrodrive.jit.trig import TWO_PI, TWO_PI_LOW
from vibrodrive.periodic.flight import NO_WORD, flight
from vibrodrive.periodic.impact_map import ImpactMap, kind_of_change, states
from vibrodrive.periodic.itineraries import NO_SLIDES, flights
from vibrodrive.periodic.search import Orbit, itinerary_cells, returning_launches, touching_orbit, trace_orbit

DOUBLING, FOLD, BORDER_COLLISION, GRAZING, STICK = "period doubling", "fold", "border", "grazing", "stick"

ON_BREAKPOINT = 1e-7  # an orbit ends at a breakpoint if, at its last A, a launch phase is closer to it than this (rad)
FIRST_STEP = 1e-9  # first step in A of a search that starts at a bifurcation, in units of `scale_of`
ASTRAY = 1e-4  # largest distance in A of this search from the bifurcation, in units of `scale_of`
SCALE_FROM = 4.0  # smallest A from which on distances in A are proportional to A, like the spacing of floats


def scale_of(A: float) -> float:
    """Return the unit of distances in A: 1 up to A = SCALE_FROM, and A / SCALE_FROM for a larger A."""
    return max(1.0, A / SCALE_FROM)


def is_doubled(orbit: Orbit) -> bool:
    """Return True if both halves of the orbit have equal words and equal numbers of periods between launches."""
    half = orbit.impacts // 2
    return orbit.name[:half] == orbit.name[half:]


@dataclass(frozen=True)
class Continuation:
    """An orbit as a function of A, identified by its number of impacts, its period and its itinerary.

    rests : True if the orbit contains a rest.
    itinerary : the itineraries of the first flight, of the first two flights and so on, as numbers (`flights`).
    doubled : True if both halves of the orbit have the same states (`is_doubled`).
    """

    B: float
    impacts: int
    period: int
    rests: bool
    itinerary: tuple[int, ...]
    doubled: bool

    @classmethod
    def of(cls, orbit: Orbit) -> Continuation:
        """Return the continuation of an orbit that is known at one A."""
        n = orbit.impacts
        rests = "REST" in orbit.word.split()
        start = ImpactMap(orbit.A, orbit.B).window[0] if rests else float(orbit.phases[0])
        itinerary = tuple(flights(start, k, orbit.A, orbit.B, orbit.period, NO_SLIDES)[0] for k in range(1, n + 1))
        return cls(orbit.B, n, orbit.period, rests, itinerary, is_doubled(orbit))

    @property
    def parent(self) -> Continuation:
        """Continuation of the orbit with half as many impacts, whose states a `doubled` orbit contains twice."""
        half = self.impacts // 2
        return Continuation(self.B, half, self.period // 2, False, self.itinerary[:half], False)

    def starts(self, A: float) -> list[list[float]]:
        """Return the launch phases of each orbit with this itinerary at A. It is φ_up for an orbit with a rest."""
        system = ImpactMap(A, self.B)
        if not system.moves:
            return []
        if self.rests:
            up = system.window[0]
            code = flights(up, self.impacts, A, self.B, self.period, NO_SLIDES)[0]  # with REST at its end
            return [[up]] if code == self.itinerary[-1] else []
        cells = itinerary_cells(system, self.impacts, self.period, only=self.itinerary)
        return [launches for launches, _ in returning_launches(system, cells, self.impacts)]

    def orbit(self, A: float) -> Orbit | None:
        """Return the orbit of `starts` at A with the least |multiplier|; None if there is no orbit."""
        system = ImpactMap(A, self.B)
        if system.moves and system.B == 0.0:
            return touching_orbit(system)
        orbits = [trace_orbit(system, launches[0], self.impacts, True) for launches in self.starts(A)]
        return min(orbits, key=lambda o: abs(o.multiplier), default=None)

    def multiplier(self, A: float) -> float:
        """Return the multiplier of the first orbit of `starts` at A; NaN if there is no orbit."""
        launches = self.starts(A)
        return flights(launches[0][0], self.impacts, A, self.B, self.period, NO_SLIDES)[3] if launches else math.nan

    def doubling(self, a: float, b: float) -> float:
        """Return the A between a and b at which the multiplier passes -1. The orbit must exist at a and b."""
        stable = abs(self.multiplier(a)) < 1.0
        return bisect(lambda A: (abs(self.multiplier(A)) < 1.0) == stable, a, b)[0]

    def end(self, inside: float, outside: float) -> tuple[float, str, float]:
        """Return (A, kind, last) of the bifurcation between two values of A.

        There must be more orbits of this itinerary at `inside` than at `outside`. `last` is the last A at which floats
        can distinguish the orbit from the orbit with which it merges or which it becomes.
        """
        count = len(self.starts(inside))
        last, beyond = bisect(lambda A: len(self.starts(A)) >= count, inside, outside)
        if self.rests:
            return last, self._change(last, beyond), last
        distance, kind, launch = self._closest_to_breakpoint(last)
        if distance < ON_BREAKPOINT:
            return self._touching(last, launch) if kind == GRAZING else last, kind, last
        if self.doubled and (sides := self._across(last)):
            return self.parent.doubling(*sides), DOUBLING, last
        return last, FOLD, last

    def _change(self, last: float, beyond: float) -> str:
        """Return the kind of the bifurcation of an orbit with a rest between two neighbouring values of A."""
        inner, outer = ImpactMap(last, self.B), ImpactMap(beyond, self.B)
        psi, phi = inner.window[0], outer.window[0]
        for _ in range(self.impacts):
            before, after = states(psi, inner.A, inner.B), states(phi, outer.A, outer.B)
            if before != after:
                return kind_of_change(before, after)
            psi, phi = float(inner(psi).phase), float(outer(phi).phase)
        return BORDER_COLLISION

    def _closest_to_breakpoint(self, A: float) -> tuple[float, str, float]:
        """Return (distance, kind, launch) for the launch that is closest to a breakpoint of the map.

        `distance` is that of the launch from the breakpoint, and `kind` is the kind of bifurcation at this breakpoint.
        """
        system = ImpactMap(A, self.B)
        points, kinds, _ = system.pieces(self.period)
        return min(
            (abs(psi - point), BORDER_COLLISION if kind == "rest" else kind, psi)
            for launches in self.starts(A)
            for psi in launches
            for point, kind in zip(points.tolist(), kinds, strict=True)
        )

    def _across(self, A: float) -> tuple[float, float] | None:
        """Return two values of A between which the multiplier of `parent` passes -1; None if it does not near A."""
        step = FIRST_STEP * scale_of(A)
        while step < ASTRAY * scale_of(A):
            a, b = A - step, A + step
            if (self.parent.multiplier(a) + 1.0) * (self.parent.multiplier(b) + 1.0) < 0.0:
                return a, b
            step *= 4.0
        return None

    def _touching(self, A: float, launch: float) -> float:
        """Return the amplitude near A at which the flight with a launch near `launch` just touches the obstacle.

        On the side with the impact, the distance of the launch from its breakpoint falls as the square of the distance
        in A from the bifurcation. So this distance is below float precision long before A reaches the bifurcation. The
        orbit on which the touch is an impact is smooth in A. This function follows that orbit instead.
        """

        def residual(a: float) -> float:
            if not abs(a - A) < ASTRAY * scale_of(A):
                return math.nan
            system = ImpactMap(a, self.B)
            points, kinds, _ = system.pieces(self.period)
            grazings = [p for p, kind in zip(points.tolist(), kinds, strict=True) if kind == GRAZING]
            if not grazings:
                return math.nan
            point = min(grazings, key=lambda p: abs(p - launch))
            landed = flight(point, a, self.B, self.period, NO_WORD, NO_SLIDES)[5]
            slides = np.full((landed, 3), math.nan)
            flight(math.nextafter(point, 0.0), a, self.B, self.period, NO_WORD, slides)
            tau, h, _ = slides[-1].tolist()
            impact = (tau + h - TWO_PI) - TWO_PI_LOW
            return flights(impact, self.impacts - 1, a, self.B, self.period, NO_SLIDES)[2] - point

        touched = secant(residual, A, A + FIRST_STEP * scale_of(A))
        return A if math.isnan(residual(touched)) else touched


def bisect(holds: Callable[[float], bool], good: float, bad: float) -> tuple[float, float]:
    """Return neighbouring floats (last, beyond) between `good` and `bad`; `holds` is True only at `last`."""
    while True:
        middle = 0.5 * (good + bad)
        if middle in (good, bad):
            return good, bad
        if holds(middle):
            good = middle
        else:
            bad = middle


def secant(f: Callable[[float], float], a: float, b: float) -> float:
    """Return a zero of a smooth function f by the secant method. The first two points are a and b.

    The search ends when the steps no longer become smaller.
    """
    fa, fb = f(a), f(b)
    last = math.inf
    while fa != fb:
        step = fb * (b - a) / (fb - fa)
        if not abs(step) < last:
            break
        a, fa, last = b, fb, abs(step)
        b -= step
        fb = f(b)
    return b
