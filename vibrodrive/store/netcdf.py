"""HDF5 datasets as variables of netCDF-4: named dimensions, units and a long name, each in one piece of the file.

So xarray and other programs can open a result file.
"""

from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np


def create(content: Any) -> h5py.File:
    """Create an HDF5 file as the bytes of a Python file object.

    It tracks the order of its variables, without which the netCDF library cannot extend it. `h5py.File(…, "w",
    track_order=True)` also stores the time, before h5py 3.15, so that two files of one configuration would differ.
    """
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    # from HDF5 1.8 on headers have checksums: a damaged address of a variable would lead writers elsewhere
    access.set_libver_bounds(h5py.h5f.LIBVER_V18, h5py.h5f.LIBVER_LATEST)
    access.set_alignment(1, 8)  # for numpy.memmap
    access.set_fileobj_driver(h5py.h5fd.fileobj_driver, content)
    made = h5py.h5f.create(b"a new file", h5py.h5f.ACC_TRUNC, _in_order(h5py.h5p.FILE_CREATE), access)
    return h5py.File(made)


def group(file: h5py.File, name: str) -> h5py.Group:
    """Create a group, which also tracks the order of its variables."""
    return h5py.Group(h5py.h5g.create(file.id, name.encode(), gcpl=_in_order(h5py.h5p.GROUP_CREATE)))


def _in_order(kind: Any) -> Any:
    properties = h5py.h5p.create(kind)
    properties.set_link_creation_order(h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED)
    properties.set_attr_creation_order(h5py.h5p.CRT_ORDER_TRACKED | h5py.h5p.CRT_ORDER_INDEXED)
    properties.set_obj_track_times(False)
    return properties


def dimension(parent: h5py.Group, name: str, values: np.ndarray, long_name: str, units: str) -> h5py.Dataset:
    """Create a dimension and the coordinate variable with its values."""
    data = _create(parent, name, values.shape, values.dtype, (long_name, units))
    data[...] = values
    data.make_scale(name)
    return data


def variable(
    parent: h5py.Group, name: str, dimensions: tuple[str, ...], dtype: Any, about: tuple[str, str], fill: Any = None
) -> h5py.Dataset:
    """Create a variable over existing dimensions. `about` is its long name and its unit, `fill` its value where nothing
    has been written, by default 0."""
    data = _create(parent, name, tuple(len(parent[d]) for d in dimensions), dtype, about, fill)
    for k, d in enumerate(dimensions):
        data.dims[k].attach_scale(parent[d])
    return data


def _create(
    parent: h5py.Group, name: str, shape: tuple[int, ...], dtype: Any, about: tuple[str, str], fill: Any = None
) -> h5py.Dataset:
    """Create a dataset whose values are one piece of the file, which they have from the beginning."""
    made, number = h5py.h5p.create(h5py.h5p.DATASET_CREATE), np.dtype(dtype)
    made.set_layout(h5py.h5d.CONTIGUOUS)
    made.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    made.set_fill_time(h5py.h5d.FILL_TIME_NEVER if fill is None else h5py.h5d.FILL_TIME_ALLOC)
    if fill is not None:
        made.set_fill_value(np.array(fill, number))
    made.set_obj_track_times(False)
    space, kind = h5py.h5s.create_simple(shape), h5py.h5t.py_create(number)
    data = h5py.Dataset(h5py.h5d.create(parent.id, name.encode(), kind, space, made))
    describe(data, dict(zip(("long_name", "units"), about, strict=True)))
    return data


def describe(holder: h5py.File | h5py.Dataset, attributes: Mapping[str, Any]) -> None:
    """Add attributes. Texts have a fixed length, because programs for netCDF-3, such as the package of Octave, read no
    others, and because HDF5 may loop for ever in the heap of those if it is damaged."""
    for name, value in attributes.items():
        text = value.encode() if isinstance(value, str) else None
        dtype = None if text is None else h5py.string_dtype("utf-8", max(len(text), 1))
        holder.attrs.create(name, value if text is None else text, dtype=dtype)


def attribute(holder: h5py.File | h5py.Dataset, name: str) -> Any:
    """Return an attribute as a text or a number. Other programs write a text also with a variable length, and text or
    number also as an array of one. Raises KeyError and the other exceptions of h5py."""
    value = holder.attrs[name]
    if isinstance(value, h5py.Empty):  # an empty text of the netCDF library
        return ""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    return value.decode() if isinstance(value, bytes) else value
