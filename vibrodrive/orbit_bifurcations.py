"""Values of A at which a periodic orbit is born, dies or changes, to the last digits.

Orbits are compared on a grid of A. Where the orbits of two neighbours differ, one that differs is followed by
its itinerary, which needs no search, and the A at which it ends is bisected to neighbouring floats. What
ends it names the kind, and the rest of the interval is compared again. So every change that shows between
grid points is found; an orbit that is born and dies between two of them is not.

An orbit can end, or change, only where

* A = 1 + B: the mass begins to move (*onset*);
* its multiplier is -1 (*period doubling*; odd number of impacts) or +1 (*fold*; even number, two orbits
  meet);
* one of its impacts falls on a breakpoint of the impact-phase map: on an end of the window, so that a rest
  appears or vanishes (*border*), or on a launch whose flight just touches the obstacle (*grazing*), or on one
  with a sticking of no duration (*stick*: the word changes, the derivative of the map is continuous there).

Where an orbit grazes on the side of the impact its multiplier tends to minus infinity as a square root, and
its launch comes closer to the breakpoint than floats can tell long before A does. There the orbit is
followed with the impact at the touching itself.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vibrodrive.orbit_cells import NOTHING, RESTS, flights
from vibrodrive.orbit_map import ImpactMap
from vibrodrive.orbit_path import DOUBLING, Path
from vibrodrive.orbit_search import Orbit, orbits
from vibrodrive.parameters import bad, check, check_count

ONSET = "onset"

STEP = 1.0 / 256.0
"""Spacing of the grid of A at most, where the caller says nothing."""

FINER = 32
"""How many times finer the orbit that rests is looked at. Windows in which it has a short period are the
narrowest things between 3.15 and 3.19, and most other orbits are born and die at their ends."""

APART = 1e-10
"""How far from a bifurcation the orbits on either side are taken; two closer ones are reported as one."""

MEET = 1e-3
"""Phases of one orbit on both sides of a bifurcation, APART from it, differ by less than this."""

AGAIN = 1e-8
"""A bifurcation of one kind found twice (a doubling, seen by both orbits) is found within this."""


@dataclass(frozen=True, eq=False)
class Bifurcation:
    """One value of A at which an orbit is born, dies or changes.

    Attributes
    ----------
    A, B : where.
    kind : "onset", "period doubling", "fold", "border", "grazing" or "stick" (see the head of this module).
    orbit : the orbit, as close to A as floats tell it from what it ends in.
    multiplier_below, multiplier_above : its multiplier a little below and above A; NaN where there is no such
        orbit.
    """

    A: float
    kind: str
    orbit: Orbit
    multiplier_below: float
    multiplier_above: float

    @property
    def B(self) -> float:
        return self.orbit.B


def bifurcations(
    A: tuple[float, float] = (1.05, 3.25), B: float = 0.1, max_period: int = 3, *, step: float = STEP
) -> list[Bifurcation]:
    """Every bifurcation between A[0] and A[1] of the orbits of up to `max_period` excitation periods, by A.

    `step` is the spacing at most of the values of A whose orbits are compared (see the head of this module).

    Raises
    ------
    TypeError, ValueError
        if an argument is no number or out of range.
    """
    low, high = (check("A", a) for a in A)
    incline = check("B", B)
    limit = check_count("max_period", max_period, 1)
    if not low < high:
        raise ValueError(bad("A", tuple(A), "two numbers, the smaller one first"))
    if not 0.0 < step < math.inf:
        raise ValueError(bad("step", step, "a number > 0"))
    return _Search(incline, limit).between(low, high, step)


class _Search:
    """One search: what is fixed, and what has been found."""

    def __init__(self, B: float, limit: int):
        self.B = B
        self.limit = limit
        self.found: list[Bifurcation] = []

    def orbits(self, A: float) -> list[Orbit]:
        return orbits(A, self.B, self.limit)

    def between(self, low: float, high: float, step: float) -> list[Bifurcation]:
        onset = 1.0 + self.B
        if high <= onset:
            return []
        if low < onset:
            low = onset + APART
            born = self.orbits(low)
            self.found += [Bifurcation(onset, ONSET, o, math.nan, o.multiplier) for o in born]
        even = np.linspace(max(low, onset + APART), high, 1 + math.ceil((high - low) / step))
        grid = np.union1d(even, self.changes_of_rest(even[0], high, step / FINER)).tolist()
        below = self.orbits(grid[0])
        for a, b in itertools.pairwise(grid):
            above = self.orbits(b)
            self.compare(a, below, b, above)
            below = above
        return sorted(self.found, key=lambda f: f.A)

    def changes_of_rest(self, low: float, high: float, step: float) -> list[float]:
        """Neighbours on a fine grid of A between which the orbit that rests changes: found at no cost."""
        fine = np.linspace(low, high, 1 + math.ceil((high - low) / step)).tolist()
        names = [_name_of_rest(a, self.B, self.limit) for a in fine]
        return [a for i, pair in enumerate(itertools.pairwise(names)) if pair[0] != pair[1] for a in fine[i : i + 2]]

    def compare(self, a: float, below: Sequence[Orbit], b: float, above: Sequence[Orbit]) -> None:
        """Find what happens between a and b, whose orbits are `below` and `above`."""
        if (ends := _that_ends(below, above)) is not None:
            path = Path.of(ends)
            lives_below = any(o is ends for o in below)
            where, kind, last = path.end(*((a, b) if lives_below else (b, a)))
            orbit = path.parent.orbit(where) if kind == DOUBLING else path.orbit(last)
        elif (turns := _that_turns(below, above)) is not None:
            path = Path.of(turns)
            where = last = path.doubling(a, b)
            kind, orbit = DOUBLING, path.orbit(where)
        else:
            return
        first, last = min(where, last) - APART, max(where, last) + APART
        before, after = self.orbits(first), self.orbits(last)
        if not any(f.kind == kind and abs(f.A - where) < AGAIN for f in self.found):
            self.found.append(Bifurcation(where, kind, orbit, _multiplier(orbit, before), _multiplier(orbit, after)))
        if first > a:
            self.compare(a, below, first, before)
        if last < b:
            self.compare(last, after, b, above)


def _name_of_rest(A: float, B: float, limit: int) -> int:
    """The itinerary of the orbit that rests, 0 if it has a longer period."""
    up = ImpactMap(A, B).window[0]
    itinerary, _, _, _, _, fate, _ = flights(up, limit, A, B, limit, NOTHING)
    return itinerary if fate == RESTS else 0


def _that_ends(below: Sequence[Orbit], above: Sequence[Orbit]) -> Orbit | None:
    """An orbit on one side that is not on the other, by name."""
    count = Counter(o.name for o in below)
    count.subtract(o.name for o in above)
    for side, sign in ((below, 1), (above, -1)):
        for orbit in side:
            if sign * count[orbit.name] > 0:
                return orbit
    return None


def _that_turns(below: Sequence[Orbit], above: Sequence[Orbit]) -> Orbit | None:
    """An orbit of both sides that is stable on one only."""
    kinds = Counter((o.name, o.kind) for o in above)
    return next((o for o in below if not kinds[o.name, o.kind]), None)


def _multiplier(orbit: Orbit, others: Sequence[Orbit]) -> float:
    """The multiplier of what `orbit` is among others: of its period, and close. NaN if it is none of them."""
    near = [o for o in others if o.period == orbit.period and gap_between(orbit, o) < MEET]
    same = min(near, key=lambda o: (o.name != orbit.name, gap_between(orbit, o)), default=None)
    return same.multiplier if same else math.nan


def gap_between(one: Orbit, other: Orbit) -> float:
    """How far the impacts of the orbit with fewer are from impacts of the other, at most, in phase."""
    few, many = sorted((one.phases, other.phases), key=len)
    apart = abs(few[:, None] - many[None, :])
    return float(np.minimum(apart, 2.0 * math.pi - apart).min(axis=1).max())
