"""Carried sweeps: a chain of single motions, whoever computes it, in which blocks, and however often it is stopped."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import h5py
import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.batch.carry import continued
from vibrodrive.batch.sweep import run_blocks
from vibrodrive.errors import Different
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.plan import make_plan
from vibrodrive.model.results import Results
from vibrodrive.store.every_kind import load
from vibrodrive.store.layout import Origin
from vibrodrive.store.reader import verify
from vibrodrive.store.writer import open_writer

START = {"xi0": 1.0, "dxi0": -0.5, "tau0": 0.3, "section_phase": 1.0}
RUN = {"transient": 12, "periods": 3}
GRID = {"method": "fixed", "dtau": 0.1}
EVERY = ("section", "status", "margin", "switches", "energy", "impact_speed")


def chain(A, direction, **arguments):
    """Sections of motions one after the other, each from where the last one ended."""
    section, start = {}, START
    for value in A if direction == "up" else A[::-1]:
        section[value] = vd.simulate(float(value), **{**arguments, **start}, **RUN).section
        xi, dxi = section[value][-1]
        start = START | {"xi0": max(xi, 0.0), "dxi0": dxi, "tau0": START["section_phase"]}
    return np.array([section[value] for value in A])


@pytest.mark.jit
@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("grid", [{}, GRID], ids=["certified", "fixed"])
def test_a_carried_sweep_is_a_chain_of_single_motions(direction, grid):
    A = np.linspace(2.9, 3.25, 6)
    r = vd.sweep(A=A, eps=[0.0, 2e-4], **START, **RUN, **grid, carry=direction)
    for k, eps in enumerate((0.0, 2e-4)):
        assert r.section[:, k].tobytes() == chain(A, direction, eps=eps, **grid).tobytes()
    apart = vd.sweep(A=A, eps=[0.0, 2e-4], **START, **RUN, **grid)
    first = 0 if direction == "up" else -1
    assert r.section[first].tobytes() == apart.section[first].tobytes()
    assert r.section[1:-1].tobytes() != apart.section[1:-1].tobytes()


def plan_of(direction, tiling=None):
    """Five layers of six points."""
    axes = {"A": np.linspace(2.9, 3.25, 5), "eps": [0.0, 2e-4], "xi0": [0.0, 1.0, 4.0]}
    record = ["section", "summary", "impacts"]
    return replace(make_plan({**axes, **RUN, "carry": direction, "record": record}), tiling=tiling)


def whole(plan):
    """The same from the public function, as bytes."""
    r = vd.sweep(**plan.axes, **RUN, carry=plan.carry, record=plan.record)
    return {name: getattr(r, name).tobytes() for name in EVERY}


def collected(plan, **options):
    r = Results.collect(plan, run_blocks(plan, **options))
    return {name: getattr(r, name).tobytes() for name in EVERY}


@pytest.mark.jit
@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("tiling", [(2, 2, 3), (1, 1, 3), (1, 1, 2)], ids=str)
def test_bits_depend_neither_on_blocks_nor_on_threads_nor_on_who_computes(direction, tiling):
    plan = plan_of(direction, tiling)
    expected = whole(plan)
    assert collected(plan, threads=1) == collected(plan, threads=2) == expected
    with ThreadPoolExecutor(3) as pool:
        assert collected(plan, executor=pool) == expected


def fill(path, plan, blocks):
    """Compute so many of the missing blocks into a file; returns how many are missing then."""
    with_rest = open_writer(path, plan, Origin("[sweep]\nA = 3\n"))
    with_rest.check()
    found = run_blocks(with_rest.plan, with_rest.missing(), threads=1, stored=with_rest.last_section)
    for _ in range(min(blocks, len(with_rest.missing()))):
        with_rest.write(next(found))
    found.close()
    with_rest.commit()
    missing = len(with_rest.missing())
    with_rest.close()
    return missing


@pytest.mark.jit
@pytest.mark.parametrize("direction", ["up", "down"])
@pytest.mark.parametrize("tiling", [(2, 2, 3), (1, 1, 2)], ids=str)
def test_resumed_and_repaired_files_have_the_bits_of_an_uninterrupted_run(tmp_path, direction, tiling):
    path, plan = tmp_path / "x.h5", plan_of(direction, tiling)
    left = fill(path, plan, 2)
    assert left == len(plan.blocks()) - 2
    assert fill(path, plan, 1) == left - 1
    assert fill(path, plan, 99) == 0
    with h5py.File(path, "r+") as file:  # damage a block that others depend on and that depends on others
        file["margin"][2, 0, 0] += 1.0
    assert not verify(path).sound
    assert fill(path, plan, 99) == 0
    found = load(path)
    assert found.carry == direction
    assert {name: getattr(found, name).tobytes() for name in EVERY} == whole(plan)


def test_a_file_carried_otherwise_is_refused_in_words(tmp_path):
    path = tmp_path / "x.h5"
    open_writer(path, plan_of("up"), Origin("[sweep]\nA = 3\n")).close()
    for direction, told in (("down", "down"), (None, "not given")):
        with pytest.raises(Different, match=f"carry is up there and {told} here"):
            open_writer(path, plan_of(direction), Origin("[sweep]\nA = 3\n"))


def test_a_motion_that_was_given_up_hands_nothing_on():
    """And ξ below the obstacle, where an impact has not been noticed yet, is taken for 0."""
    points = make_plan({"A": [1.0, 2.0, 3.0], **START}).points(0, 3)
    after = continued(points.copy(), np.array([[2.0, -1.0], [np.nan, np.nan], [-1e-9, -0.5]]))
    columns = [COLUMNS.index(name) for name in ("xi0", "dxi0", "tau0")]
    assert after[:, columns].tolist() == [[2.0, -1.0, 1.0], [1.0, -0.5, 0.3], [0.0, -0.5, 1.0]]


@pytest.mark.jit
def test_carried_along_points_and_recorded_as_attributes():
    path = {"A": np.linspace(3.0, 3.1, 4), "B": np.linspace(0.1, 0.2, 4)}
    r = vd.sweep(points=path, **RUN, carry="up")
    assert (r.carry, r.select(point=3).carry, r.to_xarray().attrs["carry"]) == ("up", "up", "up")
    last = vd.simulate(3.0, **RUN).section[-1]
    for k in range(1, 4):
        motion = vd.simulate(path["A"][k], B=path["B"][k], xi0=last[0], dxi0=last[1], **RUN)
        assert r.section[k].tobytes() == motion.section.tobytes()
        last = motion.section[-1]
