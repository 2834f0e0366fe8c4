"""HDF5 datasets as variables of netCDF-4: named dimensions, units, a long name and a checksum.

So xarray and other programs can open a result file.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

MOST = 1 << 16  # largest default length of a chunk along a dimension


def create(path: str | Path, **options: Any) -> h5py.File:
    """Create an HDF5 file that tracks the order of its variables, without which the netCDF library cannot extend it.

    `h5py.File(path, "w", track_order=True)` also stores the time, before h5py 3.15, so that two files of one
    configuration would differ.
    """
    properties, access = h5py.h5p.create(h5py.h5p.FILE_CREATE), h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    for follow in (properties.set_link_creation_order, properties.set_attr_creation_order):
        follow(h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED)
    properties.set_obj_track_times(False)
    access.set_libver_bounds(h5py.h5f.LIBVER_EARLIEST, h5py.h5f.LIBVER_LATEST)  # the default of h5py, not of all HDF5
    access.set_file_locking(False, True)
    h5py.h5f.create(os.fsencode(path), h5py.h5f.ACC_TRUNC, properties, access).close()
    return h5py.File(path, "r+", **options)


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
    describe(data, dict(zip(("long_name", "units"), about, strict=True)))
    return data


def describe(what: h5py.File | h5py.Dataset, attributes: Mapping[str, Any]) -> None:
    """Add attributes. Texts have a fixed length, because programs for netCDF-3, such as the package of Octave, read no
    others, and because HDF5 may loop for ever in the heap of the others if it is damaged."""
    for name, value in attributes.items():
        text = value.encode() if isinstance(value, str) else None
        dtype = None if text is None else h5py.string_dtype("utf-8", max(len(text), 1))
        what.attrs.create(name, value if text is None else text, dtype=dtype)


def attribute(what: h5py.File | h5py.Dataset, name: str) -> Any:
    """Return an attribute as a text or a number. Other programs write a text also with a variable length, and text or
    number also as an array of one. Raises KeyError and the other exceptions of h5py."""
    value = what.attrs[name]
    if isinstance(value, h5py.Empty):  # an empty text of the netCDF library
        return ""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    return value.decode() if isinstance(value, bytes) else value
