"""Opening a result file: what it says about itself, and whether that can be believed."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np

from vibrodrive.plan import Plan, Settings
from vibrodrive.store_layout import SCHEMA_VERSION, VARIABLES, Origin, chunk_of, coordinates, digest

BROKEN = (OSError, KeyError, TypeError, ValueError, AttributeError, RuntimeError)
"""What h5py raises where the bytes it meets mean nothing."""


class NoResult(ValueError):
    """A file that is no (whole, readable) result file of this version; the message is one line."""


class Damaged(NoResult):
    """A result file that cannot be read (as a whole, or one of its blocks); the message is one line."""


class Header(NamedTuple):
    """What a file says about itself, besides its arrays."""

    plan: Plan
    origin: Origin
    created: str
    versions: dict[str, str]


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
