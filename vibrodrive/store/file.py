"""Files written in one go, and what all kinds of them have in common: how they appear, what they hold, are they whole.

A sweep, which is laid out first and then filled for hours, has a writer of its own (`store`).
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import json
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import h5py
import numpy as np

from vibrodrive.errors import Damaged, Unwritable
from vibrodrive.model.plan import Plan
from vibrodrive.store.compare import differences, refuse_different
from vibrodrive.store.draft import drafted, target_of
from vibrodrive.store.header import BROKEN, expect_kind, interpreting, open_result, refuse_foreign, remedy
from vibrodrive.store.layout import digest
from vibrodrive.store.lock import Lock

SEAL = "content_sha256"
"""Root attribute: SHA-256 of everything the file holds, where nothing is added later."""


def unwritable(error: BaseException, path: Path) -> Unwritable:
    """An error of HDF5, which comes as a page of text, as the system's own sentence."""
    if isinstance(error, OSError) and error.errno:
        return Unwritable(error.errno, error.strerror, str(path))
    number = re.search(r"errno = (\d+)", str(error))
    code = int(number[1]) if number else errno.EIO
    return Unwritable(code, os.strerror(code), str(path))


def refuse_moved(path: Path) -> None:
    """Raise Unwritable if an open file no longer has its name: what is written to it would be lost."""
    if not path.exists():
        raise Unwritable(errno.ENOENT, "moved or deleted while it was written", str(path))


@contextlib.contextmanager
def new_file(path: Path, *, seal: bool = False) -> Iterator[h5py.File]:
    """An empty HDF5 file that gets its name when the block ends well, in the place of a result file of that name.

    With `seal` the SHA-256 of all it holds is written into it.

    Raises
    ------
    NoResult
        if the name belongs to something else than a result file of this program.
    Busy
        if another process is writing the file of that name.
    Unwritable
        if the system refuses; nothing is left behind then, and an older file of that name stays.
    """
    refuse_foreign(path)
    # in memory: HDF5 does not recover from a full disk, not even at the end of the process
    with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
        yield file
        if seal:
            file.attrs[SEAL] = content_digest(file)
        file.flush()
        content = file.id.get_file_image()
    try:
        _replace(path, content)
    except OSError as error:
        raise unwritable(error, path) from None


def _replace(path: Path, content: bytes) -> None:
    """Put a file in its place, whole or not at all."""
    refuse_foreign(path)  # it may have appeared in the meantime
    old = Lock(target_of(path), name=path) if path.exists() else None
    try:
        with drafted(path) as draft:
            with open(draft, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            if old is not None:
                old.yield_to_renaming()
    finally:
        if old is not None:
            old.release()


@contextlib.contextmanager
def reading(path: Path, kind: str, mode: str = "r") -> Iterator[h5py.File]:
    """A file of one kind, open. Raises as `header.open_result`, and Damaged for what makes no sense."""
    with open_result(path, mode) as file:
        expect_kind(file, kind)
        with interpreting(path):
            yield file


def made_already(path: Path, kind: str, plan: Plan, given: Mapping[str, object] | None = None, **own: object) -> bool:
    """Whether a file is there, whole, and made from what is to be computed (see compare.differences).

    Raises
    ------
    Different
        if it was made from something else.
    NoResult
        if it is of another kind, or damaged.
    OSError
        if the system refuses.
    """
    if not path.exists():
        return False
    with reading(path, kind) as file:
        faults = find_faults(file)
        found = differences(file, plan, given, **own) if not faults else []
    if faults:
        raise Damaged(f"{path}: damaged ({faults[0]}): {remedy(path)}")
    refuse_different(path, found)
    return True


class Summary(NamedTuple):
    """What a file that is no sweep holds, for `info` and `verify`.

    `share` is the part that is computed, 0 to 1. `faults` are empty unless everything was to be read. `lines` say it to
    a person; `facts` are the same for a program, of types that JSON knows (NaN and inf among the numbers).
    """

    title: str
    share: float
    lines: list[tuple[str, str]]
    faults: list[str]
    facts: Mapping[str, Any] = MappingProxyType({})


def axis_facts(values: np.ndarray) -> dict[str, Any]:
    """An axis for a program: its first and last value, and how many there are."""
    return {"first": float(values[0]), "last": float(values[-1]), "num": len(values)}


def axis_line(name: str, values: np.ndarray, unit: str = "") -> tuple[str, str]:
    """The same for a person."""
    return "axis", f"{name} = {values[0]:g} to {values[-1]:g}{f' {unit}' if unit else ''}, {len(values)} values"


def counted(kinds: h5py.Dataset) -> dict[str, int]:
    """How often each text occurs in a dataset, in the order of the alphabet."""
    return dict(sorted(Counter(kinds.asstr()[...].tolist()).items()))


def versions_of(file: h5py.File) -> dict[str, str]:
    """Versions of the programs that made a file."""
    return json.loads(file.attrs["versions"])


def find_faults(file: h5py.File) -> list[str]:
    """Read everything: what does not have the checksum that was written beside it?"""
    attrs = file.attrs
    faults = []
    if "config_sha256" in attrs and digest(str(attrs["config"])) != attrs["config_sha256"]:
        faults.append("the configuration does not have the SHA-256 written beside it")
    for name, data in _datasets(file):
        try:
            data[...]
        except BROKEN:
            faults.append(f"{name}: its checksum does not fit")
    if SEAL in attrs and not faults and content_digest(file) != attrs[SEAL]:
        faults.append("the contents do not have the SHA-256 written beside them")
    return faults


def content_digest(file: h5py.File) -> str:
    """SHA-256 of the names, shapes and values of all datasets."""
    total = hashlib.sha256()
    for name, data in _datasets(file):
        values = data[...]
        if values.dtype.kind == "O":  # texts of any length
            values = np.array([len(v) for v in values.ravel()]), b"".join(values.ravel())
        else:
            values = (values,)
        total.update(f"{name} {data.shape} {data.dtype.str}".encode())
        for part in values:
            total.update(part if isinstance(part, bytes) else np.ascontiguousarray(part).tobytes())
    return total.hexdigest()


def _datasets(file: h5py.File) -> list[tuple[str, h5py.Dataset]]:
    found: list[tuple[str, h5py.Dataset]] = []
    file.visititems(lambda name, item: found.append((name, item)) if isinstance(item, h5py.Dataset) else None)
    return sorted(found, key=lambda pair: pair[0])


def summary(path: Path, thorough: bool = False) -> Summary:
    """What a file of single motions (NAME_switches.h5 of `paper`) holds; `thorough` looks for faults."""
    with reading(path, "switches") as file:
        faults = find_faults(file) if thorough else []
        if faults:
            return Summary(str(file.attrs["title"]), 1.0, [], faults)
        motions = {
            name: {
                "switches": len(group["switches"]), "periods": len(group["section"]), "A": float(group.attrs["A"]),
            } for name, group in file.items()
        }  # fmt: skip
        lines = [(k, f"{m['switches']} switches, {m['periods']} periods, A = {m['A']:g}") for k, m in motions.items()]
        facts = {"motions": motions, "versions": versions_of(file)}
        return Summary(str(file.attrs["title"]), 1.0, lines, faults, facts)
