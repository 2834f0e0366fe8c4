"""Layout of the file of a sweep: HDF5 with netCDF-4 dimension scales, laid out completely before the sweep.

The dimensions of a variable are the axes, in order, and then `period` for the section or `state` for the numbers of
switches. Each variable is one piece of the file, with the points in their order, so that a block is a part of it. The
group DIGESTS has a digest of each block (digests.py). A sweep of one point has no axes; its file has an axis `point` of
length 1. The values of parameters that change together are coordinates along the axis `point`.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import platform
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from importlib import import_module, metadata
from typing import Any, NamedTuple

import h5py
import numpy as np

from vibrodrive.errors import ConfigError
from vibrodrive.model.choices import Status
from vibrodrive.model.config import Config, parse
from vibrodrive.model.names import AXES
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import POINTS, STATUS, SWITCHES, Quantity, length_along
from vibrodrive.model.records import SECTION
from vibrodrive.model.states import State
from vibrodrive.model.variables import POINT
from vibrodrive.store import netcdf
from vibrodrive.store.describe import comment, plain
from vibrodrive.version import __version__

SWEEP, SCHEMA, NUMBER = "sweep", "schema_version", 5
"""The kind of the file, the attribute with the number of its schema, and this number."""

DIGESTS = "digests"
"""Group with the digests of the blocks of each variable, under its name, along the dimension `block`."""

Progress = Callable[[int, int], None]  # function called with (done, total)


def quiet(done: int, total: int) -> None:
    """Ignore progress."""


COUNTS_MAX = 2**31
"""In a file without sections the numbers of switches are int32, or int64 if a motion may have this many switches."""


def variables_of(plan: Plan) -> tuple[Quantity, ...]:
    """Return the variables of a file, in the order in which a block is written."""
    sections = [q for record in plan.record for q in record.quantities if q.along == "period"]
    few = not sections and plan.settings.periods * plan.settings.budget < COUNTS_MAX
    points = [q._replace(dtype="<i4") if q is SWITCHES and few else q for q in POINTS]
    return (*sections, *plan.quantities, *points)


class Origin(NamedTuple):
    """Source of a sweep: the text of the configuration, the options that replace some of its values, and a title."""

    config: str
    overrides: tuple[str, ...] = ()
    title: str = ""

    @classmethod
    def of(cls, config: Config, title: str = "") -> Origin:
        """Return the origin that a configuration describes; `title` is used if the configuration has none."""
        return cls(config.text, config.overrides, config.title or title)

    @property
    def figure(self) -> dict[str, Any]:
        """[figure] of the configuration; {} if it has a function or is of another version."""
        try:
            return parse(self.config, self.overrides).figure
        except ConfigError:
            return {}


def digest(text: str) -> str:
    """Return the SHA-256 of a text, as files contain it."""
    return hashlib.sha256(text.encode()).hexdigest()


def axes_of(plan: Plan) -> dict[str, np.ndarray]:
    """Return the axes as dimensions of the file; for a sweep of one point, the axis `point`."""
    return plan.axes or {POINT: np.zeros(1)}


def coordinates(plan: Plan) -> dict[str, np.ndarray]:
    """Return all dimensions of the file and their values."""
    periods = plan.settings.periods
    dimensions = {**axes_of(plan)}
    for name in dict.fromkeys(q.along for record in plan.record for q in record.quantities if q.along):
        dimensions[name] = np.arange(1, length_along(name, periods)[0] + 1)
    return {**dimensions, "state": np.array(list(State), np.int8)}


class Tile(NamedTuple):
    """A block: the points `start` to `stop` - 1. `slab` has a slice for each axis of the file."""

    start: int
    stop: int
    slab: tuple[slice, ...]


def tiles(plan: Plan) -> list[Tile]:
    """Return the blocks of the file, in the order of plan.blocks()."""
    shape, chunk = plan.shape or (1,), plan.chunk or (1,)
    cuts = [[slice(c, min(c + k, n)) for c in range(0, n, k)] for n, k in zip(shape, chunk, strict=True)]
    return [
        Tile(start, stop, slab) for (start, stop), slab in zip(plan.blocks(), itertools.product(*cuts), strict=True)
    ]


def lay_out(file: h5py.File, plan: Plan, origin: Origin) -> None:
    """Write all parts of an empty file except the results, and allocate the results.

    All points have the status NOT_COMPUTED. Other values are 0 until they are written.
    """
    variables, flags, attributes = variables_of(plan), flags_of(plan), _attributes(plan, origin)
    points, numbers = (*axes_of(plan),), np.arange(plan.n_blocks)
    for name, values in coordinates(plan).items():
        netcdf.dimension(file, name, values, *meaning_of(name))
    for name, values in plan.together.items():
        netcdf.variable(file, name, (POINT,), values.dtype, meaning_of(name))[...] = values
    netcdf.describe(file["state"], flags_of_states())
    digests = netcdf.group(file, DIGESTS)
    netcdf.dimension(digests, "block", numbers, "number of a block of points", "1")
    for q in variables:
        names, fill = (*points, *([q.along] if q.along else [])), q.fill if q is STATUS else None
        data = netcdf.variable(file, q.variable, names, q.dtype, (q.meaning, q.unit), fill)
        if plan.together:
            netcdf.describe(data, {"coordinates": " ".join(plan.together)})
        netcdf.variable(digests, q.variable, ("block",), "<u8", (f"BLAKE2b of the blocks of {q.variable}", "1"))
    for name, about in flags.items():
        netcdf.describe(file[name], about)
    netcdf.describe(file, attributes)


def flags_of_states() -> dict[str, Any]:
    """Return the attributes of the dimension `state` that name its values."""
    return {"flag_values": np.array(list(State), np.int8), "flag_meanings": " ".join(s.name.lower() for s in State)}


def flags_of(plan: Plan) -> dict[str, dict[str, Any]]:
    """Return the attributes that name the values of the status and of the codes, by variable."""
    advised = [s for s in Status if s is not Status.NOT_COMPUTED]
    codes = {q.variable: q.codes for q in plan.quantities if q.codes}
    return {
        "status": _flags([*advised, Status.NOT_COMPUTED], {s: s.advice for s in advised}),
        **{name: _flags(list(how), {code: code.meaning for code in how}) for name, how in codes.items()},
    }


def _flags(values: Sequence[IntEnum], meanings: Mapping[IntEnum, str]) -> dict[str, Any]:
    return {
        "flag_values": np.array(values, np.int8),
        "flag_meanings": " ".join(value.name.lower() for value in values),
        "comment": "; ".join(f"{int(value)}: {value.name.lower()}: {text}" for value, text in meanings.items()),
    }


def meaning_of(name: str) -> tuple[str, str]:
    """Return (long name, unit) of a coordinate."""
    if name in AXES:
        return AXES[name].meaning, AXES[name].unit
    meanings = {
        "period": "recorded excitation period, counted from 1 after the transient",
        "impact": "main impact, counted from 1 after the transient",
        "state": "state of the motion (Fig. 2)",
        POINT: "number of a point, counted from 0",
    }
    return meanings[name], "1"


def _attributes(plan: Plan, origin: Origin) -> dict[str, Any]:
    """Return the root attributes. They contain no date, so that two runs of one configuration give equal files."""
    scalars = {k: None if math.isnan(v) else v for k, v in plan.scalars.items()}
    parts: dict[str, Any] = {"axes": digests(plan.axes), "scalars": scalars, "settings": vars(plan.settings)}
    parts["tiling"] = plan.chunk
    if plan.record != (SECTION,):
        parts["record"] = [record.outline for record in plan.record]
    if rows := {record: record.rows for record in plan.record if record.rows}:
        parts["rows"] = rows
    if plan.quantities:
        parts["quantities"] = {q.name: q.dtype for q in plan.quantities}
    if plan.together:
        parts["points"] = digests(plan.together)
    outline = json.dumps(parts)
    return {
        "Conventions": "CF-1.10",
        "kind": SWEEP,
        "title": origin.title or "Sweep of a friction-impact oscillator",
        "config": origin.config,
        "config_sha256": digest(origin.config),
        "overrides": json.dumps(origin.overrides),
        "versions": json.dumps(versions()),
        "references": "ZAMM 79 (1999) 6, 389-397",
        **plain(plan),
        "comment": comment(plan),
        SCHEMA: NUMBER,
        "plan": outline,
        "plan_sha256": digest(outline),
    }


def digests(arrays: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Return the SHA-256 of arrays, by name."""
    return {name: hashlib.sha256(values.tobytes()).hexdigest() for name, values in arrays.items()}


def versions() -> dict[str, str]:
    """Return the versions of this package and of the packages that may affect a result."""
    return {
        "vibrodrive": __version__,
        "python": platform.python_version(),
        **{name: _version(name) for name in ("numpy", "numba", "h5py")},
        "hdf5": h5py.version.hdf5_version,
    }


def _version(package: str) -> str:
    """Return the version of a package. Its metadata are read first, because the import of Numba takes half a second."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:  # a frozen program has no metadata
        return str(import_module(package).__version__)
