"""Find the best frequency of a vibratory driver in SI units, and the largest disturbance that its motion tolerates.

    python -m examples.driver   # in the root of a clone

writes driver.png: impact power, impacts a second and limit of stability over the frequency of the excitation.
"""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

import vibrodrive as vd

DRIVER = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4, mass=250.0)  # m, Hz, –, degrees, kg


def course(frequencies: Sequence[float] | np.ndarray):
    """Compute a motion from rest at each frequency (Hz), all in one sweep. Return an xarray.Dataset in SI units."""
    return vd.sweep(scene=DRIVER, frequency=frequencies, record="summary", periods=64).to_xarray()


def limit_velocity(frequency: float) -> float:
    """Return the limit k₂ in ε at this frequency (Hz) as a velocity in m/s. Return NaN if there is no limit."""
    return vd.limit(scene=vd.Scene.quiet(**DRIVER.given | {"frequency": frequency})).velocity_si


def figure(found, frequencies: Sequence[float] | np.ndarray, limits: Sequence[float]) -> Figure:
    """Draw power, impacts a second, and the limits (m/s) at `frequencies` (Hz), over the frequency."""
    drawing = Figure(figsize=(7.0, 6.0), layout="constrained")
    power, blows, limit = drawing.subplots(3, 1, sharex=True)
    power.plot(found.frequency, found.impact_power, "k-")
    power.set_ylabel("impact power (W)")
    blows.plot(found.frequency, found.impacts, "k-")
    blows.set_ylabel("impacts a second")
    limit.semilogy(frequencies, 1e3 * np.asarray(limits), "ko-", markersize=3)
    limit.set_ylabel("limit in ε (mm/s)")
    limit.set_xlabel("frequency (Hz)")
    return drawing


def main() -> None:
    found = course(np.linspace(13.0, 32.0, 1201))
    best = found.isel(frequency=int(np.argmax(found.impact_power.data)))
    print(f"best at {best.frequency:.1f} Hz: {best.impact_power:.1f} W, {best.impacts:.1f} impacts a second,")
    print(f"fastest impact {best.impact_speed_max:.3f} m/s; period {best.motion_period:d}")
    frequencies = np.linspace(16.5, 24.2, 13)
    limits = [limit_velocity(f) for f in frequencies.tolist()]
    print(f"at {frequencies[6]:.2f} Hz the motion tolerates {1e3 * limits[6]:.1f} mm/s")
    figure(found, frequencies, limits).savefig("driver.png", dpi=110)


if __name__ == "__main__":
    main()
