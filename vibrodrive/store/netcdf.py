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


def dimension(file: h5py.File, name: str, values: np.ndarray, long_name: str, units: str) -> h5py.Dataset:
    """Create a dimension and the coordinate variable with its values."""
    data = _create(file, name, values.shape, values.dtype, (long_name, units))
    data[...] = values
    data.make_scale(name)
    return data


def variable(
    file: h5py.File,
    name: str,
    dimensions: tuple[str, ...],
    dtype: Any,
    about: tuple[str, str],
    *,
    fill: Any = None,
    chunks: tuple[int, ...] | None = None,
) -> h5py.Dataset:
    """Create a variable over existing dimensions. `about` is its long name and its unit, `fill` its value where nothing
    has been written."""
    data = _create(file, name, tuple(len(file[d]) for d in dimensions), dtype, about, chunks, fillvalue=fill)
    for k, d in enumerate(dimensions):
        data.dims[k].attach_scale(file[d])
    return data


def _create(
    file: h5py.File,
    name: str,
    shape: tuple[int, ...],
    dtype: Any,
    about: tuple[str, str],
    chunks: tuple[int, ...] | None = None,
    **options: Any,
) -> h5py.Dataset:
    chunks = chunks or tuple(min(n, MOST) for n in shape)
    data = file.create_dataset(name, shape, dtype, chunks=chunks, fletcher32=True, **options)
    data.attrs["long_name"], data.attrs["units"] = about
    return data
