"""One writer at a time."""

from __future__ import annotations

import errno
import fcntl
import os
import struct
import sys
from pathlib import Path

_UNSUPPORTED = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
"""File systems without locks (some network mounts): there the user has to keep writers apart."""


class Busy(RuntimeError):
    """Another process is writing the file; the message is one line."""


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
                _lock(self._fd)
            except OSError as error:
                if error.errno not in _UNSUPPORTED:
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

    def release(self) -> None:
        os.close(self._fd)


def _lock(fd: int) -> None:
    """Take the lock or raise OSError.

    An open-file-description lock: a plain record lock would be dropped as soon as this process closes
    any other handle on the file, and HDF5's readers try a flock, which a flock of ours would refuse them.
    """
    if sys.platform != "linux":
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return
    whole_file = struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
    fcntl.fcntl(fd, fcntl.F_OFD_SETLK, whole_file)


def is_being_written(path: Path) -> bool | None:
    """Whether some process holds the lock on a file; None where the system does not report it."""
    try:
        fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except OSError:
        return None
    try:
        if sys.platform == "linux":
            wanted = struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
            found = fcntl.fcntl(fd, fcntl.F_OFD_GETLK, wanted)
            return struct.unpack("hhqqi4x", found)[0] != fcntl.F_UNLCK
        fcntl.flock(fd, fcntl.LOCK_SH | fcntl.LOCK_NB)
        return False
    except OSError as error:
        return None if error.errno in _UNSUPPORTED or sys.platform == "linux" else True
    finally:
        os.close(fd)
