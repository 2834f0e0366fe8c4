"""Comparison of summaries with sums over the switches, with quadrature, and with orbits that are found in another way.

The summary computed from the recorded switches of a single motion must agree with the summary of a sweep to the bit.
"""

import math
from itertools import pairwise

import numba
import numpy as np
import pytest

import vibrodrive as vd
from vibrodrive.batch.parallel import run
from vibrodrive.batch.records import as_quantities
from vibrodrive.jit.slices import Halt
from vibrodrive.kernels import lane, summary
from vibrodrive.kernels.arguments import Arguments
from vibrodrive.kernels.engine import batch
from vibrodrive.kernels.history import ROWS, new_history
from vibrodrive.kernels.outputs import numbers_of
from vibrodrive.kernels.summary import AFTER, DXI, OUT, PERIOD, TOTALS, Drive, gap_cycle_of_period, summarise
from vibrodrive.model.plan import make_plan
from vibrodrive.model.records import SUMMARIES

NAMES = [q.name for q in SUMMARIES]
TURN = 2 * math.pi


def times(switches):
    return TURN * switches["period"] + switches["phase"]


def one_period(motion, n):
    """Return the switches of the last period of a motion of period n, from an impact to the same impact, inclusive."""
    switches, late = motion.switches, times(motion.switches)
    last = np.flatnonzero(switches["after"] == vd.State.IMPACT)[-1]
    first = int(np.argmin(abs(late - (late[last] - n * TURN))))
    return switches[first : last + 1]


def segments(switches):
    """Yield (state, begin, end) for each interval between switches: the state, and the switches at both ends."""
    for a, b in pairwise(switches):
        if a["after"] != vd.State.IMPACT:
            yield int(a["after"]), a, b


def naive(switches, duration):
    """Return some quantities of a summary by name, by plain loops over the switches. `duration` is in periods."""
    out = dict.fromkeys(("impacts", "momentum", "energy", "friction_loss"), 0.0)
    share, speeds = np.zeros(4), []
    for state, a, b in segments(switches):
        share[state] += times(b) - times(a)
        landed = b["after"] == vd.State.IMPACT
        if state in (vd.State.UP, vd.State.DOWN):
            out["friction_loss"] += abs((0.0 if landed else b["xi"]) - a["xi"])
        if landed:
            speeds.append(-b["dxi"])
    out["impacts"], out["momentum"] = len(speeds), sum(speeds)
    out["energy"] = 0.5 * sum(v * v for v in speeds)
    found = {name: value / duration for name, value in out.items()}
    found |= {"impact_speed_max": max(speeds), "impact_speed_mean": sum(speeds) / len(speeds)}
    names = ("share_up", "share_down", "share_stick", "share_rest")
    return found | dict(zip(names, share / (duration * TURN), strict=True))


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
    window = one_period(motion, n)
    for name, value in naive(window, n).items():
        tolerance = 1e-7 if name.startswith("share") else 1e-12
        assert getattr(swept, name)[0] == pytest.approx(value, rel=tolerance, abs=tolerance), name
    assert swept.drive_work[0] == pytest.approx(swept.friction_loss[0] + swept.energy[0], abs=1e-10)
    assert swept.xi_max[0] == pytest.approx(window["xi"].max(), abs=1e-12)
    section = motion.section
    assert abs(section[n:] - section[:-n]).max() < 1e-5
    assert not any(abs(section[-m:] - section[-2 * m : -m]).max() < 1e-5 for m in range(1, n))


@pytest.mark.jit
@pytest.mark.parametrize("eps", [0.0, 1e-4])
@pytest.mark.parametrize("A", [1.5, 2.65, 3.04])
def test_work_and_extremes_equal_those_of_the_curve(A, eps):
    """The work of the excitation is integrated by Simpson's rule. Extreme velocities are those of a million points."""
    run = dict(transient=200, periods=8)
    swept = vd.sweep(A=[A], eps=eps, **run, record="summary")
    motion = vd.simulate(A=A, eps=eps, **run)
    n = int(swept.period[0])
    switches = one_period(motion, n) if n else motion.switches
    duration = n or (times(switches[-1]) - times(switches[0])) / TURN
    s, B, eta = motion.arguments, 0.1, vd.ETA
    work, most, least = 0.0, -math.inf, math.inf
    for state, a, b in segments(switches):
        if state not in (vd.State.UP, vd.State.DOWN):
            continue
        h, count = times(b) - times(a), 40_000
        x = np.linspace(0.0, h, count + 1)
        tau = times(a) + x
        fast = s["eps"] * A * eta
        sign = 1.0 if state == vd.State.UP else -1.0
        g = -A * np.cos(tau) - fast * np.cos(eta * tau)
        v = g - g[0] - (B + sign) * x
        force = A * np.sin(tau) + fast * eta * np.sin(eta * tau)
        weights = np.ones(count + 1)
        weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
        work += (weights * force * v).sum() * h / count / 3
        most, least = max(most, v.max()), min(least, v.min())
    assert swept.drive_work[0] == pytest.approx(work / duration, abs=1e-8)
    assert most <= swept.dxi_max[0] + 1e-12 <= most + 1e-6
    assert least >= swept.dxi_min[0] - 1e-12 >= least - 1e-6


@pytest.mark.jit
@pytest.mark.parametrize("eps", [1e-5, 1e-3])
def test_no_impact_is_faster_than_the_largest_velocity_down(eps):
    """The mass is often fastest at the end of a slide, at an impact. So the end of each slide counts."""
    swept = vd.sweep(A=np.linspace(1.3, 6.0, 100), eps=eps, transient=20, periods=6, record="summary")
    assert (swept.dxi_min <= 1e-12 - swept.impact_speed_max).all()


@pytest.mark.parametrize("speed", [60.0, 60.25, 60.5, 61.0])
def test_fastest_of_a_slide_of_many_turns(speed):
    """On a steep incline the mass slides down faster in each period, so its speed is largest in the last period."""
    scene = dict(A=2.4, B=1.3, dxi0=speed, transient=0)
    (first, *_) = (row for row in vd.simulate(**scene, periods=60).switches if row["after"] == vd.State.IMPACT)
    scene["periods"] = int(first["period"]) + 1
    swept, motion = vd.sweep(**scene, record="summary"), vd.simulate(**scene)
    assert swept.period == 0
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


@pytest.mark.jit
@pytest.mark.parametrize("number", [0, 1])
def test_exponent_is_the_growth_of_a_small_difference(number):
    """From each impact, motions start slightly earlier and later. Their distances grow until their next impacts."""
    run = dict(transient=500, periods=60)
    many = vd.sweep(A=np.linspace(6.0, 8.0, 401), **run, record="summary")
    A = float(many.axes["A"][(many.period == 0) & (many.lyapunov > 0.1)][number])
    swept = many.select(A=A)
    switches = vd.simulate(A=A, **run).switches
    impacts = switches[switches["after"] == vd.State.IMPACT]
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


def test_motion_without_release_is_at_rest():
    swept = vd.sweep(A=[0.5], transient=3, periods=4, xi0=0.0, record="summary")
    assert (swept.period[0], swept.impacts[0], swept.energy[0], swept.share_rest[0]) == (1, 0.0, 0.0, 1.0)
    assert swept.lyapunov[0] == -math.inf
    assert (swept.xi_max[0], swept.dxi_max[0], swept.dxi_min[0]) == (0.0, 0.0, 0.0)


def test_permanent_stick_has_period_1():
    swept = vd.sweep(A=[0.4], B=0.25, xi0=2.0, transient=3, periods=4, record="summary")
    assert (swept.period[0], swept.impacts[0], swept.share_stick[0], swept.share_rest[0]) == (1, 0.0, 1.0, 0.0)
    assert (swept.xi_max[0], swept.dxi_max[0], swept.dxi_min[0]) == (2.0, 0.0, 0.0)


@numba.njit(error_model="numpy")
def summarised(rows, n, state, x, point, totals, out):
    summarise(rows, 0, n, state, x, Drive(point[0], point[1], point[2], point[3], point[4]), totals, out)


def of_switches(motion):
    """Return the summary of a single motion, computed from its switches."""
    s, a = motion.switches, motion.arguments
    rows = np.stack([s[name].astype(float) for name in s.dtype.names], axis=1) if len(s) else np.zeros((1, 6))
    last = (s if len(s) else motion._start)[-1]
    fast = a["A"] * a["eps"] * a["eta"] * a["eta"]
    eta = a["eta"] if fast > 0.0 else 0.0
    out = np.empty(OUT)
    x = 0.0 if last["after"] == vd.State.IMPACT else float(last["xi"])
    point = np.array([a["A"], a["B"], fast, eta, eta - math.floor(eta)])
    summarised(rows, len(s), int(last["after"]), x, point, np.empty(TOTALS), out)
    return {name: values[0] for name, values in as_quantities(out[None], None, None).items()}


def assert_same(swept, index, motion):
    expected = of_switches(motion)
    for name in NAMES:
        assert np.array_equal(getattr(swept, name)[index], expected[name], equal_nan=True), (name, motion.arguments)


@pytest.mark.jit
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


@pytest.mark.jit
@pytest.mark.parametrize("eps", [0.0, 2e-4])
@pytest.mark.parametrize("method", ["certified", "muller", "fixed"])
def test_history_of_a_lane_equals_the_switches_of_the_motion(method, eps):
    """A sweep stores the last switches of a motion, its history, for the summary. They equal those of `simulate`."""
    scene = dict(A=3.04, eps=eps, transient=2, periods=6, **({} if method == "certified" else {"dtau": 0.05}))
    plan = make_plan(scene | {"method": method})
    w, k = lane.new_lanes(1)
    history, totals = new_history(1, True)
    kernel = batch(plan.settings.method, eps > 0.0, True)
    arguments = Arguments(
        w[0], k[0], np.zeros(1, np.int64), plan.points(0, 1), np.arange(1), np.zeros(1, np.int64),
        numbers_of(plan.settings, lane.LANES), np.empty((1, 6, 2)), np.empty(1, np.int8), np.empty(1),
        np.empty((1, 5), np.int64), np.empty(1), np.empty((1, 0, 4)), history[0], totals[0], np.empty((1, OUT)),
    )  # fmt: skip
    run([(kernel, [arguments])], Halt())
    switches = vd.simulate(**scene, method=method).switches
    rows = history[0, 0, : k[0, 0, lane.HISTORY_COUNT]]
    assert (rows == np.column_stack([switches[n] for n in ("period", "phase", "before", "after", "xi", "dxi")])).all()


@pytest.mark.jit
def test_more_switches_than_a_lane_can_store():
    scene = dict(transient=10, periods=400)
    A = [1.3, 2.4, 3.04]
    swept = vd.sweep(A=A, eps=1e-3, **scene, record="summary")
    for k, a in enumerate(A):
        motion = vd.simulate(A=a, eps=1e-3, **scene)
        assert k or len(motion.switches) > 3 * ROWS
        assert_same(swept, k, motion)
        s = motion.switches
        for name, value in naive(s, (times(s[-1]) - times(s[0])) / TURN).items():
            if name != "impacts" and not name.startswith("impact_speed_mean"):
                assert getattr(swept, name)[k] == pytest.approx(value, rel=1e-6), name


@pytest.mark.jit
def test_summary_covers_all_switches_of_a_longer_cycle():
    """If no period is found, the summary covers all switches, also those in copied cycles (recurrence.py)."""
    A, run = [3.158, 3.1605, 3.172, 3.186], dict(transient=3000, periods=900)
    swept = vd.sweep(A=A, **run, record="summary")
    for k, a in enumerate(A):
        assert_same(swept, k, vd.simulate(A=a, **run))


@pytest.mark.jit
def test_cycle_reached_late_in_the_record():
    """The motion reaches its exact cycle shortly before the end of the record.

    The last n periods still differ from the n periods before, so `find_period` finds no period.
    """
    scene = dict(B=0.1, tau0=0.6385324289869151, transient=1, periods=6)
    A = [2.4, 2.719252649683075]
    swept = vd.sweep(A=A, **scene, record="summary")
    assert swept.period[1] == 0
    assert vd.sweep(A=A, **(scene | {"periods": 12}), record="summary").period[1] > 0
    for k, a in enumerate(A):
        assert_same(swept, k, vd.simulate(A=a, **scene))


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
