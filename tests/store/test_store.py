"""The file of a sweep: other programs read it, it can be resumed, other files are refused, and damage is found."""

import errno
import hashlib
import itertools
import json
import os
import pickle
import re
import signal
import weakref
from dataclasses import replace
from importlib import metadata

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
from vibrodrive.model.quantities import SUMMARIES
from vibrodrive.model.records import SUMMARY
from vibrodrive.model.size import file_bytes
from vibrodrive.model.states import State
from vibrodrive.store import header
from vibrodrive.store import writer as writer_module
from vibrodrive.store.compare import compare
from vibrodrive.store.layout import Origin, variables_of
from vibrodrive.store.load import load
from vibrodrive.store.lock import Content, Lock
from vibrodrive.store.reader import look, verify
from vibrodrive.store.writer import Writer, open_writer
from vibrodrive.version import __version__

ARRAYS = ("section", "status", "margin", "switches")
RECORDED = [("section",), ("summary",), ("impacts",), ("section", "error"), ("section", "impacts", "summary")]

TEXT = "[sweep]\nA = {start = 3, stop = 3.25, num = 90}\neps = [0, 2e-4]\n# ξ\n"


def make(**changes):
    others = {"A": np.linspace(3, 3.25, 90), "eps": [0, 2e-4], "transient": 0, "periods": 12}
    return replace(make_plan(changes | others | changes), tiling=(20, 2))  # 5 blocks, the last one with fewer points


def write(path, plan, which=None, **options):
    return fake.write(path, plan, Origin(TEXT, ("eps=[0, 2e-4]",), "A title"), which, **options)


def resumed(path):
    return write(path, make(), which=[])


def flipped(raw, offset, bit=0):
    """Return contents with a flipped bit."""
    return raw[:offset] + bytes([raw[offset] ^ 1 << bit]) + raw[offset + 1 :]


def assert_complete(path, plan):
    """Assert that every point of the file is bitwise equal to the computed point."""
    results, blocks = load(path), list(fake.run_blocks(plan))
    for name in [*["section"] * plan.sectioned, "status", "margin", "switches", *(q.name for q in plan.quantities)]:
        wanted = np.concatenate([b.records.get(name, getattr(b, name, None)) for b in blocks])
        assert results[name].astype(wanted.dtype).tobytes() == wanted.tobytes(), name


@pytest.fixture
def path(tmp_path):
    return tmp_path / "sweep.h5"


@pytest.fixture
def finished(path):
    write(path, make())
    return path


def test_written_blocks_are_released(path):
    """Blocks that are computed together are views of one array. A reference to one of them would keep the memory of
    all."""
    plan = make()
    writer = open_writer(path, plan, Origin(TEXT, (), "A title"))
    wave = np.zeros((plan.n_points, 12, 2))
    kept = weakref.ref(wave)
    b = fake.block(plan, 0)
    writer.write(b._replace(section=wave[b.start : b.stop], status=wave[b.start : b.stop, 0, 0].astype(np.int8)))
    del wave
    assert kept() is None
    writer.close()


def test_status_of_a_block_is_written_last_and_taken_back_first(path, monkeypatch):
    """Other programs know by the status that the other values of a point are there, also while a sweep runs."""
    order, put = [], Writer._put
    monkeypatch.setattr(Writer, "_put", lambda self, q, *block: order.append(q.variable) or put(self, q, *block))
    write(path, make(), [0])
    assert order == [v.variable for v in variables_of(make())]
    with h5py.File(path, "r+") as file:
        file["margin"][3] = 7.0
    writer = open_writer(path, make(), Origin(TEXT))
    writer.check()
    with h5py.File(path) as file:
        assert (file["status"][...] == Status.NOT_COMPUTED).all()
        assert file["digests/status"][0] == 0
    writer.close()


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


SHAPES = [
    {"A": np.linspace(1, 2, 7), "B": [0.1, 0.2, 0.3], "periods": 100_000},  # one point per block
    {"A": np.linspace(1, 2, 3), "eps": [0.0], "B": np.linspace(0, 1, 700), "periods": 3},
    {"A": 3.0, "periods": 7},  # no axis
    {"A": np.linspace(1, 2, 3000), "periods": 1},
]


@pytest.mark.parametrize(
    "plan", [*(make(record=r) for r in RECORDED), *(make_plan({"transient": 0} | s) for s in SHAPES)]
)
def test_results_survive_a_round_trip(path, plan):
    write(path, plan)
    assert_complete(path, plan)
    report, found = verify(path), load(path)
    assert (report.sound, report.complete, found.title, compare(found.plan, plan)) == (True, True, "A title", [])
    assert (list(found.axes), found.record) == (list(plan.axes), plan.record)
    assert path.stat().st_size == pytest.approx(file_bytes(plan), rel=0.01, abs=9_000)


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

    monkeypatch.setattr(header, "_Bytes", Failing)
    for attempt in (load, lambda path: load(path).section, lambda path: load(path).status, verify, resumed):
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
    with pytest.raises(Damaged, match=f"attribute {name}"):
        resumed(finished)


def test_unfinished_file_can_be_read(path):
    plan = make(record=("section", "impacts", "summary"))
    write(path, plan, which=[1, 4])
    with h5py.File(path, "a") as file:
        file["section_xi"][40:60] = 1.0  # data of a block without its status
    results = load(path)
    done = np.repeat([False, True, False, False, True], [20, 20, 20, 20, 10])
    assert results.computed == pytest.approx(30 / 90)
    np.testing.assert_array_equal(results.status != Status.NOT_COMPUTED, np.stack([done, done], axis=1))
    for q in plan.quantities:
        np.testing.assert_array_equal(results[q.name][~done], np.full_like(results[q.name][~done], q.fill))
    assert np.isnan(results.section[~done]).all()
    assert not np.isnan(results.section[done]).any()
    for k, there in ((0, False), (19, False), (20, True), (39, True), (40, False)):
        assert np.isnan(load(path).select(A=plan.axes["A"][k]).section).any() != there
    np.testing.assert_array_equal(load(path).select(A=plan.axes["A"][25], eps=0).section, results.section[25, 0])
    with xr.open_dataset(path, engine="h5netcdf") as data:  # other programs also see it
        assert (data.status.values[~done] == Status.NOT_COMPUTED).all()


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
    assert python(XARRAY, path).split() == ["-101", "140"]  # 40 points have the statuses 0, 1, 2, 0, …
    with pytest.raises(Busy, match="another process is writing"):
        open_writer(path, make(), Origin(TEXT))
    with pytest.raises(Busy, match="another process is writing"):
        open_writer(path, make(), Origin(TEXT), overwrite=True)
    writer.close()
    open_writer(path, make(), Origin(TEXT)).close()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"periods": 13}, "periods is 12 in the file and 13 in the configuration.* cannot be extended"),
        ({"B": 0.2}, "B is 0.1 in the file and 0.2 in the configuration"),
        (
            {"method": "fixed", "dtau": 0.1},
            "dtau is not given in the file and 0.1 .*; method is 'certified' in the file",
        ),
        (
            {"A": np.linspace(3, 3.2, 80)},
            "A is a list of 90 values from 3 to 3.25 in the file and a list of 80 values from 3 to 3.2 in",
        ),
        ({"eps": 0.0}, r"eps is \[0.0, 0.0002\] in the file and 0.0 in the configuration"),
        ({"record": "summary"}, "record is 'section' in the file and 'summary' in the configuration"),
        ({"eps": [0, 2e-4]}, r"the axes are \(A, eps\) in the file and \(eps, A\) in"),
    ],
)
def test_another_configuration_is_refused_with_the_keys_that_differ(finished, changes, words):
    before = finished.read_bytes()
    with pytest.raises(Different, match=words):
        open_writer(finished, make(**changes), Origin(TEXT))
    assert finished.read_bytes() == before


def edited(change):
    """Return a function that changes the open file."""

    def edit(path):
        with h5py.File(path, "a") as file:
            change(file)

    return edit


def attribute(name, value):
    return edited(lambda file: file.attrs.update({name: value}))


def cut(change):
    return lambda path: path.write_bytes(change(path.read_bytes()))


def newer(part, **changes):
    """Return a function that writes a file with a name in its plan that is unknown today."""

    def change(path):
        write(path, make(**changes), overwrite=True)
        with h5py.File(path, "a") as file:
            plan = file.attrs["plan"].decode().replace(part, '"tomorrow"')
            file.attrs.update({"plan": plan, "plan_sha256": hashlib.sha256(plan.encode()).hexdigest()})

    return change


def written_by_a_newer_version(path):
    with pytest.MonkeyPatch.context() as then:
        then.setattr(type(SUMMARY), "quantities", (*SUMMARIES, SUMMARIES[-1]._replace(name="tomorrow")))
        write(path, make(record="summary"), overwrite=True)


def replaced(name, change):
    """Return a function that changes the values, the type or the shape of a variable."""

    def replace_values(file):
        values = change(file[name][...])
        if (values.dtype, values.shape) == (file[name].dtype, file[name].shape):
            file[name][...] = values
        else:
            del file[name]
            file[name] = values

    return edited(replace_values)


def address(bit):
    """Return a function that changes the place at which a variable is said to be, and where a writer would write."""

    def change(path):
        with h5py.File(path) as file:
            address = file["section_dxi"].id.get_offset()
        content = path.read_bytes()
        path.write_bytes(content.replace(address.to_bytes(8, "little"), (address ^ 1 << bit).to_bytes(8, "little"), 1))

    return change


ATTEMPTS = load, look, verify, lambda path: open_writer(path, make(), Origin(TEXT))
BY = rf"vibrodrive {re.escape(__version__)}; read it with vibrodrive {re.escape(__version__)}, which wrote it$"
BROKEN = r"sweep.h5: (truncated; |not a result file|too damaged to be read \(.*\); )"

REFUSED = {
    "a text": (lambda path: path.write_text("no HDF5 at all\n" * 100), NoResult, "not a result file"),
    "of another program": (edited(lambda file: [file.attrs.clear(), file.clear()]), NoResult, "not a result file"),
    "another kind": (attribute("kind", "limits"), NoResult, f"kind = limits: must be sweep in {BY}"),
    "another schema": (attribute("schema_version", 4), NoResult, f"schema_version = 4: must be 5 in {BY}"),
    "unknown record": (newer('"summary"', record="summary"), NoResult, f"record 'tomorrow': unknown in {BY}"),
    "unknown setting": (newer('"periods"'), NoResult, f"setting 'tomorrow': unknown in {BY}"),
    "unknown axis": (newer('"eps"'), NoResult, f"axis 'tomorrow': unknown in {BY}"),
    "unknown quantity": (written_by_a_newer_version, NoResult, f"quantity 'tomorrow': unknown in {BY}"),
    "without the last byte": (cut(lambda raw: raw[:-1]), Damaged, BROKEN),
    "half": (cut(lambda raw: raw[: len(raw) // 2]), Damaged, BROKEN),
    "the beginning": (cut(lambda raw: raw[:700]), Damaged, BROKEN),
    "the signature": (cut(lambda raw: raw[:3]), NoResult, BROKEN),
    "empty": (cut(lambda raw: b""), NoResult, BROKEN),
    "damaged root": (cut(lambda raw: flipped(raw, raw.find(b"OHDR") + 20)), Damaged, BROKEN),
    "address beyond the end": (cut(lambda raw: flipped(raw, 48, 6)), Damaged, BROKEN),
    "axis A": (replaced("A", lambda values: values + 0.5), Damaged, "axis A: changed after it was written"),
    "axis eps": (replaced("eps", lambda values: values + 0.5), Damaged, "axis eps: changed after it was written"),
    "another type": (replaced("margin", np.float32), Damaged, r"\(margin: wrong shape or data type\)"),
    "another shape": (replaced("margin", lambda values: values[:-1]), Damaged, r"\(margin: wrong shape or data type\)"),
    **{f"address, bit {k}": (address(k), Damaged, "section_dxi: no variable of this file") for k in (3, 4, 10, 63)},
}  # fmt: skip
"""By what a file is: how it is made of a sound one, the exception, and its words."""


@pytest.mark.parametrize("what", REFUSED)
def test_file_is_refused_by_all_readers_and_writers_and_unchanged(finished, what):
    change, kind, words = REFUSED[what]
    change(finished)
    before = finished.read_bytes()
    for attempt in ATTEMPTS:
        with pytest.raises(NoResult, match=words) as refused:
            attempt(finished)
        assert type(refused.value) is kind
    assert finished.read_bytes() == before


def test_overwrite_replaces_after_the_new_file_exists(finished, monkeypatch):
    before = finished.read_bytes()

    def fail(lock):
        assert finished.read_bytes() == before  # the old file exists while the new one is laid out
        raise KeyError

    with monkeypatch.context() as then:
        then.setattr(Lock, "reserve", fail)
        with pytest.raises(KeyError):
            open_writer(finished, make(periods=13), Origin(TEXT), overwrite=True)
    assert finished.read_bytes() == before
    assert [p.name for p in finished.parent.iterdir()] == [finished.name]
    open_writer(finished, make(periods=13), Origin(TEXT), overwrite=True).close()
    assert load(finished).settings.periods == 13
    assert load(finished).computed == 0.0


FAILING = {
    "write of a block": (os, "pwrite", "later"),
    "reservation": (os, "posix_fallocate", ""),
    "write of the header": (os, "pwrite", ""),
    "flush": (os, "fsync", "later"),
}


def test_texts_with_backslashes_are_read_as_they_were_written(path):
    title = r"\u007e \b"
    open_writer(path, make(), Origin("", (f"title={title}",), title)).close()
    assert look(path).header.origin == Origin("", (f"title={title}",), title)


def test_fault_of_the_reader_is_no_damage_of_the_file(finished, monkeypatch):
    monkeypatch.setattr("vibrodrive.store.reader.read_marks", lambda *arguments: len(3))
    with pytest.raises(TypeError, match="has no len"):
        _ = load(finished).status


@pytest.mark.parametrize(("method", "call"), [("truncate", 1), ("write", 10), ("seek", 10)])
def test_ctrl_c_while_hdf5_lays_a_file_out_is_not_lost(method, call, tmp_path, monkeypatch):
    act, calls = getattr(Content, method), itertools.count(1)

    def interrupted(*arguments):
        if next(calls) == call:
            signal.raise_signal(signal.SIGINT)
        return act(*arguments)

    monkeypatch.setattr(Content, method, interrupted)
    with pytest.raises(KeyboardInterrupt):
        open_writer(tmp_path / "x.h5", make_plan({"A": [3.0, 3.1]}), Origin(""))
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize("what", FAILING)
@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EIO])
def test_refused_write_is_an_error_of_the_system_and_leaves_no_new_file(path, monkeypatch, what, code):
    """What is written stays, and is resumed."""
    where, name, when = FAILING[what]
    if not hasattr(where, name):
        pytest.skip("macOS reserves nothing")

    def refuse(*arguments):
        raise OSError(code, os.strerror(code))

    def attempt(then):
        if not when:
            then.setattr(where, name, refuse)
        writer = open_writer(path, make(), Origin(TEXT))
        then.setattr(where, name, refuse)
        try:
            writer.write(fake.block(writer.plan, 0))
            writer.close()
        finally:
            writer.close(sync=False)

    with monkeypatch.context() as then, pytest.raises(OSError, match=f"sweep.h5: {os.strerror(code)}") as caught:
        attempt(then)
    assert caught.value.errno == code
    assert list(path.parent.iterdir()) == ([path] if when else [])
    write(path, make())
    assert_complete(path, make())


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


def swap(*names):
    """Return a function that exchanges the first two blocks of variables."""

    def change(file):
        for name in names:
            file[name][:20], file[name][20:40] = file[name][20:40], file[name][:20]

    return change


def lose(file):
    """Leave a block whose status is on the disk, and all else is zeros, as after a loss of power."""
    for variable in variables_of(make())[:-1]:
        file[variable.variable][40:60] = file[f"digests/{variable.variable}"][2] = 0


def lose_a_digest(file):
    """Leave the values of a block without their digest."""
    file["digests/energy"][1] = 0


def exchange(file):
    file["energy"][:20], file["momentum"][:20] = file["momentum"][:20], file["energy"][:20]


@pytest.mark.parametrize(
    ("record", "change", "blocks"),
    [
        ("section", lose, [2]),
        ("summary", lose_a_digest, [1]),
        ("section", lambda file: file["status"].write_direct(np.array(-1, "i1"), None, np.s_[59, 1]), [2]),
        ("section", lambda file: file["digests/status"].write_direct(file["digests/margin"][...]), [*range(5)]),
        ("section", swap("section_xi"), [0, 1]),
        ("section", swap(*(v.variable for v in variables_of(make()))), [0, 1]),
        ("summary", exchange, [0]),
    ],
)
def test_right_bytes_in_a_wrong_place_are_damage(path, record, change, blocks):
    write(path, make(record=record))
    with h5py.File(path, "a") as file:
        change(file)
    report = verify(path)
    assert (list(report.faults), np.flatnonzero(~report.done).tolist()) == (blocks, blocks)
    assert write(path, make(record=record)) == blocks
    assert verify(path).complete


@pytest.mark.integration
def test_any_flipped_bit_is_detected_or_harmless(finished):
    """After any flipped bit the file is read as before, or there is an error or a warning. No wrong number is read."""
    whole = load(finished)
    expected = {name: getattr(whole, name).tobytes() for name in ARRAYS}
    raw = finished.read_bytes()
    random = np.random.default_rng(20)
    for offset in random.integers(0, len(raw), 100):
        finished.write_bytes(flipped(raw, offset, int(random.integers(8))))
        try:
            sound = verify(finished).sound
        except NoResult:
            continue
        if sound:
            results = load(finished)
            same = {name: getattr(results, name).tobytes() for name in ARRAYS} == expected
            assert (same and results.settings == whole.settings) or results.computed < 1


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
