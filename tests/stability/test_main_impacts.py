"""Tests of cycles of main impacts, and of motions that follow them or do not, with impacts that are written by hand."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibrodrive.batch.trajectory import MAIN_IMPACT
from vibrodrive.jit.trig import TWO_PI
from vibrodrive.stability.main_impacts import (
    ImpactCycle,
    fastest,
    follow_cycle,
    impact_cycle,
    impact_gaps,
    nearest,
    never_follows,
)

CYCLE = ImpactCycle(np.array([1, 2]), np.array([5.0, 4.0]), np.array([2.0, 1.0]))
PERIODS = 60
SHARE = 0.1  # docs/stability.md


def landings(gaps, phase, speed):
    """Return impacts, the first in period 0. `gaps` are the numbers of periods from each impact to the next."""
    rows = np.zeros(len(gaps), MAIN_IMPACT)
    rows["period"] = np.concatenate([[0], np.cumsum(gaps)[:-1]])
    rows["phase"], rows["speed"], rows["row"] = phase, speed, 5 * np.arange(len(gaps))
    return rows


def orbit(cycles=PERIODS // 3, noise=0.0, start=0):
    random = np.random.default_rng(0)
    away = noise * random.uniform(-1, 1, (2, 2 * cycles))
    turn = [np.roll(column, -start) for column in CYCLE]
    return landings(np.tile(turn[0], cycles), np.tile(turn[1], cycles) + away[0], np.tile(turn[2], cycles) + away[1])


def with_touch(rows, at, phase, speed):
    """Return the impacts with a touch (a slow impact) added in period `at`, which has no main impact."""
    touch = np.zeros(1, MAIN_IMPACT)
    touch["period"], touch["phase"], touch["speed"] = at, phase, speed
    both = np.concatenate([rows, touch])
    return both[np.lexsort((both["phase"], both["period"]))]


def test_cycle_of_an_orbit_is_the_shortest():
    found = impact_cycle(orbit())
    assert found.n == 3
    assert (found.gaps.tolist(), found.phase.tolist(), found.speed.tolist()) == ([2, 1], [4.0, 5.0], [1.0, 2.0])


def test_phases_at_both_ends_of_a_period_are_equal():
    """Rounding moves an impact at phase 0 to the beginning of a period or to the end of the previous period."""
    rows = landings(np.ones(20, int), 1e-9, 1.0)
    rows["period"][::3] -= 1
    rows["phase"][::3] = TWO_PI - 1e-9
    found = impact_cycle(rows)
    assert (found.n, found.gaps.tolist()) == (1, [1])
    rows["phase"][::3] = TWO_PI - 1e-6
    assert impact_cycle(rows) is None


def test_unsettled_motion_has_no_cycle():
    assert impact_cycle(orbit(noise=1e-5)) is None
    assert impact_cycle(orbit(noise=0.1)) is None
    assert impact_cycle(orbit()[:4]) is None, "a cycle must occur twice"
    assert impact_cycle(orbit()[:0]) is None
    assert impact_cycle(landings(np.full(9, 64), 4.0, 1.0)).n == 64
    assert impact_cycle(landings(np.full(9, 65), 4.0, 1.0)) is None


@given(noise=st.floats(0, 0.4), start=st.integers(0, 1))
def test_motion_near_the_orbit_follows_it_from_any_impact(noise, start):
    rows = orbit(noise=noise, start=start)
    for ordered in (False, True):
        chosen = follow_cycle(CYCLE, rows, PERIODS, ordered)
        assert chosen.tolist() == list(range(1, len(rows) - 1)), "only the first and the last impact are left out"


def test_two_impacts_in_the_wrong_order_break_order_but_not_gaps():
    cycle = ImpactCycle(np.array([2, 2]), CYCLE.phase, CYCLE.speed)
    rows = landings(np.full(30, 2), np.tile(CYCLE.phase, 15), np.tile(CYCLE.speed, 15))
    rows["phase"][12:14], rows["speed"][12:14] = rows["phase"][12:14][::-1].copy(), rows["speed"][12:14][::-1].copy()
    assert follow_cycle(cycle, rows, PERIODS, ordered=False) is not None
    assert follow_cycle(cycle, rows, PERIODS) is None


@pytest.mark.parametrize("first", range(4))
@pytest.mark.parametrize("last", range(4))
def test_part_of_a_cycle_may_span_much_more_or_less_than_its_mean(first, last):
    """Three of the four gaps span 3 of 28 periods, the other one 25."""
    cycle = ImpactCycle(np.array([1, 1, 1, 25]), np.full(4, 4.0), np.array([1.0, 2.0, 3.0, 4.0]))
    whole = landings(np.tile(cycle.gaps, 6), 4.0, np.tile(cycle.speed, 6))
    rows = whole[first : len(whole) - last]
    assert len(follow_cycle(cycle, rows, 168)) == len(rows) - 2


def test_missing_or_additional_impact_breaks_gaps():
    assert follow_cycle(CYCLE, np.delete(orbit(), 17), PERIODS, ordered=False) is None
    assert follow_cycle(CYCLE, with_touch(orbit(), 32, 1.0, 1.1 * SHARE), PERIODS, ordered=False) is None


def test_touches_are_omitted_for_any_speed_between_them_and_main_impacts():
    rows = with_touch(with_touch(orbit(), 32, 1.0, 0.9 * SHARE), 35, 1.0, 0.5 * SHARE)
    main = np.flatnonzero(rows["speed"] > 0.5)
    assert follow_cycle(CYCLE, rows, PERIODS).tolist() == main[1:-1].tolist()
    slow = rows.copy()
    slow["speed"][main[7]] = 0.95 * SHARE  # slower than the bound, but faster than any touch
    assert follow_cycle(CYCLE, slow, PERIODS, ordered=False).tolist() == main[1:-1].tolist()
    slow["speed"][main[7]] = 0.7 * SHARE  # now one touch is faster than this main impact
    assert follow_cycle(CYCLE, slow, PERIODS, ordered=False) is None


def test_nearest_compares_phases_across_the_end_of_a_period():
    cycle = ImpactCycle(np.array([1, 1]), np.array([0.1, 3.0]), np.array([1.0, 1.0]))
    rows = landings([1, 1], [6.2, 3.5], [1.0, 1.0])
    assert nearest(cycle, rows).tolist() == [0, 1]


def test_gaps_are_rounded_to_whole_periods():
    rows = landings([2, 1, 3], [6.2, 0.1, 3.0], 1.0)
    assert impact_gaps(rows).tolist() == [1, 1]
    assert fastest(CYCLE, orbit(), PERIODS).tobytes() == orbit().tobytes()
    assert [follow_cycle(CYCLE, orbit()[:count], PERIODS) for count in (0, 1, 3)] == [None] * 3


@given(
    extra=st.lists(st.tuples(st.integers(0, 179), st.floats(0, TWO_PI), st.floats(0, 0.3)), max_size=4),
    missing=st.lists(st.tuples(st.integers(0, 119), st.integers(1, 20)), max_size=3),
    noise=st.floats(0, 1),
    first=st.integers(0, 119),
)
def test_a_beginning_proves_only_what_holds_for_the_entire_record(extra, missing, noise, first):
    """The losses are anywhere in the record, and touches, pauses and exchanged impacts may be no loss."""
    rows = orbit(60, noise)
    for at, count in missing:
        rows["speed"][at : at + count] = 0.0
    rows = rows[first:][rows["speed"][first:] > 0.0]
    for touch in extra:
        rows = with_touch(rows, *touch)
    beginning = rows[rows["period"] < PERIODS]
    if never_follows(CYCLE, beginning, PERIODS):
        assert follow_cycle(CYCLE, rows, 3 * PERIODS) is None


def test_losses_that_a_beginning_proves():
    def lost(rows, cycle=CYCLE):
        return never_follows(cycle, rows[rows["period"] < PERIODS], PERIODS)

    rows = orbit(60)
    assert not lost(rows)
    assert not lost(with_touch(rows, 32, 1.0, 0.9 * SHARE))
    other = rows.copy()
    other["period"][17:] += 1
    assert lost(other), "another gap"
    equal = landings(np.full(30, 2), np.tile(CYCLE.phase, 15), np.tile(CYCLE.speed, 15))
    equal["phase"][13], equal["speed"][13] = CYCLE.phase[0], CYCLE.speed[0]
    assert lost(equal, CYCLE._replace(gaps=np.array([2, 2]))), "another order"
    assert lost(with_touch(rows, 32, 1.0, 1.1 * SHARE)), "too fast for a touch"
    assert lost(rows[rows["period"] > PERIODS]), "no impact"
    slow = with_touch(rows, 32, 1.0, 0.9 * SHARE)
    slow["speed"] = 0.9 * SHARE
    assert not lost(slow), "any of these impacts may be touches"
    assert lost(slow[(slow["period"] < 40) | (slow["period"] > 45)]), "a pause"
    assert not lost(slow[(slow["period"] < 10) | (slow["period"] > 15)]), "the first impacts may be touches"
    assert not lost(rows[rows["period"] != 54]), "the end of the beginning depends on its length"
