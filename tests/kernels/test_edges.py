"""Scenes in which event finders fail. The scenes provoke the following known errors of event finders:

grazing            no sign change is detected if an impact happens, or fails to happen, by a tiny margin (scipy issue
                   9228: one of three roots in a step is found; diffrax issue 507: none of two roots is found)
start on a zero    a model of friction and stops loses an event, or repeats it endlessly, if a state begins on a zero
                   of its own condition (SciML: DiffEqBase.jl issue 634, OrdinaryDiffEq.jl issue 3222)
sign after reset   the value at the event changes sign after the state is set (Hipparchus issue 184)
order of events    two conditions change sign in one step, and the one that is later in the list is chosen (diffrax
                   issue 639)
through the floor  a plastic ball falls through the floor (SciML: DifferentialEquations.jl issue 696)
NaN                a root finder never returns if a value is NaN (SUNDIALS issue 258)
same instant       an event occurs exactly at the beginning of its step (scipy issues 17066, 19418)

A motion is flagged if its status is TOO_CLOSE or BUDGET. A flagged motion may differ from the reference.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.agreement import (
    LADDER,
    ROUNDING,
    check_above_obstacle,
    check_decisions,
    check_order,
    flagged,
    follow,
    lowest,
)
from tests.exact.reference import ETA, IMPACT, Oscillator, Slide, mp, reference
from tests.support import naive
from vibrodrive import State, Status

pytestmark = pytest.mark.jit


def ulps(x: float) -> list[float]:
    """Return the double below x, x itself, and the double above x."""
    return [math.nextafter(x, -math.inf), x, math.nextafter(x, math.inf)]


def dips(f: Callable[[Any], Any], slope: Callable[[Any], Any], end: float) -> list[tuple[Any, Any]]:
    """Return (h, f(h)) for each local minimum of f on (0, end), computed to 50 digits."""
    h = np.linspace(0, end, 3000)
    v = [float(f(t)) for t in h]
    found = []
    for i in range(1, len(h) - 1):
        if v[i] < v[i - 1] and v[i] <= v[i + 1]:
            a, b = mp.mpf(h[i - 1]), mp.mpf(h[i + 1])
            for _ in range(180):
                m = (a + b) / 2
                a, b = (m, b) if slope(m) < 0 else (a, m)
            found.append((a, f(a)))
    return found


@pytest.mark.parametrize("sign", [1, -1], ids=["up", "down"])
def test_tangency_of_a_velocity(sign):
    """ξ' nearly touches 0 during a slide. The slide ends there or continues, as in the reference."""
    scene = {"A": 3.04, "B": 0.2, "eps": 3e-4, "tau0": 3.5 if sign > 0 else 0.3}
    mp.dps = 60
    model = Oscillator(scene["A"], scene["B"], scene["eps"], ETA)
    tau = mp.mpf(scene["tau0"])
    slide = Slide(mp.mpf(50), mp.zero, sign, model.B, model.waves(tau))
    found = dips(lambda h: sign * slide.at(h)[1], lambda h: sign * model.H(tau + h) - 1, 2.0)
    records = [v for i, (_, v) in enumerate(found) if v < 0 and all(v < w for _, w in found[:i])]
    assert len(records) > 1
    check_ladder(lambda d: {**scene, "xi0": 50.0, "dxi0": sign * float(d - records[1])}, scene["A"])


@pytest.mark.parametrize(
    "scene",
    [{"A": 1.9, "eps": 2e-4, "tau0": 5.0, "xi0": 0.0}, {"A": 1.0, "eps": 3e-5, "tau0": 0.3, "xi0": 5.0}],
    ids=["rest", "stick"],
)
def test_tangency_of_the_force(scene):
    """H nearly touches 1 in a wait. The wait ends there or continues, as in the reference."""
    mp.dps = 60
    model = Oscillator(scene["A"], 0.0, scene["eps"], ETA)
    tau = mp.mpf(scene["tau0"])
    turn = [(a * w, w) for a, w in model.terms]
    found = dips(lambda h: -model.H(tau + h), lambda h: -sum(a * mp.cos(w * (tau + h)) for a, w in turn), 3.0)
    records = [v for i, (_, v) in enumerate(found) if -v > 1 and all(v < w for _, w in found[:i])]
    assert len(records) > 1
    check_ladder(lambda d: {**scene, "B": float(-records[1] - 1 + d)}, 2 * scene["A"])


def check_ladder(scene: Callable[[float], dict[str, float]], terms: float) -> None:
    """Compare the states with the reference in scenes at a distance of ±1e-3 … ±1e-15 from a tangency.

    The states agree, or the motion is flagged. A motion is not flagged if this distance is much larger than the
    rounding error. The same is true for a sweep, which flags a motion by its margin only.
    """
    differ = set()
    for wanted in LADDER:
        found = follow(scene(wanted), most=6, periods=2)
        first = found.exact.switches[0]
        differ.add((first.before, first.after, round(float(first.tau), 2)))
        swept = vd.sweep(**scene(wanted), transient=0, periods=2)
        assert swept.margin == found.ours.margin
        for status in (found.ours.status, swept.status):
            assert found.agrees or status == Status.TOO_CLOSE
            assert status == Status.TOO_CLOSE or abs(wanted) > 1e-15
            assert status == Status.OK or abs(wanted) < 1e-12
        if abs(wanted) >= 1e-12:
            assert found.agrees
        if 1e-12 <= wanted <= 1e-4:
            assert found.ours.margin <= 2 * wanted
        if wanted == 0.0:
            assert found.ours.margin <= 64 * ROUNDING * terms
    assert len(differ) > 1, "the ladder crosses no decision"


TWO_ZEROS = {"A": 3.04, "B": 0.2, "eps": 3e-4, "tau0": 3.5, "xi0": 50.0}


def brief_reversal(depth: float) -> tuple[dict[str, float], float]:
    """Return (scene, h): a slide up whose ξ' would fall to -`depth` at the time h and then rise again."""
    mp.dps = 60
    model = Oscillator(TWO_ZEROS["A"], TWO_ZEROS["B"], TWO_ZEROS["eps"], ETA)
    tau = mp.mpf(TWO_ZEROS["tau0"])
    slide = Slide(mp.mpf(50), mp.zero, 1, model.B, model.waves(tau))
    found = dips(lambda h: slide.at(h)[1], lambda h: model.H(tau + h) - 1, 2.0)
    h, v = next((h, v) for i, (h, v) in enumerate(found) if i and v < 0 and all(v < w for _, w in found[:i]))
    return {**TWO_ZEROS, "dxi0": float(-v - depth)}, float(h)


@pytest.mark.parametrize("method", ["fixed", "muller"])
def test_two_zeros_in_one_step(method):
    """Both zeros are between two grid points. `fixed` and `muller` continue the slide. `certified` ends the slide."""
    scene, h = brief_reversal(1e-6)
    exact = reference(**scene, periods=1, max_switches=1).switches[0]
    assert float(exact.tau) - scene["tau0"] == pytest.approx(h, abs=1e-4)
    certified = vd.simulate(**scene, transient=0, periods=1)
    assert certified.switches[0]["phase"] == pytest.approx(float(exact.phase), abs=1e-12)
    dtau = h / 10.5  # the dip is in the middle of a step
    ours = vd.simulate(**scene, method=method, dtau=dtau, transient=0, periods=1)
    literal = getattr(naive, method)(**scene, dtau=dtau, periods=1).switches
    assert [(s.before, s.after) for s in literal] == [(r["before"], r["after"]) for r in ours.switches]
    assert ours.switches[0]["phase"] - float(exact.phase) > dtau / 4


def test_three_zeros_in_one_step():
    """One step contains three zeros of ξ', two of them in a brief reversal. `muller` finds one, but not the first."""
    scene, _ = brief_reversal(1e-3)
    first = reference(**scene, periods=1, max_switches=1).switches[0].tau - mp.mpf(scene["tau0"])
    dtau = 2.0
    literal = naive.muller(**scene, dtau=dtau, periods=1).switches[0]
    ours = vd.simulate(**scene, method="muller", dtau=dtau, transient=0, periods=1).switches[0]
    assert ours["phase"] == pytest.approx(literal.phase, abs=1e-6)
    certified = vd.simulate(**scene, transient=0, periods=1).switches[0]
    assert certified["phase"] - scene["tau0"] == pytest.approx(float(first), abs=1e-12)
    assert ours["phase"] > certified["phase"] + 0.01


@pytest.mark.parametrize("tau0", np.linspace(0, 6, 13))
def test_first_boundary_ends_a_stick(tau0):
    """H passes 1 and -1 within a hundredth of a period. The value that H reaches first ends the sticking."""
    scene = {"A": 1.4, "B": 0.05, "eps": 1.2e-3, "eta": 31.0, "xi0": 20.0, "tau0": float(tau0)}
    found = check_decisions(scene, most=30)
    assert found.agrees
    assert {int(s.after) for s in found.exact.switches} >= {State.UP, State.DOWN}


def test_both_conditions_of_a_slide_down():
    """ξ < 0 and ξ' > 0 at the same grid point are an impact. The order in which both are tested does not matter."""
    thrown = {"A": 3.04, "dxi0": -0.5, "tau0": 2.9}
    grazing = -lowest(thrown)
    both = 0
    for dtau in (0.31, 0.7, 1.3):
        for depth in np.linspace(1e-3, 0.3, 40):
            scene = {**thrown, "xi0": float(grazing - mp.mpf(depth))}
            literal = naive.fixed(**scene, dtau=dtau, periods=1).switches
            ours = vd.simulate(**scene, method="fixed", dtau=dtau, transient=0, periods=1).switches
            assert [(s.before, s.after) for s in literal] == [(r["before"], r["after"]) for r in ours]
            both += sum(1 for s in literal if s.after == IMPACT and s.dxi > 0)
    assert both, "no scene with both sign changes"


@pytest.mark.parametrize("A", [1.2, 3.04])
@pytest.mark.parametrize("B", [0.0, 0.1, 1.0])
def test_start_where_the_force_is_one(A, B):
    """The motion starts at the τ0 where H is 1 or -1, or one ulp earlier or later, at the obstacle or above it."""
    for level in (1 + B, B - 1):
        if abs(level) > A:
            continue
        rising = math.asin(level / A)
        for tau0 in [*ulps(rising), *ulps(math.pi - rising), *ulps(rising + 20 * math.pi)]:
            for xi0, eps in ((0.0, 0.0), (1.0, 0.0), (5e-324, 0.0), (0.0, 1e-7), (1.0, 1e-7)):
                check_decisions({"A": A, "B": B, "eps": eps, "xi0": xi0, "tau0": tau0}, most=6, periods=20)


@pytest.mark.parametrize("speed", [0.0, 5e-324, 1e-300, 1e-160, 1e-80, 1e-30, 1e-16])
def test_slide_with_tiny_speed(speed):
    """The slide ends almost immediately, so that its end is close to its start. The order of states is valid."""
    for xi0 in (0.0, 1e-300, 1e-24, 1.0):
        for sign in (1, -1):
            for tau0 in (0.0, 2.0, 4.7):
                t = vd.simulate(A=3.04, xi0=xi0, dxi0=sign * speed, tau0=tau0, transient=0, periods=5)
                check_order(t)
                check_above_obstacle(t)


@pytest.mark.filterwarnings("ignore:A = .*swapped")
@pytest.mark.parametrize("B", [0.0, 0.1, 0.5, 1.0, math.nextafter(1.0, 2.0), 1.3])
@pytest.mark.parametrize("eps", [0.0, 5e-4])
def test_amplitude_on_a_boundary(B, eps):
    """A is 1 + B, |1 - B|, B or 0, or one ulp from these. The motion starts in a rest, a stick or a slide."""
    for base in {1 + B, abs(1 - B), B, 0.0}:
        for A in ulps(base):
            if A < 0:
                continue
            for xi0, dxi0 in ((0.0, 0.0), (0.5, 0.0), (0.0, 1.0), (0.5, -1.0)):
                for tau0 in (0.0, math.pi / 2):
                    scene = {"A": A, "B": B, "eps": eps, "xi0": xi0, "dxi0": dxi0, "tau0": tau0}
                    try:
                        check_decisions(scene, most=8, periods=10)
                    except ArithmeticError:  # a zero of order three: even 50 digits cannot decide this case
                        assert flagged(vd.simulate(**scene, transient=0, periods=10))


def test_amplitude_just_above_the_onset():
    """With A = 1 + B + 1e-9 the mass slides for a time of 1e-4. With A = 1 + B - 1e-9 it never moves."""
    for B in (0.0, 0.1, 0.7):
        over = check_decisions({"A": 1 + B + 1e-9, "B": B}, most=12)
        assert over.agrees
        # if B = 0, the mass slides down exactly as far as it slid up, so the decision is within rounding error
        assert over.ours.status == (Status.OK if B else Status.TOO_CLOSE)
        under = vd.simulate(A=1 + B - 1e-9, B=B, transient=0, periods=5)
        assert under.status == Status.NEVER_LEAVES
        assert under.margin == pytest.approx(1e-9, rel=1e-5)
        assert not under.switches.size
        assert (under.section == 0).all()


@pytest.mark.filterwarnings("ignore:A = .*swapped")
@pytest.mark.parametrize("B", [1.0, 1.05, 1.7])
def test_incline_too_steep_to_stick(B):
    """For B >= 1 gravity moves the mass down. If H stays below 1, STICK can only end in DOWN."""
    for xi0, dxi0, tau0 in ((3.0, 0.0, 0.0), (0.5, 2.0, 4.0), (30.0, -1.0, 1.0), (0.0, 0.0, 0.0)):
        for A in (0.3, 1.7, 3.2):
            check_decisions({"A": A, "B": B, "xi0": xi0, "dxi0": dxi0, "tau0": tau0}, most=20, periods=40)


@pytest.mark.parametrize("k", [1, -7, 1000, 159_154_943])
def test_start_shifted_by_whole_periods(k):
    """A start at τ0 + 2πk gives the same motion k periods later. The test allows for the known rounding of 2πk."""
    scene = {"A": 3.04, "xi0": 0.3, "dxi0": 1.0}
    tau0 = 2 * math.pi * k
    mp.dps = 60
    off = float(abs(mp.mpf(tau0) - 2 * mp.pi * k))
    here = vd.simulate(**scene, transient=0, periods=100)
    there = vd.simulate(**scene, tau0=tau0, transient=0, periods=100)
    n = min(len(here.switches), len(there.switches))
    assert abs(len(here.switches) - len(there.switches)) <= 2
    a, b = here.switches[: n - 2], there.switches[: n - 2]
    assert (a["after"] == b["after"]).all()
    np.testing.assert_array_equal(a["period"], b["period"] - k)
    np.testing.assert_allclose(a["phase"], b["phase"], rtol=0, atol=100 * off + 1e-12)


@pytest.mark.parametrize(
    ("A", "B", "eps", "eta", "xi0", "dxi0", "tau0"),
    [
        (2.040764558489153, 0.44883473649350836, 3.366293690316993e-06, ETA, 17.6395125311242, -19.601373755697, 0.363),
        (7.357592150331901, 0.0, 1.2781472930094486e-07, 432.0, 11.712425578139808, -32.3159260573542, -2.76944123124),
        (4.590344587110132, 0.7929144428758783, 3.0194586548802e-07, 432.0, 3.370389151409819, -2.16779556217773, 0.0),
    ],
)
def test_tiny_disturbance_with_large_high_derivatives(A, B, eps, eta, xi0, dxi0, tau0):
    """The fifth and higher derivatives are large, so a series up to the fourth derivative would miss the only zero."""
    check_decisions({"A": A, "B": B, "eps": eps, "eta": eta, "xi0": xi0, "dxi0": dxi0, "tau0": tau0}, most=8, periods=4)


def test_zero_where_a_long_slide_is_continued():
    """A slide of more than 4π is divided into segments. The slide ends within rounding of an instant of division."""
    incline = {"A": 1.3810559874528507, "B": 0.22576944812017585, "eps": 0.00012271886836946676, "eta": 100.995}
    speed = float.fromhex("0x1.ece8f9bcde60bp+3")
    t = vd.simulate(**incline, xi0=1.0, dxi0=speed, transient=0, periods=8, budget=500)
    assert t.status == Status.OK
    assert t.evaluations < 5000


@pytest.mark.parametrize("A", [1.5, 2.2])
def test_vanishing_disturbance(A):
    """For ε → 0 the results tend linearly to the results of ε = 0, and agree in the last bits even if ε underflows."""
    undisturbed = vd.simulate(A=A, transient=20, periods=20)
    for eps in (1e-9, 1e-12, 1e-15, 1e-20, 1e-100, 1e-300, 5e-324):
        t = vd.simulate(A=A, eps=eps, transient=20, periods=20)
        assert (t.switches["after"] == undisturbed.switches["after"]).all()
        np.testing.assert_allclose(t.switches["phase"], undisturbed.switches["phase"], rtol=0, atol=3e4 * eps + 1e-13)
        np.testing.assert_allclose(t.switches["dxi"], undisturbed.switches["dxi"], rtol=0, atol=1e5 * eps + 1e-12)


@pytest.mark.parametrize("A", [0.4, 1.5, 3.04])
@pytest.mark.parametrize("speed", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("tau0", [0.0, 0.9, 2.0, 5.5])
def test_throw_is_reversible_in_time(A, speed, tau0):
    """The transformation τ → π - τ keeps sin τ. So a slide up at B, reversed in time, is a slide down at B + 2.

    The mass lands at the mirrored time of its start, with the speed of its start.
    """
    B = 0.25
    up = vd.simulate(A=A, B=B, dxi0=speed, tau0=tau0, transient=0, periods=8)
    top = up.switches[0]
    assert top["before"] == State.UP
    after = 2 * math.pi * int(top["period"]) + float(top["phase"])
    down = vd.simulate(A=A, B=B + 2, xi0=float(top["xi"]), tau0=math.pi - after, transient=0, periods=8)
    first, landed = down.switches[0], down.switches[down.switches["after"] == State.IMPACT][0]
    assert first["after"] == State.IMPACT, "the mass slides down immediately and lands before any other switch"
    back = 2 * math.pi * int(landed["period"]) + float(landed["phase"])
    assert back == pytest.approx(math.pi - tau0, abs=1e-13 / min(speed, 1.0))
    assert landed["dxi"] == pytest.approx(-speed, rel=1e-13)


EXTREMES: dict[str, dict[str, float]] = {
    "no excitation": {"A": 0.0, "xi0": 1.0, "dxi0": -1.0},
    "a million": {"A": 1e6},
    "a million, disturbed": {"A": 1e6, "eps": 1e-5, "eta": 1e4},
    "disturbance as large": {"A": 1.5, "eps": 1.0, "eta": 1e4},
    "slowest disturbance": {"A": 1e9, "B": 0.0, "eps": 1e-8, "eta": 1e-9, "xi0": 0.18, "dxi0": 3.6e-111},
    "from a great height": {"A": 3.0, "xi0": 1e12},
    "down from a great height": {"A": 3.0, "B": 1.4, "xi0": 1e12, "dxi0": -5.0},
    "hardly above the obstacle": {"A": 3.0, "xi0": 1e-300, "dxi0": -3.0, "tau0": 15.2},
    "tiny fall out of stick": {"A": 1.633625653761276, "B": 1.0, "xi0": 2.02e-155, "tau0": -4.693609887971659},
    "late": {"A": 3.04, "eps": 2e-4, "tau0": 1e9},
    "long before": {"A": 3.04, "eps": 2e-4, "tau0": -1e9},
    "everything": {"A": 1e6, "B": 2.0, "eps": 1.0, "eta": 1e4, "xi0": 1e12, "dxi0": 1e6, "tau0": 1e9},
    "a slide that does not brake": {"A": 5e-324, "B": 1.0, "xi0": 1e12, "dxi0": -1.0},
    "friction like a wall": {"A": 1.5, "B": 1e9, "xi0": 1e-9, "dxi0": 1.0},
}


@pytest.mark.parametrize("name", EXTREMES)
def test_extreme_scenes_end(name):
    """Each call ends quickly, because the budget limits every search."""
    t = vd.simulate(**EXTREMES[name], transient=0, periods=3, budget=2000)
    check_order(t)
    check_above_obstacle(t)
    assert t.status != Status.NOT_COMPUTED
    assert t.margin >= 0
    assert np.isfinite(t.section).all() or t.status == Status.BUDGET


@pytest.mark.parametrize("name", [n for n in EXTREMES if n not in ("a slide that does not brake", "everything")])
def test_extreme_scenes_agree_with_the_reference(name):
    scene = EXTREMES[name]
    fast = scene.get("eps", 0.0) * scene.get("eta", ETA) > 1e-2
    found = follow(scene, most=6, periods=1 if fast else 3)
    assert found.agrees or flagged(found.ours)


def test_record_ends_during_a_fall():
    """The record ends during a slide down, at ξ = 6.65. A longer record begins with the same switches."""
    scene = {"A": 4.722167765521558, "B": 1.0, "xi0": 3.7471638654197683, "tau0": 4.872575354352764}
    short = vd.simulate(**scene, transient=0, periods=6)
    long = vd.simulate(**scene, transient=0, periods=7)
    n = len(short.switches)
    np.testing.assert_array_equal(short.switches["phase"], long.switches["phase"][:n])
    np.testing.assert_array_equal(short.switches["after"], long.switches["after"][:n])


def test_slides_that_cancel():
    """For B = 0 slides up and down are equally long, and ξ returns to 0 exactly where ξ' = 0.

    The motion is flagged after either decision, and continues validly: impacts are at the obstacle, never with ξ' > 0.
    """
    for A in (1.012894992700601, 1.3845970985876055, 1.8540585017483262):
        t = vd.simulate(A=A, B=0.0, transient=0, periods=30)
        assert t.status == Status.TOO_CLOSE
        impacts = t.switches[t.switches["after"] == State.IMPACT]
        assert (impacts["dxi"] <= 1e-7).all()
        check_above_obstacle(t)
        check_order(t)
