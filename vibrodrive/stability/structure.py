"""Orbital structure: three yes/no answers and a distance, where the paper judges by eye (§1, §4).

A disturbed motion is compared with the undisturbed n-periodic orbit at the same parameters:

order   the section point nearest to it advances by one, cyclically, every period
gaps    its major impacts are the same whole numbers of periods apart
word    it passes the same states between major impacts
ρ       the largest distance of its section points from the orbit's, best phase shift

Order, ρ and the period follow from section points, so from stored results. Gaps and word need the switches
of a trajectory: a section point doesn't show whether the mass has landed since the last one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from vibrodrive.model.states import State

LONGEST_PERIOD = 64
"""Longest period looked for: subharmonics of higher order are not distinguished from irregular motion."""

SAME_POINT = 1e-7
"""Section points this close are the same point: far above rounding, far below the width of any orbit;
near a bifurcation a motion needs many transient periods to come so close."""

BLURRED = 1e-4
"""An orbit with points closer than this is not given a period: beside a period doubling a motion that still
jumps to and fro about an orbit of period n looks like one of period 2n."""

MAJOR = 0.1
"""An impact counts if it is faster than this share of the undisturbed orbit's fastest: a disturbance adds
touches of the obstacle that change nothing."""


@dataclass(frozen=True, eq=False)
class ReferenceOrbit:
    """The undisturbed orbit.

    points : float64 (n, 2), section points ξ, ξ' in visiting order
    speed : largest impact speed, 0 if the mass never lands
    gaps : periods between successive major impacts, one cycle
    word : states between successive major impacts, one cycle of tuples
    """

    points: np.ndarray
    speed: float
    gaps: tuple[int, ...]
    word: tuple[tuple[State, ...], ...]

    @property
    def n(self) -> int:
        return len(self.points)


@dataclass(frozen=True)
class Structure:
    """How a motion compares with an orbit of period n. None: cannot be decided from the data given."""

    n: int
    order: bool
    gaps: bool | None
    word: bool | None
    rho: float
    shift: int

    def kept(self, criterion: Sequence[str]) -> bool:
        """Whether every answer named in `criterion` is yes."""
        return all(getattr(self, name) for name in criterion)


def period(section: np.ndarray, longest: int = LONGEST_PERIOD, close: float = SAME_POINT) -> np.ndarray:
    """Smallest n after which all section points (…, periods, 2) repeat, 0 if there is none up to `longest`.

    A period is claimed only if it is seen twice, and if its points are further apart than BLURRED.
    Returns int64 (…).
    """
    section = np.asarray(section, dtype=np.float64)
    found = np.zeros(section.shape[:-2], dtype=np.int64)
    settled = np.ones(section.shape[:-2], dtype=bool)
    for n in range(1, min(longest, section.shape[-2] // 2) + 1):
        apart = np.abs(section[..., n:, :] - section[..., :-n, :]).max(axis=(-2, -1))
        repeats = apart <= close
        found = np.where((found == 0) & settled & repeats, n, found)
        settled &= repeats | (apart > BLURRED)
    return found


def reference_orbit(trajectory: Any, longest: int = LONGEST_PERIOD, close: float = SAME_POINT) -> ReferenceOrbit | None:
    """The periodic orbit a Trajectory has settled on, or None if it has not repeated."""
    n = int(period(trajectory.section, longest, close))
    if n == 0:
        return None
    speed = float(-impacts(trajectory.switches)["dxi"].min(initial=0.0))
    return ReferenceOrbit(
        points=np.array(trajectory.section[-n:]),
        speed=speed,
        gaps=_cycle(gaps(trajectory.switches, speed)),
        word=_cycle(words(trajectory.switches, speed)),
    )


def order(points: np.ndarray, section: np.ndarray) -> np.ndarray:
    """Whether the nearest of `points` (n, 2) to section (…, periods, 2) advances by one: bool (…)."""
    nearest = _distances(points, section).argmin(axis=-1)
    return (np.diff(nearest, axis=-1) % len(points) == 1 % len(points)).all(axis=-1) & _finite(section)


def deviation(points: np.ndarray, section: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """ρ = max_k |x_k − p_(k+s mod n)| at its best shift s, and that s: float64 (…) and int64 (…).

    s tells the n coexisting solutions apart: they are one orbit, shifted by whole excitation periods.
    """
    n = len(points)
    distance = _distances(points, section)
    k = np.arange(section.shape[-2])
    each = np.stack([distance[..., k, (k + s) % n].max(axis=-1) for s in range(n)], axis=-1)
    shift = each.argmin(axis=-1)
    rho = np.take_along_axis(each, shift[..., None], axis=-1)[..., 0]
    return np.where(_finite(section), rho, np.inf), shift


def impacts(switches: np.ndarray) -> np.ndarray:
    """The switches into IMPACT; their `dxi` is the impact velocity."""
    return switches[switches["after"] == State.IMPACT]


def major(switches: np.ndarray, speed: float) -> np.ndarray:
    """The impacts faster than MAJOR times `speed`."""
    landed = impacts(switches)
    return landed[-landed["dxi"] > MAJOR * speed]


def gaps(switches: np.ndarray, speed: float) -> np.ndarray:
    """Excitation periods between successive major impacts, rounded, zeros dropped: int64 array."""
    landed = major(switches, speed)
    whole = np.rint(np.diff(landed["period"]) + np.diff(landed["phase"]) / (2 * np.pi)).astype(np.int64)
    return whole[whole > 0]


def words(switches: np.ndarray, speed: float) -> list[tuple[State, ...]]:
    """States entered from one major impact up to the next, a tuple for each pair of successive ones."""
    after = switches["after"]
    starts = np.flatnonzero((after == State.IMPACT) & (-switches["dxi"] > MAJOR * speed))
    return [tuple(State(s) for s in after[a:b]) for a, b in pairwise(starts)]


def repeats(sequence: Sequence[Any], cycle: Sequence[Any]) -> bool:
    """Whether `sequence` is a piece of `cycle` repeated without end."""
    if len(cycle) == 0 or len(sequence) == 0:
        return len(cycle) == len(sequence)
    count = len(sequence)
    return any(all(sequence[k] == cycle[(k + s) % len(cycle)] for k in range(count)) for s in range(len(cycle)))


def compare_structure(undisturbed: Any, disturbed: Any) -> Structure:
    """Hold a disturbed motion against the undisturbed one.

    Parameters
    ----------
    undisturbed : Orbit, Trajectory, or section points float64 (periods, 2)
    disturbed : Trajectory, or section points float64 (periods, 2)
        from section points alone only order and ρ are known; gaps and word are None.

    Raises
    ------
    ValueError
        if the undisturbed motion has no period.
    """
    base = _as_reference(undisturbed)
    section = np.asarray(getattr(disturbed, "section", disturbed), dtype=np.float64)
    if section.ndim != 2 or section.shape[1] != 2:
        raise ValueError(f"section of shape {section.shape}: must be (periods, 2), one motion at a time")
    rho, shift = deviation(base.points, section)
    whole = base if isinstance(base, ReferenceOrbit) and hasattr(disturbed, "sample") else None
    return Structure(
        n=len(base.points),
        order=bool(order(base.points, section)),
        gaps=keeps(whole, disturbed, ("gaps",)) if whole else None,
        word=keeps(whole, disturbed, ("word",)) if whole else None,
        rho=float(rho),
        shift=int(shift),
    )


def keeps(base: ReferenceOrbit, motion: Any, criterion: Sequence[str]) -> bool:
    """Whether a Trajectory keeps all that `criterion` names; no more is looked at than that."""
    answers: dict[str, Callable[[], bool]] = {
        "order": lambda: bool(order(base.points, motion.section)),
        "gaps": lambda: repeats(gaps(motion.switches, base.speed).tolist(), base.gaps),
        "word": lambda: repeats(words(motion.switches, base.speed), base.word),
    }
    return all(answers[name]() for name in criterion)


@dataclass(frozen=True)
class _Points:
    points: np.ndarray


def _as_reference(undisturbed: Any) -> ReferenceOrbit | _Points:
    if isinstance(undisturbed, ReferenceOrbit):
        return undisturbed
    if hasattr(undisturbed, "sample"):
        found = reference_orbit(undisturbed)
        if found is not None:
            return found
        n = 0
    else:
        section = np.asarray(getattr(undisturbed, "section", undisturbed), dtype=np.float64)
        n = int(period(section))
    if n == 0:
        raise ValueError("the undisturbed motion has no period: there is no structure to keep")
    return _Points(np.array(section[-n:]))


def _cycle(sequence: Any) -> tuple[Any, ...]:
    """Shortest cycle of which `sequence` is a piece, from its first element on."""
    items = list(sequence.tolist() if isinstance(sequence, np.ndarray) else sequence)
    for n in range(1, len(items) + 1):
        if all(items[k] == items[k % n] for k in range(len(items))):
            return tuple(items[:n])
    return ()


def _distances(points: np.ndarray, section: np.ndarray) -> np.ndarray:
    return np.linalg.norm(section[..., :, None, :] - points, axis=-1)


def _finite(section: np.ndarray) -> np.ndarray:
    return np.isfinite(section).all(axis=(-2, -1))
