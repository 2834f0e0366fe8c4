"""Pictures and motions without a page: images of diagrams and maps, the levels that refine them, and the limits k₂."""

import json
import math
import re
from dataclasses import replace
from threading import Timer
from types import SimpleNamespace

import numpy as np
import pytest

import vibrodrive as vd
from tests.support.messages import messages
from vibrodrive.batch.trajectory import follow
from vibrodrive.explorer.image import (
    ONLY_CERTIFIED,
    ONLY_CHOSEN,
    _nearest,
    difference,
    fitting_range,
    pictures,
    values_of,
)
from vibrodrive.explorer.motion import curve_of, limit_at, limit_plans, motion_at, shown_motion, undisturbed, words
from vibrodrive.explorer.tasks import answer, save, work_of
from vibrodrive.explorer.view import View
from vibrodrive.explorer.work import Level, Pace, Part, Work, coarse_first
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.model import config


def test_difference_marks_the_method_of_each_pixel():
    chosen, certified = np.zeros((2, 360, 3), np.uint8)
    chosen[10, 0] = certified[11, 0] = 5  # pixels in adjacent rows count as equal
    chosen[100, 1] = 7
    certified[200, 2] = 9
    found = difference(chosen, certified)
    assert [found[k] for k in ((10, 0), (11, 0), (100, 1), (200, 2))] == [5, 5, ONLY_CHOSEN + 7, ONLY_CERTIFIED + 9]
    assert (found > 0).sum() == 4


def test_coarse_cells_of_a_map():
    done = np.zeros((40, 35), bool)
    done[::16, ::16] = True
    assert _nearest(done).reshape(40, 35)[39, 34] == 32 * 35 + 32
    done[::2, ::2] = True
    found = _nearest(done).reshape(40, 35)
    assert (found[39, 34], found[0, 1]) == (38 * 35 + 34, 0)


@pytest.mark.jit
def test_missing_columns_repeat_the_column_on_their_left():
    work = Work([View.read({"columns": 9, "transient": 20, "periods": 20}).plan()], 1)
    list(work.levels(Pace(), Halt()))
    low, high = fitting_range(Level(work.part, None), "dxi")
    (full,) = pictures(Level(work.part, None), "dxi", low, high)
    done = np.arange(9) % 4 == 0
    coarse, rest = Part(work.part.results, done), Part(work.part.results, ~done)
    assert np.array_equal(pictures(Level(coarse, None), "dxi", low, high)[0], full[:, [0, 0, 0, 0, 4, 4, 4, 4, 8]])
    assert np.array_equal(pictures(Level(coarse, rest), "dxi", low, high)[0], full)


@pytest.mark.jit
def test_motion_out_of_budget_is_not_drawn():
    """Values of fewer periods would give a different picture."""
    given_up = vd.sweep(A=[1.5, 1.6], eps=[5e-4], transient=0, periods=30, budget=60, tau0=1.0)
    assert (given_up.status == vd.Status.BUDGET).all()
    assert np.isnan(values_of(given_up, "dxi")).all()


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
    again = [(level.share, level.complete) for level in work.levels(paced(1e4), Halt())]
    assert (again[0][0], again[-1]) == (seen[-1], (1.0, True))
    wanted, found = vd.sweep(**config.parse(view.toml()).arguments), work.part.results[0]
    names = {"section": ["section"], "impacts": ["impact_phase", "impact_speed"], "summary": ["period", "energy"]}
    for array in (*names[view.record[0]], "status", "margin", "switches"):
        assert np.array_equal(getattr(found, array), getattr(wanted, array), equal_nan=True), array


@pytest.mark.jit
def test_halt_flag_ends_long_work_and_a_sketch_has_fewer_periods():
    view = View.read({"columns": 1000, "eps": 5e-4, "transient": 10**6, "periods": 10})
    work, halt = Work([view.plan()], 2), Halt()
    Timer(0.2, halt.call).start()
    with pytest.raises(Halted):
        list(work.levels(paced(1e12), halt))
    short = Work([View.read({"columns": 400, "eps": 2e-4}).plan()], 2).levels(paced(2e5), Halt())
    first, second = next(short), next(short)
    assert np.array_equal(np.flatnonzero(first.sketch.done), np.arange(0, 400, 4)), "a coarse grid first"
    assert first.sketch.results[0].settings.periods < second.sweep.results[0].settings.periods == 500
    assert second.sweep.done.any()


@pytest.mark.jit
@pytest.mark.parametrize("eps", [0.0, 2e-4])
def test_curve_is_the_motion_with_its_states(eps):
    motion = vd.simulate(3.04, eps=eps, tau0=0.3, transient=50, periods=6)
    found, sample = curve_of(motion), motion.sample(4001)
    time = (sample.tau - sample.tau[0]) / (2.0 * math.pi)
    there = np.isfinite(found["dxi"])
    wrong = np.abs(np.interp(time, found["time"][there], found["dxi"][there]) - sample.dxi)
    assert np.quantile(wrong, 0.99) < 0.002 + 0.1 * 3.04 * eps * motion.arguments["eta"]
    middles = 0.5 * (found["time"][1:] + found["time"][:-1])
    states = sample.state[np.searchsorted(time, middles)]
    wide = np.diff(found["time"]) > 1e-3
    assert np.mean(found["state"][:-1][wide] == states[wide]) > 0.98
    assert {*np.unique(found["state"])} <= set(map(int, vd.State))


@pytest.mark.jit
@pytest.mark.parametrize("more", [{}, {"eps": 2e-4}, {"tau0": 0.3, "section_phase": 0.2}, {"method": "fixed"}])
def test_impacts_and_dots_lie_on_the_curve(more):
    head, found = shown_motion(View.read({"low": 3.0, "high": 3.25, "at": 3.1, **more}), {}, Halt())
    time, dxi = found["time"], found["dxi"]
    there = np.isfinite(dxi)
    assert np.isin(found["hit_time"].round(5), time[~there].round(5)).all(), "the velocity jumps there"
    assert len(found["hit_time"]) == np.sum(there[:-1] & ~there[1:] & (dxi[:-1] < -1.5)) + np.sum(
        found["hit_speed"] < 1.5
    )
    assert found["hit_speed"] == pytest.approx(-dxi[np.searchsorted(time, found["hit_time"])], abs=1e-4)
    view = View.read(more)
    when = (view.section_phase - view.tau0) / (2 * np.pi) % 1 + np.arange(12)
    assert found["dot"] == pytest.approx(np.interp(when, time[there], dxi[there]), abs=2e-3)
    assert found["dot_time"].tolist() == [
        max([h for h in found["hit_time"] if h <= t] or found["hit_time"]) for t in when
    ]
    assert (len(found["dot"]), round(float(time[-1]))) == (12, 12)
    assert (head["status"], head["limits"]["eps"]) == ("OK", None)


@pytest.mark.jit
@pytest.mark.parametrize(
    ("more", "period"),
    [
        ({"at": 3.1842, "low": 3.18, "high": 3.19, "transient": 2000, "periods": 250}, 8),
        ({"at": 3.04, "eps": 1.5e-5}, 0),
        ({"at": 3.04, "method": "fixed", "dtau": 0.0353, "periods": 40}, 0),
        ({"at": 2.703, "eps": 0.002}, 0),  # its first twelve periods have another status
    ],
)
def test_description_is_that_of_the_record_which_the_page_names_without_a_hash(more, period):
    view = View.read(more)
    told = words(view.motion_plan(), view, Halt())
    disturbed = {name: more[name] for name in ("eps", "dtau", "method") if name in more}
    record = {"section_phase": view.section_phase, "transient": view.transient, "periods": view.recorded}
    motion = vd.simulate(view.at, **disturbed, **record)
    assert (told["details"], told["period"]) == (motion.describe().splitlines()[1:], period)
    assert told["status"] == motion.status.name
    assert period != 8 or "states: a cycle of more than 12" in told["details"]


@pytest.mark.jit
def test_limits_are_those_of_limit_and_end_when_they_are_halted():
    plans = limit_plans(View.read({"method": "fixed", "dtau": 0.05, "at": 3.04}).motion_plan())
    for name, method in (("eps", "certified"), ("dtau", "fixed")):
        wanted, found = vd.limit(3.04, name, method), limit_at(plans[name], Halt())
        assert (float(found["k2"]), float(found["last_kept"])) == (wanted.k2, wanted.last_kept)
    given = {}, {"method": "fixed", "dtau": 0.05, "eps": 1e-4}
    plain, disturbed = (View.read({"at": 3.04, "transient": 50, **more}).motion_plan() for more in given)
    assert np.array_equal(motion_at(undisturbed(disturbed), Halt()).section, motion_at(plain, Halt()).section)
    never = View.read({"method": "muller", "dtau": 0.3, "at": 3.04})
    assert limit_at(limit_plans(never.motion_plan())["dtau"], Halt())["k2"] == "Infinity"
    halt = Halt()
    Timer(0.2, halt.call).start()
    with pytest.raises(Halted):
        limit_at(limit_plans(View.read({"at": 2.2}).motion_plan())["eps"], halt)


def session_of(told):
    """Return a page that appends what it is told to a list."""
    engine = SimpleNamespace(threads=1, pace=Pace(), limits={}, make_room=print)
    engine.worker = SimpleNamespace(pause=lambda *_: None)
    return SimpleNamespace(
        work=None, made_from=[], painted=0, pixels=(300, 200), moving="", rests=False,
        later=lambda change: change(), news=told.append, send=lambda kind, head, arrays: told.append(head),
        engine=engine,
    )  # fmt: skip


@pytest.mark.jit
def test_slow_map_finds_the_limit_of_its_motion_first_and_tells_how_long_it_takes(monkeypatch):
    monkeypatch.setattr("vibrodrive.explorer.tasks.SOON", 0.0)  # every picture is slow
    monkeypatch.setattr("vibrodrive.explorer.work.LEVEL_SECONDS", 1e-9)
    session = session_of(told := [])
    session.view = view = View.read(
        {"mode": "map", "columns": 33, "rows": 9, "periods": 66, "transient": 20, "eps": 2e-4, "at": 3.04, "at_y": 0.1}
    )
    answer(session, view, {"seq": 1, "done": 1}, Halt())
    pictures = [head for head in told if "complete" in head]
    (limits,) = (news for news in told if "limits" in news and "done" not in news)
    assert float(limits["limits"]["eps"]["k2"]) == vd.limit(3.04).k2
    assert told.index(pictures[0]) < told.index(limits) < told.index(pictures[-1])
    assert [head["complete"] for head in pictures] == [False] * (len(pictures) - 1) + [True]
    assert pictures[-2]["left"] > pictures[-1]["left"] == 0.0


@pytest.mark.jit
def test_time_that_is_left_is_that_of_the_missing_points_at_the_mean_rate_of_the_others(monkeypatch):
    now = iter(range(10**6))
    monkeypatch.setattr("vibrodrive.explorer.work.perf_counter", lambda: float(next(now)))  # each level takes seconds
    work = Work([View.read({"columns": 300, "transient": 3, "periods": 5}).plan()], 1)
    seen = [(level.share, level.left, work.seconds) for level in work.levels(paced(1e4), Halt())]
    assert len(seen) > 3
    for share, left, taken in seen[1:]:
        assert left == pytest.approx(taken * (1.0 - share) / share)


@pytest.mark.parametrize("shape", [(300,), (40, 30)])
def test_each_grid_is_computed_in_a_mixed_order_after_all_coarser_ones(shape):
    order, counts = coarse_first(shape)
    assert sorted(order) == [*range(math.prod(shape))]
    for count, stride in zip(counts, (16, 8, 4, 2, 1)[-len(counts) :], strict=True):
        grid = np.arange(math.prod(shape)).reshape(shape)[(slice(None, None, stride),) * len(shape)]
        assert {*order[:count]} == {*grid.ravel()}
    last = order[counts[-2] :] / math.prod(shape)
    assert abs(last[: len(last) // 2].mean() - 0.5) < 0.1, "the first half is everywhere"


@pytest.mark.jit
@pytest.mark.parametrize(
    "more", [{}, {"eps": 2e-4, "method": "fixed"}, {"mode": "map", "columns": 20, "rows": 10, "at": 3.0}]
)
def test_saved_page_contains_its_motions_needs_nothing_else_and_fits_into_a_mail(more, monkeypatch):
    view = View.read({"low": 3.0, "high": 3.25, "at": 3.04, "periods": 64, **more})
    session = session_of(told := [])
    list(work_of(session, view.sized(300, 200)).levels(Pace(), Halt()))
    save(session, view, Halt())
    page = told[0]["saved"]
    assert len(page.encode()) <= 2_000_000
    assert re.findall(r"(?:src|href)=.?https?:|@import|type=.module", page) == []
    known = json.loads(re.search(r'id="known">(.*?)</script>', page, re.DOTALL)[1])
    (picture, _), *motions = messages(known["stored"])
    first, *places = known["places"]
    assert (picture["complete"], first) == (True, view.at)
    assert len(motions) == len(known["places"]) == len({*known["places"]}) == (31 if "at" in more else 32)
    assert np.diff(places) == pytest.approx(0.25 / 30, rel=0.1)
    for at, (head, arrays) in list(zip(known["places"], motions, strict=True))[::9]:
        plan = replace(view, at=at).motion_plan()
        exact = curve_of(
            follow(replace(plan, settings=replace(plan.settings, periods=round(float(arrays["time"][-1])))))
        )
        assert head["period"] == words(plan, view, Halt())["period"]
        for name in ("time", "xi", "dxi"):
            largest = float(np.nanmax(np.abs(exact[name])))
            assert arrays[name] == pytest.approx(exact[name], abs=1e-4 * largest, nan_ok=True)
    monkeypatch.setattr("vibrodrive.explorer.tasks.LARGEST_PAGE", len(page.encode()) - 1)
    save(session, view, Halt())
    fewer = json.loads(re.search(r'id="known">(.*?)</script>', told[1]["saved"], re.DOTALL)[1])
    assert fewer["places"] == known["places"][::2]
    assert len(messages(fewer["stored"])) == 1 + len(fewer["places"])
