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
    assert run("verify", "s.h5")[0] == 0
    code, _, err = run("trajectory", "s.toml")
    assert code == 2
    assert "sweep.omega0 = 12 values from 120 to 160: must be one number (--set omega0=120)" in err
    one = ["--set", "omega0=[150]", "--set", "alpha=3.4", "--set", "eps=0"]
    assert run("trajectory", "s.toml", *one, "-o", "m.png")[0] == 0
    assert np.fromfile("m.png", np.uint8).size > 1000
