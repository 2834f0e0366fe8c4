"""Levels, the successive refinements of a picture, contain every point once, coarse grids first. The last level equals
the sweep of the exported configuration."""

import numpy as np
import pytest

pytest.importorskip("bokeh")

import vibrodrive as vd
from vibrodrive.explorer.view import View
from vibrodrive.explorer.work import STRIDES, Pace, Work, coarse_first
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.model import config

SLOW = 1e4
"""Assumed speed in periods per second, so low that every view begins with a coarse picture and has many levels."""


@pytest.mark.parametrize("shape", [(1,), (2,), (5,), (100,), (1000,), (33, 20), (16, 16), (3, 1)])
def test_every_point_once_and_coarse_grids_first(shape):
    order, steps = coarse_first(shape)
    assert sorted(order.tolist()) == list(range(np.prod(shape)))
    strides = STRIDES[-len(steps) :]
    for stride, count in zip(strides, steps.tolist(), strict=True):
        coarse = np.ravel_multi_index(np.ix_(*(np.arange(0, n, stride) for n in shape)), shape)
        assert set(order[:count].tolist()) == set(coarse.reshape(-1).tolist())


def paced(pace):
    found = Pace()
    found.of = lambda plan: pace
    return found


VIEWS = {
    "undisturbed": {"columns": 201},
    "disturbed": {"columns": 201, "eps": 2e-4},
    "fixed": {"columns": 201, "method": "fixed", "dtau": 0.1},
    "muller": {"columns": 201, "method": "muller", "dtau": 0.05, "x": "xi0"},
    "impacts": {"columns": 201, "quantity": "impact_phase"},
    "map": {"mode": "map", "columns": 21, "rows": 17},
}


@pytest.mark.jit
@pytest.mark.parametrize("pace", [SLOW, 1e9])
@pytest.mark.parametrize("name", VIEWS)
def test_last_level_equals_the_sweep_of_the_exported_file(name, pace):
    view = View.read({"transient": 30, "periods": 40, **VIEWS[name]})
    work = Work([view.plan()], 2)
    levels = [(level.share, level.complete) for level in work.levels(paced(pace), Halt())]
    assert levels[-1] == (1.0, True)
    assert [share for share, _ in levels] == sorted(share for share, _ in levels)
    assert len(levels) > 2 if pace == SLOW else len(levels) == 1
    arguments = config.parse(view.toml()).arguments
    if arguments.get("method") != "muller":
        arguments.pop("tol", None)
    wanted, found = vd.sweep(**arguments), work.part.results[0]
    assert list(found.axes) == list(wanted.axes)
    names = {"section": ["section"], "impacts": ["impact_phase", "impact_speed"], "summary": ["period", "energy"]}
    for array in (*names[view.record], "status", "margin", "switches"):
        assert np.array_equal(getattr(found, array), getattr(wanted, array), equal_nan=True), array


@pytest.mark.jit
def test_halted_work_resumes_with_the_same_bits():
    view = View.read({"columns": 1000, "transient": 100, "periods": 50})
    work, seen = Work([view.plan()], 2), []
    for level in work.levels(paced(SLOW), Halt()):
        seen.append(level.share)
        if len(seen) == 3:
            break
    assert 0.0 < seen[-1] < 1.0
    again = [level.share for level in work.levels(paced(1e9), Halt())]
    assert again[0] == seen[-1]
    assert np.array_equal(work.part.results[0].section, vd.sweep(**config.parse(view.toml()).arguments).section)


@pytest.mark.jit
def test_halt_flag_ends_long_work():
    from threading import Timer

    view = View.read({"columns": 1000, "eps": 5e-4, "transient": 10**6, "periods": 10})
    work, halt = Work([view.plan()], 2), Halt()
    Timer(0.2, halt.call).start()
    with pytest.raises(Halted):
        list(work.levels(Pace(), halt))


@pytest.mark.jit
def test_sketch_has_fewer_periods_and_is_replaced():
    view = View.read({"columns": 400, "eps": 2e-4})
    levels = Work([view.plan()], 2).levels(paced(2e5), Halt())
    first = next(levels)
    assert first.sketch is not None
    assert first.sketch.results[0].settings.periods < view.periods
    assert first.sketch.done.sum() == 100
    assert not first.sweep.done.any()
    second = next(levels)
    assert second.sweep.done.any()
    assert second.sweep.results[0].settings.periods == view.periods
    levels.close()
