"""Hashes of the sources of this package. They tell which machine code and which workers belong to this process."""

import ast
import hashlib
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from vibrodrive.version import __version__

PACKAGE = __name__.partition(".")[0]

COMPILERS = {f"{PACKAGE}.jit.compile", f"{PACKAGE}.jit.compiler"}
"""Modules that import one of these modules may contain kernels."""

_IMPORT = re.compile(rb"\n((?:from|import)\b[^\n(\\]*(?:\([^)]*\)|(?:\\\n[^\n\\]*)+)?[^\n]*)")
"""An import statement that is not indented, with its continuation lines. Indented imports are in functions or for type
checks, so no kernel depends on them. To parse these statements takes a tenth of the time that entire modules would
take."""


@cache
def fingerprints() -> tuple[str, str]:
    """Return the hash of all sources of the package, and the hash of the sources on which machine code depends.

    The sources are read once in a process, when kernels are imported. So the hashes belong to the code that runs, even
    if the package is edited or installed again meanwhile. Raises OSError or SyntaxError if sources cannot be read.
    """
    sources, packages = read(files(PACKAGE))
    return hash_of(sources, sources), hash_of(sources, kernels(sources, packages) or sources)


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


def read(root: Traversable) -> tuple[dict[str, bytes], set[str]]:
    """Return the source of each module of the package in the folder `root`, by name, and the names of its packages.

    `root` may be a folder in an archive. A frozen program has no sources; the program itself is returned instead.
    """
    found = dict(_modules(root, PACKAGE)) if root.is_dir() else {}
    if not found:
        return {"": Path(sys.executable).read_bytes()}, set()
    packages = {name for name, file in found.items() if file.name == "__init__.py"}
    return {name: file.read_bytes() for name, file in found.items()}, packages


def _modules(folder: Traversable, name: str) -> Iterator[tuple[str, Traversable]]:
    """Yield (name, file) for each module in a folder and in the folders below. Backups of editors are no modules."""
    for entry in folder.iterdir():
        stem, _, ending = entry.name.rpartition(".")
        if ending == "py" and stem.isidentifier():
            yield name if stem == "__init__" else f"{name}.{stem}", entry
        elif entry.name.isidentifier() and entry.is_dir():
            yield from _modules(entry, f"{name}.{entry.name}")


def kernels(sources: Mapping[str, bytes], packages: set[str]) -> set[str]:
    """Return the names of the modules on which machine code depends.

    These are the modules that import one of COMPILERS, the modules in their folder, and all modules that any of these
    modules imports, directly or indirectly.
    """
    folder = next(iter(COMPILERS)).rpartition(".")[0]
    homes = COMPILERS | ({folder} & packages)
    words = [home.rpartition(".")[2].encode() for home in homes]
    near = [name for name, source in sources.items() if any(word in source for word in words)]
    imported = {name: set(_imported(name, sources, packages)) for name in near}
    todo = [name for name in near if not homes.isdisjoint(imported[name])]
    todo += [name for name in sources if name.rpartition(".")[0] == folder and name not in todo]
    known = set(todo)
    while todo:
        name = todo.pop()
        new = (imported[name] if name in imported else set(_imported(name, sources, packages))) - known
        known |= new
        todo += new
    return known


def _imported(name: str, sources: Mapping[str, bytes], packages: set[str]) -> Iterator[str]:
    """Yield the names of the modules of the package that module `name` imports.

    sources : source of every module of the package, by name
    packages : names of those modules that are packages
    """
    package = name.partition(".")[0].encode()
    lines = _IMPORT.findall(b"\n" + sources[name])
    lines = [line for line in lines if package in line or line.split()[1].startswith(b".")]
    try:
        statements = ast.parse(b"\n".join(lines)).body
    except SyntaxError:  # a line of a string looks like an import, or a comment in an import contains a bracket
        statements = ast.parse(sources[name]).body
    for statement in statements:
        if isinstance(statement, ast.Import):
            yield from (alias.name for alias in statement.names if alias.name in sources)
        elif isinstance(statement, ast.ImportFrom):
            base = statement.module or ""
            if statement.level:
                parts = name.split(".")
                up = statement.level - (name in packages)  # in `__init__.py` one dot is the package itself
                base = ".".join([*parts[: len(parts) - up], *filter(None, [base])])
            for alias in statement.names:
                found = f"{base}.{alias.name}"
                if found in sources or base in sources:
                    yield found if found in sources else base
