"""Tests of k₁, the smallest change of the start after which the motion settles on another solution.

The search is tested on functions with a known edge, which separates kept from lost changes. Edges of the model are
compared with motions computed with 50 digits, and with unstable orbits.
"""

import functools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibrodrive.batch.trajectory import simulate
from vibrodrive.model.states import State
from vibrodrive.periodic.impact_map import impact_map
from vibrodrive.periodic.search import UNSTABLE, orbits
from vibrodrive.stability.questions import start_limit
from vibrodrive.stability.starts import (
    COORDINATES,
    EXACT,
    each_start_limit,
    find_edge,
    nearest_other,
    same_solution,
    settled,
)
from vibrodrive.validation.reference import IMPACT, reference

pytestmark = pytest.mark.jit

IRREGULAR = 9.1523
"""Value of A without a stable orbit of short period. The distance of two motions grows by a factor e in 5 periods."""


@functools.cache
def limit_at(A, axis, **start):
    return start_limit(A, axis, **start)


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

    found = find_edge(same, 6.0)
    assert edge <= found.lost <= edge * (1 + 1e-11)


def test_no_edge_without_a_loss():
    found = find_edge(lambda d: np.ones(len(d), bool), 6.0)
    assert found == (6.0, math.inf, 6.0)
    assert find_edge(lambda d: d < 0, 0.0).lost == math.inf, "there is no room in this direction"
    assert find_edge(lambda d: d < 0, 6.0).lost <= 1e-12, "all deviations are lost"


@pytest.fixture(scope="module", params=[2.75, 3.04, 3.1, 3.25])
def edges(request):
    A = request.param
    return A, {name: limit_at(A, name) for name in COORDINATES}


def test_edges_of_starts_at_rest_on_the_obstacle(edges):
    _, found = edges
    assert found["xi0"].below.searched_to == 0.0, "a gap cannot be negative"
    assert found["dxi0"].below.lost == math.inf, "a start towards the obstacle lands on it immediately"
    for limit in found.values():
        assert 0 < limit.k1 < math.inf


def test_edges_in_time_are_a_period_apart(edges):
    """For a start at rest at the obstacle, all τ0 between two edges lead to one solution. So the edges are 2π apart."""
    _, found = edges
    tau = found["tau0"]
    if tau.n == 2:
        assert tau.above.lost + tau.below.lost == pytest.approx(2 * math.pi, abs=1e-11)
    assert tau.above.lost + tau.below.lost <= 2 * math.pi + 1e-11


def test_at_an_edge_the_impacts_follow_an_unstable_orbit(edges):
    """A start exactly on the edge of a basin leads to an unstable orbit of the impact-phase map."""
    A, found = edges
    unstable = [o for o in orbits(A, max_period=4) if o.kind == UNSTABLE]
    for name, limit in found.items():
        for side, sign in ((limit.below, -1), (limit.above, 1)):
            if side.lost == math.inf:
                continue
            start = {"tau0": 0.0} | {name: sign * side.lost}
            motion = simulate(A, **start, transient=0, periods=24)
            landed = motion.switches["phase"][motion.switches["after"] == State.IMPACT]
            apart = [np.abs(landed[:, None] - o.phases).min(axis=1) for o in unstable]
            assert min(np.sort(d[:8])[5] for d in apart) < 1e-9, f"{name} = {sign * side.lost}"


def test_edge_in_time_is_the_phase_of_an_unstable_orbit():
    """The state after an impact is a start at rest on the obstacle. So the edge in τ is the phase of an impact."""
    for A in (2.75, 3.04):
        (orbit,) = [o for o in orbits(A, max_period=1) if o.kind == UNSTABLE]
        edge = limit_at(A, "tau0").above
        assert edge.lost == pytest.approx(orbit.phases[0], abs=1e-12)


def test_map_of_phases_separates_the_two_sides_of_an_edge():
    """By the impact-phase map, starts on both sides of an edge end in solutions an odd number of periods apart."""
    follow = impact_map(3.04)
    edge = limit_at(3.04, "tau0").above
    ends = []
    for tau in (edge.lost * (1 - 1e-9), edge.lost * (1 + 1e-9)):
        phase, periods = np.array([tau]), 0
        for _ in range(300):
            landed = follow(phase)
            phase, periods = landed.phase, periods + int(landed.periods[0])
        ends.append((phase[0], periods))
    (one, first), (other, second) = ends
    assert one == pytest.approx(other, abs=1e-9)
    assert (first - second) % 2 == 1


@pytest.mark.parametrize("name", COORDINATES)
def test_both_sides_of_an_edge_agree_with_fifty_digits(name):
    """The motions have 50 digits. At A = 3.04 main impacts of the two solutions are in even and in odd periods."""
    edge = limit_at(3.04, name).above.lost

    def lands_in(deviation):
        rows = reference(3.04, **{name: deviation}, periods=34).switches
        landed = [row for row in rows if row.after == IMPACT][-4:]
        whole = [math.floor(float(row.tau) / (2 * math.pi)) for row in landed]
        assert np.diff(whole).tolist() == [2, 2, 2], "the motion must have settled"
        return whole[-1] % 2

    here = lands_in(0.0)
    assert [lands_in(share * edge) == here for share in (0.3, 0.7, 1 - 1e-8)] == [True] * 3
    assert lands_in(edge * (1 + 1e-8)) != here


def test_delays_by_whole_periods_reach_the_solutions_in_turn():
    for A, n in ((2.75, 2), (3.1, 4), (3.25, 3)):
        late = 2 * math.pi * np.arange(-2 * n, 2 * n + 1)
        assert same_solution(settled({"A": A}), "tau0", late).tolist() == [k % n == 0 for k in range(-2 * n, 2 * n + 1)]


def test_edges_do_not_depend_on_the_section():
    for phase in (0.8, math.pi, 5.0):
        found = nearest_other({"A": 3.1, "section_phase": phase}, "tau0")
        assert found.above.lost == pytest.approx(limit_at(3.1, "tau0").above.lost, rel=1e-12)


def test_one_solution_has_no_edges_and_irregular_motion_no_solution():
    alone = start_limit(1.5, "tau0")
    assert (alone.n, alone.k1, alone.how) == (1, math.inf, f"the same solution up to {2 * math.pi:.6g}")
    assert math.isnan(start_limit(IRREGULAR, "tau0").k1)
    with pytest.warns(UserWarning, match="the mass cannot leave"):
        still = start_limit(0.5, "xi0")
    assert math.isnan(still.k1), "the mass never moves"
    assert "no period" in still.how


def test_edges_are_measured_from_the_start():
    """If τ0 changes, the edges remain at the same times, so their distances from τ0 change."""
    here, there = limit_at(3.04, "tau0"), limit_at(3.04, "tau0", tau0=0.3)
    assert 0.3 + there.above.lost == pytest.approx(here.above.lost, abs=1e-12)
    assert here.k1 == here.above.lost < here.below.lost
    assert repr(here) == (
        f"<StartLimit k1 = {here.k1:.6g} in tau0 at A = 3.04, B = 0.1: another solution "
        f"below the start from {here.below.lost:.6g} on, above the start from {here.above.lost:.6g} on; period 2>"
    )
    assert dict(each_start_limit({"A": [3.04], "tau0": 0.3, "periods": 100}, "tau0")) == {0: there}


def test_bad_arguments_are_named():
    with pytest.raises(ValueError, match="axis = 'xi': must be one of xi0, dxi0, tau0"):
        start_limit(3.04, "xi")
    with pytest.raises(TypeError, match="axis = 1: must be"):
        start_limit(3.04, 1)
    with pytest.raises(ValueError, match=r"xi0 = -0\.2: must be a number >= 0"):
        start_limit(3.04, "xi0", xi0=-0.2)
    with pytest.raises(TypeError, match=r"^A = array of length 2: must be one number$"):
        start_limit([3.0, 3.04], "xi0")
    with pytest.raises(TypeError, match="argument = 'eps': must be one of"):
        start_limit(3.04, "xi0", eps=0.1)
    with pytest.raises(TypeError, match="axis is missing: must be given"):
        start_limit(3.04)
