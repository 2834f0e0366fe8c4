"""In a sweep at ε = 0 repeated cycles of a motion are copied (recurrence.py). This needs no evaluations of switching
functions, and does not change any bit.

`simulate` always computes these cycles, because it records every switch.
"""

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.agreement import same
from vibrodrive.batch import sweep

pytestmark = pytest.mark.jit

RESTS, DRAWN_IN = 1.5, 3.0
"""Amplitude of a motion that rests in each period, and of a motion that never rests but converges to the last bit."""


def evaluations(**arguments) -> float:
    """Return the number of evaluations of switching functions in a sweep of these arguments."""
    calls, run = [], sweep.run
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep, "run", lambda given, *more, **options: calls.extend(given) or run(given, *more, **options))
        vd.sweep(**arguments, threads=1)
    return float(sum({id(one.work): one.work.sum() for _, given in calls for one in given}.values()))


def copied():
    """Yield scenes with motions that repeat."""
    for seed in range(4):  # records begin and end anywhere in a cycle, and sections and starts have any phase
        rng = np.random.default_rng(seed)
        A = np.array([RESTS, DRAWN_IN, 1.2, 2.55, 3.06, 3.1, 3.17, *rng.uniform(1.05, 3.3, 13)])
        window = dict(transient=int(rng.integers(0, 400)), periods=int(rng.integers(1, 300)))
        for name in ("tau0", "section_phase"):
            window[name] = float(rng.choice([0.0, rng.uniform(0, 6.28)]))
        yield dict(A=A, **window)
    for B in (0.0, 0.5, 0.985, 0.995, 1.2):
        yield dict(A=np.linspace(1.1, 5.0, 12), B=B, xi0=2.0, transient=37, periods=90)
    # equal phases with other guesses are no return: the last bits of the section differ from those of a copy
    for A, B in ((2.5231841061368714, 0.1), (4.043804793493116, 0.5), (5.425560852028401, 0.9)):
        yield dict(A=[A], B=B, transient=150, periods=120)
    # a motion ends in a later period that needs more than the budget, although the first period needs less
    for budget in (1, 2, 3, 4, 5, 6, 12):
        yield dict(A=[RESTS, DRAWN_IN, 3.17], transient=3, periods=30, budget=budget)


@pytest.mark.parametrize("scene", [*copied()])
def test_copied_equals_computed(scene):
    swept = vd.sweep(**scene)
    for k, a in enumerate(scene["A"]):
        assert same(swept, k, vd.simulate(**scene | {"A": a})), a


def test_refined_path_repeats():
    A = np.linspace(1.1, 3.25, 12)
    setting = dict(method="muller", dtau=1e-3, tol=1e-9, transient=20, periods=60)
    swept = vd.sweep(A=A, **setting)
    for k, a in enumerate(A):
        assert same(swept, k, vd.simulate(A=a, **setting)), a
    assert evaluations(A=[RESTS], **setting) < 0.3 * vd.simulate(A=RESTS, **setting).evaluations


@pytest.mark.parametrize("A", [RESTS, DRAWN_IN])
def test_repetition_needs_no_evaluations(A):
    few, many = (evaluations(A=[A], transient=400, periods=n) for n in (400, 100_000))
    assert many <= few + 20
    assert few < 0.5 * vd.simulate(A=A, transient=400, periods=400).evaluations


@pytest.mark.parametrize("A", [RESTS, DRAWN_IN])
def test_transient_of_a_billion_periods(A):
    """Cycles are skipped in the transient, too. So the result depends on the transient only modulo a cycle."""
    late, early = (vd.sweep(A=[A], transient=n, periods=24) for n in (10**9, 10**9 % 2520 + 2520))
    assert np.array_equal(late.section, early.section)
    assert np.array_equal(late.switches, early.switches)


def test_no_repetition_with_a_disturbance_or_on_a_fixed_grid():
    swept = evaluations(A=[RESTS], eps=2e-4, transient=20, periods=20)
    assert swept == vd.simulate(A=RESTS, eps=2e-4, transient=20, periods=20).evaluations
    few, many = (evaluations(A=[RESTS], method="fixed", dtau=0.01, transient=0, periods=n) for n in (100, 400))
    assert 3.9 * few < many < 4.1 * few
