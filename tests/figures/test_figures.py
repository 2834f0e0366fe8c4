"""Diagrams show the data: pixels are dark at the values, in the right panel, and say what they do not show."""

import math
from dataclasses import replace

import h5py
import matplotlib as mpl
import numpy as np
import pytest

import vibrodrive as vd
from tests.figures.made import results
from tests.support import fake
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures import style
from vibrodrive.figures.image import PANEL_ROWS
from vibrodrive.model.choices import Status
from vibrodrive.model.plan import make_plan

A = np.linspace(3.0, 3.2, 200)


@pytest.fixture
def two_regimes():
    """Return a sweep. For A < 3.1 ξ' alternates between 1 and 2, otherwise it fills [1, 2] evenly. ξ = 10 ξ'."""
    dxi = np.where(A[:, None] < 3.1, 1 + np.arange(400) % 2, 1 + (np.arange(400) * math.sqrt(2) % 1))
    return results({"A": A}, section=np.stack([10 * dxi, dxi], axis=-1))


def image(ax):
    """Return the shades, 0 to 1 (rows from below, columns), of a bifurcation panel, and the ordinates of the rows."""
    (drawn,) = ax.get_images()
    _, _, low, high = drawn.get_extent()
    return np.asarray(drawn.get_array()), low + (np.arange(PANEL_ROWS) + 0.5) / PANEL_ROWS * (high - low)


def inked(ax, value):
    """Return the ink at a value of the abscissa, and the ordinates that are marked there."""
    ink, rows = image(ax)
    start, stop, _, _ = ax.get_images()[0].get_extent()
    column = ink[:, round((value - start) / (stop - start) * (ink.shape[1] - 1))]
    return column, sorted({round(v, 1) for v in rows[column > 0]})


def note(ax):
    return ax.get_title(loc="right").replace("\n", " ")


@pytest.mark.parametrize("backwards", [False, True])
def test_periodic_motion_is_black_lines_and_an_irregular_one_is_grey(two_regimes, backwards):
    if backwards:
        two_regimes = results({"A": A[::-1]}, section=two_regimes.section[::-1])
    (ax,) = figures.bifurcation(two_regimes).axes
    periodic, marked = inked(ax, A[50])
    assert marked == [1, 2]
    assert (periodic[periodic > 0] == 1.0).all()
    irregular, value = inked(ax, A[-1])[0], image(ax)[1]
    assert 0 < irregular[(value > 1.01) & (value < 1.99)].mean() < 0.6
    assert (irregular[(value < 0.99) | (value > 2.01)] == 0).all()
    assert "darker: more values" in note(ax)
    (ax,) = figures.bifurcation(two_regimes, "xi", limits=(0, 15)).axes
    assert inked(ax, A[50])[1] == pytest.approx([10, 10], abs=0.11), "20 is beyond the range"
    assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_ylim()) == ("$A$", r"$\xi$", (0, 15))


@pytest.mark.parametrize(("cmap", "word"), [("viridis", "lighter"), ("magma_r", "darker")])
def test_colours_of_ones_own_are_those_of_the_ink(two_regimes, cmap, word):
    own = mpl.colormaps[cmap]
    named, later = figures.bifurcation(two_regimes, cmap=cmap), figures.bifurcation(two_regimes)
    later.axes[0].images[0].set_cmap(cmap)
    for figure in (named, later):
        (drawn,) = figure.axes[0].images
        shown = drawn.to_rgba(drawn.get_array())
        assert np.array_equal(shown[..., 3] == 0, image(figure.axes[0])[0] == 0), "spots without values have no colour"
        assert np.array_equal(shown[image(figure.axes[0])[0] == 1.0][0], own(1.0))
    assert f"{word}: more values" in note(named.axes[0])


def test_impact_diagram_shows_each_impact_and_no_padding():
    phase = np.full((len(A), 8), np.nan)
    phase[:, 0] = 1.5
    phase[A >= 3.1, 1] = 2.5
    (ax,) = figures.from_results(results({"A": A}, ("impacts",), impact_phase=phase)).axes
    assert ax.get_ylabel() == r"phase $\varphi$ of the main impacts in rad"
    assert (inked(ax, A[0])[1], inked(ax, A[-1])[1]) == ([1.5], [1.5, 2.5])


def test_other_axes_become_panels_thinned_to_six_with_both_ends(two_regimes):
    dtau = np.linspace(0.01, 0.1, 9)
    section = two_regimes.section * np.linspace(1.0, 2.0, 9)[:, None, None, None]
    panels = figures.bifurcation(results({"dtau": dtau, "A": A}, section=section)).axes
    titles = [ax.get_title(loc="left") for ax in panels]
    assert (len(titles), titles[0], titles[-1]) == (6, r"a) $\Delta\tau = 0.01$", r"f) $\Delta\tau = 0.1$")
    assert r"6 of 9 values of $\Delta\tau$ shown" in note(panels[0])
    assert (inked(panels[0], A[50])[1], inked(panels[5], A[50])[1]) == ([1, 2], [2, 4])
    assert len({ax.get_ylim() for ax in panels}) == 1


DAMAGED = {
    "section": ("section_dxi", {"A": A[:6]}, ""),
    "impacts": ("impact_phase", {"A": A[:6]}, ""),
    "summary": ("energy", {"A": A[:6], "B": [0.1, 0.2]}, "energy"),
    "limit": ("k2", {"A": A[:6]}, ""),
}


@pytest.mark.parametrize("record", DAMAGED)
def test_figure_of_a_damaged_file_says_so(tmp_path, record):
    """A map, too, has the status that reading the drawn array has shown."""
    variable, axes, quantity = DAMAGED[record]
    plan = make_plan({**axes, "transient": 0, "periods": 12, "record": record})
    path = tmp_path / "x.h5"
    fake.write(path, replace(plan, tiling=(2, 2)[: len(axes)]))
    with h5py.File(path) as file:
        place = file[variable].id.get_offset()
    sound = vd.load(path).plot(quantity=quantity or None)
    raw = bytearray(path.read_bytes())
    raw[place] ^= 4
    path.write_bytes(raw)
    with pytest.warns(UserWarning, match="damaged blocks are left out"):
        fig = vd.load(path).plot(quantity=quantity or None)
    said = [" ".join(ax.get_title(loc=loc) for ax in one.axes for loc in ("left", "right")) for one in (sound, fig)]
    assert ["damaged parts of the file left out" in text for text in said] == [False, True]
    assert "not computed" in said[1]


def test_points_without_a_section_are_white_and_counted_and_odd_ones_marked(two_regimes):
    two_regimes.section[100:110] = 1.7
    two_regimes.status[100:110], two_regimes.status[:20] = Status.BUDGET, Status.NOT_COMPUTED
    (ax,) = figures.bifurcation(two_regimes).axes
    assert not inked(ax, A[5])[1]
    assert not inked(ax, A[104])[1]
    (mark,) = ax.lines
    assert mark.get_xdata() == pytest.approx(A[100:110])
    assert "not computed: 20 of 200 points" in (said := note(ax)) or "out of budget: 10 of 200 points" in said
    section = np.ones((3, 8, 2))
    swept = results({"A": [1.0, 2.0, 3.0]}, section=section, status=np.array([0, Status.NOT_COMPUTED, 0], np.int8))
    fig = figures.poincare(swept)
    assert [len(ax.lines[0].get_xdata()) for ax in fig.axes[:3]] == [1, 0, 1]


def seldom(n, where, k=16):
    """Return a sweep with period 2 at n values of A. At the values in `where` one section point is moved to 2.87."""
    dxi = np.broadcast_to(1.0 + np.arange(k) % 2, (n, k)).copy()
    dxi[where, k // 2] = 2.87  # not at a tick of the ordinate
    return results({"A": np.linspace(3.0, 3.2, n)}, section=np.stack([dxi, dxi], axis=-1))


def test_every_value_is_visible_among_many_values():
    n = 20_000
    where = np.arange(n // 1200, n, n // 600)[:600]
    ink, value = image(figures.bifurcation(seldom(n, where)).axes[0])
    marks = ink[(value > 2.8) & (value < 2.95)].max(axis=0) > 0
    assert np.count_nonzero(np.diff(marks.astype(int), prepend=0) == 1) == 600
    for line in (1.0, 2.0):
        assert (ink[(value > line - 0.05) & (value < line + 0.05)].max(axis=0) == 1.0).all()


def test_single_value_among_twenty_thousand_is_visible(tmp_path):
    where = [100, 777, 5003, 9998, 13_334, 17_771, 19_899]
    figure, dpi = figures.bifurcation(seldom(20_000, where), limits=(0.5, 3.5), style="print"), 50
    drawn = mpl.image.imread(style.save(figure, tmp_path / "figure.png", dpi))[..., 0]
    (ax,) = figure.axes
    left, row = ax.transData.transform((3.0, 2.87)) * dpi / figure.dpi
    right, _ = ax.transData.transform((3.2, 2.87)) * dpi / figure.dpi
    near = drawn.shape[0] - round(row) + np.arange(-2, 3)
    seen = np.flatnonzero(drawn[near, math.floor(left) + 1 : math.ceil(right) - 1].min(axis=0) < 0.75)
    assert np.count_nonzero(np.diff(seen, prepend=-10) > 3) == len(where)


@pytest.mark.parametrize("eps", [np.geomspace(1e-5, 1e-3, 50), [3.0, 3.0]])
def test_values_are_at_their_places_on_a_geometric_axis_and_on_one_without_length(eps):
    (ax,) = figures.bifurcation(results({"eps": eps}, section=np.ones((len(eps), 8, 2)))).axes
    ink, (left, right) = image(ax)[0], ax.images[0].get_extent()[:2]
    marked = left + (np.flatnonzero(ink.max(axis=0)) + 0.5) / ink.shape[1] * (right - left)
    places = np.log10(eps) if ax.get_xscale() == "log" else eps
    assert ax.get_xscale() == ("log" if len(eps) == 50 else "linear")
    assert np.abs(marked[:, None] - places).min(axis=0).max() < 0.01


def test_sections_share_one_scale_and_show_each_distinct_point_once():
    section = np.empty((2, 300, 2))
    section[0] = [[1, -1], [2, -3]] * 150
    section[1] = np.random.default_rng(1).uniform(0, 1, (300, 2))
    fig = figures.poincare(results({"eps": [0.0, 1e-3]}, section=section), reference=np.array([[1, -1], [2, -3]]))
    first, second = fig.axes
    assert [len(ax.lines[0].get_xdata()) for ax in (first, second)] == [2, 300]
    assert (first.get_xlim(), first.get_ylim()) == (second.get_xlim(), second.get_ylim())
    assert first.lines[1].get_xydata().tolist() == [[1, -1], [2, -3]]
    many = results({"eps": np.linspace(0, 1e-3, 9)}, section=np.ones((9, 4, 2)))
    assert "6 of 9 points shown" in note(figures.poincare(many).axes[2])


def test_diagram_of_motions_that_rest_at_the_section_says_so(two_regimes):
    two_regimes.section[...] = 0.0
    for draw in (figures.bifurcation, figures.poincare):
        assert "at rest at every section point" in " ".join(map(note, draw(two_regimes).axes))
    two_regimes.section[50:] = 1.0
    assert "at rest at 25 % of the section points" in note(figures.bifurcation(two_regimes).axes[0])
    two_regimes.status[:25] = Status.NEVER_LEAVES
    assert "at rest at 14 % of the section points" in note(figures.bifurcation(two_regimes).axes[0]), "25 of 175"
    two_regimes.status[:50] = Status.NEVER_LEAVES
    assert "section point" not in note(figures.bifurcation(two_regimes).axes[0])
