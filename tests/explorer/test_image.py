"""Images of diagrams, compared with counts by NumPy in each column, and cells of maps."""

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.explorer.image import (
    ONLY_CERTIFIED,
    ONLY_CHOSEN,
    PICTURE_ROWS,
    SHADES,
    _nearest,
    difference,
    fitting_range,
    pictures,
    shades_of,
    values_of,
)
from vibrodrive.explorer.view import View
from vibrodrive.explorer.work import Level, Pace, Part, Work
from vibrodrive.jit.slices import Halt


def test_every_value_marks_its_pixel_and_the_pixel_above():
    rng = np.random.default_rng(5)
    values = rng.normal(size=(30, 50))
    values[3, :20] = np.nan
    values[4] = 0.25
    image, columns = np.zeros((PICTURE_ROWS, 40), np.uint8), rng.permutation(40)[:30]
    shades_of(values, columns, -1.0, 1.5, image)
    for i, column in enumerate(columns):
        counts, _ = np.histogram(values[i][values[i] < 1.5], PICTURE_ROWS, (-1.0, 1.5))
        there = counts > 0
        there[1:] |= counts[:-1] > 0
        assert ((image[:, column] > 0) == there).all()
    assert image[:, columns[4]].max() == SHADES - 1  # all values are in one pixel, which has the darkest shade
    assert not image[:, np.setdiff1d(np.arange(40), columns)].any()


def test_difference_marks_the_method_of_each_pixel():
    chosen, certified = np.zeros((2, PICTURE_ROWS, 3), np.uint8)
    chosen[10, 0] = certified[11, 0] = 5  # pixels in adjacent rows count as equal
    chosen[100, 1] = 7
    certified[200, 2] = 9
    found = difference(chosen, certified)
    assert [found[k] for k in ((10, 0), (11, 0), (100, 1), (200, 2))] == [5, 5, ONLY_CHOSEN + 7, ONLY_CERTIFIED + 9]
    assert (found > 0).sum() == 4


@pytest.mark.jit
def test_missing_columns_repeat_the_column_on_their_left():
    work = Work([View.read({"columns": 9, "transient": 20, "periods": 20}).plan()], 1)
    list(work.levels(Pace(), Halt()))
    low, high = fitting_range(Level(work.part, None), "dxi")
    (full,) = pictures(Level(work.part, None), "dxi", low, high)
    done = np.arange(9) % 4 == 0
    coarse, rest = Part(work.part.results, done), Part(work.part.results, ~done)
    assert np.array_equal(pictures(Level(coarse, None), "dxi", low, high)[0], full[:, [0, 0, 0, 0, 4, 4, 4, 4, 8]])
    assert np.array_equal(pictures(Level(coarse, rest), "dxi", low, high)[0], full)


@pytest.mark.jit
def test_motion_out_of_budget_is_not_drawn():
    """Values of fewer periods would give a different picture."""
    given_up = vd.sweep(A=[1.5, 1.6], eps=[5e-4], transient=0, periods=30, budget=60, tau0=1.0)
    assert (given_up.status == vd.Status.BUDGET).all()
    assert np.isnan(values_of(given_up, "dxi")).all()


def test_coarse_cells_of_a_map():
    done = np.zeros((40, 35), bool)
    done[::16, ::16] = True
    assert _nearest(done).reshape(40, 35)[39, 34] == 32 * 35 + 32
    done[::2, ::2] = True
    found = _nearest(done).reshape(40, 35)
    assert (found[39, 34], found[0, 1]) == (38 * 35 + 34, 0)
    assert done.reshape(-1)[found].all()
