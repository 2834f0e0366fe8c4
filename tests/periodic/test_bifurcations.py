"""Tests of bifurcations: their conditions in 50 digits, the values of the paper, and a finer grid of A."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from tests.exact.reference import IMPACT, mp, reference
from tests.support.mp_flight import orbit_phase, slope
from vibrodrive.model.physical import Scene
from vibrodrive.periodic import bifurcations as orbit_bifurcations
from vibrodrive.periodic.bifurcations import Search, _multiplier, bifurcations, gap_between, spread
from vibrodrive.periodic.continuation import Continuation
from vibrodrive.periodic.family import Family, family, traces
from vibrodrive.periodic.search import orbits

pytestmark = pytest.mark.jit  # hundreds of searches

PAPER = (1.05, 3.25)


@pytest.fixture(scope="module")
def found():
    return bifurcations(PAPER, 0.1, 4)


def of_kind(found, kind):
    return [b for b in found if b.kind == kind]


def test_route_of_the_paper(found):
    assert [b.A for b in of_kind(found, "onset")] == [1.1]
    doublings = [b.A for b in of_kind(found, "period doubling")]
    assert doublings[:2] == pytest.approx([2.604, 3.057], abs=5e-4)
    grazing = of_kind(found, "grazing")[0].A
    assert grazing == pytest.approx(2.69, abs=5e-3)
    assert [b.A for b in of_kind(found, "fold")] == pytest.approx([3.19], abs=1e-3)


def test_doublings_in_the_reference(found):
    """At a period doubling the multiplier is -1, computed from differences of 50-digit flights."""
    for b in of_kind(found, "period doubling"):
        n = b.orbit.impacts
        phi = orbit_phase(b.A, b.B, float(b.orbit.phases[0]), n, b.orbit.period)
        assert float(slope(b.A, b.B, phi, n)) == pytest.approx(-1.0, abs=1e-10)
        assert b.multiplier_below == pytest.approx(-1.0, abs=1e-5)
        assert b.multiplier_above == pytest.approx(-1.0, abs=1e-5)
        twice = [o for o in orbits(b.A + 1e-7, b.B, 2 * b.orbit.period) if o.name == b.orbit.name * 2]
        assert [o.kind for o in twice] == ["stable"]


def test_two_orbits_with_multiplier_one_meet_at_a_fold(found):
    for b in of_kind(found, "fold"):
        pairs = [[o for o in orbits(b.A + d, b.B, b.orbit.period) if o.name == b.orbit.name] for d in (-1e-7, 1e-7)]
        (one, other), none = sorted(pairs, key=len, reverse=True)
        assert none == []
        assert one.multiplier * other.multiplier == pytest.approx(1.0, abs=1e-3)
        assert {one.kind, other.kind} == {"stable", "unstable"}
        # the distance of the orbits grows like a square root: at a quarter of the distance in A it is half as large
        closer = [o for o in orbits(b.A + 0.25e-7, b.B, b.orbit.period) if o.name == b.orbit.name]
        apart = np.abs(one.phases - other.phases)
        assert np.abs(closer[0].phases - closer[1].phases) == pytest.approx(0.5 * apart, rel=1e-2)


def gap_at_closest(A, b):
    """Return the least margin of the 50-digit motion at A that starts at an impact of the orbit of bifurcation b."""
    run = reference(A, b.B, tau0=float(b.orbit.phases[0]), periods=b.orbit.period + 1)
    return min(float(s.margin) for s in run.switches)


def test_borders_grazings_and_sticks_in_the_reference(found):
    """At the bifurcation the margin of one decision of the orbit is zero. At A ± 1e-5 all margins are larger."""
    for kind in ("border", "grazing", "stick"):
        for b in of_kind(found, kind):
            here = gap_at_closest(b.A, b)
            assert here < 1e-9, (kind, b.A)
            assert gap_at_closest(b.A - 1e-5, b) > 100 * here
            assert gap_at_closest(b.A + 1e-5, b) > 100 * here


def test_grazing_touches_and_border_is_at_the_end_of_the_window(found):
    for b in of_kind(found, "border"):
        up = math.asin((1 + b.B) / b.A)
        ends = np.array([up, math.pi - up])
        assert np.abs(b.orbit.phases[:, None] - ends).min() < 1e-8
    for b in of_kind(found, "grazing"):
        run = reference(b.A, b.B, tau0=float(b.orbit.phases[0]), periods=b.orbit.period + 1)
        lowest = min((s.margin for s in run.switches if s.after == IMPACT or s.xi > 0), default=mp.inf)
        assert float(lowest) < 1e-9


def test_finer_grid_finds_no_further_bifurcations(found):
    finer = bifurcations(PAPER, 0.1, 4, step=1 / 700)
    assert [b.kind for b in finer] == [b.kind for b in found]
    np.testing.assert_allclose([b.A for b in finer], [b.A for b in found], rtol=0, atol=1e-12)


def test_orbits_do_not_change_between_bifurcations(found):
    values = [b.A for b in found]
    for low, high in itertools.pairwise(values):
        names = {
            tuple(sorted((o.name, o.kind) for o in orbits(A, 0.1, 4))) for A in np.linspace(low, high, 7)[1:-1].tolist()
        }
        assert len(names) == 1


def test_grazing_agrees_from_both_sides():
    """At a grazing an orbit of three impacts vanishes together with an orbit of two impacts.

    The longer flight of the second orbit passes just above the obstacle. At the grazing the multiplier of the first
    orbit is infinite, and the last float of A at which this orbit is found is 2e-8 away.
    """
    (b,) = (b for b in bifurcations((3.25, 3.26), 0.05, 6) if b.kind == "grazing")
    assert b.orbit.impacts == 2
    assert gap_at_closest(b.A, b) < 1e-9
    there = [o for o in orbits(b.A + 1e-6, b.B, 6) if (o.period, o.impacts) == (6, 3)]
    (lands,) = (o for o in there if gap_between(o, b.orbit) < 1e-2)
    assert abs(lands.multiplier) > 100
    A, kind, last = Continuation.of(lands).end(lands.A, b.A - 1e-6)
    assert kind == "grazing"
    assert abs(last - b.A) > 1e-9
    assert pytest.approx(b.A, abs=1e-12) == A


def test_phase_differences_are_measured_on_the_circle():
    """An impact just before the end of a period is close to an impact just after the beginning of a period."""
    (orbit,) = orbits(1.5, 0.1, 1)
    places = [0.01], [2 * math.pi - 0.02], [3.0, 2 * math.pi - 0.02], [0.01, 2.8, 4.0]
    one, other, two, three = (replace(orbit, phases=np.array(phases)) for phases in places)
    assert gap_between(one, other) == gap_between(other, one) == pytest.approx(0.03)
    assert gap_between(one, two) == gap_between(two, one) == pytest.approx(0.03)
    assert math.isnan(_multiplier(one, [replace(one, period=2)])), "another orbit at the same phases"
    assert gap_between(two, three) == gap_between(three, two) == pytest.approx(0.2), "the largest of 0.2 and 0.03"


@pytest.mark.parametrize(
    ("multiplier", "doubles"),
    [
        (lambda d: -1.0 - 300.0 * d, True),
        (lambda d: -1.0 + 1e-3 * (d - 3e-9), True),
        (lambda d: -1.0 - 300.0 * (d - 2e-5), True),
        (lambda d: -1.0 - 300.0 * (d - 1e-3), False),  # far away
        (lambda d: -1.0 - 300.0 * d if abs(d) < 2e-9 else math.nan, True),  # an orbit that exists there only
        (lambda d: 1.0 + 300.0 * d, False),  # a fold, not a period doubling
        (lambda d: -0.9 if d < 0.0 else math.nan, False),  # an orbit that ends
        (lambda d: -1.1 if d < 0.0 else math.nan, False),
    ],
)
def test_doubled_orbit_begins_where_the_multiplier_of_its_half_passes_minus_one(multiplier, doubles, monkeypatch):
    monkeypatch.setattr(Continuation, "multiplier", lambda self, A: multiplier(A - 3.0))
    sides = Continuation(0.1, 2, 2, False, (1, 2), True)._across(3.0)
    assert (sides is not None) == doubles
    assert sides is None or (multiplier(sides[0] - 3.0) < -1.0) != (multiplier(sides[1] - 3.0) < -1.0)


@pytest.mark.parametrize(("distance", "kind"), [(2e-8, "border"), (2e-7, "fold")])
def test_orbit_ends_at_a_breakpoint_if_a_launch_is_there(distance, kind, monkeypatch):
    monkeypatch.setattr(Continuation, "starts", lambda self, A: [1.0] if A < 3.0 else [])
    monkeypatch.setattr(Continuation, "_closest_to_breakpoint", lambda self, A: (distance, "border", 1.0))
    assert Continuation(0.1, 2, 2, False, (1, 2), False).end(2.9, 3.1)[1] == kind


@pytest.mark.parametrize(("apart", "count"), [(1e-9, 1), (1e-7, 2)])
def test_close_results_are_one_bifurcation(apart, count, monkeypatch):
    (orbit,) = orbits(1.5, 0.1, 1)
    ends = iter([(3.0, "fold", 3.0, orbit), (3.0 + apart, "fold", 3.0 + apart, orbit)])
    monkeypatch.setattr(Search, "orbits", lambda self, A: [])
    monkeypatch.setattr(Search, "change", lambda *_: next(ends, None))
    search = Search(0.1, 1)
    search.find_between(2.9, [], 3.1, [])
    assert len(search.found) == count


def test_multipliers_are_those_of_the_same_orbit_beside_the_bifurcation(found):
    """They are taken 1e-10 from it. At a fold there is none on one side, although another orbit is 0.1 rad away."""
    for b in found:
        if b.kind in ("border", "fold"):
            for side, m in ((-1e-10, b.multiplier_below), (1e-10, b.multiplier_above)):
                known = [o.multiplier for o in orbits(b.A + side, 0.1, 4)]
                assert math.isnan(m) or pytest.approx(m, rel=0.05, abs=1e-30) in known
    grazings = [(b.multiplier_below, b.multiplier_above) for b in of_kind(found, "grazing")]
    assert grazings == [(0.0, 0.0)] * len(grazings) != [], "the orbit rests on both sides"
    (fold, *_) = bifurcations((3.178, 3.179), 0.1, 7)
    assert (fold.kind, math.isnan(fold.multiplier_below)) == ("fold", True)
    assert 0.99 < fold.multiplier_above < 1.01


def test_branches_of_a_diagram_are_close_to_their_orbits_beside_a_bifurcation():
    """Their phases change like a square root, and the straight lines of a branch are off by a sixth at most.

    Where an orbit has doubled, rounding hides both halves up to a distance of 1e-8.
    """
    for low, high, n, kind, near in ((2.55, 2.612, 2, "period doubling", 2e-7), (3.15, 3.1895, 3, "fold", 2e-9)):
        drawn = family([low, high], 0.1, n)
        (b,) = (b for b in drawn.bifurcations if b.kind == kind)
        name = b.orbit.name * (2 if kind == "period doubling" else 1)
        branch = next(x for x in drawn.branches() if x.orbits[0].name == name and x.orbits[-1].kind == "stable")
        curve = traces(branch, lambda o: o.phases)
        assert 0.0 < branch.A[0] - b.A < near
        for middle in np.sqrt(branch.A[1:] - b.A) * np.sqrt(branch.A[:-1] - b.A):
            exact = next(o for o in orbits(b.A + middle, 0.1, n) if (o.name, o.kind) == (name, "stable"))
            line = [np.interp(b.A + middle, branch.A, column) for column in curve.T]
            phases = np.sort(exact.phases)
            away = np.abs(phases - np.sort(b.orbit.phases)).max()
            assert line == pytest.approx(phases, abs=0.2 * away + 3e-5), middle


def test_two_orbits_of_one_name_are_two_branches():
    one, *_ = orbits(3.04)
    twin = replace(one, phases=one.phases + 0.01)
    drawn = Family(np.array([1.0, 2.0, 3.0]), 0.1, 2, [[one, twin], [one, twin], [one]], [])
    assert [(b.A.tolist(), b.orbits) for b in drawn.branches()] == [([1, 2, 3], [one] * 3), ([1, 2], [twin] * 2)]


STICKS = math.sqrt(1.0 + 0.25 * math.pi**2)


@pytest.mark.parametrize(
    ("ends", "B", "limit", "kinds", "orbit"),
    [
        ((0.9, 3.25), 0.0, 2, ["onset", "stick"], "touching"),  # an earlier search did not end
        *(((0.9, 3.25), B, 2, ["onset", "stick", "border"], "superstable") for B in (1e-15, 1e-12, 1e-9)),
        ((0.5, 1.0), 0.1, 3, [], ""),  # below the onset
        ((2.9, 3.0), 0.0, 2, [], ""),
        ((1.9, 2.4), 1e-6, 3, [], ""),  # the search once found hundreds, by rounding
    ],
)
def test_hardly_an_orbit_changes_close_to_the_level(ends, B, limit, kinds, orbit):
    """For B = 0 orbits are `touching`: they reach the obstacle with velocity 0."""
    found = bifurcations(ends, B, limit)
    assert [b.kind for b in found] == kinds
    assert all(b.orbit.kind == orbit for b in found)
    if found:
        assert found[0].A == 1.0 + B
        assert pytest.approx(STICKS, abs=1e-3 if B else 1e-14) == found[-1].A


@pytest.mark.parametrize("step", [None, 4.0])
def test_steps_and_tolerances_grow_with_A(step):
    """Steps and tolerances in A grow with A. Constant steps would be below the last bit of a large A."""
    for B in (1e3, 1e6):
        scale = 1e-3 * B
        border, doubling = bifurcations((3.1 * B, 3.8 * B), B, 2, step=step and step * scale)
        assert (border.kind, doubling.kind) == ("border", "period doubling")
        assert np.abs(border.orbit.phases - math.asin((1.0 + B) / border.A)).min() < 1e-8
        for side in (-1e-9, 1e-9):
            (orbit,) = (o for o in orbits(doubling.A * (1.0 + side), B, 1) if o.kind != "superstable")
            assert orbit.multiplier == pytest.approx(-1.0, abs=1e-7)


def test_grid_of_a_wide_range_grows_with_A():
    """The spacing of the grid grows with A. A grid with the spacing 1/256 would not fit into memory."""
    values = spread(1.05, 1e9, None)
    assert len(values) < 25_000
    assert np.all(np.diff(values) <= np.maximum(1.0, values[1:] / 4.0) / 256.0 * (1.0 + 1e-9))
    np.testing.assert_array_equal(spread(1.05, 3.25, None), np.linspace(1.05, 3.25, 1 + math.ceil(2.2 * 256)))
    assert bifurcations((1e8, 1e9), max_period=1) == []


def test_too_much_work_is_refused_beforehand(monkeypatch):
    with pytest.raises(ValueError, match=r"max_period = 101: must be an integer >= 1 and <= 100"):
        bifurcations(max_period=101)
    monkeypatch.setattr(orbit_bifurcations, "MOST_WORK", 1000)
    with pytest.raises(ValueError, match=r"max_period = 4: must be smaller, .* at each of 552 values of A"):
        bifurcations(max_period=4)


MACHINE = Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4)
FRICTION = 0.6 * 9.80665 * math.cos(math.radians(3.4))
RANGES = {
    "a0": (0.5e-3, 0.85e-3, lambda A: A * FRICTION / (2 * math.pi * 24.0) ** 2),
    "omega0": (120.0, 160.0, lambda A: math.sqrt(A * FRICTION / 0.8e-3)),
    "frequency": (20.0, 25.0, lambda A: math.sqrt(A * FRICTION / 0.8e-3) / (2 * math.pi)),
}
"""Ends of a range of a quantity of the machine, and its value at an A, A = a0 Ω0² / (μ g cos α)."""


@pytest.mark.parametrize("name", RANGES)
def test_bifurcations_of_a_machine_are_those_of_its_A(name):
    low, high, value = RANGES[name]
    found = bifurcations(scene=MACHINE, **{name: (low, high)}, max_period=2)
    wanted = [b for b in bifurcations((1.5, 4.0), MACHINE.B, 2) if low <= value(b.A) <= high]
    assert [b.kind for b in found] == [b.kind for b in wanted]
    assert len(found) > 3
    for b, same in zip(found, wanted, strict=True):
        assert pytest.approx(same.A, rel=1e-13) == b.A
        assert getattr(b.scene, name) == pytest.approx(value(b.A), rel=1e-14)
        assert pytest.approx((b.A, b.orbit.A), rel=1e-15) == (b.scene.A, b.orbit.scene.A)
        assert (b.B, b.scene.mu, b.scene.alpha) == (MACHINE.B, 0.6, 3.4)
    in_words = {"a0": f"a₀ = {1e3 * value(found[0].A):.10g} mm, f = 24 Hz"}
    assert in_words.get(name, "B = 0.0990182, a₀ = 0.8 mm, ") in repr(found[0])
    away = {name, "frequency"} if name == "omega0" else {name}
    given = {key: number for key, number in MACHINE.given.items() if key not in away}
    again = bifurcations(**given, **{name: (low, high)}, max_period=2)
    assert [(b.A, b.scene) for b in again] == [(b.A, b.scene) for b in found]
    if name == "a0":
        ends = (low / value(1.0), high / value(1.0))
        over = bifurcations(ends, scene=replace(MACHINE, a0=0.0), max_period=2)
        assert [b.scene.a0 for b in over] == pytest.approx([b.scene.a0 for b in found], rel=1e-12)


@pytest.mark.parametrize("along", ["mu", "alpha"])
def test_bifurcations_at_several_inclines_are_those_at_each(along):
    """The range of A depends on friction, so that each incline has a range of its own, also for an A without an a0."""
    values = [0.95 * getattr(MACHINE, along), getattr(MACHINE, along)]
    for scene, span in ((MACHINE, {"frequency": (21.0, 22.5)}), (replace(MACHINE, a0=0.0), {"A": (2.4, 2.65)})):
        found = bifurcations(scene=scene, **span, **{along: values}, max_period=1)
        wanted = [b for v in values for b in bifurcations(scene=scene, **span, **{along: v}, max_period=1)]
        assert [(b.A, b.B, b.kind, b.scene) for b in found] == [(b.A, b.B, b.kind, b.scene) for b in wanted]
        assert {getattr(b.scene, along) for b in found} == {*values}
        for b in found:
            assert pytest.approx((b.A, b.B), rel=1e-14) == (b.scene.A, b.scene.B)


def test_silent_units_of_a_range_are_named():
    with pytest.warns(UserWarning, match="the mass cannot leave the obstacle, .* frequency in Hz"):
        assert bifurcations(scene=MACHINE, frequency=(0.02, 0.024)) == []


def test_repr_of_orbits_and_bifurcations_is_one_line():
    border, doubling = bifurcations((2.5, 2.61), max_period=1)
    assert (
        repr(doubling) == "<period doubling at A = 2.60408063766, B = 0.1: period 1 to 2; orbit of period 1, 1 impact>"
    )
    assert repr(border).startswith("<border at A = 2.52271194073, B = 0.1: multiplier below / above 0 / -")
    assert repr(orbits(3.04)[1]).startswith(
        "<Orbit of period 2: stable, multiplier -0.823988; 1 impact at 0.4740; A = 3.04"
    )
