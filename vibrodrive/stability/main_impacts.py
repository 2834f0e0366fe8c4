"""Comparison of the impacts of a disturbed motion with those of the undisturbed orbit, without a section.

A main impact has no faster impact within half an excitation period before or after it (kernels/record.py). An
n-periodic orbit has m main impacts in n excitation periods. The record of a disturbed motion may contain slower impacts
in addition, the *touches*. The phases and speeds of the main impacts and the *gaps*, which are the integer numbers of
periods between them, form a cycle. A disturbed motion keeps this structure if there is one speed for the entire record
that separates its main impacts from its touches in such a way that

gaps    the main impacts have the gaps of the cycle, in the same cyclic order;
order   the impact of the cycle that is nearest in phase and speed advances by one from each main impact to the next.

Every touch must be slower than `SHARE` times the slowest main impact of the orbit. The separating speed may have any
value below this bound. With a fixed separating speed, a motion would count as lost as soon as one of its impacts became
slower than this speed, even if nothing else changed (docs/stability.md compares a free and a fixed separating
speed).
"""

import math
from typing import NamedTuple

import numpy as np

from vibrodrive.jit.trig import TWO_PI

SHARE = 0.1  # upper limit of the speed of a touch, as a share of the speed of the slowest main impact of the orbit
LONGEST_PERIOD = 64  # a subharmonic of higher order counts as irregular motion

SAME_POINT = 1e-7
"""Largest distance of two points that count as equal: section points, or impacts in phase and speed. This distance is
far above rounding and far below the size of any orbit. Near a bifurcation a motion needs many transient periods until
its points are so close."""

BLURRED = 1e-4
"""Least distance of two different points of an orbit. An orbit with closer points counts as having no period, because
close to a period doubling a transient that alternates about an orbit of period n resembles an orbit of period 2n."""

EDGE = 4
"""Number of periods before the last impact of a beginning that `never_follows` does not use. In its last two periods,
a motion that ends there and one that goes on may differ in the last bits, and the impacts themselves may be later."""

LEAST_BEGINNINGS = 3
"""Least length of a record, in units of the length of the beginning from which `never_follows` judges it."""


class ImpactCycle(NamedTuple):
    """One cycle of the main impacts of a periodic orbit.

    gaps : int64 (m,), periods from each main impact to the next.
    phase, speed : float64 (m,), phase and speed of each main impact.
    """

    gaps: np.ndarray
    phase: np.ndarray
    speed: np.ndarray

    @property
    def n(self) -> int:
        """Period of the orbit in excitation periods."""
        return int(self.gaps.sum())


def impact_gaps(impacts: np.ndarray) -> np.ndarray:
    """Return the gaps between successive impacts (rows of `Trajectory.impacts`): int64 (n - 1,)."""
    periods = np.diff(impacts["period"]) + np.diff(impacts["phase"]) / TWO_PI
    return np.rint(periods).astype(np.int64)


def impact_cycle(impacts: np.ndarray) -> ImpactCycle | None:
    """Return the shortest cycle that the main impacts of an undisturbed motion repeat.

    The result is None if no cycle of up to LONGEST_PERIOD periods repeats, or if a shorter cycle repeats nearly but not
    exactly (BLURRED). The first and the last impact are left out, because a faster impact just outside the record would
    make them touches.
    """
    inner = impacts[1:-1]
    gaps = impact_gaps(inner)
    for m in range(1, len(inner) // 2 + 1):
        phase, speed = (np.abs(inner[name][m:] - inner[name][:-m]) for name in ("phase", "speed"))
        apart = float(np.maximum(np.minimum(phase, TWO_PI - phase), speed).max())
        if (gaps[m:] != gaps[:-m]).any():
            continue
        if apart <= SAME_POINT:
            cycle = ImpactCycle(gaps[:m], inner["phase"][:m].copy(), inner["speed"][:m].copy())
            return cycle if cycle.n <= LONGEST_PERIOD else None
        if apart <= BLURRED:
            return None
    return None


def follow_cycle(
    cycle: ImpactCycle, impacts: np.ndarray, periods: int, ordered: bool = True, share: float = SHARE
) -> np.ndarray | None:
    """Return the indices of impacts of a disturbed motion that follow a cycle; None if no choice of impacts follows it.

    The record covers `periods` excitation periods. Its first and last impact are left out. If `ordered`, the order is
    compared in addition to the gaps. Every touch must be slower than `share` times the slowest impact of the cycle.
    """
    inner, m, n = impacts[1:-1], len(cycle.gaps), cycle.n
    speed = np.ascontiguousarray(inner["speed"])
    least = max(2, int(np.count_nonzero(are_main_impacts(cycle, inner, share))))
    most = min(len(inner), math.ceil(periods * m / n) + m)
    counts = range(max(least, math.floor(periods * m / n) - m - 4), most + 1)
    descending = np.argsort(-speed, kind="stable") if counts and counts[0] < len(inner) else np.empty(0, np.int64)
    for count in counts:
        everything = count == len(inner)
        chosen = np.arange(count) if everything else np.sort(descending[:count])
        if _follows(cycle, inner if everything else inner[chosen], ordered):
            return chosen + 1
    return None


def never_follows(cycle: ImpactCycle, impacts: np.ndarray, periods: int) -> bool:
    """Return True if the beginning of a record proves that `follow_cycle`, with its defaults, finds no choice.

    `impacts` are those of the first `periods` excitation periods of a record that is at least LEAST_BEGINNINGS times as
    long. There are two proofs. (1) Two successive impacts that are too fast to be touches belong to every choice, but
    have another gap or order than the cycle. (2) The motion pauses for longer than any gap, between the first and the
    last impact of every choice. A choice has at least P m/n - m - 5 of the impacts of P periods, and they span all but
    n periods of what so many need. So the first is in the first 2 n + 6 n/m <= 8 n periods, and the last in as many at
    the end. A pause that begins after 8 n is in a beginning only if 8 n is less than its length, and then it ends
    before the last 8 n periods.
    """
    longest, settled = cycle.gaps.max() + 1, 8 * cycle.n
    if len(impacts) == 0:
        return periods - EDGE > settled
    rows = impacts[1:][impacts["period"][1:] < impacts["period"][-1] - EDGE]
    gaps, main = impact_gaps(rows), are_main_impacts(cycle, rows)
    pause = (gaps > longest) & (rows["period"][:-1] > impacts["period"][0] + settled)
    return bool((main[:-1] & main[1:] & _leaves(cycle, rows, gaps) | pause).any())


def fastest(cycle: ImpactCycle, impacts: np.ndarray, periods: int) -> np.ndarray:
    """Return the fastest impacts of a disturbed motion, in order of time.

    Their number is the number of impacts that the cycle has in `periods` excitation periods. If more impacts are too
    fast to be touches, all of these impacts are returned.
    """
    count = max(round(periods * len(cycle.gaps) / cycle.n), int(np.count_nonzero(are_main_impacts(cycle, impacts))))
    return impacts[np.sort(np.argsort(-impacts["speed"], kind="stable")[:count])]


def are_main_impacts(cycle: ImpactCycle, impacts: np.ndarray, share: float = SHARE) -> np.ndarray:
    """Return, for each impact of a disturbed motion, whether it is too fast to be a touch: bool (n,)."""
    return impacts["speed"] > share * cycle.speed.min()


def _follows(cycle: ImpactCycle, impacts: np.ndarray, ordered: bool) -> bool:
    """Return True if all these impacts have the gaps of the cycle and, if `ordered`, the order of the cycle."""
    m, n = len(cycle.gaps), cycle.n
    first, last = impacts[0], impacts[-1]
    span = float(last["period"] - first["period"]) + (last["phase"] - first["phase"]) / TWO_PI
    if abs((len(impacts) - 1) * n / m - span) > n:
        return False
    gaps = impact_gaps(impacts)
    if ordered and m > 1:
        return not _leaves(cycle, impacts, gaps).any()
    cycles = np.tile(cycle.gaps, len(gaps) // m + 2)
    return any((cycles[start : start + len(gaps)] == gaps).all() for start in range(m))


def _leaves(cycle: ImpactCycle, impacts: np.ndarray, gaps: np.ndarray) -> np.ndarray:
    """Return, for each of the `gaps` between successive impacts, whether it or its order differs from the cycle."""
    at = nearest(cycle, impacts)
    return ((np.diff(at) - 1) % len(cycle.gaps) != 0) | (cycle.gaps[at[:-1]] != gaps)


def nearest(cycle: ImpactCycle, impacts: np.ndarray) -> np.ndarray:
    """Return the index of the impact of a cycle nearest to each of `impacts` in phase and speed: int64 (n,)."""
    phase = np.abs(impacts["phase"][:, None] - cycle.phase)
    late, faster = np.minimum(phase, TWO_PI - phase), impacts["speed"][:, None] - cycle.speed
    return (late * late + faster * faster).argmin(axis=1)
