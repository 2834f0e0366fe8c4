"""Exceptions that users can meet: each is a `VibrodriveError`, and a ValueError, RuntimeError or OSError.

Examples
--------
>>> import vibrodrive as vd
>>> try:
...     vd.sweep(A=[1.0, 2.0], path="diagram.png")
... except vd.errors.VibrodriveError as error:
...     print(error)
output = 'diagram.png': must be the result file (.h5): `vibrodrive plot FILE.h5 -o diagram.png` draws it
>>> issubclass(vd.errors.Damaged, vd.errors.NoResult), issubclass(vd.errors.NoResult, ValueError)
(True, True)
"""

from __future__ import annotations

__all__ = [
    "Busy",
    "ConfigError",
    "Damaged",
    "Different",
    "Failed",
    "NoResult",
    "OtherKind",
    "TooLarge",
    "Unwritable",
    "VibrodriveError",
]


class VibrodriveError(Exception):
    """Base class of the exceptions of this program. The message is one line."""


class ConfigError(VibrodriveError, ValueError):
    """A configuration or an option cannot be used. Raised before any work."""


class TooLarge(VibrodriveError, ValueError):
    """A sweep that fits neither the memory nor the disk; the sentence has the numbers."""


class Different(VibrodriveError, ValueError):
    """A file was made from another configuration; the message has the keys that differ."""


class NoResult(VibrodriveError, ValueError):
    """A file that is no result file of this version."""


class Damaged(NoResult):
    """A result file that cannot be read (as a whole, or one of its blocks)."""


class OtherKind(NoResult):
    """A good result file, but of another kind than is wanted; the message says which."""


class Busy(VibrodriveError, RuntimeError):
    """Another process is writing the file."""


class Failed(VibrodriveError, RuntimeError):
    """A sweep broke off while computing; its file can be resumed."""


class Unwritable(VibrodriveError, OSError):
    """The system refused to write (disk full, file too large, …); str() is one line.

    What is committed stays, and a sweep can be resumed.
    """

    def __str__(self) -> str:
        return f"{self.filename}: {self.strerror}"
