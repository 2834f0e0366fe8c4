"""All kinds of result files have named dimensions, units, long names and checksums."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest

from vibrodrive.model.config import parse
from vibrodrive.model.plan import make_plan
from vibrodrive.periodic.bifurcations import Bifurcation
from vibrodrive.periodic.family import Family
from vibrodrive.periodic.search import Orbit
from vibrodrive.store import failures, layout, limits, netcdf, orbits

ORBIT = Orbit(
    1, 1, np.array([2.0]), np.array([-1.0]), np.array([1]), -0.5, "stable", "UP DOWN IMPACT", 2.0, 0.1, ("UP",)
)


def a_sweep(path):
    with h5py.File(path, "w") as file:
        layout.lay_out(file, make_plan({"A": [1.0, 2.0], "eps": [0.0], "periods": 3}), layout.Origin(""))


def some_failures(path):
    config = parse("[sweep]\nA = [1.0, 2.0]\ndtau = [0.1, 0.2]\n")
    with h5py.File(path, "w") as file:
        failures.lay_out(file, config)


def some_limits(path):
    config = parse("[sweep]\nA = [1.0, 2.0]\n")
    limits.create(path, config, config.plan().axes, "order")


def some_orbits(path):
    bifurcation = Bifurcation(2.0, "fold", ORBIT, 1.0, 1.0)
    found = [[ORBIT], [replace(ORBIT, A=2.1)]]
    orbits.save(path, Family(np.array([2.0, 2.1]), 0.1, 1, found, [bifurcation]), layout.Origin(""), 0.0)


def no_orbits(path):
    orbits.save(path, Family(np.array([0.5]), 0.1, 1, [[]], []), layout.Origin(""), 0.0)


def datasets(file):
    found = []
    file.visititems(lambda name, item: found.append((name, item)))
    return found


@pytest.mark.parametrize("make", [a_sweep, some_failures, some_limits, some_orbits, no_orbits])
def test_every_dataset_is_a_variable_of_netcdf(make, tmp_path):
    path = tmp_path / "x.h5"
    make(path)
    with h5py.File(path) as file:
        for name, data in datasets(file):
            text = h5py.check_string_dtype(data.dtype) is not None and data.dtype.kind == "O"
            assert data.attrs["long_name"], name
            assert data.attrs.get("units") == (None if text else "1"), name
            assert data.fletcher32 == (data.size > 0 and not text), name
            if not data.is_scale:
                assert [len(d) for d in data.dims] == [1] * data.ndim, name
                assert tuple(len(d[0]) for d in data.dims) == data.shape, name


def test_a_variable_lies_over_its_dimensions(tmp_path):
    with h5py.File(tmp_path / "x.h5", "w") as file:
        netcdf.dimension(file, "A", np.array([1.0, 2.0, 3.0]), "amplitude")
        netcdf.dimension(file, "none", np.arange(0), "of nothing")
        data = netcdf.variable(file, "x", ("A",), "<i4", "a number", fill=-1, chunks=(2,))
        assert (data.chunks, data.dtype, data[...].tolist()) == ((2,), np.dtype("<i4"), [-1, -1, -1])
        assert data.dims[0].keys() == ["A"]
        assert netcdf.variable(file, "y", ("A", "none"), float, "nothing").shape == (3, 0)
        assert netcdf.variable(file, "z", ("A",), h5py.string_dtype(), "words").chunks is None
