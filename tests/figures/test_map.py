"""A map shows each point of a sweep once, where it lies, in a colour that says what it is, and what it leaves out."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb

import vibrodrive as vd
from vibrodrive.figures.map import APART, CLASSES, PALETTE, digits, edges, map_figure, states
from vibrodrive.figures.style import save
from vibrodrive.model.drawing import choose_drawing, merge_wishes
from vibrodrive.model.parameters import Status
from vibrodrive.model.physical import Physical, power
from vibrodrive.model.plan import Settings
from vibrodrive.periodic.curves import Curve


def results(axes, **arrays):
    shape = tuple(len(a) for a in axes.values())
    known = {"status": np.zeros(shape, np.int8), "margin": np.full(shape, 0.5)} | arrays
    scalars = {name: v for name, v in {"A": 2.0, "B": 0.1, "eps": 0.0, "eta": 101.0}.items() if name not in axes}
    return SimpleNamespace(axes=axes, scalars=scalars, settings=Settings(), title="", record=("summary",), **known)


@pytest.fixture
def plane():
    A, B = np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2])
    return results({"A": A, "B": B}, period=np.array([[1, 2], [3, 8], [9, 0]], np.int8))


def cells(fig):
    """(edges across, edges up, colours (rows, columns)) of the map."""
    (mesh,) = fig.axes[0].collections
    corners = mesh.get_coordinates()
    values = np.ma.filled(mesh.get_array().astype(float), np.nan).reshape(len(corners) - 1, -1)
    table = mesh.get_cmap().colors
    colours = [["none" if np.isnan(v) else to_hex(table[int(v)]) for v in row] for row in values]
    return corners[0, :, 0], corners[:, 0, 1], colours


def test_each_point_has_its_place_and_the_colour_of_its_period(plane):
    x, y, colours = cells(map_figure(plane))
    assert x.tolist() == [0.5, 1.5, 2.5, 3.5]
    assert y.tolist() == pytest.approx([0.05, 0.15, 0.25])
    named = [*PALETTE[:CLASSES], *PALETTE[CLASSES:]]
    assert colours[0] == [named[0], named[2], named[8]], "B = 0.1: periods 1, 3, more"
    assert colours[1] == [named[1], named[7], named[9]], "B = 0.2: periods 2, 8, none"
    assert [t.get_text() for t in map_figure(plane).axes[1].get_yticklabels()] == [*"12345678", "more", "none"]


def test_axes_may_be_exchanged_and_come_in_any_order(plane):
    _, _, straight = cells(map_figure(plane))
    _, _, turned = cells(map_figure(plane, x="B"))
    assert np.array_equal(np.transpose(straight), turned)
    back = results({"A": plane.axes["A"][::-1], "B": plane.axes["B"]}, period=plane.period[::-1])
    assert cells(map_figure(back))[2] == straight


def test_classes_stay_apart_in_grey():
    """Rec. 709 luminance falls from one to the next."""
    light = [float(np.dot(np.array(to_rgb(c)) ** 2.2, (0.2126, 0.7152, 0.0722))) for c in PALETTE]
    assert (np.diff(light) < 0).all()


def test_points_that_are_missing_or_rest_are_no_class(plane):
    plane.status[0, 0], plane.status[1, 1] = Status.NOT_COMPUTED, Status.NEVER_LEAVES
    fig = map_figure(plane)
    colours = cells(fig)[2]
    assert (colours[0][0], colours[1][1]) == ("none", to_hex(APART))
    assert "of 6 points not computed: 1, never leaves: 1" in fig.axes[0].get_title(loc="right")
    assert {t.get_text() for t in fig.legends[0].get_texts()} == {"rests", "not computed"}
    assert fig.axes[0].patch.get_hatch()


def test_gaps_and_sequences_are_named_by_what_they_are(plane):
    plane.gaps = np.array([[1, 1], [1, 122], [12, 0]])
    bar = map_figure(plane, "gaps").axes[1]
    assert [t.get_text() for t in bar.get_yticklabels()] == ["1", "1, 2", "1, 2, 2", "none"]
    assert digits(122) == "1, 2, 2"
    number = 0
    for state in (vd.State.UP, vd.State.STICK, vd.State.IMPACT):
        number = 6 * number + int(state) + 1
    assert states(number) == "USI"


@pytest.mark.jit
def test_the_letters_of_a_sequence_are_the_states_of_the_motion():
    swept = vd.sweep(A=[1.5], transient=100, periods=5, record="summary")
    seen = vd.simulate(1.5, transient=100, periods=5).switches["after"][:5]
    letters = "".join(vd.State(s).name[0] for s in seen)
    found = states(int(swept.sequence[0]))
    assert found in letters + letters
    assert len(found) == 5


def test_a_quantity_over_decades_is_drawn_over_its_logarithm(plane):
    plane.energy = np.array([[0.0, 1e-3], [1e-1, 1.0], [10.0, np.nan]])
    fig = map_figure(plane, "energy")
    assert fig.axes[1].get_yscale() == "log"
    assert {t.get_text() for t in fig.legends[0].get_texts()} == {"0", "no such value"}
    plane.energy = np.linspace(1.0, 2.0, 6).reshape(3, 2)
    assert map_figure(plane, "energy").axes[1].get_yscale() == "linear"
    low, high = map_figure(plane, "energy", limits=(0.5, 4.0)).axes[1].get_ylim()
    assert (low, high) == (0.5, 4.0)


def test_an_exponent_has_its_zero_in_the_middle(plane):
    plane.lyapunov = np.array([[-np.inf, -2.0], [-1.0, 0.1], [0.5, -0.2]])
    fig = map_figure(plane, "lyapunov")
    assert fig.axes[1].get_ylim() == (-2.0, 2.0)
    assert [t.get_text() for t in fig.legends[0].get_texts()] == ["rests"]


def test_edges_lie_half_way_and_follow_the_scale():
    assert edges(np.geomspace(1e-6, 1e-2, 3)) == pytest.approx(10.0 ** np.array([-7.0, -5.0, -3.0, -1.0]))
    assert edges(np.array([1.0, 2.0, 5.0])).tolist() == [0.5, 1.5, 3.5, 6.5]
    assert edges(np.array([2.0])).tolist() == [1.5, 2.5]
    eps = results({"A": np.array([1.0, 2.0]), "eps": np.geomspace(1e-6, 1e-2, 5)}, gaps=np.ones((2, 5), int))
    assert map_figure(eps, "gaps").axes[0].get_yscale() == "log"


def test_one_axis_has_marks_and_a_third_is_named(plane, tmp_path):
    line = results({"A": np.linspace(1, 3, 5)}, period=np.array([1, 1, 2, 2, 0], np.int8))
    (marks,) = map_figure(line).axes[0].lines
    assert marks.get_ydata().tolist() == [0, 0, 1, 1, CLASSES + 1]
    axes = {"A": np.linspace(1, 3, 4), "B": np.linspace(0.1, 0.2, 3), "tau0": np.array([0.5, 1.0])}
    fig = map_figure(results(axes, period=np.arange(24).reshape(4, 3, 2)))
    assert r"$\tau_0 = 0.5$ (first of 2)" in fig.axes[0].get_title(loc="right")
    assert (len(cells(fig)[0]), len(cells(fig)[1])) == (5, 4)
    for ending in ("png", "pdf", "svg"):
        assert save(fig, tmp_path / f"x.{ending}").stat().st_size < 500_000


def test_curves_lie_over_a_map_of_a_and_b(plane):
    curve = Curve("border", 1, 1, (), 1, np.array([1.0, 3.0]), np.array([0.1, 0.2]), ("edge", "edge"), ())
    for x in ("A", "B"):
        fig = map_figure(plane, x=x, curves=[curve])
        line = fig.axes[0].lines[-1]
        assert np.array_equal(line.get_xdata(), getattr(curve, x))
        assert [t.get_text() for t in fig.legends[0].get_texts()] == ["border collision"]
    other = results({"A": np.array([1.0, 2.0]), "eps": np.array([0.1, 0.2])}, period=np.ones((2, 2), int))
    with pytest.raises(ValueError, match="curves"):
        map_figure(other, curves=[curve])


def test_power_is_half_m_v_squared_times_the_frequency():
    scene = Physical(a0=0.8e-3, omega0=150.0, mass=250.0, mu=0.6, alpha=3.4)
    speed = 2.0
    joules = 0.5 * scene.mass * scene.velocity(speed) ** 2
    watts = power(np.array([0.5 * speed**2]), *(np.array([v]) for v in (150.0, 0.6, 3.4, 250.0, Physical.g)))
    assert watts[0] == pytest.approx(joules * 150.0 / (2 * np.pi), rel=1e-12)


@pytest.mark.parametrize(
    ("record", "wish", "found"),
    [
        (("section",), {}, (None, "dxi")),
        (("summary",), {}, ("map", "period")),
        (("section", "summary"), {"quantity": "energy"}, ("map", "energy")),
        (("section", "summary"), {}, (None, "dxi")),
        (("section",), {"kind": "map", "quantity": "status"}, ("map", "status")),
    ],
)
def test_what_is_drawn_follows_from_what_is_recorded(record, wish, found):
    swept = SimpleNamespace(axes={"A": np.ones(2)}, scalars={}, record=record)
    assert choose_drawing(swept, **wish) == found


@pytest.mark.parametrize(
    ("record", "wish", "told"),
    [
        (("summary",), {"kind": "bifurcation"}, "kind = 'bifurcation': must be map: this sweep recorded summary"),
        (
            ("section",),
            {"quantity": "energy"},
            "quantity = 'energy': must be one of status, margin: this sweep recorded",
        ),
        (("summary",), {"kind": "map", "quantity": "xi"}, "quantity = 'xi': must be one of period"),
        (("summary",), {"quantity": "impact_power"}, "a power needs omega0, mu, alpha, mass"),
        (("summary",), {"kind": "chart"}, "kind = 'chart': must be one of bifurcation, poincare, map"),
    ],
)
def test_what_was_not_recorded_is_refused_in_one_line(record, wish, told):
    swept = SimpleNamespace(axes={"A": np.ones(2)}, scalars={}, record=record)
    with pytest.raises(ValueError, match="must be") as refused:
        choose_drawing(swept, **wish)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_what_is_asked_for_now_comes_before_the_configuration():
    wanted = {"kind": "map", "quantity": "energy", "limits": (0.1, 30.0)}
    assert merge_wishes(wanted, {}) == wanted
    assert merge_wishes(wanted, {"quantity": "period"}) == {"kind": "map", "quantity": "period"}
    assert merge_wishes(wanted, {"kind": "bifurcation"}) == {"kind": "bifurcation"}
