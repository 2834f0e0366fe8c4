"""Hashes of the sources of this package. They tell which machine code and which workers belong to this process."""

import hashlib
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from vibrodrive.version import __version__

PACKAGE = __name__.partition(".")[0]

COMPILED = (
    "jit", "kernels", "batch.prange", "explorer.density",
    "model.choices", "model.reasons", "model.states",
    "periodic.fixed_points", "periodic.flight", "periodic.itineraries",
    "stability.bounds", "stability.impulses", "stability.main_impacts", "stability.reach",
)  # fmt: skip
"""Modules, and folders of modules, on which machine code depends: those with kernels, and all that these import."""


@cache
def fingerprints() -> tuple[str, str]:
    """Return the hash of all sources of the package, and the hash of the sources on which machine code depends.

    The sources are read once in a process, when kernels are imported. So the hashes belong to the code that runs, even
    if the package is edited or installed again meanwhile. Raises OSError if sources cannot be read.
    """
    sources = read(files(PACKAGE))
    return hash_of(sources, sources), hash_of(sources, filter(is_compiled, sources) if len(sources) > 1 else sources)


def is_compiled(name: str) -> bool:
    """Return whether machine code depends on a module of the package."""
    return f"{name}.".startswith(tuple(f"{PACKAGE}.{each}." for each in COMPILED))


def hash_of(sources: Mapping[str, bytes], names: Iterable[str]) -> str:
    """Return the SHA-256 of the sources of some modules."""
    digest = hashlib.sha256()
    for name in sorted(names):
        digest.update(name.encode() + b"\0" + sources[name])
    return digest.hexdigest()


def build() -> str:
    """Return the version of the package and the beginning of the hash of all its sources, as messages name them.

    The hash also contains modules that compute nothing, so that it misses none that is imported on request.
    """
    return f"vibrodrive {__version__} (sources {fingerprints()[0][:12]})"


def read(root: Traversable) -> dict[str, bytes]:
    """Return the source of each module of the package in the folder `root`, by name.

    `root` may be a folder in an archive. A frozen program has no sources; the program itself is returned instead.
    """
    sources = {name: file.read_bytes() for name, file in _modules(root, PACKAGE)} if root.is_dir() else {}
    return sources or {"": Path(sys.executable).read_bytes()}


def _modules(folder: Traversable, name: str) -> Iterator[tuple[str, Traversable]]:
    """Yield (name, file) for each module in a folder and in the folders below. Backups of editors are no modules."""
    for entry in folder.iterdir():
        stem, _, ending = entry.name.rpartition(".")
        if ending == "py" and stem.isidentifier():
            yield name if stem == "__init__" else f"{name}.{stem}", entry
        elif entry.name.isidentifier() and entry.is_dir():
            yield from _modules(entry, f"{name}.{entry.name}")
