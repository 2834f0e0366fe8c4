"""Limits for all times: long motions from any start in the intervals, and flights by single motions."""

import math

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.jit.slices import Halt
from vibrodrive.model.plan import make_plan
from vibrodrive.stability import always
from vibrodrive.stability.limit_search import GRIDS, search_band
from vibrodrive.stability.main_impacts import follow_cycle
from vibrodrive.stability.structure import reference_orbit

ORBITS = [
    pytest.param({"A": 1.9}, id="n = 1, rests"),
    pytest.param({"A": 2.2, "B": 0.3, "eta": 37.3}, id="n = 1, low eta"),
    pytest.param({"A": 2.9}, id="n = 2"),
    pytest.param({"A": 4.2, "B": 0.4}, id="n = 2, two main impacts"),
    pytest.param({"A": 3.12}, id="n = 4, two main impacts"),
    pytest.param({"A": 3.04, "eta": 20.2}, id="rational eta"),
]


def cycle_of(A, B=0.1, eta=vd.ETA):
    return reference_orbit(vd.simulate(A, B=B, transient=20_000, periods=256)).cycle


def find(point):
    plan = make_plan({**point, "periods": 5})
    return always.find_always(plan.points(0, 1)[0], cycle_of(**point), plan.settings, 1, Halt())


def kept(point, eps, starts, periods):
    """Return whether the motions from impacts at the times `starts` keep the main impacts of the undisturbed orbit."""
    cycle = cycle_of(**point)
    motions = (vd.simulate(**point, eps=eps, tau0=tau0, transient=0, periods=periods) for tau0 in starts)
    return [follow_cycle(cycle, motion.impacts, periods) is not None for motion in motions]


def starts_of(found, rng, count):
    """Return times of impacts in the intervals, after different numbers of periods."""
    which = rng.integers(len(found.starts), size=count)
    low, high = np.array(found.starts)[which].T
    return (low + (high - low) * rng.random(count)) % (2 * math.pi) + 2 * math.pi * rng.integers(400, size=count)


@pytest.mark.jit
@pytest.mark.parametrize(
    ("count", "periods"),
    [(6, 3000), pytest.param(12, 20_000, marks=[pytest.mark.slow("30 s: 20 000 periods"), pytest.mark.release])],
)
@pytest.mark.parametrize("point", ORBITS)
def test_long_motions_from_all_starts_keep_the_structure(point, count, periods):
    found = find(point)
    assert found.kind == "sampled"
    assert all(kept(point, found.k2, starts_of(found, np.random.default_rng(3), count), periods))


@pytest.mark.jit
@pytest.mark.parametrize("A", [1.35, 2.3])
def test_a_little_above_some_motion_loses_the_structure(A):
    found, rng = find({"A": A}), np.random.default_rng(5)
    assert not all(kept({"A": A}, 1.05 * found.k2, starts_of(found, rng, 8), 3000))


@pytest.mark.jit
def test_more_samples_change_little(monkeypatch):
    few = [find({"A": A}).k2 for A in (1.9, 2.9, 3.5)]
    monkeypatch.setattr(always, "FINE", (always.Samples(30, 240, 1.005),))
    assert few == pytest.approx([find({"A": A}).k2 for A in (1.9, 2.9, 3.5)], rel=0.03)


@pytest.mark.jit
@pytest.mark.parametrize("point", [{"A": 2.9}, {"A": 4.2, "B": 0.4}])
def test_phases_reached_are_those_of_single_motions(point):
    """At a small ε each motion has the impacts of the orbit, so the main impact is the fastest one when it is due."""
    cycle, plan = cycle_of(**point), make_plan({**point, "periods": 5})
    flights = always._Flights(plan.points(0, 1)[0], cycle, plan.settings, 1, Halt())
    inside, eps = np.array([(-0.01, 0.02)] * len(cycle.gaps)), 1e-6
    reached = flights.reached(eps, inside, always.Samples(3, 4, 1.0))
    for k, gap in enumerate(cycle.gaps):
        after, found = (k + 1) % len(cycle.gaps), []
        for away in (-0.01, 0.005, 0.02):
            for later in always.turns(vd.ETA, 4):
                start = (cycle.phase[k] + away) % (2 * math.pi) + 2 * math.pi * later
                impacts = vd.simulate(**point, eps=eps, tau0=start, transient=0, periods=int(gap) + 2).impacts
                times = 2 * math.pi * impacts["period"] + impacts["phase"] - start
                due = np.rint(times / (2 * math.pi)) == gap
                phase = impacts["phase"][due][impacts["speed"][due].argmax()]
                found.append((phase - cycle.phase[after] + math.pi) % (2 * math.pi) - math.pi)
        assert tuple(reached[after]) == pytest.approx((min(found), max(found)), abs=1e-9)


@pytest.mark.parametrize(
    ("eta", "phases"),
    [
        *((eta, 96) for eta in (vd.ETA, 37 * math.sqrt(2), 1e-3, 100.000001, (1 + math.sqrt(5)) / 2)),
        *((p / q, q) for p, q in ((100, 1), (401, 4), (101, 5), (708, 7))),
    ],
)
def test_phases_of_the_disturbance_are_all_that_occur(eta, phases):
    periods = always.turns(eta, 96)
    phase = np.sort(eta * periods % 1.0)
    phase[phase > 1 - 1e-6] -= 1.0
    assert len(np.unique(np.round(phase, 6))) == phases
    assert np.diff(np.sort(phase), append=phase.min() + 1.0).max() < 1.5 / phases
    assert 0 <= periods.min() <= periods.max() <= always.FARTHEST


@pytest.mark.jit
def test_limit_has_it_for_epsilon_certified_impacts_only():
    short = {"transient": 50, "periods": 50}
    k = vd.limit(1.9, **short)
    assert 0.9 * k.k2 < k.k2_always == k.always.k2 < 1.1 * k.k2
    assert k.starts_width == k.always.starts[0][1] - k.always.starts[0][0]
    assert k.always.starts[0][0] <= cycle_of(1.9).phase[0] <= k.always.starts[0][1]
    others = {"disturbance": "dtau"}, {"criterion": "word"}, {"method": "fixed", "dtau": 1e-3}
    for other in others:
        none = vd.limit(1.9, **short, **other)
        assert none.always is None
        assert math.isnan(none.k2_always)
        assert math.isnan(none.starts_width)


@pytest.mark.jit
def test_search_begins_below_a_loss_that_an_interval_of_starts_hides():
    """The start is the end of a sampled interval: at ε = 9e-4 it returns to the orbit, at smaller ε it does not."""
    k = vd.limit(2.75, tau0=6.952201193032453, transient=0, periods=200)
    assert (k.k2 < 1e-12, k.kept_below) == (True, 0.0)


@pytest.mark.unit
@pytest.mark.parametrize("edge", [3e-9, 2e-5, 0.0123])
@pytest.mark.parametrize("share", [1e-3, 0.8, 1.0, 1.5])
def test_beginning_of_a_search_changes_no_limit(edge, share):
    """Also if values are lost below the beginning, which is then too high."""

    def band(begin):
        search, answers = search_band(GRIDS["eps"], begin=begin), None
        while True:
            try:
                answers = search.send(answers) < edge if answers is not None else next(search) < edge
            except StopIteration as end:
                return end.value

    assert band(share * edge)._replace(kept_at={}) == band(0.0)._replace(kept_at={})
