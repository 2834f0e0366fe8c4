"""Levels, the successive refinements of a picture, contain every point once, coarse grids first. The last level equals
the sweep of the exported configuration."""

from threading import Timer

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.explorer.view import View
from vibrodrive.explorer.work import STRIDES, Pace, Work, coarse_first
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.model import config


@pytest.mark.parametrize("shape", [(1,), (5,), (1000,), (33, 20), (3, 1)])
def test_every_point_once_and_coarse_grids_first(shape):
    order, steps = coarse_first(shape)
    assert sorted(order.tolist()) == list(range(np.prod(shape)))
    for stride, count in zip(STRIDES[-len(steps) :], steps.tolist(), strict=True):
        coarse = np.ravel_multi_index(np.ix_(*(np.arange(0, n, stride) for n in shape)), shape)
        assert set(order[:count].tolist()) == set(coarse.reshape(-1).tolist())


def paced(pace):
    """Return a pace of so many periods per second; with 1e4 every view begins coarse and has many levels."""
    found = Pace()
    found.of = lambda plan: pace
    return found


VIEWS = {
    "undisturbed": {"columns": 201},
    "disturbed": {"columns": 201, "eps": 2e-4},
    "fixed": {"columns": 201, "method": "fixed", "dtau": 0.1},
    "impacts": {"columns": 201, "quantity": "impact_phase"},
    "map": {"mode": "map", "columns": 21, "rows": 17},
}


@pytest.mark.jit
@pytest.mark.parametrize("name", VIEWS)
def test_last_level_equals_the_sweep_of_the_exported_file_also_after_a_halt(name):
    view = View.read({"transient": 30, "periods": 40, **VIEWS[name]})
    work, seen = Work([view.plan()], 2), []
    for level in work.levels(paced(1e4), Halt()):
        seen.append(level.share)
        if len(seen) == 3:
            break
    assert 0.0 < seen[-1] < 1.0
    again = [(level.share, level.complete) for level in work.levels(paced(1e9), Halt())]
    assert (again[0][0], again[-1]) == (seen[-1], (1.0, True))
    wanted, found = vd.sweep(**config.parse(view.toml()).arguments), work.part.results[0]
    names = {"section": ["section"], "impacts": ["impact_phase", "impact_speed"], "summary": ["period", "energy"]}
    for array in (*names[view.record], "status", "margin", "switches"):
        assert np.array_equal(getattr(found, array), getattr(wanted, array), equal_nan=True), array


@pytest.mark.jit
def test_halt_flag_ends_long_work_and_a_sketch_has_fewer_periods():
    view = View.read({"columns": 1000, "eps": 5e-4, "transient": 10**6, "periods": 10})
    work, halt = Work([view.plan()], 2), Halt()
    Timer(0.2, halt.call).start()
    with pytest.raises(Halted):
        list(work.levels(paced(1e12), halt))
    short = Work([View.read({"columns": 400, "eps": 2e-4}).plan()], 2).levels(paced(2e5), Halt())
    first = next(short)
    assert (first.sketch.done.sum(), first.sweep.done.any()) == (100, False)
    second = next(short)
    assert first.sketch.results[0].settings.periods < second.sweep.results[0].settings.periods == 500
    assert second.sweep.done.any()
