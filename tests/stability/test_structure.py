"""The structure of motions that are written by hand: the order of section points, gaps, and the distance ρ."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibrodrive.batch.trajectory import MAIN_IMPACT
from vibrodrive.model.states import State
from vibrodrive.stability import structure

UP, DOWN, STICK, REST, IMPACT = State
POINTS = np.array([[2.0, -2.6], [1.0, -2.9], [3.0, -2.7]])
SWITCH = np.dtype([("period", "i8"), ("phase", "f8"), ("before", "i1"), ("after", "i1"), ("xi", "f8"), ("dxi", "f8")])


def motion(times, word, speed=2.0, section=None, sizes=None):
    """Return a trajectory that lands at `times` (in periods) and passes through `word` after each landing."""
    rows = []
    for k, time in enumerate(times):
        landing = -(speed if sizes is None else sizes[k])
        whole = int(np.floor(time))
        for j, after in enumerate((IMPACT, *word)):
            phase = 2 * np.pi * (time - whole) + 1e-3 * j
            rows.append((whole, phase, 0, after, 0.0, landing if after == IMPACT else 0.0))
    section = np.tile(POINTS, (20, 1)) if section is None else section
    switches = np.array(rows, SWITCH)
    at = np.flatnonzero(switches["after"] == IMPACT)
    impacts = np.empty(len(at), MAIN_IMPACT)
    impacts["row"], impacts["period"], impacts["phase"] = at, switches["period"][at], switches["phase"][at]
    impacts["speed"] = -switches["dxi"][at]
    return SimpleNamespace(switches=switches, section=section, impacts=impacts)


def test_period_is_the_smallest_and_must_occur_twice():
    assert structure.period(np.tile(POINTS, (20, 1))) == 3
    assert structure.period(np.tile(POINTS, (2, 1))) == 3
    assert structure.period(np.tile(POINTS, (2, 1))[:5]) == 0
    assert structure.period(np.ones((4, 2))) == 1
    assert structure.period(np.full((4, 2), np.nan)) == 0
    irregular = np.random.default_rng(0).uniform(size=(60, 2))
    assert structure.period(np.stack([np.tile(POINTS, (20, 1)), irregular, np.ones((60, 2))])).tolist() == [3, 0, 1]
    assert structure.reference_orbit(motion(times=[], word=(UP, DOWN), section=irregular)) is None


def test_motion_alternating_about_its_orbit_has_no_period():
    """Near a period doubling the deviations from an orbit change sign every period and decay slowly."""
    there = 3e-6 * (-0.999999) ** np.arange(60)
    section = np.stack([1.0 + there, -2.0 + there], axis=1)
    assert np.abs(section[2:] - section[:-2]).max() < structure.SAME_POINT, "the section repeats after two periods"
    assert structure.period(section) == 0
    assert structure.period(section + 1e-3 * (-1.0) ** np.arange(60)[:, None]) == 2


def test_shifted_copy_has_the_same_structure_and_gives_its_shift():
    for s in range(3):
        section = np.roll(np.tile(POINTS, (20, 1)), -s, axis=0)
        moved = SimpleNamespace(section=section, impacts=np.empty(0, MAIN_IMPACT))
        found = structure.compare_structure(structure.ReferenceOrbit(POINTS, None), moved)
        assert (found.n, found.order, found.rho, found.shift) == (3, True, 0.0, s)


def test_one_skipped_point_breaks_the_order():
    section = np.tile(POINTS, (20, 1))
    skipped, unknown = section.copy(), section.copy()
    skipped[7], unknown[3, 1] = skipped[8], np.nan
    assert structure.order(POINTS, np.stack([section, skipped, unknown])).tolist() == [True, False, False]
    assert not structure.order(POINTS, np.repeat(section, 2, axis=0))


@given(
    noise=st.floats(0, 0.2),
    shift=st.integers(0, 2),
    seed=st.integers(0, 2**32 - 1),
)
def test_rho_is_the_largest_distance_at_the_best_shift(noise, shift, seed):
    random = np.random.default_rng(seed)
    angle, size = random.uniform(0, 2 * np.pi, 60), random.uniform(0, 1, 60)
    size[random.integers(60)] = 1.0
    away = noise * (size * np.stack([np.cos(angle), np.sin(angle)])).T
    section = np.roll(np.tile(POINTS, (20, 1)), -shift, axis=0) + away
    rho, found = structure.deviation(POINTS, section)
    assert found == shift
    assert rho == pytest.approx(noise, abs=1e-12)


def test_orbit_reads_its_cycle():
    orbit = structure.reference_orbit(motion(times=[0, 1, 3, 4, 6, 7, 9], word=(REST, UP, STICK, DOWN)))
    assert orbit.n == 3
    assert orbit.cycle.gaps.tolist() == [2, 1]
    assert orbit.cycle.speed.tolist() == [2.0, 2.0]
    assert np.array_equal(np.sort(orbit.points, axis=0), np.sort(POINTS, axis=0))


def test_orbit_without_impacts_has_the_period_of_its_section():
    flying = motion(times=[], word=())
    orbit = structure.reference_orbit(flying)
    assert (orbit.n, orbit.cycle) == (3, None)
    found = structure.compare_structure(orbit, flying)
    assert (found.impacts, found.gaps, found.order) == (True, True, True)
    assert not structure.compare_structure(orbit, motion(times=[3], word=(UP, DOWN))).impacts
