"""Orbital structure: four properties and a distance that replace the visual comparison of the paper (§1, §4).

A disturbed motion is compared with the undisturbed n-periodic orbit at the same parameters:

impacts  the main impacts of the motion have the gaps and the order of the orbit's main impacts (main_impacts.py)
gaps     the integer numbers of periods between main impacts are the same in the motion and in the orbit
order    the section point of the orbit that is nearest to the motion advances by one, cyclically, every period
word     the motion passes through the same states between its main impacts
ρ        the largest distance between the section points of the motion and of the orbit, for the best phase shift

Impacts, gaps and word do not depend on the section. Order depends on the phase of the section: near an impact the
section points jump, and disturbed points that overlap at one phase may be separate at another phase. Order and ρ follow
from section points, so they can be computed from stored results. The other properties need the impacts of a trajectory,
because two successive section points do not show whether the mass has landed between them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from vibrodrive.model.states import State
from vibrodrive.stability.main_impacts import (
    BLURRED,
    LONGEST_PERIOD,
    SAME_POINT,
    ImpactCycle,
    follow_cycle,
    impact_cycle,
)

SETTLING = 20_000  # least transient of an undisturbed motion in periods; near a bifurcation a motion settles slowly
WATCHED = 256  # recorded periods of an undisturbed motion: four times the longest period (LONGEST_PERIOD)


@dataclass(frozen=True, eq=False)
class ReferenceOrbit:
    """The undisturbed orbit.

    points : float64 (n, 2), section points ξ, ξ' in order of time
    cycle : main impacts, None if the mass never lands
    word : one cycle of the states between successive main impacts, a tuple for each gap
    """

    points: np.ndarray
    cycle: ImpactCycle | None
    word: tuple[tuple[State, ...], ...] = ()

    @property
    def n(self) -> int:
        return len(self.points)


@dataclass(frozen=True)
class Structure:
    """Result of the comparison of a motion with an orbit of period n.

    impacts, gaps, order, word : True if the motion keeps this property; `word` is None if its switches are not known.
    rho : largest distance between the section points of the motion and of the orbit, for the best phase shift.
    shift : this phase shift in excitation periods.
    """

    n: int
    impacts: bool
    gaps: bool
    order: bool
    word: bool | None
    rho: float
    shift: int


def period(section: np.ndarray) -> np.ndarray:
    """Return the smallest n after which the section points (…, periods, 2) of each motion repeat: int64 (…).

    The result is 0 if there is no such n up to LONGEST_PERIOD. The record must contain at least two periods of the
    motion, and the points within a period must be further apart than BLURRED.
    """
    section = np.asarray(section, dtype=np.float64)
    found = np.zeros(section.shape[:-2], dtype=np.int64)
    settled = np.ones(section.shape[:-2], dtype=bool)
    for n in range(1, min(LONGEST_PERIOD, section.shape[-2] // 2) + 1):
        apart = np.abs(section[..., n:, :] - section[..., :-n, :]).max(axis=(-2, -1))
        repeats = apart <= SAME_POINT
        found = np.where((found == 0) & settled & repeats, n, found)
        settled &= repeats | (apart > BLURRED)
    return found


def reference_orbit(motion: Any) -> ReferenceOrbit | None:
    """Return the periodic orbit that a motion has settled on, or None if the motion does not repeat.

    The word is empty for a motion without `switches`. The period is the period of the impacts or, if the mass never
    lands, of the section.
    """
    cycle = impact_cycle(motion.impacts)
    n = cycle.n if cycle is not None else 0 if len(motion.impacts) else int(period(motion.section))
    if n == 0 or 2 * n > len(motion.section):
        return None
    switches = getattr(motion, "switches", None)
    word = _cycle(words(switches, motion.impacts["row"])) if switches is not None else ()
    return ReferenceOrbit(np.array(motion.section[-n:]), cycle, word)


def order(points: np.ndarray, section: np.ndarray) -> np.ndarray:
    """Return True if the point of `points` (n, 2) nearest to each section point advances by one every period: bool (…).

    section : float64 (…, periods, 2).
    """
    nearest = _distances(points, section).argmin(axis=-1)
    return (np.diff(nearest, axis=-1) % len(points) == 1 % len(points)).all(axis=-1) & _finite(section)


def deviation(points: np.ndarray, section: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (ρ, s): the least ρ = max_k |x_k − p_(k+s mod n)|, and its shift s; float64 (…) and int64 (…).

    `points` (p) has the shape (n, 2), `section` (x) the shape (…, periods, 2). The shift s identifies one of the n
    coexisting solutions, which are the same orbit shifted by s excitation periods.
    """
    n = len(points)
    distance = _distances(points, section)
    k = np.arange(section.shape[-2])
    each = np.stack([distance[..., k, (k + s) % n].max(axis=-1) for s in range(n)], axis=-1)
    shift = each.argmin(axis=-1)
    rho = np.take_along_axis(each, shift[..., None], axis=-1)[..., 0]
    return np.where(_finite(section), rho, np.inf), shift


def words(switches: np.ndarray, rows: np.ndarray) -> list[tuple[State, ...]]:
    """Return the states from each impact to the next, a tuple each. `rows` are the indices of impacts in `switches`."""
    after = switches["after"]
    return [tuple(State(s) for s in after[a:b]) for a, b in pairwise(rows)]


def repeats(sequence: Sequence[Any], cycle: Sequence[Any]) -> bool:
    """Return True if `sequence` is a part of the infinite repetition of `cycle`."""
    if len(cycle) == 0 or len(sequence) == 0:
        return len(cycle) == len(sequence)
    count = len(sequence)
    return any(all(sequence[k] == cycle[(k + s) % len(cycle)] for k in range(count)) for s in range(len(cycle)))


def compare_structure(base: ReferenceOrbit, motion: Any) -> Structure:
    """Compare a motion, which has the section, impacts and switches of a Trajectory, with an orbit.

    If the orbit has no word, the switches are not needed, and `word` of the result is None.
    """
    section, impacts = motion.section, motion.impacts
    rho, shift = deviation(base.points, section)
    return Structure(
        len(base.points),
        impacts=keeps(base, section, impacts, ("impacts",)),
        gaps=keeps(base, section, impacts, ("gaps",)),
        order=bool(order(base.points, section)),
        word=keeps(base, section, impacts, ("word",), motion.switches) if base.word else None,
        rho=float(rho),
        shift=int(shift),
    )


def keeps(
    base: ReferenceOrbit,
    section: np.ndarray,
    impacts: np.ndarray,
    criterion: Sequence[str],
    switches: np.ndarray | None = None,
) -> bool:
    """Return True if a motion keeps all properties named in `criterion`. Other properties are not computed.

    The property "word" needs `switches`.
    """

    def landing(ordered: bool) -> np.ndarray | None:
        if base.cycle is None:  # the mass never lands
            return np.empty(0, np.int64) if len(impacts) == 0 else None
        return follow_cycle(base.cycle, impacts, len(section), ordered)

    def same_word() -> bool:
        rows = landing(False)
        assert switches is not None, "the criterion word needs the switches"
        return rows is not None and repeats(words(switches, impacts["row"][rows]), base.word)

    answers: dict[str, Callable[[], bool]] = {
        "impacts": lambda: landing(True) is not None,
        "gaps": lambda: landing(False) is not None,
        "order": lambda: bool(order(base.points, section)),
        "word": same_word,
    }
    return bool(_finite(section)) and all(answers[name]() for name in criterion)


def _cycle(sequence: Sequence[Any]) -> tuple[Any, ...]:
    """Return the shortest cycle that begins with the first element of `sequence` and whose repetition contains it."""
    cycles = (tuple(sequence[:n]) for n in range(1, len(sequence) + 1))
    return next((cycle for cycle in cycles if repeats(sequence, cycle)), ())


def _distances(points: np.ndarray, section: np.ndarray) -> np.ndarray:
    return np.linalg.norm(section[..., :, None, :] - points, axis=-1)


def _finite(section: np.ndarray) -> np.ndarray:
    return np.isfinite(section).all(axis=(-2, -1))
