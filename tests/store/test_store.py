"""The file of a sweep: other programs read it, it can be resumed, other files are refused, and damage is found."""

import gzip
import hashlib
import json
import os
import pickle
import time
import weakref
from dataclasses import replace
from importlib import metadata
from pathlib import Path

import h5py
import numba
import numpy as np
import pytest
import xarray as xr

from tests.support import fake
from tests.support.process import python
from vibrodrive.errors import Busy, Damaged, Different, NoResult, TooLarge
from vibrodrive.model import size
from vibrodrive.model.choices import Status
from vibrodrive.model.plan import make_plan
from vibrodrive.model.quantities import MAIN_IMPACTS, SUMMARIES
from vibrodrive.model.records import SUMMARY
from vibrodrive.model.size import file_bytes
from vibrodrive.model.states import State
from vibrodrive.store import header
from vibrodrive.store import writer as writer_module
from vibrodrive.store.layout import Origin, tiles, variables_of
from vibrodrive.store.load import load
from vibrodrive.store.reader import DamagedBlock, look, verify
from vibrodrive.store.writer import Writer, open_writer

ARRAYS = ("section", "status", "margin", "switches")
RECORDED = [("section",), ("summary",), ("impacts",), ("section", "error"), ("section", "impacts", "summary")]

TEXT = "[sweep]\nA = {start = 3, stop = 3.25, num = 90}\neps = [0, 2e-4]\n# ξ\n"


def make(**changes):
    arguments = {"A": np.linspace(3, 3.25, 90), "eps": [0, 2e-4], "transient": 0, "periods": 12}
    return replace(make_plan(arguments | changes), tiling=(20, 2))  # 5 blocks, the last one with fewer points


def write(path, plan, which=None, **options):
    fake.write(path, plan, Origin(TEXT, ("eps=[0, 2e-4]",), "A title"), which, **options)


def assert_complete(path, plan):
    """Assert that every point of the file is bitwise equal to the computed point."""
    results = load(path)
    arrays = {name: results[name].reshape(plan.n_points, -1) for name in recorded(plan)}
    for k, (start, stop) in enumerate(plan.blocks()):
        expected = fake.block(plan, k)
        for name, values in arrays.items():
            wanted = expected.records.get(name, getattr(expected, name, None))
            assert values[start:stop].astype(wanted.dtype).tobytes() == wanted.tobytes(), name


def recorded(plan):
    """Return the names of all arrays of a plan."""
    section = ["section"] if "section" in plan.record else []
    return [*section, "status", "margin", "switches", *(q.name for q in plan.quantities)]


def test_written_blocks_are_released_before_the_commit(path):
    """Blocks that are computed together are views of one array. A reference to one of them would keep the memory of
    all."""
    plan = make()
    writer = open_writer(path, plan, Origin(TEXT, (), "A title"))
    wave = np.zeros((plan.n_points, 12, 2))
    kept = weakref.ref(wave)
    b = fake.block(plan, 0)
    writer.write(b._replace(section=wave[b.start : b.stop], status=wave[b.start : b.stop, 0, 0].astype(np.int8)))
    del wave
    assert not writer.done[0]
    assert kept() is None
    writer.close()


def test_status_is_written_after_the_data_between_two_flushes(path, monkeypatch):
    """With this order, even after a loss of power, no block counts as computed before its data are written."""
    order, put, flush = [], Writer._put, h5py.File.flush
    monkeypatch.setattr(Writer, "_put", lambda self, k, name, values: order.append(name) or put(self, k, name, values))
    monkeypatch.setattr(h5py.File, "flush", lambda self: order.append("flush") or flush(self))
    plan = make()
    writer = open_writer(path, plan, Origin(TEXT))
    order.clear()
    writer.write(fake.block(plan, 0))
    writer.close()
    names = [v.variable for v in variables_of(plan)]
    assert order[: len(names) + 2] == [*names[:-1], "flush", "status", "flush"]


@pytest.mark.parametrize("sync", [True, False])
def test_closed_file_is_synced(path, monkeypatch, sync):
    """fsync is called once, after all blocks. After a signal fsync is not called, because it would take too long."""
    asked = []
    monkeypatch.setattr(
        os, "fsync", lambda fd: asked.append((os.path.samestat(os.fstat(fd), os.stat(path)), look(path)))
    )
    writer = open_writer(path, make(), Origin(TEXT))
    for b in fake.run_blocks(writer.plan, writer.missing()):
        writer.write(b)
    assert not asked
    writer.close(sync=sync)
    assert [(same, report.complete) for same, report in asked] == [(True, True)] * sync


def test_status_of_a_damaged_block_is_cleared_before_its_data(finished, monkeypatch):
    """With this order no reader finds a blank block that counts as computed, even if the process is killed."""
    with h5py.File(finished) as file:
        chunk = file["margin"].id.get_chunk_info(1)
    damaged(finished, chunk.byte_offset + chunk.size // 2)
    order, put, flush = [], writer_module.put_chunk, h5py.File.flush
    monkeypatch.setattr(writer_module, "put_chunk", lambda data, *more: order.append(data.name[1:]) or put(data, *more))
    monkeypatch.setattr(h5py.File, "flush", lambda self: order.append("flush") or flush(self))
    writer = open_writer(finished, make(), Origin(TEXT))
    writer.check()
    assert order[:2] == ["status", "flush"]
    assert {*order} == {"flush", *(v.variable for v in variables_of(make()))}
    writer.close()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "sweep.h5"


@pytest.fixture
def finished(path):
    write(path, make())
    return path


@pytest.mark.parametrize("record", RECORDED, ids="+".join)
def test_results_survive_a_round_trip(path, record):
    """Also from a file with a part of its blocks, whose others have fill values."""
    plan = make(record=record)
    write(path, plan, which=[0, 3])
    half = load(path)
    assert (half.record, half.computed) == (plan.record, 40 / 90)
    for q in plan.quantities:
        np.testing.assert_array_equal(half[q.name][20:60], np.full_like(half[q.name][20:60], q.fill))
    write(path, plan)
    assert_complete(path, plan)
    assert verify(path).sound
    found = load(path)
    assert found.axes["A"].tolist() == plan.axes["A"].tolist()
    assert (found.settings, found.title, found.scalars["B"]) == (plan.settings, "A title", 0.1)
    assert np.isnan(found.scalars["dtau"])
    assert path.stat().st_size == pytest.approx(file_bytes(plan), abs=70_000), "HDF5's own tables grow by doubling"


def test_repr_follows_a_file_that_grows_or_is_deleted(path, tmp_path):
    plan = make()
    write(path, plan, which=[0])
    results = load(path)
    assert "22.2 % computed" in repr(results)
    write(path, plan)
    assert ", computed: " in repr(results)
    assert results.computed == 1.0, "the repr does not cache the share"
    gone = load(path)
    path.unlink()
    assert "not readable: A 3…3.25 (90)" in repr(gone)
    assert "not readable" in gone._repr_html_()


def test_pickled_results_read_their_file(finished, monkeypatch, tmp_path):
    monkeypatch.chdir(finished.parent)
    whole, part = load(finished.name), load(finished.name).select(A=3.1, method="nearest")
    assert whole.margin.size
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    for results in (whole, part):
        again = pickle.loads(pickle.dumps(results))
        for name in ARRAYS:
            np.testing.assert_array_equal(getattr(again, name), getattr(results, name))
    assert len(pickle.dumps(load(finished))) < finished.stat().st_size / 4


OTHERS = {"values": {"A": [1.5, 1.6]}, "axes": {"B": [0.1, 0.2]}, "record": {"record": "summary"}}


@pytest.mark.parametrize("other", OTHERS)
def test_replaced_file_is_not_read_with_the_axes_of_the_former(finished, tmp_path, other):
    """Neither through results, a part of them or a pickle, nor in a figure or a Dataset."""
    whole = load(finished)
    objects = whole, whole.select(eps=0), pickle.loads(pickle.dumps(whole))
    fake.write(tmp_path / "other.h5", make_plan({"A": [3.0, 3.1], "transient": 0, "periods": 12} | OTHERS[other]))
    os.replace(tmp_path / "other.h5", finished)
    for results in objects:
        reads = [lambda r, name=name: getattr(r, name) for name in ARRAYS]
        for read in (*reads, lambda r: r.to_xarray(), lambda r: r.plot()):
            with pytest.raises(Different, match=r"sweep.h5: was replaced since by the file of another sweep; load it"):
                read(results)
        assert "not readable" in repr(results)
    write(finished, make(), overwrite=True, which=[2])  # the same sweep, begun again
    assert whole.computed == objects[-1].computed == 20 / 90
    write(finished, make())
    assert load(finished).section.tobytes() == whole.section.tobytes()


def test_error_of_the_system_is_no_damage(finished, monkeypatch):
    """The system may fail at any read. Damage would be blanked before it is computed again."""
    before = finished.read_bytes()
    directory = os.open("/", os.O_RDONLY)

    class Failing(header._Bytes):
        left = 0

        def readinto(self, buffer):
            self.left -= 1
            if not self.left:
                os.dup2(directory, self.fileno())  # a directory cannot be read
            return super().readinto(buffer)

    def resume(path):
        writer = open_writer(path, make(), Origin(TEXT))
        try:
            writer.check()
        finally:
            writer.abandon()

    monkeypatch.setattr(header, "_Bytes", Failing)
    for attempt in (load, lambda path: load(path).section, lambda path: load(path).status, verify, resume):
        for Failing.left in (1, 2, 3, 5, 9, 17, 33):
            with pytest.raises(OSError, match=f"Is a directory: '{finished}'"):
                attempt(finished)
    os.close(directory)
    assert finished.read_bytes() == before


def test_attributes_give_the_origin(finished):
    with h5py.File(finished) as file:
        assert file.attrs["Conventions"].decode() == "CF-1.10"
        assert file.attrs["title"].decode() == "A title"
        assert file.attrs["config"].decode() == TEXT
        assert file.attrs["config_sha256"].decode() == hashlib.sha256(TEXT.encode()).hexdigest()
        assert json.loads(file.attrs["overrides"]) == ["eps=[0, 2e-4]"]
        assert "created" not in file.attrs  # a date would make files of equal runs different
        assert "numba" in json.loads(file.attrs["versions"])
        assert file["state"].attrs["flag_meanings"].decode().split() == [s.name.lower() for s in State]


def test_frozen_program_without_metadata_names_its_versions(path, monkeypatch):
    def lacking(package):
        raise metadata.PackageNotFoundError(package)

    monkeypatch.setattr(metadata, "version", lacking)
    write(path, make())
    with h5py.File(path) as file:
        found = json.loads(file.attrs["versions"])
    assert (found["numpy"], found["numba"], found["h5py"]) == (np.__version__, numba.__version__, h5py.__version__)


def test_shared_parameters_are_attributes(finished):
    """Other programs read B, eta, periods, … as attributes. They do not need the plan of the sweep."""
    plan = make()
    with xr.open_dataset(finished, engine="h5netcdf") as data:
        for name in ("B", "eta", "xi0", "dxi0", "tau0", "section_phase", "tol"):
            assert data.attrs[name] == plan.scalars[name]
        for name in ("transient", "periods", "budget"):
            assert data.attrs[name] == getattr(plan.settings, name)
        assert (data.attrs["method"], data.attrs["record"]) == ("certified", "section")
        assert not {"A", "eps", "dtau"} & set(data.attrs)  # axes and parameters without effect are no attributes
        told = data.attrs["comment"]
        assert [name for name in plan.scalars if name not in ("eps", "dtau") and f"{name}: " not in told] == []
        assert "too_close: " in data.status.comment


@pytest.mark.parametrize(("name", "value"), [("B", 0.2), ("periods", 13), ("method", "muller")])
def test_changed_attribute_is_found(finished, name, value):
    with h5py.File(finished, "a") as file:
        file.attrs[name] = value
    assert verify(finished).general == [f"attribute {name}: changed after it was written"]
    assert load(finished).scalars["B"] == 0.1
    writer = open_writer(finished, make(), Origin(TEXT))
    with pytest.raises(Damaged, match=f"attribute {name}"):
        writer.check()
    writer.abandon()


@pytest.mark.parametrize("name", ["A", "eps"])
def test_changed_axis_is_found(finished, name):
    with h5py.File(finished, "a") as file:
        file[name][0] += 0.5
    for reads in (load, verify, lambda path: open_writer(path, make(), Origin(TEXT))):
        with pytest.raises(Damaged, match=f"axis {name}: changed after it was written"):
            reads(finished)


@pytest.mark.parametrize("record", RECORDED, ids="+".join)
@pytest.mark.parametrize("group_seconds", [0.0, np.inf], ids=["every block committed", "no block committed"])
def test_file_of_a_killed_run_ends_as_that_of_an_undisturbed_one(path, tmp_path, monkeypatch, record, group_seconds):
    """In every byte. A process that is killed leaves what the system has of its file."""
    plan = make(record=record)
    monkeypatch.setattr(writer_module, "GROUP_SECONDS", group_seconds)
    writer = open_writer(path, plan, Origin(TEXT))
    left = [path.read_bytes()]
    for block in fake.run_blocks(plan):
        writer.write(block)
        left.append(path.read_bytes())
    writer.close()
    killed = tmp_path / "killed.h5"
    for content in left:
        killed.write_bytes(content)
        resumed = open_writer(killed, plan, Origin(TEXT))
        resumed.check()
        for block in fake.run_blocks(plan, resumed.missing()):
            resumed.write(block)
        resumed.close()
        assert killed.read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    "arguments",
    [
        {"A": np.linspace(1, 2, 7), "B": [0.1, 0.2, 0.3], "periods": 100_000},  # one point per block
        {"A": np.linspace(1, 2, 3), "eps": [0.0], "B": np.linspace(0, 1, 700), "periods": 3},
        {"A": 3.0, "periods": 7},  # no axis
        {"A": np.linspace(1, 2, 3000), "periods": 1},
    ],
)
def test_blocks_of_every_shape(path, arguments):
    plan = make_plan({"transient": 0} | arguments)
    write(path, plan)
    assert_complete(path, plan)
    report = verify(path)
    assert report.sound
    assert report.complete
    assert path.stat().st_size == pytest.approx(file_bytes(plan), rel=0.01, abs=20_000)


def test_unfinished_file_can_be_read(path):
    plan = make()
    write(path, plan, which=[1, 4])
    results = load(path)
    done = np.repeat([False, True, False, False, True], [20, 20, 20, 20, 10])
    assert results.computed == pytest.approx(30 / 90)
    np.testing.assert_array_equal(results.status != Status.NOT_COMPUTED, np.stack([done, done], axis=1))
    assert np.isnan(results.section[~done]).all()
    assert not np.isnan(results.section[done]).any()
    assert np.isnan(load(path).select(A=3.0).section).all()
    np.testing.assert_array_equal(load(path).select(A=plan.axes["A"][25], eps=0).section, results.section[25, 0])
    with xr.open_dataset(path, engine="h5netcdf") as data:  # other programs also see it
        assert np.isnan(data.section_xi.values[~done]).all()


def test_blocks_without_a_status_are_not_read(path):
    """From an unfinished file all blocks with a status are read, and no other block."""
    plan = make()
    write(path, plan, which=[1])
    with h5py.File(path, "a") as file:
        for name in ("section_xi", "section_dxi"):  # data of the next block, without its status
            file[name][40:60] = 1.0
    results = load(path)
    assert np.isnan(results.section[40:60]).all()
    for k, done in ((19, False), (20, True), (39, True), (40, False)):
        assert np.isnan(load(path).select(A=plan.axes["A"][k]).section).any() != done


XARRAY = """
import sys, xarray
with xarray.open_dataset(sys.argv[1], engine="h5netcdf") as data:
    print(data.status.values.sum(), (data.status.values == -1).sum())
"""


@pytest.mark.integration
def test_reader_needs_no_permission_of_the_writer(path):
    writer = open_writer(path, make(), Origin(TEXT))
    writer.write(fake.block(writer.plan, 0))
    assert load(path).section.shape == (90, 2, 12, 2)
    assert python(XARRAY, path).split() == ["-180", "180"]
    with pytest.raises(Busy, match="another process is writing"):
        open_writer(path, make(), Origin(TEXT))
    with pytest.raises(Busy, match="another process is writing"):
        open_writer(path, make(), Origin(TEXT), overwrite=True)
    writer.close()
    open_writer(path, make(), Origin(TEXT)).close()


def test_file_keeps_its_block_size(path):
    """A version of the program that uses blocks of another size resumes a file with the blocks of this file."""
    write(path, make(), which=[0])
    plan = replace(make(), tiling=None)
    assert plan.chunk == (90, 2)
    writer = open_writer(path, plan, Origin(TEXT))
    assert writer.plan.chunk == (20, 2)
    writer.close()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"periods": 13}, ["periods is 12 in the file and 13 in the configuration", "cannot be extended"]),
        ({"B": 0.2}, ["B is 0.1 in the file and 0.2 in the configuration"]),
        (
            {"method": "fixed", "dtau": 0.1},
            ["method is 'certified' in the file and 'fixed' in the configuration", "dtau is not given in the file"],
        ),
        (
            {"A": np.linspace(3, 3.2, 80)},
            ["A is a list of 90 values from 3 to 3.25 in the file and a list of 80 values from 3 to 3.2 in"],
        ),
        ({"eps": 0.0}, ["eps is [0.0, 0.0002] in the file and 0.0 in the configuration"]),
        ({"record": "summary"}, ["record is 'section' in the file and 'summary' in the configuration"]),
    ],
)
def test_another_configuration_is_refused_with_the_keys_that_differ(finished, changes, words):
    before = finished.read_bytes()
    with pytest.raises(Different) as caught:
        open_writer(finished, make(**changes), Origin(TEXT))
    assert [w for w in words if w not in str(caught.value)] == []
    assert finished.read_bytes() == before


def test_axes_in_another_order_are_another_configuration(finished):
    swapped = make_plan({"eps": [0, 2e-4], "A": np.linspace(3, 3.25, 90), "transient": 0, "periods": 12})
    with pytest.raises(Different, match=r"the axes are \(A, eps\) in the file and \(eps, A\) in"):
        open_writer(finished, swapped, Origin(TEXT))


def test_foreign_files_are_refused_and_unchanged(path):
    path.write_text("no HDF5 at all\n" * 100)
    with h5py.File(path.with_name("other.h5"), "w") as file:
        file["x"] = 1.0
    for p in (path, path.with_name("other.h5")):
        before = p.read_bytes()
        for attempt in (load, look, verify, lambda p: open_writer(p, make(), Origin(TEXT))):
            with pytest.raises(NoResult, match="not a result file"):
                attempt(p)
        assert p.read_bytes() == before


def test_another_schema_version_is_refused(finished):
    with h5py.File(finished, "a") as file:
        file.attrs["schema_version"] = 99
    with pytest.raises(
        NoResult, match=r"schema_version = 99: must be 3 or 4 in .*; read it with vibrodrive [\d.]+, which"
    ):
        load(finished)
    with pytest.raises(NoResult, match="schema_version = 99"):
        open_writer(finished, make(), Origin(TEXT))


def test_truncated_file_is_refused(finished):
    raw = finished.read_bytes()
    for length in (len(raw) - 1, len(raw) // 2, 700, 3, 0):
        finished.write_bytes(raw[:length])
        with pytest.raises(NoResult, match=r"truncated|not a result file|damaged"):
            load(finished)
        with pytest.raises(NoResult):
            open_writer(finished, make(), Origin(TEXT))


def test_file_that_is_growing_is_read_when_it_is_complete(finished, monkeypatch):
    raw = finished.read_bytes()
    finished.write_bytes(raw[:-1])  # HDF5 writes the length into the header before it extends the file
    monkeypatch.setattr(time, "sleep", lambda seconds: finished.write_bytes(raw))
    assert look(finished).complete


def test_damaged_root_is_refused(finished):
    damaged(finished, finished.read_bytes().find(b"OHDR") + 20)
    for attempt in (load, look, verify, lambda path: open_writer(path, make(), Origin(TEXT))):
        with pytest.raises(Damaged, match=r"sweep.h5: too damaged to be read \(.*\); restore or delete it"):
            attempt(finished)


def test_address_that_is_too_large_is_damage(finished):
    raw = bytearray(finished.read_bytes())
    assert raw[48:56] == b"\xff" * 8, "the superblock has no address of a driver"
    raw[48] = 0xBF
    finished.write_bytes(raw)
    for attempt in (load, look, verify):
        with pytest.raises(Damaged, match=r"too damaged to be read \(.*\); restore or delete it"):
            attempt(finished)


def test_overwrite_replaces_after_the_new_file_exists(finished, monkeypatch):
    before = finished.read_bytes()

    def fail(done, total):
        assert finished.read_bytes() == before  # the old file exists while the new one is laid out
        if done > 10:
            raise KeyError

    with pytest.raises(KeyError):
        open_writer(finished, make(periods=13), Origin(TEXT), overwrite=True, progress=fail)
    assert finished.read_bytes() == before
    assert [p.name for p in finished.parent.iterdir()] == [finished.name]
    open_writer(finished, make(periods=13), Origin(TEXT), overwrite=True).close()
    assert load(finished).settings.periods == 13
    assert load(finished).computed == 0.0


def test_file_created_by_another_process_is_not_replaced(path, monkeypatch):
    """The file may have been created by another process, so it is replaced only with `overwrite`."""
    monkeypatch.setattr(writer_module, "refuse_large_file", lambda plan, place: place.write_text("another"))
    with pytest.raises(Busy, match="another process is writing this file"):
        open_writer(path, make(), Origin(TEXT))
    assert path.read_text() == "another"
    assert list(path.parent.iterdir()) == [path]


def test_array_larger_than_the_memory_is_not_read(finished, monkeypatch):
    """Reading a section of 180 points with 12 periods takes 2 · 2 · 8 · 180 · 12 bytes, because it is copied once."""
    monkeypatch.setattr(size, "LARGE", 0)
    monkeypatch.setattr(size, "available_memory", lambda: 69_119)
    results = load(finished)
    with pytest.raises(TooLarge, match=r"section: must .* takes 69\.1 kB, and 69\.1 kB are available \(`select`"):
        results.section  # noqa: B018
    assert results.select(A=results.axes["A"][0]).section.size
    monkeypatch.setattr(size, "available_memory", lambda: 69_120)
    assert results.section.nbytes == 69_120 / 2


def damaged(path, offset, bit=0):
    raw = bytearray(path.read_bytes())
    raw[offset] ^= 1 << bit
    path.write_bytes(raw)


def test_lost_data_with_a_status_are_found(finished):
    """After a loss of power a block may have a status but blank data. HDF5's checksums of blank data are right."""
    plan = make()
    with h5py.File(finished, "a") as file:
        slab = tiles(plan)[2].slab
        for variable in variables_of(plan)[:-1]:
            file[variable.variable][slab] = variable.fill
    assert list(verify(finished).faults) == [2]


@pytest.mark.parametrize("first", [41, 59])
def test_partly_computed_block_is_found(finished, first):
    """The status is written block by block, so a block is damaged if only a part of its points have a status."""
    with h5py.File(finished, "a") as file:
        file["status"][first:60] = Status.NOT_COMPUTED
    for report in (verify(finished), look(finished)):
        assert list(report.faults) == [2]
        assert not report.complete
    writer = open_writer(finished, make(), Origin(TEXT))
    writer.check()
    assert writer.missing() == [2]
    writer.close()


@pytest.mark.parametrize("names", [["section_xi"], [v.variable for v in variables_of(make())]], ids=["one", "all"])
def test_swapped_chunks_are_found(finished, names):
    with h5py.File(finished, "a") as file:
        for name in names:
            first, second = file[name][:20], file[name][20:40]
            file[name][:20], file[name][20:40] = second, first
    assert list(verify(finished).faults) == [0, 1]


@pytest.mark.integration
def test_any_flipped_bit_is_detected_or_harmless(finished):
    """After any flipped bit the file is read as before, or there is an error or a warning. No wrong number is read."""
    whole = load(finished)
    expected = {name: getattr(whole, name).tobytes() for name in ARRAYS}
    raw = finished.read_bytes()
    random = np.random.default_rng(20)
    for offset in random.integers(0, len(raw), 100):
        finished.write_bytes(raw)
        damaged(finished, offset, int(random.integers(8)))
        try:
            sound = verify(finished).sound
        except NoResult:
            continue
        if sound:
            results = load(finished)
            same = {name: getattr(results, name).tobytes() for name in ARRAYS} == expected
            assert (same and results.settings == whole.settings) or results.computed < 1


def test_swapped_quantities_are_found(path):
    write(path, make(record="summary"))
    with h5py.File(path, "a") as file:
        energy, momentum = file["energy"][:20], file["momentum"][:20]
        file["energy"][:20], file["momentum"][:20] = momentum, energy
    assert list(verify(path).faults) == [0]


def test_counts_of_switches_have_the_width_of_the_budget(path):
    """Without sections a number of switches takes 4 bytes, or 8 bytes if it may reach 2³¹."""
    plan = make_plan({"A": [3.0], "transient": 0, "periods": 12, "budget": 2**30, "record": "summary"})
    block = fake.block(plan, 0)
    writer = open_writer(path, plan, Origin(TEXT))
    writer.write(block._replace(switches=block.switches + 2**31 + 5))
    writer.close()
    assert load(path).switches.tolist() == [[2**31 + 5] * 5]
    assert verify(path).sound
    assert {v.variable: v.dtype for v in variables_of(make(record="summary"))}["switches"] == "<i4"


def test_file_of_an_older_version_has_what_it_has(path, monkeypatch):
    """A quantity that is new, or has another type today, damages no file, and the file is resumed without it."""
    older = [q._replace(dtype="<f4") if q.name == "momentum" else q for q in SUMMARIES if q.name != "energy"]
    with monkeypatch.context() as then:
        then.setattr(type(SUMMARY), "quantities", older)
        write(path, make(record="summary"), which=[0, 3])
    with h5py.File(path, "a") as file:
        del file.attrs["budget"]  # an attribute may be new, too
    write(path, make(record="summary"))
    report = verify(path)
    assert (report.complete, report.sound) == (True, True)
    found = load(path)
    assert found.momentum.dtype == np.float32
    assert found.impacts.tobytes() == b"".join(
        b.records["impacts"].tobytes() for b in fake.run_blocks(make(record="summary"))
    )
    with pytest.raises(AttributeError, match=r"energy: was not recorded by the version .* that wrote this file"):
        _ = found.select(A=3.0).energy
    assert "energy" not in {*found.to_xarray(), *dir(found)}


def test_file_of_schema_3_is_read_and_resumed(path, monkeypatch):
    """A file that was written by a version of before 0.1.0, with the blocks 0 and 2 of three blocks."""
    monkeypatch.setattr(fake, "quantities", lambda record: (*SUMMARIES, *MAIN_IMPACTS))  # numbered as at that time
    path.write_bytes(gzip.decompress((Path(__file__).parent / "schema3.h5.gz").read_bytes()))
    results, report = load(path), verify(path)
    plan = replace(report.header.plan, tiling=None)
    assert (report.sound, report.done.tolist(), results.title) == (True, [True, False, True], "Würfel ξ")
    writer = open_writer(path, plan, report.header.origin)
    writer.check()
    assert writer.missing() == [1]
    writer.write(fake.block(writer.plan, 1))
    writer.close()
    assert verify(path).complete
    assert_complete(path, report.header.plan)
    with h5py.File(path, "r+") as file:
        assert file.attrs["schema_version"] == 3
        file["checksum"][2:4] = 0
        file["status"][2:4] = 0  # a hole of zeros
    with pytest.warns(DamagedBlock, match="left out of status: block 1"):
        assert load(path).computed == 3 / 5


@pytest.mark.parametrize("attempt", [load, look, verify, lambda path: write(path, make(record="summary"))])
def test_file_of_a_newer_version_is_no_damage(path, monkeypatch, attempt):
    with monkeypatch.context() as then:
        then.setattr(type(SUMMARY), "quantities", (*SUMMARIES, SUMMARIES[-1]._replace(name="tomorrow")))
        write(path, make(record="summary"))
    before = path.read_bytes()
    with pytest.raises(
        NoResult, match=r"quantity 'tomorrow': unknown in .*; read it with vibrodrive [\d.]+, which wrote it$"
    ):
        attempt(path)
    assert path.read_bytes() == before
