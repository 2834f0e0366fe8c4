"""Tests of ϱ, the distance of a motion from the closed curve of an orbit in the plane (ξ, ξ').

The references are simple polygons, a naive search over all edges, and motions of the model.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vibrodrive.batch.trajectory import simulate
from vibrodrive.model.choices import Status
from vibrodrive.model.states import State
from vibrodrive.stability.orbit_curve import PER_PERIOD, OrbitCurve, curve_distance, orbit_curve, raise_farthest
from vibrodrive.stability.structure import reference_orbit

pytestmark = pytest.mark.jit


def naive_distance(vertices, point):
    """Return the distance of a point from a closed polygon, by a loop over all edges."""
    best = math.inf
    for a, b in zip(vertices, [*vertices[1:], vertices[0]], strict=True):
        length = math.dist(a, b)
        share = 0.0 if length == 0 else sum((p - u) * (v - u) for p, u, v in zip(point, a, b, strict=True)) / length**2
        share = min(1.0, max(0.0, share))
        best = min(best, math.dist(point, [u + share * (v - u) for u, v in zip(a, b, strict=True)]))
    return best


def farthest(curve, points, edge, enough=math.inf):
    """Return the largest distance of `points` from `curve`, or the first above `enough`. `edge`: where to begin."""
    out = np.zeros(1)
    raise_farthest(np.array(points, float), np.array(edge), curve.vertices, *curve.edges, enough**2, out)
    return math.sqrt(out[0])


SQUARE = OrbitCurve(1, np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]), np.arange(4) / 4)


def test_distances_from_a_square():
    for point, distance in (((1, 0), 0), ((1, 1), 1), ((1, 0.3), 0.3), ((3, 3), math.sqrt(2)), ((-0.5, 1), 0.5)):
        for edge in range(4):
            assert farthest(SQUARE, [point], [edge]) == pytest.approx(distance, abs=1e-15)
    assert farthest(SQUARE, [(1, 0), (1, 0.3), (1, 1), (0, 0)], [0, 1, 2, 3]) == 1
    assert farthest(SQUARE, [(1, 0.3), (3, 3)], [0, 0], enough=0.2) == pytest.approx(0.3), "the second point is skipped"


coordinate = st.integers(-300, 300).map(lambda k: k / 100)


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_farthest_is_independent_of_the_first_edge(data):
    count = data.draw(st.integers(1, 12))
    vertices = np.array(data.draw(st.lists(st.tuples(coordinate, coordinate), min_size=count, max_size=count)))
    points = data.draw(st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=8))
    edge = data.draw(st.lists(st.integers(0, count - 1), min_size=len(points), max_size=len(points)))
    expected = max(naive_distance(vertices.tolist(), point) for point in points)
    found = farthest(OrbitCurve(1, vertices, np.arange(count) / count), points, edge)
    assert found == pytest.approx(expected, abs=1e-7)


def closed(motion):
    return orbit_curve(motion, reference_orbit(motion).n)


@pytest.fixture(scope="module")
def orbit():
    return simulate(3.04, transient=1000, periods=8)


def test_orbit_is_on_its_curve(orbit):
    """At the instants of the vertices, and 2π later, ϱ is a rounding error. Elsewhere ϱ is the error of the chords."""
    curve = closed(orbit)
    assert curve_distance(curve, orbit) < 1e-12
    assert curve_distance(curve, simulate(3.04, tau0=2 * math.pi, transient=1001, periods=8)) < 1e-12
    chord = (2 * math.pi / PER_PERIOD) ** 2 / 8 * (2 * 3.04 + 0.1 + 1)
    assert 1e-6 < curve_distance(curve, orbit, per_period=3 * PER_PERIOD) < chord


def test_jumps_are_part_of_the_curve(orbit):
    """A motion that lands at half the speed passes (0, -v/2). This point is on the segment of the jump."""
    curve = closed(orbit)
    speed = -orbit.switches["dxi"].min()
    half = [(0.0, -speed / 2)]
    assert farthest(curve, half, [0]) < 1e-12
    sampled = orbit.sample(PER_PERIOD)
    assert np.hypot(sampled.xi, sampled.dxi + speed / 2).min() > 0.1


def test_farthest_of_points_moved_along_the_normal(orbit):
    """A point moved along the normal by d, less than the radius of curvature, has the distance d from the curve."""
    curve = closed(orbit)
    k = int(np.argmax(curve.vertices[:, 0]))  # at the largest ξ the curve is parallel to the ξ' axis
    top = curve.vertices[k]
    for by in (1e-3, 0.1):
        assert farthest(curve, [top + np.array([by, 0.0])], [k]) == pytest.approx(by, rel=1e-3)


@pytest.mark.parametrize(
    ("A", "arguments"),
    [(3.04, {"eps": 1e-4}), (3.04, {"method": "fixed", "dtau": 0.05}), (3.25, {"eps": 1e-3}), (1.5, {"eps": 5e-4})],
)
def test_farthest_equals_a_naive_search(A, arguments):
    orbit = simulate(A, transient=2000, periods=128)
    motion = simulate(A, **arguments, transient=100, periods=6)
    curve = closed(orbit)
    sampled, rows = motion.sample(64), motion.switches
    points = [*zip(sampled.xi, sampled.dxi, strict=True), *zip(rows["xi"], rows["dxi"], strict=True)]
    points += [(0.0 if row["after"] == State.IMPACT else row["xi"], 0.0) for row in rows]
    ends = np.roll(curve.vertices, -1, axis=0)
    along = ends - curve.vertices
    best = 0.0
    for x, v in points:
        away = np.array([x, v]) - curve.vertices
        with np.errstate(invalid="ignore"):
            share = np.nan_to_num(np.clip((away * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1))
        best = max(best, np.linalg.norm(away - share[:, None] * along, axis=1).min())
    assert curve_distance(curve, motion) == pytest.approx(best, rel=1e-12)
    assert curve_distance(curve, motion, enough=0.5 * best) > 0.5 * best


def test_distance_grows_with_the_disturbance_and_not_with_delays():
    orbit = closed(simulate(3.04, transient=1000, periods=8))
    near = [curve_distance(orbit, simulate(3.04, eps=eps, transient=300, periods=100)) for eps in (1e-7, 1e-6, 1e-5)]
    assert near[0] < near[1] < near[2] < 0.3
    late = simulate(3.04, tau0=0.4, transient=1000, periods=8)
    assert curve_distance(orbit, late) < 2e-4, "both motions are on one curve, at other phases"


def test_incomplete_motion_has_infinite_distance():
    chatter = simulate(1.5, eps=5e-4, transient=2, periods=5, budget=20)
    assert chatter.status == Status.BUDGET
    assert curve_distance(closed(simulate(1.5, transient=100, periods=4)), chatter) == math.inf
