"""The figure of limits of stability (k₂) shows only known limits, in ε and Δτ and as velocities. It shows ratios
only of two known limits."""

from dataclasses import replace

import numpy as np
import pytest

from vibrodrive.figures.limits import limits_figure
from vibrodrive.figures.style import save
from vibrodrive.stability.limits import QUANTITIES, Limits


def of(axes, k2, factor=100.0, mm_s=None, **options):
    """Return `Limits` with the values k2, float64 (3, axes…), in ε, in Δτ of `fixed` and in Δτ of `muller`.

    factor : velocity of a limit in ε, divided by the limit
    """
    scale = np.array([factor, 1.0, 1.0]).reshape(3, *(1,) * (k2.ndim - 1))
    numbers = {name: k2.copy() for name in QUANTITIES["k2"].numbers}
    numbers |= {"last_kept": 2 * k2, "velocity": scale * k2, "velocity_last": 2 * scale * k2}
    some = {"n": np.ones(k2.shape, int), "done": np.ones(k2.shape, bool), "how": np.full(k2.shape, "")}
    fixed = {name: 1.0 for name in ("A", "B", "eta") if name not in axes}
    some |= {"axes": axes, "fixed": fixed, "numbers": numbers, "criterion": "impacts", "title": "", "mm_s": mm_s}
    return Limits(**(some | options))


def drawn(ax):
    """Return the lines of limits by their labels."""
    return {line.get_label(): line.get_ydata() for line in ax.lines if line.get_label().startswith("$")}


@pytest.fixture
def over_A():
    A = np.linspace(2.4, 3.2, 81)
    k2 = np.stack([np.full(81, 1e-4), np.full(81, 2e-2), np.full(81, np.inf)])
    k2[0, 10] = np.nan
    k2[1, 20] = np.inf
    n = np.where(np.arange(81) < 40, 1, 2) * np.ones((3, 1), int)
    return of({"A": A}, k2, n=n, done=~np.isinf(k2) | (np.arange(3)[:, None] == 1), fine=A, diagram=np.ones((81, 5)))


def test_panels_share_one_axis(over_A):
    fig = limits_figure(over_A)
    top, velocity, ratio, bottom = fig.axes
    assert len({ax.get_xlim() for ax in fig.axes}) == 1
    assert {ax.get_yscale() for ax in (top, velocity, ratio)} == {"log"}
    assert [t.get_text() for t in top.texts] == ["$n = 1$", "$n = 2$"]
    assert bottom.get_images()
    eps, fixed, muller = drawn(top).values()
    assert np.flatnonzero(np.isnan(eps)).tolist() == [10]
    assert np.flatnonzero(np.isnan(fixed)).tolist() == [20]
    assert np.isnan(muller).all(), "a structure that was never lost has no limit"
    V = drawn(velocity)
    assert list(V) == list(drawn(top))[:2], "a switch that Muller's method finds is not late by Δτ"
    assert np.nanmax(np.abs(V[r"$k_2(\varepsilon)$"] - 1e-2)) < 1e-15
    assert np.array_equal(list(V.values())[1], fixed, equal_nan=True), "a limit in Δτ is a velocity without conversion"


def test_band_extends_from_the_first_loss_to_the_last_value_kept(over_A):
    top = limits_figure(over_A).axes[0]
    ends = [line.get_ydata() for line in top.lines if line.get_linewidth() == 0.25]
    for band, end, first in zip(top.collections, ends, drawn(top).values(), strict=True):
        known = ~np.isnan(first)
        assert np.array_equal(end[known], 2 * first[known])
        corners = np.concatenate([path.vertices for path in band.get_paths()] or [np.empty((0, 2))])
        assert set(corners[:, 1]) == set(first[known]) | set(2 * first[known])


def test_limits_not_computed_are_not_reported_as_missing_points():
    """The period n is 0 if a limit is not computed or a motion has no period. Only the latter point is missing."""
    A, done = np.linspace(2.4, 3.2, 9), np.zeros((3, 9), bool)
    blank = of({"A": A}, np.full((3, 9), np.nan), n=np.zeros((3, 9), int), done=done, fine=A, diagram=np.ones((9, 5)))
    top = limits_figure(blank).axes[0].get_title(loc="right")
    assert "missing points" not in top
    assert "27 of 27 limits not computed" in top.replace("\n", " ")
    done[:, 3] = True
    note = limits_figure(blank).axes[0].get_title(loc="right").replace("\n", " ")
    assert "missing points: no periodic motion" in note


def test_ratio_is_drawn_only_where_both_limits_are_known(over_A):
    ratio = limits_figure(over_A).axes[2]
    assert ratio.get_ylabel() == "ratio"
    fixed = ratio.lines[0].get_ydata()
    assert np.flatnonzero(np.isnan(fixed)).tolist() == [10, 20]
    assert np.allclose(fixed[~np.isnan(fixed)], 2.0, rtol=1e-12)
    low, high = ratio.get_ylim()
    assert low < 1 < high
    assert any(np.all(np.asarray(line.get_ydata()) == 1.0) for line in ratio.lines), "there must be a line at 1"


def test_note_on_ratios_gives_median_and_90_per_cent_range():
    A = np.linspace(1.5, 2.5, 101)
    k2 = np.stack([np.full(101, 0.01), np.linspace(0.2, 2.2, 101), np.ones(101)])
    ratio = limits_figure(of({"A": A}, k2, fine=A, diagram=np.ones((101, 5)))).axes[2]
    assert ratio.get_title(loc="right") == "median 1.2, 90 % between 0.3 and 2.1"


def test_axis_of_eta_is_logarithmic_and_of_b_linear():
    eta = np.geomspace(3.1, 1009.9, 9)
    fig = limits_figure(of({"eta": eta}, np.stack([0.2 / eta, 0.1 + 0 * eta, 0.1 + 0 * eta])))
    assert len(fig.axes) == 2
    assert fig.axes[0].get_xscale() == "log"
    assert fig.axes[1].get_xlabel() == r"$\eta$"
    assert len(drawn(fig.axes[0])) == 2
    B = np.linspace(0.01, 0.9, 9)
    assert limits_figure(of({"B": B}, np.ones((3, 9)))).axes[0].get_xscale() == "linear"


@pytest.mark.parametrize("swapped", [False, True])
def test_longer_axis_is_the_abscissa_and_the_other_has_lines(swapped):
    A, eta = np.array([2.4, 2.8, 3.04]), np.geomspace(3.1, 1009.9, 7)
    k2 = np.empty((3, 3, 7))
    k2[0] = A[:, None] / eta
    k2[1:] = 10 * A[:, None]
    k2[0, 1, 2] = np.inf
    axes = {"A": A, "eta": eta}
    if swapped:
        axes, k2 = {"eta": eta, "A": A}, k2.swapaxes(1, 2)
    fig = limits_figure(of(axes, k2))
    assert len(fig.axes) == 2, "limits in Δτ must have no panel, because they do not depend on η"
    velocity, ratio = fig.axes
    lines = drawn(velocity)
    assert list(lines) == ["$A = 2.4$", "$A = 2.8$", "$A = 3.04$"]
    assert np.allclose(lines["$A = 3.04$"], 100 * 3.04 / eta, rtol=1e-14)
    assert np.flatnonzero(np.isnan(lines["$A = 2.8$"])).tolist() == [2]
    assert np.flatnonzero(np.isnan(drawn(ratio)["$A = 2.8$"])).tolist() == [2]
    assert np.allclose(drawn(ratio)["$A = 2.4$"], eta / 10, rtol=1e-14)
    assert len({(line.get_linestyle(), line.get_color()) for line in velocity.lines}) == 3


def test_limits_over_b_have_a_panel_for_each_kind():
    A, B = np.linspace(1.5, 3.0, 9), np.linspace(0.05, 0.5, 20)
    k2 = 1e-3 * np.ones((3, 9, 1)) * (1 + B)
    fig = limits_figure(of({"A": A, "B": B}, k2))
    assert len(fig.axes) == 3
    assert [len(drawn(ax)) for ax in fig.axes] == [6, 6, 6], "at most six values of the other axis"
    assert fig.axes[-1].get_xlabel() == "$B$"


@pytest.mark.parametrize("axes", [{"eta": 5}, {"A": 5}, {"A": 2, "B": 5}])
def test_scene_in_si_units_has_mm_s_on_the_right(axes, tmp_path):
    values = {name: np.linspace(1.5, 2.5, k) for name, k in axes.items()}
    k2 = 1e-3 * (1.0 + np.arange(3 * np.prod(list(axes.values())))).reshape(3, *axes.values())
    options = {"fine": values["A"], "diagram": np.ones((5, 4))} if list(axes) == ["A"] else {}
    fig = limits_figure(of(values, k2, mm_s=39.16, **options))
    save(fig, tmp_path / "x.png")  # the range of the second axis is set when the figure is drawn
    second = [child for ax in fig.axes for child in ax.child_axes]
    assert {ax.get_ylabel() for ax in second} == {"$V$ in mm/s"}
    for ax in fig.axes:
        for child in ax.child_axes:
            assert child.get_ylim() == pytest.approx(39.16 * np.array(ax.get_ylim()), rel=1e-9)


@pytest.mark.parametrize("axes", [{"A": 1}, {"A": 4}, {"eta": 3}, {"B": 1}, {"B": 2, "eta": 3}])
def test_figure_without_limits_reports_missing_points(axes, tmp_path):
    values = {name: np.linspace(1.5, 2.5, k) for name, k in axes.items()}
    shape = (3, *axes.values())
    options = {"fine": np.linspace(1.5, 2.5, 7), "diagram": np.ones((7, 4))} if list(axes) == ["A"] else {}
    fig = limits_figure(of(values, np.full(shape, np.nan), done=np.zeros(shape, bool), **options))
    save(fig, tmp_path / "x.png")
    total = int(np.prod(shape))
    assert any(f"{total} of {total} limits not computed" in ax.get_title(loc="right") for ax in fig.axes)


def test_criterion_and_reasons_for_missing_points_are_named_for_any_axes(over_A):
    near = replace(over_A, criterion="impacts and word")
    top = limits_figure(near).axes[0]
    said = top.get_title(loc="right")
    assert "criterion: impacts and word" in said
    assert "missing points: no limit found" in said, "at A = 2.6 the limit in Δτ is infinite"
    assert "kept" not in limits_figure(over_A).axes[0].get_title(loc="right")
    eta = of({"eta": np.array([3.1, 10.3])}, np.ones((3, 2)), criterion="word")
    assert "criterion: word" in limits_figure(eta).axes[0].get_title(loc="right")
    two = of({"A": np.array([2.0, 3.0]), "B": np.array([0.1, 0.2, 0.3])}, np.ones((3, 2, 3)), criterion="word")
    assert "criterion: word" in limits_figure(two).axes[0].get_title(loc="right")
