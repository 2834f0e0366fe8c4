"""Figures fit the columns of a journal, in its black ink, and equal figures are equal files."""

import io
import itertools
import math

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from tests.figures.made import results
from vibrodrive.figures import diagrams as figures
from vibrodrive.figures.curves import periods_ticks
from vibrodrive.figures.looks import LOOKS
from vibrodrive.figures.sheet import drawn_on
from vibrodrive.figures.style import FORMATS, INCHES, LETTERS, about, save
from vibrodrive.figures.texts import equation, number
from vibrodrive.model.figure import WIDTHS
from vibrodrive.model.records import How


@pytest.fixture
def swept():
    """Return a sweep of irregular motions over A and ε."""
    section = np.random.default_rng(3).uniform(0.0, 1.0, (40, 2, 200, 2))
    return results({"A": np.linspace(3.0, 3.2, 40), "eps": [0.0, 1e-4]}, section=section)


def test_print_is_black_and_white_and_the_screen_is_not(swept, tmp_path):
    for style, coloured in (("print", False), ("screen", True)):
        drawn = figures.bifurcation(swept, style=style), figures.poincare(swept, reference=np.ones((1, 2)), style=style)
        for figure in drawn:
            seen = mpl.image.imread(save(figure, tmp_path / "x.png", 30))[..., :3]
            assert (np.ptp(seen, axis=-1).max() > 0.2) == coloured


@pytest.mark.parametrize("width", WIDTHS)
def test_note_and_legend_fit_the_width_of_a_column(width):
    phrases = [rf"$\varepsilon_{k} = 2\cdot10^{{-4}}$ and some words" for k in range(9)]
    with drawn_on(width=width) as sheet:
        fig, axes = sheet.new(height=3.0)
        axes[0, 0].set_title("a) a name", loc="left")
        sheet.note(axes[0, 0], phrases)
        for k in range(7):
            axes[0, 0].plot([0, k], label=f"an entry of the legend {k}")
    fig.draw_without_rendering()
    assert fig.get_figwidth() == INCHES[width]
    (legend,), said = fig.legends, axes[0, 0]._right_title
    for box in (legend.get_window_extent(), said.get_window_extent()):
        assert 0 <= box.x0 < box.x1 <= fig.bbox.width
    assert len({round(t.get_window_extent().x0) for t in legend.get_texts()}) > 1, "there must be several columns"
    assert not said.get_window_extent().overlaps(axes[0, 0]._left_title.get_window_extent())


def long_label(width, ax=None):
    """Draw a map whose colour bar has a long label, and return its figure."""
    swept = results({"A": [1.0, 2.0], "B": [0.1, 0.2]}, ("summary",), drive_work=np.array([[1.0, 2.0], [3.0, 4.0]]))
    return figures.map_figure(swept, "drive_work", width=width, ax=ax)


@pytest.mark.parametrize(
    "draw",
    [
        lambda: long_label("single"),
        lambda: long_label("double"),
        lambda: long_label(None, Figure(figsize=(3.4, 2.6)).subplots()),
        lambda: figures.bifurcation(
            results({"eps": [0.0, 1e-4, 1e-3], "A": [3.0, 3.1]}, ("impacts",), impact_speed=np.ones((3, 2, 4))),
            "impact_speed", x="A", width="single",
        ),
    ],
    ids=["single", "double", "of the user", "panels"],
)  # fmt: skip
def test_label_is_not_longer_than_its_axes(draw):
    figure = draw()
    figure.draw_without_rendering()
    for ax in figure.axes:
        label, box = ax.yaxis.label.get_window_extent(), ax.get_window_extent()
        assert label.height <= box.height
        assert label.y0 >= 0
        assert label.y1 <= figure.bbox.height
    assert len(figure.axes[-1].get_ylabel()) > 30, "nothing may be left out"


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("axes", [{"A": [1.0, 2.0]}, {"A": [1.0, 2.0], "B": [0.1, 0.2]}], ids=["line", "map"])
def test_names_of_classes_leave_room(axes, width):
    """The names of the ways in which a structure is lost have up to 62 letters."""
    swept = results(axes, ("limit",), how=np.full([2] * len(axes), How.GAPS, np.int8))
    figure = figures.map_figure(swept, "how", width=width)
    figure.draw_without_rendering()
    assert figure.axes[0].get_window_extent().width > 0.25 * figure.bbox.width
    boxes = [text.get_window_extent() for text in figure.axes[-1].get_yticklabels()]
    assert len(boxes) == len(How)
    assert not any(a.overlaps(b) for a, b in itertools.pairwise(boxes))
    assert min(box.x0 for box in boxes) >= 0
    assert max(box.x1 for box in boxes) <= figure.bbox.width
    said = figure.axes[0]._right_title if len(axes) == 1 else figure.axes[0]._left_title
    assert 0 <= said.get_window_extent().x0 < said.get_window_extent().x1 <= figure.bbox.width


def test_first_drawing_leaves_room_for_the_last_number():
    """The layout decides which numbers are at the axes, and these decide the layout, so that a second drawing may move
    the axes."""
    section = np.random.default_rng(1).uniform(-3.3, 0.0, (400, 100, 2))
    fig = figures.bifurcation(results({"A": np.linspace(2.5, 3.3, 400)}, section=section), width="single")
    ends = []
    for _ in range(2):
        fig.savefig(io.BytesIO())
        ends.append(fig.axes[0].get_position().x1)
    assert ends[0] == pytest.approx(ends[1], abs=1e-3)


def test_style_applies_within_its_block_only(swept):
    before = dict(mpl.rcParams)
    with drawn_on(style="print", width="single") as outer:
        with drawn_on() as inner:
            assert inner.look is LOOKS["screen"]
            assert inner.new(height=3.0)[0].get_figwidth() == INCHES["double"]
        assert outer.look is LOOKS["print"]
        figures.bifurcation(swept)
        assert outer.new(height=3.0)[0].get_figwidth() == INCHES["single"]
        assert mpl.rcParams["font.size"] == LETTERS["single"][0]
    assert dict(mpl.rcParams) == before


def test_same_figure_is_the_same_file_with_its_letters(swept, tmp_path):
    for ending in FORMATS:
        one, two = (save(figures.bifurcation(swept), tmp_path / f"{name}{ending}", 40) for name in ("one", "two"))
        assert one.read_bytes() == two.read_bytes()
    assert b"/FontFile2" in (written := (tmp_path / "one.pdf").read_bytes())
    assert b"/Type3" not in written
    assert "<text" not in (svg := (tmp_path / "one.svg").read_text(encoding="utf-8")), "letters must be outlines"
    png, title, said = Image.open(tmp_path / "one.png").text, "ξ′ over A", "a) ε = 0; B = 0.1, η = 101, certified, "
    assert (png["Title"], png["Description"][: len(said)]) == (title, said)
    assert all(text.encode("utf-16-be") in written.replace(b"\\)", b")") for text in (title, said))
    assert f"<title>{title}</title>\n <desc>{said}" in svg
    figures.bifurcation(swept).savefig(tmp_path / "one.jpg")  # this format has no title
    shown = results({"A": [1.0, 2.0], "B": [0.1, 0.2]}, ("summary",), drive_work=np.array([[1.0, 2.0], [3.0, 4e-9]]))
    title, said = about(figures.map_figure(shown, "drive_work"))
    assert title == "work of the excitation per excitation period over A and B"
    assert said.endswith("least 4·10⁻⁹ at A = 2, B = 0.2, largest 3 at A = 2, B = 0.1")


@pytest.mark.parametrize("count", [3, 117, 1500])
def test_ticks_of_periods_are_round(count):
    low = 2 * math.pi * 1000
    with drawn_on() as sheet:
        ax = sheet.new(height=2.0)[1][0, 0]
        periods_ticks(sheet, ax, low, low + 2 * math.pi * count)
    shown = [int(t.get_text()) for t in ax.get_xticklabels()]
    step = shown[1] - shown[0]
    assert step / 10 ** math.floor(math.log10(step)) in (1, 2, 5)
    assert shown[0] == 0
    assert 3 <= len(shown) <= 16
    assert ax.get_xlabel() == r"$\tau/2\pi - 1000$"


@pytest.mark.parametrize(
    ("value", "text", "phase"),
    [(0.0, "0", "0"), (3.04, "3.04", "3.04"), (1e-5, "10^{-5}", "10^{-5}"), (2e-4, r"2\cdot10^{-4}", r"2\cdot10^{-4}"),
     (math.pi / 2, "1.5708", r"\pi/2"), (3 * math.pi / 4, "2.35619", r"3\pi/4"), (1.57, "1.57", "1.57")],
)  # fmt: skip
def test_numbers_and_phases_are_written_as_in_print(value, text, phase):
    assert number(value) == text
    assert equation("section_phase", value) == rf"$\varphi_s = {phase}$"
