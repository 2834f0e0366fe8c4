"""The certified path compared with the 50-digit reference, which imports no kernel."""

from __future__ import annotations

import math

import numpy as np
import pytest

import vibrodrive as vd
from tests.support.reference import SCENES, mp, scene
from vibrodrive.validation.clocks import phase_error


def errors(exact, trajectory):
    """Return the errors in τ, ξ and ξ' of all switches, after checking that states and order agree."""
    rows = trajectory.switches
    assert [(s.before, s.after) for s in exact.switches] == [(r["before"], r["after"]) for r in rows]
    late, dx, dv = [], [], []
    for s, r in zip(exact.switches, rows, strict=True):
        turns = (int(r["period"]) - s.period) * 2 * mp.pi
        late.append(abs(float(turns + (mp.mpf(float(r["phase"])) - s.phase))))
        dx.append(abs(float(s.xi - mp.mpf(float(r["xi"])))))
        dv.append(abs(float(s.dxi - mp.mpf(float(r["dxi"])))))
    return np.array(late), np.array(dx), np.array(dv)


def certified(name):
    arguments = dict(SCENES[name])
    return vd.simulate(transient=0, method="certified", **arguments)


@pytest.mark.jit
@pytest.mark.parametrize(("name", "bound"), [("one-periodic", 1e-11), ("two-periodic", 1e-11), ("disturbed", 1e-10)])
def test_switches_of_the_paper(name, bound):
    """1000 periods at ε = 0 agree to 1e-11 in τ, 100 periods at ε = 2e-4 to 1e-10."""
    tau, dx, dv = errors(scene(name), certified(name))
    assert tau.max() < bound
    assert dx.max() < 100 * bound
    assert dv.max() < 100 * bound


@pytest.mark.jit
@pytest.mark.parametrize("name", [n for n in SCENES if n not in ("one-periodic", "two-periodic", "disturbed")])
def test_switches_beyond_the_paper(name):
    """All scenes agree to 1e-10, except one in which the mass chatters.

    There some twenty bounces in a row each multiply the error by 2 to 3. An error of 1e-17 at the first bounce becomes
    1e-9 at the last one, in any arithmetic with doubles.
    """
    exact, ours = scene(name), certified(name)
    late, _, _ = errors(exact, ours)
    assert late.max() < (1e-8 if name == "fast disturbance" else 1e-10)
    section = np.array([[float(x), float(v)] for x, v in exact.section])
    assert np.abs(ours.section - section).max() < 100 * max(late.max(), 1e-13)


@pytest.mark.jit
def test_clocks_stay_right_for_a_million_periods():
    """H = 1 where REST ends: evaluated in 50 digits at the recorded instant, after a million periods.

    H depends on η (2π n + φ). An error of 1e-12 in the phase of τ or of ητ would change H by 1e-11.
    """
    eps = 1e-6
    t = vd.simulate(A=1.5, eps=eps, transient=1_000_000, periods=5)
    assert (t.switches["before"] == vd.State.REST).sum() >= 5
    assert phase_error(t) < 1e-12


@pytest.mark.jit
def test_start_shifted_by_whole_periods():
    """τ0 = 2πk gives the orbit of τ0 = 0 shifted by k periods, up to the rounding of 2πk."""
    base = vd.simulate(A=3.04, xi0=1.0, transient=0, periods=30)
    for k in (1, 1000, 10**8):
        shifted = vd.simulate(A=3.04, xi0=1.0, tau0=2 * math.pi * k, transient=0, periods=30)
        assert np.array_equal(base.switches["after"], shifted.switches["after"])
        turn = 2 * math.pi * (shifted.switches["period"] - base.switches["period"] - k)
        late = turn + shifted.switches["phase"] - base.switches["phase"]
        assert np.abs(late).max() < 1e-11 + 20 * k * 2.0**-52


@pytest.mark.jit
def test_vanishing_disturbance_meets_none():
    undisturbed = vd.simulate(A=3.04, transient=0, periods=20)
    for eps in (1e-12, 1e-14, 1e-300):
        t = vd.simulate(A=3.04, eps=eps, transient=0, periods=20)
        assert np.array_equal(t.switches["after"], undisturbed.switches["after"])
        assert np.abs(t.switches["phase"] - undisturbed.switches["phase"]).max() < 1e4 * eps + 1e-12
