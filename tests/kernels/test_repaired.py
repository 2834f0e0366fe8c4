"""Certified motions that were once wrong or never ended, and similar motions, compared with 50-digit closed forms."""

import math

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.agreement import compare, same
from tests.exact.reference import ETA, mp, reference, with_digits

pytestmark = pytest.mark.jit

UP, DOWN, STICK, REST, IMPACT = vd.State
ULP = 2.0**-52


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(50):
        yield


def slide(scene, tau, s=-1):
    """Return (ξ, ξ', H) at `tau` in a slide of direction s from the start of a scene, by eqs. (2), (4), (5), (9)."""
    a, b, eps, eta, x, v, start = (
        mp.mpf(scene.get(name, default))
        for name, default in (("A", 0), ("B", 0.1), ("eps", 0), ("eta", ETA), ("xi0", 0), ("dxi0", 0), ("tau0", 0))
    )
    h = tau - start
    slow, fast = (mp.sin(tau) - mp.sin(start)), (mp.sin(eta * tau) - mp.sin(eta * start))
    speed = v + a * mp.cos(start) + a * eps * eta * mp.cos(eta * start)
    xi = x + speed * h - (b + s) * h**2 / 2 - a * slow - a * eps * fast
    dxi = speed - (b + s) * h - a * mp.cos(tau) - a * eps * eta * mp.cos(eta * tau)
    return xi, dxi, a * (mp.sin(tau) + eps * eta**2 * mp.sin(eta * tau)) - b


def time_of(row):
    return 2 * mp.pi * int(row["period"]) + mp.mpf(float(row["phase"]))


def ulps(value, count):
    for _ in range(abs(count)):
        value = math.nextafter(value, math.copysign(math.inf, count))
    return value


FAST = [
    dict(A=1.5, xi0=50000.0, dxi0=-9000.0),
    dict(A=1.5, xi0=124000.0, dxi0=-10000.0),
    dict(A=3.0, xi0=2766158.393840665, dxi0=-1e6),
    dict(A=3.0, xi0=9049291.454858877, dxi0=-1e6),
]


def fast_impacts(count):
    """Yield scenes with an impact of speed 10² to 10⁸ in the first two periods."""
    draw = np.random.default_rng(14)
    for _ in range(count):
        speed = 10 ** draw.uniform(2, 8)
        yield dict(A=draw.uniform(1.2, 9), B=draw.uniform(0, 2), xi0=speed * draw.uniform(0.1, 12), dxi0=-speed)


@pytest.mark.parametrize("scene", [*FAST, *fast_impacts(60)])
def test_fast_impact(scene):
    motion = vd.simulate(**scene, transient=0, periods=3)
    impact, after = motion.switches[:2]
    assert (impact["before"], impact["after"]) == (DOWN, IMPACT)
    tau = time_of(impact)
    exact = mp.findroot(lambda t: slide(scene, t)[0], tau)
    assert abs(tau - exact) < 16 * ULP * (1 + exact)
    force = slide(scene, exact)[2]
    assert after["after"] == (UP if force > 1 else REST) or motion.status == vd.Status.TOO_CLOSE


@pytest.mark.parametrize(
    "scene",
    [
        dict(A=5.0, eps=0.002, eta=2000.0, xi0=2610.027186963511, dxi0=-55.00000000000001, tau0=2.0),
        dict(A=5.0, eps=0.001, eta=20000.0, xi0=16373.354673167863, dxi0=-231.00000000000003, tau0=2.0),
    ],
)
def test_strong_ripple_over_a_long_slide(scene):
    """ξ is -1e-10 at the zero of ξ', so an impact precedes this zero. η times the duration is of order 10⁶."""
    motion = vd.simulate(**scene, transient=0, periods=86)
    impact = motion.switches[0]
    assert (impact["before"], impact["after"]) == (DOWN, IMPACT)
    tau = time_of(impact)
    xi, dxi, _ = slide(scene, tau)
    assert abs(xi) < 2e-11  # rounding of ξ₀ (2e-12), and of the start of the last segment
    assert dxi < 0


def test_slide_from_rest_under_strong_ripple():
    """ξ is right at the end of the slide, because the rounding of A ε η² = 36 000 does not accumulate."""
    scene = dict(A=4.346792718684417, eps=0.005409430943170665, eta=1238.6871187775064, tau0=1.245016202052283)
    motion = vd.simulate(**scene, dxi0=1.2274500536187732e-18, transient=0, periods=1)
    begin, end = motion.switches[3:5]
    assert (begin["before"], begin["after"]) == (REST, UP)
    lift = mp.findroot(lambda t: slide(scene, t)[2] - 1, time_of(begin))
    xi, _, _ = slide(dict(scene, tau0=lift), time_of(end), s=1)
    assert abs(end["xi"] - xi) < 1e-13 * (1 + abs(xi))


def falling_zero(a, b, level=1):
    """Return the phase in (π/2, 3π/2) at which H falls through `level` at ε = 0."""
    return math.pi - math.asin((b + level) / a)


BOUNDARIES = [
    (3.31, 0.3, 2.737973501272656),
    (5.53, 0.3, 2.9042903658110744),
    (4.19, 0.1, 2.8759495867515765),
    *((a, b, falling_zero(a, b)) for a in np.linspace(1.5, 9, 12) for b in (0.0, 0.1, 0.3)),
]


@pytest.mark.parametrize("eps", [0.0, 1e-9])
@pytest.mark.parametrize("gap", [0.0, 1.0])
def test_start_where_the_force_falls_to_one(gap, eps):
    """H falls to 1 at the start, so rounding decides if a slide begins.

    Such a slide is negligibly short. The motion after it must be right.
    """
    for a, b, tau0 in BOUNDARIES:
        later = vd.simulate(A=a, B=b, xi0=gap, tau0=tau0 + 1e-8, transient=0, periods=2)
        for off in range(-3, 4):
            motion = vd.simulate(A=a, B=b, eps=eps, xi0=gap, tau0=ulps(tau0, off), transient=0, periods=2)
            assert motion.status in (vd.Status.OK, vd.Status.TOO_CLOSE)
            assert len(motion.switches) < (30 if eps == 0 else 90)
            assert np.allclose(motion.section, later.section, atol=1e-5)


def test_impact_where_the_force_falls_to_one():
    for a in np.linspace(2, 9, 15):
        scene = dict(A=float(a), dxi0=-40.0, tau0=1.0)
        end = falling_zero(a, 0.1)
        gap = float(-slide(scene, mp.mpf(end))[0])
        rest = vd.simulate(**scene, xi0=gap + 1e-8, transient=0, periods=2)
        for off in range(-4, 5):
            motion = vd.simulate(**scene, xi0=ulps(gap, off), transient=0, periods=2)
            assert motion.status in (vd.Status.OK, vd.Status.TOO_CLOSE)
            assert len(motion.switches) < 30
            assert np.allclose(motion.section, rest.section, atol=1e-5)


@pytest.mark.parametrize("speed", [1e-2, 1e-3, 1e-5])
def test_slow_impact_where_the_force_falls_to_one(speed):
    """H differs from 1 by more than the rounding error of H. But the rounding of ξ shifts this slow impact in time. The
    shift changes H by as much as the difference from 1.

    This sweep computes no bounds of errors, so its status can be TOO_CLOSE only because of the margin.
    """
    scene = dict(A=3.04, tau0=2.2)
    impact = mp.mpf(falling_zero(3.04, 0.1)) + mp.mpf(3e-15) / speed
    scene["dxi0"] = float(-speed - slide(scene, impact)[1])
    scene["xi0"] = float(-slide(scene, impact)[0])
    motion = vd.simulate(**scene, transient=0, periods=1)
    assert motion.switches["after"][:2].tolist() == [IMPACT, REST]
    assert motion.switches["dxi"][0] == pytest.approx(-speed, rel=1e-4)
    assert motion.status == vd.Status.TOO_CLOSE
    assert vd.sweep(**scene, transient=0, periods=1).status == vd.Status.TOO_CLOSE


def test_tiny_gaps_land_at_once():
    """A tiny gap ξ is lost in any sum. With a disturbance, the mass lands as soon as it begins to fall from this ξ."""
    scene = dict(A=6.640823138230711, B=2.0, eps=4.481376927180557e-06, eta=147.8154875011132, tau0=-78.81932951798649)
    seen = vd.simulate(**scene, xi0=1e-20, transient=0, periods=2)
    for gap in (1e-29, 1e-31, 1e-60, 1e-80, 1e-200, 5e-324):
        motion = vd.simulate(**scene, xi0=gap, transient=0, periods=2)
        # if the gap is tiny, the fall is shorter than the error of the time at which it begins
        assert motion.status == (vd.Status.OK if gap > 1e-50 else vd.Status.TOO_CLOSE)
        assert motion.evaluations < 2 * seen.evaluations + 200
        assert np.array_equal(motion.switches["after"], seen.switches["after"])
        assert np.allclose(motion.switches["phase"], seen.switches["phase"], atol=1e-6)
        together = vd.sweep(**scene, points={"xi0": [gap, gap]}, transient=0, periods=2)
        assert np.array_equal(together.section[0], motion.section)
        assert (together.status == vd.Status.OK).all()


@pytest.mark.parametrize(
    "scene",
    [
        dict(
            A=1.9743229809449232, B=0.7393951302691629, eps=1.0719987329958424e-10, eta=35679.434791572596,
            tau0=8.65311288577029, xi0=1.539647733532997e-15,
        ),
        dict(
            A=0.7577751116504161, B=0.493196678519624, eps=2.0094832500696334e-05, eta=224.36653361331864,
            tau0=2.2774491356643267, xi0=1.704184292509266e-10,
        ),
        dict(
            A=1.0585559730874063, B=0.4500714400946647, eps=1.4336375419089547e-06, eta=655.4970069069367,
            tau0=2.5364352515575055, xi0=1.1549349921983423e-11,
        ),
    ],
)  # fmt: skip
def test_grazing_after_a_stick_under_ripple(scene):
    """The mass falls and grazes the obstacle, at a relative distance of 1e-14.

    The effect of the rounding of the end of the stick is multiplied by η.
    """
    motion = vd.simulate(**scene, transient=0, periods=1)
    states = [(row["before"], row["after"]) for row in motion.switches[:2]]
    assert states == [(STICK, DOWN), (DOWN, IMPACT)] or motion.status == vd.Status.TOO_CLOSE
    assert motion.margin < 1e-20


SCANNED = [
    # the end of a wait is refined to `tol` only, so H differs from 1 there
    dict(A=2.124315791770267, B=0.0, eps=4.076095191217171e-4, eta=832.077790178324, tau0=-5.190723011087952,
         method="muller", dtau=2.0, tol=6.356022532440077e-4, periods=3),
    dict(A=1022.9295381042608, B=1.0, eps=2.7209023525564547e-11, eta=55000.097644342175, tau0=104.11063206873814,
         method="muller", dtau=0.0027761733736793017, tol=6.342018237727862e-05, periods=3),
    dict(A=20.4903024393604, eps=2.279753337772712e-09, eta=35146.453447660984, xi0=4.5448988983974114e-200,
         method="muller", dtau=0.08546414755107967, tol=0.00013800221549820703, periods=1),
    # ξ falls below 0 and rises again between two grid points; ξ' < 0 at both grid points
    dict(A=0.6963907173756203, B=0.01132728906346433, eps=0.00021921874625096044, eta=8352.996175319993,
         xi0=4.5414103517155956e-89, method="fixed", dtau=0.4077451002682671, periods=3),
    dict(A=9.165567220558879, B=0.7684219343644937, eps=0.011911967832519764, eta=100.99504938362077,
         tau0=-4.648915649965991, xi0=6.107424952833542e-44, method="muller", dtau=1.0, tol=8.732632141734592e-09,
         periods=1),
]  # fmt: skip


@pytest.mark.parametrize("scene", SCANNED)
def test_sweep_on_a_grid_equals_a_single_motion_under_strong_ripple(scene):
    scene = scene | dict(transient=0, budget=5000)
    alone, swept = vd.simulate(**scene), vd.sweep(**scene)
    assert same(swept, (), alone)
    assert (alone.section[:, 0] >= 0).all()


STARTS = [
    # -π < τ0 < 0, with more bits than a phase in [0, 2π) can have
    dict(A=3.0, eps=1e-5, eta=3000.0, xi0=0.5, dxi0=-0.3, tau0=-0.1921264721053357),
    dict(A=1.895957175637014, eps=3.373121021471122e-05, eta=1000.0, xi0=1.4463205615846848, dxi0=-0.5487352769550277,
         tau0=-1.362319856741268),
    *(dict(A=3.04, xi0=0.5, dxi0=-0.3, tau0=tau0) for tau0 in (-1e-300, -1e-20, -4.4e-16, -5e-16)),
    # H rounds to ±1 but differs from it
    dict(A=2.093, xi0=6.858203428851564e-10, dxi0=-1e-6, tau0=5.8386872381702055),
    dict(A=1.1000000075206713, xi0=1.9329026367943846e-11, dxi0=1e-17, tau0=1.5706793911393189),
    # the exact H is below 1, but the rounded H is above 1; the motion reverses immediately
    dict(A=1.825864922378041, dxi0=3.333302917989881e-43, tau0=0.6465724070261151),
    dict(A=3.7119619166298983, xi0=7.53164536378848e-17, dxi0=1.1134871069022562e-44, tau0=0.3008574458121069),
    # ξ after the first slide is below the smallest double
    dict(A=3.8053715145824043, B=0.6, eps=0.00010123287233329773, eta=26.00713995041946, tau0=0.010144705945132487,
         dxi0=7.037947552933589e-259),
]  # fmt: skip


def drawn_starts(count):
    """Yield random starts, half of them at any time, and half of them at a time at which H is ±1 to the last bit."""
    draw = np.random.default_rng(30)

    def size(least, most):
        return float(draw.choice([-1.0, 1.0]) * 10 ** draw.uniform(least, most))

    for k in range(count):
        a, b = draw.uniform(1.2, 9.0), float(draw.choice([0.0, 0.1, 0.6]))
        scene = dict(A=a, B=b, xi0=abs(size(-40, 0.5)), dxi0=float(draw.choice([0.0, size(-40, 0.5)])))
        if k % 2:
            start = math.asin((b + 1) / a) if k % 4 == 1 else math.asin((b - 1) / a)
            start = ulps(start if k % 8 < 4 else -math.pi - start, int(draw.integers(-2, 3)))
            yield scene | dict(tau0=start)
        else:
            eta = 10 ** draw.uniform(0, 3.5)
            yield scene | dict(tau0=size(-18, 0.6), eta=eta, eps=float(draw.choice([0.0, abs(size(-4, 0)) / eta**2])))


@pytest.mark.parametrize("scenes", [STARTS, list(drawn_starts(240))], ids=["named", "drawn"])
def test_errors_of_a_tiny_start_are_within_bounds(scenes):
    """No error exceeds its bound, and all states that the program calls certain are right."""
    certain = 0
    for scene in scenes:
        with with_digits(400 if abs(scene["dxi0"]) < 1e-60 else 50):
            exact = reference(**scene, periods=1, max_switches=8)
        motion = vd.simulate(**scene, transient=0, periods=1, budget=500)
        held = compare(motion, exact, most=8)
        assert not [p for p in held.pairs if not p.error <= p.bound + 1e-45], scene
        last = [s.tau for s in exact.switches[-1:]] + [time_of(row) for row in motion.switches[-1:]]
        undecided = any(abs(tau - scene["tau0"] - 2 * mp.pi) < 1e-14 for tau in last)  # at the end of the record
        assert not held.others or undecided, scene
        certain += math.isinf(motion.certain_until)
    assert certain > len(scenes) / 2
