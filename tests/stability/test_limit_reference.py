"""The limit k₂ at three values of A, compared with 50-digit motions on both sides by a criterion without kernels."""

import itertools
import math

import numpy as np
import pytest

from tests.exact.reference import IMPACT, reference
from tests.support.blows import main_impacts
from vibrodrive.stability.limit import limit

TRANSIENT, PERIODS = 10, 40

SHARE = 0.1
"""Largest speed of a touch, as a share of the speed of the slowest main impact of the orbit."""


def landings(A, eps, transient, periods):
    """Return (τ, speed) of each impact without a faster impact within half a period: float64 (n, 2)."""
    switches = [s for s in reference(A, eps=eps, periods=transient + periods).switches if s.after == IMPACT]
    found = main_impacts([(float(s.tau), float(-s.dxi)) for s in switches if s.tau > 2 * math.pi * transient])
    return np.column_stack([2 * math.pi * found["period"] + found["phase"], found["speed"]])


def whole_periods(taus):
    return [round(d / (2 * math.pi)) for d in np.diff(taus)]


def same_landings(orbit, motion):
    """Return True if the impacts of `motion` above some speed have the gaps and the order of the impacts of `orbit`.

    The speed is below SHARE times that of the slowest impact of `orbit`. `orbit` contains at least one cycle of m
    impacts and the next impact.
    """
    m = next(m for m in range(1, len(orbit)) if np.ptp(orbit[::m, 1]) < 1e-7)
    gaps = whole_periods(orbit[: m + 1, 0])
    inner = motion[1:-1]
    bound = SHARE * orbit[:, 1].min()
    for speed in [0.0, *inner[inner[:, 1] < bound, 1]]:
        main = inner[inner[:, 1] > speed]
        at = []
        for tau, v in main:
            turn = [abs(math.remainder(tau - tau0, 2 * math.pi)) for tau0 in orbit[:m, 0]]
            at.append(int(np.argmin([math.hypot(t, v - v0) for t, v0 in zip(turn, orbit[:m, 1], strict=True)])))
        in_order = all(b == (a + 1) % m for a, b in itertools.pairwise(at))
        if in_order and whole_periods(main[:, 0]) == [gaps[a] for a in at[:-1]]:
            return True
    return False


@pytest.mark.jit
@pytest.mark.parametrize("A", [2.4, 3.04, 3.1])
def test_both_sides_of_a_limit_agree_with_50_digits(A):
    found = limit(A, transient=TRANSIENT, periods=PERIODS)
    orbit = landings(A, 0.0, 150, 16)
    assert same_landings(orbit, landings(A, found.kept_below, TRANSIENT, PERIODS))
    assert not same_landings(orbit, landings(A, found.k2, TRANSIENT, PERIODS))
