"""The motion of a view: its curve, its states, its description and its limits k₂."""

import math
import threading

import numpy as np
import pytest

import vibrodrive as vd

pytest.importorskip("tornado")

from vibrodrive.explorer.motion import curve_of, limit_at, limit_plans, motion_at, words
from vibrodrive.explorer.view import View
from vibrodrive.jit.slices import Halt, Halted
from vibrodrive.model.states import LASTING

pytestmark = pytest.mark.jit


@pytest.mark.parametrize("eps", [0.0, 2e-4])
def test_curve_is_the_motion_with_its_states(eps):
    motion = vd.simulate(3.04, eps=eps, tau0=0.3, transient=50, periods=6)
    found, sample = curve_of(motion), motion.sample(4001)
    time = (sample.tau - sample.tau[0]) / (2.0 * math.pi)
    there = np.isfinite(found["dxi"])
    wrong = np.abs(np.interp(time, found["time"][there], found["dxi"][there]) - sample.dxi)
    assert np.quantile(wrong, 0.99) < 0.002 + 0.1 * 3.04 * eps * motion.arguments["eta"]
    middles = 0.5 * (found["time"][1:] + found["time"][:-1])
    states = sample.state[np.searchsorted(time, middles)]
    wide = np.diff(found["time"]) > 1e-3
    assert np.mean(found["state"][:-1][wide] == states[wide]) > 0.98
    assert {*np.unique(found["state"])} <= {int(state) for state in (*LASTING, vd.State.IMPACT)}


def test_description_is_that_of_the_motion_and_names_no_hash():
    view = View.read({"at": 3.1842, "low": 3.18, "high": 3.19, "transient": 2000, "periods": 250})
    plan = view.motion_plan()
    motion = motion_at(plan, Halt())
    told = words(motion, plan, view, Halt())
    lines = vd.simulate(3.1842, section_phase=view.section_phase, transient=2000).describe().splitlines()[1:]
    assert told["details"] == lines
    assert told["period"] == 8
    assert "states: a cycle of more than 12" in lines


def test_limits_are_those_of_limit_and_end_when_they_are_halted():
    view = View.read({"method": "fixed", "dtau": 0.05, "at": 3.04})
    plans = limit_plans(view.motion_plan())
    for name, method in (("eps", "certified"), ("dtau", "fixed")):
        wanted = vd.limit(3.04, name, method)
        found = limit_at(plans[name], Halt())
        assert (float(found["k2"]), float(found["last_kept"])) == (wanted.k2, wanted.last_kept)
    never = View.read({"method": "muller", "dtau": 0.3, "at": 3.04})
    assert limit_at(limit_plans(never.motion_plan())["dtau"], Halt())["k2"] == "Infinity"
    halt = Halt()
    threading.Timer(0.2, halt.call).start()
    with pytest.raises(Halted):
        limit_at(limit_plans(View.read({"at": 2.2}).motion_plan())["eps"], halt)
