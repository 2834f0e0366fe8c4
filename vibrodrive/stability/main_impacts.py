"""Whether a disturbed motion lands as the undisturbed orbit does: order judged at the impacts, on no section.

An n-periodic orbit has m main impacts (kernels/record.py) in n excitation periods, at known phases and speeds and
known whole numbers of periods apart: a cycle. A disturbed motion keeps this structure if there is a speed, the same for
its whole record, that divides its main impacts from its touches such that

gaps    the former are the same whole numbers of periods apart, cyclically;
order   the one of the m that is nearest in phase and speed advances by one from each of them to the next.

Touches are slower than `SHARE` of the orbit's slowest main impact. That the dividing speed is not prescribed beneath
that bound is what makes the answer independent of it: with a given one, every motion is lost in which some impact comes
out slower, though nothing else happened (docs/stability.md has both tables).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vibrodrive.jit.trig import TWO_PI

SHARE = 0.1  # a touch is slower than this share of the speed of the orbit's slowest main impact
LONGEST_PERIOD = 64  # looked for: subharmonics of higher order are not distinguished from irregular motion

SAME_POINT = 1e-7
"""Points (of a section, or impacts in phase and speed) this close are the same: far above rounding, far below
the width of any orbit; near a bifurcation a motion needs many transient periods to come so close."""

BLURRED = 1e-4
"""An orbit with points closer than this is not given a period: beside a period doubling a motion that still
jumps to and fro about an orbit of period n looks like one of period 2n."""


class ImpactCycle(NamedTuple):
    """The main impacts of a periodic orbit, one cycle: `gaps` int64 (m,), periods from each to the next; phase, speed
    float64 (m,)."""

    gaps: np.ndarray
    phase: np.ndarray
    speed: np.ndarray

    @property
    def n(self) -> int:
        """The orbit's period in excitation periods."""
        return int(self.gaps.sum())


def impact_gaps(impacts: np.ndarray) -> np.ndarray:
    """Whole excitation periods between successive impacts (rows of `Trajectory.impacts`): int64 (n - 1,)."""
    periods = np.diff(impacts["period"]) + np.diff(impacts["phase"]) / TWO_PI
    return np.rint(periods).astype(np.int64)


def impact_cycle(impacts: np.ndarray) -> ImpactCycle | None:
    """The shortest cycle that the main impacts of an undisturbed motion repeat, or None.

    The first and the last are left out: which impact is main may be decided outside of the record.
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
    """Numbers of the main impacts, among those of a disturbed motion, that follow a cycle; None if none do.

    The first and the last are left out. `ordered`: order is asked for, not gaps alone.
    """
    inner, m, n = impacts[1:-1], len(cycle.gaps), cycle.n
    speed = np.ascontiguousarray(inner["speed"])
    least = max(2, int(np.count_nonzero(no_touches(cycle, inner, share))))
    most = min(len(inner), math.ceil(periods * m / n) + m)
    for count in range(max(least, math.floor(periods * m / n) - m - 4), most + 1):
        chosen = np.sort(np.argsort(-speed, kind="stable")[:count]) if count < len(inner) else np.arange(count)
        if _follows(cycle, inner[chosen], ordered):
            return chosen + 1
    return None


def fastest(cycle: ImpactCycle, impacts: np.ndarray, periods: int) -> np.ndarray:
    """The fastest impacts of a disturbed motion, in order: as many as the cycle has in so many excitation periods, and
    all that are no touches."""
    count = max(round(periods * len(cycle.gaps) / cycle.n), int(np.count_nonzero(no_touches(cycle, impacts))))
    return impacts[np.sort(np.argsort(-impacts["speed"], kind="stable")[:count])]


def no_touches(cycle: ImpactCycle, impacts: np.ndarray, share: float = SHARE) -> np.ndarray:
    """Which of the impacts of a disturbed motion are too fast for touches: bool (n,)."""
    return impacts["speed"] > share * cycle.speed.min()


def _follows(cycle: ImpactCycle, impacts: np.ndarray, ordered: bool) -> bool:
    """Whether all of these impacts, in turn, are those of a cycle."""
    m = len(cycle.gaps)
    first, last = impacts[0], impacts[-1]
    span = float(last["period"] - first["period"]) + (last["phase"] - first["phase"]) / TWO_PI
    if abs((len(impacts) - 1) * cycle.n / m - span) > cycle.n:
        return False
    gaps = impact_gaps(impacts)
    steps = np.arange(len(gaps))
    if ordered and m > 1:
        at = nearest(cycle, impacts)
        return bool((np.diff(at) % m == 1).all() and (cycle.gaps[at[:-1]] == gaps).all())
    return any((cycle.gaps[(steps + start) % m] == gaps).all() for start in range(m))


def nearest(cycle: ImpactCycle, impacts: np.ndarray) -> np.ndarray:
    """Which impact of a cycle is nearest to each of `impacts`, in phase and speed: int64 (n,)."""
    phase = np.abs(impacts["phase"][:, None] - cycle.phase)
    return np.hypot(np.minimum(phase, TWO_PI - phase), impacts["speed"][:, None] - cycle.speed).argmin(axis=1)
