"""One writer at a time."""

from __future__ import annotations

import os
from pathlib import Path

from vibrodrive.errors import Busy
from vibrodrive.store import system


class Lock:
    """Exclusive right to write one file, kept until `release` or the end of the process.

    It belongs to the file, not to its name, and so survives the renaming that publishes the file.
    Readers are not affected by it, nor is the lock that HDF5 itself takes for them.
    """

    def __init__(self, path: Path, *, create: bool = False, name: Path | None = None) -> None:
        """Lock an existing file, or create it. Raises Busy, or OSError where the system refuses."""
        while True:
            try:
                self._fd = os.open(path, os.O_RDWR | (os.O_CREAT if create else 0), 0o666)
            except OSError as error:
                raise OSError(error.errno, error.strerror, str(name or path)) from None
            try:
                system.lock(self._fd)
            except OSError as error:
                if error.errno not in system.UNSUPPORTED:
                    os.close(self._fd)
                    raise Busy(f"{name or path}: another process is writing it") from None
            if self._is(path):
                return
            os.close(self._fd)  # it was renamed between opening and locking

    def _is(self, path: Path) -> bool:
        try:
            return os.path.samestat(os.fstat(self._fd), os.stat(path))
        except FileNotFoundError:
            return False

    def sync(self) -> None:
        """Have the system put the file on the disk."""
        os.fsync(self._fd)

    def yield_to_renaming(self) -> None:
        """Let go where the system renames and replaces no open file: just before that is done."""
        if not system.RENAMES_OPEN_FILES:
            self.release()

    def release(self) -> None:
        """Give the right back; twice does no harm."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1
