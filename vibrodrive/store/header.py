"""Opening a result file: what it says about itself, and whether that is consistent."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from vibrodrive.errors import Busy, Damaged, NoResult, OtherKind
from vibrodrive.model.plan import Plan, Settings
from vibrodrive.model.records import SECTION
from vibrodrive.store.describe import plain
from vibrodrive.store.kind import KINDS, bears_our_names, kind_of, special
from vibrodrive.store.layout import SCHEMA_VERSION, Origin, chunk_of, coordinates, digest, variables_of

BROKEN = (OSError, KeyError, TypeError, ValueError, RuntimeError)
"""Raised by h5py for bytes that it cannot interpret. For single calls of h5py; a whole reader: see `interpreting`."""


class Header(NamedTuple):
    """What a file says about itself, besides its arrays."""

    plan: Plan
    origin: Origin
    versions: dict[str, str]


def open_result(path: Path, mode: str = "r") -> h5py.File:
    """Open a result file of any kind. Raises NoResult, OSError where the system refuses, or Busy where this process
    reads a file that is to be written.

    HDF5's own lock is off in a writer: it would shut readers out while a sweep runs, which the layout
    makes unnecessary. Writers exclude each other by `lock`.
    """
    if (what := special(path)) is not None:  # or the system's own words for a missing one
        raise NoResult(f"{path}: no result file, but {what}")
    with open(path, "rb"):  # the same for a forbidden one
        pass
    if not h5py.is_hdf5(path):
        raise NoResult(f"{path}: no result file (not HDF5, or its beginning is damaged)")
    try:
        return _open(path, mode)
    except OSError as error:
        if "already open" in str(error):
            raise Busy(f"{path}: this process has it open for reading (h5py, xarray): close it there") from None
        what = "truncated" if "truncated" in str(error) else f"damaged beyond reading ({error})"
        raise Damaged(f"{path}: {what}: {remedy(path)}") from error


def remedy(path: Path) -> str:
    """What to do about a file that is damaged beyond reading."""
    return "restore it, or replace it with --overwrite" if bears_our_names(path) else "restore or delete it"


@contextlib.contextmanager
def interpreting(path: str | Path) -> Iterator[None]:
    """Raise Damaged for contents that make no sense to the reader in the block.

    A TypeError counts only if h5py raised it: anywhere else it is an error of the reader.
    """
    try:
        yield
    except NoResult:
        raise
    except BROKEN as error:
        if isinstance(error, TypeError) and not _raised_by_h5py(error):
            raise
        what = " ".join(str(error).split())
        raise Damaged(f"{path}: damaged beyond reading ({what}): {remedy(Path(path))}") from error


def _raised_by_h5py(error: BaseException) -> bool:
    frames = [frame for frame, _ in traceback.walk_tb(error.__traceback__)]
    return bool(frames) and str(frames[-1].f_globals.get("__name__")).startswith("h5py")


def read_kind(path: Path) -> str:
    """The kind of a result file, one of kind.KINDS.

    Raises
    ------
    NoResult
        if it is no result file, or of a kind that this version does not know; Damaged if it cannot be read.
    OSError
        if the system refuses.
    """
    with open_result(path) as file, interpreting(path):
        kind = kind_of(file)
    if kind is None:
        raise NoResult(f"{path}: no result file of vibrodrive")
    if kind not in KINDS:
        raise NoResult(f"{path}: kind = {kind!r}: must be one of {', '.join(KINDS)} for this version of vibrodrive")
    return kind


def read_origin(path: Path) -> Origin:
    """The configuration in a result file of any kind, empty where it cannot be read. Raises as `open_result`."""
    with open_result(path) as file:
        try:
            attrs = dict(file.attrs)
            return Origin(str(attrs["config"]), tuple(json.loads(attrs["overrides"])), str(attrs["title"]))
        except BROKEN:
            return Origin("")


def expect_kind(file: h5py.File, wanted: str) -> None:
    """Raise OtherKind if an open file is of another kind, NoResult if it is no result file.

    A file that cannot be interpreted at all passes: reading it will report what is wrong.
    """
    path = file.filename
    try:
        found = kind_of(file)
    except BROKEN:
        return
    if found is None:
        raise NoResult(f"{path}: no result file of vibrodrive")
    if found not in KINDS:
        raise OtherKind(f"{path}: holds {found!r}, which this version does not know, not {KINDS[wanted].holds}")
    if found != wanted:
        raise OtherKind(
            f"{path}: holds {KINDS[found].holds}, made by `vibrodrive {KINDS[found].command}`, "
            f"not {KINDS[wanted].holds}: `vibrodrive info` and `vibrodrive plot` read it"
        )


def refuse_foreign(path: Path) -> None:
    """Raise NoResult if a file is there and is no result file of this program: only such may be replaced.

    A damaged one counts as long as it can be recognised.
    """
    if not path.exists():
        return
    try:
        with open_result(path) as file:
            ours = kind_of(file) is not None
    except NoResult as error:
        if isinstance(error, Damaged) and bears_our_names(path):
            return
        raise NoResult(f"{error}; --overwrite replaces result files only") from None
    except BROKEN:
        ours = bears_our_names(path)
    if not ours:
        raise NoResult(f"{path}: no result file of vibrodrive; --overwrite replaces result files only")


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
    expect_kind(file, "sweep")
    with interpreting(path):
        version = attrs.get("schema_version")
        if version is None:
            raise NoResult(f"{path}: no result file (no schema_version)")
        if version != SCHEMA_VERSION:
            raise NoResult(
                f"{path}: schema_version = {version}: must be {SCHEMA_VERSION} for this version of vibrodrive: "
                "compute it again, into another file or with --overwrite"
            )
        text = str(attrs["config"])
        if digest(text) != attrs["config_sha256"]:
            raise Damaged(f"{path}: damaged: the configuration does not have the SHA-256 written beside it")
        if digest(str(attrs["plan"])) != attrs["plan_sha256"]:
            raise Damaged(f"{path}: damaged: the plan does not have the SHA-256 written beside it")
        outline = json.loads(attrs["plan"])
        digests = outline["axes"] | outline.get("points", {})
        along = {name: file[name][...] for name in digests}
        for name, values in along.items():
            if hashlib.sha256(values.tobytes()).hexdigest() != digests[name]:
                raise Damaged(f"{path}: damaged: axis {name} is not what was written")
        axes = {name: along[name] for name in outline["axes"]}
        together = {name: along[name] for name in outline.get("points", {})}
        scalars = {k: math.nan if v is None else v for k, v in outline["scalars"].items()}
        tiling = file["status"].chunks if axes else None
        record, carry = tuple(outline.get("record", (SECTION,))), outline.get("carry", "")
        plan = Plan(axes, scalars, Settings(**outline["settings"]), tiling, record, together, carry)
        for variable in variables_of(plan):
            data = file[variable.name]
            if data.chunks != chunk_of(variable, plan) or data.dtype != np.dtype(variable.dtype):
                raise Damaged(f"{path}: damaged: {variable.name} is not laid out as it should be")
        return Header(
            plan,
            Origin(text, tuple(json.loads(attrs["overrides"])), str(attrs["title"])),
            json.loads(attrs["versions"]),
        )


def damaged_descriptions(file: h5py.File, plan: Plan) -> list[str]:
    """Which coordinates, and which plain root attributes, are not what was written."""
    wrong = [f"coordinate {name}" for name in _damaged_coordinates(file, plan)]
    for name, value in plain(plan).items():
        try:
            if file.attrs[name] != value:
                wrong.append(f"attribute {name}")
        except BROKEN:
            wrong.append(f"attribute {name}")
    return wrong


def _damaged_coordinates(file: h5py.File, plan: Plan) -> list[str]:
    wrong = []
    for name, values in coordinates(plan).items():
        try:
            stored = file[name]
            if stored.shape != values.shape or not np.array_equal(stored[...], values):
                wrong.append(name)
        except BROKEN:
            wrong.append(name)
    return wrong
