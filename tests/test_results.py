"""Results: named axes, the nearest value, the arrays of a sweep in memory and of its file."""

from __future__ import annotations

import numpy as np
import pytest

from tests import fake
from vibrodrive.parameters import Status
from vibrodrive.plan import make_plan
from vibrodrive.results import Results
from vibrodrive.size import TooLarge


@pytest.fixture
def plan():
    return make_plan({"A": [1.0, 2.0, 3.0, 4.0], "eps": [0, 1e-4], "periods": 5, "transient": 0})


def collected(plan):
    return Results.collect(plan, fake.run_blocks(plan))


def test_every_block_is_in_its_place(plan):
    r = collected(plan)
    assert r.section.shape == (4, 2, 5, 2)
    assert r.switches.shape == (4, 2, 5)
    flat = r.section.reshape(-1, 5, 2)
    for k, (start, stop) in enumerate(plan.blocks()):
        np.testing.assert_array_equal(flat[start:stop], fake.block(plan, k).section)
    # point 5 of the product is A = 3, ε = 1e-4
    assert r.section[2, 1, 0, 0] == np.sin(3.0 * 1 + 5)
    assert r.computed == 1.0


def test_what_is_not_computed_is_marked(plan):
    r = Results.collect(plan, [])
    assert np.isnan(r.section).all()
    assert (r.status == Status.NOT_COMPUTED).all()
    assert r.computed == 0.0


def test_select_takes_the_nearest_value_and_drops_the_axis(plan):
    r = collected(plan)
    part = r.select(A=2.9)
    assert list(part.axes) == ["eps"]
    assert part.scalars["A"] == 3.0
    np.testing.assert_array_equal(part.section, r.section[2])
    point = part.select(eps=1.0)
    np.testing.assert_array_equal(point.section, r.section[2, 1])
    np.testing.assert_array_equal(r.select(eps=0, A=1).margin, r.margin[0, 0])
    with pytest.raises(ValueError, match="axis = 'B': must be one of A, eps"):
        r.select(B=1)


def test_a_sweep_that_does_not_fit_the_memory_is_refused_with_the_numbers():
    plan = make_plan({"A": np.linspace(1, 2, 100_000), "B": np.linspace(0, 1, 10_000), "periods": 10**6})
    with pytest.raises(TooLarge, match=r"1000000000 points x 1000000 periods.* take .*PB.* available"):
        Results.collect(plan, [])


def test_its_name_says_what_it_holds(plan):
    assert repr(collected(plan)) == "<Results A 1…4 (4), eps 0…0.0001 (2): certified, 0 + 5 periods>"
