"""Two layers of checksums, which detect every flipped bit of a file.

HDF5's fletcher32 protects the bytes of a chunk (`jit.fletcher` computes the same sum faster). It does not detect that a
chunk is in the wrong place or was never written, because the index of chunks has no checksum. Therefore each
point has a second checksum, of the values of all its variables and of the number of the point. The points of a block
(one chunk of each variable) are written together. After a power failure the status of a block may be on the disk
without the data of the block, or the index may be damaged. Only the checksums of the points detect these faults.

Zeros are a special case: a chunk whose bytes a power failure or a hole has set to zero has the right fletcher32, 0. So
the lowest byte of a checksum is the status + 1: no computed point has the checksum 0, and a status can be verified
without reading the values. Values that may be such zeros, or that HDF5 fills in for a chunk without an entry in the
index, are verified by the checksums of their points when they are read. So are zeros in integers that may be -1,
because fletcher32 does not distinguish the words 0 and 65535. A block with checksums, but without a status, is looked
up in the index, because its status may be a fill value, too.

The SHA-256 of the plan (model/plan.py) covers the axes, and that of the configuration its text. The other numeric
attributes are compared with the plan.
"""

import hashlib
from collections.abc import Callable
from typing import NamedTuple

import h5py
import numpy as np

from vibrodrive.model.choices import Status
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import SECTIONS, Quantity
from vibrodrive.store.header import BAD_INDEX, BROKEN, is_as_written, is_in_order, is_readable
from vibrodrive.store.layout import SCHEMA, Progress, Tile, any_in_blocks, starts, tiles, variables_of
from vibrodrive.store.netcdf import attribute

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


def is_sealed(file: h5py.File) -> bool:
    """Return True if the lowest byte of the checksums in an open file is the status + 1."""
    return bool(attribute(file, SCHEMA) > 3)


def sealed(sums: np.ndarray, status: np.ndarray) -> np.ndarray:
    """Return checksums whose lowest byte is the status + 1."""
    return sums & ~np.uint64(255) | (status + 1).astype(np.uint64)


def _words(array: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(array).view(np.uint64)


class Marks(NamedTuple):
    """Statuses of all points of a file, and the blocks that these statuses mark as computed."""

    status: np.ndarray  # int8 over the dimensions of the file; NOT_COMPUTED in unreadable blocks
    done: np.ndarray  # bool (blocks,): True for each block that is marked as computed
    wrong: dict[int, str]  # fault of each damaged block, by the number of the block


def read_marks(file: h5py.File, plan: Plan, *, verify: bool = True) -> Marks:
    """Read the statuses of all blocks, and `verify` them. A block counts as computed if no point of the block is
    NOT_COMPUTED."""
    wrong: dict[int, str] = {}
    lost: dict[int, str] = {}
    status = _read_chunks(file["status"], plan, wrong)
    there = status != Status.NOT_COMPUTED
    odd = summed = np.zeros_like(there)
    if verify:
        sums = _read_chunks(file["checksum"], plan, lost)  # later, because a sweep writes the status after its checksum
        odd = there & ((sealed(sums, status) != sums) if is_sealed(file) else (sums == 0))
        summed = sums != 0
    flags = (there, ~there, odd, summed)
    begun, lacking, odd, summed = (any_in_blocks(each, starts(plan)).ravel() for each in flags)
    odd[list(lost)] = summed[list(lost)] = True
    for k in np.flatnonzero(begun & (lacking | odd)).tolist():
        part = "status: only a part of the block is marked as computed"
        wrong[k] = part if lacking[k] else lost.get(k, "status: does not match the checksums of the points")
    unmarked = [k for k in np.flatnonzero(summed & ~begun).tolist() if k not in wrong]
    where = tiles(plan) if wrong or unmarked else []
    if unmarked and is_as_written(file["status"], plan.chunk or (1,)):  # a sweep is writing them, or they are lost
        in_order = is_in_order(file["status"])
        lost_marks = [k for k in unmarked if not (in_order and _is_found(file["status"], where[k]))]
        wrong |= dict.fromkeys(lost_marks, f"status: {BAD_INDEX}")
    for k in wrong:
        status[where[k].slab] = Status.NOT_COMPUTED
    return Marks(status, begun & ~lacking & ~odd, wrong)


def _read_chunks(data: h5py.Dataset, plan: Plan, wrong: dict[int, str]) -> np.ndarray:
    """Return all values of a variable with one value for each point. Unreadable blocks are added to `wrong`, and have
    the fill value."""
    name = data.name.strip("/")
    if not is_readable(data):
        wrong |= dict.fromkeys(range(len(plan.blocks())), f"{name}: {BAD_INDEX}")
        return np.full(data.shape, data.fillvalue, data.dtype)
    try:
        return np.asarray(data[...])
    except BROKEN:  # read the undamaged chunks one by one
        values = np.full(data.shape, data.fillvalue, data.dtype)
        for k, tile in enumerate(tiles(plan)):
            try:
                values[tile.slab] = data[tile.slab]
            except BROKEN:
                wrong[k] = f"{name}: wrong checksum"
        return values


def _is_found(data: h5py.Dataset, tile: Tile) -> bool:
    """Return True if HDF5 finds the chunk of a block: also the keys between the entries of an index may be wrong."""
    try:
        return bool(data.id.read_direct_chunk(tuple(s.start for s in tile.slab)))
    except BROKEN:
        return False


def perhaps_lost(values: np.ndarray, variable: Quantity) -> bool:
    """Return True if values of a block, or of a part of it, may be zeros or fill values in the place of lost values."""
    first, integers = values.flat[0], values.dtype.kind == "i"
    suspect = first == 0 or first == variable.fill or first != first
    if suspect and (((values == 0) if first == 0 else (values == variable.fill) | (values != values)).all()):
        return True
    return integers and variable.along == "impact" and bool((values == 0).any())


def check_blocks(file: h5py.File, where: list[Tile], plan: Plan, progress: Progress) -> Marks:
    """Read all computed blocks, and return the marks of the file. `wrong` includes the blocks with a wrong checksum."""
    marks, check = read_marks(file, plan), checker(file, plan)
    for k in np.flatnonzero(marks.done).tolist():
        if fault := check(where[k]):
            marks.wrong[k] = fault
        progress(k + 1, len(where))
    return marks


def checker(file: h5py.File, plan: Plan) -> Callable[[Tile], str | None]:
    """Return a function that returns the fault of a block that is marked as computed, or None."""
    variables, with_seal = {v: file[v.variable] for v in variables_of(plan)}, is_sealed(file)
    unreadable = [v.variable for v, data in variables.items() if not is_readable(data)]

    def check(tile: Tile) -> str | None:
        if unreadable:
            return f"{unreadable[0]}: {BAD_INDEX}"
        values = {}
        n = tile.stop - tile.start
        for variable, data in variables.items():
            try:
                read = data[tile.slab]
            except BROKEN:
                return f"{variable.variable}: wrong checksum"
            values[variable.name] = read.reshape(n, -1) if variable.along else read.reshape(n)
        status = values["status"]
        if not np.isin(status, ENDINGS).all():
            return "status: unknown value"
        sums = point_sums(tile.start, values["margin"], values["switches"].astype(np.int64), status)
        for column, q in enumerate(SECTIONS):
            sums += section_sums(values[q.name], column) if q.name in values else np.uint64(0)
        for q in plan.quantities:
            sums += record_sums(q.name, values[q.name])
        if not np.array_equal(values["checksum"], sealed(sums, status) if with_seal else sums):
            return "the values do not match their checksum"
        return None

    return check
