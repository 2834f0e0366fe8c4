"""Measurement of the time that this process has spent on compilation."""

from __future__ import annotations

from time import monotonic


class Compilation:
    """Measurement of the time that this process has spent on compilation.

    Numba reports the beginning and the end of each compilation (compiler.py). The files of the cache do not show
    whether a kernel must be compiled, because only Numba can evaluate the keys of the cache.

    said_after : duration of a compilation in seconds after which a message is printed
    """

    said_after = 1.0

    def __init__(self) -> None:
        self._depth = 0  # the compilation of a kernel includes the compilation of the functions that it calls
        self._began = self._spent = 0.0

    def begins(self) -> None:
        if self._depth == 0:
            self._began = monotonic()
        self._depth += 1

    def ends(self) -> None:
        self._depth -= 1
        if self._depth == 0:
            self._spent += monotonic() - self._began

    @property
    def running(self) -> bool:
        """True while a function is compiled."""
        return self._depth > 0

    @property
    def seconds(self) -> float:
        """Seconds spent on compilation so far, including a compilation in progress."""
        return self._spent + (monotonic() - self._began if self.running else 0.0)

    @property
    def progress(self) -> str:
        """Seconds of the compilation in progress."""
        return f"{monotonic() - self._began:.0f} s"


compilation = Compilation()
