"""Limits of the paper that are functions of a motion: k₁ (starts), k_u (one motion), ϱ (orbit as a curve), and grids.

Searches are tested on functions with a known edge. Edges of the model are compared with motions computed with 50
digits, with unstable orbits and with naive loops, distances with a naive search over all edges of the curve.
"""

import functools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vibrodrive as vd
from benchmarks.paper.grids import closing, convergents, returning
from benchmarks.paper.limits import band_of_motions
from benchmarks.paper.motions import NotApplicable
from benchmarks.paper.orbit_curve import PER_PERIOD, curve_distance, farthest, orbit_curve
from benchmarks.paper.starts import COORDINATES, EXACT, find_edge, same_solution, settled, start_limit
from benchmarks.paper.unique_motion import SIDES, is_unique, lattice, sufficient_starts, unique_limit
from tests.exact.reference import IMPACT, reference
from tests.support import naive
from vibrodrive.stability.structure import compare_structure, reference_orbit

jit = pytest.mark.jit

# k₁

IRREGULAR = 9.1523
"""Value of A without a stable orbit of short period. The distance of two motions grows by a factor e in 5 periods."""

edge_at = functools.cache(start_limit)


@given(edge=st.floats(1e-11, 5.9), bit=st.sampled_from([0.0, 1e-15]))
def test_clean_edge_is_found_to_the_last_bits(edge, bit):
    found = find_edge(lambda d: d < edge, 6.0, bit)
    assert found.kept < edge <= found.lost
    assert found.lost - found.kept <= max(1.001 * EXACT * edge, bit)


@given(edge=st.floats(1e-3, 5.0), ratio=st.floats(1.5, 8.0), share=st.floats(0.3, 0.7))
def test_edge_is_found_below_accumulating_slices(edge, ratio, share):
    """Above the edge kept and lost values alternate. The intervals become narrower towards the edge."""

    def same(d):
        place = np.log(np.maximum(d - edge, 1e-300)) / math.log(ratio)
        return (d <= edge) | (place - np.floor(place) > share)

    assert edge <= find_edge(same, 6.0).lost <= edge * (1 + 1e-11)


def test_no_edge_without_a_loss():
    assert find_edge(lambda d: np.ones(len(d), bool), 6.0) == (6.0, math.inf)
    assert find_edge(lambda d: d < 0, 0.0).lost == math.inf, "there is no room in this direction"
    assert find_edge(lambda d: d < 0, 6.0).lost <= 1e-12, "all deviations are lost"


@jit
@pytest.mark.slow("8 s each: scans of three coordinates in both directions")
@pytest.mark.parametrize("A", [2.75, 3.04, 3.1, 3.25])
def test_at_an_edge_the_impacts_follow_an_unstable_orbit(A):
    """A start exactly on the edge of a basin leads to an unstable orbit of the impact-phase map.

    For a start at rest at the obstacle, all τ0 between two edges lead to one solution, so with two solutions the edges
    in time are 2π apart.
    """
    unstable = [o for o in vd.orbits(A, max_period=4) if o.kind == "unstable"]
    found = {name: edge_at(A, name) for name in COORDINATES}
    assert found["xi0"][0] == (0.0, math.inf), "a gap cannot be negative"
    assert found["dxi0"][0].lost == math.inf, "a start towards the obstacle lands on it immediately"
    for name, edges in found.items():
        assert 0 < min(edge.lost for edge in edges) < math.inf
        for edge, sign in zip(edges, (-1, 1), strict=True):
            if edge.lost < math.inf:
                motion = vd.simulate(A, **{name: sign * edge.lost}, transient=0, periods=24)
                landed = motion.switches["phase"][motion.switches["after"] == IMPACT]
                apart = [np.abs(landed[:, None] - o.phases).min(axis=1) for o in unstable]
                assert min(np.sort(d[:8])[5] for d in apart) < 1e-9, f"{name} = {sign * edge.lost}"
    span = sum(edge.lost for edge in found["tau0"])
    assert span == pytest.approx(2 * math.pi, abs=1e-11) if A < 3.1 else span <= 2 * math.pi + 1e-11


@jit
@pytest.mark.parametrize("name", COORDINATES)
def test_both_sides_of_an_edge_agree_with_fifty_digits(name):
    """The motions have 50 digits. At A = 3.04 main impacts of the two solutions are in even and in odd periods."""
    edge = edge_at(3.04, name)[1].lost

    def lands_in(deviation):
        rows = reference(3.04, **{name: deviation}, periods=34).switches
        whole = [math.floor(float(row.tau) / (2 * math.pi)) for row in rows if row.after == IMPACT][-4:]
        assert np.diff(whole).tolist() == [2, 2, 2], "the motion must have settled"
        return whole[-1] % 2

    here = lands_in(0.0)
    assert [lands_in(share * edge) == here for share in (0.3, 0.7, 1 - 1e-8)] == [True] * 3
    assert lands_in(edge * (1 + 1e-8)) != here


@jit
def test_edges_are_measured_from_the_start():
    """If τ0 changes, the edges remain at the same times, so their distances from τ0 change."""
    here, there = edge_at(3.04, "tau0")[1], edge_at(3.04, "tau0", tau0=0.3)[1]
    assert 0.3 + there.lost == pytest.approx(here.lost, abs=1e-12)


@jit
def test_delays_by_whole_periods_reach_the_solutions_in_turn():
    for A, n in ((2.75, 2), (3.1, 4), (3.25, 3)):
        late = 2 * math.pi * np.arange(-2 * n, 2 * n + 1)
        found = same_solution(settled(A, tau0=0.3), "tau0", late)
        assert found.tolist() == [k % n == 0 for k in range(-2 * n, 2 * n + 1)]


@jit
@pytest.mark.filterwarnings("ignore:.*cannot leave")
def test_one_solution_has_no_edges_and_irregular_motion_no_solution():
    assert [edge.lost for edge in start_limit(1.5, "tau0")] == [math.inf] * 2
    assert start_limit(IRREGULAR, "tau0") is None
    assert start_limit(0.5, "xi0") is None, "the mass never moves"


# k_u


@jit
@pytest.mark.filterwarnings("ignore:.*cannot leave")
def test_all_solutions_are_reached_from_few_starts():
    for A, n in ((1.5, 1), (2.75, 2), (3.04, 2), (3.1, 4), (3.25, 3)):
        found, reached, (xi0, dxi0) = sufficient_starts(A)
        assert (found, reached) == (n, n)
        assert len(xi0) == len(dxi0) <= SIDES[1]
    with pytest.raises(NotApplicable, match="no period"):
        unique_limit("dtau", 0.5)
    with pytest.raises(NotApplicable, match="one solution only"):
        unique_limit("dtau", 1.5)


@jit
def test_large_step_leaves_one_motion_and_a_small_one_two():
    """At Δτ = 0.1 there is one motion (Fig. 11). The two solutions merge between Δτ = 0.05 and 0.063."""
    found = is_unique({"A": 3.04}, "dtau", [0.01, 0.05, 0.063, 0.1], lattice(3.04, 5))
    assert found.tolist() == [False, False, True, True]


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
def test_only_a_fixed_grid_allows_no_difference():
    """Two motions without impacts keep their distance of 1e-7. With `fixed`, motions are one only if bitwise equal."""
    starts = np.array([100.0, 100.0 + 1e-7]), np.array([0.0])
    short = {"A": 1.5, "transient": 0, "periods": 3}
    assert is_unique(short, "dtau", [0.1], starts).tolist() == [False]
    assert is_unique(short | {"method": "muller"}, "dtau", [0.1], starts).tolist() == [True]
    assert is_unique(short, "eps", [1e-4], starts).tolist() == [True]


@jit
def test_band_in_which_the_motion_becomes_unique():
    band = unique_limit("eps", 3.04)
    assert 1e-4 < band.kept_below < band.lost < 3e-4
    below, above = is_unique({"A": 3.04}, "eps", [band.kept_below, band.lost], lattice(3.04, 9))
    assert (below, above) == (False, True)


@jit
@pytest.mark.parametrize("disturbance", ["eps", "dtau"])
def test_band_of_a_function_of_a_motion_is_that_of_vd_limit(disturbance):
    """With the criterion "impacts" as a function, the search finds the same band in every bit."""
    point = {"A": 3.04, "transient": 100, "periods": 60}
    base = reference_orbit(vd.simulate(3.04, transient=20_000, periods=256))
    method = {"method": "fixed"} if disturbance == "dtau" else {}
    band = band_of_motions(disturbance, lambda motion: compare_structure(base, motion).impacts, **point, **method)
    k = vd.limit(**point, disturbance=disturbance)
    assert band == (k.k2, k.kept_below, k.last_kept, k.share_kept, k.searched_to)


# ϱ


def naive_distance(vertices, point):
    """Return the distance of a point from a closed polygon, by a loop over all edges."""
    best = math.inf
    for a, b in zip(vertices, [*vertices[1:], vertices[0]], strict=True):
        length = math.dist(a, b)
        share = 0.0 if length == 0 else sum((p - u) * (v - u) for p, u, v in zip(point, a, b, strict=True)) / length**2
        share = min(1.0, max(0.0, share))
        best = min(best, math.dist(point, [u + share * (v - u) for u, v in zip(a, b, strict=True)]))
    return best


coordinate = st.integers(-300, 300).map(lambda k: k / 100)


@jit
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_farthest_is_independent_of_the_first_edge(data):
    count = data.draw(st.integers(1, 12))
    vertices = np.array(data.draw(st.lists(st.tuples(coordinate, coordinate), min_size=count, max_size=count)))
    points = np.array(data.draw(st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=8)))
    edge = np.array(data.draw(st.lists(st.integers(0, count - 1), min_size=len(points), max_size=len(points))))
    along = np.roll(vertices, -1, axis=0) - vertices
    squared = (along**2).sum(axis=1)
    inverse = np.divide(1.0, squared, out=np.zeros_like(squared), where=squared > 0)
    expected = max(naive_distance(vertices.tolist(), point) for point in points.tolist())
    found = math.sqrt(farthest(points, edge, vertices, along, inverse, math.inf))
    assert found == pytest.approx(expected, abs=1e-7)


def closed(motion):
    return orbit_curve(motion, reference_orbit(motion).n)


@jit
def test_orbit_is_on_its_curve():
    """At the instants of the vertices, and 2π later, ϱ is a rounding error. Elsewhere ϱ is the error of the chords."""
    orbit = vd.simulate(3.04, transient=1000, periods=8)
    curve = closed(orbit)
    assert curve_distance(curve, orbit) < 1e-12
    assert curve_distance(curve, vd.simulate(3.04, tau0=2 * math.pi, transient=1001, periods=8)) < 1e-12
    chord = (2 * math.pi / PER_PERIOD) ** 2 / 8 * (2 * 3.04 + 0.1 + 1)
    assert 1e-6 < curve_distance(curve, orbit, per_period=3 * PER_PERIOD) < chord
    late = vd.simulate(3.04, tau0=0.4, transient=1000, periods=8)
    assert curve_distance(curve, late) < 2e-4, "both motions are on one curve, at other phases"
    speed = -orbit.switches["dxi"].min()
    assert naive_distance(curve.vertices.tolist(), (0.0, -speed / 2)) < 1e-12, "the jump is a part of the curve"


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


@jit
def test_incomplete_motion_has_infinite_distance():
    chatter = vd.simulate(1.5, eps=5e-4, transient=2, periods=5, budget=20)
    assert chatter.status == vd.Status.BUDGET
    assert curve_distance(closed(vd.simulate(1.5, transient=100, periods=4)), chatter) == math.inf


# Grids


def test_grid_of_fig_12_nearly_closes_after_six_periods():
    found = {(c.steps, c.periods): c.miss for c in convergents(0.1)}
    assert found[377, 6] == pytest.approx(37.7 - 12 * math.pi, abs=1e-12)
    assert list(found) == [(62, 1), (63, 1), (314, 5), (377, 6), (6723, 107), (7100, 113)]


@given(dtau=st.floats(1e-3, 20.0))
def test_convergents_are_the_closest_approximations(dtau):
    miss = closing(dtau, 200)
    for c in convergents(dtau, 200):
        assert c.steps * dtau - c.periods * 2 * math.pi == pytest.approx(c.miss, abs=1e-9)
        if c.periods > 1:
            assert abs(c.miss) == pytest.approx(miss[c.periods - 1], abs=1e-9)
            assert abs(c.miss) <= miss[: c.periods].min() + 1e-9


def test_returning_ignores_single_outliers():
    section = np.tile(np.array([[0.0, 1.0], [1.0, 0.0], [2.0, 3.0]]), (100, 1))
    section[150] += 5.0
    assert np.flatnonzero(returning(section, 10) == 0).tolist() == [2, 5, 8]
