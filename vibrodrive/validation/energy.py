"""Check of the energy balance: the work of the excitation equals the losses by friction and impacts."""

import numpy as np

from vibrodrive.batch.sweep import collect
from vibrodrive.model.plan import make_plan
from vibrodrive.validation.check import Finding

PERIODS = 300

WITHIN = 1e-12
"""Bound of the imbalance of a periodic motion, relative to the work of the excitation. It allows for rounding."""


def energy_balance() -> list[Finding]:
    """Check the imbalance drive − friction − impacts. Each of the three works is summed separately.

    Over one period of a periodic motion the imbalance is zero, because the mass returns and gravity does no work. For
    any other motion the sums extend from the first to the last recorded switch, with ξ' = 0 at both switches. Between
    these switches gravity does the work B times the difference of the gaps, which is at most B ξ_max.
    """
    A, B = np.linspace(1.2, 5.0, 96), 0.1
    run = {"A": A, "B": B, "eps": [0.0, 2e-4], "transient": 200, "periods": PERIODS, "record": "summary"}
    swept = collect(make_plan(run))
    off = np.abs(swept.drive_work - swept.friction_loss - swept.energy)
    periodic = swept.period > 0
    relative = (off / swept.drive_work)[periodic]
    kept = (off * (PERIODS - 1) / (B * swept.xi_max))[~periodic]
    return [
        Finding(
            f"{relative.size} periodic motions: largest ratio of the imbalance to the work of the excitation",
            float(relative.max()),
            WITHIN,
        ),
        Finding(
            f"{kept.size} other motions: largest ratio of the imbalance to B ξ_max ({PERIODS} periods)",
            float(kept.max()),
            1.0,
        ),
    ]
