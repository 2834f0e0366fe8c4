"""Tests of Results: named axes, selection of values, equality of results, sizes in memory, and the repr."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import vibrodrive as vd
from tests.support import fake
from vibrodrive.batch.block import gather
from vibrodrive.errors import TooLarge
from vibrodrive.model import size
from vibrodrive.model.choices import Status
from vibrodrive.model.plan import make_plan
from vibrodrive.model.results import Results


@pytest.fixture
def plan():
    return make_plan({"A": [1.0, 2.0, 3.0, 4.0], "eps": [0, 1e-4], "periods": 5, "transient": 0})


def collected(plan):
    return gather(plan, fake.run_blocks(plan))


def test_select_finds_the_exact_or_nearest_value_and_drops_the_axis(plan):
    r = collected(plan)
    part = r.select(A=2.9, method="nearest", tolerance=0.11)
    assert list(part.axes) == ["eps"]
    assert part.scalars["A"] == 3.0
    np.testing.assert_array_equal(part.section, r.section[2])
    point = part.select(eps=1e-4)
    np.testing.assert_array_equal(point.section, r.section[2, 1])
    np.testing.assert_array_equal(r.select(eps=0, A=1).margin, r.margin[0, 0])


def test_select_allows_for_rounding_of_a_value(plan):
    """In double precision 0.1 · 3 exceeds 0.3, but it selects the value 0.3 of an axis."""
    r = Results(make_plan({"A": np.array([0.1, 0.3])}), {"margin": np.array([1.0, 2.0])})
    assert r.select(A=0.1 * 3).margin == 2.0
    axis = np.linspace(3.0, 3.25, 251)
    r = Results(make_plan({"A": axis}), {"margin": np.arange(251.0)})
    assert [r.select(A=round(3 + k / 1000, 3)).margin for k in range(251)] == list(range(251))
    assert (axis != [round(3 + k / 1000, 3) for k in range(251)]).any(), "some values must differ by rounding"


@pytest.mark.integration
def test_trajectories_are_equal_if_arguments_and_results_are_equal():
    one, same = (vd.simulate(A=3.04, eps=1e-4, transient=2, periods=3) for _ in range(2))
    other = vd.simulate(A=3.05, eps=1e-4, transient=2, periods=3)
    assert (one == same, one != same, one == other) == (True, False, False)
    assert one != vd.simulate(A=3.04, eps=1e-4, transient=2, periods=3, budget=99)
    assert one != 3
    assert pickle.loads(pickle.dumps(one)) == one, "motions with Δτ = NaN must compare equal"
    for name in one.switches.dtype.names:
        switches = one.switches.copy()
        switches[name][-1] += 1
        assert replace(one, switches=switches) != one, name
    on_a_grid = [vd.simulate(1.5, method="fixed", dtau=0.1, transient=0, periods=2) for _ in range(2)]
    assert np.isnan(on_a_grid[0].error).all()
    assert on_a_grid[0] == on_a_grid[1]
    assert [one.sample(5) == each for each in (same.sample(5), other.sample(5), one.sample(6))] == [True, False, False]
    given_up = [vd.simulate(A=1.5, eps=5e-4, transient=0, periods=2, budget=9) for _ in range(2)]
    assert np.isnan(given_up[0].section).any()
    assert given_up[0] == given_up[1], "NaN in the same places must compare equal"


def test_blocks_of_an_executor_use_more_memory_than_local_blocks(monkeypatch):
    plan = make_plan({"A": np.linspace(1, 2, 100_000), "transient": 0, "periods": 1000})
    monkeypatch.setattr(size, "available_memory", lambda: 10 * size.block_bytes(plan))
    size.refuse_large_block(plan)
    with pytest.raises(TooLarge, match="the blocks computed at one time take"):
        size.refuse_large_block(plan, remote=True)


def test_repr_describes_the_contents(plan):
    r = collected(plan)
    assert repr(r) == (
        "<Results of 4 × 2 points, computed: A 1…4 (4), eps 0…0.0001 (2); section; certified, 0 + 5 periods; "
        "3 OK, 3 TOO_CLOSE, 2 BUDGET>"
    )
    assert repr(r.select(A=1, eps=0)) == "<Results of one point, computed: section; certified, 0 + 5 periods; 1 OK>"
    half = Results.uncomputed(plan)
    assert half.computed == 0.0
    half.status[0] = Status.OK
    assert repr(half).startswith("<Results of 4 × 2 points, 25.0 % computed: ")
    page = r._repr_html_()
    assert "<td>4 × 2 points</td>" in page
    assert "B = 0.1" in page


def test_arrays_and_axes_are_items():
    plan = make_plan({"eps": [0.0, 1e-4], "points": {"A": [3.0, 3.1]}, "record": ["section", "summary"], "periods": 2})
    r = gather(plan, fake.run_blocks(plan))
    assert "eps 0…0.0001 (2), point 0…1 (2) with A; section, summary" in repr(r)
    for name in ("section", "status", "margin", "switches", "period", "energy"):
        np.testing.assert_array_equal(r[name], getattr(r, name))
    assert (r["A"].tolist(), r["eps"].tolist()) == ([3.0, 3.1], [0.0, 1e-4])
    for name in ("sections", "plot", "error", "impact_phase", 0, slice(None)):
        with pytest.raises(KeyError, match=r"name = .*: must be one of section, status, margin, switches, period, "):
            r[name]
    with pytest.raises(TypeError, match="not iterable"):
        list(r)
    for name in ("error", "error_xi", "k2", "impact_phase"):
        assert getattr(r, name, None) is None
        with pytest.raises(ValueError, match="must be extended by"):
            getattr(r, name)
    r = gather(plan := make_plan({"A": [3.0], "record": "summary"}), fake.run_blocks(plan))
    assert not hasattr(r, "section")
