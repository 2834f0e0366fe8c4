"""Tests of the solver `branch_prune`: its bounds hold, it finds pairs, and it refuses what rounding hides."""

import json
import math
import random
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from benchmarks import passes
from benchmarks.switches import level0, run, score
from benchmarks.switches.loop import event_loop
from benchmarks.switches.solvers import branch_prune
from benchmarks.switches.solvers.chebyshev_roots import values
from benchmarks.switches.sums import Sum

pytestmark = pytest.mark.integration  # Numba compiles the solver

CASES = {case["id"]: case for case in run.cases_of([0, 1, 2, 3])}


def drawn(draw, fastest):
    """Return the inputs of a random function with a ripple, with eta up to `fastest`."""
    eta = fastest ** draw.uniform(0.0, 1.0)
    names = ("c0", "c1", "c2", "a", "alpha", "b", "eta", "beta", "T")
    rates = [draw.uniform(-0.4, 0.4), draw.uniform(-0.02, 0.02), draw.uniform(0.3, 2.0), draw.uniform(-9.0, 9.0)]
    values = [draw.uniform(-1.5, 1.5), *rates, draw.uniform(0.1, 1.0) / eta, eta, draw.uniform(-9.0, 9.0)]
    return dict(zip(names, [*values, draw.uniform(1.0, 12.0)], strict=True))


def separate(x):
    """Return the function and the end of its search."""
    return Sum(**{name: value for name, value in x.items() if name != "T"}), x["T"]


def exact(x, t, n=0):
    """Return the n-th derivative of g at t with 60 digits."""
    with mpmath.workdps(60):
        c0, c1, c2, t = (mpmath.mpf(v) for v in (x["c0"], x["c1"], x["c2"], t))
        slow = ((c0 + (c1 + c2 * t) * t), c1 + 2 * c2 * t, 2 * c2)[n]
        waves = ((x["a"], 1, x["alpha"]), (x["b"], x["eta"], x["beta"]))
        turned = [a * mpmath.mpf(w) ** n * mpmath.sin(w * t + phase + n * mpmath.pi / 2) for a, w, phase in waves]
        return slow + sum(turned)


def test_sums_and_products_are_rounded_outwards():
    draw = random.Random(1)
    for _ in range(2000):
        a, b = (sorted(draw.uniform(-1.0, 1.0) * 10.0 ** draw.randint(-30, 5) for _ in "12") for _ in "12")
        for made, of in ((branch_prune.add, lambda x, y: x + y), (branch_prune.mul, lambda x, y: x * y)):
            ends = [of(Fraction(x), Fraction(y)) for x in a for y in b]
            low, high = made(tuple(a), tuple(b))
            assert low <= min(ends) <= max(ends) <= high
    assert branch_prune.add((0.1, 0.1), (-0.1, -0.1)) == (0.0, 0.0)


def test_sine_and_cosine_of_a_product_are_enclosed():
    draw = random.Random(2)
    for _ in range(500):
        w, x = 10.0 ** draw.uniform(0.0, 5.0), 10.0 ** draw.uniform(-12.0, 4.0)
        bounds = branch_prune.cos_sin(w, x)
        with mpmath.workdps(60):
            angle = mpmath.mpf(w) * mpmath.mpf(x)
            for (low, high), true in zip(bounds, (mpmath.cos(angle), mpmath.sin(angle)), strict=True):
                assert low <= true <= high
                assert high - low < 4e-15 * max(abs(true), 1e-3)


def test_bounds_of_a_box_hold_for_the_exact_function():
    draw = random.Random(3)
    for _ in range(60):
        x = drawn(draw, 1e4)
        form = branch_prune.form_of(separate(x)[0])
        m, rho = draw.uniform(0.0, x["T"]), 10.0 ** draw.uniform(-12.0, 0.5)
        g, *boxes = branch_prune.enclose(form, m, rho)
        assert g[0] <= exact(x, m) <= g[1]
        for k in range(-4, 5):
            for n, (low, high) in enumerate(boxes):
                assert low <= exact(x, mpmath.mpf(m) + mpmath.mpf(rho) * k / 4, n) <= high, (x, m, rho, k, n)


HALF = 2.0**-21

TANGENT = {
    "at a double": Sum(6.25, -5.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0),
    "at π/2": Sum(1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0),
    "1e-17 above": Sum(1.0, 0.0, 0.0, -1.0, 0.0, 1e-17, 1.0, 0.0),
}
BEFORE_A_TANGENCY = Sum(2.0, 0.0, 0.0, -3.0, 0.0, -1.0, 2.0, math.pi / 2)
"""2 − 3 sin t − cos 2t = (1 − sin t)(1 − 2 sin t), except for the rounding of π/2."""
AT_A_ZERO = Sum(-0.3 * math.sin(2.0), 1.0, 0.0, 0.3, 2.0, 0.0, 1.0, 0.0)


def parabola(middle, c0):
    """Return (t − m)² + c0, which is exact in doubles."""
    return Sum(middle**2 + c0, -2.0 * middle, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def sums():
    """Yield (function, end of the search, zeros, tolerance): pairs 2⁻²⁰ apart, and sums with a reference of 90 digits.

    The start does not count, be it a simple zero, a double zero or a positive value.
    """
    for middle in (0.5, 1.0, 7.25, 19.0):
        yield parabola(middle, -(HALF**2)), 20.0, [middle - HALF, middle + HALF], 1e-8
        yield parabola(middle, HALF**2), 20.0, [], 0.0
    yield BEFORE_A_TANGENCY, 3.0, [math.pi / 6], 1e-15
    draw = random.Random(4)
    starts = [
        level0.inputs(c1=-1.1, c2=-0.48, a=0.58, b=0.165, eta=3.27, T=5.9),
        level0.inputs(c1=0.75, c2=-0.000195, a=-0.75, T=5.8),
        level0.inputs(c0=1e-9, c1=-1.0, a=0.5, T=2.0),
    ]
    for x in (*starts, *(drawn(draw, 30.0) for _ in range(25))):
        yield *separate(x), [float(zero.at) for zero in level0.solve(x)], 1e-11


def test_zeros_are_those_of_the_reference():
    count = 0
    for function, end, zeros, off in sums():
        assert branch_prune.zeros(function, end) == pytest.approx(zeros, rel=0, abs=off), function
        count += len(zeros)
    assert count > 30


@pytest.mark.parametrize("function", [*TANGENT.values(), AT_A_ZERO], ids=[*TANGENT, "start within rounding of a zero"])
def test_zero_within_rounding_is_refused(function):
    with pytest.raises(ArithmeticError, match="rounding hides"):
        branch_prune.zeros(function, 10.0)


def test_pair_a_millionth_apart_in_a_ripple_is_found():
    draw, grid, found = random.Random(5), np.linspace(0.0, 3.0, 30_001), 0
    while found < 10:
        x = drawn(draw, 300.0) | {"T": 3.0}
        least = np.argmin(values(separate(x)[0], grid))
        if not 0 < least < len(grid) - 1:
            continue
        with mpmath.workdps(60):
            beside = grid[least - 1], grid[least + 1]
            bottom = mpmath.findroot(lambda t, x=x: exact(x, t, 1), beside, solver="illinois")
            x["c0"] -= float(exact(x, bottom) + exact(x, bottom, 2) * mpmath.mpf(1e-6) ** 2 / 8)
            halves = [(bottom, bottom + side * 1e-6) for side in (-1, 1)]
            pair = [float(mpmath.findroot(lambda t, x=x: exact(x, t), half, solver="illinois")) for half in halves]
        assert branch_prune.zeros(*separate(x)) == pytest.approx(pair, rel=0, abs=1e-8)
        found += 1


class Motions:
    """The solver without compiling its loop over events, which takes longer than these motions."""

    events = staticmethod(event_loop(branch_prune.locate.py_func, compiled=False))


def judged(name):
    """Return the verdict on the answer to a case, or the error."""
    case = CASES[name]
    try:
        return score.judge(case, run.answer(Motions, case["level"], run.inputs(case), {}))["verdict"]
    except ArithmeticError as error:
        return str(error)


@pytest.mark.parametrize(
    "name", ["L1-dip-11", "L1-short-slide-10", "L1-late-start-07", "L2-paper-07", "L3-hard-spot-01"]
)
def test_motion_is_right(name):
    assert judged(name) == "right"


def test_impact_or_reversal_within_rounding_is_refused():
    assert [judged(f"L1-grazing-{k}") for k in (28, 29, 30)] == ["right", *["rounding hides the first zero"] * 2]


def test_arb_decides_what_is_not_an_exact_double_zero():
    pytest.importorskip("flint")
    from benchmarks.switches.solvers import branch_prune_arb

    with pytest.raises(ArithmeticError, match="rounding hides"):
        branch_prune_arb.zeros(TANGENT["at a double"], 10.0)
    assert branch_prune_arb.zeros(TANGENT["1e-17 above"], 10.0) == []
    for name in ("L0-close-pair-13", "L0-near-miss-29", "L0-double-zero-02", "L0-double-zero-05"):
        case = CASES[name]
        found = branch_prune_arb.zeros(*separate(run.inputs(case)))
        assert found == pytest.approx([float(zero) for zero in case["zeros"]], rel=1e-14), name


def test_no_stored_answer_of_branch_and_prune_is_wrong():
    paths = sorted(passes.RESULTS.glob("level*/branch_prune*.json"))
    assert len(paths) == 5
    for path in paths:
        runs = json.loads(path.read_text(encoding="utf-8"))["runs"]
        assert {letter for one in runs for letter in one["verdicts"]} <= {"R", "r", "-"}, path
