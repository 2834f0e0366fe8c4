"""Express the limits of five disturbances as velocities, over the amplitude A.

`vd.limit` finds the limits in ε (a force) and Δτ (late switches). This program finds the limits of other methods by the
same criterion: in 1500 periods, after a transient of 1000, the main impacts have the gaps and the order of the
undisturbed orbit, which are its structure (docs/stability.md). Only one of the five disturbances acts at a time. The
velocity V of a disturbance is the change of ξ' at a switch:

ε    The relative amplitude of the fast disturbance. V = εηA is the amplitude of its velocity.
Δτ   The step of a time grid. V = Δτ, because a switch is late by up to Δτ, and accelerations are of the order 1.
h    The step of the Moreau-Jean method. V = h, because this step delays a switch by up to h, as Δτ does.
v_s  The width of smoothed friction. V = v_s, the largest velocity at which the mass creeps instead of sticking.
k    The stiffness of a spring in place of the obstacle. V is the velocity that the mass lacks after an impact on the
     spring, compared with a plastic impact. A mass of speed 1 hits the obstacle under an acceleration of 1 away from
     it. After a plastic impact the velocity grows from 0, and is t at the time t. From the spring with critical damping
     the mass separates at t = s/√k, where exp s = 1 + s + s √k, with the velocity (s - 1 + t) exp(-s). V is the
     difference of the two velocities at this t, about 0.9 to 0.95 t. V is of the order 1/√k, the time constant of the
     contact, times a logarithm.

    python -m benchmarks.ruler                    # measure, write ruler.json, draw, fill in the table (an hour)
    python -m benchmarks.ruler --only v_s k       # measure only these again, keep the other results
    python -m benchmarks.ruler --draw             # draw the stored results, fill in the table
"""

import json
import math
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import vibrodrive as vd
from benchmarks import ruler_motions
from benchmarks.common import TWO_PI, environment, figure, look, parser, say
from benchmarks.switches.model import Point
from benchmarks.tables import ROOT, number, show, table
from vibrodrive.batch.trajectory import MAIN_IMPACT
from vibrodrive.cli.plain import plain
from vibrodrive.jit.slices import Halt
from vibrodrive.model.names import ETA
from vibrodrive.model.plan import make_plan
from vibrodrive.stability.evaluate import Evaluator
from vibrodrive.stability.limit import LimitSearch, plan_limits
from vibrodrive.stability.limit_search import GRIDS, Band, Grid, search_band
from vibrodrive.stability.main_impacts import impact_cycle
from vibrodrive.stability.structure import ReferenceOrbit, keeps

PAGE, PICTURE = ROOT / "benchmarks" / "LIMITS.md", ROOT / "docs" / "ruler.png"

TRANSIENT, PERIODS, B = 1000, 1500, 0.1
PAPER = 3.04
AMPLITUDES = tuple(round(3.0 + 0.005 * i, 3) for i in range(51))
THREADS = os.cpu_count() or 1

VELOCITIES = Grid(lambda i: 1e-5 * 1.05**i, 48, 1e-9, 1.0, 8)
"""The values of v_s that are tried."""

CONTACTS = GRIDS["eps"]._replace(value=lambda i: 1e-4 * 1.15**i, floor=1e-9, batch=8)
"""The values of 1/√k that are tried. Successive values have the same ratio as the values of ε."""

STEPS = GRIDS["dtau"]._replace(decade=45, floor=1e-4)
"""The steps h that are tried: the values that `vd.limit` tries for Δτ, down to 1e-4. A motion with h = 1e-5 would take
twenty seconds."""


def velocity_loss(root: float) -> float:
    """Return the velocity that the mass lacks after an impact on a spring with √k = 1/`root`.

    The speed of the impact and the acceleration are 1. The velocity is compared with that after a plastic impact.
    """
    w = 1.0 / root
    low, high = 0.0, 60.0
    for _ in range(80):
        s = 0.5 * (low + high)
        low, high = (s, high) if math.expm1(s) < s * (1.0 + w) else (low, s)
    return s / w - (s - 1.0 + s / w) * math.exp(-s)


class Disturbance(NamedTuple):
    """A disturbance that is not part of `vd.limit`. Its value x is h, v_s or 1/√k. `follow` computes a motion with the
    parameter `argument(x)`; `velocity(x)` is V."""

    follow: Callable[..., int]
    argument: Callable[[float], float]
    grid: Grid
    velocity: Callable[[float], float]


OWN = {
    "h": Disturbance(ruler_motions.stepped, float, STEPS, float),
    "v_s": Disturbance(ruler_motions.creeping, float, VELOCITIES, float),
    "k": Disturbance(ruler_motions.sprung, lambda root: 1.0 / root, CONTACTS, velocity_loss),
}
NAMES = ("eps", "dtau", *OWN)
LABELS = {
    "eps": ("$\\varepsilon$", "force ε sin ητ: V = εηA"),
    "dtau": ("$\\Delta\\tau$", "switches on a grid: V = Δτ"),
    "h": ("$h$", "Moreau–Jean time-stepping: V = h"),
    "v_s": ("$v_s$", "smoothed friction: V = v_s"),
    "k": ("$1/\\sqrt{k}$", "spring for obstacle: V lost in an impact"),
}


# -- measuring ---------------------------------------------------------------------------------------------


def main_impacts(way: Disturbance, A: float, value: float) -> np.ndarray | None:
    """Return the main impacts under one disturbance after the transient, or None if the computation was stopped."""
    found = np.empty((2 * PERIODS, 2))
    point = Point(A, B, 0.0, ETA)
    count = way.follow(point, way.argument(value), TRANSIENT * TWO_PI, (TRANSIENT + PERIODS) * TWO_PI, found)
    if count < 0:
        return None
    impacts = np.zeros(count, MAIN_IMPACT)
    impacts["period"] = np.floor(found[:count, 0] / TWO_PI)
    impacts["phase"] = found[:count, 0] - TWO_PI * impacts["period"]
    impacts["speed"] = found[:count, 1]
    return impacts


def kept(way: Disturbance, A: float, base: ReferenceOrbit, value: float) -> bool:
    """Return True if the motion under one disturbance keeps the structure of the undisturbed motion."""
    impacts = main_impacts(way, A, value)
    return impacts is not None and keeps(base, np.zeros((PERIODS, 2)), impacts)


def repeats(name: str, A: float, value: float) -> bool:
    """Return True if the motion under one disturbance is periodic."""
    if name in OWN:
        impacts = main_impacts(OWN[name], A, value)
    else:
        disturbed: dict[str, Any] = {"eps": value} if name == "eps" else {"dtau": value, "method": "fixed"}
        impacts = vd.simulate(A, transient=TRANSIENT, periods=PERIODS, **disturbed).impacts
    return impacts is not None and impact_cycle(impacts) is not None


def band(way: Disturbance, A: float, base: ReferenceOrbit, pool: ThreadPoolExecutor) -> Band:
    """Return the Band (stability/limit_search.py) of the values that keep the structure. The search is that of
    `vd.limit`."""
    search = search_band(way.grid)
    wanted = next(search)
    while True:
        try:
            wanted = search.send(np.array(list(pool.map(lambda value: kept(way, A, base, value), wanted.tolist()))))
        except StopIteration as end:
            return end.value


def orbits(amplitudes: Iterable[float]) -> list[ReferenceOrbit | None]:
    """Return the undisturbed orbit at each A, or None if the motion is not periodic."""
    plan = make_plan({"A": list(amplitudes), "eps": 1e-3, "transient": TRANSIENT, "periods": PERIODS})
    with Evaluator(plan, "eps", THREADS, Halt()) as evaluator:
        found = evaluator.undisturbed(np.arange(plan.n_points))
    return [one if isinstance(one, ReferenceOrbit) else None for one in found]


def searched(name: str, amplitudes: tuple[float, ...], bases: list[ReferenceOrbit | None]) -> list[dict[str, Any]]:
    """Return a dictionary for each A: `k2` (the limit in one disturbance), `velocity` (V of k2) and further results.

    A dictionary is empty if there is no orbit or, for a disturbance of OWN, if the least value tried loses the
    structure.
    """
    rows: list[dict[str, Any]] = [{} for _ in amplitudes]
    fields = ("kept_below", "last_kept", "share_kept", "searched_to")
    if name not in OWN:
        plan = plan_limits({"A": amplitudes, "transient": TRANSIENT, "periods": PERIODS}, name)
        for i, limit in LimitSearch(plan).run():
            if limit.n:
                rows[i] = {"k2": limit.k2, **{f: getattr(limit, f) for f in fields}}
                rows[i] |= {"velocity": limit.velocity, "velocity_last": limit.velocity_last}
        return rows
    way = OWN[name]
    with ThreadPoolExecutor(THREADS) as pool:
        for i, (A, base) in enumerate(zip(amplitudes, bases, strict=True)):
            if base is None:
                continue
            b = band(way, A, base, pool)
            if b.kept_below == 0.0:
                continue
            rows[i] = {"k2": b.lost, **{f: getattr(b, f) for f in fields}}
            ends = zip(("velocity", "velocity_last"), (b.lost, b.last_kept), strict=True)
            rows[i] |= {key: way.velocity(x) if 0.0 < x < math.inf else x for key, x in ends}
            say(f"A = {A:g}, {name}: first lost at {b.lost:.3g}, last kept at {b.last_kept:.3g}")
    return rows


def measured(name: str, amplitudes: tuple[float, ...], bases: list[ReferenceOrbit | None]) -> list[dict[str, Any]]:
    """Return the dictionaries of `searched`. If k2 is finite, add the key `repeats_at_half`: True if the motion at half
    the limit is periodic."""
    rows = searched(name, amplitudes, bases)
    for A, row in zip(amplitudes, rows, strict=True):
        if row and math.isfinite(row["k2"]):
            row["repeats_at_half"] = repeats(name, A, 0.5 * row["k2"])
    return rows


def measure(path: Path, names: Iterable[str], amplitudes: tuple[float, ...]) -> None:
    """Measure the named disturbances, and write the file after each. The other disturbances in the file remain."""
    data = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    bases = orbits(amplitudes)
    if data.get("A") != list(amplitudes):
        data = {"limits": {}}
    data |= {"transient": TRANSIENT, "periods": PERIODS, "B": B, "eta": ETA, "A": amplitudes}
    data["n"] = [base.n if base is not None else 0 for base in bases]
    for name in names:
        data["limits"][name] = {"environment": environment(), "points": measured(name, amplitudes, bases)}
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(plain(data), indent=1, allow_nan=False) + "\n", encoding="utf-8")


# -- showing -----------------------------------------------------------------------------------------------


def velocities(data: dict[str, Any], name: str, key: str = "velocity") -> np.ndarray:
    """Return the limits of one disturbance over A as velocities, with NaN where there is no limit."""
    values = [row.get(key) for row in data["limits"][name]["points"]]
    return np.array([math.nan if v is None else v for v in values])


def ratios(data: dict[str, Any], name: str) -> np.ndarray:
    """Return the ratio of V of one disturbance to V of Δτ, for each A at which both are known."""
    both = velocities(data, name) / velocities(data, "dtau")
    return both[np.isfinite(both)]


def rates(data: dict[str, Any]) -> str:
    """Return the sentence about the exchange rates: values of the other disturbances that have the effect of Δτ = x."""
    median = {name: number(float(np.median(ratios(data, name)))) for name in NAMES}
    roots, x = np.geomspace(1e-6, 1.0, 2000), 0.01
    root = np.interp(float(median["k"]) * x, [velocity_loss(r) for r in roots], roots)
    return (
        f"Exchange rates, from the medians over A: Δτ = x has the effect of ε = {median['eps']} x/(ηA), h = "
        f"{median['h']} x, v_s = {median['v_s']} x, and a spring with V = {median['k']} x (k = {number(root**-2)} for "
        f"x = {x:g})."
    )


def markdown(data: dict[str, Any]) -> str:
    """Return the table: limits at the paper's A, and ratios of the velocities over all A."""
    head = [
        "disturbance",
        f"first lost at A = {PAPER}",
        "V there",
        "V last kept with the next lower",
        "V / V(Δτ) over A: median",
    ]
    head += ["quartiles", "least … largest", "within a factor of 3", "repeats at half the limit"]
    rows, at = [], data["A"].index(PAPER)
    for name in (n for n in NAMES if n in data["limits"]):
        points, over = data["limits"][name]["points"], ratios(data, name)
        row, (low, middle, high) = points[at], np.percentile(over, (25, 50, 75))
        first = f"k = {number(row['k2'] ** -2)}" if name == "k" else number(row["k2"])
        spread = [number(middle), f"{number(low)} … {number(high)}", f"{number(over.min())} … {number(over.max())}"]
        near = int(np.count_nonzero((over > 1 / 3) & (over < 3)))
        same = [point["repeats_at_half"] for point in points if "repeats_at_half" in point]
        counts = [f"{near} of {len(over)}", f"{sum(same)} of {len(same)}"]
        rows.append([LABELS[name][1], first, number(row["velocity"]), number(row["velocity_last"]), *spread, *counts])
    return f"{table(head, rows)}\n\n{rates(data)}"


def draw(data: dict[str, Any]) -> Any:
    """Return the chart: limits over A as velocities, and their ratios to the limit in Δτ."""
    fig, axes = figure(6.3, 6.8, rows=2)
    fig.suptitle("Limits of five disturbances, as velocities $V$", fontsize=10)
    A, scale = np.array(data["A"]), velocities(data, "dtau")
    for i, name in enumerate(n for n in NAMES if n in data["limits"]):
        V, last = velocities(data, name), velocities(data, name, "velocity_last")
        style = look(i, name in ("eps", "dtau")) | {"linewidth": 0.7, "markersize": 3.5}
        symbol, meaning = LABELS[name]
        axes[0, 0].semilogy(A, V, label=f"{symbol}, {meaning.split(':')[0]}", **style)
        axes[0, 0].vlines(A, V, np.maximum(V, last), color=style["color"], linewidth=0.5)
        gaps = A[np.isnan(V)]
        if len(gaps):
            least = OWN[name].velocity(OWN[name].grid.floor)
            below = f"{symbol}: lost at all $V$ tried ($V$ ≥ {least:g})"
            axes[0, 0].plot(gaps, np.full(len(gaps), least), "x", color=style["color"], ms=5, label=below)
        if name != "dtau":
            axes[1, 0].semilogy(A, V / scale, **style)
    axes[0, 0].vlines([], [], [], color="black", linewidth=0.5, label="up to the last kept with the next lower")
    factor = axes[1, 0].axhspan(1 / 3, 3, color="0.92", zorder=0, label="within a factor of 3")
    axes[1, 0].axhline(1.0, color="black", linewidth=0.6)
    for ax in axes[:, 0]:
        ax.axvline(PAPER, color="0.7", linewidth=0.6, zorder=0, label=f"the paper's $A$ = {PAPER}")
        ax.set_xlim(A[0] - 0.003, A[-1] + 0.003)
    axes[0, 0].set_ylabel("$V$ that first changes the order of impacts")
    axes[1, 0].set_ylabel(r"that $V$, over that of $\Delta\tau$")
    axes[1, 0].set_xlabel("$A$")
    axes[0, 0].legend(loc="lower left", labelspacing=0.25)
    axes[1, 0].legend(handles=[factor], loc="upper center")
    return fig


def main() -> None:
    """Measure the limits, or read stored limits. Then draw the chart and write the table."""
    known = parser(__doc__, draws=True)
    known.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, help="disturbances to measure")
    known.add_argument(
        "--quick", action="store_true", help=f"measure at A = {PAPER} and the ends of the range only; draw nothing"
    )
    options = known.parse_args()
    path = options.output / "ruler.json"
    if not options.draw:
        measure(path, options.only, (3.0, PAPER, 3.25) if options.quick else AMPLITUDES)
    data = json.loads(path.read_text(encoding="utf-8"))
    if options.quick:
        print(markdown(data))
    else:
        show(PAGE, {"ruler": markdown(data)}, PICTURE, draw(data))


if __name__ == "__main__":
    main()
