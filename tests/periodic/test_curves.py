"""Comparison of curves of bifurcations with independent results.

The independent results are a search at fixed B, closed forms, the 50-digit reference and a published limit.
"""

import math

import numpy as np
import pytest

from tests.exact.reference import mp, reference
from tests.support.mp_flight import after, orbit_phase, slope
from vibrodrive.periodic.bifurcations import bifurcations
from vibrodrive.periodic.conditions import Condition, Margin, Slide, lags
from vibrodrive.periodic.curve import Curve
from vibrodrive.periodic.curves import curves
from vibrodrive.periodic.flight import FROM_GROUND, FROM_REVERSAL, FROM_STICK
from vibrodrive.periodic.meetings import meeting_points, with_meetings
from vibrodrive.periodic.recognition import recognise
from vibrodrive.periodic.tracing import CLOSED, EDGE, Box, cut, point_at, trace

LEVEL_POINT = math.sqrt(1.0 + 0.25 * math.pi**2)
"""Value of A at which curves begin at B = 0 (on the level)."""


@pytest.fixture(scope="module")
def found():
    return curves((1.5, 3.2), (0.03, 0.15), 3, num=2)


def listed(found, B):
    """Return (kind, A) of every curve at B, ordered by A."""
    return sorted(((c.kind, a) for c in found for a in c.at(B).tolist()), key=lambda pair: pair[1])


def agree(found, A, B, max_period, atol=1e-12):
    alone = [(b.kind, b.A) for b in bifurcations(A, B, max_period)]
    here = listed(found, B)
    assert [kind for kind, _ in here] == [kind for kind, _ in alone]
    np.testing.assert_allclose([a for _, a in here], [a for _, a in alone], rtol=0, atol=atol)
    return len(alone)


@pytest.mark.jit
@pytest.mark.parametrize("B", [0.03, 0.0371, 0.0768234, 0.1, 0.1299])
def test_curves_at_one_B_equal_the_bifurcations(found, B):
    """The curves give exactly the bifurcations at B, for the smallest B of the curves and for larger values."""
    assert agree(found, (1.5, 3.2), B, 3) >= 5


@pytest.mark.jit
def test_three_curves_begin_where_a_grazing_orbit_begins_to_rest():
    """Up to B = 0.00489 the orbit at a grazing has one impact in four periods and no rest. For a larger B it has a
    rest. At B = 0.00489 three curves meet the curve of the grazing: the border of its orbit, and the fold and the
    border of an orbit of two impacts."""
    A = (2.105, 2.15)
    found = curves(A, (0.0047, 0.0057), 4, num=2)
    (point,) = meeting_points(found)
    there = [found[i] for i in point[2]]
    kinds = sorted((c.kind, c.impacts) for c in there)
    assert kinds == [("border", 1), ("border", 2), ("fold", 2), ("grazing", 1), ("grazing", 1)]
    assert {m.what for c in there for m in c.meets} == {"end"}
    assert sorted(c.at(0.0048).size for c in there) == [0, 0, 0, 0, 1]
    assert sorted(c.at(0.0050).size for c in there) == [0, 1, 1, 1, 1]
    for B in (0.0048, 0.0056):  # closer to the point the search at one B would merge the fold and the border
        agree(found, A, B, 4)
    # at the point the flight after a rest touches the obstacle, and rounding determines whether the mass lands
    run = reference(point[0], point[1], tau0=math.asin((1.0 + point[1]) / point[0]), periods=4)
    assert min(float(s.margin) for s in run.switches) < 1e-6


@pytest.mark.jit
def test_every_curve_ends_at_the_edge_of_the_range(found):
    for c in found:
        assert c.ends == ("edge", "edge")
        for A, B in zip(c.A[[0, -1]].tolist(), c.B[[0, -1]].tolist(), strict=True):
            assert A in (1.5, 3.2) or B in (0.03, 0.15)
        assert ((c.A >= 1.5) & (c.A <= 3.2) & (c.B >= 0.03) & (c.B <= 0.15)).all()
        assert c.at(0.02).tolist() == c.at(0.2).tolist() == []


@pytest.mark.jit
def test_at_returns_the_points_of_a_curve(found):
    for c in found:
        for k in (0, len(c.A) // 2, -1):
            assert np.abs(c.at(float(c.B[k])) - c.A[k]).min() < 1e-13


def test_onset_is_a_straight_line_below_other_curves():
    (onset,) = curves((1.0, 1.8), (0.0, 1e-9), 1)
    assert onset.kind == "onset"
    assert onset.at(5e-10).tolist() == [1.0 + 5e-10]
    assert curves((0.5, 0.9), (0.0, 1.0), 1) == []


@pytest.mark.jit
def test_curves_begin_at_one_point_on_the_level():
    """As B → 0 the distance of a curve from A = √(1 + π²/4) falls like B for a stick, and like √B for other kinds."""
    found = curves((1.2, 1.9), (0.0, 0.001), 1, num=2)
    assert [c.kind for c in found] == ["stick", "border", "period doubling"]
    for c in found:
        assert (c.A[0], c.B[0], c.ends[0]) == (LEVEL_POINT, 0.0, "level")
        near, far = (c.at(B)[0] - LEVEL_POINT for B in (1e-6, 4e-6))
        assert near / far == pytest.approx(0.25 if c.kind == "stick" else 0.5, rel=2e-2)
    assert meeting_points(found) == [(LEVEL_POINT, 0.0, [0, 1, 2])]
    (level,) = bifurcations((1.2, 1.9), 0.0, 1)
    assert listed(found, 0.0) == [(level.kind, pytest.approx(level.A, abs=1e-15))]


@pytest.mark.jit
def test_steep_inclines_tend_to_the_inelastic_bouncing_ball():
    """As B → ∞, the border collision tends to A/B = √(1 + π²), and the first period doubling to A/B = √(4 + π²) (Mehta
    and Luck 1990)."""
    found = curves((320.0, 460.0), (100.0, 120.0), 1, num=2)
    limits = {"border": math.sqrt(1.0 + math.pi**2), "period doubling": math.sqrt(4.0 + math.pi**2)}
    curved = [c for c in found if c.kind in limits]
    assert len(curved) == 2
    for c in curved:
        errors = [c.at(B)[0] / B - limits[c.kind] for B in (100.0, 120.0)]
        assert abs(errors[1]) < 3e-2
        assert errors[0] / errors[1] == pytest.approx(1.2, rel=5e-3)


@pytest.mark.jit
def test_doublings_in_the_reference(found):
    doublings = [c for c in found if c.kind == "period doubling"]
    assert {c.period for c in doublings} == {1, 2, 3}
    for c in doublings:
        B = 0.0413
        (A,) = c.at(B)
        i = int(np.argmin(abs(c.B - B)))
        near = float(c.points[i, len(c.condition.slides) - 1]) % (2.0 * math.pi)
        phi = orbit_phase(float(A), B, near, c.impacts, c.period)
        assert float(slope(float(A), B, phi, c.impacts)) == pytest.approx(-1.0, abs=1e-11)


@pytest.mark.jit
def test_borders_in_the_reference(found):
    """The last impact of one period is exactly at the phase φ_up at which the motion began after a rest."""
    borders = [c for c in found if c.kind == "border"]
    assert len(borders) >= 4
    for c in borders:
        B = 0.0413
        (A,) = c.at(B)
        up = mp.asin((1 + mp.mpf(B)) / mp.mpf(float(A)))
        assert abs(after(float(A), B, up, c.impacts) - up - 2 * mp.pi * c.period) < 1e-12
        assert c.side == "beginning"


@pytest.mark.jit
def test_grazings_and_sticks_in_the_reference(found):
    for c in (c for c in found if c.kind in ("grazing", "stick")):
        B = 0.0413
        (A,) = c.at(B)
        up = math.asin((1.0 + B) / A)
        run = reference(float(A), B, tau0=up, periods=c.period + 1)
        assert min(float(s.margin) for s in run.switches[: len(c.word.split())]) < 1e-12


@pytest.mark.jit
@pytest.mark.parametrize("B", [0.02, 1.7])
def test_stick_agrees_with_the_closed_form(B):
    """The first slide begins from rest at H = 1 and ends with ξ' = 0 exactly at H = -1."""
    b = mp.mpf(B)

    def velocity(A):
        up, down = mp.asin((1 + b) / A), mp.pi + mp.asin((1 - b) / A)
        return A * (mp.cos(up) - mp.cos(down)) - (1 + b) * (down - up)

    with mp.workdps(50):
        exact = mp.findroot(velocity, 1.86 + 0.9 * b)
    found = curves((1.5, 5.0), (B, B + 1e-3), 1, num=2)
    (stick,) = (c for c in found if c.kind == "stick")
    assert abs(stick.at(B)[0] - exact) < 1e-14 * exact


@pytest.mark.jit
def test_every_bifurcation_is_recognised():
    kinds = set()
    for b in [*bifurcations((3.15, 3.3), 0.1, 4), *bifurcations((2.10, 2.11), 0.0048, 4)]:
        condition, u = recognise(b)
        assert condition.kind == b.kind
        assert abs(u[-2] - b.A) < 1e-13
        assert min(m.value for m in condition.margins(u)) > 0.0
        kinds.add((condition.kind, condition.rests))
    assert kinds == {
        ("border", True),
        ("period doubling", False),
        ("fold", False),
        ("grazing", True),
        ("grazing", False),
    }


@pytest.mark.jit
def test_fold_margin_vanishes_at_a_period_doubling():
    """The curve of a fold ends at a period doubling, where its orbit becomes an orbit of half the period."""
    (b,) = bifurcations((2.6, 2.61), 0.1, 1)
    once, u = recognise(b)
    again = once.slides
    twice = Condition("fold", once.slides + again, 2, False, -1, doubled=True)
    both = np.array([*u[:-2], *(u[:-2] + 2.0 * math.pi), *u[-2:]])
    assert abs(min(m.value for m in twice.margins(both))) < 1e-14
    assert np.abs(twice.equations(both[None, :])).max() < 1e-12


def test_short_slides_lose_no_digits():
    for h in (1e-6, 0.1, 0.99, 1.01, 3.0):
        with mp.workdps(50):
            exact = mp.mpf(h)
            forms = 1 - mp.cos(exact), exact - mp.sin(exact), exact**2 / 2 - 1 + mp.cos(exact)
            for value, form in zip(lags(np.array([h])), forms, strict=True):
                assert abs(value[0] / form - 1) < 3e-15


def test_derivatives_equal_difference_quotients():
    slides = (
        Slide(False, FROM_GROUND, 0, False),
        Slide(True, FROM_REVERSAL, 0, False),
        Slide(False, FROM_STICK, 1, False),
        Slide(True, FROM_REVERSAL, 0, True),
    )
    u = np.array([3.4, 5.9, 9.6, 13.1, 3.1, 0.12])
    for kind, critical in (("period doubling", -1), ("grazing", 1), ("stick", 0)):
        condition = Condition(kind, slides, 2, False, critical)
        values, slopes = condition.linearised(u)
        np.testing.assert_allclose(values, condition.equations(u[None, :])[0], rtol=1e-14, atol=1e-14)
        for k in range(len(u)):
            step = np.zeros(len(u))
            step[k] = 1e-6
            ahead, behind = condition.equations(np.stack([u + step, u - step]))
            np.testing.assert_allclose(slopes[:, k], (ahead - behind) / 2e-6, rtol=1e-6, atol=1e-7)


class Circle:
    """A condition with a known curve: (A - 3)² + (B - 1)² = 1/4, valid for A < limit."""

    slides = ()

    def __init__(self, limit=math.inf):
        self.limit = limit

    def linearised(self, u):
        A, B = u - (3.0, 1.0)
        return np.array([A * A + B * B - 0.25]), np.array([[2.0 * A, 2.0 * B]])

    def margins(self, u):
        return [Margin("grazing", self.limit - u[0])]


BOX = Box((2.0, 5.0), (0.0, 2.0))


def as_curve(condition, path):
    points, ends = path
    return Curve("fold", 1, 2, "", "", points[:, 0], points[:, 1], ends, (), condition, points)


def test_closed_curve_has_two_turns_and_is_traced_once():
    points, ends = trace(Circle(), np.array([3.5, 1.0]), BOX)
    assert ends == (CLOSED, CLOSED)
    np.testing.assert_array_equal(points[0], points[-1])
    A, B = points.T
    angle = np.unwrap(np.arctan2(B - 1.0, A - 3.0))
    assert abs(angle[-1] - angle[0]) == pytest.approx(2.0 * math.pi, abs=1e-12)
    assert (B.min(), B.max()) == (pytest.approx(0.5, abs=1e-14), pytest.approx(1.5, abs=1e-14))
    curve = as_curve(Circle(), (points, ends))
    for b in (0.5 + 1e-9, 0.7, 1.0, 1.21, 1.5 - 1e-9):
        half = math.sqrt(0.25 - (b - 1.0) ** 2)
        np.testing.assert_allclose(curve.at(b), [3.0 - half, 3.0 + half], rtol=0, atol=1e-15 + 1e-15 / half)


def test_curve_ends_with_its_condition():
    end = math.sqrt(0.25 - 0.2**2)
    points, ends = trace(Circle(limit=3.2), np.array([2.5, 1.0]), BOX)
    assert ends == ("grazing", "grazing")
    np.testing.assert_allclose(sorted(points[[0, -1]].tolist()), [[3.2, 1 - end], [3.2, 1 + end]], atol=1e-14)
    points, ends = trace(Circle(), np.array([2.5, 1.0]), Box((2.0, 5.0), (0.0, 1.3)))
    assert ends == (EDGE, EDGE)
    assert (points[[0, -1], 1] == 1.3).all()


def test_parts_of_a_curve_in_the_range():
    points, _ = trace(Circle(), np.array([3.5, 1.0]), BOX)
    parts = list(cut(Circle(), points[10:-10], (EDGE, EDGE), 2.8))
    assert len(parts) == 2
    assert all(p[0][:, 0].min() >= 2.8 for p in parts)
    edges = [p[0][k].tolist() for p, k in zip(parts, (-1, 0), strict=True)]
    np.testing.assert_allclose(sorted(b for _, b in edges), [1 - math.sqrt(0.21), 1 + math.sqrt(0.21)], atol=1e-14)


def test_crossings_and_ends_on_another_curve_are_found():
    class Line(Circle):
        """A condition with the known curve A - 3 = (B - 1) / 2."""

        def linearised(self, u):
            A, B = u - (3.0, 1.0)
            return np.array([A - 0.5 * B]), np.array([[1.0, -0.5]])

    circle = as_curve(Circle(), trace(Circle(), np.array([3.5, 1.0]), BOX))
    line = as_curve(Line(), trace(Line(), np.array([3.0, 1.0]), BOX))
    high = 1.0 + math.sqrt(0.2)
    both = with_meetings([circle, line])
    points = sorted((m.B, m.A, m.other, m.what) for m in both[0].meets)
    assert [p[2:] for p in points] == [(1, "crossing"), (1, "crossing")]
    np.testing.assert_allclose([p[0] for p in points], [2.0 - high, high], atol=1e-14)
    stop = 3.0 + 0.5 * (high - 1.0)
    half = as_curve(Line(stop), trace(Line(stop), np.array([3.0, 1.0]), BOX))
    assert sorted(m.what for m in with_meetings([circle, half])[1].meets) == ["crossing", "end"]


def test_points_close_to_a_turn_are_approached_along_the_curve():
    b = 1.5 - 1e-6
    here = np.array([3.0, 1.5])
    there = np.array([3.0 + 0.5 * math.sin(0.1), 1.0 + 0.5 * math.cos(0.1)])
    assert point_at(Circle(), here, there, b) == pytest.approx(3.0 + math.sqrt(0.25 - (b - 1.0) ** 2), abs=1e-13)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"A": (3.0, 2.0)}, "A = .*two numbers in ascending order"),
        ({"A": 3.0}, "A = 3.0: must be two numbers"),
        ({"B": (0.1, 0.1)}, "B = "),
        ({"B": (0.1, 0.2, 0.3)}, "B = "),
        ({"B": (-0.1, 0.2)}, "B = -0.1: must be a number >= 0"),
        ({"max_period": 0}, "max_period = 0"),
        ({"num": 1}, "num = 1: must be an integer >= 2"),
    ],
)
def test_bad_arguments_are_refused(arguments, told):
    with pytest.raises((TypeError, ValueError), match=told):
        curves(**arguments)


@pytest.mark.jit
def test_curve_has_a_repr_and_accepts_arrays():
    border, doubling = curves((2.4, 2.8), (0.05, 0.2), 1)
    assert repr(doubling).startswith("<period doubling: orbit of period 1, 1 impact; A 2.4…2.8, B ")
    assert len(repr(border)) < 200
    found = border.at([[0.1, 0.15], [0.12, 0.9]])
    assert found.shape == (2, 2, 1)
    assert found[0, 0] == border.at(0.1)
    assert np.isnan(found[1, 1, 0])
    assert border.at([]).shape == (0, 0)
    assert border.at([0.9]).shape == (1, 0)
