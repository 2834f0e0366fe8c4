"""Limits for all times: attacks on proved intervals, and motions of the engine inside what the proof encloses."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.figures.texts import conditions_of
from vibrodrive.jit.slices import Halt
from vibrodrive.stability import always
from vibrodrive.stability.limit_search import GRIDS, search_band
from vibrodrive.stability.main_impacts import follow_cycle
from vibrodrive.stability.structure import reference_orbit
from vibrodrive.store.describe import acting, comment

TWO_PI = 2.0 * math.pi

POINTS = [
    pytest.param({"A": 1.9, "eta": 5.3}, 0.9, id="n = 1, low eta"),
    pytest.param({"A": 2.2, "B": 0.3, "eta": 37.3}, 0.9, id="n = 1"),
    pytest.param({"A": 2.75, "eta": 10.618}, 0.5, id="n = 2"),
    pytest.param({"A": 2.9, "eta": 20.2}, 0.8, id="fraction"),
    pytest.param({"A": 3.0, "eta": 30.25}, 0.5, id="fraction, lost from other starts"),
    pytest.param({"A": 3.0, "eta": 30.25 + 1e-9}, 0.5, id="beside a fraction"),
    pytest.param({"A": 3.0, "eta": 33.33333333}, 0.5, id="a fraction as one types it"),
    pytest.param({"A": 4.2, "B": 0.4, "eta": 17.3}, 0.8, id="two main impacts"),
    pytest.param({"A": 3.5289, "B": 0.3104, "eta": 11.6}, 0.4, id="proved for every disturbance"),
]

SLOW = [
    {"A": 2.75},
    {"A": 3.04},
    {"A": 2.62},
    {"A": 3.0576},
    {"A": 3.3608783028901414, "B": 0.4},
]


def cycle_of(A, B=0.1, eta=vd.ETA):
    return reference_orbit(vd.simulate(A, B=B, eta=eta, transient=20_000, periods=256)).cycle


def prove(point):
    point = {"B": 0.1, "eta": vd.ETA, **point}
    return always.find_always(**point, cycle=cycle_of(**point))


def lost(point, found, count, periods):
    """Return motions from drawn starts, phases and amplitudes, and from the ends of intervals, that are lost."""
    rng, cycle, motions = np.random.default_rng(3), cycle_of(**point), []
    for number in range(count):
        low, high = found.starts[rng.integers(len(found.starts))]
        tau0 = (low + (high - low) * (0.0, 1.0, rng.random())[number % 3]) % TWO_PI + TWO_PI * rng.integers(5000)
        eps = found.k2 * (1.0, 0.3, 0.0, rng.random())[number % 4]
        motion = vd.simulate(**point, eps=eps, tau0=float(tau0), transient=0, periods=periods)
        if follow_cycle(cycle, motion.impacts, periods) is None:
            motions.append((tau0, eps))
    return motions


@pytest.mark.jit
@pytest.mark.parametrize(("point", "share"), POINTS)
def test_nothing_is_lost_from_proved_starts_up_to_the_proved_amplitude(point, share):
    found = prove(point)
    assert (found.kind, found.k2 > share * vd.limit(**point).k2) == ("proved", True)
    assert all((phase - first) % TWO_PI < last - first for phase, (first, last) in zip(
        cycle_of(**point).phase, ((first - 1e-9, last + 1e-9) for first, last in found.starts), strict=True
    ))  # fmt: skip
    assert lost(point, found, 24, 1000) == []


@pytest.mark.jit
@pytest.mark.slow("2 min: the paper's η")
@pytest.mark.release
@pytest.mark.parametrize("point", SLOW)
def test_nothing_is_lost_at_the_eta_of_the_paper(point):
    found = prove(point)
    assert not found.k2 > vd.limit(**point, periods=20_000).k2
    assert (found.kind == "proved") == (not math.isnan(found.k2)) == (len(found.starts) > 0)
    assert not found.starts or lost(point, found, 24, 10_000) == []


@pytest.mark.jit
@pytest.mark.parametrize(
    ("point", "eps"),
    [({"A": 1.9, "eta": 5.317}, 0.02), ({"A": 2.75}, 8e-4), ({"A": 4.2, "B": 0.4, "eta": 17.3}, 1e-4)],
)
@pytest.mark.parametrize("b", [0.0, 0.02])
def test_arrivals_enclose_those_of_drawn_motions_of_a_cell(point, eps, b):
    """For drawn starts, phases and amplitudes of a cell, by single motions of the engine."""
    point, rng = {"B": 0.1, "eta": vd.ETA, **point}, np.random.default_rng(5)
    cycle = cycle_of(**point)
    motions, band = always._Motions(**point, cycle=cycle, halt=Halt()), (eps * (1.0 - 0.1 * b), eps)
    inside = np.tile((-0.02, 0.03), (len(cycle.gaps), 1))
    for turn in rng.integers(1, 10_000, size=20).tolist():
        psi = point["eta"] * TWO_PI * turn + rng.uniform(-b, b)
        for k, gap in enumerate(cycle.gaps):
            first, last = motions._image(k, band, (psi % TWO_PI, b), inside, always.AROUND)
            start = {"eps": rng.uniform(*band), "tau0": cycle.phase[k] + rng.uniform(*inside[k]) + TWO_PI * turn}
            impacts = vd.simulate(**point, **start, transient=0, periods=int(gap) + 2).impacts
            later = TWO_PI * (impacts["period"] - turn) + impacts["phase"] - motions.due[k]
            arrives = (np.abs(later) < always.AROUND) & (impacts["speed"] > motions._touch)
            assert first - 1e-9 <= later[arrives][0] <= last + 1e-9


@pytest.mark.jit
def test_no_proof_is_no_number(monkeypatch):
    monkeypatch.setattr(always, "BUDGET", 1e5)
    every = prove({"A": 2.6045})
    assert every.k2 == vd.limit(2.6045, periods=300, transient=20_000).velocity_any / (2.0 * 2.6045 * vd.ETA)
    monkeypatch.setattr(always, "find_tolerated", lambda *_: SimpleNamespace(velocity=math.nan))
    found = prove({"A": 2.6045})
    assert (math.isnan(found.k2), found.kind, found.starts, found.how != "") == (True, "", (), True)
    assert math.isnan(found.starts_width)


@pytest.mark.jit
def test_record_has_the_numbers_of_limits_and_names_eta(tmp_path):
    short, eta = {"transient": 50, "periods": 50}, [5.3, 7.1]
    r = vd.sweep(A=[1.9], eta=eta, record="always", path=tmp_path / "x.h5", **short)
    assert r.k2_always.tolist() == [[vd.limit(1.9, eta=each, **short).k2_always for each in eta]]
    said = conditions_of(r.select(eta=7.1))
    assert said[:3] == ["$B = 0.1$", r"$\eta = 7.1$", "certified"], "and not ε = 0"
    assert "eps" not in acting(r.plan)
    assert "what is proved of it" in comment(r.plan)


@pytest.mark.jit
def test_limit_has_it_for_epsilon_certified_impacts_only():
    short = {"eta": 5.3, "transient": 50, "periods": 50}
    k = vd.limit(1.9, **short)
    assert 0.9 * k.k2 < k.k2_always == k.always.k2 < k.k2
    assert k.starts_width == k.always.starts[0][1] - k.always.starts[0][0]
    others = {"disturbance": "dtau"}, {"method": "fixed", "dtau": 1e-3}
    for other in others:
        none = vd.limit(1.9, **short, **other)
        assert none.always is None
        assert math.isnan(none.k2_always)
        assert math.isnan(none.starts_width)
    low = vd.limit(1.05, **short)
    assert (low.always.kind, math.isnan(low.k2_always), low.always.how) == ("", True, "there are no impacts")


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
