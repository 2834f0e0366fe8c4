"""The limit B → ∞: the completely inelastic bouncing ball (A. Mehta, J. M. Luck, Phys. Rev. Lett. 65, 393, 1990).

The ball falls under gravity onto a vibrating table, and its impacts are plastic. Its only parameter Γ is the ratio of
the largest acceleration of the table to gravity. Here gravity along the incline is B, in units of the friction, and the
largest acceleration is A. So Γ = A/B, and the ratio of friction to gravity is δ = 1/B. With ξ = B y the slides are

    y'' = Γ sin τ - 1 - δ  (up),    y'' = Γ sin τ - 1 + δ  (down),

and sticking, which requires |Γ sin τ - 1| <= δ, lasts for a time of order δ at most. For δ = 0 these are the equations
of the ball, where τ is the phase of the table.

**The ball.** A ball launched at the phase φ returns after one period if 2πΓ cos φ = 2π². It hits the table at the speed
2π, and d(next φ)/dφ = 1 - Γ sin φ. Let s = Γ sin φ. As Γ cos φ = π, s² = Γ² - π². The ball leaves the table immediately
if s >= 1, and its motion is stable if s < 2. Both conditions hold between Γ = √(1+π²) and Γ = √(4+π²).

**A little friction.** Let the slide up last h and the slide down u = 2π - h. To first order in δ the velocity after one
period changes by δ(u - h), and the gap after one period changes by δD with D = u²/2 - hu - h²/2. Here h is the value
for δ = 0, because y' = 0 at the end of the slide up, so that a shift of h has only an effect of second order. So
cos φ = (π - δD/2π)/Γ. A launch requires Γ sin φ > 1 + δ. The derivative of the flight (periodic/flight.py) is
-(Γ sin φ - 1 - δ) (2π - 2δu/f) / (2π + δ(h - u)), where f = 1 - Γ sin(φ + h) is the deceleration of the ball at the
end of the slide up.
`laws` gives the limit of each quantity and the factor of its term of order δ.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vibrodrive.periodic.bifurcations import bifurcations
from vibrodrive.periodic.continuation import BORDER_COLLISION, DOUBLING
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import orbits_of
from vibrodrive.validation.check import Finding

DECADES = tuple(10.0**k for k in range(2, 9))
"""Values of B. At B = 10 the first-order shift would be as large as the range of Γ of the orbit. At B = 1e9 the values
of A = Γ B would exceed 1e9, the largest value allowed."""

MIDDLE = 3.5  # Γ of the checked orbit, between √(1+π²) = 3.297 and √(4+π²) = 3.724
SEARCHED = (3.25, 3.8)  # range of Γ in which the two ends of the orbit are searched for, at each value of B

SLOPE_WITHIN = 0.01
"""Bound of |slope of log(error) over log(B) + 1|. It allows for the term of second order at B = 100."""

FACTOR_WITHIN = 1e-5
"""Bound of the relative difference between error × B at the largest B and the derived factor of 1/B. At B = 1e8
rounding is about 1e-15, a millionth of the least error, and the second order is smaller."""


@dataclass(frozen=True)
class Law:
    """Quantity of the ball: its limit for B → ∞, and the factor of 1/B of the error at finite B."""

    quantity: str
    formula: str
    limit: float
    factor: float


def _turn(gamma: float, phase: float) -> float:
    """Return the duration of the rise after a launch at `phase`, in a flight of one period.

    y' increases until Γ sin τ falls to 1. Then y' decreases until Γ sin τ rises to 1 again, which is after the end of
    the period. So y' has one zero.
    """
    low, high = math.pi - math.asin(1.0 / gamma) - phase, 2.0 * math.pi
    while low < (middle := 0.5 * (low + high)) < high:
        rises = gamma * (math.cos(phase) - math.cos(phase + middle)) > middle
        low, high = (middle, high) if rises else (low, middle)
    return low


def _first_order(s: float) -> tuple[float, float, float]:
    """Return the factors of 1/B in (phase, speed over B, multiplier) of the orbit at Γ² = s² + π²."""
    gamma, phase = math.hypot(s, math.pi), math.atan2(s, math.pi)
    h = _turn(gamma, phase)
    u = 2.0 * math.pi - h
    gap = 0.5 * u**2 - h * u - 0.5 * h**2
    deceleration = 1.0 - gamma * math.sin(phase + h)
    multiplier = 1.0 - gap / (2.0 * s) + (s - 1.0) * (u / (math.pi * deceleration) + (h - u) / (2.0 * math.pi))
    return gap / (2.0 * math.pi * s), h - u, multiplier


def laws() -> tuple[Law, ...]:
    """Return the laws of five quantities: the ends of the range of Γ, and phase, speed over B, multiplier at MIDDLE."""
    s = math.sqrt(MIDDLE**2 - math.pi**2)
    phase, speed, multiplier = _first_order(s)
    first, second = math.hypot(1.0, math.pi), math.hypot(2.0, math.pi)
    at_first = 2.0 * math.pi * _first_order(1.0)[0]
    at_second = _first_order(2.0)[2]
    return (
        Law("Γ at which the rest vanishes", "√(1 + π²)", first, (1.0 - 0.5 * at_first) / first),
        Law("Γ of the first period doubling", "√(4 + π²)", second, 2.0 * at_second / second),
        Law(f"phase of the impact at Γ = {MIDDLE:g}", "arccos(π/Γ)", math.acos(math.pi / MIDDLE), phase),
        Law(f"impact speed over B at Γ = {MIDDLE:g}", "2π", 2.0 * math.pi, speed),
        Law(f"multiplier at Γ = {MIDDLE:g}", "1 − √(Γ² − π²)", 1.0 - s, multiplier),
    )


def measure(B: float) -> tuple[float, ...]:
    """Return the values of the quantities of `laws` at one B, computed by `bifurcations` and `orbits`."""
    low, high = SEARCHED
    kinds = {b.kind: b.A / B for b in bifurcations((low * B, high * B), B=B, max_period=1)}
    (orbit,) = orbits_of(ImpactMap(MIDDLE * B, B), 1)
    ends = float(kinds[BORDER_COLLISION]), float(kinds[DOUBLING])
    return (*ends, float(orbit.phases[0]), float(orbit.speeds[0] / B), orbit.multiplier)


@dataclass(frozen=True, eq=False)
class Approach:
    """Convergence of one quantity to its limit: its values `found` at the values `B`, each float64 (n,)."""

    law: Law
    B: np.ndarray
    found: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """Relative error of the limit at each B, float64 (n,)."""
        return np.abs(self.found / self.law.limit - 1.0)

    @property
    def slope(self) -> float:
        """Slope of log(error) over log(B), by least squares."""
        return float(np.polyfit(np.log(self.B), np.log(self.error), 1)[0])

    @property
    def factor(self) -> float:
        """(found - limit) × B at the largest B."""
        return float((self.found[-1] - self.law.limit) * self.B[-1])

    @property
    def beyond(self) -> np.ndarray:
        """Relative error of the sum of the limit and the first-order term, factor/B, at each B, float64 (n,)."""
        return np.abs((self.found - self.law.limit - self.law.factor / self.B) / self.law.limit)

    @property
    def off(self) -> tuple[float, float]:
        """(difference of the slope from -1, relative difference of the factor from the derived factor)."""
        return abs(self.slope + 1.0), abs(self.factor / self.law.factor - 1.0)

    @property
    def holds(self) -> bool:
        """True if the error decreases as 1/B, with the derived factor."""
        return self.off[0] <= SLOPE_WITHIN and self.off[1] <= FACTOR_WITHIN


def approach() -> list[Approach]:
    """Measure all quantities at each B, in ascending order. Each B takes about a second."""
    values = np.array(DECADES)
    found = np.array([measure(b) for b in values.tolist()])
    return [Approach(law, values, found[:, k]) for k, law in enumerate(laws())]


def findings() -> list[Finding]:
    """Return two findings for each law.

    For large B the error of a law is about a factor times 1/B. The first finding is the difference between -1 and the
    slope of log(error) over log(B). The second is the relative difference between error × B at the largest B, which is
    the computed factor, and the derived factor.
    """
    out = []
    for a in approach():
        slope, factor = a.off
        out.append(Finding(f"{a.law.quantity}: |slope of log(error) over log(B) + 1|", slope, SLOPE_WITHIN))
        out.append(
            Finding(f"{a.law.quantity}: relative difference of error × B from the factor of 1/B", factor, FACTOR_WITHIN)
        )
    return out


def table(found: Sequence[Approach]) -> Iterator[str]:
    """Yield the lines of two Markdown tables: one with the verdicts, and one with a row for each quantity and B."""
    yield "| quantity | law | slope of the error | (value − law) · B at the largest B | factor of 1/B | verdict |"
    yield "|---|---|---|---|---|---|"
    for a in found:
        verdict = "holds" if a.holds else "**fails**"
        law = f"{a.law.formula} = {a.law.limit:.10f}"
        yield f"| {a.law.quantity} | {law} | {a.slope:.4f} | {a.factor:.6f} | {a.law.factor:.6f} | {verdict} |"
    yield ""
    yield "| quantity | B | value | relative error of the law | relative error of the law with the term in 1/B |"
    yield "|---|---|---|---|---|"
    for a in found:
        for B, value, error, beyond in zip(a.B, a.found, a.error, a.beyond, strict=True):
            yield f"| {a.law.quantity} | {B:.0e} | {value:.15f} | {error:.3e} | {beyond:.1e} |"
