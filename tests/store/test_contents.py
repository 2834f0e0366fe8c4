"""The file of each record describes its contents; equal runs make equal files; what a file is not is said in a line."""

import hashlib
from dataclasses import replace
from time import sleep

import h5py
import numpy as np
import pytest
import xarray as xr

import vibrodrive as vd
from tests.support import fake
from tests.support.process import python
from vibrodrive.errors import Different
from vibrodrive.model.above import ABOVE, above
from vibrodrive.model.config import parse
from vibrodrive.model.own import Own
from vibrodrive.model.plan import make_plan
from vibrodrive.model.reasons import How
from vibrodrive.model.records import RECORDS
from vibrodrive.store.layout import Origin
from vibrodrive.store.reader import look, verify

OWN = Own("settle", ("last", "share"), "1")
TOGETHER = (*(one for one in RECORDS.values() if not one.alone), OWN)
GRID = {"method": "fixed", "dtau": 0.1}

PLANS = {
    name: {"A": [1.0, 2.0], "eps": [0.0], "periods": 3, "record": record, **(GRID if name == "failures" else {})}
    for name, record in {**{name: (name,) for name in RECORDS}, "own": (OWN,), "several": TOGETHER}.items()
}
for name in ("limit", "impulses", "always"):
    PLANS[name].pop("eps")


def made(name, path):
    fake.write(path, make_plan(PLANS[name]), Origin(""))
    return path


each = pytest.mark.parametrize("name", PLANS)


def test_file_does_not_contain_the_time(tmp_path):
    one = made("section", tmp_path / "one.h5").read_bytes()
    sleep(1.1)  # HDF5 stores seconds
    assert one == made("section", tmp_path / "two.h5").read_bytes()


@each
def test_every_variable_is_described_and_every_text_has_a_fixed_length(name, tmp_path):
    """Programs for netCDF-3 read no other texts: Octave neither lists nor reads an attribute of such a file."""
    with h5py.File(made(name, tmp_path / "x.h5")) as file:
        for variable, data in [*file["digests"].items(), *file.items()]:
            if variable != "digests":
                assert all((data.attrs["long_name"], data.attrs["units"], data.id.get_offset() % 8 == 0)), variable
                assert data.is_scale or tuple(len(d[0]) for d in data.dims) == data.shape, variable
        kinds = {f"{of.name} {a}": of.attrs.get_id(a).dtype for of in (file, *file.values()) for a in of.attrs}
        texts = {about: text for about, kind in kinds.items() if (text := h5py.check_string_dtype(kind)) is not None}
    assert {"/ config", "/ method", "/status long_name", "/status units", "/status flag_meanings"} <= texts.keys()
    assert [about for about, text in texts.items() if text.length is None] == []


@each
def test_any_program_finds_the_values_and_their_digests(name, tmp_path):
    """With `numpy.memmap`, and with the recipe of docs/files.md for a digest."""
    path = made(name, tmp_path / "x.h5")
    with h5py.File(path) as file:
        for variable, sums in file["digests"].items():
            if variable != "block":
                data = file[variable]
                place = {"dtype": data.dtype, "shape": data.shape, "offset": data.id.get_offset()}
                raw = np.memmap(path, mode="r", **place)
                np.testing.assert_array_equal(raw, data[...])
                for k, part in enumerate(np.split(raw, len(sums))):  # one block, or one for each A
                    found = hashlib.blake2b(
                        variable.encode() + part.tobytes(), digest_size=8, salt=k.to_bytes(16, "little")
                    )
                    assert int.from_bytes(found.digest(), "little") == sums[k]


OF_OTHERS = {
    "variable length": lambda value: value.decode() if isinstance(value, bytes) else value,
    "array of one": np.atleast_1d,
    "array of one text of variable length": lambda value: (
        np.array([value.decode()], h5py.string_dtype()) if isinstance(value, bytes) else np.atleast_1d(value)
    ),
}
"""How other programs write an attribute. Versions of before 0.1.0 wrote texts of variable length."""


@pytest.mark.parametrize("form", OF_OTHERS.values(), ids=OF_OTHERS)
def test_attributes_are_read_in_every_form(form, tmp_path):
    path, whole = tmp_path / "x.h5", made("several", tmp_path / "whole.h5")
    plan = make_plan(PLANS["several"] | {"A": [1.0, 2.0, 2.5]})
    fake.write(path, replace(plan, tiling=(1, 1)), Origin("# ξ\n", ("a=1",), "Ein Würfel"), which=[1])
    title = vd.load(path).title
    with h5py.File(path, "r+") as file:
        for of in (file, *file.values()):
            for name, value in list(of.attrs.items()):
                if name not in ("CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST"):
                    of.attrs[name] = form(value)
    report = verify(path)
    assert (report.sound, report.share, report.header.origin) == (True, 1 / 3, ("# ξ\n", ("a=1",), "Ein Würfel"))
    assert vd.load(path).title == title == "Ein Würfel"
    fake.write(path, plan)
    assert verify(path).complete
    assert vd.load(path)["section"][:2].tobytes() == vd.load(whole)["section"].tobytes()


@pytest.mark.parametrize(("sought", "grid"), [("eps", {}), ("dtau", {"method": "fixed"})])
def test_file_of_limits_says_in_which_disturbance_and_how(sought, grid, tmp_path):
    path = tmp_path / "x.h5"
    fake.write(path, make_plan({"A": [1.0, 2.0], "record": ("limit",), **grid}), Origin(""))
    with h5py.File(path) as file:
        assert file.attrs["record"].decode() == f"limit in {sought}"
        assert f"a limit in {sought}:" in file.attrs["comment"].decode()
        assert sought not in file.attrs
        about = file["how"].attrs
        assert about["flag_values"].tolist() == [int(how) for how in How]
        assert about["flag_meanings"].decode().split() == [how.name.lower() for how in How]
        assert all(how.meaning in about["comment"].decode() for how in How)
    facts = look(path).facts()
    assert ("eta" in facts["parameters"]) == (sought == "eps"), "η acts on the motions of a limit in ε"


def test_functions_of_higher_layers_exist():
    assert [what for what in ABOVE if not callable(above(what))] == []


SCENE = "[physical]\nmu = 0.6\nmass = 250\n[sweep]\nomega0 = [100, 150]\nalpha = [2, 3.4]\na0 = [8e-4]\n"


def test_file_of_a_scene_has_coordinates_with_units_and_refuses_another_scene(tmp_path):
    path = tmp_path / "x.h5"
    fake.write(path, SCENE)
    with xr.open_dataset(path, engine="h5netcdf") as data:
        units = {name: data[name].attrs["units"] for name in ("omega0", "alpha", "a0", "margin")}
        assert units == {"omega0": "rad s-1", "alpha": "degree", "a0": "m", "margin": "1"}
        assert data.margin.dims == ("omega0", "alpha", "a0")
        assert data.omega0.values.tolist() == [100.0, 150.0]
    assert vd.load(path).scalars.keys().isdisjoint({"A", "B"})
    assert look(path).header.plan.points(0, 4).tobytes() == parse(SCENE).plan().points(0, 4).tobytes()
    for option, words in (
        ("mu=0.7", "mu is 0.6 in the file and 0.7 in the configuration"),
        ("alpha=[2, 3]", r"alpha is \[2.0, 3.4\] in the file and \[2.0, 3.0\] in the configuration"),
        ("physical.g=9.81", "g is 9.80665 in the file and 9.81 in the configuration"),
    ):
        with pytest.raises(Different, match=words):
            fake.write(path, parse(SCENE, [option]).plan())


def test_file_of_points_has_them_as_coordinates_and_refuses_others(tmp_path):
    path, text = tmp_path / "x.h5", "[sweep]\neps = [0, 1e-4]\n[sweep.points]\nA = [3, 3.1, 3.2]\nxi0 = [0, 1, 2]\n"
    fake.write(path, text)
    found = vd.load(path)
    assert {name: values.tolist() for name, values in found.points.items()} == {"A": [3, 3.1, 3.2], "xi0": [0, 1, 2]}
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.A.dims == data.xi0.dims == ("point",)
        at = data.section_xi.swap_dims(point="A").sel(A=3.1, method="nearest")
        np.testing.assert_array_equal(at, found.select(point=1).section[..., 0])
    assert look(path).header.plan.points(0, 6).tobytes() == parse(text).plan().points(0, 6).tobytes()
    told = r"points\.xi0 is \[0.0, 1.0, 2.0\] in the file and \[0.0, 1.0, 9.0\] in the configuration"
    with pytest.raises(Different, match=told):
        fake.write(path, text.replace("1, 2]", "1, 9]"))


ADD = """
import sys, netCDF4, xarray
for path in sys.argv[1:]:
    with xarray.open_dataset(path, engine="netcdf4") as data:
        data.load()
    with netCDF4.Dataset(path, "a") as file:
        read = [variable[...] for variable in file.variables.values()]
        file.note = file["status"].note = "added"
"""


@pytest.mark.integration
def test_netcdf_library_reads_and_annotates_every_record(tmp_path):
    """In a process of its own, which a fault of the library would abort."""
    paths = [made(name, tmp_path / f"{name}.h5") for name in PLANS]
    fake.write(tmp_path / "one.h5", "[sweep]\nA = 3.0\n[run]\nperiods = 3\n")
    fake.write(tmp_path / "scene.h5", SCENE, which=[])
    before = [path.read_bytes() for path in paths]
    python(ADD, *tmp_path.iterdir())
    for path, content in zip(paths, before, strict=True):
        assert path.read_bytes() != content
        assert verify(path).sound
        assert vd.load(path).computed == 1.0
    fake.write(tmp_path / "scene.h5", SCENE)
    assert verify(tmp_path / "scene.h5").complete
    assert vd.load(tmp_path / "one.h5").section.shape == (3, 2)
