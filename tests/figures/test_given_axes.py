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
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import vibrodrive as vd
from tests.figures.test_limits import of as limits_of
from vibrodrive.figures.style import save
from vibrodrive.model.states import State
from vibrodrive.periodic.family import family
from vibrodrive.store.failures import FailureMap

AXES = {"A": np.linspace(3.0, 3.2, 15), "B": [0.1, 0.15]}


@pytest.fixture(scope="module")
def swept():
    return vd.sweep(**AXES, transient=2, periods=4, record=["section", "summary"])


@pytest.fixture(scope="module")
def motion():
    return vd.simulate(3.04, transient=2, periods=3)


@pytest.fixture(scope="module")
def orbits():
    return family(np.linspace(2.5, 2.7, 5), 0.1, 1)


def limits():
    return limits_of({"B": np.array([0.1, 0.2])}, np.full((3, 2), 1e-3))


def limits_over_two():
    return limits_of({"A": np.array([2.0, 3.0]), "B": np.array([0.1, 0.2])}, np.full((3, 2, 2), 1e-3))


def failures():
    A, other = np.array([3.0, 3.1]), np.array([0.01, 0.1])
    judged = np.ones((2, 2, 2), np.int64)
    counts = {kind: judged for kind in ("missed", "late", "wrong")}
    settings = {"method": 1, "transient": 20, "periods": 30}
    return FailureMap(A, "dtau", other, judged, counts, np.full((2, 2), 0.05), {"eps": 0.0}, settings)


FIGURES = {
    "bifurcation": (2, lambda s, m, o, ax: vd.plot.bifurcation(s, "xi", ax=ax)),
    "results": (2, lambda s, m, o, ax: s.plot(ax=ax)),
    "poincare": (1, lambda s, m, o, ax: vd.plot.poincare(m, ax=ax)),
    "several poincare": (5, lambda s, m, o, ax: vd.plot.poincare([m] * 5, [""] * 5, ax=ax)),
    "map": (1, lambda s, m, o, ax: vd.plot.map(s, "status", ax=ax)),
    "trajectory": (2, lambda s, m, o, ax: m.plot(ax=ax)),
    "phase_curve": (1, lambda s, m, o, ax: vd.plot.phase_curve(m, ax=ax)),
    "time_curve": (1, lambda s, m, o, ax: m.plot(["time"], ax=ax)),
    "orbits": (1, lambda s, m, o, ax: vd.plot.orbits(o, ax=ax)),
    "multipliers": (1, lambda s, m, o, ax: vd.plot.multipliers(o, ax=ax)),
    "cobweb": (1, lambda s, m, o, ax: vd.plot.cobweb(3.04, ax=ax)),
    "curves": (1, lambda s, m, o, ax: vd.plot.curves([], (1.0, 2.0), (0.0, 1.0), 2, [(1.5, 0.5)], ax=ax)),
    "scheme": (1, lambda s, m, o, ax: vd.plot.scheme({(State.UP, State.DOWN)}, ax=ax)),
    "limits_map": (1, lambda s, m, o, ax: limits_over_two().plot("map", ax=ax)),
    "limits": (2, lambda s, m, o, ax: vd.plot.limits(limits(), ax=ax)),
    "failures": (6, lambda s, m, o, ax: vd.plot.failures(failures(), ax=ax)),
}
"""Number of panels of each figure, and a function of (sweep, motion, orbits, axes) that draws it into the axes."""


@pytest.mark.jit
@pytest.mark.parametrize("name", FIGURES)
def test_figure_is_drawn_into_the_axes_given(name, swept, motion, orbits):
    panels, draw = FIGURES[name]
    figure = Figure(figsize=(3 * panels, 3))
    spare, *given = figure.subplots(1, panels + 1)
    drawn = draw(swept, motion, orbits, given[0] if panels == 1 else given)
    assert drawn is figure
    for ax in given:
        assert ax.lines or ax.images or ax.collections or ax.patches or ax.texts
        assert not any(ax.get_title(loc) for loc in ("left", "center", "right"))
        assert ax.get_legend() is None
        assert ax.yaxis.label.get_rotation() == 90
    assert not [*spare.lines, *spare.images, *spare.collections, *spare.patches, *spare.texts]
    assert not figure.legends, "a legend must be in the given axes and not in the figure"
    figure.savefig(io.BytesIO())
    with pytest.raises(ValueError, match=r"must be (one|[0-9] different) Axes"):
        draw(swept, motion, orbits, figure.subplots(1, panels + 1))
    assert draw(swept, motion, orbits, None) is not figure, "without given axes the figure must be a new one"


def panels(style="default", count=1):
    """Return axes as a user makes them with a style of his."""
    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcParams.update(matplotlib.style.library.get(style, {}))
        return Figure(figsize=(5 * count, 4)).subplots(1, count)


def drawn(ax):
    """Return the artists, labels and ranges of axes, to compare them."""
    return [*map(id, ax.get_children())], ax.get_xlabel(), ax.get_ylabel(), ax.get_xlim(), ax.get_ylim()


@pytest.mark.jit
@pytest.mark.parametrize("style", ["ggplot", "dark_background"])
@pytest.mark.parametrize("name", ["poincare", "map", "time_curve", "phase_curve", "one bifurcation"])
def test_axes_of_the_user_keep_their_style(name, style, swept, motion, orbits):
    """What he has set, and what comes later from his settings, is as in axes with a curve of his own."""
    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcParams.update(matplotlib.style.library[style])
        ours, his = panels(style), panels(style)
        if name == "one bifurcation":
            swept.select(B=0.1).plot(ax=ours)
        else:
            FIGURES[name][1](swept, motion, orbits, ours)
        his.plot([0, 1], label="mine")
        his.legend()
        his.set(xlabel="x", ylabel="y")
        ours.legend(["mine"])

        def style_of(ax):
            letters = [ax.xaxis.label, ax.yaxis.label, *ax.get_xticklabels()[:1], *ax.get_legend().get_texts()]
            spines = [(s.get_visible(), s.get_edgecolor(), s.get_linewidth()) for s in ax.spines.values()]
            ticks = [axis.get_tick_params(which) for axis in (ax.xaxis, ax.yaxis) for which in ("major", "minor")]
            texts = [(t.get_fontfamily(), t.get_size(), t.get_color(), t.get_rotation()) for t in letters]
            frame = ax.get_legend().get_frame()
            return spines, ticks, texts, ax.get_facecolor(), frame.get_facecolor(), frame.get_alpha()

        assert style_of(ours) == style_of(his)
        colours = {to_hex(line.get_color()) for line in ours.lines}
        assert to_hex(mpl.rcParams["axes.prop_cycle"].by_key()["color"][0]) in colours


@pytest.mark.jit
def test_results_in_the_same_axes_have_two_colours_and_a_key(swept):
    first, second = swept.select(B=0.1), swept.select(B=0.15)
    ax = panels()
    ax.set(title="mine", ylabel="mine")
    first.plot(ax=ax)
    low, high = ax.get_ylim()
    assert ax.get_legend() is None
    second.plot(ax=ax)
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["$B = 0.1$", "$B = 0.15$"]
    assert (ax.get_title(), ax.get_xlabel(), ax.get_ylabel()) == ("mine", "$A$", "mine")
    assert ax.get_ylim()[0] <= low < high <= ax.get_ylim()[1]
    twin = ax.twinx()
    first.plot(quantity="xi", ax=twin)
    assert twin.get_ylabel() == r"$\xi$"
    twin.remove()
    ax.get_legend().remove()
    ax.figure.savefig(png := io.BytesIO(), dpi=60)
    seen = matplotlib.image.imread(io.BytesIO(png.getvalue()))[..., :3].reshape(-1, 3)
    bluer = seen[:, 2] - seen[:, 0]
    assert bluer.max() > 0.1, "the blue result is hidden"
    assert bluer.min() < -0.1, "the orange result is hidden"


@pytest.mark.jit
def test_motions_in_the_same_axes_count_the_same_periods(motion):
    ax = panels()
    for transient in (2, 4):
        vd.simulate(3.04, transient=transient, periods=3).plot(["time"], ax=ax)
    labels = {
        round(tick / (2 * np.pi)): t.get_text() for tick, t in zip(ax.get_xticks(), ax.get_xticklabels(), strict=True)
    }
    assert labels == {k: str(k) for k in range(2, 8)}
    assert ax.get_xlabel() == r"$\tau/2\pi$"
    assert [t.get_text() for t in ax.get_legend().get_texts()][::2] == ["periods 3–5", "periods 5–7"]


@pytest.mark.jit
def test_notes_in_given_axes_are_a_legend(swept):
    ax = panels()
    ax.set_title("mine")
    swept.select(B=0.1).plot(ax=ax, notes=True)
    assert "certified" in ax.get_legend().get_title().get_text()
    assert [ax.get_title(loc) for loc in ("left", "center", "right")] == ["", "mine", ""]
    swept.select(B=0.15).plot(ax=ax, notes=True)
    assert "B = " not in ax.get_legend().get_title().get_text()
    several = panels(count=2)
    swept.plot(ax=several, notes=True)
    assert ["B = 0.1" in one.get_legend().get_title().get_text() for one in several] == [True, True]
    assert "certified" in several[0].get_legend().get_title().get_text()


@pytest.mark.jit
def test_notes_of_a_new_figure_can_be_left_out(swept, motion):
    for figure in (swept.plot(notes=False), motion.plot(notes=False)):
        assert not figure.legends
        assert not any(ax.get_title(loc) for ax in figure.axes for loc in ("left", "center", "right"))
    assert vd.plot.phase_curve(motion, ["mine"], notes=False).axes[0].get_title("left") == "mine"
    assert vd.plot.phase_curve(motion, ["mine"], ax=panels()).axes[0].get_title() == "mine"


@pytest.mark.jit
def test_what_would_be_hidden_or_ignored_in_given_axes_is_refused(swept, motion):
    one = swept.select(B=0.1)
    diagram, section, covered = panels(), panels(), panels()
    one.plot(ax=diagram)
    vd.plot.poincare(motion, ax=section)
    vd.plot.map(swept, "period", ax=covered)
    refused = [
        (
            diagram,
            "must be Axes without a result or with xi over A, but it shows dxi over A",
            one.plot,
            {"quantity": "xi"},
        ),
        (section, "with dxi over A, but it shows dxi over xi", one.plot, {}),
        (diagram, "two such figures hide each other", swept.plot, {"quantity": "period"}),
        (covered, "two such figures hide each other", swept.plot, {"quantity": "energy"}),
        (covered, "two such figures hide each other", one.plot, {}),
        (diagram, "width = 'single': must be left out with ax", one.plot, {"width": "single"}),
        (diagram, "style = 'loud': must be one of screen, print", one.plot, {"style": "loud"}),
        (diagram, "notes = 'much': must be True or False", one.plot, {"notes": "much"}),
        ([diagram, diagram], "2 different Axes", swept.plot, {}),
        (one.plot().axes[0], "must be Axes of a figure of yours", one.plot, {}),
    ]
    for ax, told, draw, options in refused:
        before = [drawn(a) for a in np.ravel(ax)]
        with pytest.raises(ValueError, match=told):
            draw(ax=ax, **options)
        assert [drawn(a) for a in np.ravel(ax)] == before, "a refused figure must change nothing"
    grey = panels()
    for _ in range(2):
        one.plot(ax=grey, style="print")
    assert [t.get_text() for t in grey.get_legend().get_texts()] == ["result (1)", "result (2)"]
    with pytest.raises(
        ValueError, match="style = 'print': must be left out, because it has colours for 2 results only"
    ):
        one.plot(ax=grey, style="print")


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


@pytest.mark.jit
@pytest.mark.parametrize("name", ["bifurcation", "poincare", "map", "trajectory", "phase_curve", "cobweb", "scheme"])
def test_settings_of_the_user_do_not_change_a_figure(name, swept, motion, orbits, tmp_path):
    """They have no effect when the figure is made, drawn, and saved by its own method or by the command line."""

    def files():
        figure = FIGURES[name][1](swept, motion, orbits, None)
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


def test_every_public_figure_is_tested():
    assert set(vd.plot.__all__) <= FIGURES.keys()


def test_other_objects_than_axes_are_refused(motion):
    for wrong in (3, "left", [], Figure()):
        with pytest.raises(ValueError, match=r"^ax = .*: must be one Axes$"):
            vd.plot.phase_curve(motion, ax=wrong)


def test_notebook_shows_a_figure(motion):
    figure = motion.plot()
    png, size = figure._repr_png_()
    pixels = matplotlib.image.imread(io.BytesIO(png))
    assert pixels.shape[1::-1] == (2 * size["width"], 2 * size["height"])
