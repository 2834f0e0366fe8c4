"""What the system offers to keep writers apart: open-file-description locks, flock, or LockFileEx on Windows.

What is lost on Windows: an open file cannot be renamed or replaced there. A new result file is closed to be given its
name and opened again, between which another process may take it, and one that somebody reads cannot be replaced.
"""

from __future__ import annotations

import errno
import os
import struct
import sys
from typing import Any

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

RENAMES_OPEN_FILES = os.name != "nt"

UNSUPPORTED = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
"""File systems without locks (some network mounts): there the user has to keep writers apart."""


def lock(fd: int) -> None:
    """Take the lock of an open file, exclusively and without waiting. Raises OSError.

    Linux has locks of an open file description: a plain record lock would be dropped as soon as this process closes
    any other handle on the file, and HDF5's readers try a flock, which a flock of ours would refuse them.
    """
    if fcntl is None:
        _lock_byte(fd)
    elif sys.platform == "linux":
        fcntl.fcntl(fd, fcntl.F_OFD_SETLK, _whole_file())
    else:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)


_FLOCK = "hhqqi4x"


def _whole_file() -> bytes:
    return struct.pack(_FLOCK, fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)


_FAR = 1 << 62
"""Offset of the byte that is locked on Windows, where what is locked cannot be read: behind the end of any file."""


def _lock_byte(fd: int) -> None:
    """LockFileEx, as msvcrt.locking knows no offset above 2 GiB. Raises OSError; ends when the file is closed."""
    import ctypes
    import msvcrt

    windows: Any = ctypes

    class Overlapped(ctypes.Structure):
        _fields_ = (
            ("internal", ctypes.c_void_p), ("internal_high", ctypes.c_void_p),
            ("offset", ctypes.c_uint32), ("offset_high", ctypes.c_uint32), ("event", ctypes.c_void_p),
        )  # fmt: skip

    fail_at_once, exclusive = 1, 2
    take = windows.WinDLL("kernel32", use_last_error=True).LockFileEx
    take.argtypes = [ctypes.c_void_p, *[ctypes.c_uint32] * 4, ctypes.POINTER(Overlapped)]
    where = Overlapped(offset=_FAR & 0xFFFFFFFF, offset_high=_FAR >> 32)
    handle = msvcrt.get_osfhandle(fd)  # type: ignore[attr-defined]
    if not take(handle, fail_at_once | exclusive, 0, 1, 0, ctypes.byref(where)):
        raise windows.WinError(windows.get_last_error())
