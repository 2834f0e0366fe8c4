"""Error and cost of every method of locating a switch, compared with a reference of 50 digits.

The columns of the figure are A = 1.5 and A = 3.04 without a disturbance, and A = 3.04 with ε = 2e-4. Errors are the
largest error of a switching time over 20 periods from rest, and the distance ρ of 1000 section points from the orbit
without a disturbance. Costs are CPU time per period on one thread, without compilation, and evaluations of switching
functions (or of the equations of motion) per period. A setting that missed or invented a switch is drawn as a cross at
the top of the figure, at its cost. The JSON contains the number of missed and invented switches.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.common import (
    TWO_PI,
    Truth,
    arguments,
    figure,
    look,
    orbit,
    paired,
    rho,
    say,
    switch_error,
    truth,
    write,
)
from benchmarks.peers import certified_scalar, heyoka_events, literal_scan, rk4, scan_newton, scipy_ivp
from benchmarks.peers.record import Case, Run, Unavailable
from vibrodrive.model.plain import plain

PERIODS = 20
SECTION_PHASE = 2.0  # the mass slides at this phase in both orbits; at phase 0 it rests, and no method has an error
UNUSUAL, SECTIONS = 400, 1000
TIMED, AFFORDED = 0.1, 15.0  # seconds: one measurement; limit of a long run for ρ
STEPS_OBVIOUS = 1e8  # limit for the obvious loop


@dataclass(frozen=True)
class Scene:
    """One column of the figure. n: period of the stable orbit, 0 if there is none to which ρ could refer."""

    A: float
    eps: float
    n: int

    @property
    def title(self) -> str:
        return f"$A = {self.A:g}$, " + ("$\\varepsilon = 0$" if self.eps == 0 else f"$\\varepsilon = {self.eps:g}$")


SCENES = (Scene(1.5, 0.0, 1), Scene(3.04, 0.0, 2), Scene(3.04, 2e-4, 0))


@dataclass(frozen=True)
class Point:
    """One setting of one method in one scene. Errors in τ and in the section; None: not measured."""

    A: float
    eps: float
    family: str
    setting: str
    ours: bool
    seconds: float
    evaluations: float | None
    error: float | None
    wrong: int | None
    switches: int
    rho: float | None
    notes: tuple[str, ...] = ()


def evaluations(t: Any, grid_points: float | None) -> float | None:
    """Return the evaluations per period. If they are not counted, return those of a literal scan, `grid_points`."""
    counted = getattr(t, "evaluations", None)
    return counted / PERIODS if counted is not None else grid_points


def our_point(scene: Scene, family: str, setting: str, repeats: int, **method: Any) -> Point:
    """Measure one setting of `vd.simulate`."""
    base = {"A": scene.A, "eps": scene.eps, **method}
    literal = method.get("scan") == "literal"
    steps = TWO_PI / method["dtau"] if literal else 1.0
    true = truth(scene.A, scene.eps, PERIODS)
    t = vd.simulate(**base, transient=0, periods=PERIODS)
    s = t.switches
    error = switch_error(true, s["period"], s["phase"], s["before"], s["after"])
    start = time.process_time()
    vd.simulate(**base, transient=0, periods=PERIODS)  # for a single period the call itself would dominate
    once = (time.process_time() - start) / PERIODS
    timed: dict[str, Any] = {"transient": 0, "periods": int(np.clip(TIMED / once, 1, 2000))}
    timing = paired({"": lambda: vd.simulate(**base, **timed)}, repeats)[""]
    seconds = timing.seconds / timed["periods"]
    far = None
    if scene.n and seconds * (UNUSUAL + SECTIONS) <= AFFORDED:
        long = vd.simulate(**base, transient=UNUSUAL, periods=SECTIONS, section_phase=SECTION_PHASE)
        far = rho(long.section, orbit(scene.A, scene.n, SECTION_PHASE))
    return Point(
        scene.A, scene.eps, family, setting, True, seconds,
        evaluations(t, steps if literal else None),
        plain(error.largest), error.wrong, error.of, plain(far),
    )  # fmt: skip


def batched_point(scene: Scene, repeats: int) -> Point:
    """Measure `certified` in a sweep of 1024 neighbouring points: the same bits, with the cost of a batch."""
    A = scene.A + 1e-9 * np.arange(1024)
    run: dict[str, Any] = {
        "A": A, "eps": scene.eps, "method": "certified", "transient": 100, "periods": 100, "threads": 1,
    }  # fmt: skip
    timing = paired({"": lambda: vd.sweep(**run)}, repeats)[""]
    alone = our_point(scene, "", "", 1, method="certified")
    return Point(
        scene.A, scene.eps, "certified, batched", "1024 trajectories", True, timing.seconds / (len(A) * 200),
        alone.evaluations, alone.error, alone.wrong, alone.switches, alone.rho,
    )  # fmt: skip


def our_points(scene: Scene, quick: bool) -> Iterable[Point]:
    repeats = 1 if quick else 5
    steps = (0.3, 0.01, 1e-3) if quick else (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 1e-4, 1e-5, 1e-6)
    for dtau in steps:
        for scan in ("literal", "skip"):
            setting = {"method": "fixed", "dtau": dtau, "scan": scan}
            yield our_point(scene, f"fixed, {scan}", f"Δτ = {dtau:g}", repeats, **setting)
    for dtau in steps[1:-1]:
        for scan in ("literal", "skip"):
            setting = {"method": "muller", "dtau": dtau, "tol": 1e-7, "scan": scan}
            yield our_point(scene, f"Muller, {scan}", f"Δτ = {dtau:g}, tol = 1e-07", repeats, **setting)
    for tol in (1e-3, 1e-7) if quick else (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12):
        dtau = 1e-3 if scene.eps == 0 else 1e-4
        setting = {"method": "muller", "dtau": dtau, "tol": tol, "scan": "skip"}
        yield our_point(scene, "Muller, skip, over tol", f"Δτ = {dtau:g}, tol = {tol:g}", repeats, **setting)
    yield our_point(scene, "certified", "", repeats, method="certified")
    yield batched_point(scene, repeats)


def peer_point(
    scene: Scene, family: str, setting: str, run: Callable[[Case], Run], true: Truth, seconds_allowed: float
) -> Point:
    """Measure one setting of a peer. ρ is omitted if its long run would take more than `seconds_allowed`."""
    short = run(Case(scene.A, scene.eps, periods=PERIODS))
    error = switch_error(true, short.period, short.phase, short.before, short.after)
    far, seconds, notes = None, short.seconds, short.notes
    if scene.n and short.seconds * (UNUSUAL + SECTIONS) <= seconds_allowed:
        case = Case(scene.A, transient=UNUSUAL, periods=SECTIONS, section_phase=SECTION_PHASE)
        long = run(case)
        far, seconds = rho(long.section, orbit(scene.A, scene.n, SECTION_PHASE)), long.seconds
        notes = long.notes
    return Point(
        scene.A, scene.eps, family, setting, False, seconds, short.evaluations, plain(error.largest),
        error.wrong, error.of, plain(far), notes,
    )  # fmt: skip


def peers(scene: Scene, quick: bool) -> Iterable[tuple[str, str, Callable[[Case], Run]]]:
    """Yield (family, setting, function that runs it) of every peer at every setting."""
    disturbed = scene.eps > 0.0
    yield certified_scalar.NAME, "", certified_scalar.run
    scans = (0.03, 0.01, 3e-3, 1e-3, 3e-4) if disturbed else (1.0, 0.3, 0.1, 0.01)
    for step in scans[-2:] if quick else scans:
        yield scan_newton.NAME, f"Δτ = {step:g}", partial(scan_newton.run, step=step)
    for step in (1e-2,) if quick else (1e-1, 1e-2, 1e-3, 1e-4):
        if TWO_PI / step * PERIODS <= STEPS_OBVIOUS:
            yield "obvious loop, fixed", f"Δτ = {step:g}", partial(literal_scan.run_fixed, step=step)
            yield "obvious loop, Muller", f"Δτ = {step:g}", partial(literal_scan.run_muller, step=step)
    for step in (1e-2,) if quick else (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 1e-4):
        yield rk4.NAME, f"Δτ = {step:g}", partial(rk4.run, step=step)
    for tol in (1e-16,) if quick else (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14, 2.2e-16):
        yield heyoka_events.NAME, f"tol = {tol:g}", partial(heyoka_events.run, tol=tol)
    for rtol in (1e-8,) if quick else (1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 3e-14):
        yield scipy_ivp.NAME, f"rtol = {rtol:g}", partial(scipy_ivp.run, rtol=rtol, atol=1e-2 * rtol)


def measure(quick: bool) -> tuple[list[Point], list[str]]:
    """Return all points, and the families of the peers that are not installed."""
    points: list[Point] = []
    missing: list[str] = []
    for scene in SCENES:
        start = time.perf_counter()
        points.extend(our_points(scene, quick))
        true = truth(scene.A, scene.eps, PERIODS)
        for family, setting, run in peers(scene, quick):
            if family in missing:
                continue
            try:
                points.append(peer_point(scene, family, setting, run, true, 1.0 if quick else AFFORDED))
            except Unavailable as why:
                missing.append(family)
                say(f"{family} is left out: {why}")
        say(f"A = {scene.A:g}, ε = {scene.eps:g}: {time.perf_counter() - start:.0f} s")
    return points, missing


ROWS = (
    ("seconds", "error", "CPU time a period (s)", r"largest error of a switching time"),
    ("evaluations", "error", "evaluations a period", r"largest error of a switching time"),
    ("seconds", "rho", "CPU time a period (s)", r"$\rho$ over 1000 periods"),
)


def draw(points: list[Point]):
    """Draw rows: error over time, error over evaluations, ρ over time; the free corner contains the legend."""
    fig, axes = figure(10.0, 9.6, columns=3, rows=3)
    families = list(dict.fromkeys(p.family for p in points))
    styles = {f: look(k, next(p.ours for p in points if p.family == f)) for k, f in enumerate(families)}
    floor, wrong = 1e-17, 1e2
    for row, (cost, error, xlabel, ylabel) in enumerate(ROWS):
        for column, scene in enumerate(SCENES):
            ax = axes[row, column]
            if error == "rho" and not scene.n:
                ax.set_axis_off()
                handles, labels = axes[0, column].get_legend_handles_labels()
                ax.legend(handles, labels, loc="center", title="× at the top: missed or wrong switches")
                continue
            for family in families:
                here = [
                    p
                    for p in points
                    if (p.A, p.eps, p.family) == (scene.A, scene.eps, family)
                    and getattr(p, error) is not None
                    and getattr(p, cost) is not None
                ]
                right = [p for p in here if not p.wrong]
                x = [getattr(p, cost) for p in right]
                ax.loglog(x, [max(getattr(p, error), floor) for p in right], label=family, **styles[family])
                x = [getattr(p, cost) for p in here if p.wrong]
                ax.plot(x, [wrong] * len(x), "x", color=styles[family]["color"], markersize=6)
            ax.set_xlabel(xlabel)
            if column == 0:
                ax.set_ylabel(ylabel)
            if row == 0:
                ax.set_title(scene.title)
    return fig


def summary(points: list[Point]) -> list[dict[str, Any]]:
    """Return for each scene and family the cheapest setting whose error is within 10 times the smallest error."""
    rows = []
    for scene in SCENES:
        for family in dict.fromkeys(p.family for p in points):
            here = [p for p in points if (p.A, p.eps, p.family) == (scene.A, scene.eps, family)]
            if not here:
                continue
            fewest = min(p.wrong for p in here if p.wrong is not None)
            right = [(p.error, p) for p in here if p.wrong == fewest and p.error is not None]
            least = min((error for error, _ in right), default=math.inf)
            good = [p for error, p in right if error <= max(10.0 * least, 1e-13)]
            if good:
                rows.append(asdict(min(good, key=lambda p: p.seconds)))
    return rows


def main() -> None:
    options = arguments(__doc__)
    points, missing = measure(options.quick)
    data = {
        "periods": PERIODS,
        "rho_periods": SECTIONS,
        "points": [asdict(p) for p in points],
        "best": summary(points),
        "missing": missing,
    }
    write("work_precision", data, draw(points), options.output)


if __name__ == "__main__":
    main()
