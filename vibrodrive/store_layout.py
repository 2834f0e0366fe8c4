"""The result file as it lies on the disk: HDF5 with netCDF-4 dimension scales, laid out whole beforehand.

One dimension per axis, in order, then `period` (and `state` for the switch counts). Every chunk of every
variable is allocated before the first point is computed, so that a running sweep overwrites chunks in
place and never touches the structure of the file: a kill can hurt no more than the chunk being written.
A sweep of one point has no axes; its file has a nameless axis `point` of length 1.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import platform
from collections.abc import Callable
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from vibrodrive.parameters import PARAMETERS, Method, Scan, State, Status
from vibrodrive.plan import Plan, Settings

SCHEMA_VERSION = 1

Progress = Callable[[int, int], None]
"""Called with (done, of how many)."""


def quiet(done: int, total: int) -> None:
    """Progress nobody watches."""


class Variable(NamedTuple):
    """A variable of the file: what it is called, holds, and is filled with until it is computed."""

    name: str
    dtype: str
    extra: str  # the dimension after the axes, if any
    fill: Any
    long_name: str


VARIABLES = (
    Variable("section_xi", "<f8", "period", math.nan, "gap ξ at the instants of the Poincaré section"),
    Variable("section_dxi", "<f8", "period", math.nan, "velocity ξ' at the instants of the Poincaré section"),
    Variable("margin", "<f8", "", math.nan, "how close the closest decision came to going the other way"),
    Variable("switches", "<i8", "state", -1, "switches into each state within the recorded periods"),
    Variable("checksum", "<u8", "", 0, "weighted sum of the words of a point's values (see store_check)"),
    Variable("status", "<i1", "", int(Status.NOT_COMPUTED), "how the trajectory ended"),
)
"""In the order in which a block is written: the status is the mark that commits it."""


BROKEN = (OSError, KeyError, TypeError, ValueError, AttributeError, RuntimeError)
"""What h5py raises where the bytes it meets mean nothing."""


class NoResult(ValueError):
    """A file that is no (whole, readable) result file of this version; the message is one line."""


class Damaged(NoResult):
    """A result file that cannot be read (as a whole, or one of its blocks); the message is one line."""


class Origin(NamedTuple):
    """Where a sweep comes from: the configuration verbatim, the options that replace parts of it, a title."""

    config: str
    overrides: tuple[str, ...] = ()
    title: str = ""


class Header(NamedTuple):
    """What a file says about itself, besides its arrays."""

    plan: Plan
    origin: Origin
    created: str
    versions: dict[str, str]


def digest(text: str) -> str:
    """SHA-256 of a configuration as it is written in a file."""
    return hashlib.sha256(text.encode()).hexdigest()


def axes_of(plan: Plan) -> dict[str, np.ndarray]:
    """The axes as dimensions of the file."""
    return plan.axes or {"point": np.zeros(1)}


def coordinates(plan: Plan) -> dict[str, np.ndarray]:
    """All dimensions of the file and their values."""
    periods = np.arange(1, plan.settings.periods + 1)
    return {**axes_of(plan), "period": periods, "state": np.array(list(State), np.int8)}


class Tile(NamedTuple):
    """A block in the file: points start to stop of the flattened sweep, as slices over the dimensions."""

    start: int
    stop: int
    slab: tuple[slice, ...]


def tiles(plan: Plan) -> list[Tile]:
    """Where the blocks lie, in the order of plan.blocks()."""
    shape, chunk = plan.shape or (1,), plan.chunk or (1,)
    cuts = [[slice(c, min(c + k, n)) for c in range(0, n, k)] for n, k in zip(shape, chunk, strict=True)]
    return [
        Tile(start, stop, slab)
        for (start, stop), slab in zip(plan.blocks(), itertools.product(*cuts), strict=True)
    ]


def blank(variable: Variable, chunk: tuple[int, ...]) -> bytes:
    """An empty chunk as it lies in the file, its checksum included."""
    with h5py.File("blank", "w", driver="core", backing_store=False) as memory:
        data = memory.create_dataset(
            "chunk", data=np.full(chunk, variable.fill, variable.dtype), chunks=chunk, fletcher32=True
        )
        return data.id.read_direct_chunk((0,) * len(chunk))[1]


def chunk_of(variable: Variable, plan: Plan) -> tuple[int, ...]:
    """Shape of a chunk of a variable: a block of points, and the extra dimension whole."""
    extra = {"": (), "period": (plan.settings.periods,), "state": (len(State),)}[variable.extra]
    return (plan.chunk or (1,)) + extra


def lay_out(file: h5py.File, plan: Plan, origin: Origin, progress: Progress = quiet) -> None:
    """Write everything but the results into an empty file, and room for all of them."""
    for name, values in coordinates(plan).items():
        _coordinate(file, name, values)
    file["state"].attrs["flag_values"] = np.array(list(State), np.int8)
    file["state"].attrs["flag_meanings"] = " ".join(s.name.lower() for s in State)
    where = tiles(plan)
    for n, variable in enumerate(VARIABLES):
        empty, data = blank(variable, chunk_of(variable, plan)), _variable(file, variable, plan)
        for k, tile in enumerate(where):
            put_chunk(data, tile, empty)
            progress(n * len(where) + k + 1, len(VARIABLES) * len(where))
    flags = [s for s in Status if s is not Status.NOT_COMPUTED]
    file["status"].attrs["flag_values"] = np.array([*flags, Status.NOT_COMPUTED], np.int8)
    file["status"].attrs["flag_meanings"] = " ".join(s.name.lower() for s in [*flags, Status.NOT_COMPUTED])
    file.attrs.update(_attributes(plan, origin))


def damaged_coordinates(file: h5py.File, plan: Plan) -> list[str]:
    """Which coordinates are not what was written."""
    wrong = []
    for name, values in coordinates(plan).items():
        try:
            if not np.array_equal(file[name][...], values):
                wrong.append(name)
        except BROKEN:
            wrong.append(name)
    return wrong


def _coordinate(file: h5py.File, name: str, values: np.ndarray) -> None:
    chunks = (min(len(values), 1 << 16),)
    data = file.create_dataset(name, data=values, chunks=chunks, fletcher32=True)
    data.make_scale(name)
    data.attrs["units"] = "1"
    data.attrs["long_name"] = _meaning(name)


def _meaning(name: str) -> str:
    if name in PARAMETERS:
        return PARAMETERS[name].meaning
    return {
        "period": "recorded excitation period, counted from 1 after the transient",
        "state": "state of the motion (Fig. 2)",
        "point": "the one point of this sweep",
    }[name]


def _variable(file: h5py.File, variable: Variable, plan: Plan) -> h5py.Dataset:
    names = [*axes_of(plan), *([variable.extra] if variable.extra else [])]
    shape = tuple(len(file[n]) for n in names)
    data = file.create_dataset(
        variable.name,
        shape,
        variable.dtype,
        chunks=chunk_of(variable, plan),
        fletcher32=True,
        fillvalue=variable.fill,
    )
    for k, name in enumerate(names):
        data.dims[k].attach_scale(file[name])
    data.attrs["units"] = "1"
    data.attrs["long_name"] = variable.long_name
    return data


def put_chunk(data: h5py.Dataset, tile: Tile, content: bytes | np.ndarray) -> None:
    """Write one chunk as it lies in the file, whatever lies there now."""
    corner = tuple(s.start for s in tile.slab)
    data.id.write_direct_chunk(corner + (0,) * (data.ndim - len(corner)), content)


def _attributes(plan: Plan, origin: Origin) -> dict[str, Any]:
    scalars = {k: None if math.isnan(v) else v for k, v in plan.scalars.items() if k not in plan.axes}
    axes = {name: hashlib.sha256(values.tobytes()).hexdigest() for name, values in plan.axes.items()}
    outline = json.dumps({"axes": axes, "scalars": scalars, "settings": vars(plan.settings)})
    return {
        "Conventions": "CF-1.10",
        "title": origin.title or "Sweep of a friction-impact oscillator",
        "schema_version": SCHEMA_VERSION,
        "config": origin.config,
        "config_sha256": digest(origin.config),
        "overrides": json.dumps(origin.overrides),
        "method": Method(plan.settings.method).name.lower(),
        "scan": Scan(plan.settings.scan).name.lower(),
        "plan": outline,
        "plan_sha256": digest(outline),
        "versions": json.dumps(_versions()),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _versions() -> dict[str, str]:
    from vibrodrive import __version__

    packages = {name: metadata.version(name) for name in ("numpy", "numba", "h5py")}
    return {
        "vibrodrive": __version__,
        "python": platform.python_version(),
        **packages,
        "hdf5": h5py.version.hdf5_version,
    }


def open_result(path: Path, mode: str = "r") -> h5py.File:
    """Open a result file. Raises NoResult, or OSError where the system refuses.

    HDF5's own lock is off in a writer: it would shut readers out while a sweep runs, which the layout
    makes unnecessary. Writers exclude each other by `store_lock`.
    """
    with open(path, "rb"):  # the system's own words for a missing or forbidden file
        pass
    if not h5py.is_hdf5(path):
        raise NoResult(f"{path}: no result file (not HDF5, or its beginning is damaged)")
    try:
        return _open(path, mode)
    except OSError as error:
        what = "truncated" if "truncated" in str(error) else f"damaged beyond reading ({error})"
        raise Damaged(f"{path}: {what}: restore it, or replace it with --overwrite") from None


def _open(path: Path, mode: str) -> h5py.File:
    if mode == "r":
        try:
            return h5py.File(path, "r")
        except OSError as error:
            if "locking flag" not in str(error):
                raise
    # HDF5 wants all handles of one process on a file to agree, and this process is writing it
    return h5py.File(path, mode, locking=False, rdcc_nbytes=0)


def read_header(file: h5py.File) -> Header:
    """Rebuild the plan a file was laid out for, and check it. Raises NoResult."""
    path, attrs = file.filename, file.attrs
    try:
        version = attrs.get("schema_version")
        if version is None:
            raise NoResult(f"{path}: no result file (no schema_version)")
        if version != SCHEMA_VERSION:
            raise NoResult(
                f"{path}: schema_version = {version}: must be {SCHEMA_VERSION}, "
                f"the one this version of vibrodrive reads and writes"
            )
        text = str(attrs["config"])
        if digest(text) != attrs["config_sha256"]:
            raise Damaged(f"{path}: damaged: the configuration does not have the SHA-256 written beside it")
        if digest(str(attrs["plan"])) != attrs["plan_sha256"]:
            raise Damaged(f"{path}: damaged: the plan does not have the SHA-256 written beside it")
        outline = json.loads(attrs["plan"])
        axes = {name: file[name][...] for name in outline["axes"]}
        for name, values in axes.items():
            if hashlib.sha256(values.tobytes()).hexdigest() != outline["axes"][name]:
                raise Damaged(f"{path}: damaged: axis {name} is not what was written")
        scalars = {k: math.nan if v is None else v for k, v in outline["scalars"].items()}
        tiling = file["status"].chunks if axes else None
        plan = Plan(axes, scalars, Settings(**outline["settings"]), tiling)
        for variable in VARIABLES:
            data = file[variable.name]
            if data.chunks != chunk_of(variable, plan) or data.dtype != np.dtype(variable.dtype):
                raise Damaged(f"{path}: damaged: {variable.name} is not laid out as it should be")
        return Header(
            plan,
            Origin(text, tuple(json.loads(attrs["overrides"])), str(attrs["title"])),
            str(attrs["created"]),
            json.loads(attrs["versions"]),
        )
    except NoResult:
        raise
    except BROKEN as error:
        raise Damaged(f"{path}: damaged beyond reading ({error}): replace it with --overwrite") from None
