"""Examples of each kind of failure: `python -m benchmarks.failures` measures, `python -m benchmarks.draw` draws them.

Each example stores its case, a caption with the measured numbers, and the curves of its picture. One picture shows data
of the benchmark `accuracy_speed`, which must be run first.
"""

import importlib
import json
from collections.abc import Callable
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.accuracy_speed import PERIODS
from benchmarks.common import RESULTS, TWO_PI, arguments, say, truth, write
from benchmarks.switches import level1, run, solvers
from benchmarks.switches.model import IMPACT, REST, STATES, STICK, Point, force, start
from benchmarks.switches.score import judge
from benchmarks.switches.sums import Sum, value
from tests.exact.reference import Slide, mp

Series = dict[str, Any]
STEP = 0.1

CASES = {case["id"]: case for case in run.cases_of([0, 1, 2, 3])}


def series(x: Any, y: Any, style: str = "line", label: str = "") -> Series:
    """Return a curve of a picture. `style` contains the kind of its line ("line", "dashes", …) and of its marks
    ("dots", …)."""
    return {"x": np.asarray(x, float).tolist(), "y": np.asarray(y, float).tolist(), "style": style, "label": label}


def ask(name: str, solver: str, **setting: Any) -> tuple[list[Any], str]:
    """Return the answer of a solver to a case, and the verdict on this answer."""
    case, module = CASES[name], importlib.import_module(f"{solvers.__name__}.{solver}")
    given = run.answer(module, case["level"], run.inputs(case), setting)
    return next(iter(given.values())), judge(case, given)["verdict"]


def g_of(name: str) -> Callable[[Any], list[float]]:
    """Return the function of a case of level 0, for arrays of times."""
    x = run.inputs(CASES[name])
    f = Sum(**{key: number for key, number in x.items() if key != "T"})
    return lambda times: [value(f, float(t)) for t in times]


def true_zeros(name: str) -> list[float]:
    """Return the zeros of a case of level 0."""
    return [float(z) for z in CASES[name]["zeros"]]


# -- one search ----------------------------------------------------------------------------------------------


def pair_missed() -> dict[str, Any]:
    """Return the example of two zeros between grid points."""
    name = "L0-close-pair-03"
    g, zeros = g_of(name), true_zeros(name)
    found, verdict = ask(name, "scan_newton", step=STEP)
    k = np.arange(np.floor(zeros[0] / STEP), np.floor(zeros[0] / STEP) + 2)
    grid = STEP * k
    fine = np.linspace(grid[0] - 0.02, grid[1] + 0.02, 200)
    later = f"the first zero found is {found[0]:.4f}" if found else "no zero is found"
    return {
        "title": "A pair missed in a step",
        "case": name,
        "caption": f"Two zeros at a distance of {zeros[1] - zeros[0]:.2g} are between two neighbouring points of a "
        f"grid of step {STEP:g}. g has the same sign at both points, so scan + Newton does not search between them: "
        f"{later} instead of {zeros[0]:.4f} ({verdict}).",
        "axes": ("τ", "g", "linear", "linear"),
        "series": [
            series(fine, g(fine), label="g"),
            series(grid, g(grid), "dots", "points of the grid"),
            series(zeros[:2], [0, 0], "rings", "true zeros"),
        ],
    }


def zero_at_start() -> dict[str, Any]:
    """Return the example of a zero at the start. One method reports this zero; another method misses the next zero."""
    again, lost = "L0-zero-at-the-start-20", "L0-zero-at-the-start-18"
    (reported, *_), verdict = ask(again, "cvode", rtol=1e-8)
    found, verdict_lost = ask(lost, "scan_newton", step=STEP)
    zero, other = true_zeros(again)[0], true_zeros(lost)[0]
    fine = np.linspace(0.0, 1.4 * zero, 200)
    scale = np.abs(g_of(again)(fine)).max()
    none = "finds no zero" if not found else f"finds {found[0]:.4f}"
    return {
        "title": "A zero at the start found again, or the next one lost",
        "case": again,
        "caption": f"At the start g = g′ = 0. This zero does not count; the next zero is at {zero:.5f}. CVODE (rtol "
        f"1e-8) reports a zero at {reported:.1e}, because near the start its error is larger than g ({verdict}). In "
        f"the case `{lost}` the first zero after the start is at {other:.4f}, inside the first step of {STEP:g}. "
        f"Therefore scan + Newton {none} ({verdict_lost}).",
        "axes": ("τ", "g / max |g|", "linear", "linear"),
        "series": [
            series(fine, np.array(g_of(again)(fine)) / scale, label="g"),
            series([zero], [0], "rings", "true zero"),
            series([reported], [0], "cross", "reported"),
        ],
    }


def wrong_of_three() -> dict[str, Any]:
    """Return the example of three zeros in a bracket, of which Newton's method does not find the first."""
    name = "L0-three-in-a-step-07"
    g, zeros = g_of(name), true_zeros(name)
    found, verdict = ask(name, "scan_newton", step=STEP)
    low = STEP * np.floor(zeros[0] / STEP)
    fine = np.linspace(low - 0.01, low + STEP + 0.01, 300)
    bracket = [low, low + STEP]
    return {
        "title": "The wrong one of three",
        "case": name,
        "caption": f"The bracket from {low:.1f} to {low + STEP:.1f} contains three zeros, at {zeros[0]:.4f}, "
        f"{zeros[1]:.4f} and {zeros[2]:.4f}. A search in this bracket may find any of the three: scan + Newton reports "
        f"{found[0]:.4f}, not the first zero ({verdict}).",
        "axes": ("τ", "g", "linear", "linear"),
        "series": [
            series(fine, g(fine), label="g"),
            series(bracket, g(bracket), "dots", "ends of the bracket"),
            series(zeros[:3], [0, 0, 0], "rings", "true zeros"),
            series([found[0]], [0], "cross", "reported"),
        ],
    }


def wrong_of_two() -> dict[str, Any]:
    """Return the example of a reversal so close to the obstacle that an integrator reports an impact."""
    name = "L1-grazing-23"
    found, verdict = ask(name, "scipy_ivp", method="DOP853", rtol=1e-8)
    x, event = run.inputs(CASES[name]), CASES[name]["events"][0]
    model = level1.oscillator(x)
    slide = Slide(mp.mpf(x["xi0"]), mp.mpf(x["dxi0"]), -1, model.B, model.waves(mp.mpf(x["tau0"])))
    at = mp.mpf(event["tau"]) - mp.mpf(x["tau0"])
    away = np.linspace(-3e-6, 3e-6, 121)
    gap = [float(slide.at(at + mp.mpf(d))[0]) for d in away]
    return {
        "title": "The wrong one of two nearly simultaneous events",
        "case": name,
        "caption": f"The slide reverses {float(event['xi']):.1e} above the obstacle. The integrator's error of ξ is "
        "larger than this gap. So the integrator also finds an impact in its last step: scipy DOP853 (rtol 1e-8) "
        f"reports {found[0][2]} instead of {event['after']}, at the right time ({verdict}).",
        "axes": ("τ − τ of the reversal", "ξ", "linear", "linear"),
        "series": [
            series(away, gap, label="ξ"),
            series([0.0], [float(event["xi"])], "rings", "reversal"),
            series([away[0], away[-1]], [0, 0], "dashes", "obstacle"),
            series([found[0][0] - float(event["tau"])], [0], "cross", "reported impact"),
        ],
    }


def tightened() -> dict[str, Any]:
    """Return the example of a method that is right at one tolerance and wrong at a tighter tolerance."""
    name, tolerances = "L0-close-pair-03", [10.0**e for e in np.arange(-4.0, -13.1, -0.25)]
    methods = {"DOP853": ("scipy_ivp", {"method": "DOP853"}), "CVODE": ("cvode", {})}
    shown, counts = [], []
    for (label, (solver, fixed)), style in zip(methods.items(), ("line dots", "dashes rings"), strict=True):
        answers = [ask(name, solver, **fixed, rtol=rtol) for rtol in tolerances]
        right = [verdict == "right" for _, verdict in answers]
        first = right.index(True)
        again = right[first:].count(False)
        counts.append(
            f"{label} is right at rtol {tolerances[first]:.1e}, but wrong at {again} of the "
            f"{len(right) - first - 1} tighter tolerances"
        )
        errors = [abs(found[0] - true_zeros(name)[0]) if found else np.nan for found, _ in answers]
        shown.append(series(tolerances, np.maximum(errors, 1e-16), style, label))
    return {
        "title": "Right, and wrong again with a tighter tolerance",
        "case": name,
        "caption": "An integrator finds a pair of zeros only if one of its steps ends between the two. No tolerance "
        f"controls this. {'; '.join(counts)}.",
        "axes": ("rtol", "error of the first zero", "log", "log"),
        "series": shown,
    }


# -- many periods --------------------------------------------------------------------------------------------


def stored_points(eps: float) -> dict[str, list[dict[str, Any]]]:
    """Return the measurements of `accuracy_speed` at one ε, as a list for each method."""
    data = json.loads((RESULTS / "accuracy_speed.json").read_text(encoding="utf-8"))
    found: dict[str, list[dict[str, Any]]] = {}
    for point in data["points"]:
        if point["eps"] == eps:
            found.setdefault(point["method"], []).append(point)
    return found


def first_order() -> dict[str, Any]:
    """Return the example of the error of time-stepping over its step."""
    found = stored_points(0.0)
    stepping, newton = ([p for p in found[name] if p["right"]] for name in ("time-stepping", "scan + Newton"))
    steps, errors = ([p[key] for p in stepping] for key in ("value", "error"))
    case = CASES["L2-paper-04"]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    return {
        "title": "An error of first order in the step",
        "case": case["id"],
        "caption": "Time-stepping reports the end of a step as the time of a switch. The motion of the case is "
        f"continued from {float(case['inputs']['periods']):g} to {PERIODS} periods. In these periods the largest error "
        f"of a switch is proportional to the step to the power {order:.2f}. At the step {steps[-1]:g} this error is "
        f"{errors[-1]:.1e}. The sequence of states is right for {len(steps)} of the {len(found['time-stepping'])} "
        "steps.",
        "axes": ("step", "largest error of a switch", "log", "log"),
        "series": [
            series(steps, errors, "line dots", "time-stepping"),
            series([p["value"] for p in newton], [p["error"] for p in newton], "dashes rings", "scan + Newton"),
        ],
    }


def clock() -> dict[str, Any]:
    """Return the example of the error of the phase after many periods, for a τ that grows, and for a number of periods
    and a phase that are stored separately."""
    periods = [1000, 3000, 10_000, 30_000, 100_000]
    case = CASES["L2-paper-04"]
    x = run.inputs(case)
    point = Point(x["A"], x["B"], x["eps"], x["eta"])
    mp.dps = 40
    true = truth(point.A, 0.0, 1200).phase
    impact = [float(p) for p, kind in zip(true, truth(point.A, 0.0, 1200).kinds, strict=True) if kind == (1, 4)][-2:]

    def error(phase: float) -> float:
        return max(min(abs(phase - p) for p in impact), 1e-17)

    curves: dict[str, list[float]] = {"RK4 + bisection": [], "scan + Newton": [], "certified": []}
    for n in periods:
        for name, module, setting in (
            ("RK4 + bisection", "rk4_bisection", {"step": 0.003}),
            ("scan + Newton", "scan_newton", {"step": 0.1}),
        ):
            solver = importlib.import_module(f"{solvers.__name__}.{module}")
            found = solver.events((0.0, 0.0, 0.0, TWO_PI * n), point, **setting)
            tau = [tau for tau, before, after in found if (before, after) == (1, 4)][-1]
            curves[name].append(error(float(mp.fmod(mp.mpf(tau), 2 * mp.pi))))
        s = vd.simulate(point.A, transient=n - 2, periods=2).switches
        curves["certified"].append(error(float(s["phase"][(s["before"] == 1) & (s["after"] == 4)][-1])))
    last = {name: values[-1] for name, values in curves.items()}
    return {
        "title": "The phase error of a growing time τ",
        "case": case["id"],
        "caption": f"The motion of the case is continued from {x['periods']:g} to {periods[-1]:.0e} periods. It "
        "becomes periodic, so the phase of its impacts becomes constant. In the last periods the error of this phase "
        f"is {last['RK4 + bisection']:.0e} if τ is the sum of all "
        f"steps (RK4 + bisection). It is {last['scan + Newton']:.0e} if each τ is computed from the τ of the last "
        f"switch (scan + Newton). It is {last['certified']:.0e} if the number of periods and the phase are stored "
        "separately (certified).",
        "axes": ("periods", "error of the impact phase", "log", "log"),
        "series": [
            series(periods, values, f"{style} dots", name)
            for (name, values), style in zip(curves.items(), ("line", "dashes", "dotted"), strict=True)
        ],
    }


# -- states that are not kept --------------------------------------------------------------------------------


def trace(solver: str, setting: Any, A: float, periods: float) -> tuple[np.ndarray, ...]:
    """Return arrays of τ, ξ, ξ' and the state at the end of each step of a method of fixed step, from rest."""
    advance = importlib.import_module(f"{solvers.__name__}.{solver}").advance
    point, h, xi, dxi = Point(A, 0.1, 0.0, vd.ETA), setting[0], 0.0, 0.0
    level, rows = force(point, 0.0), []
    state = start(level, xi, dxi)
    for k in range(int(TWO_PI * periods / h)):
        ahead = force(point, (k + 1) * h)
        xi, dxi, state, _ = advance(point, setting, state, xi, dxi, k * h, level, ahead)
        level = ahead
        rows.append(((k + 1) * h, xi, dxi, state))
    return tuple(np.array(rows).T)


def creep() -> dict[str, Any]:
    """Return the example of the velocity of a mass that should stick."""
    shown, largest = [], []
    for v_s, style in ((1e-2, "line"), (1e-3, "dashes"), (1e-4, "dotted")):
        tau, xi, dxi, state = trace("regularised", (1e-4, v_s, 1e4, True), 1.5, 1.0)
        stuck = (state == STICK) & (xi > 0.0)
        largest.append(float(np.abs(dxi[stuck]).max()))
        shown.append(series(tau[stuck][::50], np.maximum(np.abs(dxi[stuck][::50]), 1e-9), style, f"$v_s$ = {v_s:g}"))
    return {
        "title": "Creep that never sticks",
        "case": "L2-paper-01",
        "caption": "Regularised friction has no force at the velocity 0. So a mass that should stick moves slowly, "
        f"with ξ′ = v_s·H. Its velocity reaches {largest[0]:.1e}, {largest[1]:.1e} and {largest[2]:.1e} for v_s = "
        "1e-2, 1e-3 and 1e-4. The true velocity is 0.",
        "axes": ("τ", "|ξ′| while it sticks", "linear", "log"),
        "series": shown,
    }


def penetration() -> dict[str, Any]:
    """Return the example of a mass that compresses a spring, which replaces the obstacle."""
    shown, deepest = [], []
    for k, style in ((1e3, "line"), (1e4, "dashes"), (1e5, "dotted")):
        tau, xi, _, state = trace("regularised", (1e-4, 1e-4, k, True), 1.5, 2.0)
        landed = int(np.argmax((state[1:] == REST) & (xi[1:] < 0.0) & (tau[1:] > 2.0)))
        part = slice(max(landed - 500, 0), landed + 4000)
        deepest.append(float(xi.min()))
        shown.append(series(tau[part][::10], xi[part][::10], style, f"k = {k:g}"))
    return {
        "title": "Penetration",
        "case": "L2-paper-01",
        "caption": "A spring replaces the obstacle. The mass compresses the spring to "
        f"ξ = {deepest[0]:.1e}, {deepest[1]:.1e} and {deepest[2]:.1e} for k = 1e3, 1e4 and 1e5. This depth is "
        "proportional to 1/√k. The true ξ is never negative.",
        "axes": ("τ", "ξ", "linear", "linear"),
        "series": shown,
    }


def sinking() -> dict[str, Any]:
    """Return the example of the depth of the mass below the obstacle, over the length of the fixed step."""
    steps = [float(f"{10**e:.3g}") for e in np.arange(-3, -0.4, 0.25)]
    seen, rest = [], []
    for step in steps:
        switches = vd.simulate(1.5, method="fixed", dtau=step, transient=0, periods=20).switches
        seen.append(-float(switches["xi"].min()))
        _, xi, _, state = trace("moreau_jean", (step,), 1.5, 20.0)
        rest.append(-float(xi[state == REST].min()))
    return {
        "title": "Below the obstacle at fixed steps",
        "case": "L2-paper-01",
        "caption": "A method of fixed step detects an impact at the end of the step. At this time ξ is negative. Its "
        f"modulus is the speed of the mass times the delay. With `fixed` it is at most {seen[0]:.1e} at Δτ = "
        f"{steps[0]:g} and {seen[8]:.1e} at {steps[8]:g}; then `fixed` sets ξ to 0. Time-stepping does not correct ξ. "
        f"So its mass may rest at ξ = -{rest[0]:.1e} and -{rest[8]:.1e}.",
        "axes": ("Δτ", "depth below 0", "log", "log"),
        "series": [
            series(steps, seen, "line dots", "fixed Δτ, at impacts"),
            series(steps, rest, "dashes rings", "time-stepping, at rest"),
        ],
    }


def lateness() -> dict[str, Any]:
    """Return the example of the error of an impact time, over the depth behind the obstacle at which the slide would
    reverse."""
    depths = [10.0**-k for k in range(1, 13)]
    events = [CASES[f"L1-grazing-{2 * k:02}"]["events"][0] for k in range(1, 13)]
    settings = {
        "fixed, Δτ = 1e-4": ("vibrodrive_paths", {"method": "fixed", "dtau": 1e-4}),
        "RK45, rtol 1e-6": ("scipy_ivp", {"method": "RK45", "rtol": 1e-6}),
    }
    shown, counts, errors = [], [], {}
    for (label, (solver, setting)), style in zip(settings.items(), ("line dots", "dashes dots"), strict=True):
        found = [ask(f"L1-grazing-{2 * k:02}", solver, **setting)[0][0] for k in range(1, 13)]
        late = [tau - float(event["tau"]) for (tau, _, _), event in zip(found, events, strict=True)]
        reported = [after for _, _, after in found]
        shown.append(series(depths, np.maximum(np.abs(late), 1e-16), style, label) | {"reported": reported})
        lost = ", ".join(f"1e-{k}" for k, after in enumerate(reported, 1) if after != STATES[IMPACT])
        counts.append(f"{label.split(',')[0]} reports the reversal at d = {lost}")
        errors[label] = late
    grid, adaptive = errors.values()
    early = ", ".join(f"1e-{k}" for k, error in enumerate(adaptive, 1) if error < 0.0)
    return {
        "title": "The time of an impact that is nearly a touch",
        "case": "L1-grazing-12",
        "caption": "Without the obstacle, the slide would reverse at a depth d behind the obstacle, about √d after the "
        f"time of the impact. The grid with Δτ = 1e-4 is {min(grid):.1e} to {max(grid):.1e} late. If the slide would "
        "leave the obstacle again within one step, there may be no point of the grid behind the obstacle. Then the "
        "method reports the reversal and no impact. An integrator has an error e of ξ. Its time error is about e/√d "
        "for d > e. For d < e the integrator reports an impact up to √e too early, or the reversal, about √d too late. "
        f"Hollow marks show a reversal in place of the impact: {'; '.join(counts)}. At rtol 1e-6 RK45 is early at d = "
        f"{early}. Its time error is at most {max(map(abs, adaptive)):.1e}.",
        "axes": ("depth d", "error of the time (hollow: reversal)", "log", "log"),
        "series": [
            series(depths, [float(e["nearest_other_zero"]) for e in events], "dotted", "time to reversal"),
            *shown,
        ],
    }


EXAMPLES = (
    pair_missed, zero_at_start, wrong_of_three, wrong_of_two, tightened, creep, penetration, first_order, sinking,
    lateness, clock,
)  # fmt: skip


def main() -> None:
    options = arguments(__doc__)
    found = {}
    for example in EXAMPLES:
        found[example.__name__] = example()
        say(f"{example.__name__}: {found[example.__name__]['caption']}")
    write("failures", {"examples": found}, None, options.output)


if __name__ == "__main__":
    main()
