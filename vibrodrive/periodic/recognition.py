"""Recognition of the condition that a bifurcation satisfies, from the slides of its orbit.

The search for bifurcations reports the orbit on one side of the bifurcation, at a small distance in A. At the end of
each slide of this orbit a decision is made between reversal, sticking, impact and rest. Each decision that is close to
a change gives a candidate condition (conditions.py). A candidate is the condition of the bifurcation if its equations
have a solution at the A that the search found. The orbits on both sides of a bifurcation give the same condition,
because an impact that only touches the obstacle is not counted if the motion continues without a rest.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from vibrodrive.jit.trig import TWO_PI
from vibrodrive.periodic.bifurcations import Bifurcation
from vibrodrive.periodic.conditions import Condition, Slide, newton
from vibrodrive.periodic.continuation import BORDER_COLLISION, DOUBLING, FOLD, GRAZING, STICK, is_doubled, scale_of
from vibrodrive.periodic.flight import FROM_GROUND, FROM_REVERSAL, FROM_STICK, NO_WORD, flight
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.itineraries import NO_SLIDES
from vibrodrive.periodic.search import Orbit
from vibrodrive.periodic.tracing import ROUNDING

SAME = 1e-9  # largest distance in A of a solution from the bifurcation that the search found, in units of `scale_of`

CLOSE = 0.05
"""Largest distance of a decision from its change (the difference of |H| from 1, or ξ, or |ξ'|), in units of `scale_of`.
Near a grazing this distance grows as the square root of the distance in A from the bifurcation."""


class Part(NamedTuple):
    """One slide of an orbit.

    falls : True for a slide down.
    begun : kind of beginning, as in `conditions.Slide`.
    begin, end : times of the beginning and the end, from τ = 0.
    lands : True if the slide ends at the obstacle.
    gap : ξ at the end.
    speed : impact speed |ξ'| if the slide lands, otherwise 0.
    """

    falls: bool
    begun: int
    begin: float
    end: float
    lands: bool
    gap: float
    speed: float


def recognise(found: Bifurcation) -> tuple[Condition, np.ndarray] | None:
    """Return (condition, solution) for a bifurcation; None if no candidate has a solution at this bifurcation."""
    A, B = found.A, found.B
    solved = []
    for condition, ends in candidates(found.kind, found.orbit):
        row = np.zeros(len(ends) + 2)
        row[-1] = 1.0
        u = newton(condition, np.array([*ends, A, B]), row, B)
        if u is None or not abs(u[-2] - A) < SAME * scale_of(A):
            continue
        least = min(m.value for m in condition.margins(u))
        if least > -ROUNDING:
            solved.append((least > 0.0, -len(condition.slides), condition, u))
    if not solved:
        return None
    return max(solved, key=lambda s: s[:2])[2:]


def candidates(kind: str, orbit: Orbit) -> Iterator[tuple[Condition, list[float]]]:
    """Yield (condition, ends) for each condition of this kind that the orbit almost satisfies.

    `ends` are the times at which the slides end. The condition that the orbit satisfies best comes first.
    """
    rests = "REST" in orbit.word.split()
    parts = parts_of(orbit, rests)
    force = [orbit.A * math.sin(p.end) - orbit.B for p in parts]
    if kind in (DOUBLING, FOLD):
        doubled = is_doubled(orbit)
        if kind == DOUBLING and doubled:
            yield _prescribed(kind, parts[: len(parts) // 2], False, -1, orbit, orbit.period // 2)
        else:
            yield _prescribed(kind, parts, False, -1, orbit, orbit.period, doubled)
        return
    if kind == BORDER_COLLISION:
        distance = [abs(f - 1.0) if p.lands else math.inf for p, f in zip(parts, force, strict=True)]
        build = _border
    elif kind == STICK:
        distance = [
            math.inf if p.lands else abs(f - 1.0 if p.falls else f + 1.0) for p, f in zip(parts, force, strict=True)
        ]
        build = _stick
    else:
        distance = [min(abs(p.gap), p.speed) if p.falls else math.inf for p in parts]
        build = _grazing
    for i in sorted(range(len(parts)), key=distance.__getitem__):
        if distance[i] < CLOSE * scale_of(orbit.A):
            yield from build(parts, i, rests, orbit)


def parts_of(orbit: Orbit, rests: bool) -> list[Part]:
    """Return the slides of one period, with times from τ = 0. If there is a rest, the first slide follows it."""
    A, B = orbit.A, orbit.B
    psi = ImpactMap(A, B).window[0] if rests else float(orbit.phases[0])
    at = psi
    parts: list[Part] = []
    for _ in range(orbit.impacts):
        count = flight(psi, A, B, orbit.period, NO_WORD, NO_SLIDES)[5]
        slides = np.full((count, 3), math.nan)
        _, landed, velocity, _, _, _ = flight(psi, A, B, orbit.period, NO_WORD, slides)
        falls, gap = True, 0.0
        for k, (tau, h, begun) in enumerate(slides.tolist()):
            if k == 0:
                begin, falls = at, False
            elif begun == FROM_STICK:
                begin = tau + TWO_PI * math.ceil((at - tau) / TWO_PI - 1e-9)
                falls = tau > 0.5 * math.pi
            else:
                begin, falls = at, not falls
            at = begin + h
            sigma = -1.0 if falls else 1.0
            gap += A * (math.cos(begin) * h - math.sin(at) + math.sin(begin)) - 0.5 * (B + sigma) * h * h
            lands = k == count - 1
            how = FROM_STICK if k == 0 and not parts and rests else int(begun)
            parts.append(Part(falls, how, begin, at, lands, gap, -velocity if lands else 0.0))
        psi = landed
    return parts


def _prescribed(
    kind: str, parts: Sequence[Part], rests: bool, critical: int, orbit: Orbit, period: int, doubled: bool = False
) -> tuple[Condition, list[float]]:
    """Return (condition, ends): `ends` are the times at which the slides end. The first launch is in period 0."""
    turn = TWO_PI * math.floor(parts[0].begin / TWO_PI)
    up = math.asin(min(1.0, (1.0 + orbit.B) / orbit.A))
    down = math.pi + math.asin((1.0 - orbit.B) / orbit.A)
    slides = []
    for p in parts:
        turns = round((p.begin - turn - (down if p.falls else up)) / TWO_PI) if p.begun == FROM_STICK else 0
        slides.append(Slide(p.falls, p.begun, turns, p.lands))
    return Condition(kind, tuple(slides), period, rests, critical, doubled), [p.end - turn for p in parts]


def _rotated(parts: Sequence[Part], first: int, orbit: Orbit) -> list[Part]:
    """Return the slides of one period that begins with the slide at index `first` of `parts`."""
    span = TWO_PI * orbit.period
    wrapped = [p._replace(begin=p.begin + span, end=p.end + span) for p in parts[:first]]
    return [*parts[first:], *wrapped]


def _border(parts: Sequence[Part], i: int, rests: bool, orbit: Orbit) -> Iterator[tuple[Condition, list[float]]]:
    """Yield the condition of a border collision by which a rest after slide i appears or vanishes.

    The period begins after the rest of the orbit or, if the orbit has no rest, after slide i.
    """
    there = list(parts[: i + 1])
    if not rests:
        first, *others = _rotated(parts, i + 1, orbit)
        there = [first._replace(begun=FROM_STICK), *others]
    # the period ends with the rest after the last slide
    period = math.ceil((there[-1].end - there[0].begin) / TWO_PI - 1e-2)
    yield _prescribed(BORDER_COLLISION, there, True, len(there) - 1, orbit, period)


def _stick(parts: Sequence[Part], i: int, rests: bool, orbit: Orbit) -> Iterator[tuple[Condition, list[float]]]:
    there = list(parts)
    following = (i + 1) % len(parts)
    there[following] = there[following]._replace(begun=FROM_STICK)
    yield _prescribed(STICK, there, rests, i, orbit, orbit.period)


def _grazing(parts: Sequence[Part], i: int, rests: bool, orbit: Orbit) -> Iterator[tuple[Condition, list[float]]]:
    there = list(parts)
    there[i] = there[i]._replace(lands=False)
    n = len(parts)
    if rests and i == n - 1:
        return
    following = (i + 1) % n
    if there[following].begun == FROM_GROUND:
        there[following] = there[following]._replace(begun=FROM_REVERSAL)
    if rests:
        yield _prescribed(GRAZING, there, True, i, orbit, orbit.period)
        return
    landings = [k for k, p in enumerate(there) if p.lands]
    if landings:
        turned = _rotated(there, (landings[-1] + 1) % n, orbit)
        where = (i - landings[-1] - 1) % n
        yield _prescribed(GRAZING, turned, False, where, orbit, orbit.period)
