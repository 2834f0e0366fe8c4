"""Mean velocity of the mass without an obstacle."""

import math

from vibrodrive.batch.sweep import collect
from vibrodrive.model.names import ETA
from vibrodrive.model.plan import make_plan

SHORTEST, LONGEST = 256, 16_384
"""First and last number of excitation periods of the transient, and of the record. Each attempt doubles it."""

WITHIN = 1e-4
"""Largest relative difference of the means of the two halves of a record of a motion that has settled."""


def conveying_velocity(A: float, B: float, eps: float = 0.0, eta: float = ETA) -> float:
    """Return the mean velocity without an obstacle, dimensionless and negative down the incline.

    The velocity is -inf for B > 1, because the mass then accelerates without limit. It is NaN if the two halves of the
    longest record still differ.

    For large A the mean velocity is -A sin(πB/2), but a motion from rest needs many times A/4 periods to reach it. So
    the motion starts with the velocity at τ = 0 that belongs to this mean.
    """
    if B > 1.0:
        return -math.inf
    periods = SHORTEST
    while periods <= LONGEST:
        # the velocity down never exceeds 2 A (1 + ε η), so from the gap `far` the mass does not reach the obstacle
        far = 1.0 + 4.0 * math.pi * A * (1.0 + eps * eta) * (2 * periods + 1)
        start = {"xi0": far, "dxi0": -A * (1.0 + math.sin(0.5 * math.pi * B))}
        run = {"transient": periods, "periods": periods + 1}
        xi = collect(make_plan({"A": A, "B": B, "eps": eps, "eta": eta, **start, **run}), threads=1).section[:, 0]
        half = periods // 2
        first, second = (float(xi[k + half] - xi[k]) / (2.0 * math.pi * half) for k in (0, half))
        if abs(second - first) <= WITHIN * abs(second) + 1e-9 * A:
            return second
        periods *= 2
    return math.nan
