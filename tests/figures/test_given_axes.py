"""Every figure has a public name, is displayed in a notebook, can be drawn into given axes, and is otherwise the same
for all users."""

import contextlib
import io
import warnings

import matplotlib as mpl
import matplotlib.image
import matplotlib.style
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import vibrodrive as vd
from tests.support import fake
from vibrodrive.batch.block import gather
from vibrodrive.figures.style import save
from vibrodrive.model.plan import make_plan

pytestmark = pytest.mark.jit


@pytest.fixture(scope="module")
def swept():
    axes = {"A": np.linspace(3.0, 3.2, 15), "B": [0.1, 0.15]}
    return vd.sweep(**axes, transient=2, periods=4, record=["section", "summary"])


@pytest.fixture(scope="module")
def motion():
    return vd.simulate(3.04, transient=2, periods=3)


def limits():
    plan = make_plan({"record": "limit", "A": 1.5, "B": [0.1, 0.2]})
    return gather(plan, fake.run_blocks(plan))


FIGURES = {
    "bifurcation": (2, lambda s, m, ax: vd.plot.bifurcation(s, "xi", ax=ax)),
    "poincare": (5, lambda s, m, ax: vd.plot.poincare([m] * 5, [""] * 5, ax=ax)),
    "map": (1, lambda s, m, ax: vd.plot.map(s, "status", ax=ax)),
    "trajectory": (2, lambda s, m, ax: m.plot(ax=ax)),
    "phase_curve": (1, lambda s, m, ax: vd.plot.phase_curve(m, ax=ax)),
    "cobweb": (1, lambda s, m, ax: vd.plot.cobweb(3.04, ax=ax)),
    "limits": (1, lambda s, m, ax: vd.plot.limits(limits(), ax=ax)),
}
"""Number of panels of each figure, and a function of (sweep, motion, axes) that draws it into the axes."""


@pytest.mark.parametrize("name", FIGURES)
def test_figure_is_drawn_into_the_axes_given(name, swept, motion):
    assert set(vd.plot.__all__) <= FIGURES.keys()
    count, draw = FIGURES[name]
    figure = Figure(figsize=(3 * count, 3))
    spare, *given = figure.subplots(1, count + 1)
    assert draw(swept, motion, given[0] if count == 1 else given) is figure
    for ax in given:
        assert ax.lines or ax.images or ax.collections
        assert not any(ax.get_title(loc) for loc in ("left", "center", "right"))
        assert ax.get_legend() is None
        assert ax.yaxis.label.get_rotation() == 90
    assert not [*spare.lines, *spare.images, *spare.collections, *spare.patches, *spare.texts]
    assert not figure.legends, "a legend must be in the given axes and not in the figure"
    with pytest.raises(ValueError, match=r"must be (one|[0-9] different) Axes"):
        draw(swept, motion, figure.subplots(1, count + 1))
    assert draw(swept, motion, None) is not figure, "without given axes the figure must be a new one"


def panels(count=1):
    return Figure(figsize=(5 * count, 4)).subplots(1, count)


@pytest.mark.parametrize("name", ["bifurcation", "map", "phase_curve"])
def test_axes_of_the_user_keep_their_style(name, swept, motion):
    """What he has set, and what comes later from his settings, is as in axes with a curve of his own."""
    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcParams.update(matplotlib.style.library["ggplot"])
        ours, his = panels(), panels()
        FIGURES[name][1](swept.select(B=0.1) if name == "bifurcation" else swept, motion, ours)
        his.plot([0, 1], label="mine")
        his.legend()
        his.set(xlabel="x", ylabel="y")
        ours.legend(["mine"])

        def style_of(ax):
            letters = [ax.xaxis.label, ax.yaxis.label, *ax.get_xticklabels()[:1], *ax.get_legend().get_texts()]
            spines = [(s.get_visible(), s.get_edgecolor(), s.get_linewidth()) for s in ax.spines.values()]
            ticks = [axis.get_tick_params(which) for axis in (ax.xaxis, ax.yaxis) for which in ("major", "minor")]
            texts = [(t.get_fontfamily(), t.get_size(), t.get_color(), t.get_rotation()) for t in letters]
            return spines, ticks, texts, ax.get_facecolor(), ax.get_legend().get_frame().get_facecolor()

        assert style_of(ours) == style_of(his)
        assert his.lines[0].get_color().lower() in {line.get_color() for line in ours.lines}


def test_results_in_the_same_axes_have_two_colours_and_a_key(swept):
    ax = panels()
    ax.set(title="mine", ylabel="mine")
    swept.select(B=0.1).plot(ax=ax)
    low, high = ax.get_ylim()
    assert ax.get_legend() is None
    swept.select(B=0.15).plot(ax=ax)
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["$B = 0.1$", "$B = 0.15$"]
    assert (ax.get_title(), ax.get_xlabel(), ax.get_ylabel()) == ("mine", "$A$", "mine")
    assert ax.get_ylim()[0] <= low < high <= ax.get_ylim()[1]
    ax.get_legend().remove()
    ax.figure.savefig(png := io.BytesIO(), dpi=60)
    seen = matplotlib.image.imread(io.BytesIO(png.getvalue()))[..., :3].reshape(-1, 3)
    bluer = seen[:, 2] - seen[:, 0]
    assert bluer.max() > 0.1, "the blue result is hidden"
    assert bluer.min() < -0.1, "the orange result is hidden"


def test_motions_in_the_same_axes_count_the_same_periods():
    ax = panels()
    for transient in (2, 4):
        vd.simulate(3.04, transient=transient, periods=3).plot(["time"], ax=ax)
    ticks = zip(ax.get_xticks(), ax.get_xticklabels(), strict=True)
    assert {round(tick / (2 * np.pi)): t.get_text() for tick, t in ticks} == {k: str(k) for k in range(2, 8)}
    assert ax.get_xlabel() == r"$\tau/2\pi$"
    assert [t.get_text() for t in ax.get_legend().get_texts()][::2] == ["periods 3–5", "periods 5–7"]


def test_notes_are_a_legend_in_given_axes_and_can_be_left_out(swept, motion):
    several = panels(2)
    several[0].set_title("mine")
    swept.plot(ax=several, notes=True)
    assert ["B = 0.1" in one.get_legend().get_title().get_text() for one in several] == [True, True]
    assert "certified" in several[0].get_legend().get_title().get_text()
    assert [several[0].get_title(loc) for loc in ("left", "center", "right")] == ["", "mine", ""]
    for figure in (swept.plot(notes=False), motion.plot(notes=False)):
        assert not figure.legends
        assert not any(ax.get_title(loc) for ax in figure.axes for loc in ("left", "center", "right"))
    assert vd.plot.phase_curve(motion, ["mine"], notes=False).axes[0].get_title("left") == "mine"
    assert vd.plot.phase_curve(motion, ["mine"], ax=panels()).axes[0].get_title() == "mine"


def test_what_would_be_hidden_or_ignored_in_given_axes_is_refused(swept, motion):
    one = swept.select(B=0.1)
    diagram, section, covered, grey = (panels() for _ in range(4))
    one.plot(ax=diagram)
    vd.plot.poincare(motion, ax=section)
    vd.plot.map(swept, "period", ax=covered)
    for _ in range(2):
        one.plot(ax=grey, style="print")
    assert [t.get_text() for t in grey.get_legend().get_texts()] == ["result (1)", "result (2)"]
    hides = "two such figures hide each other"
    for ax, told, draw, options in [
        (diagram, "or with xi over A, but it shows dxi over A", one.plot, {"quantity": "xi"}),
        (section, "with dxi over A, but it shows dxi over xi", one.plot, {}),
        (diagram, hides, swept.plot, {"quantity": "period"}),
        (covered, hides, swept.plot, {"quantity": "energy"}),
        (covered, hides, one.plot, {}),
        (diagram, "width = 'single': must be left out with ax", one.plot, {"width": "single"}),
        (diagram, "notes = 'much': must be True or False", one.plot, {"notes": "much"}),
        ([diagram, diagram], "2 different Axes", swept.plot, {}),
        (one.plot().axes[0], "must be Axes of a figure of yours", one.plot, {}),
        (Figure(), "ax = .*: must be one Axes", motion.plot, {"curves": ["phase"]}),
        (grey, "style = 'print': must be left out, because it has colours for 2 results", one.plot, {"style": "print"}),
    ]:  # fmt: skip
        before = [[*map(id, a.get_children())] for a in np.ravel(ax)]
        with pytest.raises(ValueError, match=told):
            draw(ax=ax, **options)
        assert [[*map(id, a.get_children())] for a in np.ravel(ax)] == before, "a refused figure must change nothing"


def spoil_settings():
    """Change all settings of Matplotlib that have another value, as a matplotlibrc and a style of a user may do."""
    mpl.rcParams.update(matplotlib.style.library["dark_background"])
    for name, value in mpl.rcParamsDefault.items():
        if name.startswith(("backend", "date.epoch", "interactive", "timezone", "toolbar")):
            continue
        others = [not value] if isinstance(value, bool) else ["large", "red", "tight", "none"]
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            others = [2 * value + 1, value / 2]
        for other in others:
            with contextlib.suppress(ValueError, RuntimeError, TypeError):
                mpl.rcParams[name] = other
                break
    mpl.rcParams.update({"savefig.bbox": "tight", "figure.constrained_layout.use": False, "figure.autolayout": True})


@pytest.mark.parametrize("name", ["bifurcation", "map", "trajectory"])
def test_settings_of_the_user_do_not_change_a_figure(name, swept, motion, tmp_path):
    """They have no effect when the figure is made, drawn, and saved by its own method or by the command line."""

    def files():
        figure = FIGURES[name][1](swept, motion, None)
        canvas = FigureCanvasAgg(figure)  # as a notebook draws it
        canvas.draw()
        return bytes(canvas.buffer_rgba()), save(figure, tmp_path / "figure.pdf").read_bytes()

    expected = files()
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.simplefilter("ignore", mpl.MatplotlibDeprecationWarning)
        spoil_settings()
        assert mpl.rcParams["text.usetex"]
        assert mpl.rcParams["font.size"] != mpl.rcParamsDefault["font.size"]
        assert files() == expected


def test_notebook_shows_a_figure(motion):
    png, size = motion.plot()._repr_png_()
    assert matplotlib.image.imread(io.BytesIO(png)).shape[1::-1] == (2 * size["width"], 2 * size["height"])


def test_a_figure_that_cannot_be_shown_says_so(motion):
    told = r'without a display \(backend [Aa]gg\); figure\.savefig\("figure\.png"\) writes it to a file$'
    with pytest.warns(UserWarning, match=told) as caught:
        motion.plot().show()
    assert [w.filename for w in caught if w.category is UserWarning] == [__file__]
    motion.plot().show(warn=False)
    assert pyplot.get_fignums() == []


def test_only_show_makes_a_figure_of_pyplot(motion, monkeypatch):
    """pyplot keeps its figures, warns of many, and a notebook displays all of them at the end of a cell."""
    shown = []
    monkeypatch.setattr(pyplot, "get_backend", lambda: "qtagg")
    monkeypatch.setattr(pyplot, "show", lambda: shown.append([pyplot.figure(n) for n in pyplot.get_fignums()]))
    with mpl.rc_context({"figure.max_open_warning": 1}):
        for _ in range(3):
            figure = motion.plot()
            assert pyplot.get_fignums() == []
            assert figure.show() is figure.show() is None
    assert [len(figures) for figures in shown] == [1] * 6
    assert shown[-1] == [figure]
    assert pyplot.get_fignums() == []
