"""HDF5 datasets as variables of netCDF-4: named dimensions, units, a long name and a checksum.

So xarray and other programs can open a result file.
"""

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
    """Create a variable over existing dimensions. `fill` is its value where nothing has been written."""
    shape = tuple(len(file[d]) for d in dimensions)
    data = _create(file, name, shape, np.dtype(dtype), chunks, fillvalue=fill)
    for k, d in enumerate(dimensions):
        data.dims[k].attach_scale(file[d])
    return _describe(data, long_name, units)


def _create(
    file: h5py.File,
    name: str,
    shape: tuple[int, ...],
    dtype: np.dtype,
    chunks: tuple[int, ...] | None = None,
    **options: Any,
) -> h5py.Dataset:
    chunks = chunks or tuple(min(n, MOST) for n in shape)
    return file.create_dataset(name, shape, dtype, chunks=chunks, fletcher32=True, **options)


def _describe(data: h5py.Dataset, long_name: str, units: str) -> h5py.Dataset:
    data.attrs["units"] = units
    data.attrs["long_name"] = long_name
    return data
