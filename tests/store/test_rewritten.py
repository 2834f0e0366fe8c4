"""Files that other programs have written anew: whole if their digests are right, and resumed if blocks have a place."""

import re

import h5py
import numpy as np
import pytest
import xarray as xr

import vibrodrive as vd
from tests.support import fake
from vibrodrive.errors import Damaged, NoResult
from vibrodrive.store.reader import DamagedBlock, verify

CONFIG = "[sweep]\nA = {start = 3.0, stop = 3.25, num = 3000}\n[run]\ntransient = 0\nperiods = 6\n"

FORMS = {
    "h5repack -f GZIP": lambda data: {"chunks": True, "fletcher32": True, "compression": "gzip"},
    "h5repack -f SHUF": lambda data: {"chunks": True, "shuffle": True},
    "h5repack -l CHUNK": lambda data: {"chunks": (min(100, len(data)), *data.shape[1:])},
    "h5repack -l CONTI": lambda data: {},
}
"""How other programs store a variable, as arguments of h5py. Each is what h5repack makes with these options."""

CHUNKED = [form for form in FORMS if "CONTI" not in form]


def rewrite(path, target, form, leave_out=()):
    """Write the file anew, as other programs do that keep its groups."""

    def copy(old, new):
        for name, what in old.items():
            if isinstance(what, h5py.Group):
                copy(what, new.create_group(name))
            elif name not in leave_out:
                new.create_dataset(name, data=what[...], **form(what))

    with h5py.File(path) as old, h5py.File(target, "w") as new:
        new.attrs.update(old.attrs)
        copy(old, new)


def save_by_xarray(path, target, engine, decoded=True):
    """Save both groups of the file anew, which gives each variable a _FillValue."""
    for mode, group in (("w", None), ("a", "digests")):
        with xr.open_dataset(path, engine=engine, decode_cf=decoded, group=group) as data:
            data.load().to_netcdf(target, mode, engine=engine, group=group)


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


def test_complete_rewritten_file_needs_nothing(paths, theirs, run, quick):
    before = theirs.read_bytes()
    code, out, err = run("sweep", "c.toml", "-o", "theirs.h5")
    assert (code, out, err.splitlines()[0]) == (0, "", "theirs.h5 is complete: nothing to compute")
    code, out, err = run("info", "--check", "theirs.h5")
    assert (code, err) == (0, "complete and undamaged\n")
    chunked = verify(theirs).facts()["rewritten"]
    assert chunked in ("", "section_xi has chunks or filters")
    assert (f"rewritten by another program ({chunked}): it cannot be resumed\n" in out) == bool(chunked)
    assert quick == []
    assert theirs.read_bytes() == before
    one, two = map(vd.load, paths)
    assert all(one[name].tobytes() == two[name].tobytes() for name in ("section", "status", "margin", "switches"))


@pytest.mark.parametrize("form", FORMS)
def test_damage_of_a_rewritten_file_is_found_and_computed_again_where_it_can_be(paths, form, run, quick):
    rewrite(*paths, FORMS[form])
    theirs = paths[1]
    with h5py.File(theirs, "r+") as file:
        file["margin"][1500] *= 2
    before = theirs.read_bytes()
    told = r"left out of margin: block 1 \(points 1000 to 1999: .*\): margin: does not match its digest"
    told += r".*, into another file" if form in CHUNKED else ""
    with pytest.warns(DamagedBlock, match=told):
        assert np.isnan(vd.load(theirs).margin).sum() == 1000
    code, _, err = run("sweep", "c.toml", "-o", "theirs.h5")
    if form in CHUNKED:
        assert (code, quick) == (2, [])
        assert re.fullmatch("vibrodrive: theirs.h5: rewritten by another program .* cannot be resumed\n", err)
        assert theirs.read_bytes() == before
    else:
        assert (code, quick) == (0, [1])
        assert verify(theirs).complete


MISSING = {"variable section_dxi": "section_dxi", "variable A": "A", "variable status": "status", "group digests": ""}


@pytest.mark.parametrize("what", [*MISSING, "attribute plan", "attribute overrides", "attribute schema_version"])
def test_file_without_a_part_is_no_damaged_file(paths, what, run):
    ours, theirs = paths
    rewrite(ours, theirs, FORMS["h5repack -l CONTI"], leave_out=[MISSING.get(what)])
    if what == "group digests":  # xarray knows one group at a time
        with xr.open_dataset(ours) as data:
            data.load().to_netcdf(theirs)
    elif what not in MISSING:
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
