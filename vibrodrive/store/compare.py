"""Was a file made from this configuration? If not: where do they differ, in words."""

from __future__ import annotations

import numpy as np

from vibrodrive.model.parameters import Method, Scan
from vibrodrive.model.plan import Plan


def compare(stored: Plan, plan: Plan) -> list[str]:
    """Which parts of a stored plan differ from another, each in words; empty if none does."""
    there, here = _flat(stored), _flat(plan)
    found = []
    for key in [*there, *(k for k in here if k not in there)]:
        a, b = there.get(key), here.get(key)
        if a is None or b is None or a.tobytes() != b.tobytes():
            found.append(f"{key} is {_words(a)} there and {_words(b)} here")
    if not found and list(stored.axes) != list(plan.axes):
        found.append(f"the axes are {', '.join(stored.axes)} there and {', '.join(plan.axes)} here")
    return found


def _flat(plan: Plan) -> dict[str, np.ndarray]:
    scalars = {k: np.asarray(v) for k, v in plan.scalars.items() if k not in plan.axes}
    settings = vars(plan.settings) | {
        "method": Method(plan.settings.method).name.lower(),
        "scan": Scan(plan.settings.scan).name.lower(),
    }
    return plan.axes | scalars | {k: np.asarray(v) for k, v in settings.items()}


def _words(value: np.ndarray | None) -> str:
    if value is None or (value.ndim == 0 and value != value):
        return "not given"
    if value.size <= 4:
        return ", ".join(str(v) for v in np.atleast_1d(value).tolist())
    return f"{len(value)} values from {value[0]:g} to {value[-1]:g}"
