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
    assert not [*spare.lines, *spare.images, *spare.collections, *spare.patches, *spare.texts]
    assert not figure.legends, "a legend must be in the given axes and not in the figure"
    figure.savefig(io.BytesIO())
    with pytest.raises(ValueError, match=r"must be (one|[0-9]) Axes"):
        draw(swept, motion, orbits, figure.subplots(1, panels + 1))
    assert draw(swept, motion, orbits, None) is not figure, "without given axes the figure must be a new one"


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
