"""The file of a sweep over quantities in SI units has coordinates with units, and is refused for another scene."""

import h5py
import pytest
import xarray as xr

from tests.support import fake
from vibrodrive.errors import Different
from vibrodrive.model.config import parse
from vibrodrive.model.physical import Scene
from vibrodrive.store.layout import Origin
from vibrodrive.store.load import load
from vibrodrive.store.reader import look
from vibrodrive.store.writer import open_writer

TEXT = (
    "[physical]\nmu = 0.6\nmass = 250\n"
    "[sweep]\nomega0 = {start = 100, stop = 200, num = 1500}\nalpha = [2, 3.4]\na0 = [8e-4]\n"
    "[run]\ntransient = 0\nperiods = 3\n"
)


def write(path, plan, count=None):
    writer = open_writer(path, plan, Origin(TEXT))
    writer.check()
    todo = writer.missing()
    for block in fake.run_blocks(writer.plan, todo[:count]):
        writer.write(block)
    writer.close()
    return len(todo)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "x.h5"


def test_file_has_coordinates_with_units_and_the_scene(path):
    plan = parse(TEXT).plan()
    write(path, plan)
    with h5py.File(path) as file:
        units = {name: file[name].attrs["units"] for name in ("omega0", "alpha", "a0", "period", "margin")}
        assert units == {"omega0": "rad s-1", "alpha": "degree", "a0": "m", "period": "1", "margin": "1"}
        assert "angular frequency" in file["omega0"].attrs["long_name"]
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.margin.dims == ("omega0", "alpha", "a0")
        assert data.omega0.values.tolist() == plan.axes["omega0"].tolist()
    results = load(path)
    assert {name: axis.tolist() for name, axis in results.axes.items()} == {k: v.tolist() for k, v in plan.axes.items()}
    assert (results.scalars["mu"], results.scalars["mass"]) == (0.6, 250.0)
    assert results.scalars.keys().isdisjoint({"A", "B"})
    at = results.select("nearest", omega0=120.0, alpha=3.4, a0=8e-4).scalars
    scene = Scene(a0=8e-4, omega0=at["omega0"], mu=0.6, alpha=3.4)
    assert (at["A"], at["B"]) == (scene.A, scene.B)
    again = look(path).header.plan
    assert again.points(0, plan.n_points).tobytes() == plan.points(0, plan.n_points).tobytes()


def test_another_scene_is_refused_in_one_line(path):
    write(path, parse(TEXT).plan(), count=1)
    for option, words in (
        ("mu=0.7", "mu is 0.6 in the file and 0.7 in the configuration"),
        ("mass=1", "mass is 250.0 in the file and 1.0 in the configuration"),
        ("alpha=[2, 3]", r"alpha is \[2.0, 3.4\] in the file and \[2.0, 3.0\] in the configuration"),
        ("physical.g=9.81", "g is 9.80665 in the file and 9.81 in the configuration"),
    ):
        with pytest.raises(Different, match=words) as caught:
            write(path, parse(TEXT, [option]).plan())
        assert "\n" not in str(caught.value)
