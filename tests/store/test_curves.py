"""This program and other programs read files of curves as they were written."""

import h5py
import numpy as np
import pytest

from vibrodrive.errors import Damaged, OtherKind
from vibrodrive.periodic.conditions import Condition, Slide
from vibrodrive.periodic.curve import Curve, Meeting
from vibrodrive.periodic.flight import FROM_REVERSAL, FROM_STICK
from vibrodrive.store import curves, tables
from vibrodrive.store.curves import StoredCurves, save
from vibrodrive.store.every_kind import load, summary
from vibrodrive.store.header import read_kind
from vibrodrive.store.layout import Origin

ORIGIN = Origin("[sweep]\nA = 2\n[orbits]\nmax_period = 2\n", (), "Two of them")

FLIGHT = (Slide(False, FROM_STICK, 0, False), Slide(True, FROM_REVERSAL, 0, True))


def made():
    """Return two curves that meet twice: the onset, and a border collision whose condition has two slides."""
    line = np.linspace(0.0, 1.0, 4)
    points = np.arange(12.0).reshape(3, 4) / 7.0
    condition = Condition("border", FLIGHT, 1, True, 1)
    meets = [Meeting(1.25, 0.25, 1, "crossing"), Meeting(1.5, 0.5, 1, "end")]
    onset = Curve("onset", 1, 1, "REST", "", 1.0 + line, line, ("edge", "edge"), tuple(meets))
    border = Curve(
        "border", 1, 1, condition.word, "beginning", points[:, 2], points[:, 3], ("level", "stick"),
        tuple(m._replace(other=0) for m in meets), condition, points,
    )  # fmt: skip
    return StoredCurves([onset, border], 2, (1.0, 2.0), (0.0, 1.0), ORIGIN.title)


def test_curves_survive_a_round_trip(tmp_path):
    found = made()
    save(tmp_path / "c.h5", found, ORIGIN)
    read = load(tmp_path / "c.h5")
    for name in ("max_period", "A", "B", "title"):
        assert getattr(read, name) == getattr(found, name), name
    for one, other in zip(read.curves, found.curves, strict=True):
        for name in ("kind", "period", "impacts", "word", "side", "ends", "meets", "condition"):
            assert getattr(one, name) == getattr(other, name), name
        for name in ("A", "B", "points"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert read.curves[0].at(0.3).tolist() == [1.3]


def test_file_without_curves(tmp_path):
    save(tmp_path / "c.h5", StoredCurves([], 2, (0.5, 0.9), (0.0, 1.0)), ORIGIN)
    assert load(tmp_path / "c.h5").curves == []
    assert summary(tmp_path / "c.h5", thorough=True).faults == []


def test_summary_of_curves(tmp_path):
    save(tmp_path / "c.h5", made(), ORIGIN)
    assert read_kind(tmp_path / "c.h5") == "curves"
    found = summary(tmp_path / "c.h5", thorough=True)
    assert (found.title, found.share, found.faults) == ("Two of them", 1.0, [])
    assert found.lines == [
        ("range", "A = 1 to 2"), ("range", "B = 0 to 1"), ("max period", "2"), ("curves", "1 border, 1 onset"),
        ("points", "7"), ("meeting points", "2"),
    ]  # fmt: skip


def test_damage_and_other_kinds_are_named(tmp_path):
    path = tmp_path / "c.h5"
    save(path, made(), ORIGIN)
    with pytest.raises(OtherKind, match="curves of bifurcations"):
        load(path, "orbits")
    with h5py.File(path, "r+") as file:
        file["A"][2] += 1e-9
    assert summary(path, thorough=True).faults == ["the SHA-256 of the contents differs from the stored SHA-256"]
    with h5py.File(path, "r+") as file:
        file["condition"][1] = "{"
    with pytest.raises(Damaged, match="too damaged to be read"):
        load(path)


@pytest.mark.parametrize("lengths", [[2, 1], [1, 3], [2, 3]])
def test_parts_must_cover_the_table(lengths):
    """A table of 4 rows is refused if its parts have too few rows, too many rows, or a wrong first row."""
    with h5py.File("parts", "w", driver="core", backing_store=False) as file:
        file["first"], file["points"], file["point"] = [0, 2], lengths, np.arange(4)
        with pytest.raises(ValueError, match="first: does not match points"):
            tables.parts(file, "first", "points", "point")
        file["points"][:] = [2, 2]
        assert list(tables.parts(file, "first", "points", "point")) == [slice(0, 2), slice(2, 4)]


def test_word_damaged_within_json_is_named(tmp_path):
    """After a flipped bit the JSON may still be valid, but have another key or a list of another length."""
    for old, new in (("critical", "britical"), ("true, 2", "true. 2"), ("0, true", "0. true"), ("0, true]", "0]")):
        save(tmp_path / "c.h5", made(), ORIGIN)
        with h5py.File(tmp_path / "c.h5", "r+") as file:
            file["condition"][1] = file["condition"].asstr()[1].replace(old, new, 1)
            changed = file["condition"].asstr()[1] != curves._written(made().curves[1].condition)
        if changed:
            with pytest.raises(Damaged, match="too damaged to be read"):
                load(tmp_path / "c.h5")


def test_error_of_the_reader_is_not_reported_as_damage(tmp_path, monkeypatch):
    save(tmp_path / "c.h5", made(), ORIGIN)
    monkeypatch.setattr(curves, "Curve", lambda *values: Curve(*values, "one too many"))
    with pytest.raises(TypeError, match="positional arguments"):
        load(tmp_path / "c.h5")
    monkeypatch.setattr(curves, "Curve", lambda *values: Curve.nothing)
    with pytest.raises(AttributeError, match="nothing"):
        load(tmp_path / "c.h5")


def test_xarray_opens_the_file(tmp_path):
    xr = pytest.importorskip("xarray")
    found = made()
    save(tmp_path / "c.h5", found, ORIGIN)
    with xr.open_dataset(tmp_path / "c.h5", engine="h5netcdf") as file:
        assert dict(file.sizes) == {"curve": 2, "point": 7, "unknown": 6, "meeting": 2}
        assert file.attrs["kind"] == "curves"
        assert file.kind.values.tolist() == ["onset", "border"]
        rows = slice(int(file.first_point[1]), int(file.first_point[1] + file.points[1]))
        np.testing.assert_array_equal(file.A.values[rows], found.curves[1].A)
        assert file.A.attrs == {"units": "1", "long_name": "excitation amplitude"}
