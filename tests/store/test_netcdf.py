"""The netCDF library opens the file of each record and adds to it. A separate process, which a fault would abort."""

import h5py
import numpy as np
import pytest

from tests.support import fake
from tests.support.process import python
from vibrodrive.model.records import ALONE, RECORDS
from vibrodrive.store.load import load
from vibrodrive.store.reader import verify

pytestmark = pytest.mark.integration

ADD = """
import sys, netCDF4, xarray
for path in sys.argv[1:]:
    with xarray.open_dataset(path, engine="netcdf4") as data:
        data.load()
    with netCDF4.Dataset(path, "a") as file:
        read = [variable[...] for variable in file.variables.values()]
        file.note = file["status"].note = "added"
        print(*file.variables)
"""


def test_every_record_is_read_and_annotated(tmp_path):
    records = {name: [name] for name in RECORDS} | {"all": [name for name in RECORDS if name not in ALONE]}
    for name, record in records.items():
        text = f"[sweep]\nA = [3.0, 3.1]\nxi0 = [0.0]\n[run]\nperiods = 3\nrecord = {record}\n"
        text += '[switching]\nmethod = "fixed"\ndtau = 0.1\n' if name == "failures" else ""
        fake.write(tmp_path / f"{name}.h5", text)
    fake.write(tmp_path / "points.h5", "[sweep.points]\nA = [3.0, 3.1]\nxi0 = [0, 1]\n[run]\nperiods = 3\n")
    fake.write(tmp_path / "one.h5", "[sweep]\nA = 3.0\n[run]\nperiods = 3\n")
    fake.write(tmp_path / "empty.h5", "[sweep]\nA = [3.0, 3.1]\n[run]\nperiods = 3\n", which=[])
    paths = sorted(tmp_path.iterdir())
    before = [load(path) for path in paths]
    variables = python(ADD, *paths).splitlines()
    assert len(variables) == len(paths)
    for path, results, names in zip(paths, before, variables, strict=True):
        assert {"status", "margin", "switches", "checksum"} < {*names.split()}
        assert verify(path).sound
        np.testing.assert_array_equal(results.margin, load(path).margin)
        with h5py.File(path) as file:
            assert file.attrs["note"] == file["status"].attrs["note"] == b"added"
    fake.write(tmp_path / "empty.h5", "[sweep]\nA = [3.0, 3.1]\n[run]\nperiods = 3\n")
    assert verify(tmp_path / "empty.h5").complete
