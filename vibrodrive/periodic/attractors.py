"""The attractor of the undisturbed motion over A: the motion out of a rest, followed by the impact-phase map.

Every motion that ever rests goes on from φ_up. If it rests again, it is periodic and superstable from there.
If not, its attractor is that of the flights that follow: a stable orbit, recognised by its return, or none
of short period, for which the mean logarithm of the slopes of the map is given (the Lyapunov exponent, exact but for
the average). A stable orbit that no motion out of a rest leads to is not found in this way; `orbits` finds it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vibrodrive.jit.compile import jit, part
from vibrodrive.jit.slices import in_slices
from vibrodrive.kernels.release import moves, release_up
from vibrodrive.model.parameters import check, check_count
from vibrodrive.periodic.flight import NO_WORD, flight, window_end
from vibrodrive.periodic.impact_map import HORIZON
from vibrodrive.periodic.itineraries import NO_SLIDES

NEVER_LEAVES, SUPERSTABLE, STABLE, IRREGULAR = 0, 1, 2, 3

KINDS = ("never leaves", "superstable", "stable", "irregular")

RETURNED = 1e-10
"""Phases of a return: closer than any two impacts of a short orbit, far above the rounding of one."""

MOST_FLIGHTS = 512
"""Flights of the longest stable orbit that is recognised; a longer one counts as irregular."""


@part
def return_of(psi, A, B, horizon, none, no_slides):
    """(flights, periods) after which a motion is back at ψ; 0 flights if it is not within MOST_FLIGHTS."""
    phase = psi
    periods = 0
    for j in range(MOST_FLIGHTS):
        k, phase, _, _, _, _ = flight(phase, A, B, horizon, none, no_slides)
        if k < 0:
            break
        periods += k
        if abs(phase - psi) < RETURNED:
            return j + 1, periods
    return 0, 0


@jit(_nrt=False)
def follow_rests(A, B, limit, horizon, kind, period, impacts, exponent, flown, no_slides):
    """The attractor for every A (n,), into the arrays behind it (n,); `no_slides` float64 (0, 3)."""
    none = np.int64(NO_WORD)  # a literal would compile another specialisation
    for i in range(len(A)):
        a = A[i]
        kind[i], period[i], impacts[i], exponent[i], flown[i] = NEVER_LEAVES, 0, 0, -math.inf, 0
        if not moves(a, B):
            continue
        kind[i] = IRREGULAR
        up, _ = release_up(a, B)
        end = window_end(up)
        psi = up
        periods = 0
        half_periods = 0
        total = 0.0
        while flown[i] < limit:
            if flown[i] == limit // 2:
                half_periods = periods
                total = 0.0
            k, phase, _, slope, _, _ = flight(psi, a, B, horizon, none, no_slides)
            flown[i] += 1
            if k < 0:
                break
            periods += k
            if phase <= up or phase >= end:
                kind[i], impacts[i] = SUPERSTABLE, flown[i]
                period[i] = periods + (1 if phase >= end else 0)
                break
            total += math.log(-slope) if slope < 0.0 else 0.0
            psi = phase
        if kind[i] == IRREGULAR and flown[i] == limit:
            exponent[i] = total / (periods - half_periods)
            back, span = return_of(psi, a, B, horizon, none, no_slides)
            if back > 0:
                kind[i], impacts[i], period[i] = STABLE, back, span


@dataclass(frozen=True, eq=False)
class Attractors:
    """What the motion from a rest ends in, for each of A (n,).

    kind : index into KINDS, int8.
    period, impacts : of a periodic attractor; 0 for an irregular one.
    exponent : Lyapunov exponent per excitation period; -inf for an attractor that rests.
    flown : flights followed: until the rest, or all.
    limit : flights after which a motion that has not rested was taken never to rest.
    """

    A: np.ndarray
    B: float
    kind: np.ndarray
    period: np.ndarray
    impacts: np.ndarray
    exponent: np.ndarray
    flown: np.ndarray
    limit: int

    def share(self, kind: str) -> float:
        """The share of A with this kind of attractor."""
        return float(np.mean(self.kind == KINDS.index(kind)))


def attractors(A, B: float = 0.1, limit: int = 20_000) -> Attractors:
    """Follow the motion from a rest for up to `limit` flights at each of `A` (one-dimensional).

    Raises
    ------
    TypeError, ValueError
        if an argument is no number or out of range.
    """
    values = np.array([check("A", a) for a in np.atleast_1d(np.asarray(A)).tolist()])
    n = len(values)
    kind, exponent = np.zeros(n, np.int8), np.zeros(n)
    period, impacts, flown = (np.zeros(n, np.int64) for _ in range(3))
    incline, flights = check("B", B), check_count("limit", limit, 2)
    done = 0

    def advance(steps: int) -> bool:
        nonlocal done
        part = slice(done, done + steps)
        out = kind[part], period[part], impacts[part], exponent[part], flown[part]
        follow_rests(values[part], incline, flights, HORIZON, *out, NO_SLIDES)
        done += steps
        return done >= n

    in_slices(advance, first=1)
    return Attractors(values, incline, kind, period, impacts, exponent, flown, flights)
