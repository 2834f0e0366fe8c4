"""Limits of the paper that are functions of a motion: k₁ (starts), k_u (one motion), ϱ (orbit as a curve); grids."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import vibrodrive as vd
from benchmarks.paper.grids import closing, convergents
from benchmarks.paper.limits import band_of_motions
from benchmarks.paper.orbit_curve import curve_distance, orbit_curve
from benchmarks.paper.starts import EXACT, find_edge, start_limit
from benchmarks.paper.unique_motion import is_unique
from tests.exact.reference import IMPACT, reference
from tests.support import naive
from vibrodrive.stability.structure import compare_structure, reference_orbit

jit = pytest.mark.jit


@given(edge=st.floats(1e-11, 5.9), bit=st.sampled_from([0.0, 1e-15]))
def test_clean_edge_is_found_to_the_last_bits(edge, bit):
    found = find_edge(lambda d: d < edge, 6.0, bit)
    assert found.kept < edge <= found.lost
    assert found.lost - found.kept <= max(1.001 * EXACT * edge, bit)


@jit
def test_both_sides_of_an_edge_agree_with_fifty_digits():
    """The motions have 50 digits. At A = 3.04 main impacts of the two solutions are in even and in odd periods."""
    edge = start_limit(3.04, "xi0")[1].lost

    def lands_in(deviation):
        rows = reference(3.04, xi0=deviation, periods=34).switches
        whole = [math.floor(float(row.tau) / (2 * math.pi)) for row in rows if row.after == IMPACT][-4:]
        assert np.diff(whole).tolist() == [2, 2, 2], "the motion must have settled"
        return whole[-1] % 2

    here = lands_in(0.0)
    assert [lands_in(share * edge) == here for share in (0.3, 0.7, 1 - 1e-8)] == [True] * 3
    assert lands_in(edge * (1 + 1e-8)) != here


@jit
@pytest.mark.parametrize(("dtau", "one"), [(0.04, False), (0.1, True)])
def test_unique_motion_agrees_with_naive_loops(dtau, one):
    """Compare the last section points of motions from three starts with loops that evaluate every grid point."""
    starts = [(0.0, 0.0), (1.5, 0.0), (3.0, 1.5)]
    ends = [naive.fixed(3.04, xi0=x, dxi0=v, dtau=dtau, periods=120).section[-16:] for x, v in starts]
    assert (np.ptp(ends, axis=0).max() == 0.0) == one
    point = {"A": 3.04, "transient": 104, "periods": 16}
    assert is_unique(point, "dtau", [dtau], (np.array([0.0, 1.5, 3.0]), np.array([0.0, 1.5]))).tolist() == [one]


@jit
@pytest.mark.parametrize("disturbance", ["eps", "dtau"])
def test_band_of_a_function_of_a_motion_is_that_of_vd_limit(disturbance):
    """With the criterion "impacts" as a function, the search finds the same band in every bit.

    `vd.limit` tries no values in ε far below its limit for all times: all of them are kept.
    """
    point = {"A": 3.04, "transient": 100, "periods": 60}
    base = reference_orbit(vd.simulate(3.04, transient=20_000, periods=256))
    method = {"method": "fixed"} if disturbance == "dtau" else {}
    band = band_of_motions(disturbance, lambda motion: compare_structure(base, motion).impacts, **point, **method)
    k = vd.limit(**point, disturbance=disturbance)
    assert band[:-1] == (k.k2, k.kept_below, k.last_kept, k.share_kept, k.searched_to, k.half_kept)
    below = {value for value in band.kept_at if value < min(k.kept_at)}
    assert {value: kept for value, kept in band.kept_at.items() if value not in below} == k.kept_at
    assert all(band.kept_at[value] for value in below)
    assert max(below, default=0.0) < 0.8 * k.kept_below


def closed(motion):
    return orbit_curve(motion, reference_orbit(motion).n)


@jit
@pytest.mark.parametrize(
    ("A", "arguments"),
    [(3.04, {"eps": 1e-4}), (3.04, {"method": "fixed", "dtau": 0.05}), (3.25, {"eps": 1e-3}), (1.5, {"eps": 5e-4})],
)
def test_distance_equals_a_naive_search(A, arguments):
    motion = vd.simulate(A, **arguments, transient=100, periods=6)
    curve = closed(vd.simulate(A, transient=2000, periods=128))
    sampled, rows = motion.sample(64), motion.switches
    points = [*zip(sampled.xi, sampled.dxi, strict=True), *zip(rows["xi"], rows["dxi"], strict=True)]
    points += [(0.0 if row["after"] == IMPACT else row["xi"], 0.0) for row in rows]
    along = np.roll(curve.vertices, -1, axis=0) - curve.vertices
    best = 0.0
    for x, v in points:
        away = np.array([x, v]) - curve.vertices
        with np.errstate(invalid="ignore"):
            share = np.nan_to_num(np.clip((away * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1))
        best = max(best, np.linalg.norm(away - share[:, None] * along, axis=1).min())
    assert curve_distance(curve, motion) == pytest.approx(best, rel=1e-12)
    assert curve_distance(curve, motion, enough=0.5 * best) > 0.5 * best


@given(dtau=st.floats(1e-3, 20.0))
def test_convergents_are_the_closest_approximations(dtau):
    miss = closing(dtau, 200)
    for c in convergents(dtau, 200):
        assert c.steps * dtau - c.periods * 2 * math.pi == pytest.approx(c.miss, abs=1e-9)
        if c.periods > 1:
            assert abs(c.miss) == pytest.approx(miss[c.periods - 1], abs=1e-9)
            assert abs(c.miss) <= miss[: c.periods].min() + 1e-9
