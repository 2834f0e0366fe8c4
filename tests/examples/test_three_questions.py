"""Tests of the answers to the three questions of docs/orbits.md.

Attractors found by simulation are among the orbits of the impact-phase map.
"""

from pathlib import Path

import numpy as np
import pytest

import vibrodrive as vd
from examples.three_questions import (
    bifurcation_table,
    chaos,
    distance,
    limit_table,
    rank_correlation,
    surroundings,
    what_sets_limit,
)
from vibrodrive.periodic.family import section
from vibrodrive.periodic.impact_map import ImpactMap
from vibrodrive.periodic.search import Orbit, orbits, resting

SEARCHED = 8
"""Longest period, in excitation periods, of the search for orbits without a rest."""


TRANSIENT = 1500


def follows(points: np.ndarray, orbit: Orbit) -> bool:
    """Return True if section points (n, 2) visit the points of the orbit in order, within 1e-7 + `left`.

    left : share of the initial distance from the orbit that remains after the transient
    """
    left = abs(orbit.multiplier) ** (TRANSIENT / orbit.period)
    apart = np.abs(points[:, None] - section(orbit, 2.0)[None]).max(axis=2)
    visited = np.argmin(apart, axis=1)
    return bool(
        apart.min(axis=1).max() < 1e-7 + left
        and np.all((visited[1:] - visited[:-1]) % orbit.period == 1 % orbit.period)
    )


@pytest.mark.jit
def test_every_attractor_of_brute_force_is_among_the_orbits():
    """At 400 values of A from 1.12 to 3.25 the simulated motion ends on an orbit of the list.

    Orbits with a rest are searched for up to the recorded 160 periods, all other orbits up to the period SEARCHED.
    `longer` would contain each A whose motion ends on none of these orbits. It must be empty.
    """
    values = np.linspace(1.12, 3.25, 400)
    motion = vd.sweep(A=values, transient=TRANSIENT, periods=160, section_phase=2.0).section
    longer = []
    for A, points in zip(values.tolist(), motion, strict=True):
        known = list(resting(ImpactMap(A), 160))
        known += [o for o in orbits(A, 0.1, 2) if abs(o.multiplier) < 1]
        if not any(follows(points, o) for o in known):
            known = orbits(A, 0.1, SEARCHED)
            if not any(follows(points, o) for o in known if abs(o.multiplier) < 1):
                longer.append(A)
    assert longer == []


@pytest.mark.jit
def test_no_chaos_between_3_15_and_3_19():
    """98 % of the values of A have a superstable orbit (multiplier 0), all others a stable orbit. So every Lyapunov
    exponent is negative."""
    answer = chaos(num=1001)
    assert answer.shares["irregular"] == 0.0
    assert answer.shares["superstable"] == pytest.approx(0.98, abs=0.01)
    assert sum(answer.shares.values()) == pytest.approx(1.0)
    rests, moves = chaos(1.5, 3.04, 2).exponent
    (stable,) = (o for o in orbits(3.04) if o.kind == "stable")
    assert rests == -np.inf
    assert moves == pytest.approx(np.log(abs(stable.multiplier)) / 2, abs=1e-9)


def test_surroundings_of_a_known_orbit():
    around = surroundings([1.05, 3.04])
    assert around.period.tolist() == [0, 2]
    found = orbits(3.04, 0.1, 6)
    (stable,) = (o for o in found if o.kind == "stable")
    assert around.multiplier[1] == abs(stable.multiplier)
    apart = [np.abs(o.phases[:, None] - stable.phases).min() for o in found if o.kind == "unstable"]
    assert around.unstable[1] == min(apart)
    system = ImpactMap(3.04)
    assert around.border[1] == pytest.approx(stable.phases[0] - system.window[0])
    assert around.grazing[1] == pytest.approx(system.breakpoints[1] - stable.phases[0])
    assert around.nearest[1] == min(around.unstable[1], around.border[1], around.grazing[1])
    assert np.isnan(around.multiplier[0])
    (orbit,) = orbits(1.15, 0.1, 1)  # its impact is closer to the end of the window than to its beginning
    assert surroundings([1.15]).border[0] == pytest.approx(orbit.phases[0] - ImpactMap(1.15).window[1])
    assert np.isnan(around.nearest[0])


@pytest.mark.jit
def test_correlation_of_limits(tmp_path):
    A = np.array([2.8, 3.0, 3.03, 3.04, 3.05])
    measure = surroundings(A).multiplier
    assert what_sets_limit(A, 1.0 - measure)["multiplier"] == (-1.0, 5)
    assert what_sets_limit(A, [np.nan, np.inf, 1, 2, 3])["multiplier"] == (1.0, 3)
    with pytest.raises(ValueError, match="k2"):
        what_sets_limit(A, [1.0])
    found = vd.sweep(A=A[:3], record="limit", transient=20, periods=30, path=tmp_path / "eps.h5")
    titles, _, row = limit_table([tmp_path / "eps.h5"])
    correlation, count = what_sets_limit(A[:3], found.k2)["border"]
    assert row.startswith("| eps, certified | ")
    assert f" {correlation:.2f} ({count}) " in row
    assert row.count("|") == titles.count("|")


def test_rank_correlation_and_distance():
    x = np.array([3.0, 1.0, 2.0, 2.0])
    assert rank_correlation(x, np.exp(x)) == pytest.approx(1.0)
    assert rank_correlation(x, -x) == pytest.approx(-1.0)
    assert np.isnan(rank_correlation(x, np.ones(4)))
    assert distance([0.1], [6.2]) == pytest.approx(0.1 + 2 * np.pi - 6.2)
    assert np.isnan(distance([0.1], []))


@pytest.mark.jit
def test_page_shows_the_output_of_the_example():
    """Kinds and A of bifurcations in docs/orbits.md equal the example's output (exact A to a relative 1e-12)."""
    page = (Path(__file__).parents[2] / "docs" / "orbits.md").read_text()
    shown = [
        line.split("|")[1:4]
        for line in page.split("exactly | kind |")[1].split("\n\n")[0].splitlines()
        if line.startswith("| ")
    ]
    printed = [line.split("|")[1:4] for line in bifurcation_table(max_period=4)][2:]  # no longer orbit is visible
    assert len(shown) == len(printed) == 7
    for (seen, exact, kind), (seen_now, exact_now, kind_now) in zip(shown, printed, strict=True):
        assert float(seen) == float(seen_now)
        assert float(exact) == pytest.approx(float(exact_now), rel=1e-12)
        assert kind.strip().startswith(kind_now.strip())
