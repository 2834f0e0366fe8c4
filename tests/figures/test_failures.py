"""The figure of a failure map distinguishes points without a failure, with few failures, and without switches."""

import numpy as np
import pytest

from vibrodrive.figures.failures import LEAST, failures_figure
from vibrodrive.stability.failures import JUDGED, KINDS, METHODS
from vibrodrive.store.failures import FailureMap


@pytest.fixture
def found():
    """Return a failure map. For the first three values of A, 0, 20 and 5000 of 100 000 switches are missed. The last
    value of A has no switches."""
    shape = (len(METHODS), 4, 3)
    judged = np.full(shape, 100_000)
    judged[:, 3] = 0
    counts = {kind: np.zeros(shape, int) for kind in KINDS}
    counts["missed"][:, 1] = 20
    counts["missed"][:, 2] = 5000
    scalars, settings = {"B": 0.1, "eps": 2e-4, "eta": 101.0, "dtau": 0.01}, {"transient": 200, "periods": 300}
    limit = np.array([[0.05, 0.02, np.inf, np.nan]] * len(METHODS))
    return FailureMap(np.arange(4.0), "dtau", np.geomspace(1e-3, 1.0, 3), judged, counts, limit, scalars, settings)


def test_zero_small_and_unjudged_shares_look_different(found):
    fig = failures_figure(found)
    ax = fig.axes[0]
    none, some = (mesh.get_array() for mesh in ax.collections)
    mesh = ax.collections[1]
    assert none.mask[0].tolist() == [False, True, True, True], "only points without a failure are white"
    colour = {A: mesh.to_rgba(some[0, A]) for A in (1, 2)}
    assert some[0, 1] < LEAST < some[0, 2]
    assert sum(colour[1][:3]) > sum(colour[2][:3]), "a small share must be lighter than a large share"
    assert 2.95 > sum(colour[1][:3]) > sum(mesh.to_rgba(LEAST)[:3]), "it must be lighter than LEAST, but not white"
    assert some.mask[0].tolist() == [True, False, False, True], "points without switches must be hatched"
    assert ax.patch.get_hatch()
    assert "no switch: the mass never moves" in {t.get_text() for t in fig.legends[0].get_texts()}


def test_figure_names_the_line_and_the_conditions(found):
    fig = failures_figure(found)
    line = "structure of the motion lost above this line (periods 201–500)"
    assert line in {t.get_text() for t in fig.legends[0].get_texts()}
    said = fig.axes[2].get_title(loc="right")
    assert r"\varepsilon = 2" in said
    assert f"periods 201–{200 + JUDGED}" in said, "the failures are counted in these periods only"
    assert r"\Delta" not in said, "Δτ is an axis and no condition"


@pytest.mark.parametrize(("width", "rows"), [("double", 2), ("single", 3)])
def test_panels_of_one_column_are_stacked(found, width, rows):
    fig = failures_figure(found, width=width)
    assert fig.axes[0].get_subplotspec().get_gridspec().nrows == rows
    names = [ax.get_title(loc="left")[3:] for ax in fig.axes[: len(METHODS) * len(KINDS)]]
    assert sorted(names) == sorted(f"{m}: {k}" for m in METHODS for k in KINDS)
