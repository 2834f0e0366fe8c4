"""Find the best frequency of a vibratory driver in SI units, and the largest disturbance that its motion tolerates.

    python -m examples.driver   # in the root of a clone

writes driver.png: impact power, impacts a second and limit of stability over the frequency of the excitation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

import vibrodrive as vd

DRIVER = {"a0": 0.8e-3, "mu": 0.6, "alpha": 3.4, "mass": 250.0}
"""Amplitude of the excitation (m), friction, angle (degrees) and mass (kg)."""


@dataclass(frozen=True)
class Course:
    """Results over the frequency of the excitation, float64 arrays (n,) in SI units.

    omega0 : frequency of the excitation, rad/s.
    power : mean power of the impacts, W.
    speed : speed of the fastest impact, m/s.
    blows : number of impacts a second, including slow touches.
    period : period of the motion in periods of the excitation; 0 if the motion does not repeat within 64 periods.
    """

    omega0: np.ndarray
    power: np.ndarray
    speed: np.ndarray
    blows: np.ndarray
    period: np.ndarray


def course(omega0: Sequence[float] | np.ndarray) -> Course:
    """Compute a motion from rest at each frequency (rad/s), all in one sweep."""
    scenes = [vd.Scene.quiet(omega0=float(w), **DRIVER) for w in omega0]  # no warning if the mass cannot leave
    r = vd.sweep(points={"A": [s.A for s in scenes], "B": [s.B for s in scenes]}, record="summary", periods=66)
    each = list(zip(scenes, r.energy, r.impact_speed_max, r.impacts, strict=True))
    return Course(
        omega0=np.asarray(omega0, dtype=np.float64),
        power=np.array([s.power(energy) for s, energy, _, _ in each]),
        speed=np.array([s.velocity(speed) for s, _, speed, _ in each]),
        blows=np.array([impacts * s.omega0 / (2.0 * np.pi) for s, _, _, impacts in each]),
        period=r.period,
    )


def limit_velocity(omega0: float) -> float:
    """Return the limit k₂ in ε at this frequency as a velocity in m/s. Return NaN if there is no limit."""
    scene = vd.Scene(omega0=omega0, **DRIVER)
    return float(scene.velocity(vd.limit(scene.A, "eps", B=scene.B).velocity))


def figure(found: Course, frequencies: Sequence[float] | np.ndarray, limits: Sequence[float]) -> Figure:
    """Draw power, impacts a second, and the limits (m/s) at `frequencies` (rad/s), over the frequency."""
    drawing = Figure(figsize=(7.0, 6.0), layout="constrained")
    power, blows, limit = drawing.subplots(3, 1, sharex=True)
    power.plot(found.omega0, found.power, "k-")
    power.set_ylabel("impact power (W)")
    blows.plot(found.omega0, found.blows, "k-")
    blows.set_ylabel("impacts a second")
    limit.semilogy(frequencies, 1e3 * np.asarray(limits), "ko-", markersize=3)
    limit.set_ylabel("limit in ε (mm/s)")
    limit.set_xlabel("Ω₀ (rad/s)")
    return drawing


def main() -> None:
    found = course(np.linspace(80.0, 200.0, 1201))
    best = int(np.argmax(found.power))
    print(
        f"best at {found.omega0[best]:.0f} rad/s: {found.power[best]:.1f} W, {found.blows[best]:.1f} impacts a second,"
    )
    print(f"fastest impact {found.speed[best]:.3f} m/s; period {found.period[best]}")
    frequencies = np.linspace(104.0, 152.0, 13)
    limits = [limit_velocity(w) for w in frequencies.tolist()]
    print(f"at {frequencies[6]:.0f} rad/s the motion tolerates {1e3 * limits[6]:.1f} mm/s")
    figure(found, frequencies, limits).savefig("driver.png", dpi=110)


if __name__ == "__main__":
    main()
