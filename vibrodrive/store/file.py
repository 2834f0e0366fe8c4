"""Files that are written in one step: creation, and checks of an existing file.

`writer` writes the files of sweeps, which are laid out first and then filled for hours.
"""

import contextlib
import errno
import os
from collections.abc import Iterator, Mapping
from pathlib import Path

import h5py

from vibrodrive.errors import Damaged, Unwritable
from vibrodrive.model.plan import Plan
from vibrodrive.store import netcdf
from vibrodrive.store.checksums import SEAL, content_digest, find_faults
from vibrodrive.store.compare import differences, refuse_different
from vibrodrive.store.draft import drafted, target_of
from vibrodrive.store.header import reading, remedy, unwritable
from vibrodrive.store.lock import Lock
from vibrodrive.store.place import refuse_foreign


def refuse_moved(path: Path) -> None:
    """Raise Unwritable if an open file was moved or deleted, because further data would be lost."""
    if not path.exists():
        raise Unwritable(errno.ENOENT, "moved or deleted while it was written", str(path))


@contextlib.contextmanager
def new_file(path: Path, *, seal: bool = False) -> Iterator[h5py.File]:
    """Yield an empty HDF5 file that replaces any result file at `path` if the block ends without an error.

    `seal` adds the SHA-256 of the contents. After an error no temporary file remains, and an existing file is
    unchanged. Raises Busy if another process is writing the existing file, Unwritable, and the exceptions of
    `refuse_foreign`.
    """
    refuse_foreign(path)
    # the file is made in memory, because HDF5 does not recover from a full disk, even at the end of the process
    with netcdf.create(path.name, driver="core", backing_store=False) as file:
        yield file
        if seal:
            file.attrs[SEAL] = content_digest(file)
        file.flush()
        content = file.id.get_file_image()
    try:
        refuse_foreign(path)  # the file may have appeared meanwhile
        older = Lock(target_of(path), name=path) if path.exists() else contextlib.nullcontext()
        with older, drafted(path) as draft, open(draft, "wb") as written:
            written.write(content)
            written.flush()
            os.fsync(written.fileno())
    except OSError as error:
        raise unwritable(error, path) from None


def is_computed(path: Path, kind: str, plan: Plan, own: Mapping[str, object]) -> bool:
    """Return True if an undamaged file with the same configuration exists (see compare.differences).

    Raises Different if the configuration of the file differs, NoResult if the file is of another kind or damaged, and
    OSError.
    """
    if not path.exists():
        return False
    with reading(path, kind) as file:
        faults = find_faults(file)
        found = differences(file, plan, own) if not faults else []
    if faults:
        raise Damaged(f"{path}: damaged ({faults[0]}); {remedy(path)}")
    refuse_different(path, found)
    return True
