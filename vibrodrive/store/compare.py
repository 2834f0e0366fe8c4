"""Was a file made from this configuration? If not: where do they differ, in words."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from vibrodrive.errors import ConfigError, Different
from vibrodrive.model.config import parse
from vibrodrive.model.parameters import Method, Scan
from vibrodrive.model.plan import Plan


def refuse_different(path: Path, differences: list[str]) -> None:
    """Raise Different if there are any."""
    if differences:
        raise Different(
            f"{path}: made from another configuration: {'; '.join(differences)}. "
            "A file cannot be extended: choose another file for what is new, or --overwrite"
        )


def differences(file: h5py.File, plan: Plan, given: Mapping[str, object] | None = None, **own: object) -> list[str]:
    """In what an open file, of a kind that keeps its configuration but no plan, differs from what is to be computed.

    `given`: the arguments as given, for commands whose default periods are not those of a sweep.
    `own`: the command's own settings, by the names of root attributes.
    """
    try:
        there = parse(str(file.attrs["config"]), json.loads(file.attrs["overrides"]))
        found = compare(there.plan(), plan)
    except ConfigError as error:
        return [f"its configuration is none of this version ({error})"]
    if given is not None:
        for name in ("transient", "periods"):
            a, b = there.arguments.get(name, "not given"), given.get(name, "not given")
            if a != b and "not given" in (a, b):
                found.append(f"{name} is {a} there and {b} here")
    for name, value in own.items():
        if file.attrs[name] != value:
            found.append(f"{name} is {file.attrs[name]} there and {value} here")
    return found


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
    settings["record"] = ", ".join(plan.record)
    settings["carry"] = plan.carry or "not given"
    together = {f"points.{name}": values for name, values in plan.together.items()}
    return plan.axes | together | scalars | {k: np.asarray(v) for k, v in settings.items()}


def _words(value: np.ndarray | None) -> str:
    if value is None or (value.ndim == 0 and value != value):
        return "not given"
    if value.size <= 4:
        return ", ".join(str(v) for v in np.atleast_1d(value).tolist())
    return f"{len(value)} values from {value[0]:g} to {value[-1]:g}"
