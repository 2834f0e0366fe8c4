"""Check of the energy balance: the work of the excitation equals the losses by friction and impacts."""

import numpy as np

from vibrodrive.batch.sweep import collect
from vibrodrive.model.plan import make_plan
from vibrodrive.validation.check import Finding

PERIODS = 300

WITHIN = 1e-12
"""Bound of the imbalance, relative to the work of the excitation. It allows for rounding."""


def energy_balance() -> list[Finding]:
    """Check the imbalance drive − friction − impacts. Each of the three works is summed separately.

    The imbalance is zero over one period of a periodic motion, because the mass returns and gravity does no work. The
    same is true of any other motion from a main impact to a main impact, with ξ = ξ' = 0 at both.
    """
    A, B = np.linspace(1.2, 5.0, 96), 0.1
    run = {"A": A, "B": B, "eps": [0.0, 2e-4], "transient": 200, "periods": PERIODS, "record": "summary"}
    swept = collect(make_plan(run))
    off = np.abs(swept.drive_work - swept.friction_loss - swept.energy) / swept.drive_work
    return [
        Finding(
            f"{which.sum()} {kind} motions: largest ratio of the imbalance to the work of the excitation",
            float(off[which].max()),
            WITHIN,
        )
        for kind, which in (("periodic", swept.period > 0), ("other", swept.period <= 0))
    ]
