"""Digests: the only statement of a file that a block of points is there.

A block of a variable is there if its values have its digest, whoever wrote both, and in whatever order they reached the
disk. What a kill, a power failure, a hole or a flipped bit leaves does not have it, and neither has a block in the
place of another. A digest is 8 bytes of BLAKE2b, salted with the number of the block, of the name of the variable and
its values as the file has them. It is 0 before the block is written.

The SHA-256 of the plan (model/plan.py) covers the axes, and that of the configuration its text. The other numeric
attributes are compared with the plan.
"""

import contextlib
import hashlib
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import h5py
import numpy as np

from vibrodrive.model.plan import Plan
from vibrodrive.model.quantities import STATUS, Quantity
from vibrodrive.store.header import BROKEN, digests_of, variable
from vibrodrive.store.layout import Progress, tiles, variables_of

WHOLE = 1 << 26
"""Largest number of bytes of a variable that is read at once. The blocks of others are read one by one."""


def digest(quantity: Quantity, k: int, values: np.ndarray) -> int:
    """Return the digest of the values of block k, which is never 0."""
    hashed = hashlib.blake2b(quantity.variable.encode(), digest_size=8, salt=k.to_bytes(16, "little"))
    hashed.update(np.ascontiguousarray(values, quantity.dtype).data)
    return int.from_bytes(hashed.digest(), "little") or 1


class Marks(NamedTuple):
    """Statuses of all points of a file, and the blocks that are there."""

    status: np.ndarray  # int8 over the dimensions of the file; NOT_COMPUTED in blocks that are not there
    done: np.ndarray  # bool (blocks,): True for each block that is there
    wrong: dict[int, str]  # fault of each damaged block, by the number of the block


def read_blocks(
    file: h5py.File, quantity: Quantity, plan: Plan, numbers: np.ndarray
) -> Iterator[tuple[int, np.ndarray | str]]:
    """Yield (number, values or the fault) for the blocks with these numbers. Values have a row for each point."""
    name, blocks = quantity.variable, tiles(plan)
    sums, data = np.asarray(variable(file, digests_of(quantity))[...]), variable(file, name)  # as a sweep writes them
    whole = None
    if 2 * len(numbers) > len(blocks) and data.nbytes <= WHOLE:
        with contextlib.suppress(*BROKEN):  # the blocks are then read one by one
            whole = np.asarray(data[...]).reshape(plan.n_points, -1)
    for k in numbers.tolist():
        start, stop, slab = blocks[k]
        try:
            values = np.asarray(data[slab]).reshape(stop - start, -1) if whole is None else whole[start:stop]
        except BROKEN:
            yield k, f"{name}: unreadable"
        else:
            yield k, values if digest(quantity, k, values) == sums[k] else f"{name}: does not match its digest"


def read_marks(file: h5py.File, plan: Plan, damaged: Iterable[tuple[int, str]] = ()) -> Marks:
    """Read the statuses of all blocks. `damaged` are further damaged blocks, and their faults."""
    written = np.asarray(variable(file, digests_of(STATUS))[...]) != 0
    status = np.full(plan.shape or (1,), STATUS.fill, STATUS.dtype)
    blocks, wrong = plan.blocks(), dict(damaged)
    for k, values in read_blocks(file, STATUS, plan, np.flatnonzero(written)):
        if isinstance(values, str):
            wrong[k] = values
        elif k not in wrong:
            status.reshape(-1)[slice(*blocks[k])] = values.ravel()
    written[list(wrong)] = False
    return Marks(status, written, wrong)


def check_blocks(file: h5py.File, plan: Plan, progress: Progress) -> Marks:
    """Read all blocks that are there, and return the marks of the file, which include all damaged blocks."""
    done, wrong = np.flatnonzero(read_marks(file, plan).done), dict[int, str]()
    variables = variables_of(plan)
    for n, quantity in enumerate(variables):
        for m, (k, values) in enumerate(read_blocks(file, quantity, plan, done)):
            if isinstance(values, str):
                wrong.setdefault(k, values)
            progress(n * len(done) + m + 1, len(variables) * len(done))
    return read_marks(file, plan, wrong.items())
