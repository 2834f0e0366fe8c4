"""The two styles and the two widths of figures are distinct, and figures satisfy the requirements of journals."""

import itertools
import math
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from tests.support.fake import UNITLESS
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures.curves import periods_ticks
from vibrodrive.figures.looks import LOOKS
from vibrodrive.figures.style import INCHES, NOTE, drawn_as, equation, explain, letter, look, new, note, save
from vibrodrive.model.choices import Status
from vibrodrive.model.drawing import STYLES, WIDTHS
from vibrodrive.model.plan import make_plan


@pytest.fixture
def swept():
    """Return a sweep of irregular motions over 40 values of A and two values of ε. At one point the budget is
    exhausted."""
    plan = make_plan({"A": np.linspace(3.0, 3.2, 40), "eps": [0.0, 1e-4], "periods": 200})
    section = np.random.default_rng(3).uniform(0.0, 1.0, (40, 2, 200, 2))
    status = np.zeros(plan.shape, np.int8)
    status[7, 1] = Status.BUDGET
    known = {"axes": plan.axes, "scalars": plan.scalars, "settings": plan.settings, "record": ("section",)}
    known |= {"points": {}}
    return SimpleNamespace(section=section, status=status, title="", **known, **UNITLESS)


def drawings(swept, **options):
    reference = np.array([[0.5, 0.5]])
    return figures.bifurcation(swept, **options), figures.poincare(swept, reference=reference, **options)


def pixels(figure, path):
    return mpl.image.imread(save(figure, path, 60))[..., :3]


def test_print_is_black_and_white_and_the_screen_is_not(swept, tmp_path):
    for figure in drawings(swept, style="print"):
        assert np.ptp(pixels(figure, tmp_path / "x.png"), axis=-1).max() == 0
    for figure in drawings(swept):
        assert np.ptp(pixels(figure, tmp_path / "x.png"), axis=-1).max() > 0.4


# colours for a dichromat in linear RGB: Machado, Oliveira, Fernandes (2009)
BLIND = {
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}


def lab(linear):
    """Return CIE L*a*b* of linear sRGB (D65)."""
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    x, y, z = np.array(to_xyz) @ linear / np.array([0.9505, 1.0, 1.089])
    fx, fy, fz = (t ** (1 / 3) if t > (6 / 29) ** 3 else t / (3 * (6 / 29) ** 2) + 4 / 29 for t in (x, y, z))
    return np.array([116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)])


@pytest.mark.parametrize("eyes", BLIND)
def test_first_curves_stay_apart_for_the_colour_blind(eyes):
    """A distance of 10 between colours in CIE L*a*b* is clearly visible. (The line styles also differ.)"""
    linear = [np.where((c := np.array(to_rgb(hue))) > 0.04045, ((c + 0.055) / 1.055) ** 2.4, c / 12.92)
              for hue, _ in LOOKS["screen"].lines[:4]]  # fmt: skip
    seen = [lab(np.clip(np.array(BLIND[eyes]) @ colour, 0, 1)) for colour in linear]
    assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > 10


@pytest.mark.parametrize("style", STYLES)
def test_no_two_curves_look_alike(style):
    lines = LOOKS[style].lines
    assert len(set(lines)) == len(lines) >= 6
    assert len({pattern for _, pattern in lines[:4]}) == 4, "four curves must also differ without colour"


@pytest.mark.parametrize("width", WIDTHS)
def test_figures_are_as_wide_as_columns(swept, width):
    bifurcation, poincare = drawings(swept, width=width)
    assert bifurcation.get_figwidth() == poincare.get_figwidth() == INCHES[width]
    letters = {t.get_size() for ax in poincare.axes for t in (ax.xaxis.label, *ax.get_yticklabels())}
    assert min(letters) >= 7, "letters must not be scaled with the width"


def test_style_applies_within_its_context_only():
    before = dict(mpl.rcParams)
    assert look() is LOOKS["screen"]
    with drawn_as("print", "single"):
        assert look() is LOOKS["print"]
        with drawn_as("screen"):
            assert look() is LOOKS["screen"]
            assert new(height=3.0)[0].get_figwidth() == INCHES["single"]
        assert look() is LOOKS["print"]
    assert look() is LOOKS["screen"]
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize(("key", "value"), [("style", "nature"), ("width", "triple")])
def test_unknown_style_or_width_is_named(swept, key, value):
    with pytest.raises(ValueError, match=f"^{key} = '{value}': must be one of"):
        figures.bifurcation(swept, **{key: value})


def test_letters_are_embedded(swept, tmp_path):
    figure = figures.bifurcation(swept)
    written = save(figure, tmp_path / "x.pdf").read_bytes()
    assert b"/FontFile2" in written
    assert b"/Type3" not in written
    assert "<text" not in save(figure, tmp_path / "x.svg").read_text(), "letters must be outlines"


def test_unusual_status_is_marked_at_its_point(swept):
    fig = figures.bifurcation(swept)
    first, second = fig.axes
    assert not first.lines
    (mark,) = second.lines
    assert mark.get_xdata() == pytest.approx(swept.axes["A"][7])
    assert "out of budget: 1" in second.get_title(loc="right")
    assert "out of budget" in {t.get_text() for t in fig.legends[0].get_texts()}


def test_grey_has_a_legend_and_lines_have_none(swept):
    fig = figures.bifurcation(swept)
    texts = [t.get_text() for t in fig.legends[0].get_texts()]
    assert [t for t in texts if "budget" not in t] == ["spot visited once", "4 times", "13 times or more"]
    panel = {"axes": {"A": swept.axes["A"]}, "section": swept.section[:, 0], "status": swept.status[:, 0]}
    for eps, keys in ((0.0, 0), (2e-4, 1)):
        one = SimpleNamespace(**vars(swept) | panel | {"scalars": swept.scalars | {"eps": eps}})
        assert len(figures.bifurcation(one).legends) == keys
    swept.section[:] = 0.5
    swept.status[:] = Status.OK
    assert not figures.bifurcation(swept).legends


def test_first_and_last_columns_are_as_wide_as_the_others(swept):
    ax = figures.bifurcation(swept).axes[0]
    (drawn,) = ax.get_images()
    marked = np.asarray(drawn.get_array()).max(axis=0) > 0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], marked, [0]])))
    widths = edges[1::2] - edges[::2]
    assert len(widths) == 40
    assert np.ptp(widths) <= 1
    assert ax.get_xlim()[0] < swept.axes["A"][0]


def test_selected_panels_are_reported(swept):
    plan = make_plan({"A": np.linspace(3, 3.1, 20), "eps": np.linspace(0, 1e-3, 9), "periods": 8})
    many = SimpleNamespace(
        axes=plan.axes, points={}, scalars=plan.scalars, settings=plan.settings, record=("section",),
        section=np.ones((20, 9, 8, 2)), status=np.zeros((20, 9), np.int8), **UNITLESS,
    )  # fmt: skip
    assert r"6 of 9 values of $\varepsilon$ shown" in figures.bifurcation(many).axes[0].get_title("right")
    assert "6 of 180 points shown" in figures.poincare(many).axes[2].get_title(loc="right")
    assert "shown" not in figures.bifurcation(swept).axes[0].get_title(loc="right")


def test_two_axes_of_the_start_give_a_map():
    plan = make_plan({"A": 3.04, "xi0": np.linspace(0, 20, 15), "tau0": np.linspace(0, 6, 12), "periods": 4})
    section = np.zeros((15, 12, 4, 2))
    section[..., -1, 1] = np.arange(180).reshape(15, 12)
    start = SimpleNamespace(
        axes=plan.axes, points={}, scalars=plan.scalars, settings=plan.settings, record=("section",), quantities=(),
        section=section, status=np.zeros((15, 12), np.int8), **UNITLESS,
    )  # fmt: skip
    fig = figures.from_results(start)
    assert fig.axes[1].get_ylim() == pytest.approx((1, 179)), (
        "the colour bar must show ξ' at the last section on a logarithmic scale, without 0"
    )
    assert figures.from_results(start, "bifurcation").axes[0].get_images()


@pytest.mark.parametrize("count", [3, 10, 117, 1500])
def test_ticks_of_periods_are_round(count):
    ax = new(height=2.0)[1][0, 0]
    low = 2 * math.pi * 1000
    periods_ticks(ax, low, low + 2 * math.pi * count)
    shown = [int(t.get_text()) for t in ax.get_xticklabels()]
    step = shown[1] - shown[0]
    assert step / 10 ** math.floor(math.log10(step)) in (1, 2, 5)
    assert shown[0] == 0
    assert 3 <= len(shown) <= 16
    assert ax.get_xlabel() == r"$\tau/2\pi - 1000$"


def test_long_note_is_placed_above_the_panel_name():
    ax = new(height=2.0)[1][0, 0]
    ax.set_title("a) name", loc="left")
    note(ax, ["short"])
    assert ax.get_title(loc="right") == "short"
    ax.set_title("a) " + "name " * 16, loc="left")
    note(ax, [f"{k} is a part of many words" for k in range(12)])
    lines = ax.get_title(loc="right").split("\n")
    assert lines[-1] == ""
    assert len(lines) > 2
    assert all(line.endswith(",") for line in lines[:-2])


@pytest.mark.parametrize("width", WIDTHS)
def test_note_is_smaller_than_the_name_of_its_panel(width):
    """The ratio of the font sizes is the same for both widths."""
    with drawn_as(width=width):
        ax = new(height=2.0)[1][0, 0]
        letter(ax, 0, "name")
        note(ax, "short")
        name, said = ax._left_title, ax._right_title
        assert said.get_fontsize() == pytest.approx(NOTE * name.get_fontsize())


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("names", [["short"] * 9, ["a label that is longer than the others are", *["short"] * 8]])
def test_legend_has_as_many_columns_as_fit(names, width):
    with drawn_as(width=width):
        fig, axes = new(height=3.0)
        for k, name in enumerate(names):
            axes[0, 0].plot([0, k], label=f"{name} {k}")
        explain(fig)
        fig.draw_without_rendering()
    (legend,) = fig.legends
    box = legend.get_window_extent()
    assert 0 <= box.x0 < box.x1 <= fig.bbox.width
    columns = len({round(t.get_window_extent().x0) for t in legend.get_texts()})
    assert columns > 1 or (width, len(names[0]) > 10) == ("single", True)


@pytest.mark.parametrize(
    ("value", "text"),
    [(math.pi / 2, r"\pi/2"), (3 * math.pi / 4, r"3\pi/4"), (math.pi, r"\pi"), (2.0, "2"), (0.0, "0"), (1.57, "1.57")],
)
def test_phases_are_written_as_parts_of_pi(value, text):
    assert equation("section_phase", value) == rf"$\varphi_s = {text}$"
