"""A map shows each point of a sweep once, at the right position, with the colour of its value.

A note gives the number of points of each status other than OK.
"""

from types import SimpleNamespace

import matplotlib.image
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb

import vibrodrive as vd
from vibrodrive.figures.colours import APART, MANY, digits, paint, states
from vibrodrive.figures.limits import limits_map
from vibrodrive.figures.looks import HATCHED, LOOKS
from vibrodrive.figures.map import borders_of, map_figure
from vibrodrive.figures.style import save
from vibrodrive.model.choices import Status
from vibrodrive.model.drawing import choose_drawing, merge_options
from vibrodrive.model.names import Settings
from vibrodrive.model.physical import Scene, power
from vibrodrive.periodic.curve import Curve
from vibrodrive.store.limits import Limits

SCREEN = LOOKS["screen"]
PALETTE = SCREEN.classes
UNDER, OVER = SCREEN.beyond
HOLDS, BROKEN = SCREEN.kept


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
    """Return (ends of the abscissa, ends of the ordinate, colours) of the map; a colour is hexadecimal or "none"."""
    (image,) = fig.axes[0].images
    left, right, low, high = image.get_extent()
    colours = [["none" if v[3] == 0 else to_hex(v) for v in row] for row in image.to_rgba(image.get_array())]
    return [left, right], [low, high], colours


def note_texts(fig):
    """Return the note above the map."""
    return fig.axes[0].get_title(loc="left").replace("\n", " ")


def pixels(fig, dpi):
    """Return the hexadecimal colours of the pixels of the drawn map: (rows, columns), lowest row first."""
    fig.dpi = dpi
    canvas = FigureCanvasAgg(fig)
    canvas.draw()
    box = fig.axes[0].get_window_extent()
    image = np.asarray(canvas.buffer_rgba())[::-1]
    inside = image[round(box.y0) + 2 : round(box.y1) - 1, round(box.x0) + 2 : round(box.x1) - 1, :3]
    return np.array([[to_hex(c / 255) for c in row] for row in inside])


def test_cells_have_the_colours_of_their_periods(plane):
    x, y, colours = cells(map_figure(plane))
    assert x == [0.5, 3.5]
    assert y == pytest.approx([0.05, 0.25])
    assert colours[0] == [PALETTE[0], PALETTE[2], PALETTE[8]], "B = 0.1: periods 1, 3, more"
    assert colours[1] == [PALETTE[1], PALETTE[7], PALETTE[9]], "B = 0.2: periods 2, 8, none"
    assert [t.get_text() for t in map_figure(plane).axes[1].get_yticklabels()] == [*"12345678", "more", "none"]


def test_axes_may_be_exchanged_and_come_in_any_order(plane):
    _, _, straight = cells(map_figure(plane))
    _, _, turned = cells(map_figure(plane, x="B"))
    assert np.array_equal(np.transpose(straight), turned)
    back = results({"A": plane.axes["A"][::-1], "B": plane.axes["B"]}, period=plane.period[::-1])
    assert cells(map_figure(back))[2] == straight


def lightness(colour):
    """Return the lightness CIE L*, 0 to 100."""
    return 116.0 * float(np.dot(np.array(to_rgb(colour)) ** 2.2, (0.2126, 0.7152, 0.0722))) ** (1 / 3) - 16.0


@pytest.mark.parametrize(("style", "apart"), [("screen", 0.0), ("print", 10.0)])
def test_classes_stay_apart_in_grey(style, apart):
    """Each class is darker than the previous one. In print, which has only greys, each step is clearly visible."""
    light = np.array([lightness(c) for c in LOOKS[style].classes])
    assert (-np.diff(light) > apart).all()
    assert lightness(APART) - light[0] > apart


def test_sign_is_visible_in_print():
    grey = [lightness(c) for c in LOOKS["print"].signed(np.linspace(0, 1, 256))[:, :3]]
    assert min(grey[:128]) > max(grey[128:]) + 20


@pytest.mark.parametrize("quantity", ["period", "energy", "lyapunov", "status", "kept"])
def test_print_is_black_and_white(plane, quantity, tmp_path):
    plane.status[:2, 1] = Status.TOO_CLOSE, Status.NEVER_LEAVES
    plane.gaps = plane.period
    plane.energy = plane.lyapunov = np.array([[1e-3, -1.0], [0.5, 1.0], [7.0, np.nan]])
    curve = Curve("fold", 1, 1, (), 1, np.array([1.0, 3.0]), np.array([0.1, 0.2]), ("edge", "edge"), ())
    limits = (0.1, 2.0) if quantity == "energy" else None
    gaps = np.array([[1, 1]] * 2 + [[0, 1]]) if quantity == "kept" else None
    known = {"undisturbed": gaps, "curves": [curve], "limits": limits}
    for style, coloured in (("print", False), ("screen", True)):
        path = save(map_figure(plane, quantity, style=style, **known), tmp_path / "x.png", 60)
        seen = matplotlib.image.imread(path)[..., :3]
        assert (np.ptp(seen, axis=-1).max() > 0.1) == coloured


def test_point_without_a_value_is_hatched_in_print(plane):
    plane.energy = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, np.nan]])
    plane.status[0, 0] = Status.NOT_COMPUTED
    fig = map_figure(plane, "energy", style="print")
    colours = cells(fig)[2]
    assert colours[0][0] == colours[1][2] == "none"
    assert [patch.get_hatch() for patch in fig.axes[0].patches] == [HATCHED["hatch"]]
    assert [t.get_text() for t in fig.legends[0].get_texts()] == ["no such value or not computed"]


def test_missing_and_resting_points_have_no_class(plane):
    plane.status[0, 0], plane.status[1, 1] = Status.NOT_COMPUTED, Status.NEVER_LEAVES
    fig = map_figure(plane)
    colours = cells(fig)[2]
    assert (colours[0][0], colours[1][1]) == ("none", to_hex(APART))
    assert "at rest permanently: 1 of 6 points, not computed: 1" in note_texts(fig)
    assert {t.get_text() for t in fig.legends[0].get_texts()} == {"rests", "not computed"}
    assert [patch.get_hatch() for patch in fig.axes[0].patches] == [HATCHED["hatch"]]


def test_gaps_and_sequences_are_named(plane):
    plane.gaps = np.array([[1, 1], [1, 122], [12, 0]])
    bar = map_figure(plane, "gaps").axes[1]
    assert [t.get_text() for t in bar.get_yticklabels()] == ["1", "1, 2", "1, 2, 2", "none"]
    assert digits(122) == "1, 2, 2"
    number = 0
    for state in (vd.State.UP, vd.State.STICK, vd.State.IMPACT):
        number = 6 * number + int(state) + 1
    assert states(number) == "USI"


@pytest.mark.jit
def test_letters_of_a_sequence_are_the_states_of_the_motion():
    swept = vd.sweep(A=[1.5], transient=100, periods=5, record="summary")
    seen = vd.simulate(1.5, transient=100, periods=5).switches["after"][:5]
    letters = "".join(vd.State(s).name[0] for s in seen)
    found = states(int(swept.sequence[0]))
    assert found in letters + letters
    assert len(found) == 5


def test_quantity_over_decades_has_a_logarithmic_scale(plane):
    plane.energy = np.array([[0.0, 1e-3], [1e-1, 1.0], [10.0, np.nan]])
    fig = map_figure(plane, "energy")
    assert fig.axes[1].get_yscale() == "log"
    assert {t.get_text() for t in fig.legends[0].get_texts()} == {"0", "no such value"}
    plane.energy = np.linspace(1.0, 2.0, 6).reshape(3, 2)
    assert map_figure(plane, "energy").axes[1].get_yscale() == "linear"
    plane.energy[0, 0], plane.status[0, 0] = 0.0, Status.NEVER_LEAVES
    at_rest = map_figure(plane, "energy")
    assert (at_rest.axes[1].get_yscale(), cells(at_rest)[2][0][0]) == ("linear", to_hex(APART))
    assert [t.get_text() for t in at_rest.legends[0].get_texts()] == ["rests"]
    plane.status[0, 0] = Status.OK
    low, high = map_figure(plane, "energy", limits=(0.5, 4.0)).axes[1].get_ylim()
    assert (low, high) == (0.5, 4.0)


def test_energies_of_rounding_size_do_not_extend_the_scale(plane):
    plane.energy = np.array([[0.0, 1e-20], [1e-1, 1.0], [10.0, np.nan]])
    fig = map_figure(plane, "energy")
    assert fig.axes[1].get_ylim() == pytest.approx((1e-8, 10.0))
    assert cells(fig)[2][1][0] == UNDER, "1e-20 must have the colour of values below the scale"


@pytest.mark.parametrize("limits", [(5e-3, 1.0), (0.5, 1.0)])
def test_values_beyond_the_limits_have_the_end_colours(plane, limits):
    plane.energy = np.array([[0.0, 1e-3], [0.7, 1.0], [10.0, np.nan]])
    fig = map_figure(plane, "energy", limits=limits)
    colours = cells(fig)[2]
    assert colours[1][0] == UNDER, "1e-3 is below the scale"
    assert colours[0][2] == OVER, "10 is above the scale"
    assert not {colours[0][1], colours[1][1]} & {UNDER, OVER}, "0.7 and 1 are on the scale"
    assert colours[0][0] == (to_hex(APART) if limits[0] == 5e-3 else UNDER), (
        "0 must have a separate colour if the scale is logarithmic"
    )
    bar = fig.axes[1]
    assert bar.get_yscale() == ("log" if limits[0] == 5e-3 else "linear")
    ends = [to_hex(p.get_facecolor()) for p in bar.patches if len(p.get_path().vertices) < 6]
    assert set(ends) >= {UNDER, OVER}
    plane.energy = np.full((3, 2), 0.75)
    assert not {UNDER, OVER} & {c for row in cells(map_figure(plane, "energy", limits=limits))[2] for c in row}
    line = results({"A": np.linspace(1, 3, 4)}, energy=np.array([1e-3, 0.6, 0.8, 5.0]))
    _, below, above = map_figure(line, "energy", limits=limits).axes[0].lines
    assert (np.flatnonzero(np.isfinite(below.get_ydata())), below.get_marker()) == (0, "v")
    assert (np.flatnonzero(np.isfinite(above.get_ydata())), above.get_marker()) == (3, "^")


@pytest.mark.parametrize("quantity", ["friction_loss", "lyapunov"])
def test_few_extreme_values_do_not_set_the_scale(quantity):
    values = np.linspace(1.0, 2.0, MANY)
    values[0], values[-1] = -50.0, 60.0
    painted = paint(quantity, values, np.full(MANY, Status.OK), None)
    assert 1.99 < painted.norm.vmax < 2.0
    assert painted.extend == "both"
    few = paint(quantity, values[1:], np.full(MANY - 1, Status.OK), None)
    assert few.norm.vmax == 60.0


def test_cells_match_their_values_and_the_rarest_class_of_a_pixel_is_shown():
    """A line one cell wide and a single cell are visible on a map with more cells than pixels, at any resolution."""
    eps = np.geomspace(1e-6, 1e-2, 1500)
    period = np.ones((1500, 1500), np.int8)
    period[1237, :] = 2  # one value of A
    period[400, np.argmin(np.abs(eps - 1e-3))] = 3
    fig = map_figure(results({"A": np.linspace(1.0, 4.0, 1500), "eps": eps}, period=period))
    for dpi in (40, 120):
        seen = pixels(fig, dpi)
        assert set(np.unique(seen)) == {to_hex(c) for c in PALETTE[:3]}
        columns = np.flatnonzero((seen == to_hex(PALETTE[1])).all(axis=0))
        assert columns / seen.shape[1] == pytest.approx(1237.5 / 1500, abs=1.5 / seen.shape[1])
        ((row, column),) = np.argwhere(seen == to_hex(PALETTE[2]))
        assert row / seen.shape[0] == pytest.approx(0.75, abs=2.5 / seen.shape[0]), "1e-3 is at 3/4 of the four decades"
        assert column / seen.shape[1] == pytest.approx(400.5 / 1500, abs=2.5 / seen.shape[1])


def test_megapixel_is_a_small_file(tmp_path):
    noise = np.random.default_rng(0).integers(1, 9, (1000, 1000))
    fig = map_figure(results({"A": np.linspace(1, 2, 1000), "B": np.linspace(0.1, 0.2, 1000)}, period=noise))
    for ending in ("png", "pdf", "svg"):
        assert save(fig, tmp_path / f"x.{ending}").stat().st_size < 2_000_000


def test_cells_of_unequal_width_keep_their_width():
    A = np.array([1.0, 2.0, 5.0])  # cells from 0.5 to 1.5, 3.5, 6.5
    row = cells(map_figure(results({"A": A, "B": np.array([0.1, 0.2])}, period=np.array([[1, 1], [2, 2], [3, 3]]))))[2][
        0
    ]
    assert [row.count(to_hex(c)) / len(row) for c in PALETTE[:3]] == pytest.approx([1 / 6, 2 / 6, 3 / 6], abs=0.01)


def test_exponent_has_its_zero_in_the_middle(plane):
    plane.lyapunov = np.array([[-np.inf, -2.0], [-1.0, 0.1], [0.5, -0.2]])
    fig = map_figure(plane, "lyapunov")
    assert fig.axes[1].get_ylim() == (-2.0, 2.0)
    assert [t.get_text() for t in fig.legends[0].get_texts()] == ["rests"]


def test_borders_are_midpoints_on_the_scale_of_the_axis():
    assert borders_of(np.geomspace(1e-6, 1e-2, 3)) == pytest.approx([-7.0, -5.0, -3.0, -1.0])
    assert borders_of(np.array([1.0, 2.0, 5.0])).tolist() == [0.5, 1.5, 3.5, 6.5]
    assert borders_of(np.array([2.0])).tolist() == [1.5, 2.5]
    eps = results({"A": np.array([1.0, 2.0]), "eps": np.geomspace(1e-6, 1e-2, 5)}, gaps=np.ones((2, 5), int))
    assert map_figure(eps, "gaps").axes[0].get_yscale() == "log"


def test_one_axis_has_marks_and_a_third_is_named():
    line = results({"A": np.linspace(1, 3, 5)}, period=np.array([1, 1, 2, 2, 0], np.int8))
    (marks,) = map_figure(line).axes[0].lines
    assert marks.get_ydata().tolist() == [0, 0, 1, 1, len(PALETTE) - 1]
    axes = {"A": np.linspace(1, 3, 4), "B": np.linspace(0.1, 0.2, 3), "tau0": np.array([0.5, 1.0])}
    fig = map_figure(results(axes, period=np.arange(24).reshape(4, 3, 2)))
    assert r"$\tau_0 = 0.5$ (first of 2)" in note_texts(fig)
    assert np.shape(cells(fig)[2]) == (3, 4)


def test_curves_are_drawn_over_a_map_of_a_and_b(plane):
    curve = Curve("border", 1, 1, (), 1, np.array([1.0, 3.0]), np.array([0.1, 0.2]), ("edge", "edge"), ())
    for x in ("A", "B"):
        fig = map_figure(plane, x=x, curves=[curve])
        line = fig.axes[0].lines[-1]
        assert np.array_equal(line.get_xdata(), getattr(curve, x))
        assert [t.get_text() for t in fig.legends[0].get_texts()] == ["border collision"]
    other = results({"tau0": np.array([1.0, 2.0]), "eps": np.array([0.1, 0.2])}, period=np.ones((2, 2), int))
    with pytest.raises(ValueError, match="curves"):
        map_figure(other, curves=[curve])


def scene(x, y):
    """Return results over two axes of a scene. All other quantities have one value."""
    fixed = {"a0": 0.8e-3, "omega0": 150.0, "mu": 0.6, "alpha": 3.4, "g": Scene.g}
    ranges = {"omega0": (80.0, 200.0), "a0": (0.3e-3, 1.2e-3), "mu": (0.3, 0.9), "alpha": (1.0, 9.0), "A": (1.0, 8.0)}
    axes = {name: np.linspace(*ranges[name], 3) for name in (x, y)}
    swept = results(axes, period=np.ones((3, 3), int))
    swept.scalars = {name: value for name, value in fixed.items() if name not in axes}
    if "alpha" not in axes and "mu" not in axes:
        swept.scalars["B"] = Scene.quiet(omega0=1.0, mu=0.6, alpha=3.4).B
    if "A" in axes:
        del swept.scalars["a0"]
    return swept


class Straight(Curve):
    """Curve whose A is a known function of B."""

    def at(self, B):
        return np.array([1.0 + 20.0 * B])


@pytest.mark.parametrize(
    ("x", "y"),
    [("omega0", "a0"), ("a0", "omega0"), ("alpha", "a0"), ("mu", "a0"), ("omega0", "alpha"), ("alpha", "A")],
)
def test_curves_are_drawn_over_a_map_of_scene_axes(x, y):
    B = np.linspace(0.0, 0.5, 201)
    curve = Straight("border", 1, 1, (), 1, 1.0 + 20.0 * B, B, ("edge", "edge"), ())
    swept = scene(x, y)
    fig = map_figure(swept, x=x, y=y, curves=[curve])
    ax = fig.axes[0]
    line = ax.lines[-1]
    assert ax.get_xlabel().endswith({"omega0": "rad/s", "a0": "mm", "alpha": "°", "mu": "$"}[x])
    for u, v in line.get_xydata()[:: len(line.get_xydata()) // 7]:
        shown = {x: u, y: v}
        if "a0" in shown:
            shown["a0"] *= 1e-3
        here = Scene.quiet(**({"a0": 1e-3} | {n: w for n, w in (swept.scalars | shown).items() if n not in "AB"}))
        assert shown.get("A", here.A) == pytest.approx(1.0 + 20.0 * here.B, rel=1e-9)
    assert "numbers on curves: period" in note_texts(fig)


def test_curves_outside_the_map_are_refused():
    far = Curve("border", 1, 1, (), 1, np.array([1.0, 3.0]), np.array([0.3, 0.4]), ("edge", "edge"), ())
    with pytest.raises(ValueError, match=r"^curves: must reach B = 0\.099"):
        map_figure(scene("omega0", "a0"), curves=[far])
    with pytest.raises(ValueError, match="this map is over alpha, mu"):
        map_figure(scene("alpha", "mu"), x="alpha", curves=[far])


@pytest.fixture
def disturbed():
    gaps = np.array([[1, 1, 2], [122, 0, 122], [0, 0, 1]])
    return results({"A": np.array([1.0, 2.0, 3.0]), "eps": np.geomspace(1e-6, 1e-4, 3)}, gaps=gaps)


def test_structure_is_kept_if_the_gaps_equal_the_undisturbed_gaps(disturbed):
    fig = map_figure(disturbed, "kept", undisturbed=np.array([[1], [122], [0]]))
    by_A = np.transpose(cells(fig)[2]).tolist()
    assert by_A == [[HOLDS, HOLDS, BROKEN], [HOLDS, BROKEN, HOLDS], [to_hex(SCREEN.lacking)] * 3]
    assert [t.get_text() for t in fig.axes[1].get_yticklabels()] == ["kept", "lost"]
    assert [t.get_text() for t in fig.legends[0].get_texts()] == ["no structure to keep"]
    with pytest.raises(ValueError, match="undisturbed = None: must be"):
        map_figure(disturbed, "kept")


def limits_over(axes, k2, **fixed):
    k2 = np.array(k2)
    return Limits(
        axes=axes, fixed=fixed, numbers={"k2": k2}, n=np.ones(k2.shape, int), done=np.ones(k2.shape, bool),
        how=np.full(k2.shape, ""), criterion="impacts", title="",
    )  # fmt: skip


def test_limit_is_a_line_over_the_map(disturbed):
    found = limits_over(
        {"A": np.array([1.0, 2.5, 3.0])}, [[1e-5, 2e-5, np.inf], [1.0] * 3, [1.0] * 3], B=0.1, eta=101.0
    )
    for x, order in (("A", slice(None)), ("eps", slice(None, None, -1))):
        fig = map_figure(disturbed, "gaps", x=x, k2=found)
        line = fig.axes[0].lines[-1]
        assert line.get_xydata()[:2, order].tolist() == [[1.0, 1e-5], [2.5, 2e-5]]
        assert np.isnan(line.get_xydata()[2]).any()
        assert any("k_2" in t.get_text() for t in fig.legends[0].get_texts())
    for other in (
        limits_over({"A": np.array([1.0, 2.0])}, np.ones((3, 2)), B=0.2, eta=101.0),
        limits_over({"B": np.array([0.1, 0.2])}, np.ones((3, 2)), A=2.0, eta=101.0),
    ):
        with pytest.raises(ValueError, match="limits "):
            map_figure(disturbed, "gaps", k2=other)


def test_limits_over_two_axes_are_a_map_of_k2():
    axes = {"A": np.array([1.0, 2.0, 3.0]), "B": np.array([0.1, 0.2])}
    k2 = np.ones((3, 3, 2))
    k2[0] = [[1e-6, 1e-3], [np.inf, np.nan], [1e-4, 1e-5]]
    found = limits_over(axes, k2, eta=101.0)
    found.done[0, 2, 1] = False
    fig = limits_map(found)
    colours = cells(fig)[2]
    assert (colours[0][1], colours[1][1], colours[1][2]) == (to_hex(APART), to_hex(SCREEN.lacking), "none")
    assert len({c for row in colours for c in row}) == 6
    named = {t.get_text() for t in fig.legends[0].get_texts()}
    assert named == {"no limit found", "no periodic motion", "not computed"}
    assert fig.axes[1].get_yscale() == "log"
    with pytest.raises(ValueError, match="kind"):
        limits_map(limits_over({"A": axes["A"]}, np.ones((3, 3)), B=0.1, eta=101.0))


def test_power_is_half_m_v_squared_times_the_frequency():
    scene = Scene(a0=0.8e-3, omega0=150.0, mass=250.0, mu=0.6, alpha=3.4)
    speed = 2.0
    joules = 0.5 * scene.mass * scene.velocity(speed) ** 2
    watts = power(np.array([0.5 * speed**2]), *(np.array([v]) for v in (150.0, 0.6, 3.4, 250.0, Scene.g)))
    assert watts[0] == pytest.approx(joules * 150.0 / (2 * np.pi), rel=1e-12)


@pytest.mark.parametrize(
    ("record", "wish", "found"),
    [
        (("section",), {}, ("bifurcation", "dxi")),
        (("summary",), {}, ("map", "period")),
        (("error",), {}, ("map", "status")),
        (("section", "summary"), {"quantity": "energy"}, ("map", "energy")),
        (("section", "summary"), {}, ("bifurcation", "dxi")),
        (("section",), {"kind": "map", "quantity": "status"}, ("map", "status")),
        (("summary",), {"quantity": "kept"}, ("map", "kept")),
        (("section", "impacts"), {"quantity": "impact_speed"}, ("bifurcation", "impact_speed")),
        (("impacts",), {}, ("bifurcation", "impact_phase")),
    ],
)
def test_default_drawing_follows_from_the_record(record, wish, found):
    swept = SimpleNamespace(axes={"A": np.ones(2)}, scalars={}, record=record)
    assert choose_drawing(swept, **wish) == found


@pytest.mark.parametrize("count", [1, 2, 5, 12, 400])
@pytest.mark.parametrize(
    ("axes", "found"),
    [
        ((), ("poincare", "dxi")),
        (("A",), ("bifurcation", "dxi")),
        (("eps",), ("bifurcation", "dxi")),
        (("xi0",), ("bifurcation", "dxi")),
        (("A", "xi0", "tau0"), ("bifurcation", "dxi")),
        (("xi0", "tau0"), ("map", "last_dxi")),
    ],
)
def test_kind_of_a_figure_does_not_depend_on_the_number_of_values(axes, found, count):
    swept = SimpleNamespace(axes={name: np.ones(count) for name in axes}, scalars={}, record=("section",))
    assert choose_drawing(swept) == found


@pytest.mark.parametrize(
    ("record", "wish", "told"),
    [
        (
            ("summary",),
            {"kind": "bifurcation"},
            "kind = 'bifurcation': must be map, because this sweep recorded summary",
        ),
        (
            ("section",),
            {"quantity": "energy"},
            "quantity = 'energy': must be one of last_xi, last_dxi, status, margin, because this sweep recorded section"
            ', and energy needs record = "summary"',
        ),
        (("summary",), {"kind": "map", "quantity": "xi"}, "quantity = 'xi': must be one of period"),
        (("section",), {"quantity": "impact_speed"}, "must be left out, because this sweep recorded section"),
        (
            ("impacts",),
            {"quantity": "xi"},
            "must be one of impact_phase, impact_speed, because this sweep recorded impacts",
        ),
        (("impacts",), {"kind": "poincare"}, "must be map or bifurcation, because this sweep recorded impacts"),
        (("summary",), {"quantity": "impact_power"}, "impact_power needs omega0, mu, alpha, mass"),
        (("summary",), {"kind": "chart"}, "kind = 'chart': must be one of bifurcation, poincare, map"),
        (("section",), {"kind": "poincare", "x": "A"}, "x = 'A': must be left out for a figure of kind poincare"),
        (("section",), {"kind": "bifurcation", "y": "A"}, "y = 'A': must be left out for a figure of kind bifurcation"),
    ],
)
def test_drawing_without_its_record_is_refused_in_one_line(record, wish, told):
    swept = SimpleNamespace(axes={"A": np.ones(2)}, scalars={}, record=record)
    with pytest.raises(ValueError, match="must be") as refused:
        choose_drawing(swept, **wish)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_options_override_the_configured_drawing():
    wanted = {"kind": "map", "quantity": "energy", "limits": (0.1, 30.0)}
    assert merge_options(wanted, {}) == wanted
    assert merge_options(wanted, {"quantity": "period"}) == {"kind": "map", "quantity": "period"}
    assert merge_options(wanted, {"kind": "bifurcation"}) == {"kind": "bifurcation"}
    assert merge_options({"kind": "poincare"}, {"quantity": "xi"}) == {"quantity": "xi"}
    assert merge_options({"x": "A", "y": "B"}, {"quantity": "xi"}) == {"x": "A", "quantity": "xi"}
    assert merge_options({"x": "A", "quantity": "xi"}, {"kind": "poincare"}) == {"kind": "poincare"}
