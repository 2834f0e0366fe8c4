"""Comparison of the sweep in a file with that of a call or a configuration, and the plan that continues the file."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from vibrodrive.errors import Different
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import functions


def joined(path: Path, stored: Plan, plan: Plan) -> Plan:
    """Return the plan that continues the file at `path`: the blocks of the file, the functions of the call.

    Raises Different if the file contains another sweep.
    """
    if differences := compare(stored, plan):
        reason = f"made from another configuration: {'; '.join(differences)}"
        raise Different(f"{path}: {reason}. A file cannot be extended; choose another file")
    return replace(stored, record=plan.record)


def compare(stored: Plan, plan: Plan) -> list[str]:
    """Return the differences between a stored plan and `plan` as texts."""
    in_file, configured = _flat(stored), _flat(plan)
    differences = []
    for key in [*in_file, *(k for k in configured if k not in in_file)]:
        a, b = in_file.get(key), configured.get(key)
        if a is None or b is None or a.tobytes() != b.tobytes():
            differences.append(_other_functions(stored, plan) if key == "record" else _difference(key, a, b))
    if not differences and list(stored.axes) != list(plan.axes):
        differences.append(
            f"the axes are ({', '.join(stored.axes)}) in the file and ({', '.join(plan.axes)}) in the configuration"
        )
    return differences


def _flat(plan: Plan) -> dict[str, np.ndarray]:
    scalars = {name: np.asarray(value) for name, value in plan.scalars.items()}
    together = {f"points.{name}": values for name, values in plan.together.items()}
    settings = plan.settings.words | {"record": ", ".join(record.outline for record in plan.record)}
    return plan.axes | together | scalars | {k: np.asarray(v) for k, v in settings.items()}


def _other_functions(stored: Plan, plan: Plan) -> str:
    """Return the difference between the records of two plans."""
    lacking = {*functions(stored.record)} - {*plan.record}
    only = " (only a call of vd.sweep has functions)" if lacking else ""
    same = stored.record == plan.record
    texts = (", ".join(record.outline if same else record for record in p.record) for p in (stored, plan))
    return _difference("record", *map(np.asarray, texts)) + only


def _difference(name: str, in_file: np.ndarray | None, configured: np.ndarray | None) -> str:
    return f"{name} is {_words(in_file)} in the file and {_words(configured)} in the configuration"


def _words(value: np.ndarray | None) -> str:
    if value is None or (value.ndim == 0 and value != value):
        return "not given"
    if value.size <= 4:
        return repr(value.tolist())
    return f"a list of {len(value)} values from {value[0]:g} to {value[-1]:g}"
