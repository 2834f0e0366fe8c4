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
from vibrodrive.store.reader import DamagedBlock, look, verify
from vibrodrive.store.writer import open_writer

CONFIG = "[sweep]\nA = {start = 3.0, stop = 3.25, num = 3000}\n[run]\ntransient = 0\nperiods = 6\n"
ARRAYS = ("section", "status", "margin", "switches")

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


@pytest.fixture(params=FORMS.values(), ids=FORMS)
def form(request):
    return request.param


@pytest.fixture
def paths(tmp_path):
    return tmp_path / "ours.h5", tmp_path / "theirs.h5"


def assert_equal(path, other):
    one, two = vd.load(path), vd.load(other)
    assert {name: one[name].tobytes() for name in ARRAYS} == {name: two[name].tobytes() for name in ARRAYS}
    assert one.title == two.title


def test_rewritten_file_is_read_and_never_written(paths, form):
    """Chunks written directly into it would be unreadable for ever, or make the rest unreadable."""
    ours, theirs = paths
    fake.write(ours, CONFIG, which=[1])
    rewrite(ours, theirs, form)
    before = theirs.read_bytes()
    assert_equal(ours, theirs)
    report = verify(theirs)
    assert (report.complaints(), report.share, look(theirs).share) == ([], 1 / 3, 1 / 3)
    assert report.facts()["rewritten"] == "section_xi has other chunks or filters"
    told = r"rewritten by another program \(section_xi has other chunks or filters\): .*, but it cannot be resumed"
    writer = open_writer(theirs, parse(CONFIG).plan(), Origin(CONFIG))
    with pytest.raises(NoResult, match=told):
        writer.check()
    with pytest.raises(NoResult, match=told):
        writer.write(fake.block(writer.plan, 0))
    writer.abandon()
    assert theirs.read_bytes() == before


def test_complete_rewritten_file_needs_nothing(paths, form, run, quick):
    ours, theirs = paths
    fake.write(ours, CONFIG)
    (ours.parent / "c.toml").write_text(CONFIG)
    rewrite(ours, theirs, form)
    before = theirs.read_bytes()
    code, out, err = run("sweep", "c.toml", "-o", "theirs.h5")
    assert (code, out, err.splitlines()[0]) == (0, "", "theirs.h5 is complete: nothing to compute")
    code, out, err = run("info", "--check", "theirs.h5")
    assert (code, err) == (0, "complete and undamaged\n")
    assert "rewritten by another program (section_xi has other chunks or filters): it cannot be resumed\n" in out
    assert quick == []
    assert theirs.read_bytes() == before
    assert_equal(ours, theirs)


def test_damage_of_a_rewritten_file_is_found_and_not_repaired(paths, form, run, quick):
    """Also if the other program has left out the checksums of the chunks."""
    ours, theirs = paths
    fake.write(ours, CONFIG)
    (ours.parent / "c.toml").write_text(CONFIG)
    rewrite(ours, theirs, form)
    with h5py.File(theirs, "r+") as file:
        file["margin"][1500] *= 2
    before = theirs.read_bytes()
    with pytest.warns(
        DamagedBlock,
        match=r"left out of margin: block 1 \(points 1000 to 1999: .*\): the values do not match .*, into another file",
    ):
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
    fake.write(ours, CONFIG)
    (ours.parent / "c.toml").write_text(CONFIG)
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


def test_part_of_a_file_is_no_damaged_file(paths):
    """As ncks and xarray write it. Without a trace of another program the axis counts as damaged."""
    ours, theirs = paths
    fake.write(ours, CONFIG)
    with xr.open_dataset(ours, engine="h5netcdf") as data:
        data.isel(A=slice(0, 100)).to_netcdf(theirs, engine="h5netcdf")
    with pytest.raises(NoResult, match=r"rewritten by another program \(axis A: changed after it was written\)"):
        vd.load(theirs)


@pytest.mark.integration
@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
@pytest.mark.parametrize("decoded", [True, False])
def test_file_saved_by_xarray_is_read(paths, engine, decoded):
    ours, theirs = paths
    fake.write(ours, CONFIG, which=[1])
    save_by_xarray(ours, theirs, engine, decoded)
    assert_equal(ours, theirs)
    assert verify(theirs).complaints() == []
