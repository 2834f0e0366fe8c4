"""Open file of its only writer, with a lock that excludes a second one: of the open file description, or flock."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import io
import os
import signal
import struct
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from vibrodrive.errors import Busy

WRITING = "another process is writing this file, or has it open; wait until it has finished, or choose another file"

UNKNOWN = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL, errno.ENOTTY)
"""Errors of systems without a kind of lock, such as some network mounts. Others answer with a number without a name."""


class Unlocked(UserWarning):
    """Warning that nothing excludes a second writer of a file. The message is one line."""


def _write(fd: int, content: memoryview, at: int) -> None:
    while content:  # the system may write less than asked
        count = os.pwrite(fd, content, at)
        content, at = content[count:], at + count


class Content(io.RawIOBase):
    """File object whose errors HDF5 never meets: it would print some, keep others to itself, and crash at the exit.

    error : the first error of the system, or None.
    """

    def __init__(self, fd: int) -> None:
        self._fd, self._at = fd, 0
        self.error: OSError | None = None

    def seek(self, at: int, whence: int = os.SEEK_SET) -> int:
        self._at = at + (os.fstat(self._fd).st_size if whence == os.SEEK_END else 0)
        return self._at

    def readinto(self, buffer: Any) -> int:
        content = os.pread(self._fd, len(buffer), self._at)
        buffer[: len(content)] = content
        return len(content)

    def write(self, content: Any) -> int:
        self._try(_write, self._fd, memoryview(content).cast("B"), self._at)
        return len(content)

    def truncate(self, size: int | None = None) -> int:
        self._try(os.ftruncate, self._fd, size)
        return size or 0

    def _try(self, act: Callable[..., None], *arguments: Any) -> None:
        try:
            act(*arguments)
        except OSError as error:
            self.error = self.error or error


class Lock:
    """Exclusive lock of a writer of one file, kept until `release` or the end of the process.

    The lock belongs to the file and not to its name, so it remains when the temporary file is renamed. It has no effect
    on readers of this program, which take no lock.
    """

    def __init__(self, path: Path, *, create: bool = False, name: Path | None = None) -> None:
        """Lock an existing file, or with `create` also a new file, of which nothing is left if this fails.

        `name` is the path that messages give, by default `path`. Raises Busy if another process holds the lock, or
        OSError if the system refuses. Warns (Unlocked) if the system knows no locks.
        """
        name, self._fd = name or path, -1
        while not self.holds(path):  # the file may be renamed between opening and locking
            self.release()
            try:
                self._fd = os.open(path, os.O_RDWR | (os.O_CREAT if create else 0), 0o666)
                locked = _lock(self._fd)
            except OSError as error:
                busy = error.errno == errno.EAGAIN
                if create and not busy and self._fd >= 0 and not os.fstat(self._fd).st_size:
                    path.unlink()
                self.release()
                raise Busy(f"{name}: {WRITING}") if busy else OSError(error.errno, error.strerror, str(name)) from None
        if not locked:
            message = f"{name}: this file system has no locks; let only one process write this file"
            warnings.warn(message, Unlocked, stacklevel=2)

    def holds(self, path: Path) -> bool:
        """Return True if `path` leads to the locked file, and False if this file was moved, deleted or replaced."""
        try:
            return self._fd >= 0 and os.path.samestat(os.fstat(self._fd), os.stat(path))
        except FileNotFoundError:
            return False

    def write(self, content: memoryview, at: int) -> None:
        """Write bytes at a place of the file. Raises OSError."""
        _write(self._fd, content, at)

    def reserve(self) -> None:
        """Reserve the space of the file on the disk, where the system can. Raises OSError, such as for a full disk."""
        try:
            os.posix_fallocate(self._fd, 0, os.fstat(self._fd).st_size)
        except AttributeError:  # macOS
            pass
        except OSError as error:
            if error.errno not in UNKNOWN:
                raise

    @contextlib.contextmanager
    def rewritten(self) -> Iterator[Content]:
        """Yield the empty file as a file object for HDF5. Raises the first OSError of the block at its end."""
        os.ftruncate(self._fd, 0)
        content = Content(self._fd)
        try:
            with _signals_waiting():
                yield content
        finally:
            if content.error is not None:
                raise content.error

    @property
    def released(self) -> bool:
        return self._fd < 0

    def sync(self) -> None:
        """Flush the file to the disk."""
        os.fsync(self._fd)

    def release(self) -> None:
        """Release the lock. A second call has no effect."""
        if self._fd >= 0:
            fd, self._fd = self._fd, -1  # before: Ctrl-C after the close would let another one close a file of others
            os.close(fd)


@contextlib.contextmanager
def _signals_waiting() -> Iterator[None]:
    """Let signals wait for the end of the block, in which C code calls Python: it would lose what a handler raises."""
    waiting: list[int] = []
    main = threading.current_thread() is threading.main_thread()  # which handles all signals
    signals = sorted(signal.valid_signals(), reverse=True) if main else []
    handlers = {s: handler for s in signals if callable(handler := signal.getsignal(s))}
    try:
        for s in handlers:
            signal.signal(s, lambda number, _: waiting.append(number))
        yield
    finally:
        for s, handler in handlers.items():  # Ctrl-C last: what it raises would end this loop
            signal.signal(s, handler)
        for number in waiting:
            signal.raise_signal(number)


def _lock(fd: int) -> bool:
    """Lock an open file exclusively. Return False if the system knows no kind of lock.

    Raises OSError, with errno EAGAIN if another process holds the lock.
    """
    for take in (_lock_description, _flock) if sys.platform == "linux" else (_flock,):
        try:
            take(fd)
            return True
        except OSError as error:
            if error.errno in errno.errorcode and error.errno not in UNKNOWN:
                raise
    return False


def _lock_description(fd: int) -> None:
    """Lock the open file description. The system would release a lock of the process when any handle of the file is
    closed, and flock excludes the readers of HDF5, which use it."""
    fcntl.fcntl(fd, fcntl.F_OFD_SETLK, struct.pack("hhqqi4x", fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0))


def _flock(fd: int) -> None:
    fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
