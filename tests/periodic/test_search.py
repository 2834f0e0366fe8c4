"""Periodic orbits compared with two references: a computation with 50 digits, and a dense sampling of the map.

Other tests examine orbits close to B = 0, where rounding once changed the list of orbits.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.reference import mp, reference
from tests.support.mp_flight import next_impact, orbit_phase, slope
from vibrodrive.periodic import search as orbit_search
from vibrodrive.periodic.fixed_points import force_between, slope_between
from vibrodrive.periodic.impact_map import impact_map
from vibrodrive.periodic.itineraries import FLYING, flights
from vibrodrive.periodic.search import orbits

SOMEWHERE = [(1.2, 0.1), (2.2, 0.1), (2.61, 0.1), (2.655, 0.1), (2.93, 0.1), (3.04, 0.1), (3.07, 0.1), (3.1893, 0.1),
             (3.25, 0.1), (3.6, 0.1), (4.3, 0.1), (3.4, 0.5), (5.0, 1.0), (8.0, 0.5), (3.0, 1.3),
             (9.0, 2.0)]  # fmt: skip
"""Values (A, B) with one to eight orbits of up to three periods, of every kind."""


@pytest.mark.parametrize(("A", "B"), SOMEWHERE)
def test_orbits_close_in_the_reference(A, B):
    found = orbits(A, B, 3)
    assert found
    for orbit in found:
        n = orbit.impacts
        assert orbit.gaps.sum() == orbit.period
        phi = float(orbit.phases[0])
        words = []
        for i in range(n):
            landing = next_impact(A, B, phi)
            words.append(landing.word)
            assert landing.periods == orbit.gaps[i]
            phi = landing.phase
            assert float(phi) == pytest.approx(orbit.phases[(i + 1) % n], abs=1e-11)
            assert -float(landing.velocity) == pytest.approx(orbit.speeds[(i + 1) % n], abs=1e-11)
        assert " ".join(words) == orbit.word
        if orbit.kind == "superstable":
            assert orbit.multiplier == 0.0
            assert "REST" in orbit.word
        else:
            exact = orbit_phase(A, B, float(orbit.phases[0]), n, orbit.period)
            assert float(exact) == pytest.approx(orbit.phases[0], abs=1e-12)
            assert orbit.multiplier == pytest.approx(float(slope(A, B, exact, n)), rel=1e-8)
            assert orbit.kind == ("stable" if abs(orbit.multiplier) < 1 else "unstable")
            assert (orbit.multiplier < 0) == (n % 2 == 1)


def sampled(A: float, B: float, n: int, period: int, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (smooth, crosses), masks of the intervals between neighbours of `phi`, bool (len(phi) - 1,).

    smooth : the n-fold map is smooth in the interval and takes `period` periods
    crosses : the map is smooth in the interval and crosses the diagonal there
    """
    system = impact_map(A, B)
    low, high = system.window
    time, alive, words = phi.copy(), np.ones(len(phi), bool), np.zeros(len(phi), dtype="<U400")
    total = np.zeros(len(phi), dtype=np.int64)
    for _ in range(n):
        step = system(time)
        alive &= (step.phase > low) & (step.phase < high)
        total += step.periods
        words = np.char.add(words, step.word)
        time = step.phase
    smooth = alive[1:] & alive[:-1] & (words[1:] == words[:-1]) & (total[1:] == period) & (total[:-1] == period)
    ahead = time - phi
    return smooth, smooth & (ahead[1:] * ahead[:-1] < 0)


@pytest.mark.jit
@pytest.mark.parametrize(("A", "B"), SOMEWHERE[::2])
def test_search_finds_all_orbits_of_a_dense_sampling(A, B):
    """In intervals in which the sampled map is not smooth it may have branches that are narrower than the spacing."""
    found = orbits(A, B, 3)
    phi = np.linspace(*impact_map(A, B).window, 40_003)[1:-1]
    for period in (1, 2, 3):
        for n in range(1, period + 1):
            smooth, crossed = sampled(A, B, n, period, phi)
            launches = [
                p for o in found for p in o.phases
                if o.kind != "superstable" and n % o.impacts == 0 and o.period * (n // o.impacts) == period
            ]  # fmt: skip
            cells = np.searchsorted(phi, launches) - 1
            assert set(np.flatnonzero(crossed)) == {c for c in cells if smooth[c]}


@pytest.mark.jit
@pytest.mark.parametrize("falling", [False, True])
def test_force_is_within_its_bounds(falling):
    """|H| of a half wave, between phases at which |H| >= 1; the only peak may be between the two phases."""
    A, B, middle = 3.0, 0.4, (1.5 if falling else 0.5) * math.pi
    for one, other in itertools.product(middle + np.linspace(-0.9, 0.9, 10), repeat=2):
        force = abs(A * np.sin(np.linspace(one, other, 99)) - B)
        low, high = force_between.py_func(one, other, falling, A, B)
        assert (low, high) == pytest.approx((force.min(), force.max()), rel=2e-3)


@pytest.mark.jit
def test_orbits_of_a_machine_are_those_of_its_A_and_B():
    machine = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4, mass=250.0)
    given = {name: value for name, value in machine.given.items() if name != "frequency"}
    wanted = orbits(machine.A, machine.B, 4)
    for found in (
        vd.orbits(scene=machine, max_period=4),
        vd.orbits(**given, frequency=24.0, max_period=4),
        vd.orbits(scene=replace(machine, omega0=99.0), frequency=24.0, max_period=4),
        vd.orbits(machine.A, scene=vd.Scene(**machine.given | {"a0": 0.0}), max_period=4),
    ):
        assert len(found) == len(wanted) > 2
        for orbit, same in zip(found, wanted, strict=True):
            assert (orbit.A, orbit.B, orbit.name) == (machine.A, machine.B, same.name)
            assert orbit.phases.tobytes() == same.phases.tobytes()
            assert orbit.scene.frequency == 24.0
            assert orbit.scene.velocity(orbit.speeds).tobytes() == machine.velocity(same.speeds).tobytes()
        assert repr(found[0]).endswith("B = 0.0990182, a₀ = 0.8 mm, f = 24 Hz>")
    assert wanted[0].scene is None
    assert vd.impact_map(scene=machine)(1.0).phase == impact_map(machine.A, machine.B)(1.0).phase


def test_orbits_with_a_rest_are_superstable():
    (orbit,) = orbits(1.5)
    assert (orbit.period, orbit.kind, orbit.word) == (1, "superstable", "REST UP STICK DOWN IMPACT")
    for A in (1.1, 0.0):
        assert orbits(A) == []


@pytest.mark.jit
def test_longer_periods_contain_the_shorter_ones():
    short, long = orbits(3.17, 0.1, 3), orbits(3.17, 0.1, 6)
    assert [o.phases.tolist() for o in long if o.period <= 3] == [o.phases.tolist() for o in short]
    assert len({o.name for o in long}) == len(long)
    periods = [o.period for o in orbits(3.8, 0.1, 6)]  # one of four periods has fewer impacts than one of three
    assert periods == sorted(periods)


def test_orbit_keeps_its_name_if_an_impact_passes_the_end_of_a_period():
    """The mass then rests from the end of one excitation period to the next one, and no bifurcation is between."""
    one, other = (next(o for o in orbits(A, 0.15, 2) if o.kind == "superstable") for A in (2.953, 2.955))
    assert (one.gaps.tolist(), other.gaps.tolist()) == ([1, 1], [0, 2])
    assert one.name == other.name


STICKS = math.sqrt(1.0 + 0.25 * math.pi**2)
"""Largest A at which, for B = 0, a mass that leaves the obstacle after a rest sticks before it slides down."""


@pytest.mark.parametrize("A", [1.0 + 1e-9, 1.37, 1.4666980286121560, 1.86, 1.8622, 1.9, 2.5, 2.93, 10.0, 1e6])
def test_one_orbit_on_the_level_touches(A):
    """For B = 0 the orbit lands with velocity 0. Rounding errors once gave other kinds at two of these values of A."""
    (orbit,) = orbits(A, 0.0, 2)
    assert (orbit.kind, orbit.period, orbit.impacts) == ("touching", 1, 1)
    assert orbit.speeds.tolist() == [0.0]
    assert math.isnan(orbit.multiplier)
    assert vd.simulate(A=A, B=0.0, tau0=float(orbit.phases[0]), transient=0, periods=3).status.name == "TOO_CLOSE"
    assert orbit.word == ("REST UP STICK DOWN IMPACT" if A < STICKS else "UP DOWN IMPACT")
    if A > STICKS:
        assert A * math.cos(orbit.phases[0]) == pytest.approx(0.5 * math.pi, rel=1e-9)


@pytest.mark.parametrize("A", [1.37, 1.4666980286121560, 1.9, 2.93])
def test_touching_orbit_bounds_motions_in_the_air(A):
    """By the reference a motion that starts 1e-3 above the orbit returns to this ξ. After a later launch it lands.

    After an earlier launch the mass does not land.
    """
    (orbit,) = orbits(A, 0.0, 1)
    phase, gap = float(orbit.phases[0]), 1e-3
    run = reference(A, 0.0, tau0=phase, xi0=gap, periods=4, section_phase=phase)
    assert min(float(s.xi) for s in run.switches) == pytest.approx(gap, abs=1e-15)
    launch = phase if A > STICKS else math.asin(1.0 / A)
    later = next_impact(A, 0.0, mp.mpf(launch) + mp.mpf(1e-6))
    assert 0.0 < -later.velocity < 1e-2
    if A > STICKS:
        with pytest.raises(AssertionError, match="no impact"):
            next_impact(A, 0.0, mp.mpf(launch) - mp.mpf(1e-6))


@pytest.mark.jit
def test_first_fall_after_a_stick_close_to_the_level_lands():
    """The first fall is at least as long as the rise, so the mass lands. Rounding may hide the difference of 1e-17."""
    for A in np.linspace(1.01, 1.85, 29).tolist():
        for B in (0.0, 1e-300, 1e-18, 1e-16, 1e-15, 1e-12):
            (orbit,) = orbits(A, B, 1)
            assert orbit.word == "REST UP STICK DOWN IMPACT"
            assert orbit.kind == ("superstable" if B > 0.0 else "touching")
            assert orbit.speeds[0] < 1e2 * math.sqrt(B) + 1e-6


@pytest.mark.jit
@pytest.mark.parametrize("B", [1e-15, 1e-9, 1e-6, 1e-4])
def test_no_orbit_close_to_the_level_depends_on_rounding(B):
    """The list of orbits does not depend on the last bit of A, and no speed is negative. Both claims once failed."""
    for A in np.linspace(1.9, 4.0, 22).tolist():
        names = [[o.name for o in orbits(a, B, 3)] for a in np.linspace(A, A * (1.0 + 1e-12), 5).tolist()]
        assert all(there == names[0] for there in names)
        for orbit in orbits(A, B, 3):
            assert orbit.speeds.min() > B
            assert orbit.multiplier < 0.0 if orbit.impacts % 2 == 1 else orbit.multiplier >= 0.0


@pytest.mark.jit
def test_orbit_passed_twice_is_listed_once():
    """Far above A = 1 + B rounding separates two passes of an orbit. Together they were once listed as a new orbit."""
    for A in np.linspace(1000.0, 1100.0, 401).tolist():
        for orbit in orbits(A, 0.1, 2):
            assert len(set(orbit.name)) == orbit.impacts


@pytest.mark.jit
def test_too_long_a_period_is_refused(monkeypatch):
    with pytest.raises(ValueError, match=r"max_period = 1000: must be an integer >= 1 and <= 100"):
        orbits(3.04, max_period=1000)
    monkeypatch.setattr(orbit_search, "MOST_ITINERARIES", 2000)
    with pytest.raises(ValueError, match="max_period = 9: must be smaller, because more than 222 sequences of states"):
        orbits(5.0, max_period=9)
    assert len(orbits(3.04, max_period=9)) == 2


@pytest.mark.parametrize("n", [1, 2, 3])
def test_slopes_between_two_launches_are_within_their_bounds(n):
    """The slope of the map itself equals the difference quotient of 50 digits (test_impact_map.py)."""
    rng, slides, checked = np.random.default_rng(n), np.empty((2, 200, 3)), 0
    for A, B in [(3.04, 0.1), (4.3, 0.1), (5.0, 0.1), (5.0, 1.0), (8.0, 0.5), (9.0, 2.0)]:
        for low in rng.uniform(*impact_map(A, B).window, 100):
            high = low + 10.0 ** rng.uniform(-6, -1)
            ends = [flights(end, n, A, B, 64, rows) for end, rows in zip((low, high), slides, strict=True)]
            if ends[0][0] != ends[1][0] or {end[5] for end in ends} != {FLYING}:
                continue
            least, most = slope_between(*slides, ends[0][6], A, B)
            between = [abs(flights(psi, n, A, B, 64, slides[0])[3]) for psi in np.linspace(low, high, 12)]
            assert least <= min(between)
            assert max(between) <= most
            checked += 1
    assert checked > 40
