"""Claims about the limits k₂: their dependence on parameters, and the comparison of limits in ε and Δτ (§1 to §6)."""

import functools
import itertools
import math
import time
import timeit
from typing import Any, NamedTuple

import numpy as np

import vibrodrive as vd
from benchmarks import obvious_loop
from benchmarks.paper.claim import Outcome, claim, listed, when
from benchmarks.paper.limits import KINDS, band_of_motions, limits
from benchmarks.paper.motions import NotApplicable, Paper, loss_of_sticking
from benchmarks.paper.orbit_curve import curve_distance, orbit_curve
from benchmarks.paper.starts import SETTLING, WATCHED
from examples.three_questions import rank_correlation
from vibrodrive import Status
from vibrodrive.stability.structure import reference_orbit

OVER_A = np.linspace(1.11, 3.25, 205)[np.linspace(0, 204, 43).round().astype(int)]
"""Values of A at which the limits in ε and Δτ are compared: some of those of configs/limits.toml."""

ALIKE = 2.0  # two limits count as equal if their velocity amplitudes differ at most by this factor
TENDENCY = 0.5  # least rank correlation that counts as a tendency
SETTLES = 0.1  # a limit counts as independent of η if a higher η changes it at most by this share
SEEN = 0.1  # share; the loss of sticking affects limits if they differ by more from their linear continuation across it
A_OF_PERIODS = (2.4, 2.605, 2.8, 3.04, 3.1, 3.25)  # the undisturbed motions have the periods 1, 2, 2, 2, 4 and 3
ETAS = (30.618, 100.618, 302.618, 1009.618)  # away from integers, near which a force meets each period alike
PLACES = (2.5, 3.25)  # range of A with the bifurcations beside which the limits are compared, too
BESIDE = 1e-3  # distance from each of these bifurcations
INCLINES = (0.05, 0.1, 0.2, 0.3, 0.4)
A_OF_INCLINES = (1.9, 2.4, 2.8, 3.04)  # the undisturbed motions have a period for B >= 0.05
RATIONAL = ((101.0, 1), (100.5, 2), (100 + 1 / 3, 3), (100.2, 5))  # (η = p/q, q)
ALL_TIMES = 40_000
DISTANCE = 0.5  # k₃ of the definition in §1, a distance in the plane (ξ, ξ')
SLIDING = 0.5 * math.pi  # a phase at which the mass slides
SHARES_OF_K2 = (0.0, 0.5, 0.9)
SIZES = DISTANCE * 2.0 ** (np.arange(-32, 1) / 4)  # errors of the start, in ascending order, tried before the bisection
HALVINGS = 6
AFTER = 200  # number of simulated periods after each start
AROUND_LOSS = 0.15  # largest distance in A from the loss of sticking


@claim("limits", "Both kinds of disturbance have similar effects: their limits depend on A in a similar way.")
def alike(paper: Paper) -> Outcome:
    found = _over_A()
    r = found.ratio
    close = found.alike
    far = [
        f"{x:.3g} (A = {a:.4g}, n = {n})" for a, x, n in zip(found.A[~close], r[~close], found.n[~close], strict=True)
    ]
    places = [b.A for b in vd.bifurcations(PLACES, max_period=4)]
    beside = _both(A=np.sort([a + side * BESIDE for a in places for side in (-1, 1)])).ratio
    text = (
        f"the ratio k₂(Δτ)/(k₂(ε)ηA) of the limits as velocities is between {r.min():.2g} and {r.max():.2g} at "
        f"{len(r)} values of A from {found.A.min():.3g} to {found.A.max():.3g}, and k₂(ε)ηA is between "
        f"{found.eps.min():.1g} and {found.eps.max():.1g}; the median of the ratio is {np.median(r):.2g}; at "
        f"{100 * close.mean():.0f} % of the values the ratio is at most a factor {ALIKE:g} from 1; the exceptions are: "
        f"{', '.join(far) or 'none'}; these values of A step over the bifurcations: at a distance of {BESIDE:g} from "
        f"{len(places)} bifurcations above A = {PLACES[0]:g} the ratio is between {beside.min():.2g} and "
        f"{beside.max():.2g}"
    )
    numbers = {
        "beside": beside,
        "A": found.A,
        "n": found.n,
        "velocity_eps": found.eps,
        "velocity_dtau": found.dtau,
        "ratio": r,
    }
    return Outcome(text, numbers, when(close.all(), close.mean() > 0.75 and bool(1 / ALIKE <= np.median(r) <= ALIKE)))


@claim("limits", "The more often a solution has bifurcated, the more sensitive it is to both kinds of disturbance.")
def sensitivity(paper: Paper) -> Outcome:
    found = _over_A()
    periods = sorted(set(found.n.tolist()))
    ranges, tendency, ordered = {}, {}, True
    for name, V in (("k₂(ε)ηA", found.eps), ("k₂(Δτ)", found.dtau)):
        ranges[name] = {n: (V[found.n == n].min(), V[found.n == n].max()) for n in periods}
        ordered &= all(ranges[name][m][0] > ranges[name][n][1] for m, n in itertools.pairwise(periods))
        tendency[name] = rank_correlation(found.n.astype(np.float64), V)
    rows = [
        f"{name} is " + ", ".join(f"{low:.2g} … {high:.2g} for n = {n}" for n, (low, high) in of.items())
        + f", with a rank correlation with n of {tendency[name]:.2f}"
        for name, of in ranges.items()
    ]  # fmt: skip
    text = f"at {len(found.A)} values of A from {found.A.min():.3g} to {found.A.max():.3g}, {'; '.join(rows)}"
    numbers = {"A": found.A, "n": found.n, "tendency": tendency}
    return Outcome(text, numbers, when(ordered, max(tendency.values()) < -TENDENCY))


@claim("limits", "η = 10·√102 is chosen without restricting generality: any high frequency ratio has the same effect.")
def any_frequency(paper: Paper) -> Outcome:
    eta = np.array([*ETAS, vd.ETA])
    V = np.array([k.velocity for k in limits("eps", A=A_OF_PERIODS, eta=eta)]).reshape(len(A_OF_PERIODS), len(eta))
    V, papers = V[:, :-1], V[:, -1]
    settled = papers / V[:, -1]
    above = V[:, -2] / V[:, -1]
    rows = [f"{', '.join(f'{v:.3f}' for v in row)} for A = {a:g}" for a, row in zip(A_OF_PERIODS, V, strict=True)]
    text = (
        f"at η = {', '.join(f'{e:g}' for e in ETAS)}, away from integers, k₂ηA is {'; '.join(rows)}; the limits at the "
        f"two largest η differ by at most {100 * np.abs(above - 1).max():.0f} %; the limits at the paper's η = "
        f"{vd.ETA:.6g}, which is {round(vd.ETA) - vd.ETA:.2g} from an integer, are "
        f"{', '.join(f'{100 * s:.2g} %' for s in settled)} of the limits at the largest η"
    )
    numbers = {"A": A_OF_PERIODS, "eta": eta, "velocity": V, "velocity_paper": papers}
    return Outcome(text, numbers, when((np.abs(settled - 1) < SETTLES).all(), (np.abs(above - 1) < SETTLES).all()))


@claim("limits", "The permanent disturbance may be any small function f(τ).")
def any_function(paper: Paper) -> Outcome:
    raise NotApplicable("the model has one fast sine, and late switches")


@claim("limits", "Known experiments with real mechanical systems confirm the results.")
def experiments(paper: Paper) -> Outcome:
    raise NotApplicable("an experiment is no computation, and its data are not in the paper")


@claim("limits", "B = 0.1 is assumed without restricting generality.")
def any_incline(paper: Paper) -> Outcome:
    found = _both(A=A_OF_INCLINES, B=INCLINES)
    close = found.alike
    rows, spread = [], []
    for a in A_OF_INCLINES:
        at = np.flatnonzero(a == found.A)
        spread.append(found.eps[at].max() / found.eps[at].min())
        values = zip(found.n[at], found.eps[at], strict=True)
        rows.append(f"{', '.join(f'{v:.2g} (n = {n})' for n, v in values)} for A = {a:g}")
    text = (
        f"at B = {listed(INCLINES)}, k₂(ε)ηA is {'; '.join(rows)}; this velocity changes with B by a "
        f"factor of up to {max(spread):.0f}; the velocities of the limits in ε and in Δτ agree within a factor of "
        f"{ALIKE:g} at {100 * close.mean():.0f} % of the points"
    )
    numbers = {"A": found.A, "B": found.B, "n": found.n, "velocity_eps": found.eps, "velocity_dtau": found.dtau}
    return Outcome(text, numbers, when(max(spread) < ALIKE, close.mean() > 0.75))


@claim("fig05", "A rational η would make the disturbed motion periodic, with a multiple of the excitation period.")
def rational(paper: Paper) -> Outcome:
    arguments = paper.points("fig05")[-1]
    seen = []
    for eta in [*(eta for eta, _ in RATIONAL), arguments["eta"]]:
        motion = vd.simulate(**(arguments | {"eta": eta}))
        seen.append(_repeats(motion.section, len(motion.section) // 2))
    expected = [q for _, q in RATIONAL]
    text = (
        f"at ε = {arguments['eps']:g} and A = {arguments['A']:g} the motion has the period "
        + ", ".join(f"{n} at η = {eta:.6g}" for n, (eta, _) in zip(seen, RATIONAL, strict=False))
        + f", and {seen[-1] or 'none'} at η = {arguments['eta']:.6g}"
    )
    numbers = {"eta": [*(eta for eta, _ in RATIONAL), arguments["eta"]], "period": seen}
    return Outcome(text, numbers, when(seen == [*expected, 0]))


@claim(
    "fig03",
    "The two interruptions (sticking where the mass turns, resting after the impact) and the plastic impact cause the "
    "orbital stability and influence the limit k₂.",
)
def interruptions_and_limit(paper: Paper) -> Outcome:
    results = paper.results("fig03")
    lost = loss_of_sticking(results)
    if lost is None or results.status[lost] != Status.OK:
        raise NotApplicable("sticking never vanishes")
    at = float(results.axes["A"][lost])
    away = np.linspace(AROUND_LOSS, AROUND_LOSS / 15, 8)  # the loss itself is left out
    A = np.concatenate([at - away, at + away[::-1]])
    found = _both(A=A, B=results.scalars["B"])
    told, numbers, seen = [], {"stick_vanishes": at, "A": A}, []
    for name, V in (("k₂(ε)ηA", found.eps), ("k₂(Δτ)", found.dtau)):
        if len(V) != len(A):
            raise NotApplicable("the limits around the loss of sticking are not all known")
        below, above = slice(0, len(away)), slice(len(away), None)
        slope, level = np.polyfit(A[below] - at, V[below], 1)
        over = float(np.mean(V[above] / (level + slope * (A[above] - at))) - 1)
        seen.append(abs(over) > SEEN)
        told.append(
            f"{name} changes from {V[0]:.2g} to {V[len(away) - 1]:.2g} below the loss and from {V[len(away)]:.2g} to "
            f"{V[-1]:.2g} above the loss, and differs there by {100 * over:+.0f} % from the linear continuation from "
            "below"
        )
        numbers |= {name: V}
    text = f"sticking is lost at A = {at:.4g}; between A = {A[0]:.4g} and {A[-1]:.4g}, {'; '.join(told)}"
    return Outcome(text, numbers, when(all(seen), any(seen)))


@claim(
    "fig07", "Constant step sizes avoid the computing time of a step Δτ = 1e-5 with switching times iterated to 1e-7."
)
def computing_time(paper: Paper) -> Outcome:
    results = paper.results("fig07")
    fine, coarse = 1e-5, paper.plan("fig10").scalars["dtau"]
    span: dict[str, Any] = {
        "A": np.linspace(results.axes["A"][0], results.axes["A"][-1], 16),
        "B": results.scalars["B"], "eps": float(results.axes["eps"].max()),
    }  # fmt: skip
    ways: dict[str, dict[str, Any]] = {
        "fine": {"dtau": fine, "periods": 1},
        "coarse": {"dtau": coarse, "periods": 200},
        "certified": {"periods": 200},
    }
    spent = {name: _seconds_per_period(span | way) for name, way in ways.items()}
    text = (
        f"at {len(span['A'])} values of A of the figure, in a loop that visits every grid point, one period takes "
        f"{_time(spent['fine'])} on one core with a step of {fine:g}, even without iterations, and "
        f"{_time(spent['coarse'])} with a constant step of {coarse:g}; with certified switches it takes "
        f"{_time(spent['certified'])}"
    )
    avoided = spent["coarse"] < 0.1 * spent["fine"]
    return Outcome(text, {"seconds": spent}, when(avoided and spent["coarse"] < spent["certified"], avoided))


@claim("fig08", "With very many contact points, constant steps seem to be the only practicable procedure.")
def only_practicable(paper: Paper) -> Outcome:
    raise NotApplicable("the model has one contact point")


@claim("limits", "Practical stability is meant for all times from t₀ on; Figs. 6 and 9 show 1500 periods.")
def all_times(paper: Paper) -> Outcome:
    rows, changes = [], []
    for symbol, kind in KINDS.items():
        short, long = (np.array([k.k2 for k in limits(kind, A=A_OF_PERIODS, periods=p)]) for p in (1500, ALL_TIMES))
        changes.append(long / short - 1)
        rows.append(f"k₂({symbol}) by {', '.join(f'{c:+.1f}' for c in np.round(100 * changes[-1], 1) + 0.0)} %")
    text = (
        f"{ALL_TIMES} periods instead of 1500 change, at A = {', '.join(f'{a:g}' for a in A_OF_PERIODS)} (in the "
        f"figures A = 3.04), {' and '.join(rows)}"
    )
    largest = float(np.abs(changes).max())
    return Outcome(text, {"A": A_OF_PERIODS, "change": changes}, when(largest < 0.02, largest < 0.2))


@claim(
    "limits",
    "For a distance k₃ there are k₁ and k₂: motions with ‖ΔX₀‖ + |Δt₀| < k₁ and a disturbance below k₂ stay within k₃.",
)
def jointly(paper: Paper) -> Outcome:
    A = 3.04
    orbit = vd.simulate(A, transient=SETTLING, periods=WATCHED, section_phase=SLIDING)
    base = reference_orbit(orbit)
    if base is None:
        raise NotApplicable("the undisturbed motion has no period")
    curve, (xi, dxi) = orbit_curve(orbit, base.n), orbit.section[0]
    start = {"xi0": xi, "dxi0": dxi, "tau0": SLIDING}

    def near(motion: vd.Trajectory) -> bool:
        return curve_distance(curve, motion, enough=DISTANCE) < DISTANCE

    def within(size: float, eps: float) -> bool:
        starts = ({name: start[name] + size * part[name] for name in start} for part in _directions())
        return all(near(vd.simulate(A, **moved, eps=eps, transient=0, periods=AFTER)) for moved in starts)

    k2 = band_of_motions("eps", near, A=A, transient=1000, periods=1500).lost
    found = []
    for share in SHARES_OF_K2:
        low = 0.0
        for high in SIZES:
            if not within(high, share * k2):
                break
            low = high
        for _ in range(HALVINGS if low < SIZES[-1] else 0):
            size = 0.5 * (low + high)
            low, high = (size, high) if within(size, share * k2) else (low, size)
        found.append(low)
    pairs = ", ".join(f"{k1:.2g} at ε = {share:g} k₂" for k1, share in zip(found, SHARES_OF_K2, strict=True))
    text = (
        f"at A = {A:g} and k₃ = {DISTANCE:g}, k₂(ε) = {k2:.3g}, and k₁ is {pairs}; the distance is below k₃ "
        f"for {AFTER} periods after all starts tried, with errors in {len(_directions())} directions of (ξ, ξ', τ) and "
        f"of sizes ‖ΔX₀‖ + |Δt₀| from {SIZES[0]:.2g} to k₁"
    )
    return Outcome(text, {"k2": k2, "k1": found, "share": SHARES_OF_K2}, when(min(found) > 0))


def _directions() -> list[dict[str, float]]:
    """Return errors of the start with ‖ΔX₀‖ + |Δt₀| = 1: {"xi0": Δξ, "dxi0": Δξ', "tau0": Δτ}.

    ‖ΔX₀‖ is the Euclidean norm of (Δξ, Δξ'). The part of Δτ is 0, ±1/2 or ±1, and (Δξ, Δξ') has eight angles.
    """
    of_state = [
        {"xi0": (1 - abs(tau)) * math.cos(angle), "dxi0": (1 - abs(tau)) * math.sin(angle), "tau0": tau}
        for tau in (-0.5, 0.0, 0.5)
        for angle in np.arange(8) * math.pi / 4
    ]
    return [*of_state, *({"xi0": 0.0, "dxi0": 0.0, "tau0": tau} for tau in (-1.0, 1.0))]


class _Pairs(NamedTuple):
    """Limits in ε and in Δτ as velocity amplitudes, at the points at which both limits are known."""

    A: np.ndarray
    B: np.ndarray
    n: np.ndarray
    eps: np.ndarray
    dtau: np.ndarray

    @property
    def ratio(self) -> np.ndarray:
        return self.dtau / self.eps

    @property
    def alike(self) -> np.ndarray:
        return (self.ratio >= 1 / ALIKE) & (self.ratio <= ALIKE)


@functools.cache
def _over_A() -> _Pairs:
    return _both(A=OVER_A)


def _both(**axes: Any) -> _Pairs:
    """Return the limits in ε and in Δτ at all those points of `axes` at which both limits are known."""
    pairs = zip(limits("eps", **axes), limits("dtau", **axes), strict=True)
    known = [(e.A, e.B, e.n, e.velocity, d.velocity) for e, d in pairs if math.isfinite(e.velocity * d.velocity)]
    if not known:
        raise NotApplicable("there is no point at which both limits, in ε and in Δτ, are known")
    return _Pairs(*map(np.array, zip(*known, strict=True)))


def _repeats(section: np.ndarray, longest: int) -> int:
    """Return the smallest number of periods after which section points repeat within rounding; 0 if there is none.

    `structure.period` finds no period for a motion under a small disturbance, because its section points are so close.
    """
    return next((n for n in range(1, longest + 1) if np.abs(section[n:] - section[:-n]).max() < 1e-9), 0)


def _seconds_per_period(arguments: dict[str, Any]) -> float:
    """Return the computing time per period in seconds on one thread, the least of three runs.

    With a step of the grid the obvious loop is timed, else a certified sweep. A first run compiles and is not counted.
    """
    compute = obvious_loop.sweep if "dtau" in arguments else functools.partial(vd.sweep, transient=0, threads=1)
    compute(**arguments | {"periods": 1})
    spent = timeit.repeat(lambda: compute(**arguments), timer=time.process_time, repeat=3, number=1)
    return min(spent) / len(arguments["A"]) / arguments["periods"]


def _time(seconds: float) -> str:
    """Return a time in µs as text with one significant digit, because times differ between runs."""
    return f"{float(f'{1e6 * seconds:.0e}'):g} µs"
