"""Tests of k_u, the disturbance at which all starts end in one motion: Figs. 11 and 12, and naive loops."""

import math

import numpy as np
import pytest

from tests.support import naive
from vibrodrive.stability.limit_search import BEYOND
from vibrodrive.stability.questions import unique_limit
from vibrodrive.stability.unique_motion import (
    SIDES,
    each_unique_limit,
    is_unique,
    lattice,
    sufficient_starts,
    unique_from,
)

pytestmark = pytest.mark.jit

SHORT = {"A": 3.04, "transient": 200, "periods": 100}


def test_all_solutions_are_reached_from_few_starts():
    for A, n in ((1.5, 1), (2.75, 2), (3.04, 2), (3.1, 4), (3.25, 3)):
        found, reached, (xi0, dxi0) = sufficient_starts({"A": A})
        assert (found, reached) == (n, n)
        assert len(xi0) == len(dxi0) <= SIDES[1]
    assert sufficient_starts({"A": 0.5})[:2] == (0, 0)


def test_starts_are_valid():
    for side in SIDES:
        xi0, dxi0 = lattice(3.0, side)
        assert xi0[0] == 0.0
        assert (dxi0 == -dxi0[::-1]).all()
        assert 0.0 in dxi0


def test_large_step_leaves_one_motion_and_a_small_one_two():
    """At Δτ = 0.1 there is one motion (Fig. 11). The two solutions merge between Δτ = 0.05 and 0.063."""
    assert is_unique({"A": 3.04}, "dtau", [0.01, 0.05, 0.063, 0.1]).tolist() == [False, False, True, True]


def test_no_disturbance_leaves_all_solutions():
    assert is_unique(SHORT, "eps", [0.0, 1e-6]).tolist() == [False, False]
    assert is_unique(SHORT | {"A": 1.5}, "eps", [0.0, 1e-6]).tolist() == [True, True]


@pytest.mark.parametrize(("dtau", "one"), [(0.04, False), (0.1, True)])
def test_unique_motion_agrees_with_naive_loops(dtau, one):
    """Compare the last section points of motions from three starts with loops that evaluate every grid point."""
    periods = 120
    starts = [(0.0, 0.0), (1.5, 0.0), (3.0, 1.5)]
    ends = [naive.fixed(3.04, xi0=x, dxi0=v, dtau=dtau, periods=periods).section[-16:] for x, v in starts]
    assert (np.ptp(ends, axis=0).max() == 0.0) == one
    point = {"A": 3.04, "transient": periods - 16, "periods": 16}
    lattice_of_three = np.array([0.0, 1.5, 3.0]), np.array([0.0, 1.5])
    assert is_unique(point, "dtau", [dtau], lattice_of_three).tolist() == [one]


def test_only_a_fixed_grid_allows_no_difference():
    """Two motions without impacts keep their distance of 1e-7. With `fixed`, motions are one only if bitwise equal."""
    starts = np.array([100.0, 100.0 + 1e-7]), np.array([0.0])
    short = {"A": 1.5, "transient": 0, "periods": 3}
    assert is_unique(short, "dtau", [0.1], starts).tolist() == [False]
    assert is_unique(short | {"method": "muller"}, "dtau", [0.1], starts).tolist() == [True]
    assert is_unique(short, "eps", [1e-4], starts).tolist() == [True]


def test_band_in_which_the_motion_becomes_unique():
    band = unique_from({"A": 3.04}, "eps")
    assert 1e-4 < band.kept_below < band.lost < 3e-4
    assert band.searched_to >= BEYOND * band.lost
    below, above = is_unique({"A": 3.04}, "eps", [band.kept_below, band.lost])
    assert (below, above) == (False, True)


def test_unique_limit_needs_several_solutions():
    one = unique_limit(1.5)
    assert (one.ku, one.n, one.how) == (0.0, 1, "there is one solution only")
    with pytest.warns(UserWarning, match="the mass cannot leave"):
        assert math.isnan(unique_limit(0.5, "dtau").ku)


def test_unique_limit_has_the_band_of_its_point_and_a_repr():
    some = {"transient": 50, "periods": 64}
    k = unique_limit(3.04, **some)
    assert (k.ku, k.several_below, k.last_several, k.share_several, k.searched_to) == unique_from(
        {"A": 3.04, **some}, "eps"
    )
    assert k.velocity == pytest.approx(k.ku * k.eta * 3.04, rel=1e-15)
    assert repr(k).startswith(f"<UniqueLimit ku = {k.ku:.6g} in eps at A = 3.04, B = 0.1: all starts end in one motion")
    ((_, again),) = each_unique_limit({"A": 3.04, **some}, "eps")
    assert again == k


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match="disturbance = 'tau': must be one of eps, dtau"):
        unique_from({"A": 3.04}, "tau")
    with pytest.raises(TypeError, match="disturbance = None: must be"):
        is_unique({"A": 3.04}, None, [0.1])
    with pytest.raises(ValueError, match=r"dtau\[0\] = 0.0: must be a number >= 1e-12"):
        is_unique({"A": 3.04}, "dtau", [0.0])
    with pytest.raises(ValueError, match="periods = 0: must be"):
        is_unique({"A": 3.04, "periods": 0}, "dtau", [0.1])
    with pytest.raises(ValueError, match="method = 'certified': must be fixed or muller"):
        unique_limit(3.04, "dtau", "certified")
    with pytest.raises(TypeError, match=r"^A = array of length 2: must be one number$"):
        unique_limit([3.0, 3.04])
    with pytest.raises(TypeError, match=r"^eps = 0.0001: must be left out"):
        unique_limit(3.04, eps=1e-4)
