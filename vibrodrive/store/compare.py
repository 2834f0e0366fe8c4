"""Comparison of the sweep in a file with another one: axes, parameters and settings."""

from pathlib import Path

import numpy as np

from vibrodrive.errors import Different
from vibrodrive.model.plan import Plan
from vibrodrive.store.describe import settings_in_words


def refuse_different(path: Path, differences: list[str]) -> None:
    """Raise Different if there are differences."""
    if differences:
        raise Different(
            f"{path}: made from another configuration: {'; '.join(differences)}. "
            "A file cannot be extended; choose another file"
        )


def compare(stored: Plan, plan: Plan) -> list[str]:
    """Return the differences between a stored plan and `plan` as texts."""
    there, here = _flat(stored), _flat(plan)
    found = []
    for key in [*there, *(k for k in here if k not in there)]:
        a, b = there.get(key), here.get(key)
        if a is None or b is None or a.tobytes() != b.tobytes():
            found.append(_difference(key, a, b))
    if not found and list(stored.axes) != list(plan.axes):
        found.append(
            f"the axes are ({', '.join(stored.axes)}) in the file and ({', '.join(plan.axes)}) in the configuration"
        )
    return found


def _flat(plan: Plan) -> dict[str, np.ndarray]:
    scalars = {k: np.asarray(v) for k, v in plan.scalars.items() if k not in plan.axes}
    together = {f"points.{name}": values for name, values in plan.together.items()}
    return plan.axes | together | scalars | {k: np.asarray(v) for k, v in settings_in_words(plan).items()}


def _difference(name: str, there: np.ndarray | None, here: np.ndarray | None) -> str:
    return f"{name} is {_words(there)} in the file and {_words(here)} in the configuration"


def _words(value: np.ndarray | None) -> str:
    if value is None or (value.ndim == 0 and value != value):
        return "not given"
    if value.size <= 4:
        return repr(value.tolist())
    return f"a list of {len(value)} values from {value[0]:g} to {value[-1]:g}"
