"""The limit k₂: the search against verdicts whose answer is known, then the paper's own orbits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibrodrive import structure
from vibrodrive.limits import limit, limits
from vibrodrive.limits_search import BEYOND, GRIDS, search
from vibrodrive.trajectory import simulate


def find(kind, kept):
    """Run a search against a function that says what is kept."""
    asking = search(GRIDS[kind])
    asked = next(asking)
    while True:
        try:
            asked = asking.send(np.array([kept(x) for x in asked]))
        except StopIteration as end:
            return end.value


@given(threshold=st.floats(1e-7, 0.4))
def test_a_clean_loss_is_bracketed(threshold):
    for kind in GRIDS:
        band = find(kind, lambda x: x < threshold)
        assert band.kept_below < threshold <= band.k2
        assert band.k2 / band.kept_below < 1.15 ** (1 / 60)
        assert band.last_kept == band.kept_below
        assert band.share_kept == 0.0
        assert band.searched_to >= BEYOND * band.k2


def test_isolated_losses_make_a_band_with_two_ends():
    lost = {0.036, 0.039, 0.045}
    band = find("dtau", lambda x: x not in lost and x < 0.051)
    assert band.kept_below < 0.036 == band.k2, "only the value itself is lost"
    assert band.last_kept == 0.05
    assert band.share_kept == pytest.approx(12 / 15)


def test_a_single_value_kept_among_losses_is_no_end():
    band = find("dtau", lambda x: x < 0.03 or x == 0.045)
    assert band.last_kept == band.kept_below < 0.03


def test_the_values_tried_are_close_enough_together():
    for grid in GRIDS.values():
        values = np.array([grid.value(k) for k in range(-200, 100)])
        ratio = values[1:] / values[:-1]
        assert ratio.min() > 1.0
        assert ratio.max() < 1.1501


def test_steps_tried_are_those_one_would_choose():
    assert [GRIDS["dtau"].value(k) for k in (-1, 0, 1, 90, 130, 180)] == [
        0.00099,
        0.001,
        0.0011,
        0.01,
        0.05,
        0.1,
    ]


def test_what_is_never_lost_has_no_limit():
    band = find("dtau", lambda x: True)
    assert band.k2 == math.inf
    assert 6 < band.last_kept < 2 * math.pi


def test_what_is_never_kept_has_the_limit_zero():
    band = find("eps", lambda x: False)
    assert band.kept_below == band.last_kept == 0.0
    assert band.k2 <= 1e-12


@pytest.mark.jit
def test_first_subharmonic_in_epsilon():
    k = limit(3.04, "eps")
    assert k.n == 2
    assert 1.53e-4 <= k.kept_below < k.k2 <= 1.77e-4
    assert k.last_kept == k.kept_below, "a loss in ε is clean"
    assert k.kept.order
    assert k.kept.gaps
    assert not (k.lost.order and k.lost.gaps)
    assert k.how


@pytest.mark.jit
def test_first_subharmonic_on_a_fixed_grid():
    k = limit(3.04, "dtau", "fixed")
    assert 0.035 <= k.k2 <= 0.04
    assert 0.05 <= k.last_kept <= 0.055
    assert 0.5 < k.share_kept < 1, "lost at isolated values first"
    assert k.searched_to > 0.1


@pytest.mark.jit
@pytest.mark.slow
def test_both_sides_of_a_limit_judged_again_by_whole_trajectories():
    for A, kind, method in ((3.04, "eps", "certified"), (3.1, "dtau", "fixed"), (2.65, "dtau", "muller")):
        k = limit(A, kind, method, periods=600)
        exact = structure.orbit(simulate(A=A, periods=128))
        for value, told in ((k.kept_below, k.kept), (k.k2, k.lost)):
            again = structure.compare(exact, simulate(A=A, method=method, **{kind: value}, periods=600))
            assert again.rho == pytest.approx(told.rho, rel=1e-9, abs=1e-9)
            assert replace(again, rho=told.rho) == told
        assert k.kept.kept(("order", "gaps"))
        assert not k.lost.kept(("order", "gaps"))


@pytest.mark.jit
def test_the_word_of_the_simplest_motion_is_lost_between_065_and_07():
    k = limit(1.5, "dtau", "fixed", "word", transient=999, periods=100)
    assert 0.65 < k.k2 <= 0.7
    assert k.lost.order, "its coarse motion outlives the word"
    assert k.lost.gaps


@pytest.mark.jit
def test_sensitivity_grows_with_the_order_of_the_subharmonic():
    A = [2.5, 3.04, 3.1, 3.17]
    for kind in ("eps", "dtau"):
        found = {k: v for k, v in limits(A, kind, transient=600, periods=400)}
        assert [found[i].n for i in range(4)] == [1, 2, 4, 10]
        k2 = [found[i].k2 for i in range(4)]
        assert k2 == sorted(k2, reverse=True)


@pytest.mark.jit
def test_many_abreast_find_what_one_finds_alone():
    A = [2.5, 2.8, 3.04]
    together = dict(limits(A, "dtau", "fixed", transient=200, periods=100, threads=2))
    for i, a in enumerate(A):
        assert limit(a, "dtau", "fixed", transient=200, periods=100, threads=1) == together[i]


@pytest.mark.jit
def test_an_irregular_motion_has_nothing_to_lose():
    k = limit(3.04, "eps", transient=0, periods=10, xi0=500.0)
    assert k.n == 0
    assert math.isnan(k.k2)
    assert "no period" in k.how


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"A": [3.0, 3.1]}, "A"),
        ({"A": -1.0}, r"A\[0\]"),
        ({"A": 3.04, "disturbance": "B"}, "disturbance"),
        ({"A": 3.04, "method": "newton"}, "method"),
        ({"A": 3.04, "disturbance": "dtau", "method": "certified"}, "method"),
        ({"A": 3.04, "criterion": "shape"}, "criterion"),
        ({"A": 3.04, "criterion": 3}, "criterion"),
        ({"A": 3.04, "periods": 0}, "periods"),
        ({"A": 3.04, "B": [0.1, 0.2]}, "axes"),
        ({"A": 3.04, "threads": 0}, "threads"),
    ],
)
def test_bad_input_is_named_in_one_sentence(arguments, key):
    with pytest.raises((TypeError, ValueError), match=f"^{key} = .*: must be ") as caught:
        limit(**arguments)
    assert "\n" not in str(caught.value)
