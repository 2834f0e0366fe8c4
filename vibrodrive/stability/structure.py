"""Orbital structure: three properties and a distance that replace the visual comparison of the paper (§1, §4).

A disturbed motion is compared with the undisturbed n-periodic orbit at the same parameters:

impacts  the main impacts of the motion have the gaps and the order of the orbit's main impacts (main_impacts.py)
gaps     the integer numbers of periods between main impacts are the same in the motion and in the orbit
order    the section point of the orbit that is nearest to the motion advances by one, cyclically, every period
ρ        the largest distance between the section points of the motion and of the orbit, for the best phase shift

Impacts and gaps do not depend on the section. Order depends on the phase of the section: near an impact the
section points jump, and disturbed points that overlap at one phase may be separate at another phase. Order and ρ follow
from section points, so they can be computed from stored results. The other properties need the impacts of a trajectory,
because two successive section points do not show whether the mass has landed between them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

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
    """

    points: np.ndarray
    cycle: ImpactCycle | None

    @property
    def n(self) -> int:
        return len(self.points)


@dataclass(frozen=True)
class Structure:
    """Result of the comparison of a motion with an orbit of period n.

    impacts, gaps, order : True if the motion keeps this property.
    rho : largest distance between the section points of the motion and of the orbit, for the best phase shift.
    shift : this phase shift in excitation periods.
    """

    n: int
    impacts: bool
    gaps: bool
    order: bool
    rho: float
    shift: int


def period(section: np.ndarray) -> np.ndarray:
    """Return the smallest n after which the section points (…, periods, 2) of each motion repeat: int64 (…).

    The result is 0 if there is no such n up to LONGEST_PERIOD. The record must contain at least two periods of the
    motion, and the points within a period must be further apart than BLURRED.
    """
    section = np.asarray(section, dtype=np.float64)
    periods = np.zeros(section.shape[:-2], dtype=np.int64)
    settled = np.ones(section.shape[:-2], dtype=bool)
    for n in range(1, min(LONGEST_PERIOD, section.shape[-2] // 2) + 1):
        apart = np.abs(section[..., n:, :] - section[..., :-n, :]).max(axis=(-2, -1))
        repeats = apart <= SAME_POINT
        periods = np.where((periods == 0) & settled & repeats, n, periods)
        settled &= repeats | (apart > BLURRED)
    return periods


def reference_orbit(motion: Any) -> ReferenceOrbit | None:
    """Return the periodic orbit that a motion has settled on, or None if the motion does not repeat.

    The period is the period of the impacts or, if the mass never lands, of the section.
    """
    cycle = impact_cycle(motion.impacts)
    n = cycle.n if cycle is not None else 0 if len(motion.impacts) else int(period(motion.section))
    if n == 0 or 2 * n > len(motion.section):
        return None
    return ReferenceOrbit(np.array(motion.section[-n:]), cycle)


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
    largest = np.stack([distance[..., k, (k + s) % n].max(axis=-1) for s in range(n)], axis=-1)
    shift = largest.argmin(axis=-1)
    rho = np.take_along_axis(largest, shift[..., None], axis=-1)[..., 0]
    return np.where(_finite(section), rho, np.inf), shift


def compare_structure(base: ReferenceOrbit, motion: Any) -> Structure:
    """Compare a motion, which has the section and the impacts of a Trajectory, with an orbit."""
    rho, shift = deviation(base.points, motion.section)
    return Structure(
        len(base.points),
        impacts=keeps(base, motion.section, motion.impacts),
        gaps=keeps(base, motion.section, motion.impacts, ordered=False),
        order=bool(order(base.points, motion.section)),
        rho=float(rho),
        shift=int(shift),
    )


def keeps(base: ReferenceOrbit, section: np.ndarray, impacts: np.ndarray, ordered: bool = True) -> bool:
    """Return True if a motion keeps the main impacts of an orbit: their gaps and, if `ordered`, their order."""
    if not _finite(section):
        return False
    if base.cycle is None:  # the mass never lands
        return len(impacts) == 0
    return follow_cycle(base.cycle, impacts, len(section), ordered) is not None


def _distances(points: np.ndarray, section: np.ndarray) -> np.ndarray:
    return np.linalg.norm(section[..., :, None, :] - points, axis=-1)


def _finite(section: np.ndarray) -> np.ndarray:
    return np.isfinite(section).all(axis=(-2, -1))
