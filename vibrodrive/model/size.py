"""Size of a sweep in memory and on disk. A sweep that is too large is refused before it starts."""

import math
import os
import resource
import shutil
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from vibrodrive.errors import TooLarge
from vibrodrive.model.plan import IN_FLIGHT, Plan

POINT_BYTES = 8 + 5 * 8 + 1
"""Bytes of a point in addition to its records: margin, five numbers of switches and status."""


LARGE = 1 << 26
"""Up to this number of bytes the memory for results is not checked, because a check takes as long as a short motion.
Beside larger results this number of bytes remains free, for the blocks being computed and for compilation."""


BASE_MEMORY = 350_000_000
"""Bytes of memory for the interpreter, NumPy, Numba, and the kernels while they are compiled."""


def human(n_bytes: float) -> str:
    """Return a number of bytes with a decimal prefix: 1234567 -> '1.2 MB'."""
    for unit in ("B", "kB", "MB", "GB", "TB", "PB"):
        if n_bytes < 1000:
            return f"{n_bytes:.0f} {unit}" if unit == "B" else f"{n_bytes:.1f} {unit}"
        n_bytes /= 1000
    return f"{n_bytes:.3g} EB"


SYSTEM = Path("/")  # tests replace this directory


def available_memory() -> int:
    """Return the bytes that this process can allocate without swapping and without being killed or refused.

    This is the least of the free memory of the machine and of what is left of each limit: of the control groups of this
    process, such as a container or the job of a batch system, and of `ulimit -v` and `ulimit -d`. On macOS the total
    memory replaces the free memory.
    """
    return max(0, min([_free(), *_left_in_groups(), *_left_of_limits()]))


def _free() -> int:
    free = _table("proc/meminfo").get("MemAvailable")
    if free is not None:
        return 1024 * free
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


GROUP_FILES = (
    ("memory.max", "memory.high", "memory.current"),
    ("memory.limit_in_bytes", "memory.usage_in_bytes"),
)
"""Files of a control group with its limits and, last, its use in bytes, for versions 2 and 1 of control groups."""


def _left_in_groups() -> Iterator[int]:
    """Yield the bytes left in each control group of this process, and in each group above, which limits all below.

    Cached pages of files do not count as used, because Linux drops them before a group exceeds its limit.
    """
    groups = [line.split(":", 2) for line in _lines("proc/self/cgroup")]
    for line in _lines("proc/self/mountinfo"):
        mount, _, system = line.partition(" - ")
        (root, point), (kind, _, options) = mount.split()[3:5], system.split(" ", 2)
        first = kind == "cgroup" and "memory" in options.split(",")
        if not (first or kind == "cgroup2"):
            continue
        *caps, use = GROUP_FILES[first]
        own = next((path for _, used, path in groups if ("memory" in used.split(",") if first else not used)), root)
        below = PurePosixPath(own)
        # the mounted groups may begin at the group of a container, or this process may be outside of them
        inside = below.is_relative_to(root) and ".." not in below.parts
        below = below.relative_to(root) if inside else PurePosixPath()
        for group in (below, *below.parents):
            folder = f"{point}/{group}".lstrip("/")
            limits = [int(line) for cap in caps for line in _lines(f"{folder}/{cap}") if line != "max"]
            if limits:
                files = _table(f"{folder}/memory.stat")
                cached = sum(files.get(f"{'total_' * first}{age}_file", 0) for age in ("active", "inactive"))
                yield min(limits) - sum(map(int, _lines(f"{folder}/{use}"))) + cached


def _left_of_limits() -> Iterator[int]:
    """Yield the bytes left of the limits of this process."""
    for name, used in (("RLIMIT_AS", "VmSize"), ("RLIMIT_DATA", "VmData")):
        if (limit := _limit(name)) is not None:
            yield limit - 1024 * _table("proc/self/status").get(used, 0)


def _limit(name: str) -> int | None:
    """Return a limit of this process in bytes; None if there is no limit."""
    limit, _ = resource.getrlimit(getattr(resource, name))
    return None if limit == resource.RLIM_INFINITY else limit


def _lines(path: str) -> list[str]:
    """Return the lines of a file of the system; [] if there is no such file."""
    try:
        return (SYSTEM / path).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []


def _table(path: str) -> dict[str, int]:
    """Return the numbers in a file of the system with lines such as "name: 12 kB" or "name 12"."""
    rows = (line.replace(":", " ").split() for line in _lines(path))
    return {row[0]: int(row[1]) for row in rows if len(row) > 1 and row[1].isdigit()}


def _bytes_of_a_point(plan: Plan) -> int:
    return plan.point_bytes + POINT_BYTES


def result_bytes(plan: Plan) -> int:
    """Return the bytes of all arrays of a Results."""
    return plan.n_points * _bytes_of_a_point(plan)


def file_bytes(plan: Plan) -> int:
    """Return the bytes of a result file, within about 1 %."""
    digests = 8 * plan.n_blocks * (6 + len(plan.quantities))
    axes = 8 * (sum(plan.shape) + plan.settings.periods)
    headers = 22_000 + 1_000 * len(plan.quantities)
    return plan.n_points * _bytes_of_a_point(plan) + digests + axes + headers


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


def _refuse(size: str, takes: str, need: int, have: int, room: str = "memory", are: str = "available") -> None:
    """Raise TooLarge if `need` exceeds `have` (bytes). `takes` is a part of the message, such as "the file takes"."""
    if need > have:
        raise TooLarge(f"{size}: must be small enough for {room}; {takes} {human(need)}, and {human(have)} are {are}")


def refuse_large_block(plan: Plan, remote: bool = False) -> None:
    """Raise TooLarge if the blocks that exist at one time do not fit into memory."""
    need, have = working_bytes(plan, remote), available_memory()
    if need > LARGE:
        have = max(0, have - BASE_MEMORY)
    _refuse(f"periods = {plan.settings.periods}", "the blocks computed at one time take", need, have)


def refuse_large_results(plan: Plan) -> None:
    """Raise TooLarge if the results of a sweep do not fit into memory."""
    if (need := result_bytes(plan)) > LARGE:
        are = "available (with a result file, only blocks are in memory)"
        _refuse(_extent(plan), "the results take", need, max(0, available_memory() - LARGE), are=are)


ROW_BYTES = 34 + 24  # bytes of one switch of a single motion, with its error bounds

MOTION_BYTES = 2 * 16 + 2 * 32
"""Bytes of one period of a single motion: its section point with error bounds, and two main impacts."""


def refuse_large(size: str, takes: str, need: int, are: str = "available") -> None:
    """Raise TooLarge if arrays of `need` bytes do not fit into memory. `size` and `takes` are parts of the message."""
    if need > LARGE:
        _refuse(size, takes, need, available_memory(), are=are)


def refuse_large_reading(name: str, need: int) -> None:
    """Raise TooLarge if an array of a file does not fit into memory. Reading it takes `need` bytes."""
    refuse_large(name, "reading it takes", need, "available (`select` reads a part)")


def fitting_rows(periods: int, rows: int) -> int:
    """Return the number of rows to allocate for the switches of one motion, at most `rows`.

    Raises TooLarge if the section of the motion does not fit into memory.
    """
    if MOTION_BYTES * periods + ROW_BYTES * rows <= LARGE:
        return rows
    need, have = MOTION_BYTES * periods, available_memory()
    _refuse(f"periods = {periods}", "the section points, error bounds and main impacts take", need, have)
    return min(rows, 64 + (have - need) // (2 * ROW_BYTES))


def refuse_large_file(plan: Plan, path: Path) -> None:
    """Raise TooLarge if the result file exceeds the free space of the disk, or the file size limit of the shell."""
    need, have = file_bytes(plan), shutil.disk_usage(os.path.dirname(os.path.realpath(path))).free
    _refuse(_extent(plan), "the file takes", need, have, "the disk", "free")
    if (limit := _limit("RLIMIT_FSIZE")) is not None:
        _refuse(_extent(plan), "the file takes", need, limit, "the file size limit", "allowed (ulimit -f)")


def _extent(plan: Plan) -> str:
    return f"{plan.n_points} points x {plan.settings.periods} periods"
