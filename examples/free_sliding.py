"""Compare a mass that slides without an obstacle with Blekhman's law of vibrational displacement.

    python -m examples.free_sliding   # in the root of a clone; seconds

prints the mean velocity and two laws, and writes free_sliding.png.

The mass is so far above the obstacle that it never lands. Its mean velocity is -A sin(πB/2) for A ≫ 1 (I. I. Blekhman,
Vibrational Mechanics). The slides are ξ'' = A sin τ - B ∓ 1. In a periodic motion the mean friction equals B, so slides
up last D = π(1 - B). Friction and gravity change ξ' by ±h about its mean, h = π(1 - B²)/2. Let m be the middle of a
slide up, and C the mean velocity. ξ' = 0 at both of its ends: C - A cos(m ∓ D/2) ± h = 0. Hence, as long as the mass
never sticks,

    C = -A sin(πB/2) √(1 - (h / (A cos(πB/2)))²),

so the law for A ≫ 1 is too large by the share π² (1 - B²)² / (8 cos²(πB/2)) / A².
"""

import math

import numpy as np
from matplotlib.figure import Figure

import vibrodrive as vd

AMPLITUDES = (3.0, 10.0, 30.0, 100.0, 300.0)
INCLINES = (0.1, 0.5, 0.8)


def law(A: float, B: float) -> float:
    """Return the mean velocity for A ≫ 1."""
    return -A * math.sin(0.5 * math.pi * B)


def exact(A: float, B: float) -> float:
    """Return the mean velocity of the periodic motion without sticking."""
    return law(A, B) * math.sqrt(1.0 - (0.5 * math.pi * (1.0 - B * B) / (A * math.cos(0.5 * math.pi * B))) ** 2)


def measure(A: float, B: float, periods: int = 100) -> float:
    """Return the mean velocity of a simulated motion after a transient."""
    transient = int(20 * A) + 100
    height = 10.0 * A * (transient + periods)
    motion = vd.simulate(A, B=B, xi0=height, dxi0=law(A, B) - A, transient=transient, periods=periods)
    xi = motion.section[:, 0]
    return float(xi[-1] - xi[0]) / (2.0 * math.pi * (periods - 1))


def main() -> None:
    fig = Figure(figsize=(6.0, 4.0), layout="constrained")
    ax = fig.subplots()
    print(f"{'B':>4} {'A':>5} {'measured':>14} {'exact':>14} {'A ≫ 1':>14}")
    for B, mark in zip(INCLINES, "os^", strict=True):
        found = [measure(A, B) for A in AMPLITUDES]
        for A, V in zip(AMPLITUDES, found, strict=True):
            print(f"{B:4.1f} {A:5.0f} {V:14.8f} {exact(A, B):14.8f} {law(A, B):14.8f}")
        ax.loglog(
            AMPLITUDES, [1 - V / law(A, B) for A, V in zip(AMPLITUDES, found, strict=True)], mark, label=f"B = {B}"
        )
        factor = math.pi**2 * (1 - B * B) ** 2 / (8 * math.cos(0.5 * math.pi * B) ** 2)
        ax.loglog(AMPLITUDES, factor / np.square(AMPLITUDES), color="black", lw=0.6)
    ax.set(xlabel="$A$", ylabel=r"$1 - V / (-A\,\sin(\pi B/2))$")
    ax.legend(title="points: simulated; lines: derived, ∝ $1/A^2$")
    fig.savefig("free_sliding.png", dpi=140)


if __name__ == "__main__":
    main()
