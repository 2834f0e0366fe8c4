"""Check of the phase after a million periods. At the end of each rest H must be 1."""

from typing import Any

from vibrodrive.batch.trajectory import Trajectory, simulate
from vibrodrive.model.names import ETA
from vibrodrive.model.states import State
from vibrodrive.validation.agreement import oscillator
from vibrodrive.validation.check import Finding
from vibrodrive.validation.reference import mp

SCENES: tuple[dict[str, Any], ...] = ({"eps": 0.0}, {"eps": 1e-6, "eta": ETA}, {"eps": 0.01, "eta": 7.3})
"""Settings at A = 1.5, where the mass rests in each period."""

MILLION = 1_000_000

WITHIN = 1e-12
"""Bound of the error in τ. It detects an error in the phase of the excitation, τ, or of the disturbance, ητ."""


def million_periods() -> list[Finding]:
    """Return a finding for each scene: the largest error in τ of the ends of rests after MILLION periods."""
    found = []
    for scene in SCENES:
        late = phase_error(simulate(A=1.5, **scene, transient=MILLION, periods=5))
        words = ", ".join(f"{k} = {v:g}" for k, v in {"A": 1.5, **scene}.items())
        found.append(Finding(f"{words}: error in τ of the end of a rest", late, WITHIN))
    return found


def phase_error(motion: Trajectory) -> float:
    """Return the largest difference in τ between the end of a rest and the instant at which H = 1.

    H is computed with 60 digits. Raises ValueError if there is no rest.
    """
    mp.dps = 60
    model, late = oscillator(motion), []
    for row in motion.switches[motion.switches["before"] == State.REST]:
        tau = 2 * mp.pi * int(row["period"]) + mp.mpf(float(row["phase"]))
        rate = sum(a * w * mp.cos(w * tau) for a, w in model.terms)
        late.append(abs(float((model.H(tau) - 1) / rate)))
    return max(late)
