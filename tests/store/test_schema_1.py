"""Files of schema 1, which had a date and kept what all points share in their plan alone, are read and gone on with."""

from __future__ import annotations

import gzip
from pathlib import Path

import h5py
import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.model.config import parse
from vibrodrive.store.layout import Origin, tiles
from vibrodrive.store.reader import verify
from vibrodrive.store.writer import open_writer

STORED = Path(__file__).parent / "data" / "schema_1.h5.gz"
"""A of 1.5, 3.04 and 3.2, with and without a disturbance, by version 0.1.0."""


@pytest.fixture
def old(tmp_path):
    path = tmp_path / "old.h5"
    path.write_bytes(gzip.decompress(STORED.read_bytes()))
    return path


def test_it_is_read_and_whole(old):
    r = vd.load(old)
    assert (r.title, list(r.axes), r.shape, r.computed) == ("Schema 1", ["A", "eps"], (3, 2), 1.0)
    assert verify(old).sound
    assert verify(old).complete
    np.testing.assert_array_equal(r.axes["A"], [1.5, 3.04, 3.2])
    assert np.isfinite(r.section).all()


@pytest.mark.jit
def test_its_numbers_are_those_of_today(old):
    r = vd.load(old)
    now = vd.sweep(A=[1.5, 3.04, 3.2], eps=[0, 2e-4], transient=4, periods=3)
    np.testing.assert_array_equal(r.section, now.section)
    np.testing.assert_array_equal(r.margin, now.margin)


def test_it_is_gone_on_with(old):
    with h5py.File(old, "r+") as file:
        plan = parse(str(file.attrs["config"])).plan()
        file["status"][tiles(plan)[0].slab] = vd.Status.NOT_COMPUTED
    writer = open_writer(old, plan, Origin("another text"))
    writer.check()
    assert writer.missing() == [0]
    writer.close()
