"""Tests of examples/map_agreement.py, which compares each pixel of a map over A and B with the list of stable orbits.

The pixels of a true map agree with the list. If the list is falsified, the comparison finds the disagreement.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from vibrodrive.periodic.curve import Curve
from vibrodrive.periodic.curves import curves

from examples import map_agreement
from examples.map_agreement import COEXISTING, SLOW, UNEXPLAINED, agrees, compare_map, near_curves, table
from vibrodrive.model.choices import Status


@pytest.mark.jit
def test_pixels_off_the_curves_agree_with_the_list():
    A, B = np.linspace(2.2, 3.2, 41), np.linspace(0.08, 0.3, 23)
    found = compare_map(A, B, curves((2.2, 3.2), (0.08, 0.3), 2, num=2), 2, sample=60)
    assert (found.pixels, found.judged) == (41 * 23, 60)
    assert found.share == 1.0, found.wrong
    assert found.shown > 40
    assert "| agree | 60 (100.000 %) |" in table(found)


@pytest.mark.jit
def test_disagreement_has_a_reason_after_a_longer_motion(monkeypatch):
    """The motion at A = 3.0554, 2e-3 below a period doubling, settles slowly. At another pixel the list of orbits is
    falsified."""
    A, B = np.array([2.8, 3.0554]), np.array([0.1, 0.3])
    true = map_agreement.stable_orbits

    def listed(a, b, longest):
        orbits = true(a, b, longest)
        if (a, b) == (2.8, 0.1):  # impacts that are faster than those of the true orbit
            return [SimpleNamespace(**{**vars(orbits[0]), "speeds": orbits[0].speeds + 1.0})]
        return orbits

    monkeypatch.setattr(map_agreement, "stable_orbits", listed)
    found = compare_map(A, B, [], 2)
    assert {(d.A, d.B): d.reason for d in found.wrong} == {(2.8, 0.1): UNEXPLAINED, (3.0554, 0.1): SLOW}
    assert found.share == 0.5
    assert any(UNEXPLAINED in line for line in table(found))


def orbit(**changes):
    return SimpleNamespace(**({"period": 2, "impacts": 3, "speeds": np.array([1.0, 2.0])} | changes))


def pixel(**changes):
    return {"status": Status.OK, "period": 2, "impacts": 1.5, "impact_speed_max": 2.0} | changes


def test_pixel_agrees_only_with_the_orbit_it_shows():
    assert agrees(pixel(), [orbit(period=1), orbit()], 3)
    for other in ({"period": 4}, {"period": 0}, {"impacts": 1.0}, {"impact_speed_max": 2.001}):
        assert not agrees(pixel(**other), [orbit()], 3)
    assert not agrees(pixel(), [], 3)
    assert agrees(pixel(period=4), [], 3)
    assert agrees(pixel(period=1, status=Status.NEVER_LEAVES), [], 3)
    assert not agrees(pixel(period=1, status=Status.NEVER_LEAVES), [orbit()], 3)
    assert COEXISTING in map_agreement.REASONS


def test_near_curves_finds_pixels_within_one_pixel():
    A, B = np.linspace(1.0, 3.0, 21), np.linspace(0.0, 1.0, 11)
    curve = Curve("fold", 1, 1, "", "", np.array([1.5, 2.5]), np.array([0.2, 0.8]), ("edge", "edge"), ())
    near = near_curves(A, B, [curve])
    x, y = np.meshgrid(np.arange(21.0), np.arange(11.0), indexing="ij")
    way = np.clip(((x - 5) * 10 + (y - 2) * 6) / 136, 0, 1)
    distance = np.hypot(x - 5 - 10 * way, y - 2 - 6 * way)
    assert near[distance <= 1.0].all()
    assert not near[distance > 1.3].any()
    assert not near_curves(A, B, []).any()
