"""Zeros that a power failure, a sparse copy or a hole leaves in a file never pass as results.

HDF5's checksum of zeros is 0, so a chunk whose bytes are all zero is right for HDF5; and the status OK is 0. Zeros in
the index of chunks lose chunks, whose values HDF5 replaces by the fill value.
"""

import struct
import warnings
from dataclasses import replace

import h5py
import numpy as np
import pytest

from tests.support import fake
from vibrodrive.errors import Damaged, NoResult
from vibrodrive.model.choices import Status
from vibrodrive.model.plan import make_plan
from vibrodrive.store.layout import Origin, variables_of
from vibrodrive.store.load import load
from vibrodrive.store.reader import DamagedBlock, look, verify
from vibrodrive.store.writer import open_writer

RECORDED = {"section": ("section",), "several": ("impacts", "error"), "summary": ("summary",), "limit": ("limit",)}
BLOCKS = 3


def made(name, periods=12):
    axes = {"A": [3.0, 3.1, 3.2, 3.3, 3.4], "eps": [0.0, 2e-4]} if name != "limit" else {"A": np.linspace(3, 3.1, 10)}
    plan = make_plan({**axes, "transient": 0, "periods": periods, "record": RECORDED[name]})
    return replace(plan, tiling=(2, 2) if name != "limit" else (4,))


def block(plan, k):
    """Return a block as motions have it: with points that are all OK or not, few impacts, and numbers that are zero."""
    b = fake.block(plan, k)
    records = dict(b.records)
    for q in plan.quantities:
        if q.along:
            records[q.name] = np.where(np.arange(records[q.name].shape[1]) < 4, records[q.name], q.fill).astype(q.dtype)
    if k == 1:
        records |= {name: np.zeros_like(records[name]) for name in ("period", "energy", "how") if name in records}
    return b._replace(status=b.status if k else np.zeros_like(b.status), records=records)


def write(path, plan, which):
    writer = open_writer(path, plan, Origin(""))
    for k in which:
        writer.write(block(writer.plan, k))
    writer.close()


def truth(plan, name):
    """Return the values of all points, without the file."""
    parts = [block(plan, k) for k in range(len(plan.blocks()))]
    return np.concatenate([b.records[name] if name in b.records else getattr(b, name) for b in parts])


def arrays(plan):
    section = ["section"] if "section" in plan.record else []
    return [*section, "margin", "switches", *(q.name for q in plan.quantities)]


def with_hole(path, content, start, stop):
    holed = bytearray(content)
    holed[start:stop] = bytes(stop - start)
    path.write_bytes(holed)


def assert_no_wrong_number(path, plan, names):
    """Assert that each point of the arrays is right or, by its status, not computed; and the status, if read alone."""
    results, alone = load(path), np.asarray(load(path).status).reshape(-1)
    found = {name: results[name].reshape(plan.n_points, *results[name].shape[len(plan.axes) :]) for name in names}
    status = np.asarray(results.status).reshape(-1)
    for name, values in found.items():
        right = [v.tobytes() == t.astype(v.dtype).tobytes() for v, t in zip(values, truth(plan, name), strict=True)]
        fill = (np.isnan(values) if values.dtype.kind == "f" else values == -1).reshape(plan.n_points, -1).all(axis=1)
        assert (right | fill & (status == Status.NOT_COMPUTED)).all(), name
    for one in (status, alone):
        there = one != Status.NOT_COMPUTED
        assert (one[there] == truth(plan, "status")[there]).all()


def repaired(path, plan):
    """Compute what is missing in the file, assert that it is then complete, and return the numbers of these blocks."""
    writer = open_writer(path, plan, Origin(""))
    try:
        writer.check()
    except Damaged:
        writer.abandon()
        raise
    missing = writer.missing()
    for k in missing:
        writer.write(block(plan, k))
    writer.close()
    assert verify(path).complete
    assert_no_wrong_number(path, plan, arrays(plan))
    assert load(path).computed == 1.0
    return missing


@pytest.mark.parametrize("which", [range(BLOCKS), [0]], ids=["complete", "begun"])
@pytest.mark.parametrize("name", ["section", "several", "limit"])
def test_zeroed_chunk_is_no_result(tmp_path, name, which):
    """Its block is named and left out by every reader, and is computed again; also in a block not yet written."""
    path, plan = tmp_path / "x.h5", made(name)
    write(path, plan, which)
    content, statuses = path.read_bytes(), look(path).statuses
    with h5py.File(path) as file:
        chunks = {
            (v.variable, k): file[v.variable].id.get_chunk_info(k) for v in variables_of(plan) for k in range(BLOCKS)
        }
    for n, variable in enumerate(v.variable for v in variables_of(plan)):
        turns = {k: chunks[variable, k] for k in (*range(n % BLOCKS, BLOCKS), *range(BLOCKS))}
        filled = [k for k, c in turns.items() if any(content[c.byte_offset : c.byte_offset + c.size])]
        written, other = ([k for k in filled if (k in which) == there] for there in (True, False))
        assert written or variable == "status"
        for k in (*written[:1], *other[:1]):
            check(path, plan, content, statuses, which, variable, k, chunks[variable, k])


def check(path, plan, content, statuses, which, variable, k, chunk):
    """Fill a chunk of a block with zeros, and assert what the test above promises."""
    with_hole(path, content, chunk.byte_offset, chunk.byte_offset + chunk.size)
    array = {"section_xi": "section", "section_dxi": "section", "motion_period": "period", "checksum": "margin"}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert_no_wrong_number(path, plan, [array.get(variable, variable)] if variable != "status" else [])
    told = [str(w.message) for w in caught]
    lost = k in which or variable == "status"
    assert all(f": block {k} (" in text for text in told), variable
    assert bool(told) == lost, variable
    assert list(verify(path).faults) == [k] * lost
    assert look(path).statuses.get("OK", 0) <= statuses["OK"]
    assert repaired(path, plan) == sorted({*range(BLOCKS)} - {*which} | ({k} if lost else {*()}))


def test_hole_between_values_that_hdf5_cannot_see_is_no_result(tmp_path):
    """HDF5's checksum counts words modulo 65535, and does not distinguish -1 (no impact) from 0."""
    path, plan = tmp_path / "x.h5", made("several", periods=300)
    write(path, plan, range(BLOCKS))
    content = path.read_bytes()
    for name in ("impact_period", "impact_states"):
        with h5py.File(path) as file:
            chunk = file[name].id.get_chunk_info(1)
        start = chunk.byte_offset + 1024
        assert content[start : start + 512] == b"\xff" * 512
        with_hole(path, content, start, start + 512)
        with h5py.File(path) as file:
            assert (file[name][...] == 0).any(), "HDF5 reads the hole without an error"
        with pytest.warns(DamagedBlock, match=f"left out of {name}: block 1"):
            assert (load(path)[name][2:4] == -1).all()
        path.write_bytes(content)


def entry(path, name, k):
    """Return the first byte, the first byte of the place and the end of the entry of a chunk in the index."""
    with h5py.File(path) as file:
        data = file[name]
        at = path.read_bytes().index(struct.pack("<Q", data.id.get_chunk_info(k).byte_offset))
        return at - 8 * (data.ndim + 2), at - 8 * (data.ndim + 1), at + 8


@pytest.mark.parametrize("which", [range(BLOCKS), [0, 1]], ids=["complete", "begun"])
def test_status_lost_from_the_index_is_no_uncomputed_block(tmp_path, which):
    """HDF5 replaces a chunk that it does not find by the fill value, and NOT_COMPUTED is that of the status."""
    path, plan = tmp_path / "x.h5", made("section")
    write(path, plan, which)
    content, entries = path.read_bytes(), [entry(path, "status", k) for k in range(BLOCKS)]
    last = entries[-1][2]
    holes = [hole for start, place, end in entries for hole in ((start, end), (place, end - 8), (place, end))]
    for start, stop in [*holes, (last, last + 32), (last - 24, last + 32)]:  # the last key has no address
        with_hole(path, content, start, stop)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            lost = load(path).status.reshape(-1) == Status.NOT_COMPUTED
        blocks = {k for k in which if lost[slice(*plan.blocks()[k])].any()}
        faults = {*look(path).faults}
        assert faults >= blocks
        assert bool(caught) == bool(faults) == bool(verify(path).faults)
        holed = path.read_bytes()
        if start >= last:
            assert {*repaired(path, plan)} >= blocks
        elif faults:
            with pytest.raises(Damaged, match=r"too damaged to be repaired \(wrong index of its chunks"):
                repaired(path, plan)
            assert path.read_bytes() == holed


@pytest.mark.parametrize("name", ["A", "section_dxi", "margin", "checksum", "status"])
def test_chunk_without_a_size_does_not_crash(tmp_path, name):
    """HDF5 2.0 crashes when it reads a chunk of 0 bytes."""
    path, plan = tmp_path / "x.h5", made("section")
    write(path, plan, range(BLOCKS))
    content, (start, place, _) = path.read_bytes(), entry(path, name, 0)
    with_hole(path, content, start, place)
    if name == "A":
        with pytest.raises(Damaged, match="axis A: wrong index of its chunks"):
            load(path)
        return
    with pytest.warns(DamagedBlock, match=f"block 0 .*{name}: wrong index of its chunks.*block 2"):
        assert np.isnan(load(path)[name if name == "margin" else "section"]).all()
    assert len(verify(path).faults) == BLOCKS


@pytest.mark.parametrize("which", [range(BLOCKS), [0]], ids=["complete", "begun"])
@pytest.mark.parametrize(
    "cut", [(8, 0), (7, 0), (8, 7)], ids=["the beginning of the file", "its headers", "another chunk"]
)
def test_repair_writes_into_no_other_part_of_the_file(tmp_path, cut, which):
    """Zeros in the address of a chunk are the address of something else."""
    path, plan = tmp_path / "x.h5", made("section")
    write(path, plan, which)
    content, (_, _, end) = path.read_bytes(), entry(path, "section_xi", 1)
    with_hole(path, content, end - cut[0], end - cut[1])
    holed = path.read_bytes()
    with pytest.raises(Damaged, match="wrong index of its chunks"):
        repaired(path, plan)
    assert path.read_bytes() == holed


def test_same_chunks_in_another_order_are_resumed(tmp_path):
    """h5repack without options keeps chunks and filters, so the file is one of this program."""
    path, plan = tmp_path / "x.h5", made("section")
    write(tmp_path / "ours.h5", plan, [0])
    with h5py.File(tmp_path / "ours.h5") as ours, h5py.File(path, "w") as theirs:
        theirs.attrs.update(ours.attrs)
        for name in sorted(ours, reverse=True):
            ours.copy(name, theirs)
    assert repaired(path, plan) == [1, 2]


def test_chunk_of_another_block_is_no_result(tmp_path):
    """With zeros as the place of block 1 its values are found in the place of block 0, also if block 1 is not read."""
    path, plan = tmp_path / "x.h5", made("section")
    write(path, plan, range(BLOCKS))
    content, (_, place, end) = path.read_bytes(), entry(path, "section_xi", 1)
    with_hole(path, content, place, end - 8)
    with h5py.File(path) as file:
        assert (file["section_xi"][:2].reshape(4, -1) == truth(plan, "section")[4:8, :, 0]).all()
    with pytest.warns(DamagedBlock, match=r"left out of section: block 0 \("):
        assert np.isnan(load(path).select(A=3.0).section).all()
    with pytest.warns(DamagedBlock):
        assert_no_wrong_number(path, plan, arrays(plan))


@pytest.mark.parametrize("size", [512, 4096])
@pytest.mark.parametrize("name", ["section", "several", "summary"])
def test_hole_anywhere_is_no_result(tmp_path, name, size):
    """Also in the index of chunks, in the headers of variables, and in attributes: refused, named, or harmless."""
    path, plan = tmp_path / "x.h5", made(name)
    write(path, plan, range(BLOCKS))
    content, statuses = path.read_bytes(), look(path).statuses
    for start in range(0, len(content), max(size, len(content) // 60 // size * size)):
        with_hole(path, content, start, start + size)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DamagedBlock)
            try:
                assert_no_wrong_number(path, plan, arrays(plan))
                report = verify(path)
            except NoResult:
                continue
        assert report.statuses.get("OK", 0) <= statuses["OK"]


def test_sound_zeros_are_verified_once(tmp_path, monkeypatch):
    """Each block with zeros is read completely on the first access, and no other block."""
    from vibrodrive.store import reader

    path, plan = tmp_path / "x.h5", made("summary")
    write(path, plan, range(BLOCKS))
    asked, checker = [], reader.checker

    def noting(file, plan):
        check = checker(file, plan)
        return lambda tile: asked.append(tile.start) or check(tile)

    monkeypatch.setattr(reader, "checker", noting)
    results = load(path)
    for name in ("energy", "period", "momentum", "status"):
        assert results[name].size
    assert asked == [plan.blocks()[1][0]]
    assert (results.energy[2:4] == 0).all()
