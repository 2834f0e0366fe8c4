"""Write a result file block by block. If the process is killed, only blocks that are not committed are lost.

A block is the points of one chunk of the file. It is committed in four steps: write the data, flush, write the status,
flush. Committed blocks are not written again, and the structure of the file does not change after its layout. Blocks
that finish within GROUP_SECONDS of each other are committed together.
"""

from __future__ import annotations

import contextlib
import errno
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import h5py
import numpy as np

from vibrodrive.errors import Busy, Damaged, Unwritable, VibrodriveError
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import SECTIONS
from vibrodrive.model.size import refuse_large_file
from vibrodrive.store import layout, netcdf
from vibrodrive.store.checksums import check_blocks, is_sealed, point_sums, record_sums, sealed, section_sums
from vibrodrive.store.compare import joined
from vibrodrive.store.draft import draft_of, drafted
from vibrodrive.store.header import (
    BAD_INDEX,
    RESTORE,
    damaged,
    damaged_descriptions,
    how_rewritten,
    is_in_order,
    open_result,
    open_to_write,
    read_header,
    rewritten,
    unwritable,
    versions_of,
)
from vibrodrive.store.layout import Origin, Progress, put_chunk, quiet, variables_of
from vibrodrive.store.lock import WRITING, Lock
from vibrodrive.store.place import refuse_foreign

if TYPE_CHECKING:
    from vibrodrive.model.block import Block

GROUP_SECONDS = 0.2
"""Least time between commits. Small blocks take less than a millisecond, so a flush after each block would be slow."""


class Writer:
    """Writer of a file, locked against other writers. Open it by `open_writer`, and `close` it.

    Attributes
    ----------
    plan : Plan
        the sweep, divided into the blocks of the file, whose size another version may have chosen.
    done : bool array
        True for committed blocks.
    repaired : dict[int, str]
        faults of the damaged blocks that `check` found, by the number of the block. The blocks must be computed again.
    fletcher32 : Callable[[array], int], optional
        function that computes HDF5's checksum of an array. If it is given, sections, which are nearly all of the data,
        are written directly to their chunks. This takes a third of the time of HDF5's filters.
    """

    def __init__(self, file: h5py.File, lock: Lock, path: Path, plan: Plan) -> None:
        self.path = path
        self.plan = plan
        self.tiles = layout.tiles(plan)
        self.done = np.zeros(len(self.tiles), bool)
        self.repaired: dict[int, str] = {}
        self.fletcher32: Callable[[np.ndarray], int] | None = None
        self._file = file
        self._lock = lock
        self._pending: dict[int, np.ndarray] = {}
        self._committed_at = time.monotonic()
        self._sealed, self._rewritten = is_sealed(file), how_rewritten(file, plan)
        self._data = {v.variable: file[v.variable] for v in variables_of(plan)}
        self._chunk = np.empty(8 * math.prod(plan.chunk) * plan.settings.periods + 4, np.uint8)

    @property
    def made_by(self) -> str:
        """Version of the program that has laid out the file."""
        return versions_of(self._file)["vibrodrive"]

    def missing(self) -> list[int]:
        """Return the indices into plan.blocks() of the missing blocks."""
        return np.flatnonzero(~self.done).tolist()

    def write(self, block: Block) -> None:
        """Write a finished block. Commit this and all pending blocks if the last commit was more than GROUP_SECONDS
        ago. Raises Unwritable."""
        self._refuse_rewritten()
        k = block.index
        sums = point_sums(block.start, block.margin, block.switches, block.status)
        if block.section is not None:
            for column, q in enumerate(SECTIONS):
                sums += section_sums(self._put_section(k, q.variable, block.section[..., column]), column)
        for q in self.plan.quantities:
            values = block.records[q.name].astype(q.dtype, copy=False)
            self._put(k, q.variable, values)
            sums += record_sums(q.name, values)
        if self._sealed:
            sums = sealed(sums, block.status)
        self._put(k, "margin", block.margin)
        self._put(k, "switches", block.switches)
        self._put(k, "checksum", sums)
        self._pending[block.index] = block.status.copy()  # a view would keep the arrays of many blocks in memory
        if time.monotonic() - self._committed_at > GROUP_SECONDS:
            self._commit()

    def check(self, progress: Progress = quiet) -> None:
        """Read all committed blocks, and mark damaged blocks as missing, so that they are computed again.

        Raises Damaged for damage outside the blocks, NoResult if a block is missing in a file that another program has
        rewritten, Unwritable, and the exceptions of `progress`.
        """
        with open_result(self.path) as file:
            _, done, wrong = check_blocks(file, self.tiles, self.plan, progress)
            for name in damaged_descriptions(file, self.plan):
                raise damaged(self.path, name)
        if wrong or not done.all():
            self._refuse_rewritten()
            if not is_in_order(*self._data.values()):
                raise Damaged(f"{self.path}: too damaged to be repaired ({BAD_INDEX}); {RESTORE}")
        for k in wrong:
            # The status comes first, because it marks the block as missing. Chunks are written directly, because HDF5
            # would read a damaged chunk before it writes a part of this chunk.
            for variable in reversed(variables_of(self.plan)):
                self._put_chunk(k, variable.variable, layout.blank(variable, layout.chunk_of(variable, self.plan)))
                self._flush()
            done[k] = False
        self.done, self.repaired = done, wrong

    def close(self, *, sync: bool = True) -> None:
        """Commit the pending blocks and close the file. Without `sync` the file is not flushed to the disk.

        This method may be called several times.
        """
        if not self._file:  # an h5py.File is false once it is closed
            return
        self._commit()
        try:
            self._file.close()
        except RuntimeError as error:
            raise unwritable(error, self.path) from None
        try:
            if sync:
                self._lock.sync()
        finally:
            self._lock.release()

    def abandon(self) -> None:
        """Close a file that could not be written, without another commit."""
        with contextlib.suppress(OSError, RuntimeError):
            self._file.close()
        self._lock.release()

    def _refuse_rewritten(self) -> None:
        """Refuse to write into a file with other chunks or filters: bytes written directly would be unreadable."""
        if self._rewritten:
            raise rewritten(self.path, self._rewritten, "vd.load, xarray and others")

    def _put_section(self, k: int, name: str, values: np.ndarray) -> np.ndarray:
        """Write one column of a section, and return it as a contiguous array that is valid until the next call."""
        if self.fletcher32 is None or values.nbytes != self._chunk[:-4].nbytes:  # blocks at an edge are smaller
            values = np.ascontiguousarray(values)
            self._put(k, name, values)
            return values
        column = self._chunk[:-4].view("<f8").reshape(values.shape)
        np.copyto(column, values)
        self._chunk[-4:] = np.frombuffer(self.fletcher32(column).to_bytes(4, "little"), np.uint8)
        self._put_chunk(k, name, self._chunk)
        return column

    def _put(self, k: int, name: str, values: np.ndarray) -> None:
        data, slab = self._data[name], self.tiles[k].slab
        extra = data.shape[len(slab) :]
        count = tuple(s.stop - s.start for s in slab) + extra
        space = data.id.get_space()
        space.select_hyperslab(tuple(s.start for s in slab) + (0,) * len(extra), count)
        values = np.ascontiguousarray(values, data.dtype).reshape(count)
        try:
            data.id.write(h5py.h5s.create_simple(count), space, values)
        except OSError as error:
            raise self._refused(error) from None

    def _commit(self) -> None:
        if not self._lock.holds(self.path):  # the data would be lost, or be in a file of another name
            raise Unwritable(errno.ENOENT, "moved, deleted or replaced while it was written", str(self.path))
        self._flush()
        for k, status in self._pending.items():
            self._put(k, "status", status)
        self._flush()
        self.done[list(self._pending)] = True
        self._pending.clear()
        self._committed_at = time.monotonic()

    def _flush(self) -> None:
        try:
            self._file.flush()
        except (OSError, RuntimeError) as error:
            raise unwritable(error, self.path) from None

    def _put_chunk(self, k: int, name: str, content: bytes | np.ndarray) -> None:
        try:
            put_chunk(self._data[name], self.tiles[k], content)
        except OSError as error:
            raise self._refused(error) from None

    def _refused(self, error: BaseException) -> OSError | Damaged:
        """Return the error of a failed write: Unwritable if the system refused the write, otherwise Damaged."""
        if getattr(error, "errno", None) or "errno" in str(error):
            return unwritable(error, self.path)
        return Damaged(f"{self.path}: too damaged to be repaired; {RESTORE}")


def open_writer(
    path: Path, plan: Plan, origin: Origin, *, overwrite: bool = False, progress: Progress = quiet
) -> Writer:
    """Lay out a new file, or open an existing file to resume it.

    With `overwrite` an existing result file, even a complete or damaged one, is replaced when the new file is laid out.
    `progress` is called during the layout with (chunks, total). If it raises an exception, no new file is left. Raises
    Different if the existing file has another configuration, NoResult, Busy, TooLarge if a new file does not fit on the
    disk, Unwritable or OSError if the system refuses.
    """
    if path.exists() and not overwrite:
        return _resume(path, plan)
    refuse_foreign(path)
    return _create(path, plan, origin, overwrite, progress)


def _resume(path: Path, plan: Plan) -> Writer:
    with open_result(path):  # so that an unreadable file is reported as unreadable, and not as unwritable
        pass
    lock = Lock(path)
    try:
        with open_result(path) as file:
            there = read_header(file).plan
        plan = joined(path, there, plan)
        return Writer(open_to_write(path), lock, path, plan)
    except BaseException:
        lock.release()
        raise


def _create(path: Path, plan: Plan, origin: Origin, overwrite: bool, progress: Progress) -> Writer:
    lock = old = file = None
    try:
        lock = Lock(draft_of(path), create=True, name=path)  # first, because another process may own this draft
        with drafted(path) as draft:
            refuse_large_file(plan, path)
            if path.exists():
                if not overwrite:  # another process has created the file meanwhile
                    raise Busy(f"{path}: {WRITING}")
                old = Lock(path)
            file = netcdf.create(draft, locking=False, rdcc_nbytes=0)
            layout.lay_out(file, plan, origin, progress)
            file.close()  # HDF5 ends a file at its last byte only here, and the process may be killed at any time
        return Writer(open_to_write(path), lock, path, plan)
    except BaseException as error:
        if file is not None:
            with contextlib.suppress(OSError, RuntimeError):  # the close may write
                file.close()
        if lock is not None:
            lock.release()
        refused = isinstance(error, OSError | RuntimeError) and not isinstance(error, VibrodriveError)
        raise unwritable(error, path) if refused else error from None
    finally:
        if old is not None:
            old.release()
