"""Throughput: excitation periods per second of a sweep over A = 3…3.25, compared with other methods.

Three comparisons use the same sweep. Certified switching in batches is compared with other programs: certified
switching of one trajectory at a time with sine and cosine of libm, hand-written Numba, heyoka and scipy. The literal
scan is compared with the obvious loop. The setting of the paper (Δτ = 1e-5, Muller to 1e-7) is compared with certified
switching. All programs use one thread. A last measurement of certified switching uses all threads.

The section points of every program are compared with certified section points, so that no program is fast only because
it is wrong. At ε = 0 a certified motion that returns to the same bits is copied from then on. Therefore the cost of
computation is measured on motions that do not return within the record.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.common import TWO_PI, arguments, environment, figure, paired, ratio, say, write
from benchmarks.peers import certified_scalar, heyoka_events, literal_scan, scan_newton, scipy_ivp
from benchmarks.peers.record import Case, Unavailable

RANGE = (3.0, 3.25)
EPS = (0.0, 2e-4)
POINTS, PERIODS = 1000, 500
RANGE_COMPUTED = (3.0525, 3.06)
COMPUTED = "certified, where nothing repeats"
"""Values of A with stable motions that never rest and approach their orbit so slowly that none repeats its bits within
PERIODS periods."""


def values(n: int) -> np.ndarray:
    """Return n values of A: all POINTS of the sweep, or fewer for slow contestants."""
    return np.linspace(*RANGE, POINTS)[:: max(1, POINTS // n)]


@dataclass(frozen=True, eq=False)
class Contestant:
    """A sweep over `A`, each for `periods` periods from rest. It returns the sections (points, periods, 2) or None."""

    A: np.ndarray
    periods: int
    work: Callable[[np.ndarray, int], Any]

    def __call__(self) -> Any:
        return self.work(self.A, self.periods)

    @property
    def total(self) -> int:
        return len(self.A) * self.periods


def ours(**settings: Any) -> Callable[[np.ndarray, int], np.ndarray]:
    settings = {"threads": 1, **settings}
    return lambda A, periods: vd.sweep(A=A, transient=0, periods=periods, **settings).section


def compiled_scalar(eps: float) -> Callable[[np.ndarray, int], np.ndarray]:
    """Return a sweep by the certified kernel, one trajectory at a time."""

    def work(A: np.ndarray, periods: int) -> np.ndarray:
        section = np.empty((len(A), periods, 2))
        points = np.column_stack([A, np.full(len(A), 0.1), np.full(len(A), eps)])
        certified_scalar.sweep(points, vd.ETA, 0, periods, section)
        return section

    return work


def compiled_loop(kernel: Callable[..., Any], eps: float, *parameters: float):
    """Return a sweep that calls a kernel of `event_loop` for each A. Python adds microseconds to milliseconds."""
    none = (np.empty(0, np.int64), np.empty(0), np.empty(0, np.int8), np.empty(0, np.int8))

    def work(A: np.ndarray, periods: int) -> np.ndarray:
        section = np.empty((len(A), periods, 2))
        for k, a in enumerate(A):
            kernel(a, 0.1, eps, vd.ETA, *parameters, 0.0, 0, periods, section[k], *none)
        return section

    return work


def heyoka_sweep(eps: float) -> Callable[[np.ndarray, int], np.ndarray]:
    if heyoka_events.hy is None:
        raise Unavailable("heyoka is not installed")
    integrators = heyoka_events.Integrators(eps > 0.0, 2.2e-16)

    def work(A: np.ndarray, periods: int) -> np.ndarray:
        return np.array([integrators.solve(Case(a, eps, periods=periods))[0].section for a in A])

    return work


def scipy_sweep(eps: float) -> Callable[[np.ndarray, int], np.ndarray]:
    if scipy_ivp.solve_ivp is None:
        raise Unavailable("scipy is not installed")
    method = "LSODA" if eps > 0.0 else "DOP853"

    def work(A: np.ndarray, periods: int) -> np.ndarray:
        solvers = [scipy_ivp.Solver(Case(a, eps, periods=periods), method, 1e-10, 1e-12) for a in A]
        return np.array([solver.section() for solver in solvers])

    return work


def contestants(eps: float, quick: bool) -> tuple[dict[str, Contestant], list[str]]:
    """Return all contestants on one thread, each with work for some tenths of a second."""
    n, p = (100, 100) if quick else (POINTS, PERIODS)
    scan = scan_newton.STEP_DISTURBED if eps > 0.0 else scan_newton.STEP
    paper = {"method": "muller", "dtau": 1e-5, "tol": 1e-7}
    few = values(50)
    literal = literal_scan.kernel_fixed
    everyone = {
        "certified": Contestant(values(n), p, ours(eps=eps, method="certified")),
        certified_scalar.NAME: Contestant(values(n), p, compiled_scalar(eps)),
        "paper's setting, skipping": Contestant(values(n), p, ours(eps=eps, **paper)),
        "paper's setting, literal": Contestant(
            values(10)[:8], 1 if quick else 50, ours(eps=eps, scan="literal", **paper)
        ),
        "fixed Δτ = 0.1, skipping": Contestant(values(n), p, ours(eps=eps, method="fixed", dtau=0.1)),
        "fixed Δτ = 1e-4, literal": Contestant(
            values(10)[:8], 10 if quick else 100, ours(eps=eps, method="fixed", dtau=1e-4, scan="literal")
        ),
        "obvious loop, fixed Δτ = 1e-4": Contestant(
            values(10)[:2], 4 if quick else 20, compiled_loop(literal, eps, 1e-4, 0.0)
        ),
        scan_newton.NAME: Contestant(
            values(n) if eps == 0.0 else few[:10],
            p if eps == 0.0 else 50,
            compiled_loop(scan_newton.kernel, eps, scan, 0.0),
        ),
    }
    if eps == 0.0:
        everyone[COMPUTED] = Contestant(np.linspace(*RANGE_COMPUTED, n), p, ours(eps=eps, method="certified"))
    missing = []
    slow: tuple[tuple[str, Callable[[float], Any], int, int], ...] = (
        (heyoka_events.NAME, heyoka_sweep, 50, 100 if eps == 0.0 else 20),
        (scipy_ivp.NAME, scipy_sweep, 10, 40 if eps == 0.0 else 3),
    )
    for name, make, points, periods in slow:
        try:
            everyone[name] = Contestant(values(points), periods, make(eps))
        except Unavailable as why:
            missing.append(name)
            say(f"{name} is left out: {why}")
    return everyone, missing


def off(contestant: Contestant, eps: float) -> float:
    """Return the share of trajectories whose first 10 section points differ by more than 1e-3 from certified ones.

    Only the first periods are compared, because many of these motions are irregular, and any two computations of an
    irregular motion diverge. A missed switch appears in the first periods.
    """
    first = min(contestant.periods, 10)
    true = vd.sweep(A=contestant.A, eps=eps, transient=0, periods=first, threads=1).section
    got = np.asarray(contestant())[:, :first]
    return float((np.abs(got - true).max(axis=(1, 2)) > 1e-3).mean())


def one_thread(eps: float, quick: bool) -> dict[str, Any]:
    """Return the periods per second and the ratios of all contestants at this ε."""
    everyone, missing = contestants(eps, quick)
    times = paired(everyone, 3 if quick else 7)
    rate = {name: everyone[name].total / t.seconds for name, t in times.items()}

    def times_faster(fast: str, slow: str) -> float:
        return ratio(times[slow], times[fast], everyone[slow].total, everyone[fast].total)

    rivals = certified_scalar.NAME, scan_newton.NAME, heyoka_events.NAME, scipy_ivp.NAME
    ratios = {name: times_faster("certified", name) for name in rivals if name in times}
    steps = TWO_PI / 1e-4
    computed = COMPUTED if COMPUTED in rate else "certified"
    for name, value in rate.items():
        say(f"ε = {eps:g}: {name}: {value:.4g} periods a second")
    return {
        "eps": eps,
        "periods_per_second": rate,
        "certified_over": ratios,
        "literal_over_obvious_loop": times_faster("fixed Δτ = 1e-4, literal", "obvious loop, fixed Δτ = 1e-4"),
        "literal_ns_per_step": 1e9 / (rate["fixed Δτ = 1e-4, literal"] * steps),
        "obvious_ns_per_step": 1e9 / (rate["obvious loop, fixed Δτ = 1e-4"] * steps),
        "paper_over_certified": times_faster("certified", "paper's setting, skipping"),
        "paper_skipping_over_literal": times_faster("paper's setting, skipping", "paper's setting, literal"),
        "computed_over_one_at_a_time": times_faster(computed, certified_scalar.NAME),
        "wrong_share": {name: off(c, eps) for name, c in everyone.items() if "fixed" not in name},
        "missing": missing,
    }


def threads(quick: bool, busy: float) -> dict[str, Any]:
    """Measure the wall time of a certified sweep with several ε, on one thread and on all threads."""
    count = os.cpu_count() or 1
    run: dict[str, Any] = {
        "A": np.linspace(*RANGE, 50 if quick else 500),
        "eps": [0.0, 0.5e-4, 2e-4],
        "transient": 0,
        "periods": 50 if quick else 300,
    }
    times = paired(
        {"one": lambda: vd.sweep(**run, threads=1), "all": lambda: vd.sweep(**run, threads=count)}, 3 if quick else 7
    )
    return {"threads": count, "speed_up": ratio(times["one"], times["all"], wall=True), "busy_before": busy}


def busy_share() -> float:
    """Return the share of the cores busy over the last minute: speed-ups are unreliable on a busy machine."""
    return min(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def draw(data: dict[str, Any]):
    fig, axes = figure(10.5, 4.2, columns=2)
    for ax, at in zip(axes[0], data["one_thread"], strict=True):
        rates = dict(sorted(at["periods_per_second"].items(), key=lambda item: item[1]))
        bars = ax.barh(range(len(rates)), list(rates.values()), color="0.8", edgecolor="black", linewidth=0.6)
        for bar, name in zip(bars, rates, strict=True):
            if name == "certified":
                bar.set_color("black")
        ax.set_xscale("log")
        ax.set_yticks(range(len(rates)), list(rates))
        ax.set_xlabel("excitation periods a second, one thread")
        ax.set_title(f"$A = 3 \\ldots 3.25$, $\\varepsilon = {at['eps']:g}$")
    return fig


def main() -> None:
    options = arguments(__doc__)
    busy = busy_share()
    data = {
        "one_thread": [one_thread(eps, options.quick) for eps in EPS],
        "all_threads": threads(options.quick, busy),
        "cores": environment()["cores"],
    }
    write("throughput", data, draw(data), options.output)


if __name__ == "__main__":
    main()
