"""Lock that excludes a second writer of a file: open-file-description locks, flock, or LockFileEx on Windows.

Windows cannot rename or replace an open file. So on Windows a new result file is closed, renamed and opened again, and
another process may lock it meanwhile. A file that another process is reading cannot be replaced on Windows.
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
"""Errors of file systems without locks, such as some network mounts. There the user must exclude a second writer."""

WRITING = "another process is writing this file; wait until it has finished, or choose another file"

FAR = 1 << 62  # offset of the byte locked on Windows: after the end of any file, because locked bytes cannot be read


class Lock:
    """Exclusive lock of a writer of one file, kept until `release` or the end of the process.

    The lock belongs to the file and not to its name, so it remains when the temporary file is renamed. It has no effect
    on readers and on the locks of HDF5.
    """

    def __init__(self, path: Path, *, create: bool = False, name: Path | None = None) -> None:
        """Lock an existing file, or with `create` also a new file. Raises Busy, or OSError if the system refuses.

        `name` is the path that messages give, by default `path`.
        """
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
                    raise Busy(f"{name or path}: {WRITING}") from None
            if self._is_file(path):
                return
            os.close(self._fd)  # the file was renamed between opening and locking

    def _is_file(self, path: Path) -> bool:
        try:
            return os.path.samestat(os.fstat(self._fd), os.stat(path))
        except FileNotFoundError:
            return False

    def sync(self) -> None:
        """Flush the file to the disk."""
        os.fsync(self._fd)

    def release(self) -> None:
        """Release the lock. A second call has no effect."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def __enter__(self) -> Lock:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.release()


def _lock(fd: int) -> None:
    """Lock an open file exclusively, without waiting. Raises OSError.

    On Linux the lock belongs to the open file description. The system would release a plain record lock when this
    process closes any other handle of the file. A flock would exclude the readers of HDF5, which use flock.
    """
    if fcntl is None:
        _lock_byte(fd)
    elif sys.platform == "linux":
        fcntl.fcntl(fd, fcntl.F_OFD_SETLK, struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0))
    else:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _lock_byte(fd: int) -> None:
    """Lock one byte with LockFileEx until the file is closed. Raises OSError.

    msvcrt.locking is not used, because it has no offset above 2 GiB.
    """
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
