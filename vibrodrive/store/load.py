"""`vd.load`: the results in a file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from vibrodrive.model.parameters import bad, has_control, with_sentences
from vibrodrive.store.header import reading
from vibrodrive.store.reader import read

if TYPE_CHECKING:
    from vibrodrive.model.results import Results


@with_sentences
def load(path: str | Path) -> Results:
    """Read a result file, finished or not.

    Parameters
    ----------
    path : str or path
        a file written by `vibrodrive sweep` or by `vd.sweep(..., path=…)`.

    Returns
    -------
    Results
        as from `sweep`, with the title of the configuration. The arrays are read on access, even while the sweep is
        running. Damaged blocks count as not computed; a warning names them.

    Raises
    ------
    NoResult
        if `path` is not a result file of this version. This exception and the next are in `vibrodrive.errors`.
    Damaged (a NoResult)
        if the file cannot be read.
    TypeError, ValueError
        if `path` is not a file name.
    FileNotFoundError, OSError
        if there is no such file, or the system cannot open it.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> r = vd.load("fig07.h5")  # made by `vibrodrive sweep configs/fig07.toml`
    >>> r.axes["eps"], r.computed
    (array([0.    , 0.0002]), 1.0)
    """
    path = check_path(path)
    with reading(path) as file:
        return read(file)


def check_path(path: object) -> Path:
    """Return a file name as Path. Raises TypeError or ValueError with a sentence that names the value of `path`."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise TypeError(bad("path", path, "the name of a result file"))
    if not os.fspath(path) or has_control(os.fspath(path)):
        raise ValueError(bad("path", path, "the name of a result file"))
    return Path(path)
