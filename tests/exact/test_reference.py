"""Tests of the 50-digit reference and the loops of naive.py: known numbers, exact cases, agreement with each other."""

import ast
import math
import random
from itertools import pairwise
from pathlib import Path

import pytest

from tests.exact import reference as digits50
from tests.exact.agreement import LONG, scene
from tests.exact.reference import DOWN, IMPACT, REST, STICK, UP, Reference, Switching, mp, reference
from tests.support import naive

ONE_PERIOD = [(REST, UP), (UP, STICK), (STICK, DOWN), (DOWN, IMPACT), (IMPACT, REST)]


def words(switches: list) -> dict[int, list[tuple[int, int]]]:
    """Return the switches (before, after) by excitation period."""
    by_period: dict[int, list[tuple[int, int]]] = {}
    for s in switches:
        by_period.setdefault(s.period, []).append((s.before, s.after))
    return by_period


def test_reference_shares_nothing_with_what_it_judges():
    nodes = list(ast.walk(ast.parse(Path(digits50.__file__).read_text())))
    imported = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
    assert imported == {"collections.abc", "contextlib", "math", "mpmath", "typing"}


# ---- known numbers


@LONG
def test_two_periodic_motion_has_the_known_section_points():
    last = scene("two-periodic").section[-2:]
    expected = [(2.7733816327, -2.6101762195), (1.2155473776, -2.8904206661)]
    for found, known in zip(last, expected, strict=True):
        assert [float(x) for x in found] == pytest.approx(known, abs=5e-11)


@LONG
def test_one_periodic_motion_has_four_waits_and_slides_and_one_impact_a_period():
    for period, word in words(scene("one-periodic").switches).items():
        assert word == ONE_PERIOD, period


# ---- the first zero in known cases


def cosine_above(level: str) -> Switching:
    """Return g(h) = (1 + level) + sin h, with a minimum of height `level` at 3π/2."""
    mp.dps = 70
    return Switching(1 + mp.mpf(level), mp.zero, 1, 0, [(mp.one, mp.one, mp.zero)])


@pytest.mark.parametrize("depth", ["1e-3", "1e-8", "1e-16", "1e-30", "1e-45"])
def test_close_zeros_are_found_if_they_exist(depth):
    g = cosine_above("-" + depth)
    exact = 2 * mp.pi - mp.asin(1 - mp.mpf(depth))
    first = min(exact, 3 * mp.pi - exact)
    assert abs(g.first_zero(100, may_touch=False) - first) < mp.mpf("1e-35")
    assert cosine_above(depth).first_zero(100, may_touch=False) is None


def test_double_zero_ends_a_slide_but_not_a_wait():
    g = cosine_above("0")
    assert abs(g.first_zero(100, may_touch=False) - 3 * mp.pi / 2) < mp.mpf("1e-30")
    assert g.first_zero(100, may_touch=True) is None


def test_double_zero_at_the_start_is_skipped():
    mp.dps = 70
    g = Switching(mp.one, mp.zero, -1, 1, [(mp.one, mp.one, mp.zero)])  # 1 - cos h
    assert abs(g.first_zero(100, may_touch=False) - 2 * mp.pi) < mp.mpf("1e-30")


def test_distant_zero_is_found():
    mp.dps = 70
    g = Switching(mp.mpf("1e9"), mp.mpf(-1), 1, 0, [(mp.one, mp.one, mp.zero)])  # 1e9 - h + sin h
    zero = g.first_zero(mp.inf, may_touch=False)
    assert abs(zero - mp.mpf("1e9") - mp.sin(zero)) < mp.mpf("1e-40")


# ---- exact cases of the motion


def test_wait_continues_where_the_force_touches_its_limit():
    above = math.nextafter(1.5, 2)
    assert reference(1.5, B=0.5, periods=20).switches == []
    assert reference(above, B=0.5, periods=1).switches[0].before == REST
    assert reference(0.5, B=0.5, xi0=1.0, periods=20).switches == []
    first = reference(math.nextafter(0.5, 1), B=0.5, xi0=1.0, periods=2).switches[0]
    assert (first.before, first.after) == (STICK, DOWN)
    assert float(first.phase) == pytest.approx(1.5 * math.pi, abs=1e-7)


def test_free_fall_without_excitation():
    r = reference(0.0, B=3.0, xi0=4.0, periods=2)  # ξ'' = -2 from rest: impact at τ = 2 with ξ' = -4
    fall, end = r.switches
    assert (fall.tau, fall.dxi, fall.after, end.after) == (2, -4, IMPACT, REST)
    assert fall.margin == mp.inf


def test_push_without_excitation_ends_in_sticking():
    (stop,) = reference(0.0, B=0.5, xi0=1.0, dxi0=3.0, periods=2).switches  # ξ'' = -3/2
    assert (stop.tau, stop.xi, stop.after, stop.margin) == (2, 4, STICK, mp.mpf("0.5"))


def test_slide_touches_rest_and_continues_for_B_1():
    r = reference(3.0, B=1.0, xi0=50.0, periods=4)
    touch = [s for s in r.switches if abs(s.tau - 5 * mp.pi) < mp.mpf("1e-40")]
    assert [(s.before, s.after) for s in touch] == [(DOWN, STICK), (STICK, DOWN)]
    assert touch[0].margin == 0


def test_start_on_the_obstacle_moving_into_it():
    first, second = reference(1.5, dxi0=-2.0, periods=1).switches[:2]
    assert (first.tau, first.after, first.dxi) == (0, IMPACT, -2)
    assert (second.tau, second.after) == (0, REST)


def test_more_digits_give_the_same_switches():
    arguments = {"A": 3.04, "eps": 2e-4, "periods": 10}
    short = reference(**arguments)
    with digits50.with_digits(80):
        long = reference(**arguments)
    assert len(short.switches) == len(long.switches)
    for a, b in zip(short.switches, long.switches, strict=True):
        assert abs(a.tau - b.tau) < mp.mpf("1e-45")
        assert (a.before, a.after) == (b.before, b.after)


# ---- any scene


def random_arguments(seed: int) -> dict[str, float]:
    rng = random.Random(seed)
    return {
        "A": rng.choice([rng.uniform(0.5, 4), 10 ** rng.uniform(-0.5, 1.5)]),
        "B": rng.choice([0.0, 0.1, rng.random(), 1 + rng.random()]),
        "eps": rng.choice([0.0, 10 ** rng.uniform(-5, -2)]),
        "eta": rng.choice([naive.ETA, 10 ** rng.uniform(-0.5, 2)]),
        "xi0": rng.choice([0.0, 10 ** rng.uniform(-3, 1)]),
        "dxi0": rng.choice([0.0, rng.gauss(0, 2)]),
        "tau0": rng.choice([0.0, rng.choice([-1.0, 1.0]) * 10 ** rng.uniform(-6, 1)]),
    }


@pytest.mark.parametrize("seed", range(30))
def test_no_switching_function_changes_sign_within_a_state(seed):
    arguments = random_arguments(seed)
    r = reference(**arguments, periods=3, max_switches=60)
    model = naive.Model(*(arguments[key] for key in ("A", "B", "eps", "eta")))
    size = 1 + model.A * (1 + model.eps * model.eta**2)
    for a, b in pairwise(r.switches):
        if a.after == IMPACT:
            continue
        tau_a, tau_b, xi_a = float(a.tau), float(b.tau), float(a.xi)
        since = (a.after, tau_a, xi_a, 0.0)
        slack = 1e-11 * size * (1 + tau_b - tau_a) ** 2  # rounding of τ, ητ and of the closed form in double
        inner = [tau_a + (tau_b - tau_a) * i / 400 for i in range(401)]
        if a.after == UP:
            assert min(model.dxi(t, *since) for t in inner) > -slack
        elif a.after == DOWN:
            assert max(model.dxi(t, *since) for t in inner) < slack
            assert min(model.xi(t, *since) for t in inner) > -slack
        elif a.after == STICK:
            assert max(abs(model.H(t)) for t in inner) < 1 + slack
        else:
            assert max(model.H(t) for t in inner) < 1 + slack
        if a.after in (STICK, REST):
            assert abs(model.H(tau_b)) == pytest.approx(1, abs=slack)
        elif b.after == IMPACT:
            assert model.xi(tau_b, *since) == pytest.approx(0, abs=slack)
            assert model.dxi(tau_b, *since) == pytest.approx(float(b.dxi), abs=slack)
        else:
            assert model.dxi(tau_b, *since) == pytest.approx(0, abs=slack)
            assert model.xi(tau_b, *since) == pytest.approx(float(b.xi), abs=slack)


# ---- the two loops


def agree(loop: naive.Naive, exact: Reference, tolerance: float) -> None:
    assert [s[3:5] for s in loop.switches] == [(s.before, s.after) for s in exact.switches]
    for a, b in zip(loop.switches, exact.switches, strict=True):
        assert abs(float(b.tau - a.tau)) < tolerance
    for p, q in zip(loop.section, exact.section, strict=True):
        assert [float(x) for x in q] == pytest.approx(p, abs=10 * tolerance)


@pytest.mark.parametrize(
    ("arguments", "dtau"),
    [
        ({"A": 1.5}, 0.01),
        ({"A": 3.04, "section_phase": 1.0}, 0.01),
        ({"A": 3.04, "eps": 2e-4}, 1e-3),
        ({"A": 3.0, "B": 1.3, "xi0": 4.0, "tau0": 1.0}, 0.01),
        ({"A": 2.7, "xi0": 3.0, "dxi0": -1.5, "tau0": 2.2}, 0.01),
    ],
)
def test_mullers_loop_equals_the_reference_on_a_fine_grid(arguments, dtau):
    agree(naive.muller(**arguments, dtau=dtau, tol=1e-11, periods=8), reference(**arguments, periods=8), 1e-9)


def test_fixed_loop_is_late_by_less_than_a_step_at_first_and_never_early():
    exact = reference(1.5, periods=1).switches
    loop = naive.fixed(1.5, dtau=1e-4, periods=1).switches
    assert [s[3:5] for s in loop] == [(s.before, s.after) for s in exact]
    assert 0 <= loop[0].tau - exact[0].tau < 1e-4
    assert max(abs(float(a.tau - b.tau)) for a, b in zip(loop, exact, strict=True)) < 1e-3
