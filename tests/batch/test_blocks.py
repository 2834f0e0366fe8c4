"""Blocks of a sweep: each is given as soon as it is finished, and its work is counted rightly beforehand."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.batch import sweep
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.model.names import ETA
from vibrodrive.model.plan import make_plan

pytestmark = pytest.mark.jit


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("eps", [[1e-6, 1e-4], [0.0, 1e-4]], ids=["one kernel", "two kernels"])
def test_block_is_given_while_others_are_computed(threads, eps):
    """The first motion never leaves, the second takes seconds. A halt after the first block ends the second."""
    points = {"A": [0.5, 3.0], "eps": eps}
    plan = replace(make_plan({"points": points, "transient": 10**7, "periods": 2}), tiling=(1,))
    halt, given = Halt(), []

    def give(block):
        given.append(block.index)
        halt.call()

    with pytest.raises(Halted):
        sweep.compute_wave(plan, [(0, 0, 1), (1, 1, 2)], threads, halt, give)
    assert given == [0]


def test_task_leaves_blocks_when_its_time_is_over(monkeypatch):
    plan = replace(make_plan({"A": np.linspace(3.0, 3.25, 40), "transient": 2, "periods": 2}), tiling=(2,))
    spans = [(i, *span) for i, span in enumerate(plan.blocks())]
    whole = sweep.compute_some(plan, spans, Halt())
    assert [block.index for block in whole] == [*range(20)]
    monkeypatch.setattr(sweep, "TASK_SECONDS", 0.0)
    assert [block.index for block in sweep.compute_some(plan, spans[5:], Halt())] == [5]
    with ThreadPoolExecutor(1) as pool:
        found = list(sweep.run_blocks(plan, [*range(5, 20)], executor=pool))
    assert sorted((block.index, block.start) for block in found) == [(k, 2 * k) for k in range(5, 20)]
    for block in found:
        np.testing.assert_array_equal(block.section, whole[block.index].section)


@pytest.mark.parametrize("method", ["certified", "fixed", "muller"])
def test_work_is_at_least_the_time_of_the_switches(method):
    """A switch takes 0.06 µs or more on the machine of the benchmarks (`python -m benchmarks.work`)."""
    A, B = np.geomspace(0.5, 1000.0, 12), [0.0, 0.1, 0.5]
    for strength in (0.01, 0.3, 1.0, 3.0, 30.0):
        span = {"method": method, "dtau": None if method == "certified" else 0.01, "transient": 10, "periods": 10}
        arguments = {"A": A, "B": B, "eps": strength / ETA**2, **span}
        switches = vd.sweep(**arguments).switches.sum(axis=-1)
        for a, b in np.ndindex(switches.shape):
            work = make_plan(arguments | {"A": float(A[a]), "B": B[b]}).point_work
            assert work >= 20 * 0.06 * switches[a, b] / 10, (A[a], B[b], strength)
        assert make_plan(arguments | {"A": 0.9}).point_work < 20 * 0.15 * 5 * ETA
