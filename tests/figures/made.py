"""Invented results and motions for tests of figures."""

import math
from types import SimpleNamespace

import numpy as np

from tests.support.fake import UNITLESS
from vibrodrive.model.choices import Method, Status
from vibrodrive.model.names import Settings
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import check_record, quantities
from vibrodrive.model.states import State
from vibrodrive.model.variables import Variable, constants

SWITCH = np.dtype([("period", "i8"), ("phase", "f8"), ("before", "i1"), ("after", "i1"), ("xi", "f8"), ("dxi", "f8")])


def results(axes, record=("section",), **arrays):
    """Return what figures need of `Results` over these axes, with the given arrays."""
    axes = {name: np.asarray(values, float) for name, values in axes.items()}
    shape = tuple(map(len, axes.values()))
    known = {
        "status": np.zeros(shape, np.int8),
        "margin": np.full(shape, 0.5),
        "points": {},
        "title": "",
        "_damaged": (),
    } | arrays
    fixed = {"A": 2.0, "B": 0.1, "eps": 0.0, "eta": 101.0}
    scalars = {name: value for name, value in fixed.items() if name not in axes}
    record = check_record(record)
    recorded = {"record": record, "quantities": quantities(record)}
    return SimpleNamespace(
        plan=plan_of(axes, scalars),
        axes=axes,
        varied=axes,
        scalars=scalars,
        settings=Settings(),
        **recorded,
        **known,
        **UNITLESS,
    )


def plan_of(axes, scalars):
    """Return a plan with these axes, and parameters with one value."""
    along = {name: Variable(values, name) for name, values in axes.items()}
    return Plan(constants({"dtau": math.nan} | scalars) | along, Settings())


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
