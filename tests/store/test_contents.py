"""The file of each record describes its contents; equal runs make equal files; what a file is not is said in a line."""

import h5py
import numpy as np
import pytest

import vibrodrive as vd
from tests.support import fake
from vibrodrive.errors import NoResult
from vibrodrive.model.above import ABOVE, above
from vibrodrive.model.own import Own
from vibrodrive.model.plan import make_plan
from vibrodrive.model.records import ALONE, RECORDS, How
from vibrodrive.store.header import BEFORE
from vibrodrive.store.layout import Origin
from vibrodrive.store.reader import look, verify

OWN = Own("settle", ("last", "share"), "0" * 64)
TOGETHER = (*(name for name in RECORDS if name not in ALONE), OWN)
GRID = {"method": "fixed", "dtau": 0.1}

PLANS = {
    name: {"A": [1.0, 2.0], "eps": [0.0], "periods": 3, "record": record, **(GRID if name == "failures" else {})}
    for name, record in {**{name: (name,) for name in RECORDS}, "own": (OWN,), "several": TOGETHER}.items()
}
PLANS["limit"].pop("eps")


def made(name, path):
    fake.write(path, make_plan(PLANS[name]), Origin(""))
    return path


each = pytest.mark.parametrize("name", PLANS)


@each
def test_file_of_each_record_is_read_described_and_equal_to_another(name, tmp_path):
    path = made(name, tmp_path / "one.h5")
    assert path.read_bytes() == made(name, tmp_path / "two.h5").read_bytes()
    results, report = vd.load(path), look(path)
    assert results.record == make_plan(PLANS[name]).record
    assert repr(results).startswith("<Results of 2")
    assert verify(path).sound
    assert report.complete
    assert report.facts()["blocks"] == {"computed": 1, "of": 1}
    for quantity in results.quantities:
        assert np.array_equal(results[quantity.name], fake.block(results.plan, 0).records[quantity.name].reshape(
            results[quantity.name].shape), equal_nan=True)  # fmt: skip


@each
def test_every_variable_has_dimensions_a_unit_a_name_and_a_checksum(name, tmp_path):
    path = made(name, tmp_path / "x.h5")
    with h5py.File(path) as file:
        for variable, data in file.items():
            assert data.attrs["long_name"], variable
            assert data.attrs["units"], variable
            assert data.fletcher32, variable
            if not data.is_scale:
                assert tuple(len(d[0]) for d in data.dims) == data.shape, variable


def test_codes_of_a_limit_have_their_meanings_in_the_file(tmp_path):
    with h5py.File(made("limit", tmp_path / "x.h5")) as file:
        about = file["how"].attrs
        assert about["flag_values"].tolist() == [int(how) for how in How]
        assert about["flag_meanings"].split() == [how.name.lower() for how in How]
        assert all(how.meaning in about["comment"] for how in How)


@pytest.mark.parametrize("kind", [*BEFORE, "switches"])
def test_kinds_of_files_of_before_are_refused_with_what_to_do(kind, tmp_path):
    path = made("section", tmp_path / "x.h5")
    with h5py.File(path, "r+") as file:
        file.attrs["kind"] = kind
    for read in (vd.load, look):
        with pytest.raises(NoResult, match=f"contains {kind}, a kind of file of before 0.1.0; ") as refused:
            read(path)
        assert str(refused.value).endswith(BEFORE.get(kind, "reads nor writes it")), "one sentence says what to do"


def test_functions_of_higher_layers_exist():
    assert [what for what in ABOVE if not callable(above(what))] == []
