"""Files of tables, which are written in one go: dimensions that count rows, and columns over them."""

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

Table = Mapping[str, tuple[Any, str]]
"""Columns by name: values (an array, or a list of texts), long name."""


def save(
    path: Path,
    kind: str,
    origin: Origin,
    contents: str,
    shared: Mapping[str, Any],
    tables: Mapping[str, Table],
    **further: Any,
) -> None:
    """Write tables, by the name of the dimension of their rows, into a file that is there whole or not at all.

    `contents` says in a sentence what the file holds; `shared` are plain attributes that its comment explains,
    `further` those that it does not. Raises NoResult if `path` is no result file of this program, or OSError.
    """
    with new_file(path, seal=True) as file:
        file.attrs.update(about(kind, origin) | {FILES[kind].schema: FILES[kind].readable[-1]})
        file.attrs.update(explained(contents, shared) | further)
        for dimension, columns in tables.items():
            netcdf.table(file, dimension, columns)


def rows(file: h5py.File, *columns: str) -> Iterator[tuple[Any, ...]]:
    """Return the rows of some columns of a table, of Python's types."""
    return zip(*(_values(file[name]) for name in columns), strict=True)


def _values(data: h5py.Dataset) -> list[Any]:
    return (data.asstr() if h5py.check_string_dtype(data.dtype) else data)[...].tolist()


def first_rows(lengths: Iterable[int]) -> np.ndarray:
    """Return the row at which each part begins, where parts of these lengths follow each other."""
    counts = np.array(list(lengths), np.int64)
    return np.cumsum(counts) - counts


def parts(file: h5py.File, first: str, lengths: str, dimension: str) -> Iterator[slice]:
    """Return the rows of each part along a dimension. Raises ValueError if they do not follow each other."""
    begin, count = file[first][...], file[lengths][...]
    if not np.array_equal(first_rows(count), begin) or count.sum() != len(file[dimension]):
        raise ValueError(f"{first}: does not fit {lengths}")
    return (slice(b, b + n) for b, n in zip(begin.tolist(), count.tolist(), strict=True))


def number(file: h5py.File, name: str) -> Any:
    """Return a root attribute that is one number, of Python's type. Raises ValueError if it is not."""
    return np.asarray(file.attrs[name]).item()
