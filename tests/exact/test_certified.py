"""Certified motions agree with references that share nothing with the kernels: 50 digits, equations, other solvers.

`pytest -m exact` runs these tests and those of the error bounds, and prints each number with its bound.
"""

import math
from importlib import import_module

import numpy as np
import pytest

import vibrodrive as vd
from benchmarks.switches.model import Point
from tests.exact.agreement import LADDER, NAMES, ROUNDING, check_above_obstacle, compare, lowest, scene
from tests.exact.reference import ETA, SCENES, Oscillator, mp
from vibrodrive import State, Status

pytestmark = [pytest.mark.exact, pytest.mark.jit]

LATE = {"one-periodic": 1e-11, "two-periodic": 1e-11, "fast disturbance": 1e-8}
"""Bounds of the error in τ, by default 1e-10. In the last scene about twenty short flights in a row each multiply the
error by 2 to 3: an error of 1e-17 at the first impact becomes 1e-9 at the last one, in any arithmetic with doubles."""


def said(scene):
    return ", ".join(f"{name} = {value:g}" for name, value in scene.items())


@pytest.mark.parametrize("name", NAMES)
def test_switches_and_section_of_the_reference(name, finding):
    """States and order agree. The errors of all switches and section points are small, and below their bounds."""
    held = compare(vd.simulate(transient=0, **SCENES[name]), scene(name), most=10**9)
    assert len(held.motion.switches) == len(scene(name).switches)
    assert held.others == 0
    assert not held.broken
    assert math.isinf(held.motion.certain_until)
    late = max(pair.error for pair in held.pairs if pair.what == "tau of a switch")
    finding(f"{name} ({said(SCENES[name])}): error of a switch in τ", late, LATE.get(name, 1e-10))
    assert max(pair.error for pair in held.pairs) < 100 * max(late, 1e-13)


THROWS: dict[str, dict[str, float]] = {
    "undisturbed": {"A": 3.04, "dxi0": -2.0, "tau0": 2.5},
    "steep": {"A": 2.2, "B": 0.6, "dxi0": -0.7, "tau0": 3.0},
    "level": {"A": 1.7, "B": 0.0, "dxi0": -3.1, "tau0": -40.0},
    "disturbed": {"A": 3.04, "eps": 2e-4, "dxi0": -1.5, "tau0": 2.2},
    "slow disturbance": {"A": 2.6, "eps": 0.01, "eta": 7.3, "dxi0": -2.5, "tau0": 1.0},
    "fast disturbance": {"A": 1.9, "B": 0.2, "eps": 2e-5, "eta": 431.7, "dxi0": -1.0, "tau0": 2.9},
    "from great height": {"A": 4.5, "B": 0.9, "dxi0": -20.0, "tau0": 0.3},
}
"""Starts of slides down, by name. A slide ends in the air if its initial gap is large enough."""


@pytest.mark.parametrize("name", THROWS)
def test_grazing_ladder(name, finding):
    """The minimum of ξ is ±1e-3 … ±1e-15 or 0. The states are right, or the motion is flagged and the minimum is within
    rounding of 0.
    """
    throw, wrong, timid = THROWS[name], 0, 0
    drop = lowest(throw)
    for wanted in LADDER:
        height = float(mp.mpf(wanted) - drop)
        depth = float(mp.mpf(height) + drop)  # `height` is rounded to a double
        t = vd.simulate(**throw, xi0=height, transient=0, periods=30)
        terms = height + (abs(throw["dxi0"]) + 8) * 8
        close = t.status == Status.TOO_CLOSE
        if (t.switches[0]["after"] == State.IMPACT) != (depth <= 0):
            wrong += not close
            assert abs(depth) <= 4 * ROUNDING * terms, "the decision is wrong by more than rounding"
        assert t.margin <= abs(depth) + ROUNDING * terms
        assert close or abs(depth) > 2.0**-52 * height
        timid += close and abs(depth) > 100 * ROUNDING * terms and t.margin >= 0.9 * abs(depth)
        check_above_obstacle(t)
    assert not timid, "TOO_CLOSE although rounding is at most 1 % of the height"
    finding(f"{len(LADDER)} flights that graze the obstacle, {name}: wrong without TOO_CLOSE", wrong, 0)


@pytest.mark.parametrize(("eps", "eta"), [(0.0, ETA), (1e-6, ETA), (0.01, 7.3)])
def test_phase_after_a_million_periods(eps, eta, finding):
    """After a million periods each rest ends at the instant at which H = 1, computed with 60 digits.

    So the phases of the excitation, τ, and of the disturbance, ητ, have errors of at most this order.
    """
    t = vd.simulate(A=1.5, eps=eps, eta=eta, transient=1_000_000, periods=5)
    model, late = Oscillator(1.5, 0.1, eps, eta), []
    with mp.workdps(60):
        for row in t.switches[t.switches["before"] == State.REST]:
            tau = 2 * mp.pi * int(row["period"]) + mp.mpf(float(row["phase"]))
            rate = sum(a * w * mp.cos(w * tau) for a, w in model.terms)
            late.append(abs(float((model.H(tau) - 1) / rate)))
    assert t.switches["period"].min() >= 1_000_000
    finding(f"{said({'eps': eps, 'eta': eta})}: error in τ of a rest's end after 10⁶ periods", max(late), 1e-12)


def test_energy_balance(finding):
    """The work of the excitation equals the losses by friction and impacts; each of the three is summed separately.

    Over one period of a periodic motion the imbalance is zero, because the mass returns and gravity does no work. For
    any other motion the sums extend from the first to the last recorded switch, with ξ' = 0 at both switches. Between
    these switches gravity does the work B times the difference of the gaps, which is at most B ξ_max.
    """
    B, periods = 0.1, 300
    A = np.linspace(1.2, 5.0, 96)
    swept = vd.sweep(A=A, B=B, eps=[0.0, 2e-4], transient=200, periods=periods, record="summary")
    off = np.abs(swept.drive_work - swept.friction_loss - swept.energy)
    periodic = swept.period > 0
    assert 20 < periodic.sum() < periodic.size - 20
    finding("periodic motions: imbalance of energy over the work", (off / swept.drive_work)[periodic].max(), 1e-12)
    finding("other motions: imbalance over B ξ_max", (off * (periods - 1) / (B * swept.xi_max))[~periodic].max(), 1.0)


ONE_WAVE = [Point(A, B, 0.0, ETA) for A, B in ((1.5, 0.1), (3.04, 0.1), (3.3, 0.4))]
TWO_WAVES = [Point(2.6, 0.1, 0.01, 7.3), Point(3.04, 0.1, 5e-5, ETA)]

PEERS = {
    "scipy": ("scipy_ivp", {"method": "DOP853", "rtol": 1e-12}, 1e-9),
    "heyoka": ("heyoka_events", {"tol": 2.0**-52}, 1e-11),
}
"""By package: module in benchmarks/switches/solvers, its settings, and the bound of the difference in τ. The error of
DOP853 over 20 periods is about 1e-11, that of heyoka's Taylor series about 1e-13."""


@pytest.mark.parametrize("package", PEERS)
def test_events_of_a_general_solver(package, finding):
    """Without a disturbance, and with a slow or a weak one, general solvers miss no switch in 20 periods."""
    pytest.importorskip(package)
    module, settings, bound = PEERS[package]
    solver = import_module(f"benchmarks.switches.solvers.{module}")
    for point in (*ONE_WAVE, *TWO_WAVES):
        theirs = solver.events((0.0, 0.0, 0.0, 40.0 * math.pi), point, **settings)
        ours = vd.simulate(**point._asdict(), transient=0, periods=20).switches
        assert [row[1:] for row in theirs] == list(zip(ours["before"], ours["after"], strict=True))
        tau = 2.0 * math.pi * ours["period"] + ours["phase"]
        late = np.abs(np.array([row[0] for row in theirs]) - tau).max()
        finding(f"{package}, {said(point._asdict())}: difference in τ", late, bound)
