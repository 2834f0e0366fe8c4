"""One writer at a time: by open-file-description locks, flock, or LockFileEx on Windows.

What is lost on Windows: an open file cannot be renamed or replaced there. A new result file is closed to be given its
name and opened again, between which another process may take it, and one that somebody reads cannot be replaced.
"""

from __future__ import annotations

import errno
import os
import struct
import sys
from pathlib import Path
from types import TracebackType
from typing import Any

from vibrodrive.errors import Busy

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

RENAMES_OPEN_FILES = os.name != "nt"

UNSUPPORTED = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
"""File systems without locks (some network mounts): there the user has to keep writers apart."""

FAR = 1 << 62
"""Offset of the byte that is locked on Windows, where what is locked cannot be read: behind the end of any file."""


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
                if error.errno not in UNSUPPORTED:
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
        """Give the right back; twice does no harm."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def __enter__(self) -> Lock:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.release()


def _lock(fd: int) -> None:
    """Take the lock of an open file, exclusively and without waiting. Raises OSError.

    Linux has locks of an open file description: a plain record lock would be dropped as soon as this process closes
    any other handle on the file, and HDF5's readers try a flock, which a flock of ours would refuse them.
    """
    if fcntl is None:
        _lock_byte(fd)
    elif sys.platform == "linux":
        fcntl.fcntl(fd, fcntl.F_OFD_SETLK, struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0))
    else:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _lock_byte(fd: int) -> None:
    """LockFileEx, as msvcrt.locking knows no offset above 2 GiB. Raises OSError; ends when the file is closed."""
    import ctypes
    import msvcrt

    windows: Any = ctypes
    fail_at_once, exclusive = 1, 2
    take = windows.WinDLL("kernel32", use_last_error=True).LockFileEx
    take.argtypes = [ctypes.c_void_p, *[ctypes.c_uint32] * 4, ctypes.c_void_p]
    overlapped = ctypes.create_string_buffer(struct.pack("PPIIP", 0, 0, FAR & 0xFFFFFFFF, FAR >> 32, 0))
    handle = msvcrt.get_osfhandle(fd)  # type: ignore[attr-defined]
    if not take(handle, fail_at_once | exclusive, 0, 1, 0, overlapped):
        raise windows.WinError(windows.get_last_error())
