"""Sweeps over a scene in SI units equal sweeps over the same A and B to the bit. Their figures are in SI units."""

import re
from dataclasses import replace

import numpy as np
import pytest

import vibrodrive as vd
from tests.support import fake
from vibrodrive.batch.block import gather
from vibrodrive.model.config import parse
from vibrodrive.model.physical import PER_KG, UNITS
from vibrodrive.model.plan import make_plan
from vibrodrive.model.toml import as_toml
from vibrodrive.store.compare import compare
from vibrodrive.store.reader import look

SAID = {"impacts": r"\((\S+) per second\)", "impact_speed_mean": r"mean impact speed (\S+) m/s"}
SAID |= {"impact_speed_max": r"largest (\S+) m/s", "lyapunov": r"exponent (\S+) per second"}
MACHINE = vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4, mass=250.0)


@pytest.mark.jit
def test_machines_with_tolerances_are_points(tmp_path):
    """Each point equals the motion of its own machine, also from a file, with the numbers of its description."""
    rng = np.random.default_rng(1)
    drawn = {"a0": rng.normal(8e-4, 1e-5, 5), "frequency": rng.normal(24, 0.2, 5), "mu": rng.normal(0.6, 0.02, 5)}
    drawn |= {"alpha": rng.normal(3.4, 0.1, 5), "mass": rng.normal(250.0, 2.0, 5)}
    given = {"scene": MACHINE, "points": drawn, "record": ["section", "summary"], "transient": 60, "periods": 256}
    r, written = vd.sweep(**given), vd.sweep(**given, path=tmp_path / "x.h5")
    data, table = written.to_xarray(), written.to_dataframe()
    assert data.equals(r.to_xarray())
    assert compare(parse(as_toml(r.plan)).plan(), r.plan) == []
    assert table["frequency"].tolist() == drawn["frequency"].tolist()
    for k in range(5):
        machine = replace(MACHINE, **{name: values[k] for name, values in drawn.items() if name != "frequency"})
        machine = replace(machine, omega0=2.0 * np.pi * drawn["frequency"][k])
        motion = vd.simulate(scene=machine, transient=60, periods=256)
        assert motion.scene == machine
        assert motion.section.tobytes() == r.section[k].tobytes()
        row = motion.describe().rows["machine"]
        for name in ("impact_power", "xi_max", "impact_speed_max", "impacts"):
            assert data[name].values[k] == pytest.approx(row[name], rel=1e-14)
        for name, pattern in SAID.items():
            value = data[name].values[k]
            assert re.findall(pattern, motion.describe()) == [f"{value:.4g}"] * int(np.isfinite(value)), name
        one = r.select(point=k)
        assert one.scalars["A"] == pytest.approx(machine.A, rel=1e-15)
        assert one.to_xarray().impact_power == data.impact_power[k]
    ax = r.plot("bifurcation", "xi", x="frequency").axes[0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Excitation frequency $f$ in Hz", "gap x in mm")
    low, high = drawn["a0"].min() * 1e3, drawn["a0"].max() * 1e3
    assert ("point", f"a0 between {low:g} and {high:g} mm") in look(tmp_path / "x.h5").lines()


def test_figures_over_a_frequency_are_in_si_units():
    grows = [name for name, unit in UNITS.items() if unit.one(2.0, 3.0, 5.0) != unit.one(2.0, 3.0, 1.0)]
    assert grows == [*PER_KG], "what grows with the mass is per kilogram without one"
    f = np.array([20.0, 22.0, 24.0])
    plan = make_plan({"scene": MACHINE, "frequency": f, "periods": 20, "record": ["section", "impacts", "summary"]})
    r = gather(plan, fake.run_blocks(plan))
    r.status[:] = vd.Status.OK
    scenes = [vd.Scene(a0=0.8e-3, frequency=v, mu=0.6, alpha=3.4, mass=250.0) for v in f]
    assert r.select(frequency=24.0).scalars["A"] == scenes[2].A
    for name, label, convert in (
        ("xi_max", "largest gap x in mm", lambda s, v: 1e3 * s.length(v)),
        ("impacts", "impacts per second", lambda s, v: v * s.frequency),
        ("energy", "energy of the impacts per period in J", lambda s, v: s.power(v) / s.frequency),
    ):
        ax = r.plot(quantity=name).axes[0]
        assert (ax.get_xlabel(), ax.get_ylabel()) == ("Excitation frequency $f$ in Hz", label)
        wanted = [convert(s, v) for s, v in zip(scenes, getattr(r, name).tolist(), strict=True)]
        assert ax.lines[0].get_ydata() == pytest.approx(wanted, rel=1e-12)
    assert r.plot("bifurcation", "xi", limits=(0.0, 2e-3)).axes[0].get_ylim() == (0.0, 2.0), "limits are in m"
    assert r.dimensionless().plot(quantity="energy").axes[0].get_ylabel().endswith(", dimensionless")
    panels = r.plot("poincare").axes
    assert panels[2].lines[0].get_xdata().max() == pytest.approx(1e3 * scenes[2].length(r.section[2, :, 0].max()))
    assert panels[0].get_ylabel() == "velocity dx/dt in m/s"
