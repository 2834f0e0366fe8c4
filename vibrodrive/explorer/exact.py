"""Exact results for a view (view.py), as plain data: orbits and bifurcations over A, multipliers, limits.

Orbits, bifurcations and multipliers are those of the undisturbed motion. `SeparateProcess` runs these functions in a
separate process.
"""

from __future__ import annotations

import math
import warnings
from typing import Any, NamedTuple

import numpy as np

from vibrodrive.periodic.family import family, phase_traces, section, traces
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import Orbit, orbits_of
from vibrodrive.stability.limit import limit

VALUES = 240  # number of values of A at which orbits are computed; `family` adds values near bifurcations
SAME = 1e-6  # largest difference in rad of the impact phases of a motion and of an orbit that count as equal


STABLE, UNSTABLE = "stable orbit", "unstable orbit"


class Curve(NamedTuple):
    """Curve of orbits over A, or the point of a bifurcation over A.

    x and y are arrays for a curve and numbers for a point. `kind` is STABLE, UNSTABLE or the kind of bifurcation.
    """

    x: Any
    y: Any
    kind: str
    period: int


def warm() -> None:
    """Load or compile the kernels of the functions below."""
    orbit_lines(2.58, 2.6, 0.1, 1, "xi", 0.0)  # this range of A contains one bifurcation
    limit(1.5, transient=50, periods=50, threads=1)


def orbit_lines(
    low: float, high: float, B: float, max_period: int, quantity: str, phase: float
) -> tuple[list[Curve], list[Curve]]:
    """Return (curves of orbits, points of bifurcations) for A from `low` to `high`.

    Their ordinate is `quantity`, one of DIAGRAM_QUANTITIES. `phase` is the phase of the section.
    """
    found = family(np.linspace(low, high, VALUES), B, max_period)

    def values(orbit: Orbit) -> np.ndarray:
        if quantity == "impact_phase":
            return orbit.phases
        if quantity == "impact_speed":
            return orbit.speeds
        return section(orbit, phase)[:, ("xi", "dxi").index(quantity)]

    lines = []
    for b in found.branches():
        columns = phase_traces(b) if quantity == "impact_phase" else traces(b, values)
        lines += [Curve(b.A, y, UNSTABLE if b.unstable else STABLE, b.orbits[0].period) for y in columns.T]
    known = [b for b in found.bifurcations if len(b.orbit.phases)]
    return lines, [Curve(b.A, y, b.kind, b.orbit.period) for b in known for y in values(b.orbit).tolist()]


def multiplier_at(A: float, B: float, period: int, phases: np.ndarray) -> float:
    """Return the multiplier of the orbit with this period and these impact phases; NaN if there is no such orbit."""
    for orbit in orbits_of(ImpactMap(A, B), period):
        if orbit.period == period and len(phases):
            apart = np.abs(orbit.phases[:, None] - phases[None, :])
            if np.minimum(apart, 2.0 * math.pi - apart).min(axis=0).max() < SAME:
                return orbit.multiplier
    return math.nan


def limit_at(arguments: dict[str, Any]) -> dict[str, Any]:
    """Return k2, velocity, how and last_kept of `limit` with these arguments, and with defaults for all others."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no warnings of likely mistakes, because the page shows the motion itself
        k = limit(**arguments, threads=1)
    return {"k2": k.k2, "velocity": k.velocity, "how": k.how, "last_kept": k.last_kept}
