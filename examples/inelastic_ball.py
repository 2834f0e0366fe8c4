"""Compare the limit B → ∞ with the completely inelastic bouncing ball (A. Mehta, J. M. Luck, PRL 65, 393, 1990).

    python -m examples.inelastic_ball   # in the root of a clone; ten seconds

prints for five laws of the ball how the error of the law decreases with B, and writes inelastic_ball.png.

The ball falls onto a vibrating table, and its impacts are plastic. Its only parameter Γ is the ratio of the largest
acceleration of the table to gravity. On an incline, in units of friction, gravity is B = tan α / μ and the largest
acceleration is A. So for large B, when friction hardly matters, the mass is this ball, with Γ = A/B. With ξ = B y and
δ = 1/B, the ratio of friction to gravity, the slides are

    y'' = Γ sin τ - 1 - δ  (up),    y'' = Γ sin τ - 1 + δ  (down),

and sticking, which requires |Γ sin τ - 1| <= δ, lasts for a time of order δ at most.

**The ball.** A ball launched at the phase φ returns after one period if 2πΓ cos φ = 2π². It hits the table at the speed
2π, and d(next φ)/dφ = 1 - Γ sin φ. Let s = Γ sin φ. As Γ cos φ = π, s² = Γ² - π². The ball leaves the table immediately
if s >= 1, and its motion is stable if s < 2. Both conditions hold between Γ = √(1+π²) and Γ = √(4+π²).

**A little friction.** Let the slide up last h and the slide down u = 2π - h. To first order in δ the velocity after one
period changes by δ(u - h), and the gap by δD with D = u²/2 - hu - h²/2. Here h is the value for δ = 0, because y' = 0
at the end of the slide up, so that a shift of h has only an effect of second order. So cos φ = (π - δD/2π)/Γ. A launch
requires Γ sin φ > 1 + δ. The derivative of the flight is -(Γ sin φ - 1 - δ) (2π - 2δu/f) / (2π + δ(h - u)), where
f = 1 - Γ sin(φ + h) is the deceleration of the ball at the end of the slide up. `laws` gives the limit of each quantity
and the factor of its term of order δ.
"""

import math
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

import vibrodrive as vd

DECADES = 10.0 ** np.arange(2, 9)
"""Values of B. At B = 10 the term of first order is as large as the range of Γ; A = ΓB is at most 1e9."""

MIDDLE = 3.5  # Γ of the orbit, between √(1+π²) = 3.297 and √(4+π²) = 3.724
SEARCHED = np.array([3.25, 3.8])  # range of Γ in which the two ends of the orbit are searched for
MARKS = "os^vD"


class Law(NamedTuple):
    """Quantity of the ball: its limit for B → ∞, and the factor of 1/B in its value at finite B."""

    quantity: str
    limit: float
    factor: float


def rise(gamma: float, phase: float) -> float:
    """Return the duration of the rise after a launch at `phase`, in a flight of one period.

    y' increases until Γ sin τ falls to 1. Then y' decreases until Γ sin τ rises to 1 again, which is after the end of
    the period. So y' has one zero.
    """
    low, high = math.pi - math.asin(1.0 / gamma) - phase, 2.0 * math.pi
    while low < (middle := 0.5 * (low + high)) < high:
        rises = gamma * (math.cos(phase) - math.cos(phase + middle)) > middle
        low, high = (middle, high) if rises else (low, middle)
    return low


def first_order(s: float) -> tuple[float, float, float]:
    """Return the factors of 1/B in (phase, speed over B, multiplier) of the orbit at Γ² = s² + π²."""
    gamma, phase = math.hypot(s, math.pi), math.atan2(s, math.pi)
    h = rise(gamma, phase)
    u = 2.0 * math.pi - h
    gap = 0.5 * u**2 - h * u - 0.5 * h**2
    deceleration = 1.0 - gamma * math.sin(phase + h)
    multiplier = 1.0 - gap / (2.0 * s) + (s - 1.0) * (u / (math.pi * deceleration) + (h - u) / (2.0 * math.pi))
    return gap / (2.0 * math.pi * s), h - u, multiplier


def laws() -> list[Law]:
    """Return the laws of the ends of the range of Γ, and of phase, speed over B and multiplier at MIDDLE."""
    s = math.sqrt(MIDDLE**2 - math.pi**2)
    phase, speed, multiplier = first_order(s)
    rest, doubling = math.hypot(1.0, math.pi), math.hypot(2.0, math.pi)
    return [
        Law("Γ at which the rest vanishes: √(1 + π²)", rest, (1.0 - math.pi * first_order(1.0)[0]) / rest),
        Law("Γ of the first period doubling: √(4 + π²)", doubling, 2.0 * first_order(2.0)[2] / doubling),
        Law(f"phase of the impact at Γ = {MIDDLE:g}: arccos(π/Γ)", math.acos(math.pi / MIDDLE), phase),
        Law(f"impact speed over B at Γ = {MIDDLE:g}: 2π", 2.0 * math.pi, speed),
        Law(f"multiplier at Γ = {MIDDLE:g}: 1 − √(Γ² − π²)", 1.0 - s, multiplier),
    ]


def measure(B: float) -> list[float]:
    """Return the values of the quantities of `laws` at one B."""
    kinds = {b.kind: b.A / B for b in vd.bifurcations(SEARCHED * B, B=B, max_period=1)}
    (orbit,) = vd.orbits(MIDDLE * B, B=B, max_period=1)
    ends = kinds["border"], kinds["period doubling"]
    return [*ends, float(orbit.phases[0]), float(orbit.speeds[0] / B), orbit.multiplier]


def table(found: np.ndarray) -> str:
    """Return the slope of log(error) over log(B), which should be −1, and (value − limit) · B at the largest B, which
    should be the factor of the law. `found` is float64 (values of B, laws)."""
    lines = [f"{'slope':>8} {'measured':>10} {'factor':>10}  law, for B = {DECADES[0]:.0e} to {DECADES[-1]:.0e}"]
    for law, values in zip(laws(), found.T, strict=True):
        slope = np.polyfit(np.log(DECADES), np.log(np.abs(values - law.limit)), 1)[0]
        measured = (values[-1] - law.limit) * DECADES[-1]
        lines.append(f"{slope:8.4f} {measured:10.6f} {law.factor:10.6f}  {law.quantity} = {law.limit:.10f}")
    return "\n".join(lines)


def figure(found: np.ndarray) -> Figure:
    """Draw the relative error of each law over B, and a line of slope −1 for its derived term of first order."""
    fig = Figure(figsize=(6.8, 4.4), layout="constrained")
    ax = fig.subplots()
    for law, values, mark in zip(laws(), found.T, MARKS, strict=True):
        ax.loglog(DECADES[[0, -1]], np.abs(law.factor / law.limit) / DECADES[[0, -1]], color="black", lw=0.6)
        ax.loglog(DECADES, np.abs(values / law.limit - 1.0), mark, mfc="white", mec="black", label=law.quantity)
    ax.set_xlabel("$B$ (gravity along the incline over friction)")
    ax.set_ylabel("relative error at $B$ of the law for $B → ∞$")
    ax.legend(title="inelastic bouncing ball, $Γ = A/B$")
    return fig


def main() -> None:
    found = np.array([measure(B) for B in DECADES.tolist()])
    print(table(found))
    figure(found).savefig("inelastic_ball.png", dpi=140)


if __name__ == "__main__":
    main()
