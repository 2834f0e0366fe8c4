"""Two layers of checksums, which detect every flipped bit of a file.

HDF5's fletcher32 protects the bytes of a chunk (`jit.fletcher` computes the same sum faster). It does not detect that a
chunk is in the wrong place or was never written, because the index of chunks has no checksum. Therefore each
point has a second checksum, of the values of all its variables and of the number of the point. The points of a block
(one chunk of each variable) are written together. After a power failure the status of a block may be on the disk
without the data of the block, or the index may be damaged. Only the checksums of the points detect these faults.

The SHA-256 of the plan (model/plan.py) covers the axes, and that of the configuration its text. The other numeric
attributes are compared with the plan.
"""

import hashlib
from typing import NamedTuple

import h5py
import numpy as np

from vibrodrive.model.choices import Status
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import SECTIONS
from vibrodrive.store.header import BROKEN
from vibrodrive.store.layout import Progress, Tile, variables_of

_POINT = np.uint64(0x9E3779B97F4A7C15)
_SECTION = np.array([1, 0xBF58476D1CE4E5B9], np.uint64)
_MARGIN = np.uint64(0x94D049BB133111EB)
_STATUS = np.uint64(0xD6E8FEB86659FD93)
_SWITCHES = np.array([0xFF51AFD7ED558CCD, 0xC4CEB9FE1A85EC53, 0x2545F4914F6CDD1D, 0xDA942042E4DD58B5,
                      0x369DEA0F31A53F85], np.uint64)  # fmt: skip
"""Arbitrary odd weights of the summands. Different words modulo 2**64 have different products with an odd weight."""

ENDINGS = [int(s) for s in Status if s is not Status.NOT_COMPUTED]


def point_sums(start: int, margin: np.ndarray, switches: np.ndarray, status: np.ndarray) -> np.ndarray:
    """Return the checksums uint64 of the points start, start + 1, …, without the summands of `section_sums` and
    `record_sums`.

    margin is float64 (points,), switches int64 (points, 5), status int8 (points,).
    """
    total = np.arange(start + 1, start + 1 + len(status), dtype=np.uint64) * _POINT
    total += _words(margin) * _MARGIN
    total += np.add.reduce(_words(switches) * _SWITCHES, axis=1)
    total += status.astype(np.uint64) * _STATUS
    return total


def section_sums(values: np.ndarray, column: int) -> np.ndarray:
    """Return the summand of each checksum, uint64 (points,), for one column of a section.

    values : float64 (points, periods), ξ (column 0) or ξ' (column 1).
    """
    return np.add.reduce(_words(values), axis=1) * _SECTION[column]


def record_sums(name: str, values: np.ndarray) -> np.ndarray:
    """Return the summand of each checksum, uint64 (points,), for the recorded quantity `name`, (points, …) of any
    type."""
    weight = np.frombuffer(hashlib.sha256(name.encode()).digest()[:8], "<u8") | np.uint64(1)
    rows = np.ascontiguousarray(values).reshape(len(values), -1)
    words = rows.view(f"<u{rows.dtype.itemsize}").astype(np.uint64)
    return np.add.reduce(words, axis=1) * weight


def _words(array: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(array).view(np.uint64)


class Marks(NamedTuple):
    """Statuses of all points of a file, and the blocks that these statuses mark as computed."""

    status: np.ndarray  # int8 over the dimensions of the file; NOT_COMPUTED in unreadable blocks
    done: np.ndarray  # bool (blocks,): True for each block that is marked as computed
    wrong: dict[int, str]  # fault of each damaged block, by the number of the block


def read_marks(file: h5py.File, where: list[Tile]) -> Marks:
    """Read the statuses of all blocks. A block counts as computed if no point of the block is NOT_COMPUTED."""
    data, wrong = file["status"], {}
    try:
        status = data[...]
    except OSError:  # read the undamaged chunks one by one
        status = np.full(data.shape, int(Status.NOT_COMPUTED), np.int8)
        for k, tile in enumerate(where):
            try:
                status[tile.slab] = data[tile.slab]
            except OSError:
                wrong[k] = "status: wrong checksum"
    done = np.zeros(len(where), bool)
    for k, tile in enumerate(where):
        missing = status[tile.slab] == Status.NOT_COMPUTED
        done[k] = not missing.any()
        if missing.any() and not missing.all():
            wrong[k] = "status: only a part of the block is marked as computed"
    return Marks(status, done, wrong)


def check_blocks(file: h5py.File, where: list[Tile], plan: Plan, progress: Progress) -> Marks:
    """Read all computed blocks, and return the marks of the file. `wrong` includes the blocks with a wrong checksum."""
    marks = read_marks(file, where)
    for k in np.flatnonzero(marks.done).tolist():
        if fault := check_block(file, where[k], plan):
            marks.wrong[k] = fault
        progress(k + 1, len(where))
    return marks


def check_block(file: h5py.File, tile: Tile, plan: Plan) -> str | None:
    """Return the fault of a block that is marked as computed, or None."""
    values = {}
    n = tile.stop - tile.start
    for variable in variables_of(plan):
        try:
            read = file[variable.variable][tile.slab]
        except BROKEN:
            return f"{variable.variable}: wrong checksum"
        values[variable.name] = read.reshape(n, -1) if variable.along else read.reshape(n)
    if not np.isin(values["status"], ENDINGS).all():
        return "status: unknown value"
    sums = point_sums(tile.start, values["margin"], values["switches"].astype(np.int64), values["status"])
    for column, q in enumerate(SECTIONS):
        sums += section_sums(values[q.name], column) if q.name in values else np.uint64(0)
    for q in plan.quantities:
        sums += record_sums(q.name, values[q.name])
    if not np.array_equal(values["checksum"], sums):
        return "the values do not match their checksum"
    return None
