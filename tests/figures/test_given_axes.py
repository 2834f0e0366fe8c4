"""Every figure has a public name, is displayed in a notebook, and can be drawn into given axes."""

import io

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure
from vibrodrive.store.failures import FailureMap

import vibrodrive as vd
from tests.figures.test_limits import of as limits_of
from vibrodrive.periodic.family import family

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
