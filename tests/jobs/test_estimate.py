"""The estimated time of a sweep is right for sweeps of known cost on a simulated clock."""

from importlib import import_module

import numpy as np
import pytest

from vibrodrive.jobs import estimate
from vibrodrive.model.parameters import COLUMNS
from vibrodrive.model.plan import make_plan

pytestmark = pytest.mark.jit
ROUNDING = 1e-6  # seconds that each call takes in addition to the costs of its points


@pytest.fixture
def clock(monkeypatch):
    """Return a function of the cost of points in seconds. Then a computation only advances a clock by this cost."""
    now = [0.0]

    def set_cost(cost, startup=ROUNDING):
        def compute(plan, start, stop, threads):
            periods = plan.settings.transient + plan.settings.periods
            columns = dict(zip(COLUMNS, plan.points(start, stop).T, strict=True))
            now[0] += startup + float(np.sum(np.broadcast_to(cost(columns, periods), stop - start)))

        monkeypatch.setattr(import_module("vibrodrive.batch.sweep"), "compute", compute)
        monkeypatch.setattr(estimate, "process_time", lambda: now[0])
        return now

    return set_cost


CASES = {
    "the expensive points are in one corner": (
        lambda p, n: 1e-7 * n * np.where(p["A"] < 1.6, 80.0, 4.0) * np.where(p["xi0"] > 0.8, 20.0, 1.0),
        {"A": np.linspace(1.2, 3.2, 1000), "eps": 5e-4, "xi0": np.linspace(0.0, 1.0, 1500)},
    ),
    "repeated cycles are copied": (
        lambda p, n: 1e-6 * np.minimum(n, 150.0) + 1e-9 * n + 0 * p["A"],
        {"A": np.linspace(3, 3.2, 3000), "transient": 20_000, "periods": 200},
    ),
    "a few long records": (
        lambda p, n: 1e-6 * n * p["A"],
        {"A": np.linspace(3, 30, 100), "transient": 1000, "periods": 100_000},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_estimate_contains_the_time(clock, case):
    cost, arguments = CASES[case]
    plan = make_plan({"A": 3.0, "transient": 500, "periods": 500, **arguments})
    spent = clock(cost)
    seconds, least, most = estimate._computing(plan, 2)
    every = dict(zip(COLUMNS, plan.points(0, plan.n_points).T, strict=True))
    true = np.sum(cost(every, plan.settings.transient + plan.settings.periods)) / 2
    assert least < true < most
    assert seconds == pytest.approx(true, rel=0.05)
    assert least < seconds < most < 5 * least
    assert spent[0] < 20, "the estimate must take a few seconds only"
