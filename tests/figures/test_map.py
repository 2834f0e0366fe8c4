"""A map shows each point of a sweep once, at the right position, with the colour of its value.

A note gives the number of points of each status other than OK.
"""

from types import SimpleNamespace

import matplotlib.image
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgba_array

import vibrodrive as vd
from tests.figures import made
from tests.support import fake
from vibrodrive.batch.block import gather
from vibrodrive.figures.colours import APART, MANY, SHADES, paint
from vibrodrive.figures.drawing import choose_drawing, merge_options
from vibrodrive.figures.image import borders_of, is_geometric
from vibrodrive.figures.looks import HATCHED, LOOKS
from vibrodrive.figures.map import map_figure
from vibrodrive.figures.plane import Exact, joined
from vibrodrive.figures.sections import full_range
from vibrodrive.figures.style import save
from vibrodrive.model.choices import UNSEEN, Status
from vibrodrive.model.names import NAMES
from vibrodrive.model.physical import Scene
from vibrodrive.model.plan import make_plan
from vibrodrive.model.quantities import QUANTITIES
from vibrodrive.model.records import check_record, quantities
from vibrodrive.model.states import states

SCREEN = LOOKS["screen"]
PALETTE = SCREEN.classes
UNDER, OVER = map(to_hex, SCREEN.beyond)
KEPT, LOST = SCREEN.kept
GREY = to_hex(SCREEN.lacking)


def results(axes, **arrays):
    return made.results(axes, ("summary",), **arrays)


@pytest.fixture
def plane():
    axes = {"A": [1.0, 2.0, 3.0], "B": [0.1, 0.2]}
    return results(axes, period=np.array([[1, 2], [3, 8], [9, 0]], np.int8))


def cells(fig):
    """Return (ends of the abscissa, ends of the ordinate, colours) of the map; a colour is hexadecimal or "none"."""
    (image,) = fig.axes[0].images
    left, right, low, high = image.get_extent()
    shown = image.reduced(image.get_array(), image.get_array().shape) / 255.0
    colours = [["none" if v[3] == 0 else to_hex(v) for v in row] for row in shown]
    return [left, right], [low, high], colours


def key(fig):
    return [t.get_text() for t in fig.legends[0].get_texts()] if fig.legends else []


def note(fig):
    return fig.axes[0].get_title(loc="left").replace("\n", " ")


def test_cells_have_the_colours_of_their_periods(plane):
    fig = map_figure(plane)
    x, y, colours = cells(fig)
    assert (x, y) == ([0.5, 3.5], pytest.approx([0.05, 0.25]))
    assert colours[0] == [PALETTE[0], PALETTE[2], PALETTE[8]], "B = 0.1: periods 1, 3, more"
    assert colours[1] == [PALETTE[1], PALETTE[7], PALETTE[9]], "B = 0.2: periods 2, 8, none"
    assert [t.get_text() for t in fig.axes[1].get_yticklabels()] == [*"12345678", "9 to 64", "none up to 64"]
    assert np.array_equal(np.transpose(colours), cells(map_figure(plane, x="B"))[2])
    back = results({"A": plane.axes["A"][::-1], "B": plane.axes["B"]}, period=plane.period[::-1])
    assert cells(map_figure(back))[2] == colours


@pytest.mark.parametrize("quantity", ["period", "energy", "kept"])
def test_print_is_black_and_white(plane, quantity, tmp_path):
    plane.status[:2, 1] = Status.TOO_CLOSE, Status.NEVER_LEAVES
    plane.gaps, plane.energy = plane.period, np.array([[1e-3, -1.0], [0.5, 1.0], [7.0, np.nan]])
    known = {"over": [Exact("fold", 1, 1, 1.0, 0.1), Exact("fold", 1, 1, 2.5, 0.2)]}
    known |= {"limits": (0.1, 2.0)} if quantity == "energy" else {}
    known |= {"undisturbed": np.array([[1, 1]] * 2 + [[0, 1]])} if quantity == "kept" else {}
    path = save(map_figure(plane, quantity, style="print", **known), tmp_path / "x.png", 40)
    assert np.ptp(matplotlib.image.imread(path)[..., :3], axis=-1).max() < 0.1


@pytest.mark.parametrize("style", ["screen", "print"])
def test_points_without_a_value_have_no_class_and_are_counted(plane, style):
    plane.status[0, 0], plane.status[1, 1] = Status.NOT_COMPUTED, Status.NEVER_LEAVES
    plane.period[2, 0] = UNSEEN
    fig = map_figure(plane, style=style)
    colours = cells(fig)[2]
    unseen = GREY if style == "screen" else "none"
    assert (colours[0][0], colours[1][1], colours[0][2]) == ("none", to_hex(APART), unseen)
    for text in ("record too short at 1 point,", "at rest permanently: 1 of 6 points, not computed: 1"):
        assert text in note(fig)
    grey = {"record too short", "not computed"} if style == "screen" else {"record too short or not computed"}
    assert set(key(fig)) == {"rests"} | grey
    assert [patch.get_hatch() for patch in fig.axes[0].patches] == [HATCHED["hatch"]]


def test_gaps_and_sequences_are_named(plane):
    plane.gaps = np.array([[1, 1], [1, 122], [12, 0]])
    assert [t.get_text() for t in map_figure(plane, "gaps").axes[1].get_yticklabels()] == [
        "1",
        "1, 2",
        "1, 2, 2",
        "none",
    ]


@pytest.mark.jit
def test_letters_of_a_sequence_are_the_states_of_the_motion():
    swept = vd.sweep(A=[1.5], transient=100, periods=5, record="summary")
    seen = vd.simulate(1.5, transient=100, periods=5).switches["after"][:5]
    letters = "".join(vd.State(s).name[0] for s in seen)
    found = states(int(swept.sequence[0]))
    assert found in letters + letters
    assert len(found) == 5


def test_scale_is_logarithmic_over_decades_and_its_ends_have_colours(plane):
    plane.energy = np.array([[0.0, 1e-20], [1e-1, 1.0], [10.0, np.nan]])
    fig = map_figure(plane, "energy")
    colours = cells(fig)[2]
    assert (fig.axes[1].get_yscale(), fig.axes[1].get_ylim()) == ("log", pytest.approx((1e-8, 10.0)))
    assert set(key(fig)) == {"0", "no such value"}
    assert (colours[0][0], colours[1][0], colours[1][2]) == (to_hex(APART), UNDER, GREY)
    fig = map_figure(plane, "energy", limits=(0.5, 4.0))
    colours = cells(fig)[2]
    assert (fig.axes[1].get_yscale(), fig.axes[1].get_ylim()) == ("linear", (0.5, 4.0))
    assert (colours[0][0], colours[0][2]) == (UNDER, OVER)
    assert colours[1][1] not in (UNDER, OVER)
    assert {to_hex(p.get_facecolor()) for p in fig.axes[1].patches} >= {UNDER, OVER}
    line = results({"A": np.linspace(1, 3, 4)}, energy=np.array([1e-3, 0.6, 0.8, 5.0]))
    _, below, above = map_figure(line, "energy", limits=(0.5, 1.0)).axes[0].lines
    assert (np.flatnonzero(np.isfinite(below.get_ydata())), below.get_marker()) == (0, "v")
    assert (np.flatnonzero(np.isfinite(above.get_ydata())), above.get_marker()) == (3, "^")


ENERGY = np.array([[1e-3, 0.5], [1.0, 2.0], [9.0, np.nan]])


def test_colours_are_those_of_a_map_of_ones_own(plane):
    """A name, a Colormap and `set_cmap` color the values; the image holds them, and the bar and the key follow."""
    plane.energy, plane.status[0, 0] = ENERGY, Status.NEVER_LEAVES
    magma = matplotlib.colormaps["magma"]
    norm = matplotlib.colors.Normalize(0.4, 3.0)
    shade = to_hex(magma(norm(2.0)))
    named, given, later = (map_figure(plane, "energy", limits=(0.4, 3.0), cmap=c) for c in ("magma", magma, None))
    later.axes[0].images[0].set_cmap("magma")
    for fig, above in ((named, OVER), (given, to_hex(magma(1.0))), (later, to_hex(magma(1.0)))):
        image, colours = fig.axes[0].images[0], cells(fig)[2]
        assert np.array_equal(image.get_array().filled(np.nan).T, [[np.nan, 0.5], *ENERGY[1:]], equal_nan=True)
        shown = [colours[1][1], colours[0][0], colours[1][2], colours[0][2]]
        assert np.allclose(to_rgba_array(shown), to_rgba_array([shade, APART, GREY, above]), atol=0.02)
        assert key(fig) == ["rests", "no such value"]
        fig.draw_without_rendering()
        bar = fig.axes[1].collections[-1]
        assert np.allclose(bar.cmap(bar.norm(2.0)), magma(norm(2.0)), atol=0.02)


def test_classes_have_the_colours_of_a_map_of_ones_own(plane):
    named, later = map_figure(plane, cmap="viridis"), map_figure(plane)
    names = [t.get_text() for t in later.axes[1].get_yticklabels()]
    later.axes[0].images[0].set_cmap("viridis")
    for fig in (named, later):
        image, colours = fig.axes[0].images[0], cells(fig)[2]
        assert image.get_array().tolist() == [[0, 2, 8], [1, 7, 9]]
        assert len({c for row in colours for c in row}) == 6
        assert [t.get_text() for t in fig.axes[1].get_yticklabels()] == names
    ends = [to_hex(c) for c in matplotlib.colormaps["viridis"]([0.0, 1.0])]
    assert [cells(named)[2][0][0], cells(named)[2][1][2]] == ends


def test_cursor_reads_the_value_of_a_cell(plane):
    plane.energy = ENERGY
    fig = map_figure(plane, "energy")
    fig.draw_without_rendering()
    ax = fig.axes[0]
    for (k, m), value in np.ndenumerate(ENERGY[:2]):
        x, y = ax.transData.transform((plane.axes["A"][k], plane.axes["B"][m]))
        assert ax.images[0].get_cursor_data(SimpleNamespace(x=x, y=y)) == value


LINEAR, DECADES, ONE = np.linspace(1.0, 2.0, 2 * MANY), np.geomspace(1.0, 1e3, 2 * MANY), np.full(2 * MANY, 1.0)


@pytest.mark.parametrize(
    ("most", "few", "cut"),
    [(LINEAR, 2.9, False), (LINEAR, 3.1, True), (LINEAR, 0.1, False), (LINEAR, -0.1, True), (DECADES, 9e4, False),
     (DECADES, 2e5, True), (DECADES, 0.02, False), (DECADES, 1e-3, True), (ONE, 9.0, False), (ONE, 0.1, False)],
)  # fmt: skip
def test_extreme_is_out_of_the_scale_only_where_it_would_hide_the_others(most, few, cut):
    values = np.append(most, [few] * 8)
    painted = paint(QUANTITIES["energy"], values, np.full(values.size, Status.OK), None)
    assert painted.extend == ("neither" if not cut else "max" if few > most.max() else "min")
    assert painted.counts[SHADES:].sum() <= 16
    assert cut or {painted.norm.vmin, painted.norm.vmax} == {values.min(), values.max()}
    some = values[1 - MANY :]
    assert paint(QUANTITIES["energy"], some, np.full(some.size, Status.OK), None).extend == "neither", "too few"


def test_extremes_are_stated_with_their_points(plane):
    plane.energy = np.array([[0.5, 1e-20], [0.5, 1.0], [60.0, np.nan]])
    plane.status[0, 1] = Status.NEVER_LEAVES
    fig = map_figure(plane, "energy", x="B", limits=(0.6, 2.0))
    assert "least $0.5$ at 2 points, largest $60$ at $A = 3$, $B = 0.1$," in note(fig)
    plane.energy[:] = 1.0
    assert "largest" not in note(map_figure(plane, "energy")), "one value has no place"


@pytest.mark.parametrize("size", [1e-6, 1.0])
def test_values_that_differ_by_rounding_are_one_value(size):
    noise = size * (1.0 + 1e-14 * np.random.default_rng(4).random((40, 50)))
    axes = {"A": np.linspace(1, 2, 40), "B": np.linspace(0.1, 0.2, 50)}
    fig = map_figure(results(axes, energy=noise), "energy")
    line = map_figure(results({"A": axes["A"]}, energy=noise[:, 0]), "energy")
    for low, high in (fig.axes[1].get_ylim(), line.axes[0].get_ylim(), full_range([noise])):
        assert low < 0.9 * size < 1.1 * size < high
    assert np.ptp(to_rgba_array([c for row in cells(fig)[2] for c in row]), axis=0).max() < 0.01
    two = noise * np.repeat([1.0, 3.0], 20)[:, None]
    assert paint(QUANTITIES["energy"], two, np.full(two.shape, Status.OK), None).extend == "neither"


def test_exponent_has_its_zero_in_the_middle(plane):
    plane.lyapunov = np.array([[-np.inf, -2.0], [-1.0, 0.1], [0.5, -0.2]])
    fig = map_figure(plane, "lyapunov")
    assert fig.axes[1].get_ylim() == (-2.0, 2.0)
    assert key(fig) == ["−∞: the mass rests from time to time"]
    values = np.append(LINEAR, -60.0)
    painted = paint(QUANTITIES["lyapunov"], values, np.full(values.size, Status.OK), None)
    assert painted.extend == "both"
    assert -painted.norm.vmin == painted.norm.vmax == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize("dpi", [40, 120])
def test_cells_are_at_their_places_and_the_rarest_class_of_a_pixel_is_shown(dpi, tmp_path):
    """A line one cell wide and a single cell are visible on a map with more cells than pixels, at any resolution."""
    n, eps = 900, np.geomspace(1e-6, 1e-2, 900)
    period = np.ones((n, n), np.int8)
    period[700, :] = 2  # one value of A
    period[200, np.argmin(np.abs(eps - 1e-3))] = 3
    fig = map_figure(results({"A": np.linspace(1.0, 4.0, n), "eps": eps}, period=period))
    fig.dpi = dpi
    canvas = FigureCanvasAgg(fig)
    canvas.draw()
    box, image = fig.axes[0].get_window_extent(), np.asarray(canvas.buffer_rgba())[::-1]
    inside = image[round(box.y0) + 2 : round(box.y1) - 1, round(box.x0) + 2 : round(box.x1) - 1, :3]
    of = [(inside == (255 * np.array(matplotlib.colors.to_rgb(c))).round()).all(axis=-1) for c in PALETTE[:3]]
    assert (of[0] | of[1] | of[2]).all()
    columns = np.flatnonzero(of[1].all(axis=0))
    assert columns / of[0].shape[1] == pytest.approx(700.5 / n, abs=1.5 / of[0].shape[1])
    ((row, column),) = np.argwhere(of[2])
    assert row / of[0].shape[0] == pytest.approx(0.75, abs=2.5 / of[0].shape[0]), "1e-3 is at 3/4 of the four decades"
    assert column / of[0].shape[1] == pytest.approx(200.5 / n, abs=2.5 / of[0].shape[1])


def test_megapixel_is_a_small_file(tmp_path):
    noise = np.random.default_rng(0).integers(1, 9, (1000, 1000))
    fig = map_figure(results({"A": np.linspace(1, 2, 1000), "B": np.linspace(0.1, 0.2, 1000)}, period=noise))
    assert save(fig, tmp_path / "x.pdf").stat().st_size < 2_000_000


def test_cells_of_unequal_width_keep_their_width():
    A = [1.0, 2.0, 5.0]  # cells from 0.5 to 1.5, 3.5, 6.5
    row = cells(map_figure(results({"A": A, "B": [0.1, 0.2]}, period=np.array([[1, 1], [2, 2], [3, 3]]))))[2][0]
    assert [row.count(c) / len(row) for c in PALETTE[:3]] == pytest.approx([1 / 6, 2 / 6, 3 / 6], abs=0.01)
    assert borders_of(np.geomspace(1e-6, 1e-2, 3)) == pytest.approx([-7.0, -5.0, -3.0, -1.0])
    assert borders_of(np.array([2.0])).tolist() == [1.5, 2.5]
    assert [is_geometric(np.geomspace(1.0, end, 9)) for end in (4.9, 5.1)] == [False, True]


def test_one_axis_has_marks_and_a_third_is_named():
    line = results({"A": np.linspace(1, 3, 5)}, period=np.array([1, 1, 2, 2, 0], np.int8))
    (marks,) = map_figure(line).axes[0].lines
    assert marks.get_ydata().tolist() == [0, 0, 1, 1, len(PALETTE) - 1]
    axes = {"A": np.linspace(1, 3, 4), "B": np.linspace(0.1, 0.2, 3), "tau0": [0.5, 1.0]}
    fig = map_figure(results(axes, period=np.where(np.arange(24).reshape(4, 3, 2) % 2, 2, 1)))
    assert r"$\tau_0 = 0.5$ (first of 2)" in note(fig)
    assert cells(fig)[2] == [[PALETTE[0]] * 4] * 3, "the motions must be those of the first value"


@pytest.mark.parametrize(
    ("quantity", "values", "told"),
    [
        ("lyapunov", [-np.inf, -np.inf, -0.5, 0.1, np.nan, -np.inf, -1.0, np.nan],
         ["−∞ at 3 points", "no such value at 1 point,"]),
        ("energy", [0.0, 1e-9, 1e-3, 1.0, np.nan, 0.0, 1.0, np.nan],
         ["rests, or 0 at 2 points", "no such value at 1 point,"]),
        ("period", [1, 1, 2, UNSEEN, UNSEEN, 1, 0, -1], ["record too short at 2 points"]),
        ("k2", [np.inf, 1e-3, np.nan, 2e-3, 1e-3, np.inf, 1e-3, np.nan],
         ["no limit found at 2 points", "record too short at 1 point,"]),
    ],
)  # fmt: skip
def test_no_point_over_one_axis_is_left_out(quantity, values, told):
    """Each computed point has a mark, at an edge if it is outside the scale, and the abscissa has the swept range."""
    A, status = np.linspace(1.0, 4.5, 8), np.array([0, 0, 0, 0, 0, Status.NEVER_LEAVES, 0, Status.NOT_COMPUTED])
    record = "limit" if quantity == "k2" else "summary"
    swept = made.results({"A": A}, (record,), status=status, **{quantity: np.array(values)})
    figure = map_figure(swept, quantity)
    (ax,) = figure.axes
    marked = [x for line in ax.lines for x, y in line.get_xydata() if np.isfinite(y)]
    assert sorted(marked) == A[:-1].tolist()
    assert ax.get_xlim()[0] < A[0] < A[-1] < ax.get_xlim()[1]
    assert all(text in note_of(ax) for text in told), note_of(ax)
    for line in ax.lines[1:]:
        edge = line.get_transform() == ax.get_xaxis_transform()
        assert not edge or line.get_label() in key(figure)
    if quantity == "period":
        level = dict(zip(ax.get_yticks(), (text.get_text() for text in ax.get_yticklabels()), strict=True))
        named = [level[y] for y in ax.lines[0].get_ydata()[:-1]]
        assert named == ["1", "1", "2", "record too short", "record too short", "rests", "none up to 64"]


def test_only_neighbours_of_one_orbit_are_joined():
    """Two branches that meet and end, an orbit with another period, and a jump too steep to be one curve."""
    rows = [(1.0, 0.1), (3.0, 0.1), (1.5, 0.2), (2.5, 0.2)]
    branches = joined([Exact("fold", 1, 1, A, B) for A, B in rows])
    assert [[(e.A, e.B) for e in line] for line in branches] == [[(1.0, 0.1), (1.5, 0.2)], [(3.0, 0.1), (2.5, 0.2)]]
    apart = [Exact("fold", *orbit, A, B) for *orbit, A, B in ((1, 1, 1.0, 0.1), (2, 1, 1.0, 0.2), (1, 1, 5.0, 0.2))]
    assert [len(line) for line in joined(apart)] == [1, 1, 1]


MACHINE = Scene.quiet(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4)


def invented(**given):
    plan = make_plan({"periods": 3, **given})
    return gather(plan, fake.run_blocks(plan))


def scene(x, y):
    """Return results over two axes of a machine, or A and B, and its other quantities. All points have the period 1."""
    fixed = {"a0": 0.8e-3, "omega0": 150.0, "mu": 0.6, "alpha": 3.4}
    ranges = {"omega0": (80.0, 200.0), "a0": (0.3e-3, 1.2e-3), "mu": (0.3, 0.9), "alpha": (1.0, 9.0), "A": (1.0, 8.0)}
    ranges |= {"frequency": (13.0, 32.0), "B": (0.05, 0.3)}
    away = {x, y, *({"omega0"} if "frequency" in (x, y) else {}), *({"a0"} if "A" in (x, y) else {})}
    fixed = {name: value for name, value in fixed.items() if name not in away and "B" not in away}
    swept = invented(record="summary", **fixed, **{name: np.linspace(*ranges[name], 3) for name in (x, y)})
    swept.period[...], swept.status[...] = 1, Status.OK
    return swept, fixed


@pytest.mark.parametrize(
    ("x", "y"),
    [("omega0", "a0"), ("a0", "omega0"), ("alpha", "a0"), ("mu", "a0"), ("omega0", "alpha"), ("alpha", "A"),
     ("frequency", "a0"), ("alpha", "frequency"), ("A", "B"), ("B", "A")],
)  # fmt: skip
def test_bifurcations_are_drawn_over_a_map(x, y):
    swept, fixed = scene(x, y)
    B = np.linspace(0.0, 0.5, 201) if {"alpha", "mu", "B"} & {x, y} else [MACHINE.B]
    fig = map_figure(swept, x=x, y=y, over=[Exact("border", 1, 1, 1.0 + 10.0 * b, b) for b in B])
    ax, units = fig.axes[0], {"omega0": "rad/s", "a0": "mm", "alpha": "°", "frequency": "Hz"}
    line = ax.lines[-1]
    assert ax.get_xlabel().endswith(units.get(x, "$"))
    for u, v in line.get_xydata()[:: len(line.get_xydata()) // 7]:
        shown = {x: u, y: v}
        if "a0" in shown:
            shown["a0"] *= 1e-3
        if "B" not in shown:
            here = Scene.quiet(**({"a0": 1e-3} | fixed | {n: w for n, w in shown.items() if n != "A"}))
            shown = {"A": here.A, "B": here.B} | shown
        assert shown["A"] == pytest.approx(1.0 + 10.0 * shown["B"], rel=1e-9)
    assert key(fig) == ["border collision"]
    assert "numbers on lines: period" in note(fig)


@pytest.mark.parametrize(("name", "low"), [("A", 2.0), ("a0", 0.5e-3), ("omega0", 130.0), ("frequency", 20.0)])
@pytest.mark.parametrize("along", [{"alpha": [3.4, 5.0]}, {"points": {"alpha": [3.4, 5.0]}}], ids=["axis", "points"])
def test_bifurcations_are_drawn_over_a_diagram(name, low, along):
    """Each panel has those at its own B, upright at the value of the abscissa that gives their A."""
    away = {"A": {"a0"}, "a0": {"a0"}}.get(name, {"frequency"})
    given = {key: value for key, value in MACHINE.given.items() if key not in away}
    given.pop("alpha")
    swept = invented(**given, **{name: np.linspace(low, 1.5 * low, 4)}, **along)
    inclines = [Scene.quiet(**MACHINE.given | {"alpha": alpha}).B for alpha in (3.4, 5.0)]
    fig = swept.plot(x=name, over=[Exact("border", 1, 1, A, B) for B in inclines for A in (2.5, 2.7)])
    for ax, alpha in zip(fig.axes, (3.4, 5.0), strict=True):
        upright = [line for line in ax.lines if line.get_zorder() == 5]
        for A, line in zip((2.5, 2.7), upright, strict=True):
            (place,) = {*(line.get_xdata() / NAMES[name].scale).tolist()}
            here = place if name == "A" else Scene.quiet(**given | {"alpha": alpha, name: place}).A
            assert here == pytest.approx(A, rel=1e-12)
            assert (line.get_ydata()[0], line.get_ydata()[-1]) == ax.get_ylim()
    assert key(fig)[-1] == "border collision"
    assert "numbers on lines: period" in fig.axes[0].get_title(loc="right")


STEEP = [Exact("border", 1, 1, 2.5, MACHINE.B)]
BORDER = [Exact("border", 1, 1, 2.0, 0.3)]
PLANE = {"A": [1.0, 2.0, 3.0], "eps": [1e-6, 1e-5, 1e-4], "eta": 101.0, "record": "summary"}
OF_POINTS = {"a0": [4e-4, 8e-4], "frequency": 24.0, "alpha": 3.4, "record": "summary"}


@pytest.mark.parametrize(
    ("given", "over", "told"),
    [
        ({"A": [2.0, 3.0]}, lambda: limits_over([1.0, 1.0], A=[1.0, 2.0]), "limits: must be left out for a diagram"),
        ({"B": [0.1, 0.3], "A": 2.0}, lambda: BORDER, "A is not given by the axis B alone"),
        ({"A": [2.0, 3.0]}, lambda: BORDER, r"must contain B = 0\.1"),
        ({"xi0": [0.0, 1.0], "A": 2.0}, lambda: BORDER, "A is not given by the axis xi0"),
        ({"points": {"A": [2.0, 3.0]}}, lambda: BORDER, "by the axis point alone"),
        (PLANE, lambda: limits_over([1.0, 1.0], A=[1.0, 2.0], B=0.2), "limits for B = 0.2: must be for B = 0.1"),
        (PLANE, lambda: limits_over([1.0, 1.0], A=2.0, B=[0.1, 0.2]), "limits = over B in eps"),
        (PLANE, lambda: limits_over([1.0, 1.0], A=[1.0, 2.0], method="fixed"), "with the same method"),
        (PLANE | {"A": 2.0, "tau0": [0.0, 1.0]}, lambda: BORDER, "A is not given by the axes of this map, eps, tau0"),
        (PLANE, lambda: BORDER, r"over = bifurcations: must contain B = 0\.1"),
        (OF_POINTS | {"points": {"mu": [0.6, 0.7]}}, lambda: STEEP, "not given by the axes of this map, a0, point"),
    ],
)  # fmt: skip
def test_lines_that_do_not_fit_a_figure_are_refused(given, over, told):
    with pytest.raises(ValueError, match=told):
        invented(**given).plot(over=over())


def test_points_that_have_other_starts_only_share_the_lines_of_their_machine():
    (ax, *_) = invented(**OF_POINTS, mu=0.6, points={"xi0": [0.0, 1.0]}).plot(over=STEEP).axes
    assert [line.get_zorder() for line in ax.lines] == [4, 5]


@pytest.fixture
def disturbed():
    gaps = np.array([[1, 1, 2], [122, 0, 122], [0, 0, UNSEEN]])
    return results({"A": [1.0, 2.0, 3.0], "eps": np.geomspace(1e-6, 1e-4, 3)}, gaps=gaps)


def test_structure_is_kept_if_the_gaps_equal_the_undisturbed_gaps(disturbed):
    fig = map_figure(disturbed, "kept", undisturbed=np.array([[1], [122], [0]]))
    assert np.transpose(cells(fig)[2]).tolist() == [[KEPT, KEPT, LOST], [KEPT, LOST, KEPT], [GREY] * 3]
    assert [t.get_text() for t in fig.axes[1].get_yticklabels()] == ["kept", "lost"]
    assert key(fig) == ["no structure to compare"]


def limits_over(k2, **parameters):
    """Return results with the record "limit" and the given k2."""
    found = invented(record="limit", eta=101.0, **parameters)
    found.k2[...], found.half_kept[...] = k2, 2.0 * np.array(k2)
    found.velocity[...] = found.k2 * 100.0
    found.status[...] = Status.OK
    return found


def test_limit_is_a_line_over_the_map(disturbed):
    found = limits_over([1e-5, 2e-5, np.inf, 0.0], A=[1.0, 2.5, 2.7, 3.0])
    for x, order in (("A", slice(None)), ("eps", slice(None, None, -1))):
        fig = map_figure(disturbed, "gaps", x=x, over=found)
        line = fig.axes[0].lines[-1]
        assert line.get_xydata()[:2, order].tolist() == [[1.0, 1e-5], [2.5, 2e-5]]
        assert np.isnan(line.get_xydata()[2:]).any(axis=1).all()
        assert any("k_2" in text for text in key(fig))


def test_lines_over_a_map_of_a_scene_are_in_its_units():
    """A limit over a0 is placed in mm like the map. On the level no coefficient of friction gives a bifurcation."""
    machine = {"frequency": 24.0, "mu": 0.6, "alpha": 3.4, "a0": [0.5e-3, 1e-3]}
    swept = invented(**machine, eps=[1e-6, 1e-4], eta=101.0, record="summary")
    found = limits_over([1e-5, 2e-5], **machine)
    for x, order in (("a0", slice(None)), ("eps", slice(None, None, -1))):
        line = map_figure(swept, "gaps", x=x, over=found).axes[0].lines[-1]
        assert line.get_xydata()[:, order] == pytest.approx(np.array([[0.5, 1e-5], [1.0, 2e-5]]))
    level = [Exact("stick", 1, 1, 1.862, 0.0)]
    assert not map_figure(scene("mu", "A")[0], over=level).axes[0].lines
    (line,) = {line.get_xydata().tobytes() for line in map_figure(scene("alpha", "A")[0], over=level).axes[0].lines}
    assert np.frombuffer(line).tolist() == [0.0, 1.862]


def test_limits_over_two_axes_are_a_map_of_k2():
    found = limits_over([[1e-6, 1e-3], [np.inf, np.nan], [1e-4, 1e-5]], A=[1.0, 2.0, 3.0], B=[0.1, 0.2])
    found.status[1, 1], found.status[2, 1] = Status.NO_ORBIT, Status.NOT_COMPUTED
    fig = found.plot()
    assert fig.axes[1].get_ylabel() == r"limit $k_2$ in $\varepsilon$"
    colours = cells(fig)[2]
    assert (colours[0][1], colours[1][1], colours[1][2]) == (to_hex(APART), GREY, "none")
    assert len({c for row in colours for c in row}) == 6
    assert set(key(fig)) == {"no limit found", "no periodic motion, or record too short", "not computed"}
    assert fig.axes[1].get_yscale() == "log"


def test_map_of_statuses_has_words_for_each():
    found = limits_over([[1e-6, 1e-3], [np.nan] * 2, [1e-4] * 2], A=[1.0, 2.0, 3.0], B=[0.1, 0.2])
    found.status[1] = Status.NO_ORBIT, Status.RAISED
    assert key(found.plot(quantity="status")) == ["no periodic motion or function raised an exception"]
    found.status[1] = 9  # of a later version
    assert key(found.plot(quantity="status")) == ["status 9"]


def test_limits_over_one_axis_are_bands_of_velocities():
    same = {"A": [1.5, 1.0, 2.0]}
    certified, fixed = limits_over([1e-3, 1e-4, np.inf], **same), limits_over([0.2, 0.1, 0.3], **same, method="fixed")
    assert vd.plot.limits(certified).axes[0].get_xlim() == (1.0, 2.0), "where a limit is missing, too"
    several = limits_over([1e-3] * 1000, A=np.linspace(1.0, 2.0, 1000))
    several.orbit_period[:] = [1] * 400 + [2, 3, 4] + [5] * 197 + [6, 0, 7] + [8] * 397
    texts = [text.get_text() for text in vd.plot.limits(several).axes[0].texts]
    assert texts == ["$n = 1$", *"234", "$n = 5$", *"67", "$n = 8$"]
    certified.half_kept[1] = 0.0  # nothing is kept above
    ax = (fig := vd.plot.limits([certified, fixed])).axes[0]
    first, last = ax.lines[:2]
    assert first.get_xdata().tolist() == [1.0, 1.5, 2.0]
    assert first.get_ydata()[:2] == pytest.approx([1e-2, 1e-1])
    assert last.get_ydata()[:2] == pytest.approx([1e-2, 2e-1])
    assert np.isnan(first.get_ydata()[2])
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_yscale()) == ("$A$", "limit as a velocity $V$", "log")
    assert "missing points: no limit found (1)" in note_of(ax)
    assert len([text for text in key(fig) if "k_2" in text]) == 2
    with pytest.raises(ValueError, match="axes = A: must be A with the same values in all results"):
        vd.plot.limits([certified, limits_over([1e-3], A=[1.5])])
    scene = {"scene": Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4), "frequency": [20.0, 24.0]}
    found = limits_over([1e-3, 1e-3], **scene)
    ax = vd.plot.limits(found).axes[0]
    speeds = [Scene(a0=1e-3, frequency=f, mu=0.6, alpha=3.4).velocity(0.1) for f in (20.0, 24.0)]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Excitation frequency $f$ in Hz", "limit as a velocity $V$ in m/s")
    assert ax.lines[0].get_ydata() == pytest.approx(speeds, rel=1e-12)


def note_of(ax):
    return ax.get_title(loc="right").replace("\n", " ")


@pytest.mark.parametrize(
    ("axes", "record", "wish", "found"),
    [
        ("", ("section",), {}, ("poincare", "dxi")),
        ("A", ("section",), {}, ("bifurcation", "dxi")),
        ("A", ("summary",), {}, ("map", "period")),
        ("A", ("error",), {}, ("map", "status")),
        ("A", ("section", "summary"), {"quantity": "energy"}, ("map", "energy")),
        ("A", ("section",), {"kind": "map", "quantity": "status"}, ("map", "status")),
        ("A", ("summary",), {"quantity": "kept"}, ("map", "kept")),
        ("A", ("section", "impacts"), {"quantity": "impact_speed"}, ("bifurcation", "impact_speed")),
        ("A", ("impacts",), {}, ("bifurcation", "impact_phase")),
        ("A", ("limit",), {}, ("bands", "k2")),
        ("A B", ("limit",), {}, ("map", "k2")),
        ("A dtau", ("failures",), {}, ("map", "missed")),
        ("xi0", ("section",), {}, ("bifurcation", "dxi")),
        ("A xi0 tau0", ("section",), {}, ("bifurcation", "dxi")),
        ("xi0 tau0", ("section",), {}, ("map", "last_dxi")),
        ("A", ("summary",), {"kind": "bifurcation"}, "must be map, because this sweep recorded summary"),
        ("A", ("summary",), {"quantity": "power"}, "quantity = 'power': must be one of period"),
        ("A", ("summary",), {"quantity": "xi"}, "quantity = 'xi': must be one of period"),
        ("A", ("section",), {"quantity": "energy"}, 'and energy needs record = "summary"'),
        ("A", ("summary",), {"kind": "map", "quantity": "xi"}, "quantity = 'xi': must be one of period"),
        ("A", ("section",), {"quantity": "impact_speed"}, 'section, and impact_speed needs record = "impacts"'),
        ("A", ("impacts",), {"quantity": "xi"}, "must be one of impact_phase, impact_speed"),
        ("A", ("impacts",), {"kind": "poincare"}, "must be map or bifurcation"),
        ("A", ("summary",), {"quantity": "impact_power"}, "impact_power needs a scene in SI units"),
        ("A", ("section",), {"kind": "poincare", "x": "A"}, "x = 'A': must be left out for a figure of kind poincare"),
        ("A", ("section",), {"kind": "bifurcation", "y": "A"}, "y = 'A': must be left out for a figure of kind bif"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("count", [1, 12])
def test_drawing_follows_from_axes_and_record_whatever_the_number_of_values(axes, record, wish, found, count):
    record = check_record(record)
    known = {"record": record, "quantities": quantities(record), "scalars": {}}
    axes = {name: np.ones(count) for name in axes.split()}
    swept = SimpleNamespace(axes=axes, varied=axes, **known)
    if isinstance(found, tuple):
        shown = choose_drawing(swept, **wish)
        assert (shown.kind, shown.row.name) == found
        return
    with pytest.raises(ValueError, match="must be") as refused:
        choose_drawing(swept, **wish)
    assert found in str(refused.value)


def test_options_override_the_configured_drawing():
    wanted = {"kind": "map", "quantity": "energy", "limits": (0.1, 30.0)}
    assert merge_options(wanted, {}) == wanted
    assert merge_options(wanted, {"quantity": "period"}) == {"kind": "map", "quantity": "period"}
    assert merge_options(wanted, {"kind": "bifurcation"}) == {"kind": "bifurcation"}
    assert merge_options({"kind": "poincare"}, {"quantity": "xi"}) == {"quantity": "xi"}
    assert merge_options({"x": "A", "y": "B"}, {"quantity": "xi"}) == {"x": "A", "quantity": "xi"}
