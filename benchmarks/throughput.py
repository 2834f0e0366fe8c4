"""Throughput: excitation periods per second of a sweep over A = 3…3.25, compared with other methods.

All comparisons use the same sweep. Certified switching in batches is compared with one motion at a time, with solvers
of the set of switches (benchmarks/switches): hand-written Numba, heyoka and scipy, with the setting of the paper
(Δτ = 1e-5, Muller to 1e-7), and with the obvious loop, which visits every grid point. All programs use one thread. A
last measurement of certified switching uses all threads.

The first switches of every other program are compared with those of certified switching, so that no program is fast
only because it is wrong. If the state of a certified motion at ε = 0 repeats bit for bit, the rest of the motion is
copied. Therefore the cost of computation is measured with motions that do not repeat within the recorded periods.

The results of other vector instructions (benchmarks/common.py) remain in the file, so that the tables show both.
"""

import importlib
import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks import obvious_loop
from benchmarks.common import TWO_PI, arguments, environment, figure, paired, ratio, say, vectors, write
from benchmarks.switches import solvers
from benchmarks.switches.model import Point

RANGE = (3.0, 3.25)
EPS = (0.0, 2e-4)
POINTS, PERIODS = 1000, 500
RANGE_COMPUTED = (3.0525, 3.06)
COMPUTED, ONE_BY_ONE = "certified, where nothing repeats", "certified, one motion at a time"
"""At the A of RANGE_COMPUTED motions are stable and never rest. They approach their orbit so slowly that no motion
repeats bit for bit within PERIODS periods."""


def rivals(eps: float) -> dict[str, tuple[str, dict[str, Any], int, int]]:
    """Return (module, setting, number of motions, number of periods) by name, for each solver of the set that takes
    part.

    Each computation takes some tenths of a second. Each setting is the fastest right setting: the step of the scan is
    below the distance of the closest pair of zeros.
    """
    if eps == 0.0:
        return {
            "scan + Newton": ("scan_newton", {"step": 0.3}, POINTS, PERIODS),
            "heyoka": ("heyoka_events", {"tol": 2.2e-16}, 50, 100),
            "scipy solve_ivp": ("scipy_ivp", {"method": "DOP853", "rtol": 1e-10}, 10, 40),
        }
    return {
        "scan + Newton": ("scan_newton", {"step": 3e-4}, 10, 50),
        "heyoka": ("heyoka_events", {"tol": 2.2e-16}, 50, 20),
        "scipy solve_ivp": ("scipy_ivp", {"method": "LSODA", "rtol": 1e-10}, 10, 3),
    }


def values(n: int) -> np.ndarray:
    """Return about n of the POINTS values of A of the sweep; slow contestants use few values."""
    return np.linspace(*RANGE, POINTS)[:: max(1, POINTS // n)]


@dataclass(frozen=True, eq=False)
class Contestant:
    """A sweep over `A`: one motion for each value, from rest, over `periods` periods.

    `work` computes the sweep and returns switches or section points.
    """

    A: np.ndarray
    periods: int
    work: Callable[[np.ndarray, int], Any]

    def __call__(self) -> Any:
        return self.work(self.A, self.periods)

    @property
    def total(self) -> int:
        return len(self.A) * self.periods


def ours(**settings: Any) -> Callable[[np.ndarray, int], Any]:
    """Return the `work` of a Contestant: a sweep of the package that records section points."""
    settings = {"threads": 1, **settings}
    return lambda A, periods: vd.sweep(A=A, transient=0, periods=periods, **settings).section


def one_by_one(eps: float) -> Callable[[np.ndarray, int], Any]:
    """Return the `work` of a Contestant: the package computes one motion at a time."""
    return lambda A, periods: [vd.simulate(a, eps=eps, transient=0, periods=periods).section for a in A]


def by_solver(events: Callable[..., Any], eps: float, **setting: Any) -> Callable[[np.ndarray, int], Any]:
    """Return the `work` of a Contestant: a solver of the set of switches computes one motion at a time."""

    def work(A: np.ndarray, periods: int) -> Any:
        return [events((0.0, 0.0, 0.0, TWO_PI * periods), Point(a, 0.1, eps, vd.ETA), **setting) for a in A]

    return work


def contestants(eps: float, quick: bool) -> tuple[dict[str, Contestant], list[str]]:
    """Return all contestants, and the names of missing programs. Each contestant runs some tenths of a second."""
    n, p = (100, 100) if quick else (POINTS, PERIODS)
    paper = {"method": "muller", "dtau": 1e-5, "tol": 1e-7}
    few = values(50)
    everyone = {
        "certified": Contestant(values(n), p, ours(eps=eps, method="certified")),
        ONE_BY_ONE: Contestant(few, p, one_by_one(eps)),
        "paper's setting": Contestant(values(n), p, ours(eps=eps, **paper)),
        "fixed Δτ = 0.1": Contestant(values(n), p, ours(eps=eps, method="fixed", dtau=0.1)),
        "obvious loop, fixed Δτ = 1e-4": Contestant(
            values(10)[:2], 4 if quick else 20, by_solver(obvious_loop.events, eps, step=1e-4)
        ),
    }
    if eps == 0.0:
        everyone[COMPUTED] = Contestant(np.linspace(*RANGE_COMPUTED, n), p, ours(eps=eps, method="certified"))
    missing = []
    for name, (module, setting, points, periods) in rivals(eps).items():
        try:
            solver = importlib.import_module(f"{solvers.__name__}.{module}")
        except ImportError as why:
            missing.append(name)
            say(f"{name} is left out: {why}")
            continue
        everyone[name] = Contestant(values(points), periods, by_solver(solver.events, eps, **setting))
    return everyone, missing


def off(contestant: Contestant, eps: float) -> float:
    """Return the share of motions with a wrong switch in the first 10 periods: a state differs from that of the
    certified motion, or a τ differs by more than 1e-3.

    Only the first periods are compared, because many of these motions are irregular, and any two computations of an
    irregular motion diverge. The first periods are sufficient to detect a missed switch.
    """
    first, wrong = min(contestant.periods, 10), 0
    for a, found in zip(contestant.A, contestant.work(contestant.A, first), strict=True):
        s = vd.simulate(a, eps=eps, transient=0, periods=first).switches
        true = [(TWO_PI * k + phase, *kind) for k, phase, *kind in s[["period", "phase", "before", "after"]].tolist()]
        same = [t[1:] for t in true] == [f[1:] for f in found]
        wrong += not same or any(abs(t[0] - f[0]) > 1e-3 for t, f in zip(true, found, strict=True))
    return wrong / len(contestant.A)


def one_thread(eps: float, quick: bool) -> dict[str, Any]:
    """Return the periods per second and the ratios of all contestants at this ε."""
    everyone, missing = contestants(eps, quick)
    times = paired(everyone, 3 if quick else 5)
    rate = {name: everyone[name].total / t.seconds for name, t in times.items()}

    def times_faster(fast: str, slow: str) -> float:
        return ratio(times[slow], times[fast], everyone[slow].total, everyone[fast].total)

    others = [ONE_BY_ONE, *(name for name in rivals(eps) if name in times)]
    ratios = {name: times_faster("certified", name) for name in others}
    steps = TWO_PI / 1e-4
    computed = COMPUTED if COMPUTED in rate else "certified"
    for name, value in rate.items():
        say(f"ε = {eps:g}: {name}: {value:.4g} periods a second")
    return {
        "eps": eps,
        "periods_per_second": rate,
        "certified_over": ratios,
        "obvious_ns_per_step": 1e9 / (rate["obvious loop, fixed Δτ = 1e-4"] * steps),
        "paper_over_certified": times_faster("certified", "paper's setting"),
        "computed_over_one_at_a_time": times_faster(computed, ONE_BY_ONE),
        "wrong_share": {name: off(everyone[name], eps) for name in others[1:]},
        "missing": missing,
    }


def threads(quick: bool, busy: float) -> dict[str, Any]:
    """Return the speed-up of a certified sweep with several ε by all threads, as a ratio of wall times. `busy` is the
    share of busy cores before the measurement (busy_share), and is stored, too."""
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
    """Return the share of the cores that were busy in the last minute. On a busy machine measured speed-ups are
    unreliable."""
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
    busy, path = busy_share(), options.output / "throughput.json"
    data = {
        "environment": environment(),
        "one_thread": [one_thread(eps, options.quick) for eps in EPS],
        "all_threads": threads(options.quick, busy),
    }
    others = json.loads(path.read_text(encoding="utf-8"))["vectors"] if path.exists() else {}
    write("throughput", {"vectors": others | {vectors(): data}}, draw(data), options.output)


if __name__ == "__main__":
    main()
