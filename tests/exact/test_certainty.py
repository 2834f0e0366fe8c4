"""Bounds of the errors of a motion (kernels/certainty.py), compared with motions computed with 50 digits.

The margin of a motion is the smallest distance of H or ξ from a value at
which another state would follow.
"""

import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.agreement import compare, hold
from tests.exact.reference import mp, reference

TOO_CLOSE = vd.Status.TOO_CLOSE

Scene = dict[str, Any]

DRAWN = int(os.environ.get("SCENES", "24"))  # number of random scenes; docs/certified.md has the result of 2040


def _thrown(draw: np.random.Generator) -> Scene:
    scene = {"tau0": draw.choice([-1.0, 1.0]) * 10.0 ** draw.uniform(-6.0, 1.0)} if draw.random() < 0.5 else {}
    scene |= {"xi0": draw.uniform(0.0, 5.0)} if draw.random() < 0.5 else {}
    return scene | ({"dxi0": 3.0 * draw.normal()} if draw.random() < 0.5 else {})


def _undisturbed(draw: np.random.Generator) -> Scene:
    scene = {"A": draw.uniform(1.05, 9.0), "B": draw.choice([0.0, 0.1, 0.5, draw.uniform(0.0, 1.5)]), "periods": 40}
    return scene | _thrown(draw)


def _onset(draw: np.random.Generator) -> Scene:
    b = draw.choice([0.0, 0.1, 0.6])
    return {"A": (1.0 + b) * (1.0 + 10.0 ** draw.uniform(-8.0, -1.0)), "B": b, "periods": 10}


def _any_disturbance(draw: np.random.Generator) -> Scene:
    eta = 10.0 ** draw.uniform(-0.5, 3.0)
    scene = {"A": draw.uniform(1.05, 9.0), "B": draw.choice([0.0, 0.1, 0.5, 1.3]), "eta": eta, "periods": 4}
    return scene | {"eps": 10.0 ** draw.uniform(-8.0, 0.5) / eta**2} | _thrown(draw)


def _slow(draw: np.random.Generator) -> Scene:
    scene = {"A": draw.uniform(1.05, 9.0), "eta": draw.uniform(0.05, 3.0), "eps": 10.0 ** draw.uniform(-6.0, 0.0)}
    return scene | {"periods": 30} | _thrown(draw)


def _ripple(draw: np.random.Generator) -> Scene:
    eta = 10.0 ** draw.uniform(2.0, 4.0)
    return {"A": draw.uniform(1.2, 6.0), "eta": eta, "eps": 10.0 ** draw.uniform(-1.0, 2.0) / eta**2, "periods": 1}


def _fast(draw: np.random.Generator) -> Scene:
    speed = 10.0 ** draw.uniform(1.0, 5.0)
    scene = {"A": draw.uniform(1.2, 6.0), "xi0": speed * draw.uniform(0.1, 12.0)}
    return scene | {"dxi0": -speed * draw.choice([1.0, 0.01]), "eps": draw.choice([0.0, 1e-4]), "periods": 8}


def _boundary(draw: np.random.Generator) -> Scene:
    a, b = draw.uniform(1.7, 9.0), draw.choice([0.0, 0.1, 0.6])
    off = draw.choice([0.0, 1e-12, -1e-10, 1e-6])
    scene = {"A": a, "B": b, "tau0": math.pi - math.asin((b + 1.0) / a) + off, "xi0": draw.choice([0.0, 1.0])}
    return scene | {"eps": draw.choice([0.0, 1e-9, 1e-6]), "periods": 5}


def _small_gap(draw: np.random.Generator) -> Scene:
    return {
        "A": draw.uniform(1.2, 9.0), "xi0": 10.0 ** draw.uniform(-60.0, 0.0), "tau0": draw.uniform(0.0, 7.0),
        "eta": 10.0 ** draw.uniform(0.0, 3.0), "eps": draw.choice([0.0, 1e-7]), "periods": 5,
    }  # fmt: skip


BANDS: dict[str, Callable[[np.random.Generator], Scene]] = {
    "start from rest, A up to 3.25": lambda draw: {"A": draw.uniform(1.12, 3.25), "periods": 60},
    "any start, ε = 0": _undisturbed,
    "long motion": lambda draw: {"A": draw.uniform(3.0, 9.0), "B": draw.choice([0.1, 0.6]), "periods": 120},
    "A up to 10⁶": lambda draw: {"A": 10.0 ** draw.uniform(1.0, 6.0), "B": draw.choice([0.0, 0.1, 0.6]), "periods": 10},
    "A close to the onset": _onset,
    "disturbed, η of the paper": lambda draw: {
        "A": draw.uniform(1.2, 9.0), "eps": 10.0 ** draw.uniform(-6.0, -2.5), "periods": 5,
    },
    "disturbed, any η": _any_disturbance,
    "slow disturbance": _slow,
    "fast disturbance, ε η² up to 100": _ripple,
    "fast impact": _fast,
    "start where H falls to 1": _boundary,
    "small gap": _small_gap,
}  # fmt: skip
"""Functions that draw a random scene, by the kind of scene."""


def draw(seed: int, number: int) -> list[tuple[str, Scene]]:
    """Return pairs (kind, arguments) of scenes with random section phases. All kinds occur in turn."""
    generator = np.random.default_rng(seed)
    bands = list(BANDS.items())
    scenes = []
    for k in range(number):
        name, drawn = bands[k % len(bands)]
        scene = {"B": 0.1, "eps": 0.0, "eta": vd.ETA} | drawn(generator)
        scene["section_phase"] = generator.choice([0.0, generator.uniform(0.0, 2.0 * math.pi)])
        scenes.append((name, {key: int(v) if key == "periods" else float(v) for key, v in scene.items()}))
    return scenes


@pytest.mark.exact
@pytest.mark.parametrize("band", BANDS)
def test_errors_are_within_bounds_in_scenes_of_all_kinds(band, finding):
    """No error is above its bound, and no state marked as certain is wrong. The bounds are not much too large."""
    held = [hold(arguments) for name, arguments in draw(17, DRAWN) if name == band]
    known = [h.looseness for h in held if not math.isnan(h.looseness)]
    wrong, about = sum(len(h.broken) > 0 or h.others > 0 for h in held), f"{len(held)} scenes, {band}"
    finding(f"{about}: with an error above its bound, or a wrong state marked as certain", wrong, 0)
    finding(f"{about}: median of largest bound / largest error", float(np.median(known)), 1000)


CHAOTIC = [({"A": 12.0}, 430), ({"A": 9.0, "xi0": 1.0}, 310), ({"A": 9.5}, 360)]


@pytest.mark.jit
@pytest.mark.parametrize(("arguments", "most"), CHAOTIC)
def test_certainty_ends_before_a_chaotic_motion_deviates(arguments, most):
    """After about 400 switches the computed states differ from the true states, although all margins exceed 0.01."""
    motion = vd.simulate(**arguments, transient=0, periods=250)
    certain = np.isfinite(motion.switch_errors["tau"])
    number = int(certain.sum())
    assert motion.status == TOO_CLOSE
    assert motion.margin > 0.01
    assert certain[:number].all()
    exact = reference(**arguments, periods=250, max_switches=most)
    words = [(s.before, s.after) for s in exact.switches], motion.switches[["before", "after"]][:most].tolist()
    departs = next(n for n, (true, ours) in enumerate(zip(*words, strict=True)) if true != ours)
    assert 0.7 * departs < number <= departs
    held = compare(motion, exact, most)
    assert not held.broken
    assert held.others == 0


def test_bounds_of_short_slides_include_the_rounding_of_each_phase():
    """In slides of 1e-7 to 1e-4 the closed form is accurate to 1e-20, so the last bit of each phase is the error.

    With a disturbance only the phases that are returned are rounded.
    """
    draw = np.random.default_rng(1)
    for n in range(120):
        height = 10.0 ** draw.uniform(-14.0, -8.0)
        scene = dict(A=draw.uniform(2.0, 6.0), B=draw.choice([0.1, 0.5]), tau0=draw.uniform(3.75, 5.68), periods=1)
        scene |= dict(xi0=height, dxi0=n % 2 * 3.0 * draw.random() * math.sqrt(height))
        scene |= dict(eps=1e-7 * draw.random(), eta=draw.uniform(3.0, 50.0)) if n % 3 == 0 else {}
        held = hold(scene, most=6)
        assert (held.motion.status, held.others, held.broken) == (vd.Status.OK, 0, []), scene
        assert held.motion.switch_errors["tau"][:2].max() < 2e-15


@pytest.mark.jit
def test_certainty_ends_in_a_long_run_of_impacts_without_a_rest():
    """The bound grows by a factor of up to 4.5 at each of 44 impacts in a row, although no margin is below 1e-7.

    The first switch whose states differ from the states of the exact motion is in row 1171.
    """
    scene = dict(A=1.2207337005962078, B=1.5638725555830817, eps=2.444604789503143e-4, eta=196.35606314394815)
    held = hold(scene | {"periods": 4}, most=600)
    assert not held.broken
    assert held.others == 0
    assert held.motion.status == TOO_CLOSE
    assert held.motion.certain_until == 1
    assert 500 < np.isfinite(held.motion.switch_errors["tau"]).sum() < 1171


@pytest.mark.jit
def test_certainty_does_not_return_after_its_loss():
    motion = vd.simulate(A=12.0, transient=0, periods=250)
    switches, until = motion.switches, motion.certain_until
    known = np.isfinite(motion.switch_errors["tau"])
    first = int(np.argmin(known))
    assert switches["period"][first - 1] <= until <= switches["period"][first]
    for name in ("tau", "xi", "dxi"):
        assert np.array_equal(np.isfinite(motion.switch_errors[name]), known)
    at = np.arange(1, 251)
    assert np.isfinite(motion.error[at < until]).all()
    assert np.isinf(motion.error[at > until + 1]).all()
    later = vd.simulate(A=12.0, transient=230, periods=20)
    assert later.certain_until == until
    assert np.isinf(later.error).all()
    assert np.isinf(later.switch_errors["tau"]).all()


STABLE = [1.5, 3.04, *np.linspace(1.12, 3.25, 40)]


@pytest.mark.jit
@pytest.mark.parametrize(
    ("transient", "disturbed"),
    [(3000, 300), pytest.param(99_900, 9_900, marks=pytest.mark.slow("20 s: 100 000 periods, one motion at a time"))],
)
def test_stable_motions_stay_certain(transient, disturbed):
    scenes = [dict(A=A, transient=transient) for A in STABLE] + [dict(A=3.04, eps=2e-4, transient=disturbed)]
    for arguments in scenes:
        motion = vd.simulate(**arguments, periods=100, section_phase=2.0)
        assert motion.status == vd.Status.OK, arguments
        assert math.isinf(motion.certain_until)
        assert motion.error.max() < 1e-10, arguments
        assert motion.switch_errors["tau"].max() < 1e-10, arguments


@pytest.mark.jit
@pytest.mark.parametrize("tol", [1e-4, 1e-9])
@pytest.mark.parametrize("eps", [0.0, 2e-4])
def test_error_bars_of_muller_reach_the_certified_motion(tol, eps):
    arguments = dict(A=3.04, eps=eps, transient=20, periods=20, section_phase=2.0)
    exact = vd.simulate(**arguments)
    found = vd.simulate(**arguments, method="muller", dtau=1e-3, tol=tol)
    assert math.isinf(found.certain_until)
    apart = np.abs(found.section - exact.section)
    assert (apart <= found.error + exact.error).all()
    assert apart.max() > 1e-15
    late = np.abs(found.switches["phase"] - exact.switches["phase"])
    assert (late <= found.switch_errors["tau"] + exact.switch_errors["tau"]).all()


@pytest.mark.jit
@pytest.mark.parametrize("eps", [0.0, 1e-9])
@pytest.mark.parametrize(("start", "side"), [({}, 1.0), ({"xi0": 1.0}, 1.0), ({"xi0": 1.0}, -1.0)])
def test_bounds_of_muller_include_the_force_where_a_wait_ends(start, side, eps):
    """H barely exceeds 1, or falls below -1. The slide begins where Muller's method ends, at another H."""
    for B in (0.0, 0.1, 0.6) if side > 0.0 else (0.05, 0.1, 0.6):
        for d in 10.0 ** np.arange(-8.0, -1.5, 0.5):
            scene = dict(A=float(abs(1.0 + side * B) * (1.0 + d)), B=B, eps=eps, eta=20.0, periods=3, **start)
            for tol in (1e-4, 1e-7, 1e-10):
                held = hold(scene, 12, method="muller", dtau=0.2 * math.sqrt(d), tol=tol)
                assert (held.others, held.broken) == (0, []), scene


@pytest.mark.jit
def test_tolerance_may_change_a_decision_near_H_minus_1():
    """H falls through -1 near the end of UP. If UP ends earlier, the mass sticks. If UP ends later, it slides down."""
    scene = dict(A=3.04, xi0=1.0, dxi0=0.59222, tau0=3.0, transient=0, periods=1, method="muller", dtau=0.1)
    fine, coarse = (vd.simulate(**scene, tol=tol) for tol in (1e-9, 1e-2))
    assert (fine.switches["after"][0], fine.status) == (vd.State.STICK, vd.Status.OK)
    assert (coarse.switches["after"][0], coarse.status) == (vd.State.DOWN, TOO_CLOSE)
    assert coarse.certain_until == 0


def test_certainty_ends_where_an_error_is_larger_than_the_gap():
    """After an inexact end of UP the slide down reverses just above the obstacle, or it lands."""
    scene = dict(A=3.04, dxi0=0.6, tau0=3.5, transient=0, periods=1)
    drop = 100.0 - float(vd.simulate(**scene, xi0=100.0).switches["xi"][1])
    far, near = (vd.simulate(**scene, xi0=drop + gap, method="muller", dtau=0.1, tol=1e-3) for gap in (1e-10, 1e-11))
    assert (far.status, near.status) == (vd.Status.OK, TOO_CLOSE)
    assert (far.certain_until, near.certain_until) == (math.inf, 0)


def test_fixed_grid_has_no_bounds():
    motion = vd.simulate(1.5, method="fixed", dtau=0.1, transient=0, periods=3)
    assert np.isnan(motion.error).all()
    assert np.isnan(motion.switch_errors["tau"]).all()
    assert math.isnan(motion.certain_until)


def test_certainty_ends_at_an_undecided_start():
    """H falls through 1 at the start τ0 = 4π + …, so rounding decides if the mass leaves the obstacle there."""
    start = 4 * math.pi + math.pi - math.asin(1.1 / 3.0)
    motion = vd.simulate(3.0, tau0=start, transient=0, periods=2)
    assert motion.status == TOO_CLOSE
    assert motion.certain_until == 2
    assert np.isinf(motion.error).all()


def test_record_may_end_with_a_rest():
    """The motion begins at the end of a rest. Its record ends at the end of another rest, where a slide begins."""
    start = math.asin(1.1 / 1.5)
    motion = vd.simulate(1.5, tau0=start, dxi0=1e-14, transient=0, periods=3, section_phase=start)
    assert motion.status == vd.Status.OK
    assert math.isinf(motion.certain_until)
    assert motion.error.max() < 1e-12


@mp.workdps(50)
def test_error_covers_a_possible_impact_at_the_end_of_the_record():
    """The mass lands within rounding of the end of the record. So ξ' at this end is the velocity of the fall, or 0."""
    A, B, end = 1.05, 0.1, 5.4
    begin = mp.pi + mp.asin((1 - mp.mpf(B)) / A)
    h = end - begin
    fall = A * (mp.cos(begin) * h - mp.sin(end) + mp.sin(begin)) + (1 - mp.mpf(B)) * h**2 / 2
    speed = A * (mp.cos(begin) - mp.cos(end)) + (1 - mp.mpf(B)) * h
    for off in range(-3, 4):
        scene = dict(A=A, B=B, xi0=float(-fall) + off * 2.0**-56, tau0=end, section_phase=end)
        motion = vd.simulate(**scene, transient=0, periods=1)
        assert motion.section[0, 1] in (0.0, pytest.approx(float(speed)))
        assert motion.error[0, 1] >= 0.99 * abs(speed)


@mp.workdps(50)
@pytest.mark.parametrize("B", [1e-6, 1.2345e-8, 1.2345e-10, 3.3e-12])
def test_end_of_a_wait_includes_the_rounding_of_1_minus_B(B):
    """H barely reaches -1 where a wait ends. An error in the last bit of 1 - B shifts this end by more than a bit."""
    for A in (1.0, 1.0 - 0.5 * B):
        motion = vd.simulate(A, B=B, xi0=1.0, transient=0, periods=1)
        late = mp.mpf(float(motion.switches["phase"][0])) - (mp.pi + mp.asin((1 - mp.mpf(B)) / mp.mpf(A)))
        assert 1e-14 < abs(late) <= motion.switch_errors["tau"][0] < 1.1 * abs(late)
        held = hold(dict(A=A, B=B, eps=0.0, eta=vd.ETA, xi0=1.0, periods=1, section_phase=5.8), most=10)
        assert not held.broken, "the slide after the wait is late, too"


def test_permanent_rest_has_zero_error():
    motion = vd.simulate(0.5, transient=0, periods=3)
    assert motion.status == vd.Status.NEVER_LEAVES
    assert math.isinf(motion.certain_until)
    assert not motion.error.any()


def test_bounds_end_with_the_budget():
    motion = vd.simulate(3.04, eps=2e-4, transient=0, periods=5, budget=5, section_phase=1.0)
    assert motion.status == vd.Status.BUDGET
    assert np.array_equal(np.isnan(motion.error), np.isnan(motion.section))


@pytest.mark.jit
@pytest.mark.parametrize("settings", [{}, dict(method="muller", dtau=1e-3), dict(method="fixed", dtau=1e-2)])
def test_sweep_records_the_largest_bounds_of_its_motions(settings):
    axes = dict(A=[0.5, 1.5, 2.9, 3.2, 12.0], eps=[0.0, 2e-4])
    run = dict(transient=20, periods=15, section_phase=2.0, **settings)
    others = ("section",) if settings else ("section", "summary")  # with a summary, each method needs one more kernel
    swept = vd.sweep(**axes, **run, record=(*others, "error"))
    plain = vd.sweep(**axes, **run, record=others)
    for name in ("section", "margin", "switches", *(() if settings else ("impact_speed_max", "period"))):
        assert np.array_equal(getattr(swept, name), getattr(plain, name), equal_nan=True), name
    for index in np.ndindex(swept.shape):
        point = {name: values[i] for (name, values), i in zip(axes.items(), index, strict=True)}
        alone = vd.simulate(**point, **run)
        assert np.array_equal(swept.error[index], alone.error.max(axis=0), equal_nan=True)
        assert np.array_equal(swept.certain_until[index], alone.certain_until, equal_nan=True)
        assert swept.status[index] == alone.status
    one = vd.sweep(**axes, **run, record="error", threads=1)
    assert np.array_equal(one.error, swept.error, equal_nan=True)
