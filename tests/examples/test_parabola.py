"""Tests of examples/parabola.py, which draws the steps of the certified search in the figure of docs/certified.md.

Each parabola is below the switching function, and the last step ends at the first zero of this function.
"""

import numpy as np
import pytest

import vibrodrive as vd
from examples.parabola import EPS, ETA, A, B, figure, g, search


@pytest.fixture(scope="module")
def steps():
    return search()


def test_no_parabola_rises_above_the_function(steps):
    for step in steps:
        s = np.linspace(0.0, step.length, 1001)
        assert (g(step.start + s) - step.at(s)).min() > -1e-13


def test_steps_end_at_the_first_zero_of_a_dense_scan(steps):
    zero = steps[-1].start + steps[-1].length
    tau = np.arange(0.0, 1.0, 1e-6)
    assert zero == pytest.approx(tau[np.argmax(g(tau) < 0.0)], abs=2e-6)
    assert zero == pytest.approx(vd.simulate(A, B=B, eps=EPS, transient=0, periods=1).switches["phase"][0], abs=1e-14)


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_are_those_of_the_function(order):
    tau, h = np.linspace(0.1, 0.3, 50), 1e-6
    numeric = (g(tau + h, order - 1) - g(tau - h, order - 1)) / (2.0 * h)
    assert g(tau, order) == pytest.approx(numeric, abs=1e-5 * ETA ** (1 + order))


def test_grid_of_the_picture_misses_two_zeros(steps):
    above, _ = figure().axes
    (grid,) = (line for line in above.lines if "grid" in line.get_label())
    zero = steps[-1].start + steps[-1].length
    between = g(np.linspace(0.0, zero + 0.02, 2001)) < 0.0
    assert between.any()
    assert not between[-1]
    x, y = grid.get_data()
    assert (np.asarray(y)[np.asarray(x) <= zero + 0.02] > 0.0).all()
