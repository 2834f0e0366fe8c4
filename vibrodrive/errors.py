"""Public exceptions. Each is a `VibrodriveError` and also a ValueError, RuntimeError or OSError.

Examples
--------
>>> import vibrodrive as vd
>>> try:
...     vd.sweep(A=[1.0, 2.0], path="diagram.png")
... except vd.errors.VibrodriveError as error:
...     print(error)
path = 'diagram.png': must be a result file (.h5 or .nc); `vibrodrive plot FILE.h5 -o diagram.png` draws one
>>> issubclass(vd.errors.Damaged, vd.errors.NoResult), issubclass(vd.errors.NoResult, ValueError)
(True, True)
"""

__all__ = [
    "Busy",
    "ConfigError",
    "Damaged",
    "Different",
    "Failed",
    "NoResult",
    "TooLarge",
    "Unwritable",
    "VibrodriveError",
]


def __dir__() -> list[str]:
    return sorted(__all__)


class VibrodriveError(Exception):
    """Base class of the exceptions of this program. The message is one line."""


class ConfigError(VibrodriveError, ValueError):
    """A configuration or an option is invalid. This is raised before any computation."""


class TooLarge(VibrodriveError, ValueError):
    """A sweep does not fit into memory or on the disk. The message gives the required and the available size."""


class Different(VibrodriveError, ValueError):
    """A file was made from another configuration (the message gives the keys that differ), or was replaced since."""


class NoResult(VibrodriveError, ValueError):
    """A file is not a result file of this version."""


class Damaged(NoResult):
    """A result file, or a block of its points, cannot be read."""


class Busy(VibrodriveError, RuntimeError):
    """Another process, or another writer in this one, is writing the file."""


class Failed(VibrodriveError, RuntimeError):
    """A sweep ended with an error during the computation; its file can be resumed."""


class Unwritable(VibrodriveError, OSError):
    """The system refused to write (disk full, file too large, …). The message is one line.

    Committed results are kept, and a sweep can be resumed.
    """

    def __str__(self) -> str:
        return super().__str__() if self.filename is None else f"{self.filename}: {self.strerror}"
