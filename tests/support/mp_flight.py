"""Impacts, orbits and derivatives d(time of impact)/d(phase of an earlier impact) in 50 digits, without kernels."""

from typing import Any, NamedTuple

from tests.exact.reference import DOWN, IMPACT, REST, STICK, UP, mp, reference

NAMES = {UP: "UP", DOWN: "DOWN", STICK: "STICK", REST: "REST", IMPACT: "IMPACT"}

DIGITS = 50

SMALL = 1e-12  # step of a central difference: its error, of second order, is far below the tolerance of comparisons


class Landing(NamedTuple):
    """Next impact: phase (mpf), periods up to the impact, velocity ξ' (mpf), and the states before it as text."""

    phase: Any
    periods: int
    velocity: Any
    word: str


def next_impact(A: float, B: float, phi: Any, patience: int = 64) -> Landing:
    """Return the next impact after an impact at the phase φ (float or mpf)."""
    periods = 2
    while True:
        switches = reference(A, B, tau0=phi, periods=periods).switches
        if any(s.after == IMPACT for s in switches):
            break
        periods *= 2
        assert periods <= patience, "no impact"
    word = []
    for s in switches:
        word.append(NAMES[s.before])
        if s.after == IMPACT:
            return Landing(s.phase, s.period, s.dxi, " ".join([*word, "IMPACT"]))
    raise AssertionError


def after(A: float, B: float, phi: Any, n: int) -> Any:
    """Return 2π × periods + phase of the n-th impact after an impact at the phase φ."""
    periods = 0
    for _ in range(n):
        landing = next_impact(A, B, phi)
        phi = landing.phase
        periods += landing.periods
    return 2 * mp.pi * periods + phi


@mp.workdps(DIGITS)
def slope(A: float, B: float, phi: float, n: int = 1) -> Any:
    """Return d(time of the n-th impact)/dφ by a central difference."""
    step = mp.mpf(SMALL)
    return (after(A, B, phi + step, n) - after(A, B, phi - step, n)) / (2 * step)


@mp.workdps(DIGITS)
def orbit_phase(A: float, B: float, near: float, n: int, period: int) -> Any:
    """Return the phase near `near` that returns to itself after n impacts and `period` periods (secant method)."""
    turn = 2 * mp.pi * period
    a, b = mp.mpf(near), mp.mpf(near) + mp.mpf(SMALL)
    fa, fb = after(A, B, a, n) - turn - a, after(A, B, b, n) - turn - b
    for _ in range(6):
        if fb == fa:
            break
        a, fa, b = b, fb, b - fb * (b - a) / (fb - fa)
        fb = after(A, B, b, n) - turn - b
        if abs(b - a) < mp.mpf(10) ** -30:
            break
    return b
