"""`Results.to_xarray` equals the Dataset that xarray reads from the file. Without xarray the error is one line."""

import sys
import warnings

import numpy as np
import pytest
import xarray as xr
from vibrodrive.store.every_kind import load

from tests.support import fake
from vibrodrive.model.config import parse
from vibrodrive.model.plan import make_plan
from vibrodrive.model.results import Results
from vibrodrive.store.layout import Origin

AXES = "[sweep]\nA = {start = 3.0, stop = 3.2, num = 5}\neps = [0.0, 1e-4]\n[run]\nperiods = 3\ntransient = 0\n"
SCENE = "[physical]\nomega0 = 150\nmu = 0.6\nalpha = 3\nmass = 250\n[sweep]\na0 = [1e-3, 2e-3]\n[run]\nperiods = 3\n"
TEXTS = {
    "section": AXES,
    "everything": AXES + 'record = ["section", "summary", "impacts"]\n',
    "summary": AXES + 'record = "summary"\n',
    "points": "[sweep.points]\nA = [3.0, 3.1]\nxi0 = [0, 1]\n[run]\nperiods = 3\n",
    "scene": SCENE,
}


everything = pytest.mark.parametrize("path", ["everything"], indirect=True)


@pytest.fixture(params=TEXTS)
def path(request, tmp_path):
    config = parse(TEXTS[request.param])
    fake.write(tmp_path / "x.h5", config.plan(), Origin(config.text, title="A title"))
    return tmp_path / "x.h5"


def test_dataset_equals_the_file_read_by_xarray(path):
    made = load(path).to_xarray()
    with xr.open_dataset(path, engine="h5netcdf") as read:
        xr.testing.assert_equal(made, read.drop_vars("checksum"))
        for name in made.variables:
            told = dict(made[name].attrs)
            if "flag_values" in told:
                np.testing.assert_array_equal(told.pop("flag_values"), read[name].attrs["flag_values"])
            assert told == {key: value for key, value in read[name].attrs.items() if key != "flag_values"}, name
            assert made[name].dtype == read[name].dtype, name
        assert made.attrs["title"] == read.attrs["title"]


def test_dataset_attributes_are_the_parameters(path):
    results = load(path)
    attrs = results.to_xarray().attrs
    swept = {*results.axes, *results.points}
    assert {name: attrs[name] for name in attrs if name in results.scalars} == {
        name: value for name, value in results.scalars.items() if name not in swept and value == value
    }
    assert (attrs["method"], attrs["periods"], attrs["record"]) == ("certified", 3, ", ".join(results.record))


@everything
def test_dataset_survives_a_round_trip(path, tmp_path):
    made = load(path).to_xarray()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made.to_netcdf(tmp_path / "again.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "again.nc", engine="h5netcdf") as again:
        xr.testing.assert_equal(made, again)
        assert again.attrs["method"] == "certified"


@everything
def test_missing_xarray_is_reported_in_one_line(path, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(ImportError, match=r"^to_xarray needs the extra `data`: pip install 'vibrodrive\[data\]'$"):
        load(path).to_xarray()


def test_table_has_a_row_for_each_point_and_a_column_for_each_number(path):
    results = load(path)
    table = results.to_dataframe()
    assert len(table) == results.status.size
    for k, index in enumerate(np.ndindex(results.shape)):
        row = table.iloc[k]
        assert row["status"] == str(results.status[index])
        assert row["margin"] == results.margin[index]
        for (name, values), i in zip(results.axes.items(), index, strict=True):
            assert row[name] == values[i]
        for name, values in results.points.items():
            assert row[name] == values[index]
    data = results.to_xarray()
    numbers = {n for n, array in data.variables.items() if n not in data.dims and set(array.dims) == set(results.axes)}
    wanted = (
        {"period" if name == "motion_period" else name for name in numbers}
        | results.axes.keys()
        | results.points.keys()
    )
    assert set(table) == wanted
    assert set(table.attrs["units"]) == set(table)


def test_table_of_one_motion_has_one_row():
    plan = make_plan({"A": 3.0, "record": "summary"})
    table = Results.collect(plan, fake.run_blocks(plan)).to_dataframe()
    assert len(table) == 1
    assert {"status", "margin", "period", "energy"} <= set(table)
    assert "point" not in table
