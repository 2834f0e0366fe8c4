"""Comparison of summaries with sums over the switches, with quadrature, and with orbits found in another way."""

import math
from itertools import pairwise

import numba
import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.batch.records import Arrays
from vibrodrive.kernels import summary
from vibrodrive.kernels.history import ROWS
from vibrodrive.kernels.summary import AFTER, DXI, OUT, PERIOD, TOTALS, Drive, gap_cycle_of_period, summarise
from vibrodrive.model.choices import LONGEST, UNSEEN
from vibrodrive.model.quantities import SUMMARIES

NAMES = [q.name for q in SUMMARIES]
TURN = 2 * math.pi


def times(switches):
    return TURN * switches["period"] + switches["phase"]


def one_period(motion, n):
    """Return the switches of the last period of a motion of period n, from an impact to the same impact, inclusive.

    Return [] if the record is too short for these two impacts.
    """
    switches, late = motion.switches, times(motion.switches)
    impacts = np.flatnonzero(switches["after"] == vd.State.IMPACT)
    first = impacts[abs(late[impacts] - (late[impacts[-1]] - n * TURN)) < 1e-5]
    return switches[first[0] : impacts[-1] + 1] if len(first) else switches[:0]


def between_main_impacts(motion):
    """Return the switches from the first main impact to the last one, inclusive, and [] if there are not two.

    Switches more than half a period before and after a main impact must be recorded.
    """
    late, main = times(motion.switches), motion.impacts
    at = times(main)
    rows = main["row"][(at - late[0] > math.pi) & (late[-1] - at > math.pi)]
    return motion.switches[rows[0] : rows[-1] + 1] if len(rows) > 1 else motion.switches[:0]


def segments(switches):
    """Yield (state, begin, end) for each interval between switches: the state, and the switches at both ends."""
    for a, b in pairwise(switches):
        if a["after"] != vd.State.IMPACT:
            yield int(a["after"]), a, b


class Slide:
    """A slide by eqs. (4), (5) and (9) as they are printed, at times x since its beginning."""

    def __init__(self, a, b, direction, arguments):
        self.A, self.B, self.eps = (arguments[name] for name in ("A", "B", "eps"))
        self.eta = arguments["eta"] if self.eps else 1.0
        self.phi, self.xi, self.drop = a["phase"], a["xi"], self.B + direction
        self.theta = TURN * (self.eta % 1.0 * int(a["period"]) % 1.0) + self.eta * self.phi
        self.h = times(b) - times(a)
        if direction * self.acceleration(0.0) < 0.0:  # Muller's method has ended a wait early, so ξ'' is set to 0
            self.drop = self.force(0.0)

    def force(self, x):
        return self.A * (np.sin(self.phi + x) + self.eps * self.eta**2 * np.sin(self.theta + self.eta * x))

    def first(self, x):
        return self.A * (np.cos(self.phi + x) + self.eps * self.eta * np.cos(self.theta + self.eta * x))

    def gap(self, x):
        second = [self.A * (np.sin(self.phi + y) + self.eps * np.sin(self.theta + self.eta * y)) for y in (x, 0.0)]
        return self.xi + self.first(0.0) * x - self.drop * x * x / 2 - second[0] + second[1]

    def velocity(self, x):
        return self.first(0.0) - self.first(x) - self.drop * x

    def acceleration(self, x):
        return self.force(x) - self.drop

    def zeros(self, f, x):
        """Return both ends of the slide, and the zeros of f between the times x, between which f is monotonic."""
        at = np.flatnonzero(f(x[:-1]) * f(x[1:]) < 0)
        low, high = x[at], x[at + 1]
        for _ in range(26):  # an extreme changes only by the square of the remaining error
            middle = (low + high) / 2
            before = f(middle) * f(low) > 0
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return np.concatenate([[0.0, self.h], low])

    def extremes(self):
        """Return ξ and ξ' where they may be extreme: at both ends, at the zeros of ξ', and at those of ξ''.

        Between zeros of ξ'' the velocity is monotonic, so no zero of ξ' is missed, however close to another one.
        """
        dense = np.linspace(0.0, self.h, max(64, int(24 * self.h * max(self.eta, 1.0) / TURN)))
        bends = np.sort(self.zeros(self.acceleration, dense))
        return self.gap(self.zeros(self.velocity, bends)), self.velocity(bends)

    def work(self):
        ends = np.linspace(0.0, self.h, 2 + int(self.h * max(self.eta, 1.0) / 2))
        nodes, weights = np.polynomial.legendre.leggauss(20)
        half = np.diff(ends)[:, None] / 2
        x = ends[:-1, None] + half * (1 + nodes)
        return float((half * weights * self.force(x) * self.velocity(x)).sum())


def naive(switches, arguments, duration=None):
    """Return the quantities of a summary by name, by plain loops over the switches. `duration` is in periods."""
    per = dict.fromkeys(("impacts", "momentum", "energy", "friction_loss", "drive_work"), 0.0)
    most = dict.fromkeys(("xi_max", "dxi_min", "dxi_max", "impact_speed_max"), 0.0)
    share = np.zeros(4)
    for switch in switches[1:] if duration else switches:  # the first switch of a period repeats the last one
        landed, speed = switch["after"] == vd.State.IMPACT, switch["dxi"]
        most["xi_max"] = max(most["xi_max"], 0.0 if landed else switch["xi"])
        most["dxi_min"], most["dxi_max"] = min(most["dxi_min"], speed), max(most["dxi_max"], speed)
        most["impact_speed_max"] = max(most["impact_speed_max"], abs(speed) if landed else 0.0)
    for state, a, b in segments(switches):
        share[state] += times(b) - times(a)
        landed = b["after"] == vd.State.IMPACT
        if state in (vd.State.UP, vd.State.DOWN):
            slide = Slide(a, b, 1.0 if state == vd.State.UP else -1.0, arguments)
            gaps, speeds = slide.extremes()
            most["xi_max"] = max(most["xi_max"], gaps.max())
            most["dxi_min"] = min(most["dxi_min"], speeds.min())
            most["dxi_max"] = max(most["dxi_max"], speeds.max())
            per["friction_loss"] += abs((0.0 if landed else b["xi"]) - a["xi"])
            per["drive_work"] += slide.work()
        if landed:
            speed = abs(b["dxi"])
            per["impacts"], per["momentum"] = per["impacts"] + 1, per["momentum"] + speed
            per["energy"] += speed * speed / 2
    duration = duration or (share.sum() / TURN or math.nan)
    found = {name: value / duration for name, value in per.items()} | most
    found["impact_speed_mean"] = found["momentum"] / found["impacts"] if per["impacts"] else 0.0 * duration
    names = ("share_up", "share_down", "share_stick", "share_rest")
    return found | dict(zip(names, share / (share.sum() or math.nan), strict=True))


EXTREMES = ("xi_max", "dxi_min", "dxi_max", "impact_speed_max")


def reference(motion, n):
    """Return the quantities of the summary of a motion that has the period n, or no known period if n <= 0."""
    if n > 0:
        whole = one_period(motion, n)
        return naive(whole, motion.arguments, n) if len(whole) else {}
    of_record = naive(motion.switches, motion.arguments)
    of_record["impact_speed_max"] = of_record["impact_speed_max"] or math.nan  # not 0 if the record has no impact
    return naive(between_main_impacts(motion), motion.arguments) | {name: of_record[name] for name in EXTREMES}


def assert_agrees(swept, index, motion):
    for name, value in reference(motion, int(swept.period[index])).items():
        found = getattr(swept, name)[index]
        assert found == pytest.approx(value, rel=1e-11, abs=1e-11, nan_ok=True), (name, motion.arguments)


MOTIONS = [
    dict(A=1.5), dict(A=2.4), dict(A=2.65), dict(A=3.04), dict(A=3.1), dict(A=3.25), dict(A=1.9, B=0.6),
    dict(A=4.0, B=1.5), dict(A=3.3, B=0.4),
]  # fmt: skip


@pytest.mark.jit
@pytest.mark.parametrize("scene", MOTIONS, ids=str)
def test_periodic_motion_is_summarised_over_one_period(scene):
    run = dict(transient=600, periods=30)
    swept = vd.sweep(**(scene | {"A": [scene["A"]]}), **run, record="summary")
    motion = vd.simulate(**scene, **run)
    n = int(swept.period[0])
    assert n > 0
    assert_agrees(swept, 0, motion)
    assert swept.drive_work[0] == pytest.approx(swept.friction_loss[0] + swept.energy[0], abs=1e-10)
    section = motion.section
    assert abs(section[n:] - section[:-n]).max() < 1e-5
    assert not any(abs(section[-m:] - section[-2 * m : -m]).max() < 1e-5 for m in range(1, n))


@pytest.mark.jit
@pytest.mark.parametrize("seed", range(6))
def test_summary_equals_quadrature_and_the_extremes_of_the_curve(seed):
    """Motions with and without a period, a disturbance and a grid. Without a grid the energy balance closes."""
    rng = np.random.default_rng(seed)
    method = ("certified", "certified", "muller", "fixed")[seed % 4]
    eta, eps = ((0.5, 1e-3), (vd.ETA, 1e-5), (vd.ETA, 2e-4))[seed % 3]
    scene = dict(
        B=float(rng.choice([0.0, 0.1, 0.3, 1.2])), transient=int(rng.choice([0, 5, 100])), method=method, eta=eta,
        periods=int(rng.choice([3, 10, 20])), xi0=float(rng.choice([0.0, 3.0])), eps=[0.0, eps],
    )  # fmt: skip
    scene |= {} if method == "certified" else {"dtau": 0.01 if method == "muller" else 0.1}
    scene["A"] = A = np.sort(rng.uniform(1.02 + scene["B"], scene["B"] + 7, 4))
    swept = vd.sweep(**scene, record="summary")
    assert list(swept.axes) == ["eps", "A"]
    for index in np.ndindex(swept.shape):
        motion = vd.simulate(**scene | {"eps": scene["eps"][index[0]], "A": A[index[1]]})
        assert_agrees(swept, index, motion)
        if method == "certified" and swept.impacts[index] > 0:
            assert swept.drive_work[index] == pytest.approx(swept.friction_loss[index] + swept.energy[index], rel=1e-12)


@pytest.mark.jit
@pytest.mark.parametrize("seed", range(8))
def test_extremes_on_a_coarse_grid(seed):
    """A step may skip two zeros of ξ', between which ξ' has another sign and ξ a maximum.

    Muller's method ends a wait early, within its tolerance, and the next slide then begins with ξ'' = 0.
    """
    rng = np.random.default_rng(seed)
    scene = dict(
        B=float(rng.choice([0.0, 0.1, 0.6, 1.2])), transient=5, periods=20, method=("muller", "fixed")[seed % 2],
        dtau=float(rng.uniform(0.2, 6.0)), eta=float(rng.uniform(3.0, 30.0)),
    )  # fmt: skip
    scene |= {"eps": [0.0, 0.3 / scene["eta"] ** 2, 0.3 / scene["eta"]], **({} if seed % 2 else {"tol": 1e-4})}
    A = np.sort(rng.uniform(1.05 + scene["B"], scene["B"] + 7, 3))
    swept = vd.sweep(A=A, **scene, record="summary")
    for index in np.ndindex(swept.shape):
        motion = vd.simulate(**scene | {"A": A[index[0]], "eps": scene["eps"][index[1]]})
        assert_agrees(swept, index, motion)


MISSED = [
    dict(A=1.7584744386475173, eps=0.03611600705602364, eta=7.0, method="muller", dtau=1.708403603598648,
         transient=20, periods=3),
    dict(A=3.6755083282381538, eps=8.258422082613284e-08, transient=400, periods=20),
]  # fmt: skip


@pytest.mark.jit
@pytest.mark.parametrize("scene", MISSED, ids=["xi_max", "impact_speed_max"])
def test_extremes_that_were_missed(scene):
    """In the first motion a slide skips two zeros of ξ', in the second an impact is the first recorded switch."""
    assert_agrees(vd.sweep(**scene | {"A": [scene["A"]]}, record="summary"), 0, vd.simulate(**scene))


@pytest.mark.jit
def test_extremes_include_the_first_recorded_switch():
    """Records of one period of a motion of period 2. Those that begin with an impact have no later one."""
    tau0, run = np.linspace(0, TURN, 16, endpoint=False), dict(A=3.04, transient=50, periods=1)
    swept, states = vd.sweep(tau0=tau0, **run, record="summary"), set()
    for k, start in enumerate(tau0):
        motion = vd.simulate(tau0=start, **run)
        states.add(int(motion.switches["after"][0]))
        assert_agrees(swept, k, motion)
    assert states > {vd.State.IMPACT}


@pytest.mark.jit
@pytest.mark.parametrize("speed", [60.0, 60.25, 60.5, 61.0])
def test_fastest_of_a_slide_of_many_turns(speed):
    """On a steep incline the mass slides down faster in each period, so its speed is largest in the last period."""
    scene = dict(A=2.4, B=1.3, dxi0=speed, transient=0)
    (first, *_) = (row for row in vd.simulate(**scene, periods=60).switches if row["after"] == vd.State.IMPACT)
    scene["periods"] = int(first["period"]) + 1
    swept, motion = vd.sweep(**scene, record="summary"), vd.simulate(**scene)
    assert swept.period == UNSEEN
    found = motion.sample(20_000)
    least = found.dxi[found.tau <= times(first)].min()
    assert least - 1e-6 < swept.dxi_min <= least
    assert least < first["dxi"] - 1.0, "the largest speed is reached before the impact"


@pytest.mark.jit
def test_periods_and_exponents_equal_those_of_the_orbits():
    """The Lyapunov exponent is log |multiplier| / period of the stable orbit of `vd.orbits`, -∞ if the mass rests."""
    A = [2.9, 3.0, 3.04, 3.05]
    swept = vd.sweep(A=A, transient=4000, periods=20, record="summary")
    for k, a in enumerate(A):
        (orbit,) = [o for o in vd.orbits(a, max_period=4) if abs(o.multiplier) < 1.0]
        assert swept.period[k] == orbit.period
        expected = math.log(abs(orbit.multiplier)) / orbit.period if orbit.multiplier else -math.inf
        assert swept.lyapunov[k] == pytest.approx(expected, abs=1e-9)
    assert vd.sweep(A=[1.5], transient=10, periods=9, record="summary").lyapunov.tolist() == [-math.inf]
    assert np.isnan(vd.sweep(A=[3.04], eps=1e-4, transient=9, periods=9, record="summary").lyapunov).all()


ALTERNATING = [
    dict(A=[*np.linspace(2.595, 2.604, 40), 2.604085, *np.linspace(2.6045, 2.61, 20)]),
    dict(A=np.linspace(3.05, 3.065, 40)),
    dict(A=[10.76, 10.7825, 10.783, 10.79], B=2.2, transient=20_000),
    dict(A=np.linspace(2.6, 2.608, 10), method="muller", dtau=1e-2),
    dict(A=[2.9259506337558374, 2.95], eps=1e-2, eta=3.0, periods=64),
    dict(A=[4.459984996249062, 8.02263565891473]),
]


@pytest.mark.jit
@pytest.mark.parametrize("scene", ALTERNATING, ids=lambda scene: f"A={scene['A'][0]:g}")
def test_alternation_that_decays_is_no_period(scene):
    """Near a doubling a motion alternates about its orbit, and differs little from itself two periods earlier."""
    run = dict(transient=500, periods=128, record="summary") | scene
    soon, late = vd.sweep(**run).period, vd.sweep(**run | {"transient": 300_000}).period
    assert (soon == late)[soon > 0].all()
    assert (soon > 0).mean() > 0.7


@pytest.mark.jit
@pytest.mark.parametrize("number", [0, 1])
def test_exponent_is_the_growth_of_a_small_difference(number):
    """From each impact, motions start slightly earlier and later. Their distances grow until their next impacts."""
    run = dict(transient=500, periods=70)
    many = vd.sweep(A=np.linspace(6.0, 8.0, 401), **run, record="summary")
    A = float(many.axes["A"][(many.period == 0) & (many.lyapunov > 0.1)][number])
    swept = many.select(A=A)
    impacts = between_main_impacts(vd.simulate(A=A, **run))
    impacts = impacts[impacts["after"] == vd.State.IMPACT]
    delta, grown = 1e-7, 0.0

    def next_impact(tau0):
        motion = vd.simulate(A=A, tau0=tau0, transient=0, periods=20).switches
        return float(times(motion[motion["after"] == vd.State.IMPACT])[0])

    for impact in impacts[:-1]:
        later, earlier = (next_impact(impact["phase"] + d) for d in (delta, -delta))
        grown += math.log(abs(later - earlier) / (2 * delta))
    duration = (times(impacts[-1]) - times(impacts[0])) / TURN
    assert swept.lyapunov == pytest.approx(grown / duration, abs=1e-4)


@pytest.mark.jit
def test_means_do_not_depend_on_the_ends_of_the_record():
    """An impact falls every five periods. From the first recorded switch to the last there were 0.177 in a period."""
    scene = dict(A=3.3001343562003362, B=0.04658268061775628, transient=50, record="summary")
    short, settled = (vd.sweep(**scene, periods=n) for n in (40, 4000))
    assert settled.impacts == 0.2
    for name in ("impacts", "momentum", "energy", "drive_work"):
        assert getattr(short, name) == pytest.approx(getattr(settled, name), rel=3e-3)


@pytest.mark.jit
def test_extremes_between_the_samples_of_a_wave():
    """The values are those at the zeros of ξ''. Eight samples a wave missed them, by 5e-7 and completely."""
    down = vd.sweep(A=3.053, eps=2e-4, transient=100, periods=100, record="summary").dxi_min
    up = vd.sweep(A=1.11, eps=1e-3, eta=0.5, transient=20, periods=20, record="summary").dxi_max
    assert down == pytest.approx(-3.1496524952183, abs=1e-13)
    assert up == pytest.approx(0.0018434932811647, abs=1e-15)


@pytest.mark.jit
def test_period_that_the_record_cannot_show_is_unknown():
    """At p = 10 a superstable motion of period 10 had the period 0 and a positive exponent, at p = 15 the latter."""
    scene = dict(A=8.1305, B=0.28108, transient=400, record="summary")
    short, middle, whole = (vd.sweep(**scene, periods=p) for p in (10, 15, 64))
    assert (short.period, short.sequence) == (UNSEEN, UNSEEN)
    assert math.isnan(short.lyapunov)
    assert (middle.period, middle.lyapunov) == (whole.period, whole.lyapunov) == (10, -math.inf)


@pytest.mark.jit
@pytest.mark.parametrize("periods", [1, 3, 10, 40, LONGEST, LONGEST + 2])
def test_periods_of_short_records_are_those_of_long_ones_or_unknown(periods):
    scene = dict(A=np.random.default_rng(1).uniform(1.2, 9.0, 1000), B=0.28108, transient=20_000, record="summary")
    short, long = vd.sweep(**scene, periods=periods), vd.sweep(**scene, periods=300)
    assert (long.period >= 0).all()
    unknown = short.period == UNSEEN
    assert (short.period == long.period)[~unknown].all()
    assert ((long.period == 0) | (long.period > periods - 2))[unknown].all()
    assert not (periods > LONGEST and unknown.any())
    assert not (short.lyapunov > 0)[short.period != 0].any()
    assert (np.isneginf(short.lyapunov) == np.isneginf(long.lyapunov))[short.period > 0].all()
    assert not (short.gaps == 0)[long.gaps > 0].any()


@pytest.mark.jit
def test_disturbed_motion_has_no_period_if_the_excitation_has_none():
    """If η is an integer, the excitation repeats every period, so the disturbed motion may have a long period."""
    scene = dict(A=[1.5, 3.05, 3.2], eps=1e-4, transient=10, periods=4, record="summary")
    assert (vd.sweep(**scene).period == 0).all()
    assert vd.sweep(**scene, eta=100.0).period[1] == UNSEEN
    assert vd.sweep(**scene | {"periods": 40}, eta=100.0).period[1] > 0


@pytest.mark.jit
def test_gaps_and_sequences_distinguish_orbits():
    swept = vd.sweep(A=[1.5, 2.4, 2.65, 2.75, 3.04, 3.1, 3.17, 3.2, 3.25], transient=900, periods=64, record="summary")
    assert swept.gaps.tolist() == [1, 1, 1, 2, 2, 2, 122, 12, 3]
    assert swept.period.tolist() == [1, 1, 2, 2, 2, 4, 10, 3, 3]
    words = {}
    for k, a in enumerate(swept.axes["A"]):
        window = one_period(vd.simulate(A=a, transient=900, periods=64), int(swept.period[k]))["after"][1:].tolist()
        turned = [tuple(window[m:] + window[:m]) for m in range(len(window))]
        root = min(turned)
        for m in range(1, len(root)):
            if len(root) % m == 0 and root == root[:m] * (len(root) // m):
                root = root[:m]
                break
        words.setdefault(int(swept.sequence[k]), set()).add(root)
    assert all(len(w) == 1 for w in words.values()), "equal numbers must mean equal sequences"
    assert len(set.union(*words.values())) == len(words), "equal sequences must have equal numbers"


@pytest.mark.jit
@pytest.mark.parametrize("eps", [0.0, 1e-9])
@pytest.mark.parametrize("A", [5.718193004727864, 3.623774070760059, 4.671037042484899])
def test_gaps_are_in_order_of_time(A, eps):
    """These cycles are not their own reverse. With the disturbance the motions have no period."""
    run = dict(A=A, eps=eps, transient=2000, periods=200)
    impacts = vd.simulate(**run).impacts[1:-1]
    gaps = np.rint(np.diff(times(impacts)) / TURN).astype(int).tolist()
    n = next(n for n in range(1, len(gaps)) if gaps[n:] == gaps[:-n])

    def least(cycle):
        return min("".join(map(str, cycle[k:] + cycle[:k])) for k in range(n))

    assert least(gaps[:n]) != least(gaps[:n][::-1])
    swept = vd.sweep(**run, record="summary")
    assert (str(int(swept.gaps)), bool(swept.period > 0)) == (least(gaps[:n]), eps == 0.0)


@pytest.mark.parametrize(
    ("scene", "share", "xi"), [(dict(A=0.5), "share_rest", 0.0), (dict(A=0.4, B=0.25, xi0=2.0), "share_stick", 2.0)]
)
def test_permanent_rest_or_stick_has_period_1(scene, share, xi):
    swept = vd.sweep(**scene, transient=3, periods=4, record="summary")
    assert (swept.period, swept.impacts, swept.energy, swept.lyapunov) == (1, 0.0, 0.0, -math.inf)
    assert swept.share_rest + swept.share_stick == getattr(swept, share) == 1.0
    assert (swept.xi_max, swept.dxi_max, swept.dxi_min) == (xi, 0.0, 0.0)


@numba.njit(error_model="numpy")
def summarised(rows, n, state, x, point, totals, out):
    drive = Drive(point[0], point[1], point[2], point[3], point[4], point[5])
    summarise(rows, 0, n, state, x, drive, totals, out)


def of_switches(motion):
    """Return the summary of a single motion, computed from its switches."""
    s, a = motion.switches, motion.arguments
    rows = np.stack([s[name].astype(float) for name in s.dtype.names], axis=1) if len(s) else np.zeros((1, 6))
    last = (s if len(s) else motion._start)[-1]
    fast = a["A"] * a["eps"] * a["eta"] * a["eta"]
    eta = a["eta"] if fast > 0.0 else 0.0
    out = np.empty(OUT)
    x = 0.0 if last["after"] == vd.State.IMPACT else float(last["xi"])
    point = np.array([a["A"], a["B"], fast, eta, eta - math.floor(eta), a["dtau"]])
    summarised(rows, len(s), int(last["after"]), x, point, np.empty(TOTALS), out)
    return {name: values[0] for name, values in Arrays(*[None] * 4, summary=out[None]).quantities().items()}


def assert_same(swept, index, motion):
    expected = of_switches(motion)
    for name in NAMES:
        assert np.array_equal(getattr(swept, name)[index], expected[name], equal_nan=True), (name, motion.arguments)


@pytest.mark.jit
@pytest.mark.filterwarnings("ignore:A = .*swapped")
@pytest.mark.parametrize("seed", range(12))
def test_summary_has_the_bits_of_the_switches(seed):
    """The scenes cover all methods, points with and without a disturbance, irregular motions, and short records."""
    rng = np.random.default_rng(seed)
    B = float(rng.choice([0.0, 0.1, 0.5, 0.985, 1.2, rng.uniform(0, 2)]))
    A = np.sort(rng.uniform(abs(1 - B) * 0.5 + 0.01, B + 4, 6))
    method = str(rng.choice(["certified", "certified", "muller", "fixed"]))
    scene = dict(
        B=B, method=method, transient=int(rng.choice([0, 5, 300])), periods=int(rng.choice([1, 3, 64, 100])),
        tau0=float(rng.choice([0.0, rng.uniform(0, 6.28)])), xi0=float(rng.choice([0, rng.exponential()])),
        eps=float(rng.choice([0, 0, 1e-4, 1e-3])),
    )  # fmt: skip
    scene |= {} if method == "certified" else {"dtau": float(10 ** rng.uniform(-3, -1))}
    scene |= {"tol": 1e-9} if method == "muller" else {}
    both = vd.sweep(A=A, **scene, record=("summary", "section"))
    alone = vd.sweep(A=A, **scene, record="summary", threads=1)
    for k, a in enumerate(A):
        assert_same(both, k, vd.simulate(A=a, **scene))
        assert all(np.array_equal(getattr(both, q)[k], getattr(alone, q)[k], equal_nan=True) for q in NAMES)


LONGER = [
    dict(A=[1.3, 2.4, 3.04], eps=1e-3, transient=10, periods=400),  # more switches than a lane can store
    dict(A=[3.158, 3.1605, 3.172, 3.186], transient=3000, periods=900),  # no period, and copied cycles (recurrence.py)
    dict(A=[2.4, 2.719252649683075], B=0.1, tau0=0.6385324289869151, transient=1, periods=6),
]


@pytest.mark.jit
@pytest.mark.parametrize("scene", LONGER, ids=str)
def test_summary_covers_all_switches(scene):
    """If no period is found, the summary covers all switches.

    The last motion reaches its exact cycle shortly before the end of the record. The last n periods still differ from
    the n periods before, so `find_period` finds no period.
    """
    swept = vd.sweep(**scene, record="summary")
    for k, a in enumerate(scene["A"]):
        assert_same(swept, k, vd.simulate(**scene | {"A": a}))
    if scene["periods"] == 6:
        assert swept.period[1] == UNSEEN
        assert vd.sweep(**scene | {"periods": 12}, record="summary").period[1] > 0
    if "eps" in scene:
        assert swept.switches[0].sum() > 3 * ROWS


def test_columns_have_the_names_and_the_order_of_the_quantities():
    columns = {value: name for name, value in vars(summary).items() if name.startswith("OUT_")}
    assert [columns[n] for n in range(OUT)] == [f"OUT_{q.name.upper()}" for q in SUMMARIES]


@pytest.mark.parametrize("fastest", range(3))
def test_gap_cycle_does_not_depend_on_the_first_impact(fastest):
    """The gaps (numbers of periods between impacts) are 1, 2, 1, a cycle of three gaps.

    From the first gap on a cycle of two gaps, 1 and 2, also seems to repeat.
    """
    rows = np.zeros((3, 6))
    rows[:, PERIOD], rows[:, AFTER], rows[:, DXI] = [0, 1, 3], vd.State.IMPACT, -1.0
    rows[fastest, DXI] = -2.0
    assert gap_cycle_of_period(rows, 2, 3, 4, np.zeros(TOTALS)) == 112.0
