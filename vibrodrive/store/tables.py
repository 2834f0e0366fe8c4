"""Files that consist of tables and are written in one step.

A table is a dimension that numbers the rows. Its columns are variables over this dimension.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibrodrive.model.kinds import FILES
from vibrodrive.store import netcdf
from vibrodrive.store.describe import explained
from vibrodrive.store.file import new_file
from vibrodrive.store.layout import Origin, about

Table = Mapping[str, tuple[Any, str]]  # columns by name: values (an array, or a list of texts), long name


def save(
    path: Path,
    kind: str,
    origin: Origin,
    contents: str,
    shared: Mapping[str, Any],
    tables: Mapping[str, Table],
    **further: Any,
) -> None:
    """Write a file of tables, given by the names of their dimensions. After an error no new file is left.

    `contents` describes the file in a sentence. `shared` and `further` are root attributes; the comment of the file
    explains only `shared`. Raises the exceptions of `new_file`.
    """
    with new_file(path, seal=True) as file:
        file.attrs.update(about(kind, origin) | {FILES[kind].schema: FILES[kind].readable[-1]})
        file.attrs.update(explained(contents, shared) | further)
        for dimension, columns in tables.items():
            netcdf.table(file, dimension, columns)


def rows(file: h5py.File, *columns: str) -> Iterator[tuple[Any, ...]]:
    """Return the rows of some columns of a table, in Python types."""
    return zip(*(_values(file[name]) for name in columns), strict=True)


def _values(data: h5py.Dataset) -> list[Any]:
    return (data.asstr() if h5py.check_string_dtype(data.dtype) else data)[...].tolist()


def first_rows(lengths: Iterable[int]) -> np.ndarray:
    """Return the number of the first row of each part, for consecutive parts with these lengths."""
    counts = np.array(list(lengths), np.int64)
    return np.cumsum(counts) - counts


def parts(file: h5py.File, first: str, lengths: str, dimension: str) -> Iterator[slice]:
    """Return the slice of rows of each part along a dimension. Raises ValueError if the parts are not consecutive.

    `first` and `lengths` are the names of the variables with the first row and the length of each part.
    """
    begin, count = file[first][...], file[lengths][...]
    if not np.array_equal(first_rows(count), begin) or count.sum() != len(file[dimension]):
        raise ValueError(f"{first}: does not match {lengths}")
    return (slice(b, b + n) for b, n in zip(begin.tolist(), count.tolist(), strict=True))


def number(file: h5py.File, name: str) -> Any:
    """Return a root attribute that is one number as a Python number. Raises ValueError for any other attribute."""
    return np.asarray(file.attrs[name]).item()
