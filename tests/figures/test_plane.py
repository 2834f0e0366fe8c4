"""Curves in the plane (A, B): the right lines are drawn, and the limits of the axes do not change."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from vibrodrive.figures.plane import Line, curves_figure, draw_lines
from vibrodrive.figures.style import new
from vibrodrive.model.bifurcations import BIFURCATIONS
from vibrodrive.periodic.bifurcations import ONSET
from vibrodrive.periodic.continuation import BORDER_COLLISION, DOUBLING, FOLD, GRAZING, STICK
from vibrodrive.periodic.curve import Curve, Meeting
from vibrodrive.periodic.meetings import meeting_points


def line(kind, slope, meets=()):
    B = np.linspace(0.0, 1.0, 11)
    return Curve(kind, 2, 1, "REST", "", 1.0 + slope * B, B, ("edge", "edge"), meets)


@pytest.fixture
def curves():
    meet = Meeting(1.0, 0.0, 1, "end")
    return [line("onset", 1.0, (meet,)), line("fold", 2.0, (meet._replace(other=0),)), line("fold", 2.5)]


def drawn(ax):
    return [a for a in ax.lines if a.get_color() != "white" and len(a.get_xdata()) > 2]


def test_figure_shows_curves_periods_and_meeting_points(curves):
    meets = [(a, b) for a, b, _ in meeting_points(curves)]
    figure = curves_figure(curves, (1.0, 3.0), (0.0, 1.0), 2, meets)
    ax = figure.axes[0]
    assert (ax.get_xlim(), ax.get_ylim()) == ((1.0, 3.0), (0.0, 1.0))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$A$", "$B$")
    for one, curve in zip(drawn(ax), curves, strict=True):
        np.testing.assert_array_equal(one.get_xydata(), np.column_stack([curve.A, curve.B]))
    assert [t.get_text() for t in ax.texts] == ["2", "2"]
    for text, curve in zip(ax.texts, curves[1:], strict=True):
        A, B = text.get_position()
        assert pytest.approx(np.interp(B, curve.B, curve.A)) == A
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["onset", "fold", "curves meet"]
    (mark,) = (a for a in ax.lines if a.get_marker() == "o")
    assert mark.get_xydata().tolist() == [[1.0, 0.0]]


def test_curves_over_a_map_keep_its_limits_and_scale(curves):
    fig, axes = new(1, 1, height=3.0)
    ax = axes[0, 0]
    ax.pcolormesh([0.0, 0.5, 1.0], [1.0, 2.0, 3.0], np.zeros((2, 2)))
    ax.set(xlim=(0.1, 0.9), ylim=(1.0, 2.0), yscale="log")
    draw_lines(ax, [Line(c.kind, c.period, c.B, c.A) for c in curves])
    fig.canvas.draw()
    assert (ax.get_xlim(), ax.get_ylim(), ax.get_yscale()) == ((0.1, 0.9), (1.0, 2.0), "log")
    assert ax.get_legend() is None
    np.testing.assert_array_equal(drawn(ax)[1].get_xydata(), np.column_stack([curves[1].B, curves[1].A]))
    assert all(0.1 <= t.get_position()[0] <= 0.9 and 1.0 <= t.get_position()[1] <= 2.0 for t in ax.texts)


def test_kinds_differ_in_black_and_white():
    kinds = BIFURCATIONS.values()
    assert {*BIFURCATIONS} == {ONSET, DOUBLING, FOLD, BORDER_COLLISION, GRAZING, STICK}
    assert len({(str(kind.dashes), kind.width) for kind in kinds}) == len({kind.marker for kind in kinds}) == len(kinds)
    dashes = [str(kind.dashes) for kind in kinds if kind.dashes != "-"]
    assert len(set(dashes)) == len(dashes)
    for one, other in itertools.combinations((to_rgb(kind.colour) for kind in kinds), 2):
        assert np.abs(np.subtract(one, other)).max() > 0.2


def test_figure_without_curves_has_no_legend():
    assert curves_figure([], (1.0, 3.0), (0.0, 1.0), 2).legends == []


def test_legend_has_the_kinds_in_view_only(curves):
    """The points of one curve are outside the view, but the line between them crosses it."""
    coarse = Curve("grazing", 1, 1, "REST", "", np.array([0.0, 4.0]), np.array([0.2, 0.2]), ("edge", "edge"), ())
    figure = curves_figure([*curves, coarse], (1.0, 1.15), (0.1, 0.3), 2)
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["onset", "grazing"]
