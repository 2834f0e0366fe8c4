"""Sweeps over a scene in SI units equal sweeps over the same A and B to the bit. Figures show axes in SI units."""

from pathlib import Path

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.batch.sweep import run_blocks
from vibrodrive.figures.diagrams import from_results
from vibrodrive.model.config import parse
from vibrodrive.model.results import Results

TEXT = (
    "[physical]\na0 = 8e-4\nmu = 0.6\n"
    "[sweep]\nomega0 = {start = 120, stop = 160, num = 12}\neps = [0, 1e-4]\nalpha = [2, 3.4]\n"
    "[run]\ntransient = 30\nperiods = 20\n"
)


@pytest.fixture(scope="module")
def results():
    plan = parse(TEXT).plan()
    return Results.collect(plan, run_blocks(plan))


@pytest.mark.jit
def test_scene_axes_equal_the_same_numbers_given_directly(results):
    assert results.section.shape == (12, 2, 2, 20, 2)
    for i, omega0 in enumerate(results.axes["omega0"].tolist()):
        for k, alpha in enumerate(results.axes["alpha"].tolist()):
            scene = vd.Scene(a0=8e-4, omega0=omega0, mu=0.6, alpha=alpha)
            direct = vd.sweep(A=scene.A, B=scene.B, eps=[0, 1e-4], transient=30, periods=20)
            for name in ("section", "margin", "status", "switches"):
                assert getattr(results, name)[i, :, k].tobytes() == getattr(direct, name).tobytes()


@pytest.mark.jit
def test_figures_have_the_units(results):
    figure = from_results(results)
    assert figure.axes[-1].get_xlabel() == r"$\Omega_0$ in rad/s"
    assert figure.axes[0].get_title(loc="left") == r"a) $\varepsilon = 0$, $\alpha = 2$°"
    assert r"$a_0 = 0.8$ mm" in figure.axes[0].get_title(loc="right")
    low, high = figure.axes[0].get_xlim()
    assert (low, high) == pytest.approx((120.0, 160.0), abs=1.3), "with room for the first and the last mark"
    over = from_results(results.select("nearest", omega0=150, eps=0), kind="bifurcation")
    assert over.axes[0].get_xlabel() == r"$\alpha$ in °"
    assert r"$\Omega_0 = 149.091$ rad/s" in over.axes[0].get_title(loc="right")
    single = from_results(results.select("nearest", omega0=150, eps=0, alpha=2))
    A = vd.Scene(a0=8e-4, omega0=float(results.axes["omega0"][8]), mu=0.6, alpha=2.0).A
    assert f"$A = {A:.6g}$" in single.axes[0].get_title(loc="right")


@pytest.mark.jit
def test_commands_compute_draw_or_refuse(run):
    Path("s.toml").write_text(TEXT)

    assert run("sweep", "s.toml", "--plot")[0] == 0
    assert "nothing to compute" in run("sweep", "s.toml")[2]
    assert "axis      omega0 = 120 to 160 rad/s, 12 values" in run("info", "s.h5")[1]
    assert run("info", "--check", "s.h5")[0] == 0
    code, _, err = run("trajectory", "s.toml")
    assert code == 2
    assert "sweep.omega0 = 12 values from 120 to 160: must be one number (--set omega0=120)" in err
    one = ["--set", "omega0=[150]", "--set", "alpha=3.4", "--set", "eps=0"]
    assert run("trajectory", "s.toml", *one, "-o", "m.png")[0] == 0
    assert np.fromfile("m.png", np.uint8).size > 1000


MACHINE = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4, mass=250.0)


@pytest.mark.jit
def test_figures_over_a_frequency_are_in_si_units():
    f = np.array([20.0, 22.0, 24.0])
    r = vd.sweep(scene=MACHINE, frequency=f, transient=50, periods=20, record=["section", "impacts", "summary"])
    scenes = [vd.Scene(a0=0.8e-3, frequency=v, mu=0.6, alpha=3.4, mass=250.0) for v in f]
    assert r.select(frequency=24.0).scalars["A"] == scenes[2].A
    for name, label, convert in (
        ("impact_speed_max", "largest impact speed in m/s", lambda s, v: s.velocity(v)),
        ("xi_max", "largest gap x in mm", lambda s, v: 1e3 * s.length(v)),
        ("impacts", "impacts per second", lambda s, v: v * s.frequency),
        ("energy", "energy of the impacts per period in J", lambda s, v: s.power(v) / s.frequency),
        ("period", "period of the motion", None),
    ):
        ax = r.plot(quantity=name).axes[0]
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("Excitation frequency $f$ in Hz", label)
        if convert:
            wanted = [convert(s, v) for s, v in zip(scenes, getattr(r, name).tolist(), strict=True)]
            assert ax.lines[0].get_ydata() == pytest.approx(wanted, rel=1e-12)
        plain = r.dimensionless().plot(quantity=name).axes[0]
        assert plain.get_ylabel().endswith(", dimensionless") == (convert is not None)
    ax = r.plot("bifurcation", limits=(-0.2, 0.01)).axes[0]
    assert (ax.get_ylabel(), ax.get_ylim()) == ("velocity dx/dt in m/s", (-0.2, 0.01))
    assert r.plot("bifurcation", "xi", limits=(0.0, 2e-3)).axes[0].get_ylim() == (0.0, 2.0), "limits are in m"
    panels = r.plot("poincare").axes
    assert panels[2].lines[0].get_xdata().max() == pytest.approx(1e3 * scenes[2].length(r.section[2, :, 0].max()))
    assert panels[0].get_ylabel() == "velocity dx/dt in m/s"


@pytest.mark.jit
def test_motion_of_a_scene_is_drawn_in_si_units():
    motion = vd.simulate(scene=MACHINE, transient=50, periods=3)
    phase, time = motion.plot().axes
    assert [ax.get_ylabel() for ax in (phase, time)] == ["velocity dx/dt in m/s", "gap x in mm"]
    assert time.get_xlabel() == "time in ms from the beginning of the record"
    assert time.get_xlim()[1] == pytest.approx(3e3 / 24.0)
    highest = 1e3 * MACHINE.length(motion.sample(400).xi.max())
    assert max(phase.lines[0].get_xdata()) == max(time.lines[0].get_ydata()) == pytest.approx(highest, rel=1e-4)
    assert "$f = 24$ Hz" in phase.get_title(loc="right")
    for plain in (motion.dimensionless().plot(), vd.plot.phase_curve([motion, vd.simulate(3.0, periods=3)])):
        assert plain.axes[0].get_ylabel() == r"$\xi\mathrm{′}$"
