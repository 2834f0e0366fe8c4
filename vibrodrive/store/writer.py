"""Write a result file block by block: the values of each variable, and then their digest (digests.py).

The file is laid out before, and each block has its place in it. So the blocks may be written in any order, and nothing
else of the file changes. Only the layout is written by HDF5.
"""

from __future__ import annotations

import errno
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibrodrive.errors import Busy, Unwritable
from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import SECTIONS, STATUS, Quantity
from vibrodrive.model.size import refuse_large_file
from vibrodrive.store import layout, netcdf
from vibrodrive.store.compare import joined
from vibrodrive.store.digests import check_blocks, digest
from vibrodrive.store.draft import draft_of, drafted
from vibrodrive.store.header import (
    damaged,
    damaged_descriptions,
    how_rewritten,
    offsets,
    open_result,
    read_header,
    reading,
    rewritten,
    unwritable,
    versions_of,
)
from vibrodrive.store.layout import Origin, Progress, quiet
from vibrodrive.store.lock import WRITING, Lock
from vibrodrive.store.place import refuse_foreign

if TYPE_CHECKING:
    from vibrodrive.batch.block import Block


class Writer:
    """Writer of a file, locked against other writers. Open it by `open_writer`, and `close` it.

    Attributes
    ----------
    plan : Plan
        the sweep, divided into the blocks of the file, whose size another version may have chosen.
    done : bool array
        True for blocks that are there.
    repaired : dict[int, str]
        faults of the damaged blocks that `check` found, by the number of the block. The blocks must be computed again.
    made_by : str
        version of the program that has laid out the file.
    """

    def __init__(self, lock: Lock, path: Path, plan: Plan) -> None:
        self.path, self.plan, self._lock = path, plan, lock
        self._blocks = plan.blocks()
        self.done, self.repaired = np.zeros(len(self._blocks), bool), dict[int, str]()
        with open_result(path) as file:
            self.made_by = versions_of(file)["vibrodrive"]
            self._at: dict[Quantity, list[Any]] = offsets(file, plan)
        self._rewritten = how_rewritten(self._at)

    def missing(self) -> list[int]:
        """Return the indices into plan.blocks() of the missing blocks."""
        return np.flatnonzero(~self.done).tolist()

    def write(self, block: Block) -> None:
        """Write a finished block. Raises Unwritable."""
        self._refuse_rewritten()
        self._refuse_lost()
        arrays: dict[str, np.ndarray] = {**block._asdict(), **block.records}
        if block.section is not None:
            arrays |= {q.name: block.section[..., column] for column, q in enumerate(SECTIONS)}
        for quantity in self._at:
            values = np.ascontiguousarray(arrays[quantity.name], quantity.dtype)
            self._put(quantity, block.index, values, digest(quantity, block.index, values))
        self.done[block.index] = True

    def check(self, progress: Progress = quiet) -> None:
        """Read all blocks that are there, and mark damaged blocks as missing, so that they are computed again.

        Raises Damaged for damage outside the blocks, NoResult if a block is missing in a file that another program has
        rewritten, Unwritable, and the exceptions of `progress`.
        """
        with open_result(self.path) as file:
            _, self.done, self.repaired = check_blocks(file, self.plan, progress)
            for name in damaged_descriptions(file, self.plan):
                raise damaged(self.path, name)
        if not self.done.all():
            self._refuse_rewritten()
        for k in self.repaired:
            start, stop = self._blocks[k]
            self._put(STATUS, k, np.full(stop - start, STATUS.fill, STATUS.dtype), 0)

    def close(self, *, sync: bool = True) -> None:
        """Close the file. Without `sync` it is not flushed to the disk. This method may be called several times."""
        try:
            if sync and not self._lock.released:
                self._refuse_lost()
                self._lock.sync()
        except OSError as error:
            raise error if isinstance(error, Unwritable) else unwritable(error, self.path) from None
        finally:
            self._lock.release()

    def _refuse_lost(self) -> None:
        """Raise Unwritable if the data would be lost, or be in a file of another name."""
        if not self._lock.holds(self.path):
            raise Unwritable(errno.ENOENT, "moved, deleted or replaced while it was written", str(self.path))

    def _refuse_rewritten(self) -> None:
        """Refuse to write into a file whose variables are not each one piece of it."""
        if self._rewritten:
            raise rewritten(self.path, self._rewritten, "vd.load, xarray and others")

    def _put(self, quantity: Quantity, k: int, values: np.ndarray, of_values: int) -> None:
        """Write block k of a variable, and its digest."""
        at, digests = self._at[quantity]
        row = values.nbytes // len(values)
        try:
            self._lock.write(values.data.cast("B"), at + row * self._blocks[k][0])
            self._lock.write(memoryview(of_values.to_bytes(8, "little")), digests + 8 * k)
        except OSError as error:
            raise unwritable(error, self.path) from None


def open_writer(path: Path, plan: Plan, origin: Origin, *, overwrite: bool = False) -> Writer:
    """Lay out a new file, or open an existing file to resume it.

    With `overwrite` an existing result file, even a complete or damaged one, is replaced when the new file is laid out.
    Raises Different if the existing file has another configuration, NoResult, Busy, TooLarge if a new file does not fit
    on the disk, Unwritable or OSError if the system refuses.
    """
    if path.exists() and not overwrite:
        return _resume(path, plan)
    refuse_foreign(path)
    return _create(path, plan, origin, overwrite)


def _resume(path: Path, plan: Plan) -> Writer:
    lock = Lock(path)
    try:
        with reading(path) as file:
            stored = read_header(file).plan
        return Writer(lock, path, joined(path, stored, plan))
    except BaseException:
        lock.release()
        raise


def _create(path: Path, plan: Plan, origin: Origin, overwrite: bool) -> Writer:
    lock = old = None
    try:
        lock = Lock(draft_of(path), create=True, name=path)  # first, because another process may own this draft
        with drafted(path):
            refuse_large_file(plan, path)
            if path.exists():
                if not overwrite:  # another process has created the file meanwhile
                    raise Busy(f"{path}: {WRITING}")
                old = Lock(path)
            with lock.rewritten() as content, netcdf.create(content) as file:
                layout.lay_out(file, plan, origin)
            lock.reserve()
        return Writer(lock, path, plan)
    except BaseException as error:
        if lock is not None:
            lock.release()
        raise unwritable(error, path) if isinstance(error, OSError) else error from None
    finally:
        if old is not None:
            old.release()
