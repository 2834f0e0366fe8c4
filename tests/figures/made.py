"""Invented results and motions for tests of figures."""

import math
from types import SimpleNamespace

import numpy as np

from tests.support.fake import UNITLESS
from vibrodrive.model.choices import Method, Status
from vibrodrive.model.plan import make_plan
from vibrodrive.model.results import Results
from vibrodrive.model.states import State

SWITCH = np.dtype([("period", "i8"), ("phase", "f8"), ("before", "i1"), ("after", "i1"), ("xi", "f8"), ("dxi", "f8")])


def results(axes, record=("section",), **arrays):
    """Return `Results` over these axes, with the given arrays. The status is OK, and A is 2 if it is no axis."""
    axes = axes if "A" in axes else {"A": 2.0} | axes
    plan = make_plan({"method": "fixed" if "dtau" in axes else "certified", "eta": 101.0} | axes | {"record": record})
    status, margin = np.zeros(plan.shape, np.int8), np.full(plan.shape, 0.5)
    return Results(plan, {"status": status, "margin": margin} | arrays)


def motion(periods, irregular=False, **arguments):
    """Return what figures need of a `Trajectory`: ξ = 2 + sin τ. If irregular, each period has another amplitude."""
    size = 1.0 + (np.arange(periods) * math.sqrt(2) % 1 if irregular else np.zeros(periods))
    switches = np.zeros(2 * periods, SWITCH)
    switches["period"] = np.repeat(np.arange(periods), 2)
    switches["phase"] = np.tile([0.5, 2.5], periods)
    switches["xi"] = 2 + np.repeat(size, 2)

    def sample(n):
        tau = np.arange(periods * n + 1) * (2 * math.pi / n)
        now = size[np.minimum(np.arange(periods * n + 1) // n, periods - 1)]
        return SimpleNamespace(tau=tau, xi=2 + now * np.sin(tau), dxi=now * np.cos(tau))

    section = np.stack([np.full(periods, 2.0), size], axis=1)
    known = {"A": 3.0, "B": 0.1, "eps": 0.0, "eta": 101.0, "dtau": None, "method": int(Method.CERTIFIED)}
    known |= {"transient": 1000, "periods": periods, "xi0": 0.0, "dxi0": 0.0, "tau0": 0.0} | arguments
    return SimpleNamespace(
        switches=switches, section=section, sample=sample, arguments=known, status=Status.OK, **UNITLESS
    )


def fall():
    """Return one period of a simple motion: ξ = 2 − τ until the impact at τ = 2, then a rest."""
    switches = np.array(
        [(0, 2.0, State.DOWN, State.IMPACT, 0.0, -1.0), (0, 2.0, State.IMPACT, State.REST, 0.0, 0.0)], SWITCH
    )

    def sample(n):
        tau = np.linspace(0, 2 * math.pi, n + 1)
        return SimpleNamespace(tau=tau, xi=np.maximum(2 - tau, 0), dxi=np.where(tau < 2, -1.0, 0.0))

    known = {"arguments": {"A": 1.0, "B": 0.1, "eps": 0.0}, "status": 0}
    return SimpleNamespace(switches=switches, section=np.zeros((1, 2)), sample=sample, **known, **UNITLESS)
