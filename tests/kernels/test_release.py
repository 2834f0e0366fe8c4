"""Phases φ_up and φ_down, at which waits end because H rises to 1 or falls to -1.

Kernels and the impact-phase map use the same formulas, which are exact to two units in the last place.
"""

import math

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.reference import mp
from vibrodrive.kernels.release import moves, onset, release_down, release_up
from vibrodrive.model.states import State
from vibrodrive.periodic.flight import FROM_STICK, NO_WORD, flight
from vibrodrive.periodic.impact_map import ImpactMap


def places(seed: int, n: int) -> np.ndarray:
    """Return n pairs (A, B) with A > 1 + B, half of them with B > 1, as an array (n, 2)."""
    rng = np.random.default_rng(seed)
    B = np.where(rng.random(n) < 0.5, rng.uniform(0.0, 1.0, n), 10.0 ** rng.uniform(0.0, 3.0, n))
    return np.column_stack(((1.0 + B) * (1.0 + 10.0 ** rng.uniform(-3.0, 2.0, n)), B))


def waits_end(A: float, B: float) -> tuple[float, float]:
    """Return (up, down): the phases at which a stick that begins at H = 0 ends if H rises, and if H falls."""
    middle = math.asin(B / A)
    up, down = (
        vd.simulate(A=A, B=B, xi0=1.0, tau0=start, transient=0, periods=1).switches[0]
        for start in (middle, math.pi - middle)
    )
    assert (up["before"], up["after"]) == (State.STICK, State.UP)
    assert (down["before"], down["after"]) == (State.STICK, State.DOWN)
    return float(up["phase"]), float(down["phase"])


@pytest.mark.jit
def test_engine_and_map_agree_to_the_bit():
    """φ_down also agrees for B > 1, where the last bit was once different."""
    seen = 0
    for A, B in places(1, 2000).tolist():
        ends = waits_end(A, B)
        assert ends == (release_up(A, B)[0], release_down(A, B)[0])
        slides = np.full((16, 3), np.nan)
        flight(ends[0], A, B, 4, NO_WORD, slides)
        assert slides[0, 0] == ends[0]
        if slides[1, 2] == FROM_STICK:
            assert slides[1, 0] == ends[1]
            seen += B > 1.0
    assert seen > 50


@pytest.mark.jit
def test_mass_moves_from_the_onset():
    """At A = 1 + B static friction just holds the mass. At the next larger A the mass moves, also in `simulate`."""
    for B in (0.0, 0.1, 0.99, 1.0, 3.7):
        assert not moves(onset(B), B)
        least = float(np.nextafter(onset(B), np.inf))
        assert moves(least, B)
        assert np.ptp(ImpactMap(least, B).window) > 2e-8, "there are floats inside of every window"
        below, above = (vd.simulate(A=onset(B) * (1 + d), B=B, transient=0, periods=2) for d in (-1e-6, 1e-6))
        assert below.status == vd.Status.NEVER_LEAVES
        assert State.UP in above.switches["after"]


def test_release_agrees_with_fifty_digits():
    """Both phases, and A cos φ there, are exact to two units in the last place."""
    with mp.workdps(50):
        for A, B in places(3, 2000).tolist():
            a, b = mp.mpf(A), mp.mpf(B)
            up, down = mp.asin((1 + b) / a), mp.pi + mp.asin((1 - b) / a)
            found = np.array([*release_up(A, B), *release_down(A, B)])
            exact = [up, a * mp.cos(up), down, a * mp.cos(down)]
            apart = [float(abs(x - y)) for x, y in zip(found.tolist(), exact, strict=True)]
            assert (apart <= np.spacing(np.abs(found)) * 2.0).all(), (A, B)
