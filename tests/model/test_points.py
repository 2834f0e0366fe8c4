"""Tests of parameters that change together along the axis `point`, in Python, configurations, results and files."""

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from tests.support import fake
from vibrodrive.batch.block import gather
from vibrodrive.errors import Different
from vibrodrive.model.config import parse
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.plan import make_plan
from vibrodrive.model.toml import as_toml
from vibrodrive.store.load import load
from vibrodrive.store.reader import look, verify

TEXT = """
[sweep]
eps = [0.0, 1e-4]
[sweep.points]
A = {start = 3.0, stop = 3.2, num = 5}
xi0 = [0, 1, 2, 3, 4]
[run]
periods = 3
transient = 0
"""
POINTS = {"A": np.linspace(3.0, 3.2, 5), "xi0": [0, 1, 2, 3, 4]}


def column(plan, name):
    return plan.points(0, plan.n_points)[:, COLUMNS.index(name)].tolist()


def test_configuration_and_call_give_the_same_points():
    called = make_plan({"eps": [0.0, 1e-4], "points": POINTS, "periods": 3, "transient": 0})
    for plan in (called, parse(TEXT).plan(), parse(as_toml(called)).plan()):
        assert (list(plan.axes), plan.shape) == (["eps", "point"], (2, 5))
        assert column(plan, "A") == 2 * POINTS["A"].tolist()
        assert column(plan, "xi0") == 2 * [0.0, 1.0, 2.0, 3.0, 4.0]
        assert column(plan, "eps") == 5 * [0.0] + 5 * [1e-4]
    first = make_plan({"points": POINTS, "eps": [0.0, 1e-4]})
    assert list(first.axes) == ["point", "eps"], "axes must keep the order written"
    assert column(make_plan({"points": pd.DataFrame(POINTS)}), "A") == POINTS["A"].tolist()
    r = gather(called, fake.run_blocks(called))
    assert "eps 0…0.0001 (2), point 0…4 (5) with A, xi0; section" in repr(r)


def test_file_stores_points_as_coordinates(tmp_path):
    path = tmp_path / "x.h5"
    fake.write(path, TEXT)
    assert verify(path).sound
    found = load(path)
    assert {name: values.tolist() for name, values in found.points.items()} == {
        "A": POINTS["A"].tolist(), "xi0": [0.0, 1.0, 2.0, 3.0, 4.0]
    }  # fmt: skip
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.A.dims == data.xi0.dims == ("point",)
        at = data.section_xi.swap_dims(point="A").sel(A=3.1, method="nearest")
        np.testing.assert_array_equal(at, found.select(point=2).section[..., 0])
    assert look(path).header.plan.points(0, 10).tobytes() == parse(TEXT).plan().points(0, 10).tobytes()
    words = r"points\.xi0 is a list of 5 values from 0 to 4 in the file and a list of 5 values from 0 to 5 in"
    with pytest.raises(Different, match=words):
        fake.write(path, TEXT.replace("3, 4]", "3, 5]"))
