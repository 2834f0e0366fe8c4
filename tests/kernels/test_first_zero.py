"""Tests of the search for a first zero: its step for the steepest function that the bounds allow, and difficult roots.

Difficult roots are cases in which event finders fail: two very close roots, roots at the ends of the interval, double
and triple roots, a function that touches zero (Hipparchus' `CloseEventsTest`), three roots of a cubic in one step
(scipy issue 9228: scipy finds only one of them), and a simple root after a double root. ((t - 1)² - e)(1.2 - t) is the
simplest example of the last case.
"""

import itertools
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial

from vibrodrive.kernels.first_zero import LEAST_GAP, Taylor, advance, parabola, safe_step, zero_free_span

Function = Callable[[float], tuple[float, ...]]

STEPS = 4000


def search(function: Function, m3: float, limit: float, rate: float = 0.0) -> list[float]:
    """Return the cursors (times reached, one a step) of a search for the first zero of g, g(0) > 0, on [0, limit].

    `function` gives g and its first four derivatives. |g'''| <= m3, and the bound of each further derivative is `rate`
    times the bound before (4/limit times if `rate` is 0). The last cursor is the zero, `limit` or, near a zero of high
    order, the cursor after STEPS steps. This is the loop of `first_zero.search` for a general function.
    """
    cursors, span = [0.0], limit
    rate = rate or 4 / limit
    for _ in range(STEPS):
        t = cursors[-1]
        g, *derivatives = function(t)
        step, slope = safe_step(max(g, 0.0), *derivatives[:2], m3, span)
        ahead, zero = advance(t, Taylor(g, *derivatives), m3, 1 / rate, rate, step, limit)
        span = step if slope > 0 else 3 * span
        cursors.append(min(ahead, limit))
        if zero or ahead >= limit:
            return cursors
    return cursors


def product(roots: list[float], scale: float = 1.0) -> Polynomial:
    """Return the polynomial with these roots, times `scale`, that is positive at 0."""
    p = Polynomial.fromroots(roots) * scale
    return p if p(0.0) > 0 else -p


def prepare(p: Polynomial, limit: float) -> tuple[Function, float]:
    """Return (function, m3): g with four derivatives, and a bound of |g'''| on [0, limit] from the coefficients."""
    derivatives = [p, *(p.deriv(n) for n in (1, 2, 3, 4))]
    third = derivatives[3]
    bound = float(np.sum(np.abs(third.coef) * limit ** np.arange(len(third.coef)))) + 1e-300
    return lambda t: tuple(float(d(t)) for d in derivatives), bound


def rounding(p: Polynomial, t: float) -> float:
    """Return a bound of the error of p(t) evaluated in doubles."""
    return 16 * 2.0**-53 * float(np.sum(np.abs(p.coef) * t ** np.arange(len(p.coef))))


AWKWARD = {
    "two roots 1e-3 apart": ([0.9, 0.901], 2.0),
    "two roots 1e-6 apart": ([0.9, 0.900001], 2.0),
    "two roots 1e-7 apart": ([0.9, 0.9 + 1e-7], 2.0),
    "two pairs of close roots": ([0.3, 0.3001, 0.7, 0.7001], 1.0),
    "three roots of a cubic": ([2.0, 6.0, 10.0], 12.0),
    "three close roots": ([1.0, 1.001, 1.002], 2.0),
    "close to the beginning": ([1e-12, 1.0], 2.0),
    "at the limit": ([2.0], 2.0),
    "just before the limit": ([2.0 - 1e-12], 2.0),
    "just behind the limit": ([2.0 + 1e-12], 2.0),
    "long after the beginning": ([900.0, 900.5], 1000.0),
    "no root": ([-1.0, -2.0, 50.0], 10.0),
    "a short excursion below zero": ([15.0 - 1e-7, 15.0 + 1e-7, 40.0], 30.0),
    "an excursion that ends a step": ([4.9, 5.0, 30.0], 30.0),
}
for k, scale in itertools.product(range(1, 15), (1.0, 1e-9, 1e9)):  # a dip that is down to 2e-15 deep
    roots = [1 - 10 ** (-k / 2), 1 + 10 ** (-k / 2), 1.2]
    AWKWARD[f"a pair before a third root, 1e-{k}, times {scale:g}"] = roots, 1.5, scale


@pytest.mark.parametrize("name", AWKWARD)
def test_awkward_roots(name):
    roots, limit, *scale = AWKWARD[name]
    p = product(roots, *scale)
    function, bound = prepare(p, limit)
    first = min([t for t in roots if 0 < t <= limit], default=limit)
    found = search(function, bound, limit)
    off = rounding(p, first) / max(abs(float(p.deriv()(first))), 1e-300) + 1e-15 * first
    if first == limit:
        assert found[-1] == limit
    else:
        assert found[-1] == pytest.approx(first, rel=0, abs=off)
    assert all(t <= first + off for t in found), "a step went past the first zero"


@pytest.mark.parametrize("e", [10.0**-k for k in range(1, 14)])
def test_simple_root_after_a_positive_minimum(e):
    """For ((t - 1)² + e)(1.2 - t) the search passes the minimum at 1, which has no zero, and finds 1.2."""
    p = Polynomial([1 + e, -2, 1]) * Polynomial([1.2, -1])
    function, bound = prepare(p, 1.5)
    assert search(function, bound, 1.5)[-1] == pytest.approx(1.2, rel=0, abs=1e-13)


@pytest.mark.parametrize("order", [2, 3])
def test_multiple_root_is_found(order):
    """(1 - t)ⁿ(1.2 - t) touches zero at 1. The search ends at 1 or, by rounding, at 1.2, but not in between."""
    p = product([1.0] * order + [1.2])
    function, bound = prepare(p, 1.5)
    found = search(function, bound, 1.5)[-1]
    width = (rounding(p, 1.0) / abs(float(p.deriv(order)(1.0)))) ** (1 / order) * 2
    assert abs(found - 1.0) <= width or (order == 2 and found == pytest.approx(1.2, rel=0, abs=1e-13))


@pytest.mark.parametrize("frequency", [5.0, 37.0, 300.0])
def test_ripple_on_a_slope(frequency):
    """If aω > 1, a sin ωt + 1 - t falls below zero many times. The search finds the first zero."""
    a, limit = 3 / frequency, 2.0

    def function(t: float) -> tuple[float, ...]:
        s, c = math.sin(frequency * t), math.cos(frequency * t)
        rates = [a * frequency**n for n in range(5)]
        return rates[0] * s + 1 - t, rates[1] * c - 1, -rates[2] * s, -rates[3] * c, rates[4] * s

    t = np.linspace(0, limit, 2_000_001)
    first = int(np.argmax(a * np.sin(frequency * t) + 1 - t < 0))
    assert t[first - 1] <= search(function, a * frequency**3, limit, frequency)[-1] <= t[first]


@settings(max_examples=300, derandomize=True, deadline=None)
@given(
    g=st.floats(1e-12, 1e3),
    dg=st.floats(-1e3, 1e3),
    ddg=st.floats(-1e3, 1e3),
    m3=st.floats(1e-3, 1e4),
    span=st.floats(1e-9, 1e3),
)
def test_no_function_within_the_bound_has_a_zero_before_the_step(g, dg, ddg, m3, span):
    """The function that falls as steeply as m3 allows, with g''' = -m3 everywhere, is positive within the step."""
    step, _ = safe_step(g, dg, ddg, m3, span)
    assert 0 <= step <= span
    s = np.linspace(0, step, 400)
    worst = g + dg * s + ddg * s**2 / 2 - m3 * s**3 / 6
    terms = g + abs(dg) * s + abs(ddg) * s**2 / 2 + m3 * s**3 / 6
    assert (worst >= -1e-14 * terms).all()


@settings(max_examples=300, derandomize=True, deadline=None)
@given(
    rise=st.just(0.0) | st.floats(1e-100, 1e3),
    bend=st.floats(-1e3, -1e-100) | st.just(0.0) | st.floats(1e-100, 1e3),
    m3=st.floats(1e-3, 1e4),
)
def test_zero_free_span_contains_no_zero(rise, bend, m3):
    """For g(0) = 0 a search begins at the end of this span. If g falls as steeply as m3 allows, g is zero there."""
    free = zero_free_span(rise, bend, m3)
    s = np.linspace(0, free, 400)
    worst = rise * s + bend * s**2 / 2 - m3 * s**3 / 6
    terms = rise * s + abs(bend) * s**2 / 2 + m3 * s**3 / 6 + 1e-300
    assert (worst >= -1e-13 * terms).all()
    assert abs(worst[-1]) <= 1e-13 * terms[-1]


@settings(max_examples=500, derandomize=True, deadline=None)
@given(
    g=st.floats(-10, 1e3),
    dg=st.floats(-1e3, 1e3),
    ddg=st.floats(-1e3, 1e3),
    share=st.floats(-1, 1),
    m3=st.floats(1e-3, 1e4),
    rate=st.floats(1e-3, 1e3),
)
def test_series_is_used_only_if_the_zero_is_unique(g, dg, ddg, share, m3, rate):
    """The series may move the cursor beyond the safe step, or back if g < 0. Then g' changes by at most |g'|/3.

    So g has at most one zero on this way.
    """
    h = 5.0
    step, _ = safe_step(max(g, 0.0), dg, ddg, m3, 1 / rate)
    ahead, _ = advance(h, Taylor(g, dg, ddg, share * m3, -share * m3 * rate), m3, 1 / rate, rate, step, 1e9)
    if ahead in (h, h + step):
        return
    way = abs(ahead - h)
    assert 0 < ahead < 1e9
    assert abs(ddg) * way + m3 * way**2 / 2 <= abs(dg) / 3


@settings(max_examples=500, derandomize=True, deadline=None)
@given(
    speed=st.floats(0.1, 30),
    bend=st.floats(-3, 3),
    rate=st.floats(30, 3000),
    share=st.floats(-6, 1),
    phase=st.floats(0, 6.28),
)
def test_ripple_in_high_derivatives_only(speed, bend, rate, share, phase):
    """The search finds the first zero of 1 - Vt + bt²/2 + a sin(ωt + φ), whose higher derivatives are large."""
    a, b, limit = speed * rate**-2 * 10**share, bend * speed**2 / 4, 3 / speed

    def function(t: float) -> tuple[float, ...]:
        s, c = math.sin(rate * t + phase), math.cos(rate * t + phase)
        r = [a * rate**n for n in range(5)]
        return 1 - speed * t + b * t * t / 2 + r[0] * s, b * t - speed + r[1] * c, b - r[2] * s, -r[3] * c, r[4] * s

    found = search(function, a * rate**3, limit, rate)
    t = np.linspace(0, limit, 20001)
    values = 1 - speed * t + b * t * t / 2 + a * np.sin(rate * t + phase)
    assert (values[t < found[-1]] > -1e-9).all()
    if found[-1] < limit:
        assert abs(function(found[-1])[0]) <= 1e-14 * (2 + speed * limit)


@settings(max_examples=200, derandomize=True, deadline=None)
@given(
    g=st.one_of(st.just(0.0), st.floats(LEAST_GAP, 1e3)),  # for a smaller g the root would be up to 1e-23 too large
    dg=st.floats(-1e3, 1e3),
    m=st.floats(1e-3, 1e6),
)
def test_parabola_ends_at_its_first_root(g, dg, m):
    s, slope = parabola(g, dg, -m, np.inf)
    assert np.isfinite(s)
    assert s >= 0
    assert slope == pytest.approx(m * s - dg, rel=1e-6, abs=1e-3)
    terms = g + abs(dg) * s + m * s**2 / 2
    assert abs(g + dg * s - m * s**2 / 2) <= 1e-13 * terms + 1e-290
    if s > 0:
        inner = np.linspace(0, s, 100)[1:-1]
        assert (g + dg * inner - m * inner**2 / 2 >= -1e-13 * terms).all()


@settings(max_examples=200, derandomize=True, deadline=None)
@given(st.lists(st.floats(0.01, 10.0), min_size=1, max_size=4), st.floats(-6, 6))
def test_first_of_any_roots(roots, exponent):
    """The result exceeds the first root by at most rounding(g)/slope. At an earlier result g is 0 within rounding."""
    limit = 11.0
    p = product(roots, 10.0**exponent)
    function, bound = prepare(p, limit)
    first = min(roots)
    found = search(function, bound, limit)[-1]
    noise = rounding(p, max(first, found))
    if found < first:
        assert float(p(found)) <= noise + abs(float(p.deriv()(found))) * 1e-14 * found
    else:
        between = np.linspace(first, found, 50)
        assert (p(between) >= -2 * noise - np.abs(p.deriv()(between)) * 1e-14 * first).all()
