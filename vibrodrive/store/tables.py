"""Files that consist of tables and are written in one step. A table is a dimension, whose values number the rows, and
columns over this dimension."""

from __future__ import annotations

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
    """Write a file of tables, given by the name of their dimension; after an error no file is left.

    `contents` describes the file in a sentence; its comment explains the attributes `shared`, but not `further`.
    Raises NoResult if an existing file at `path` is not a result file of this program, or OSError.
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
    """Return the first row of each part, for consecutive parts of these lengths."""
    counts = np.array(list(lengths), np.int64)
    return np.cumsum(counts) - counts


def parts(file: h5py.File, first: str, lengths: str, dimension: str) -> Iterator[slice]:
    """Return the slice of rows of each part along a dimension, from the variables with its first row and its length.

    Raises ValueError if the parts are not consecutive.
    """
    begin, count = file[first][...], file[lengths][...]
    if not np.array_equal(first_rows(count), begin) or count.sum() != len(file[dimension]):
        raise ValueError(f"{first}: does not match {lengths}")
    return (slice(b, b + n) for b, n in zip(begin.tolist(), count.tolist(), strict=True))


def number(file: h5py.File, name: str) -> Any:
    """Return a root attribute that is one number, in its Python type. Raises ValueError otherwise."""
    return np.asarray(file.attrs[name]).item()
