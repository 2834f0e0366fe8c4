"""Checks of the paths of results and figures, before a computation and before a file is replaced.

This module imports HDF5 only inside its functions, so that `--help` does not load it.
"""

import os
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path

from vibrodrive.errors import ConfigError, Damaged, NoResult
from vibrodrive.model.figure import FORMATS
from vibrodrive.model.parameters import bad
from vibrodrive.store.draft import draft_of

ENDINGS = (".h5", ".nc")
"""Endings of result files. They are HDF5 and netCDF-4 in one; without an ending a slip such as `-o diagram` or
`-o table.csv` would be written."""


def check_figure(target: Path, sources: Mapping[str, Path]) -> None:
    """Raise ConfigError if a figure cannot be written. `sources` are the input files of the figure, by their roles."""
    if target.suffix.lower() not in FORMATS:
        raise ConfigError(bad("figure", str(target), "a file name ending in " + ", ".join(FORMATS)))
    check_replaced("figure", target, sources)


def check_replaced(role: str, target: Path, sources: Mapping[str, Path]) -> None:
    """Raise ConfigError if a file that is written in one step cannot be written, or would replace an input or data."""
    from vibrodrive.store.header import SIGNATURE

    check_different({**sources, role: target, f"temporary file of the {role}": draft_of(target)})
    check_place(role, target, renamed=True)
    if target.exists() and os.access(target, os.R_OK):
        with open(target, "rb") as file:
            if file.read(len(SIGNATURE)) == SIGNATURE:
                raise ConfigError(bad(role, str(target), "another file, because this file contains data (HDF5)"))


def check_output(path: Path, config: Path | None, *, overwrite: bool, figures: Sequence[Path] = ()) -> None:
    """Raise ConfigError if a result file cannot be written, or if output files would replace each other or an input.

    An existing result file is resumed; its configuration is compared later. With `overwrite` it is replaced. Without
    a configuration the file is the argument `path` of a call in Python.
    """
    from vibrodrive.store.header import reading

    source, role = ({}, "path") if config is None else ({"configuration": config}, "output")
    check_different({**source, role: path, "temporary file of the output": draft_of(path)})
    check_place(role, path, renamed=overwrite)
    if path.suffix.lower() not in ENDINGS:
        drawn = f"; `vibrodrive plot FILE.h5 -o {path}` draws one" if path.suffix.lower() in FORMATS else ""
        raise ConfigError(bad(role, str(path), f"a result file ({' or '.join(ENDINGS)}){drawn}"))
    for figure in figures:
        check_figure(figure, {**source, role: path})
    if overwrite:
        refuse_foreign(path)
        return
    if not path.exists():
        return
    try:
        with reading(path):
            pass
    except Damaged:
        raise
    except NoResult as error:
        advice = "choose another file; only result files are overwritten"
        raise ConfigError(error.args[0].at(f"{role} = {str(path)!r}") + f"; {advice}") from None


def refuse_foreign(path: Path) -> None:
    """Raise NoResult for an existing file that is no result file of this program. Only result files may be replaced.

    A damaged file may be replaced if it can be recognised.
    """
    from vibrodrive.store.header import is_ours, no_result, open_result

    if not path.exists():
        return
    try:
        with open_result(path) as file:
            ours = is_ours(file)
    except NoResult as error:
        raise NoResult(f"{error}; only result files are overwritten") from None
    if not ours:
        raise no_result(path, "not a result file of vibrodrive; only result files are overwritten")


def check_place(role: str, path: Path, *, renamed: bool) -> None:
    """Raise ConfigError if a path cannot be written.

    `renamed` means that a temporary file in the same directory will be written and renamed to the path.
    """
    from vibrodrive.model.config import special

    try:
        kind = special(path)
        exists = True
    except FileNotFoundError:
        kind, exists = None, False
    except OSError as error:
        raise ConfigError(bad(role, str(path), f"a path that can be written ({error.strerror})")) from None
    if kind is not None:
        raise ConfigError(bad(role, str(path), f"a file, but is {kind}"))
    parent = os.path.dirname(os.path.realpath(path))
    if renamed and os.path.ismount(os.path.realpath(path)):  # as a file of a container may be
        raise ConfigError(bad(role, str(path), "a file that can be replaced, but it is mounted alone"))
    if not os.path.isdir(parent):
        raise ConfigError(bad(role, str(path), "in a directory that exists (No such file or directory)"))
    needed = ([path] if exists else []) + ([Path(parent)] if renamed or not exists else [])
    if not all(os.access(place, os.W_OK) for place in needed):
        raise ConfigError(bad(role, str(path), "a path with write permission (Permission denied)"))


def check_different(files: Mapping[str, Path]) -> None:
    """Raise ConfigError if two paths lead to the same file, even with different spellings or by links."""
    for (role, path), (other, second) in combinations(files.items(), 2):
        try:
            same = os.path.samefile(path, second)
        except OSError:  # one file does not exist, or its directory does not
            same = os.path.realpath(path) == os.path.realpath(second)
        if same:
            raise ConfigError(bad(other, str(second), f"another file than the {role}, {str(path)!r}"))
