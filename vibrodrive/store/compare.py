"""Comparison of a file with a configuration, or with a plan: the axes, parameters and settings of a sweep."""

from collections.abc import Collection, Mapping
from pathlib import Path

import h5py
import numpy as np

from vibrodrive.errors import ConfigError, Different
from vibrodrive.model.names import SCENE
from vibrodrive.model.plan import Plan
from vibrodrive.store.describe import plain, settings_in_words
from vibrodrive.store.header import origin_of


def refuse_different(path: Path, differences: list[str]) -> None:
    """Raise Different if there are differences."""
    if differences:
        raise Different(
            f"{path}: made from another configuration: {'; '.join(differences)}. "
            "A file cannot be extended. Choose another file, or replace this one with --overwrite"
        )


def differences(file: h5py.File, plan: Plan, own: Mapping[str, object]) -> list[str]:
    """Return as texts the differences between a plan and an open file, which contains its configuration, but no plan.

    `own` contains settings of the command, by the names of their root attributes. In the comparison they replace the
    settings of the plan.
    """
    try:
        there = origin_of(file).parsed().plan()
    except ConfigError as error:
        return [f"this version cannot read its configuration ({error})"]
    different = {name: value for name, value in own.items() if file.attrs[name] != value}
    found = [_difference(name, np.asarray(file.attrs[name]), np.asarray(value)) for name, value in different.items()]
    return found + compare(there, plan, without=own)


def altered(file: h5py.File, **own: object) -> list[str]:
    """Return a text for each parameter, setting or range in the root attributes of an open file that contradicts the
    configuration in the file.

    No checksum covers these attributes. `own` contains the default values of the attributes that a command adds to its
    files (`periods`, `max_period`), by name.
    """
    try:
        config = origin_of(file).parsed()
    except ConfigError:  # the configuration was written by another version
        return []
    plan = config.plan()
    given = {name: value for name, value in (config.arguments | config.orbits).items() if name in own}
    ranges = {f"range_{name}": (values.min(), values.max()) for name, values in plan.axes.items()}
    expected = plain(plan) | ranges | own | given
    wrong = [name for name in expected if name in file.attrs and not np.array_equal(file.attrs[name], expected[name])]
    return [f"attribute {name}: changed after it was written" for name in wrong]


def compare(stored: Plan, plan: Plan, without: Collection[str] = ()) -> list[str]:
    """Return the differences between a stored plan and `plan` as texts. Names in `without` are not compared."""
    there, here = _flat(stored), _flat(plan)
    found = []
    for key in [*there, *(k for k in here if k not in there)]:
        a, b = there.get(key), here.get(key)
        if key in without or (a is None and key in SCENE):  # older files contain a fixed scene in their text only
            continue
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
