"""Tests of the plan of a sweep: the order of its axes, its points and blocks, and arguments that it refuses."""

import math
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibrodrive.model import config
from vibrodrive.model.names import ETA, PARAMETERS, SCENE_AXES, SETTINGS, Settings
from vibrodrive.model.parameters import COLUMNS, check_setting
from vibrodrive.model.plan import BLOCK_BYTES, BLOCK_WORK, LEAST_POINTS, WAVE_POINTS, Plan, make_plan
from vibrodrive.model.record import BLOCK_POINTS
from vibrodrive.model.variables import Variable, constants


def test_axes_keep_the_order_written():
    plan = make_plan({"eps": [0.0, 2e-4], "A": np.array([1, 2, 3]), "B": 0.2, "periods": 7})
    assert list(plan.axes) == ["eps", "A"]
    assert plan.shape == (2, 3)
    assert plan.axes["A"].dtype == np.float64
    assert plan.scalars["B"] == 0.2
    assert plan.scalars["eta"] == ETA
    assert math.isnan(plan.scalars["dtau"])
    assert plan.settings == Settings(periods=7)
    points = {"A": [1.0, 2.0], "B": [0.1, 0.2]}
    text = "[sweep]\neps = [0, 1]\n[sweep.points]\nA = [1, 2]\nB = [0.1, 0.2]\n"
    for plan in (make_plan({"eps": [0, 1], "points": points}), config.parse(text).plan()):
        assert list(plan.axes) == ["eps", "point"]
        assert plan.points(0, 4)[:, :3].tolist() == [[1.0, 0.1, 0.0], [2.0, 0.2, 0.0], [1.0, 0.1, 1.0], [2.0, 0.2, 1.0]]
    assert list(make_plan({"points": points, "eps": [0, 1]}).axes) == ["point", "eps"]


def test_one_point_has_no_axis():
    plan = make_plan({"A": 3.04})
    assert (plan.shape, plan.n_points, plan.chunk, plan.blocks()) == ((), 1, (), [(0, 1)])
    assert plan.points(0, 1)[0, 0] == 3.04
    assert make_plan({"A": [3.04]}).shape == (1,)


@settings(max_examples=60, derandomize=True, deadline=None)
@given(
    shape=st.lists(st.integers(1, 3000), min_size=1, max_size=4).filter(lambda s: math.prod(s) <= 10**6),
    periods=st.integers(1, 10**6),
)
def test_blocks_tile_the_points_and_are_chunks(shape, periods):
    axes = {name: Variable(np.zeros(n), name) for name, n in zip(COLUMNS, shape, strict=False)}
    plan = Plan(axes | constants(dict.fromkeys(COLUMNS[len(shape) :], 0.0)), Settings(periods=periods))
    blocks = plan.blocks()
    assert [stop for _, stop in blocks[:-1]] == [start for start, _ in blocks[1:]]
    assert (blocks[0][0], blocks[-1][1]) == (0, plan.n_points)
    points = math.prod(plan.chunk)
    assert points <= BLOCK_POINTS
    assert points == 1 or points * periods * 16 <= BLOCK_BYTES
    assert len(blocks) == math.prod(-(-n // c) for n, c in zip(plan.shape, plan.chunk, strict=True))
    for start, stop in (blocks[0], blocks[-1]):
        index = np.array(np.unravel_index(np.arange(start, stop), plan.shape)).T
        low, high = index.min(axis=0), index.max(axis=0)
        assert math.prod(high - low + 1) == stop - start, "the block must be a box"
        assert (low % plan.chunk == 0).all()
        assert (low // plan.chunk == high // plan.chunk).all(), "the block must be in one tile"


def test_blocks_are_smaller_the_longer_their_points_take():
    """The work of a block is at most BLOCK_WORK, because a stopped run loses its unfinished blocks."""
    long = {"A": np.linspace(3.0, 3.25, 1 << 17), "transient": 10_000, "periods": 10, "record": "summary"}

    def block(**changes):
        plan = make_plan(long | changes)
        points = math.prod(plan.chunk)
        assert points in (1, LEAST_POINTS) or points * plan.point_work <= BLOCK_WORK
        return points

    assert block(transient=1000) == 8192
    short = block()
    assert 0.9 * short < int(BLOCK_WORK // make_plan(long).point_work) < 8192
    some = {"transient": 100, "eps": 1e-5}
    assert block(transient=100) > block(**some | {"eps": 1e-6}) > block(**some) > block(**some | {"eps": 1e-4})
    assert block(**some) > block(**some, A=np.linspace(1.5, 3.25, 1 << 17))  # the mass rests
    assert block(eps=[0.0, 2e-4], transient=10**6) == LEAST_POINTS
    assert block(record=["section", "error"], transient=10**6) == 1  # one motion at a time
    grid = {"method": "fixed", "dtau": [1e-4, 1e-2]}
    assert block(**grid) == block(**grid, record=["summary", "error"])
    together = {"A": 3.0, "points": {"xi0": [0.0] * (1 << 17), "eps": [0.0] * ((1 << 17) - 1) + [2e-5]}}
    assert block(**together, transient=100) == block(transient=100, eps=2e-5)


def test_blocks_of_a_scene_follow_its_smallest_A():
    omega0, scene = np.geomspace(60.0, 300.0, 1000), {"a0": 1.2e-3, "mu": 0.4, "alpha": 3.0, "eps": 1e-4}
    A = make_plan(scene | {"omega0": omega0}).points(0, 1)[0, 0]
    assert make_plan(scene | {"omega0": omega0}).point_work == make_plan({"A": A, "B": 0.2, "eps": 1e-4}).point_work
    assert make_plan(scene | {"omega0": omega0[-1]}).point_work < make_plan(scene | {"omega0": omega0}).point_work


def test_blocks_along_an_axis_have_equal_lengths():
    """A block of the file is stored in full, even at the end of an axis."""
    plan = make_plan({"A": np.linspace(1.0, 4.0, 201), "eps": 1e-4, "record": "summary"})
    lengths = {stop - start for start, stop in plan.blocks()}
    assert plan.n_blocks == len(plan.blocks()) > 2
    assert max(lengths) - min(lengths) <= len(plan.blocks())


def test_wave_with_both_kinds_of_points_begins_with_little_work():
    """The points with ε = 0 are computed first, so no block may be finished before they are."""
    long = {"A": np.linspace(3.0, 3.25, 1 << 17), "transient": 10_000, "periods": 10, "record": "summary"}
    assert make_plan(long).wave_points == make_plan(long | {"eps": 1e-5}).wave_points == WAVE_POINTS
    mixed = make_plan(long | {"eps": [0.0, 1e-5]})
    assert mixed.wave_points * make_plan(long).point_work <= BLOCK_WORK


def test_arguments_of_a_point_reproduce_its_plan():
    plan = make_plan({"A": [1.0, 2.0], "eps": [0.0, 1e-4, 2e-4], "dtau": 0.1, "method": "fixed", "periods": 7})
    for at in range(plan.n_points):
        alone = make_plan(plan.arguments(at))
        assert alone.axes == {}
        assert alone.points(0, 1).tobytes() == plan.points(at, at + 1).tobytes()
        assert alone.settings == plan.settings
    assert make_plan({"A": 1.0}).arguments(0)["dtau"] is None


def test_settings_agree_with_the_tables_of_a_configuration():
    """A configuration accepts and refuses the same values of all settings and parameters as `make_plan`."""
    known = {key for keys in config.HOMES.values() for key in keys}
    assert known == {*COLUMNS, *SETTINGS, *SCENE_AXES, "record", "points"}
    assert list(SETTINGS) == [f.name for f in fields(Settings)]
    assert not [name for name in PARAMETERS if sum(name in keys for keys in config.HOMES.values()) != 2]
    for table, keys in config.HOMES.items():
        for key in keys:
            if key not in SETTINGS:
                continue
            with pytest.raises((TypeError, ValueError)) as refused:
                make_plan({"A": 1.0, key: -1})
            with pytest.raises(config.ConfigError) as told:
                config.parse(f"[{table}]\n{key} = -1\n")
            assert str(told.value) == str(refused.value)
            default = getattr(Settings(), key)
            assert check_setting(key, Settings().words[key]) == default
