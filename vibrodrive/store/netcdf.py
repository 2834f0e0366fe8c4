"""HDF5 datasets as variables of netCDF-4: named dimensions, units, a long name and a checksum.

All kinds of result files use these functions, so that xarray and other programs can open them.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

MOST = 1 << 16  # largest default length of a chunk along a dimension


def create(path: str | Path, **options: Any) -> h5py.File:
    """Create an HDF5 file. The netCDF library extends only a file that tracks the order of its variables."""
    return h5py.File(path, "w", track_order=True, **options)


def dimension(file: h5py.File, name: str, values: np.ndarray, long_name: str, units: str = "1") -> h5py.Dataset:
    """Create a dimension and the coordinate variable with its values."""
    data = _create(file, name, values.shape, values.dtype)
    if data.size:
        data[...] = values
    data.make_scale(name)
    return _describe(data, long_name, units)


def variable(
    file: h5py.File,
    name: str,
    dimensions: tuple[str, ...],
    dtype: Any,
    long_name: str,
    *,
    fill: Any = None,
    chunks: tuple[int, ...] | None = None,
    units: str = "1",
) -> h5py.Dataset:
    """Create a variable over existing dimensions. `fill` is its value where nothing has been written.

    Texts of fixed length have no such value: the netCDF library would overwrite memory when it opens the file.
    """
    shape = tuple(len(file[d]) for d in dimensions)
    kind = np.dtype(dtype)
    data = _create(file, name, shape, kind, chunks, fillvalue=None if kind.kind == "S" else fill)
    for k, d in enumerate(dimensions):
        data.dims[k].attach_scale(file[d])
    return _describe(data, long_name, units)


def table(file: h5py.File, name: str, columns: Mapping[str, tuple[Any, str]]) -> None:
    """Create a dimension `name` that counts rows, and variables over it.

    columns : (array or list of texts, long name) of each variable, by its name.
    """
    count = len(next(iter(columns.values()))[0])
    dimension(file, name, np.arange(count), f"index of the {name}")
    for column, (values, meaning) in columns.items():
        dtype = h5py.string_dtype() if isinstance(values, list) else values.dtype
        data = variable(file, column, (name,), dtype, meaning)
        if count:
            data[:] = values


def _create(
    file: h5py.File,
    name: str,
    shape: tuple[int, ...],
    dtype: np.dtype,
    chunks: tuple[int, ...] | None = None,
    **options: Any,
) -> h5py.Dataset:
    if 0 in shape or _is_text(dtype):  # HDF5 has no checksum for empty arrays and texts
        return file.create_dataset(name, shape, dtype, **options)
    chunks = chunks or tuple(min(n, MOST) for n in shape)
    return file.create_dataset(name, shape, dtype, chunks=chunks, fletcher32=True, **options)


def _describe(data: h5py.Dataset, long_name: str, units: str = "1") -> h5py.Dataset:
    if not _is_text(data.dtype):
        data.attrs["units"] = units
    data.attrs["long_name"] = long_name
    return data


def _is_text(dtype: np.dtype) -> bool:
    """Return True if the entries are texts of variable length."""
    text = h5py.check_string_dtype(dtype)
    return text is not None and text.length is None
