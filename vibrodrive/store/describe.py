"""Plain root attributes of a file: all numbers that are common to its points, and a comment that explains them.

Users of other programs (ncdump, xarray, h5py) find B, eps, eta, periods, … under these names; `comment` gives their
meanings.
"""

import math
from typing import Any

from vibrodrive.model.names import NAMES, SCENE
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import ALWAYS, IMPULSES

MOTION = (
    "Each point of the axes is one motion, followed for `transient` excitation periods and then recorded for `periods` "
    "more; its section is taken at τ = section_phase + 2πk."
)
SOUGHT = (
    "Each point of the axes is one search for a limit in {}: motions with increasing values of it are followed for "
    "`transient` excitation periods and then compared with the undisturbed orbit for `periods` more."
)
ORBIT = (
    "Each point of the axes is one undisturbed orbit, on which a motion settles, and what is proved of it under "
    "disturbances, for all times."
)
MODEL = (
    "Mass on a vibrating incline with Coulomb friction and an ideally plastic obstacle, dimensionless: adhesive force "
    "H = A (sin τ + ε η² sin ητ) − B; ξ'' = H − 1 sliding up, ξ'' = H + 1 sliding down; ξ is the gap above the "
    "obstacle, τ the time (2π: one excitation period), ' the derivative by τ."
)


def plain(plan: Plan) -> dict[str, Any]:
    """Return the values common to all motions of a plan, by name: parameters that are not an axis, and settings."""
    omitted = [plan.sought] if plan.seeks else []
    scalars = {name: value for name, value in plan.scalars.items() if name not in omitted and not math.isnan(value)}
    return scalars | plan.settings.words | {"record": ", ".join(record.text(plan.sought) for record in plan.record)}


def acting(plan: Plan) -> dict[str, Any]:
    """Return the values of `plain` that affect a motion: dtau and tol if the method uses them, eta if ε may be > 0."""
    values = plain(plan)
    omitted = {*plan.settings.idle, *(["eta"] if values.get("eps") == 0.0 else [])}
    return {name: value for name, value in values.items() if name not in omitted}


def comment(plan: Plan) -> str:
    """Return the description of the contents of a file, and the meanings of the values of `plain`."""
    proofs = plan.record in ((IMPULSES,), (ALWAYS,))
    contents = ORBIT if proofs else SOUGHT.format(plan.sought) if plan.seeks else MOTION
    return f"{contents} {MODEL} Attributes: {'; '.join(f'{name}: {_meaning(name)}' for name in plain(plan))}."


def _meaning(name: str) -> str:
    row = NAMES[name]
    return f"{row.meaning} ({row.unit})" if name in SCENE else row.meaning
