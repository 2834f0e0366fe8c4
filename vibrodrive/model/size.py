"""Size of a sweep in memory and on disk. A sweep that is too large is refused before it starts."""

import math
import os
import shutil
import sys
from pathlib import Path

from vibrodrive.errors import TooLarge
from vibrodrive.model.plan import IN_FLIGHT, Plan
from vibrodrive.model.records import point_bytes, quantities

PERIODS_MAX = 2**29 - 1
"""Largest number of recorded periods. All ξ (or ξ') of one point are in one HDF5 chunk, and a chunk is below 4 GiB."""

POINT_BYTES = 8 + 5 * 8 + 8 + 1
"""Bytes of a point in addition to its records: margin, five numbers of switches, checksum and status."""


def human(n_bytes: float) -> str:
    """Return a number of bytes with a decimal prefix: 1234567 -> '1.2 MB'."""
    for unit in ("B", "kB", "MB", "GB", "TB", "PB"):
        if n_bytes < 1000:
            return f"{n_bytes:.0f} {unit}" if unit == "B" else f"{n_bytes:.1f} {unit}"
        n_bytes /= 1000
    return f"{n_bytes:.3g} EB"


def available_memory() -> int:
    """Return the bytes that can be allocated without swapping (Linux), or the total memory (other systems).

    On Windows Python has no such function. The result is then `sys.maxsize`, which disables the checks of memory.
    """
    try:
        with open("/proc/meminfo") as lines:
            for line in lines:
                if line.startswith("MemAvailable:"):
                    return int(line.split()[1]) * 1024
    except OSError:
        pass
    if not hasattr(os, "sysconf"):
        return sys.maxsize
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _bytes_of_a_point(plan: Plan) -> int:
    return point_bytes(plan.record, plan.settings.periods) + POINT_BYTES


def result_bytes(plan: Plan) -> int:
    """Return the bytes of all arrays of a Results."""
    return plan.n_points * _bytes_of_a_point(plan)


def file_bytes(plan: Plan) -> int:
    """Return the bytes of a result file, within about 1 %. HDF5 stores full chunks, even at the ends of the axes."""
    chunks = math.prod(-(-n // c) for n, c in zip(plan.shape, plan.chunk, strict=True))
    rows = chunks * math.prod(plan.chunk)
    per_chunk = (6 + len(quantities(plan.record))) * (4 + 40)  # a checksum and an index entry for each variable
    axes = 8 * (sum(plan.shape) + plan.settings.periods)
    tables = 40_000 + 3_200 * len(quantities(plan.record))
    return rows * _bytes_of_a_point(plan) + chunks * per_chunk + axes + tables


def block_bytes(plan: Plan) -> int:
    """Return the bytes of one block in memory."""
    return math.prod(plan.chunk) * _bytes_of_a_point(plan)


def working_bytes(plan: Plan, remote: bool = False) -> int:
    """Return the bytes of the blocks that are in memory at one time, for all threads together.

    These are the blocks being computed, the same number of blocks being written, and the writer's copy of one
    coordinate of a block. With an executor (`remote`), the blocks of submitted tasks replace the computed and written
    blocks.
    """
    block = block_bytes(plan)
    points = min(plan.n_points, plan.wave_points)
    return (IN_FLIGHT if remote else 2) * max(block, points * _bytes_of_a_point(plan)) + block // 2


def _refuse(what: str, takes: str, need: int, have: int, room: str = "memory", are: str = "available") -> None:
    """Raise TooLarge if `need` exceeds `have` (bytes). `takes` is a part of the message, such as "the file takes"."""
    if need > have:
        raise TooLarge(f"{what}: must be small enough for {room}; {takes} {human(need)}, and {human(have)} are {are}")


def refuse_large_axis(key: str, num: int) -> None:
    """Raise TooLarge if the values of one axis and their temporary copies do not fit into memory."""
    _refuse(f"{key} = {num}", "its values and their copies take", 4 * 8 * num, available_memory())


def refuse_large_block(plan: Plan, remote: bool = False) -> None:
    """Raise TooLarge if a point exceeds a chunk, or if the blocks that exist at one time do not fit into memory."""
    if plan.settings.periods > PERIODS_MAX:
        raise TooLarge(f"periods = {plan.settings.periods}: must be <= {PERIODS_MAX}, the limit of the file format")
    what = f"periods = {plan.settings.periods}"
    _refuse(what, "the blocks computed at one time take", working_bytes(plan, remote), available_memory())


def refuse_large_results(plan: Plan) -> None:
    """Raise TooLarge if the results of a sweep do not fit into memory."""
    are = "available (with a result file, only blocks are in memory)"
    _refuse(_extent(plan), "the results take", result_bytes(plan), available_memory(), are=are)


LARGE = 1 << 26  # up to this number of bytes memory is not checked, because a check takes as long as a short motion
ROW_BYTES = 34 + 24  # bytes of one switch of a single motion, with its error bounds

MOTION_BYTES = 2 * 16 + 2 * 32
"""Bytes of one period of a single motion: its section point with error bounds, and two main impacts."""


def fitting_rows(periods: int, rows: int) -> int:
    """Return the number of rows to allocate for the switches of one motion, at most `rows`.

    Raises TooLarge if the section of the motion does not fit into memory.
    """
    if MOTION_BYTES * periods + ROW_BYTES * rows <= LARGE:
        return rows
    need, have = MOTION_BYTES * periods, available_memory()
    _refuse(f"periods = {periods}", "the section points, error bounds and main impacts take", need, have)
    return min(rows, 64 + (have - need) // (2 * ROW_BYTES))


def refuse_many_rows(periods: int, rows: int) -> None:
    """Raise TooLarge if the switches of one motion do not fit into memory."""
    need = MOTION_BYTES * periods + ROW_BYTES * rows
    if need > LARGE:
        _refuse(f"periods = {periods}", f"{rows} switches take", need, available_memory())


def refuse_large_sample(per_period: int, instants: int) -> None:
    """Raise TooLarge if the instants of one motion do not fit into memory."""
    need = 64 * instants  # τ, ξ, ξ', H and the state, and temporary arrays
    if need > LARGE:
        _refuse(f"points_per_period = {per_period}", f"{instants} instants take", need, available_memory())


def refuse_large_file(plan: Plan, path: Path) -> None:
    """Raise TooLarge if the result file exceeds the free space of the disk, or the file size limit of the shell."""
    need, have = file_bytes(plan), shutil.disk_usage(path.absolute().parent).free
    _refuse(_extent(plan), "the file takes", need, have, "the disk", "free")
    if (limit := _file_size_limit()) is not None:
        _refuse(_extent(plan), "the file takes", need, limit, "the file size limit", "allowed (ulimit -f)")


def _extent(plan: Plan) -> str:
    return f"{plan.n_points} points x {plan.settings.periods} periods"


def _file_size_limit() -> int | None:
    """Return the largest size, in bytes, of a file of this process; None if there is no limit, as on Windows."""
    try:
        import resource
    except ImportError:
        return None
    limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    return None if limit == resource.RLIM_INFINITY else limit
