"""Figures show the data: pixels are dark at the values, and lines have corners at the switches."""

import io
import math
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest

from tests.support.fake import UNITLESS
from tests.support.process import python
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures import style
from vibrodrive.figures.bifurcation import PANEL_ROWS
from vibrodrive.figures.curves import curve
from vibrodrive.model.choices import Status
from vibrodrive.model.plan import make_plan
from vibrodrive.model.records import quantities
from vibrodrive.model.states import State

PERIODS = 400


def results(section, status=None, **axes):
    plan = make_plan({**axes, "A": axes.get("A", 3.0), "periods": section.shape[-2]})
    assert section.shape[:-2] == plan.shape
    status = np.zeros(plan.shape, dtype=np.int8) if status is None else status
    return SimpleNamespace(
        axes=plan.axes,
        points=plan.together,
        scalars=plan.scalars,
        settings=plan.settings,
        record=("section",),
        quantities=quantities(("section",)),
        section=section,
        status=status,
        **UNITLESS,
    )


@pytest.fixture
def two_regimes():
    """Return a sweep. For A < 3.1 ξ' alternates between 1 and 2, otherwise it fills [1, 2] evenly. ξ = 10 ξ'."""
    A = np.linspace(3.0, 3.2, 200)
    dxi = np.where(A[:, None] < 3.1, 1 + np.arange(PERIODS) % 2, 1 + (np.arange(PERIODS) * math.sqrt(2) % 1))
    return results(np.stack([10 * dxi, dxi], axis=-1), A=A)


def image(ax):
    """Return the shades, 0 to 1 (rows from below, columns), of a bifurcation panel, and the ordinates of the rows."""
    (drawn,) = ax.get_images()
    _, _, low, high = drawn.get_extent()
    return np.asarray(drawn.get_array()), low + (np.arange(PANEL_ROWS) + 0.5) / PANEL_ROWS * (high - low)


def at(ax, value):
    """Return the index of the column of the image at a value of the abscissa."""
    ink, _ = image(ax)
    start, stop, _, _ = ax.get_images()[0].get_extent()
    return round((value - start) / (stop - start) * (ink.shape[1] - 1))


def inked(column, value):
    """Return the values that are marked in a column of the image. A mark has a height of two rows."""
    rows = np.flatnonzero(column)
    assert (np.diff(rows)[::2] == 1).all()
    return [round(v, 1) for v in value[rows][::2]]


def test_periodic_motion_is_black_lines_and_an_irregular_one_is_grey(two_regimes):
    (ax,) = figures.bifurcation(two_regimes).axes
    ink, value = image(ax)
    A = two_regimes.axes["A"]
    periodic, irregular = ink[:, at(ax, A[50])], ink[:, at(ax, A[-1])]
    assert inked(periodic, value) == [1, 2]
    assert (periodic[periodic > 0] == 1.0).all()
    inside = (value > 1.01) & (value < 1.99)
    assert 0 < irregular[inside].mean() < 0.6
    assert (irregular[(value < 0.99) | (value > 2.01)] == 0).all()


def test_quantity_and_limits(two_regimes):
    (ax,) = figures.bifurcation(two_regimes, "xi", limits=(0, 15)).axes
    ink, value = image(ax)
    column = ink[:, at(ax, two_regimes.axes["A"][50])]
    assert inked(column, value) == [10]
    assert ax.get_ylabel() == style.symbol("xi")
    assert ax.get_xlabel() == "$A$"


def test_impact_diagram_shows_each_impact_and_no_padding(two_regimes):
    A = two_regimes.axes["A"]
    phase = np.full((len(A), 8), np.nan)
    phase[:, 0] = 1.5
    phase[A >= 3.1, 1] = 2.5
    swept = SimpleNamespace(**{**vars(two_regimes), "record": ("impacts",)}, impact_phase=phase)
    for wish in ({}, {"quantity": "impact_phase"}, {"kind": "bifurcation"}):
        (ax,) = figures.from_results(swept, **wish).axes
        assert ax.get_ylabel() == r"phase $\varphi$ of the main impacts in rad"
        shown, value = image(ax)
        assert inked(shown[:, at(ax, A[0])], value) == [1.5]
        assert inked(shown[:, at(ax, A[-1])], value) == [1.5, 2.5]


def test_second_axis_becomes_panels(two_regimes):
    both = results(np.stack([two_regimes.section, two_regimes.section + 1]), eps=[0.0, 2e-4], A=two_regimes.axes["A"])
    fig = figures.bifurcation(both)
    titles = [ax.get_title(loc="left") for ax in fig.axes]
    assert titles == [r"a) $\varepsilon = 0$", r"b) $\varepsilon = 2\cdot10^{-4}$"]


def test_many_panels_are_thinned_to_a_few_with_both_ends(two_regimes):
    dtau = np.linspace(0.01, 0.1, 30)
    section = np.broadcast_to(two_regimes.section, (30, *two_regimes.section.shape))
    fig = figures.bifurcation(results(section, dtau=dtau, A=two_regimes.axes["A"]))
    titles = [ax.get_title(loc="left") for ax in fig.axes]
    assert len(titles) == 6
    assert "0.01" in titles[0]
    assert "0.1$" in titles[-1]


def test_points_not_computed_are_white_and_counted(two_regimes):
    two_regimes.status[:20] = Status.NOT_COMPUTED
    (ax,) = figures.bifurcation(two_regimes).axes
    ink, _ = image(ax)
    assert ink[:, : int(0.09 * ink.shape[1])].max() == 0
    assert "not computed: 20 of 200 points" in ax.get_title(loc="right")


def seldom(n, where, k=16):
    """Return a sweep with period 2 at n values of A. At the values in `where` one section point is moved to 2.87."""
    A = np.linspace(3.0, 3.2, n)
    dxi = np.broadcast_to(1.0 + np.arange(k) % 2, (n, k)).copy()
    dxi[where, k // 2] = 2.87  # not at a tick of the ordinate
    return results(np.stack([dxi, dxi], axis=-1), A=A)


def pixels(figure, path, dpi):
    """Return the colours (rows, columns, 3), 0 to 1, of all pixels of a saved figure."""
    return mpl.image.imread(style.save(figure, path, dpi))[..., :3]


@pytest.mark.parametrize("n", [600, 20_000])
def test_every_value_is_visible_for_any_number_of_values(n):
    where = np.arange(n // 1200, n, n // 600)[:600]
    (ax,) = figures.bifurcation(seldom(n, where)).axes
    ink, value = image(ax)
    spot = (value > 2.8) & (value < 2.95)
    marks = ink[spot].max(axis=0) > 0
    runs = np.count_nonzero(np.diff(marks.astype(int), prepend=0) == 1)
    assert len(where) == 600
    assert runs == (600 if n > 600 else 1), "there must be 600 marks, or one mark if all values are adjacent"
    for line in (1.0, 2.0):
        drawn = ink[(value > line - 0.05) & (value < line + 0.05)].max(axis=0)
        assert (drawn == 1.0).all(), "values that repeat must have full ink in all columns"


@pytest.mark.parametrize("dpi", [50, 250])
def test_single_value_among_twenty_thousand_is_visible(tmp_path, dpi):
    where = [100, 777, 5003, 9998, 13_334, 17_771, 19_899]
    figure = figures.bifurcation(seldom(20_000, where), limits=(0.5, 3.5), style="print")
    drawn = pixels(figure, tmp_path / "figure.png", dpi)[..., 0]
    (ax,) = figure.axes
    left, row = ax.transData.transform((3.0, 2.87)) * dpi / figure.dpi
    right, _ = ax.transData.transform((3.2, 2.87)) * dpi / figure.dpi
    frame = 1 + dpi // 100  # some versions of Matplotlib draw it a pixel further inside
    across = slice(math.floor(left) + frame, math.ceil(right) - frame)
    near = drawn.shape[0] - round(row) + np.arange(-2, 3)
    seen = np.flatnonzero(drawn[near, across].min(axis=0) < 0.75)
    assert np.count_nonzero(np.diff(seen, prepend=-10) > 3) == len(where)


def test_values_closer_than_a_column_are_all_visible():
    """The spacing of the values may be uneven. In this test 300 values are within one thousandth of the axis."""
    crowd = results(np.ones((302, 16, 2)), A=np.concatenate([[3.0], np.linspace(3.1, 3.1002, 300), [3.2]]))
    crowd.section[1:301, :, :] += np.linspace(0, 1, 300)[:, None, None]
    (ax,) = figures.bifurcation(crowd).axes
    ink, value = image(ax)
    middle = ink[:, ink.shape[1] // 2 - 8 : ink.shape[1] // 2 + 8].max(axis=1)
    spread = (value > 1.0) & (value < 2.0)
    assert (middle[spread] > 0).mean() > 0.95


def test_panels_share_the_widest_limits(two_regimes):
    wide = two_regimes.section.copy()
    wide[5, 0] = 7.0
    both = results(np.stack([wide, two_regimes.section]), eps=[0.0, 2e-4], A=two_regimes.axes["A"])
    for ax in figures.bifurcation(both).axes:
        assert ax.get_ylim()[1] > 7.0


def test_axis_of_one_value_twice_is_drawn():
    (ax,) = figures.bifurcation(results(np.ones((2, 8, 2)), A=[3.0, 3.0])).axes
    assert image(ax)[0].max() == 1.0


def test_geometric_axis_is_drawn_in_decades():
    eps = np.geomspace(1e-5, 1e-3, 50)
    (ax,) = figures.bifurcation(results(np.ones((50, 8, 2)), eps=eps)).axes
    assert ax.get_xscale() == "log"
    assert ax.get_xlim() == pytest.approx((1e-5, 1e-3), rel=0.1)
    ink, _ = image(ax)
    left, right = ax.images[0].get_extent()[:2]
    marked = left + (np.flatnonzero(ink.max(axis=0)) + 0.5) / ink.shape[1] * (right - left)
    assert np.abs(marked[:, None] - np.log10(eps)).min(axis=0).max() < 0.01


def test_sections_share_one_scale_and_show_each_distinct_point_once():
    section = np.empty((2, 300, 2))
    section[0] = [[1, -1], [2, -3]] * 150
    section[1] = np.random.default_rng(1).uniform(0, 1, (300, 2))
    fig = figures.poincare(results(section, eps=[0.0, 1e-3]), reference=np.array([[1, -1], [2, -3]]))
    first, second = fig.axes
    assert len(first.lines[0].get_xdata()) == 2
    assert len(second.lines[0].get_xdata()) == 300
    assert first.get_xlim() == second.get_xlim()
    assert first.get_ylim() == second.get_ylim()
    assert len(first.lines) == 2, "there must be dots and the circles of the reference"


def test_few_values_are_drawn_as_many(two_regimes):
    few = results(two_regimes.section[:3], A=two_regimes.axes["A"][:3])
    for swept in (few, two_regimes):
        assert figures.from_results(swept).axes[0].get_images()
    assert len(figures.from_results(few, kind="poincare").axes) == 3


KEYWORDS = {
    "quantity": "xi",
    "x": "B",
    "y": "A",
    "limits": (0.0, 3.0),
    "style": "print",
    "width": "single",
    "notes": False,
}


@pytest.mark.parametrize("keyword", KEYWORDS)
@pytest.mark.parametrize("kind", [None, "bifurcation", "poincare", "map", "one motion"])
def test_each_keyword_acts_or_is_refused(kind, keyword):
    section = np.random.default_rng(1).uniform(1, 2, (3, 2, 8, 2))
    swept = results(section, A=[3.0, 3.1, 3.2], B=[0.1, 0.2])
    if kind == "one motion":
        swept, kind = results(section[0, 0]), None

    def pixels_with(**options):
        figure = figures.from_results(swept, kind, **options)
        figure.savefig(drawn := io.BytesIO(), format="raw", dpi=40)
        return drawn.getvalue()

    refused = []
    try:
        assert pixels_with(**{keyword: KEYWORDS[keyword]}) != pixels_with()
    except ValueError as error:
        refused = [str(error).partition(" = ")[0]]
    assert refused in ([], [keyword])
    assert not refused or keyword not in ("style", "width", "notes")


@pytest.mark.parametrize("limits", [(2.0, 1.0), (0.0, math.inf), (0.0,), 3.0, "ab", (0.0, 10**400)])
def test_limits_that_are_no_range_are_refused(two_regimes, limits):
    with pytest.raises(ValueError, match=r"^limits = .*: must be two numbers in ascending order$"):
        figures.bifurcation(two_regimes, limits=limits)


def test_diagram_of_motions_that_rest_at_the_section_says_so(two_regimes):
    two_regimes.section[...] = 0.0
    for draw in (figures.bifurcation, figures.poincare):
        titles = [ax.get_title("right") for ax in draw(two_regimes).axes]
        assert "at rest at every section point" in "".join(titles)
    two_regimes.section[50:] = 1.0
    assert "at rest at 25 % of the section points" in figures.bifurcation(two_regimes).axes[0].get_title("right")
    two_regimes.status[:50] = Status.NEVER_LEAVES
    assert "section point" not in figures.bifurcation(two_regimes).axes[0].get_title("right")


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda r: figures.from_results(r, kind="pie"), "kind"),
        (lambda r: figures.bifurcation(r, "speed"), "quantity"),
        (lambda r: figures.bifurcation(r, x="B"), "x"),
    ],
)
def test_unknown_option_is_named(two_regimes, call, key):
    with pytest.raises(ValueError, match=f"^{key} = .*must be one of"):
        call(two_regimes)


SWITCH = np.dtype([("period", "i8"), ("phase", "f8"), ("before", "i1"), ("after", "i1"), ("xi", "f8"), ("dxi", "f8")])


@pytest.fixture
def falling():
    """Return one period of a simple motion: ξ = 2 − τ until the impact at τ = 2, then a rest."""
    switches = np.array(
        [(0, 2.0, State.DOWN, State.IMPACT, 0.0, -1.0), (0, 2.0, State.IMPACT, State.REST, 0.0, 0.0)], SWITCH
    )

    def sample(n):
        tau = np.linspace(0, 2 * math.pi, n + 1)
        state = np.where(tau < 2, State.DOWN, State.REST)
        return SimpleNamespace(
            tau=tau, xi=np.maximum(2 - tau, 0), dxi=np.where(tau < 2, -1.0, 0.0), state=state, H=np.sin(tau)
        )

    arguments = {"A": 1.0, "B": 0.1, "eps": 0.0}
    known = {"section": np.zeros((1, 2)), "sample": sample, "arguments": arguments, "status": 0, **UNITLESS}
    return SimpleNamespace(switches=switches, **known)


def test_impact_breaks_the_curve_and_is_stored_as_a_jump(falling):
    drawn = curve(falling, points_per_period=5)
    assert (np.diff(drawn.tau) >= 0).all()
    assert drawn.jumps.tolist() == [[[2, 0, -1], [2, 0, 0]]]
    (gap,) = np.flatnonzero(np.isnan(drawn.xi))
    assert (drawn.xi[gap - 1], drawn.dxi[gap - 1]) == (0, -1)
    assert (drawn.xi[gap + 1], drawn.dxi[gap + 1]) == (0, 0)
    before, after = drawn.xi[:gap], drawn.xi[gap + 1 :]
    assert np.allclose(before, 2 - drawn.tau[:gap])
    assert (after == 0).all()


def test_time_curves_carry_the_excitation(falling):
    (ax,) = figures.trajectory_figure(falling, ["time"]).axes
    sine = next(line for line in ax.lines if line.get_label() == r"$\sin\tau$")
    assert np.allclose(sine.get_ydata(), np.sin(sine.get_xdata()))
    assert ax.get_ylabel() == style.symbol("xi")
    assert r"\tau" in ax.get_xlabel()


def test_trajectory_figure_has_a_row_for_each_curve(falling):
    fig = figures.trajectory_figure(falling, ("phase", "time", "velocity", "section"))
    assert [ax.get_ylabel() for ax in fig.axes] == [style.symbol(s) for s in ("dxi", "xi", "dxi", "dxi")]
    for wrong in (("orbit",), "time", ()):
        with pytest.raises(ValueError, match=r"curves = .*: must be a list of one or more of phase, time"):
            figures.trajectory_figure(falling, wrong)
    with pytest.raises(ValueError, match="shown = 3: must be left out, because no curve over time"):
        figures.trajectory_figure(falling, ["phase"], shown=3)


@pytest.mark.parametrize("draw", [figures.phase_curve, figures.poincare])
def test_titles_are_one_for_each_panel(falling, draw):
    for wrong in (["one"], ["one", "two", "three"], "ab"):
        with pytest.raises(ValueError, match=r"titles = .*: must be a list of 2, one for each panel"):
            draw([falling, falling], titles=wrong)


def test_phase_curves_of_two_motions_share_a_scale(falling):
    first, second = figures.phase_curve([falling, falling], titles=["exact", "grid"]).axes
    assert first.get_xlim() == second.get_xlim()
    assert second.get_title(loc="left") == "b) grid"


@pytest.mark.parametrize("ending", style.FORMATS)
def test_same_figure_is_the_same_file(two_regimes, tmp_path, ending):
    one = style.save(figures.bifurcation(two_regimes), tmp_path / f"one{ending}")
    two = style.save(figures.bifurcation(two_regimes), tmp_path / f"two{ending}")
    assert one.read_bytes() == two.read_bytes()
    assert one.stat().st_size > 1000


def test_unknown_suffix_is_named_and_leaves_no_file(two_regimes, tmp_path):
    with pytest.raises(ValueError, match=r"a file name ending in \.png"):
        style.save(figures.bifurcation(two_regimes), tmp_path / "figure.xyz")
    assert not list(tmp_path.iterdir())


def test_settings_of_the_caller_are_unchanged(two_regimes):
    before = dict(mpl.rcParams)
    figures.bifurcation(two_regimes)
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (3.04, "3.04"),
        (0.05, "0.05"),
        (2e-4, r"2\cdot10^{-4}"),
        (1e-5, "10^{-5}"),
        (1.5e7, r"1.5\cdot10^{7}"),
    ],
)
def test_numbers_are_written_as_in_print(value, text):
    assert style.number(value) == text


def test_figures_load_no_window_system_and_no_numba():
    code = "import sys, vibrodrive.figures; sys.exit(bool({'matplotlib.pyplot', 'numba'} & set(sys.modules)))"
    python(code)
