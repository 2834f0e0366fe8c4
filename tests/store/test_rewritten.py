"""Files that other programs have written anew: read where nothing is missing, and never resumed into damage."""

import re

import h5py
import numpy as np
import pytest
import xarray as xr

import vibrodrive as vd
from tests.support import fake
from vibrodrive.errors import Damaged, NoResult
from vibrodrive.model.config import parse
from vibrodrive.store.layout import Origin
from vibrodrive.store.reader import DamagedBlock, verify
from vibrodrive.store.writer import open_writer

CONFIG = "[sweep]\nA = {start = 3.0, stop = 3.25, num = 3000}\n[run]\ntransient = 0\nperiods = 6\n"

FORMS = {
    "h5repack -f GZIP": lambda data: {"chunks": data.chunks, "fletcher32": True, "compression": "gzip"},
    "h5repack -f SHUF": lambda data: {"chunks": data.chunks, "shuffle": True},
    "h5repack -f NONE": lambda data: {"chunks": data.chunks},
    "h5repack -l CHUNK": lambda data: {"chunks": (min(100, len(data)), *data.shape[1:]), "fletcher32": True},
    "h5repack -l CONTI": lambda data: {},
}
"""How other programs store a variable, as arguments of h5py. Each is what h5repack makes with these options."""


def rewrite(path, target, form, leave_out=()):
    """Write the file anew, as other programs do."""
    with h5py.File(path) as old, h5py.File(target, "w") as new:
        new.attrs.update(old.attrs)
        for name, data in old.items():
            if name not in leave_out:
                new.create_dataset(name, data=data[...], fillvalue=data.fillvalue, **form(data))


def save_by_xarray(path, target, engine, decoded=True):
    """Save the file anew, which gives each variable a _FillValue."""
    with xr.open_dataset(path, engine=engine, decode_cf=decoded) as data:
        data.load().to_netcdf(target, engine=engine)


@pytest.fixture
def paths(tmp_path):
    """Return the paths of a complete file and of one that will be made of it. Their configuration is c.toml."""
    fake.write(tmp_path / "ours.h5", CONFIG)
    (tmp_path / "c.toml").write_text(CONFIG)
    return tmp_path / "ours.h5", tmp_path / "theirs.h5"


@pytest.fixture(params=FORMS.values(), ids=FORMS)
def theirs(request, paths):
    """Return the path of a complete file that another program has written anew."""
    rewrite(*paths, request.param)
    return paths[1]


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_nothing_is_written_into_an_unfinished_rewritten_file(tmp_path, form):
    """Chunks written directly into it would be unreadable for ever, or make the rest unreadable."""
    theirs = tmp_path / "theirs.h5"
    fake.write(tmp_path / "part.h5", CONFIG, which=[1])
    rewrite(tmp_path / "part.h5", theirs, form)
    before = theirs.read_bytes()
    told = r"rewritten by another program \(section_xi has other chunks or filters\): .*, but it cannot be resumed"
    writer = open_writer(theirs, parse(CONFIG).plan(), Origin(CONFIG))
    for attempt in (writer.check, lambda: writer.write(fake.block(writer.plan, 0))):
        with pytest.raises(NoResult, match=told):
            attempt()
    writer.abandon()
    assert theirs.read_bytes() == before


def test_complete_rewritten_file_needs_nothing(paths, theirs, run, quick):
    before = theirs.read_bytes()
    code, out, err = run("sweep", "c.toml", "-o", "theirs.h5")
    assert (code, out, err.splitlines()[0]) == (0, "", "theirs.h5 is complete: nothing to compute")
    code, out, err = run("info", "--check", "theirs.h5")
    assert (code, err) == (0, "complete and undamaged\n")
    assert "rewritten by another program (section_xi has other chunks or filters): it cannot be resumed\n" in out
    assert verify(theirs).facts()["rewritten"] == "section_xi has other chunks or filters"
    assert quick == []
    assert theirs.read_bytes() == before
    one, two = map(vd.load, paths)
    assert all(one[name].tobytes() == two[name].tobytes() for name in ("section", "status", "margin", "switches"))


def test_damage_of_a_rewritten_file_is_found_and_not_repaired(theirs, run, quick):
    """Also if the other program has left out the checksums of the chunks."""
    with h5py.File(theirs, "r+") as file:
        file["margin"][1500] *= 2
    before = theirs.read_bytes()
    told = r"left out of margin: block 1 \(points 1000 to 1999: .*\): the values do not match .*, into another file"
    with pytest.warns(DamagedBlock, match=told):
        assert np.isnan(vd.load(theirs).margin).sum() == 1000
    code, _, err = run("sweep", "c.toml", "-o", "theirs.h5")
    assert code == 2
    assert re.fullmatch("vibrodrive: theirs.h5: rewritten by another program .* cannot be resumed\n", err)
    assert quick == []
    assert theirs.read_bytes() == before


MISSING = {"variable section_dxi": "section_dxi", "variable A": "A", "variable status": "status"}


@pytest.mark.parametrize("what", [*MISSING, "attribute plan", "attribute overrides", "attribute schema_version"])
def test_file_without_a_part_is_no_damaged_file(paths, what, run):
    ours, theirs = paths
    rewrite(ours, theirs, FORMS["h5repack -l CONTI"], leave_out=[MISSING.get(what)])
    if what not in MISSING:
        with h5py.File(theirs, "r+") as file:
            del file.attrs[what.split()[1]]
    before = theirs.read_bytes()
    told = f"theirs.h5: rewritten by another program (without the {what}): its numbers can be read by h5py, xarray"
    with pytest.raises(NoResult, match=re.escape(told)) as refused:
        vd.load(theirs)
    assert not isinstance(refused.value, Damaged)
    for command in (("info", "theirs.h5"), ("plot", "theirs.h5"), ("sweep", "c.toml", "-o", "theirs.h5")):
        code, out, err = run(*command)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert told.removeprefix("theirs.h5: ") in err
        assert "but it cannot be resumed" in err
    assert theirs.read_bytes() == before


@pytest.mark.parametrize(
    "change", [lambda values: values.astype("<f4"), lambda values: values[:-1]], ids=["type", "shape"]
)
def test_variable_of_another_type_or_shape_is_damage(paths, change):
    with h5py.File(paths[0], "r+") as file:
        values = file["margin"][...]
        del file["margin"]
        file["margin"] = change(values)
    with pytest.raises(Damaged, match=r"damaged \(margin: wrong shape or data type\)"):
        vd.load(paths[0])


def test_part_of_a_file_is_no_damaged_file(paths):
    """As ncks and xarray write it. Without a trace of another program the axis counts as damaged."""
    ours, theirs = paths
    with xr.open_dataset(ours, engine="h5netcdf") as data:
        data.isel(A=slice(0, 100)).to_netcdf(theirs, engine="h5netcdf")
    with pytest.raises(NoResult, match=r"rewritten by another program \(axis A: changed after it was written\)"):
        vd.load(theirs)
