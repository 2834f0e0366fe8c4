"""Tests of the limit k₂ (the disturbance at which a motion loses its structure): known results, orbits of the paper."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vibrodrive as vd
from vibrodrive.jit.slices import Halt
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.reasons import How
from vibrodrive.model.spacing import geometric
from vibrodrive.stability import evaluate, structure
from vibrodrive.stability import limit as limits
from vibrodrive.stability.evaluate import Motion
from vibrodrive.stability.limit import LimitSearch, _Problem, limit, plan_limits
from vibrodrive.stability.limit_search import BEYOND, GRIDS, search_band, share_kept
from vibrodrive.stability.main_impacts import never_follows


def find(kind, kept, ahead=1):
    """Return the Band that a search in `kind` (eps or dtau) finds. kept(value): True if the structure is kept.

    The search requests `ahead` values in advance. The motions beside the loss must be those at the ends of the Band.
    """
    problem = _Problem(0, None, search_band(GRIDS[kind], lambda: ahead))
    problem.begin()
    band = None
    while band is None:
        motions = [SimpleNamespace(keeps=lambda *_, x=x: kept(x), copy=lambda x=x: x) for x in problem.requested]
        band = problem.go_on(list(map(problem.take, motions)))
    assert problem.lost == (band.lost, band.lost if math.isfinite(band.lost) else None)
    assert problem.kept == (band.kept_below, band.kept_below or None)
    return band


@given(threshold=st.floats(1e-7, 0.4))
def test_clean_loss_is_bracketed(threshold):
    for kind in GRIDS:
        band = find(kind, lambda x: x < threshold)
        assert band.kept_below < threshold <= band.lost
        assert band.lost / band.kept_below < 1.15 ** (1 / 60)
        assert band.last_kept == band.kept_below
        assert band.share_kept == 0.0
        assert band.searched_to >= BEYOND * band.lost


def plain_band(grid, kept):
    """Return the band of a criterion, computed from its definition, one value after the other."""
    first = 0
    while not kept(grid.value(first)):
        if grid.value(first) <= grid.floor:
            return grid.value(first), 0.0, 0.0, 0.0, grid.value(first)
        first -= 2 * grid.decade
    top, loss, last = first, None, first
    while grid.value(top + 1) <= grid.top and (loss is None or grid.value(top) <= BEYOND * grid.value(max(last, loss))):
        for k in [k for k in range(top + 1, top + 1 + grid.batch) if grid.value(k) <= grid.top]:
            top = k
            if not kept(grid.value(k)):
                loss = k if loss is None else loss
            elif kept(grid.value(k - 1)):
                last = k
    if loss is None:
        return math.inf, grid.value(top), grid.value(top), 0.0, grid.value(top)
    low, high = grid.value(loss - 1), grid.value(loss)
    for _ in range(2):
        inner = [low, *geometric(low, high, 9)[1:-1].tolist(), high]
        at = next((k for k in range(1, 8) if not kept(inner[k])), 8)
        low, high = inner[at - 1], inner[at]
    share = np.mean([kept(grid.value(k)) for k in range(loss, last + 1)]) if last >= loss else 0.0
    return high, low, grid.value(last) if last >= loss else low, share, grid.value(top)


@given(st.integers(-70, 80), st.sets(st.integers(-70, 110)), st.sampled_from(sorted(GRIDS)), st.integers(1, 40))
def test_values_requested_in_advance_do_not_change_the_band(edge, odd, kind, ahead):
    grid = GRIDS[kind]
    exceptions = {grid.value(k) for k in odd}

    def kept(value):
        return (value < grid.value(edge)) != (value in exceptions)

    assert find(kind, kept, ahead)[:5] == plain_band(grid, kept)


def test_isolated_losses_make_a_band_with_two_ends():
    lost = {0.036, 0.039, 0.045}
    band = find("dtau", lambda x: x not in lost and x < 0.051)
    assert band.kept_below < 0.036 == band.lost, "only the value itself is lost"
    assert band.last_kept == 0.05
    assert band.share_kept == pytest.approx(12 / 15)
    assert band.half_kept == 0.049, "of eleven steps around it six are kept, of those around 0.05 five"
    assert [value for value, kept in band.kept_at.items() if not kept and value < 0.051] == sorted(lost)
    band = find("dtau", lambda x: x < 0.03 or x == 0.045)
    assert band.last_kept == band.half_kept == band.kept_below < 0.03, "a single value does not end the band"
    assert band.kept_at[0.045], "the curve has it"


@given(pattern=st.lists(st.booleans(), min_size=1, max_size=60))
def test_share_kept_at_each_value(pattern):
    """Compared with the definition, value by value."""
    shares = [np.mean(([True] * 5 + pattern + [False] * 5)[k : k + 11]) for k in range(len(pattern))]
    assert share_kept(dict(enumerate(pattern))) == pytest.approx(shares)


def test_values_tried_are_round_or_close_enough():
    assert [GRIDS["dtau"].value(k) for k in (-1, 0, 1, 90, 130, 180)] == [0.00099, 0.001, 0.0011, 0.01, 0.05, 0.1]
    for grid in GRIDS.values():
        values = np.array([grid.value(k) for k in range(-200, 100)])
        ratio = values[1:] / values[:-1]
        assert ratio.min() > 1.0
        assert ratio.max() < 1.1501


def test_structure_never_lost_has_no_limit_and_one_never_kept_the_limit_zero():
    band = find("dtau", lambda x: True)
    assert band.lost == math.inf
    assert 6 < band.last_kept < 2 * math.pi
    band = find("eps", lambda x: False)
    assert band.kept_below == band.last_kept == 0.0
    assert band.lost <= 1e-12


@pytest.mark.jit
def test_limit_below_the_smallest_value_is_reported(monkeypatch):
    monkeypatch.setattr(Motion, "keeps", lambda *arguments: False)
    k = limit(1.5, "eps", transient=20, periods=20)
    assert (k.kept_below, k.kept) == (0.0, None)
    assert k.how.startswith("k2 is below the smallest value tried: ")


@pytest.mark.parametrize(
    ("usual", "now", "code", "said"),
    [
        ([2], [1, 2], How.GAPS, "gaps 2 became 1, 2"),
        ([1, 2, 2], [1, 2], How.GAPS_IN_ANOTHER_ORDER, "gaps 1, 2, 2 became 1, 2 in another order"),
        ([2], [2], How.FEWER_IMPACTS, "gaps 2 became 2, of fewer impacts"),
    ],
)
def test_change_of_gaps_is_described(usual, now, code, said, monkeypatch):
    monkeypatch.setattr(evaluate, "fastest", lambda cycle, impacts, periods: impacts)
    monkeypatch.setattr(evaluate, "impact_gaps", lambda impacts: impacts)
    base = SimpleNamespace(cycle=SimpleNamespace(gaps=np.array(usual)))
    motion = SimpleNamespace(complete=True, impacts=now, section=())
    lost = structure.Structure(2, False, False, True, 0.0, 0)
    assert evaluate.explain_loss(base, motion, lost) == (code, said)


@pytest.mark.jit
@pytest.mark.parametrize(
    ("A", "periods", "n", "how"),
    [
        (2.8416, 1500, 2, "gaps 2 became 1, 2"),  # impacts are added, and the gaps of the other impacts stay the same
        (3.04, 1500, 2, "gaps 2 became 1, 2"),
        (3.16, 500, 6, "gaps 1, 1, 2, 2 became 1, 2 in another order"),  # from the rotation that sorts first
    ],
)
def test_how_describes_the_loss(A, periods, n, how):
    k = limit(A, "eps", transient=500, periods=periods)
    assert (k.how, k.n, k.last_kept) == (how, n, k.kept_below), "all values above k2 are lost"
    assert (k.kept.impacts, k.kept.gaps, k.lost.impacts) == (True, True, False)


@pytest.mark.jit
def test_first_subharmonic_on_a_fixed_grid():
    k = limit(3.04, "dtau", "fixed")
    assert 0.045 <= k.k2 <= 0.046
    assert 0.05 <= k.last_kept <= 0.055
    assert 0 < k.share_kept < 1, "the structure is lost at isolated values first"
    assert k.searched_to > 0.1


@pytest.mark.jit
def test_sensitivity_grows_with_the_order_of_the_subharmonic():
    A = [2.5, 3.04, 3.1, 3.17]
    for kind in ("eps", "dtau"):
        found = dict(LimitSearch(plan_limits({"A": A, "transient": 600, "periods": 400}, kind)).run())
        assert [found[i].n for i in range(4)] == [1, 2, 4, 10]
        k2 = [found[i].k2 for i in range(4)]
        assert k2 == sorted(k2, reverse=True)


@pytest.mark.jit
def test_too_short_record_is_reported_for_its_point():
    """The third point has no periodic orbit. `vd.limit` raises the sentence."""
    found = dict(LimitSearch(plan_limits({"A": [1.5, 3.1, 3.05711], "transient": 50, "periods": 14}), threads=1).run())
    assert [found[k].n for k in range(3)] == [1, 4, 0]
    assert found[0].k2 > 1e-4
    assert math.isnan(found[1].k2)
    assert math.isnan(found[2].k2)
    assert "no period" in found[2].how
    told = "periods = 14: must be >= 16 (4 times the period of the undisturbed motion at A = 3.1)"
    assert found[1].how == told
    with pytest.raises(ValueError, match=f"^{re.escape(told)}$"):
        limit(3.1, transient=50, periods=14)
    assert limit(3.1, transient=50, periods=16).k2 > 0


@pytest.mark.jit
@pytest.mark.parametrize("disturbance", GRIDS)
def test_brief_records_change_no_result(disturbance, monkeypatch):
    """Only many searches use brief records. Here two searches use them, too."""
    plan = plan_limits({"A": [2.95, 3.1], "transient": 50, "periods": 3 * limits.BRIEF_PERIODS}, disturbance)
    whole, proofs = dict(LimitSearch(plan).run()), []
    monkeypatch.setattr(limits, "TOGETHER", 0)
    monkeypatch.setattr(limits, "never_follows", lambda *of: proofs.append(never_follows(*of)) or proofs[-1])
    assert dict(LimitSearch(plan).run()) == whole
    assert any(proofs)


@pytest.mark.parametrize(
    ("motions", "transient", "periods", "saves"),
    [(64, 0, 480, True), (63, 0, 480, False), (64, 0, 479, False), (64, 1000, 1320, True), (64, 1000, 1319, False)],
)
def test_brief_records_are_for_many_long_motions(motions, transient, periods, saves):
    """A brief record of 160 periods proves a loss in 480, and takes half the time of 1000 + 1320 periods."""
    plan = plan_limits({"A": [2.0], "transient": transient, "periods": periods})
    assert LimitSearch(plan)._saves_time(motions) == saves


@pytest.mark.parametrize(("points", "most_sweeps", "most_motions"), [(1, 8, 70), (300, 80, 20_500)])
def test_searches_need_few_sweeps_and_few_motions(points, most_sweeps, most_motions, monkeypatch):
    """A search that requests one value at a time takes 18 sweeps and 58 motions."""
    sweeps = []

    def answers(self, requests, ask, *_, **periods):
        sweeps.append([len(values) for _, _, values in requests])
        kept = [(p, x, x < 1e-4 * 1.01**k) for k, p, values in requests for x in values.tolist()]
        found = iter([ask(p, SimpleNamespace(keeps=lambda *_, now=now: now, copy=lambda x=x: x)) for p, x, now in kept])
        return [[next(found) for _ in values] for *_, values in requests]

    orbit = SimpleNamespace(n=1, cycle=None)
    monkeypatch.setattr(evaluate.Evaluator, "undisturbed", lambda self, numbers: [orbit] * len(numbers))
    monkeypatch.setattr(evaluate.Evaluator, "answers", answers)
    monkeypatch.setattr(LimitSearch, "_explained", lambda self, problem, band: band)
    found = list(LimitSearch(plan_limits({"A": np.linspace(2, 3, points), "transient": 50, "periods": 500})).run())
    assert len(found) == points
    assert len(sweeps) <= most_sweeps
    assert sum(map(sum, sweeps)) <= most_motions
    assert max(map(len, sweeps)) <= 128, "the records of so many searches are in memory"


def test_motions_computed_together_take_about_50_megabytes(monkeypatch):
    plan, sizes = plan_limits({"A": [2.0], "transient": 0, "periods": 1500}), []

    def computed(self, points, settings):
        sizes.append(len(points) * settings.periods * (2 + 2 * 4) * 8)  # section points, and two impacts in a period
        return np.empty((len(points), 0, 2)), np.empty((len(points), 0, 4))

    monkeypatch.setattr(evaluate.Evaluator, "_computed", computed)
    with evaluate.Evaluator(plan, "eps", 1, Halt()) as evaluator:
        assert len(list(evaluator._motions(np.zeros((2000, len(COLUMNS))), plan.settings))) == 2000
    assert 25e6 < max(sizes) < 51e6
    assert sum(sizes) == 2000 * 120_000


@pytest.mark.jit
@pytest.mark.integration
def test_limit_of_a_scene_is_that_of_its_A_and_B_and_has_a_velocity_in_si_units():
    scene = vd.Scene(a0=0.8e-3, frequency=20.0, mu=0.6, alpha=3.4)
    k = vd.limit(scene=scene, transient=50, periods=50)
    assert replace(k, scene=None, kept=None, lost=None) == replace(
        vd.limit(scene.A, B=scene.B, transient=50, periods=50), kept=None, lost=None
    )
    assert repr(k).startswith(f"<Limit k2 = {k.k2:.6g} (")
    assert k.velocity_si == pytest.approx(k.k2 * vd.ETA * 0.8e-3 * 2.0 * math.pi * 20.0, rel=1e-12)
    assert f"({1e3 * k.velocity_si:.4g} mm/s)" in repr(k)
    assert math.isnan(replace(k, scene=None).velocity_si)
