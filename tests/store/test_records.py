"""Records other than sections are written, resumed, refused, checked and repaired like sections."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
import xarray as xr

from tests.support import fake
from vibrodrive.model.plan import make_plan
from vibrodrive.model.records import quantities
from vibrodrive.model.size import file_bytes
from vibrodrive.store.every_kind import load
from vibrodrive.store.layout import Origin, variable_name, variables_of
from vibrodrive.store.reader import DamagedBlock, verify
from vibrodrive.store.writer import open_writer

TEXT = "[sweep]\nA = {start = 3, stop = 3.25, num = 90}\n"

KINDS = [("summary",), ("impacts",), ("section", "error"), ("section", "impacts", "summary")]


def make(record):
    plan = make_plan({"A": np.linspace(3, 3.25, 90), "transient": 0, "periods": 12, "record": record})
    return replace(plan, tiling=(20,))


def write(path, plan, which=None):
    fake.write(path, plan, TEXT, which)


@pytest.fixture(params=KINDS, ids="+".join)
def plan(request):
    return make(request.param)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "x.h5"


def assert_complete(path, plan):
    found = load(path)
    for k, (start, stop) in enumerate(plan.blocks()):
        expected = fake.block(plan, k)
        for name, values in expected.records.items():
            assert getattr(found, name)[start:stop].tobytes() == values.tobytes(), name
        assert found.switches[start:stop].tolist() == expected.switches.tolist()
        if expected.section is not None:
            assert found.section[start:stop].tobytes() == expected.section.tobytes()


def test_recorded_values_are_read(path, plan):
    write(path, plan, which=[0, 3])
    half = load(path)
    assert (half.record, half.computed) == (plan.record, 40 / 90)
    q = quantities(plan.record)[0]
    np.testing.assert_array_equal(getattr(half, q.name)[20:60], q.fill, "these points are not computed yet")
    write(path, plan)
    assert_complete(path, plan)
    assert verify(path).sound
    assert load(path).select(A=3.1, method="nearest").record == plan.record


def test_file_has_the_estimated_size_and_a_summary_is_small(path, plan):
    write(path, plan)
    assert path.stat().st_size == pytest.approx(file_bytes(plan), abs=70_000), "HDF5's own tables grow by doubling"
    if plan.record == ("summary",):
        points = np.prod(plan.chunk) * len(plan.blocks())
        with h5py.File(path) as file:
            held = sum(file[v.name].id.get_storage_size() for v in variables_of(plan))
        assert held / points < 176, "a point must take less than 176 bytes"


def test_missing_records_are_named(path):
    write(path, make(("summary",)))
    found = load(path)
    with pytest.raises(ValueError, match='extended by "section"'):
        _ = found.section
    with pytest.raises(AttributeError, match='extended by "impacts", which contains impact_phase'):
        _ = found.impact_phase
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = found.nonsense
    assert "energy" in dir(found)
    assert "impact_phase" not in dir(found)


@pytest.mark.parametrize("name", ["sequence", "impact_states"])
def test_flipped_bit_is_found_named_and_repaired(path, name):
    plan = make(("impacts", "summary"))
    write(path, plan)
    with h5py.File(path) as file:
        chunk = file[variable_name(name)].id.get_chunk_info(3)
    raw = bytearray(path.read_bytes())
    raw[chunk.byte_offset + chunk.size // 2] ^= 8
    path.write_bytes(raw)
    assert name in verify(path).faults[3]
    with pytest.warns(DamagedBlock, match=rf"left out of {name}: block 3 \(points"):
        part = getattr(load(path), name).reshape(plan.n_points, -1)
    there = np.arange(plan.n_points)
    start, stop = plan.blocks()[3]
    left = (there < start) | (there >= stop)
    whole = np.concatenate([fake.block(plan, k).records[name] for k in range(len(plan.blocks()))])
    assert part[left].tobytes() == whole.reshape(plan.n_points, -1)[left].tobytes()
    fill = {q.name: q.fill for q in quantities(plan.record)}[name]
    np.testing.assert_array_equal(part[~left], np.full_like(part[~left], fill))
    writer = open_writer(path, plan, Origin(TEXT))
    writer.check()
    assert writer.missing() == [3]
    writer.close()
    write(path, plan)
    assert_complete(path, plan)


def test_swapped_quantities_are_found(path):
    write(path, make(("summary",)))
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
    assert {v.name: v.dtype for v in variables_of(make(("summary",)))}["switches"] == "<i4"


def test_variables_have_units_and_long_names(path, plan):
    write(path, plan)
    with xr.open_dataset(path, engine="h5netcdf") as data:
        for q in quantities(plan.record):
            variable = data[variable_name(q.name)]
            assert (variable.attrs["units"], variable.attrs["long_name"]) == (q.unit, q.meaning)
            assert variable.dims == (("A", "impact") if q.along else ("A",))
        if "section" in plan.record:
            assert data["section_xi"].dims == ("A", "period")
