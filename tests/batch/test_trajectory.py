"""Result of `simulate`: its memory and its description."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.batch import describe
from vibrodrive.batch.trajectory import SWITCH_ERROR
from vibrodrive.kernels.arguments import SWITCH
from vibrodrive.model.choices import Status
from vibrodrive.model.plan import make_plan


@pytest.mark.parametrize("method", ["certified", "fixed"])
def test_motion_uses_only_the_memory_of_its_switches(method):
    """The buffer of the computation is larger, because the number of switches is not known in advance."""
    dtau = None if method == "certified" else 0.1
    motion = vd.simulate(3.04, method=method, dtau=dtau, transient=0, periods=3)
    n = 1 + len(motion.switches)
    assert motion.switches.base.nbytes == n * SWITCH.itemsize
    assert motion.switch_errors.base.nbytes == n * SWITCH_ERROR.itemsize


@pytest.mark.jit
def test_more_switches_than_expected_are_all_stored():
    """The motion has sixty impacts in a row, with three times as many switches as the first buffer has rows."""
    hops = {"A": 1.2207337005962078, "B": 1.5638725555830817, "eps": 2.444604789503143e-4, "eta": 196.35606314394815}
    few, many = (vd.simulate(**hops, transient=0, periods=n) for n in (1, 2))
    assert len(few.switches) > 2 * (64 + 128)
    assert (many.switches[: len(few.switches)] == few.switches).all()
    assert (many.switch_errors[: len(few.switches)] == few.switch_errors).all()
    status = {record: vd.sweep(**hops, transient=0, periods=2, record=record).status for record in ("section", "error")}
    assert (many.status, status) == (Status.TOO_CLOSE, {"section": Status.OK, "error": Status.TOO_CLOSE})
    assert 'in `simulate` and with the record "error" for the exact motion' in Status.OK.advice


@pytest.mark.jit
def test_period_is_that_of_the_summary_even_if_the_record_is_short():
    for A in (1.5, 3.04, 3.2):
        assert vd.simulate(A, periods=1).period == vd.sweep(A=A, periods=256, record="summary").period


def test_motion_is_described_in_words():
    motion = vd.simulate(3.04, transient=200, periods=2)
    words = motion.describe().splitlines()
    assert words[0] == "A = 3.04, B = 0.1"
    assert words[1].startswith(f"OK, margin {motion.margin:.3g}: ")
    assert words[2:4] == [
        "period 2; impacts per excitation period: 0.5",
        "states: U D U D I (Up, Down, Stick, Rest, Impact)",
    ]
    still = vd.simulate(0.5, transient=0, periods=1).describe().splitlines()
    assert still[1].startswith("NEVER_LEAVES")
    assert len(still) == 3
    creeping, falling = (
        vd.simulate(2.4, B=B, xi0=1e9, transient=5, periods=1).describe().splitlines() for B in (0.5, 3)
    )
    short = "the record is too short for means, which need two main impacts"
    assert creeping[2:] == [f"no period up to 64; {short}"]
    assert falling[2:] == [f"period unknown, because too few periods are recorded; {short}"]


@pytest.mark.jit
def test_one_switch_is_counted_as_one():
    assert "; 1 switch, 0 main impacts; OK" in repr(vd.simulate(1.5, tau0=2.7, transient=0, periods=1))


SCENE = vd.Scene(a0=0.8e-3, omega0=150.0, mu=0.6, alpha=3.4, mass=250.0)


@pytest.mark.jit
def test_machine_is_described_in_si_units():
    motion = vd.simulate(scene=SCENE, transient=1000, periods=252)
    assert motion == vd.simulate(SCENE.A, B=SCENE.B, transient=1000, periods=252)
    said = motion.describe()
    hits = motion.switches[motion.switches["after"] == vd.State.IMPACT]
    speeds, seconds = SCENE.velocity(-hits["dxi"]), SCENE.time(2.0 * math.pi * 252)
    found = said.rows["machine"]
    assert found["impacts"] == pytest.approx(len(hits) / seconds, rel=1e-9)
    assert (found["impact_speed_max"], found["impact_speed_mean"]) == pytest.approx((speeds.max(), speeds.mean()))
    assert found["impact_power"] == pytest.approx(0.5 * SCENE.mass * (speeds**2).sum() / seconds, rel=1e-9)
    assert found["xi_max"] == pytest.approx(SCENE.length(motion.sample(4000).xi.max()), rel=1e-5)
    period = round(found["period"] * SCENE.frequency)
    assert np.allclose(motion.section[period:], motion.section[:-period], atol=1e-9)
    assert not np.allclose(motion.section[period // 2 :], motion.section[: -(period // 2)], atol=1e-3)
    more = vd.simulate(scene=replace(SCENE, omega0=SCENE.omega0 * 1.01), transient=1000, periods=252)
    assert said.rows["omega0 +1 %"] == more.describe().rows["machine"]
    assert f"{said.rows['mu −1 %']['impact_power']:.4g}" in said
    assert said.rows["mu -1 %"] is said.rows.get("mu -1 %") is said.rows["mu −1 %"]  # a keyboard has no "−"
    assert ("mu -1 %" in said.rows, "mu -2 %" in said.rows, said.rows.get("mu -2 %")) == (True, False, None)
    with pytest.raises(KeyError, match=r"row = 'nu': must be one of machine, a0 −1 %, "):
        said.rows["nu"]
    with pytest.raises(KeyError, match="no rows without a scene"):
        motion.dimensionless().describe().rows["machine"]
    assert f"<td>{found['impact_power']:.4g}</td>" in said._repr_html_()
    assert ["ms", "1/s", "m/s", "m/s", "W", "W", "mm", "mm/s"] in [line.split() for line in said.splitlines()]
    scales = {"period": 1e3, "xi_max": 1e3, "conveying": 1e3}
    shown = [f"{value * scales.get(name, 1.0):.4g}" for name, value in found.items()]
    assert ["machine", *shown] in [line.split() for line in said.splitlines()]
    assert f"period {period} ({1e3 * found['period']:.4g} ms)" in said
    light = vd.simulate(scene=vd.Scene(a0=0.8e-3, frequency=24.0, mu=0.6, alpha=3.4), periods=2).describe()
    assert "W/kg" in light
    assert "f = 24 Hz" in light


@pytest.mark.jit
def test_conveying_velocity_of_the_page_is_that_of_the_description():
    cells = re.findall(r"```{code-cell}\n(.*?)```", (Path(__file__).parents[2] / "docs" / "api.md").read_text(), re.S)
    (source,) = [cell for cell in cells if "def conveying(" in cell]
    names = {"np": np, "vd": vd, "__name__": "__main__"}
    exec(source, names)
    found, machine = [("frequency", names["r"])], names["machine"]
    for name, values in {"a0": [0.7e-3, 0.9e-3], "mu": [0.5, 0.6], "alpha": [3.0, 5.0]}.items():
        given = {name: values} if name != "mu" else {"points": {name: values}}
        found.append((name, vd.sweep(scene=machine, **given, xi0=1e5, record=names["own"], transient=200, periods=201)))
    for name, r in found:
        for velocity in r.to_xarray().conveying:
            motion = vd.simulate(scene=machine, **{name: float(velocity[name])}, periods=2)
            assert float(velocity) == pytest.approx(motion.describe().rows["machine"]["conveying"], rel=1e-6)
    steep = vd.simulate(scene=vd.Scene.quiet(**SCENE.given | {"alpha": 40.0}), periods=2).describe()
    assert steep.rows["machine"]["conveying"] == -math.inf
    assert steep.count("−∞\n") == len(steep.rows)
    assert "It is −∞ for B > 1" in steep


@pytest.mark.jit
@pytest.mark.parametrize("omega0", [2e3 * math.pi, 4e4 * math.pi])
def test_conveying_velocity_has_settled_or_is_not_given(omega0, monkeypatch):
    """The limit for A >> 1 is -a0 Ω0 sin(πB/2). At A = 80 821 a motion from rest reaches it in 10⁵ periods only. No
    description of a motion computes more than about these."""
    asked, compute = [], describe.compute
    monkeypatch.setattr(describe, "compute", lambda plan, *more: asked.append(plan.settings) or compute(plan, *more))
    motion = vd.simulate(scene=vd.Scene.quiet(a0=1e-5, omega0=omega0, mu=0.2, alpha=5.0), periods=2)
    found = motion.describe().rows["machine"]["conveying"]
    assert found == pytest.approx(-1e-5 * omega0 * math.sin(0.5 * math.pi * motion.arguments["B"]), rel=1e-4)
    assert max(s.transient + s.periods for s in asked) < 1.1e5
    monkeypatch.setattr(describe, "SETTLED", {False: -1.0, True: -1.0})
    told = motion.describe()
    assert math.isnan(told.rows["machine"]["conveying"])
    assert "has not settled" in told
    assert [line[-1] for line in told.splitlines() if line.startswith(("machine", "a0"))] == ["–"] * 3


@pytest.mark.jit
@pytest.mark.parametrize(("A", "eps", "transient"), [(1.5, 1e-3, 1000), (3.0, 0.0, 0)])
def test_conveying_velocity_is_the_mean_of_all_periods_after_a_transient(A, eps, transient):
    """The disturbance beats with the excitation: halves of the record give means that differ by 5e-6."""
    B, n = 0.3, 32 * describe.AVERAGED
    plan = make_plan({"A": A, "B": B, "eps": eps, "transient": transient})
    (found,) = describe.conveying(plan, np.array([A]), np.array([B]))
    gap = vd.sweep(A=A, B=B, eps=eps, xi0=1e6, transient=2000, periods=n).section[:, 0]
    assert found == pytest.approx((gap[-1] - gap[0]) / (2.0 * math.pi * (n - 1)), abs=1e-6)


def test_table_of_a_machine_is_in_si_units():
    motion = vd.simulate(scene=SCENE, transient=200, periods=4)
    table, plain = motion.to_dataframe(), motion.dimensionless().to_dataframe()
    assert table.columns.tolist() == ["t_s", "period", "phase", "before", "after", "x_m", "v_m_per_s"]
    assert np.allclose(table.v_m_per_s, SCENE.velocity(motion.switches["dxi"]))
    assert np.allclose(table.t_s, SCENE.time(plain.tau))
    assert np.allclose(motion.to_dataframe("impacts").speed_m_per_s, SCENE.velocity(motion.impacts["speed"]))
    assert motion.to_dataframe("section").columns.tolist() == ["t_s", "x_m", "v_m_per_s"]
    assert (table.attrs["units"], plain.attrs["units"]) == ({"t_s": "s", "x_m": "m", "v_m_per_s": "m s-1"}, {})
    assert (plain.dxi == motion.switches["dxi"]).all()
