"""Figures of trajectories show the chosen periods, name the settings, and break a curve at an impact."""

import math

import numpy as np
import pytest

import vibrodrive as vd
from tests.figures.made import fall, motion
from vibrodrive.figures import curves
from vibrodrive.figures.curves import curve
from vibrodrive.model.choices import Method, Status


def test_trajectory_names_its_settings_and_shows_the_first_periods():
    long = motion(1500, method=int(Method.FIXED), dtau=0.1)
    long.status = Status.TOO_CLOSE
    phase, time = curves.trajectory_figure(long).axes
    said = phase.get_title(loc="right")
    for part in ("fixed", r"\Delta\tau = 0.1", "periods 1001–2500", r"\xi_0 = 0", "too close to a decision"):
        assert part in said
    assert time.get_title(loc="right") == "first 10 of 1500 periods shown"
    assert time.get_xlim() == pytest.approx((0, 20 * math.pi))
    assert time.lines[0].get_xdata().max() < 20 * math.pi + 1e-6
    sine = next(line for line in time.lines if line.get_label() == r"$\sin\tau$")
    assert np.allclose(sine.get_ydata(), np.sin(sine.get_xdata()))
    (jump,) = (line for line in phase.lines if line.get_label() == curves.JUMP)
    assert jump.get_linestyle() != sine.get_linestyle(), "both are grey"
    assert curves.trajectory_figure(long, shown=None).axes[1].get_xlim()[1] == pytest.approx(3000 * math.pi)


@pytest.mark.parametrize(("periods", "irregular", "faint"), [(100, True, 100), (30, True, 0), (900, False, 0)])
def test_only_long_irregular_motions_have_a_faint_line_for_each_period(periods, irregular, faint):
    (ax,) = curves.phase_curve(motion(periods, irregular)).axes
    drawn = [line for lines in ax.collections for line in lines.get_segments()]
    assert len(drawn) in (faint, faint + 1)
    assert np.max(drawn[1] if faint else ax.lines[0].get_xdata(), initial=0.0) > 2.9
    assert all(line.get_zorder() > one.get_zorder() for line in ax.lines for one in ax.collections)


def test_impact_breaks_the_curve_and_is_stored_as_a_jump():
    deep = fall()
    deep.switches["xi"][0] = -0.1  # on a grid the mass is below the obstacle before an impact is noticed
    assert curve(deep).jumps[0, :, 1].tolist() == [-0.1, 0.0]
    drawn = curve(fall(), points_per_period=5)
    assert (np.diff(drawn.tau) >= 0).all()
    assert drawn.jumps.tolist() == [[[2, 0, -1], [2, 0, 0]]]
    (gap,) = np.flatnonzero(np.isnan(drawn.xi))
    assert (drawn.xi[gap - 1], drawn.dxi[gap - 1]) == (0, -1)
    assert (drawn.xi[gap + 1], drawn.dxi[gap + 1]) == (0, 0)
    assert np.allclose(drawn.xi[:gap], 2 - drawn.tau[:gap])
    assert (drawn.xi[gap + 1 :] == 0).all()


@pytest.mark.jit
def test_motion_of_a_scene_is_drawn_in_its_units():
    scene = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4)
    motion = vd.simulate(scene=scene, transient=50, periods=4)
    phase, time = motion.plot().axes
    jump, mine = (
        next(line for line in phase.lines if ("jump" in line.get_label()) == jumps) for jumps in (True, False)
    )
    fastest = np.nanmin(mine.get_ydata())
    assert "m/s" in phase.get_ylabel()
    assert 0.5 * fastest > np.nanmin(jump.get_ydata()) > fastest, "a jump must have the unit of the curve"
    assert time.get_xlim() == pytest.approx((0.0, 4e3 / 24.0))
    assert time.lines[0].get_xdata()[[0, -1]] == pytest.approx(time.get_xlim()), "from the beginning of the record"
    highest = 1e3 * scene.length(motion.sample(400).xi.max())
    assert max(mine.get_xdata()) == max(time.lines[0].get_ydata()) == pytest.approx(highest, rel=1e-4)
    assert motion.dimensionless().plot().axes[0].get_ylabel() == r"$\xi\mathrm{′}$"


def test_curves_and_titles_that_fit_no_panel_are_refused():
    fig = curves.trajectory_figure(fall(), ("phase", "time", "velocity", "section"))
    assert [ax.get_ylabel() for ax in fig.axes] == [r"$\xi\mathrm{′}$", r"$\xi$", *[r"$\xi\mathrm{′}$"] * 2]
    for wrong in ("time", [["time"]], 3, [], {"time": 1}):
        with pytest.raises(ValueError, match=r"curves = .*: must be a list of one or more of phase, time"):
            curves.trajectory_figure(fall(), wrong)
    with pytest.raises(ValueError, match="shown = 3: must be left out, because no curve over time"):
        curves.trajectory_figure(fall(), ["phase"], shown=3)
    with pytest.raises(ValueError, match=r"titles = .*: must be a list of 2, one for each panel"):
        curves.phase_curve([fall(), fall()], titles="ab")
    first, second = curves.phase_curve([fall(), fall()], titles=["exact", "grid"]).axes
    assert first.get_xlim() == second.get_xlim()
    assert second.get_title(loc="left") == "b) grid"
