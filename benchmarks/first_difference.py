"""The cause of each wrong setting in `accuracy_speed`: `python -m benchmarks.first_difference` computes the table.

The command computes the motions of these settings again, and compares them with the certified events up to the first
difference. The cause follows from the event at the difference, and from the errors of the times up to this event.
"""

import importlib
import json
from functools import cache
from typing import Any

import vibrodrive as vd
from benchmarks.accuracy_speed import EPS, PERIODS, A, Method, methods
from benchmarks.common import RESULTS, TWO_PI, Found, arguments, compare, say, simulated, write
from benchmarks.switches import motions, run, solvers
from benchmarks.switches.model import IMPACT, REST, STATES, Point, force, force_rate, jit, start
from benchmarks.switches.solvers.moreau_jean import advance
from tests.exact.reference import mp

CAUSES = ("pair", "start", "touch", "threshold", "sunk", "drift")
"""Causes of a difference.

pair : an event is passed with the zero next to it; the time of the event before has no such error
start : the zero at the start of a slide is reported as its end
touch : an impact is nearly a touch, so the error of ξ decides between impact and reversal
threshold : |H| is close to 1 at the event, so the error of the time decides which state follows
sunk : the mass is below the obstacle, so it rests where it should stick or slide down
drift : errors of earlier times have changed the motion
"""


@cache
def true_events(eps: float) -> list[dict[str, Any]]:
    """Return the certified events of the motion, with the fields of a case of the set."""
    for case in run.cases_of([3]):
        x = run.inputs(case)
        if (x["A"], x["eps"], x["xi0"], x["periods"]) == (A, eps, 0.0, PERIODS):
            return case["events"]
    names = motions.Event._fields
    return [dict(zip(names, event, strict=True)) for event in motions.solve(motions.inputs(A=A, periods=PERIODS))]


def found_by(solver: str | None, eps: float, setting: dict[str, Any]) -> Found:
    """Return the switches of the motion by a solver of the set, or by the package if `solver` is None."""
    if solver is None:
        return simulated(A=A, eps=eps, transient=0, periods=PERIODS, **setting)
    point = Point(A, 0.1, eps, vd.ETA)
    return importlib.import_module(f"{solvers.__name__}.{solver}").events((0, 0, 0, TWO_PI * PERIODS), point, **setting)


@jit
def depth(point, step, steps):
    """Return -ξ after a number of steps of time-stepping, in a motion from rest."""
    xi, dxi, level = 0.0, 0.0, force(point, 0.0)
    state = start(level, xi, dxi)
    for k in range(steps):
        ahead = force(point, (k + 1) * step)
        xi, dxi, state, _ = advance(point, (step,), state, xi, dxi, k * step, level, ahead)
        level = ahead
    return -xi


def cause(true: Found, found: Found, near: list[float], n: int) -> tuple[str, int]:
    """Return (cause, number of the event at which it acts). The states first differ at the event n.

    `near` contains the distance of each event to the nearest other zero.
    """
    late = [float(mp.mpf(b[0]) - a[0]) for a, b in zip(true[: n + 1], found, strict=False)]
    for m in range(n + 1):
        if late[m] > near[m] or m == n:
            if IMPACT in (true[m][2], found[m][2]) and abs(late[m]) < 10 * near[m] < 1.0:
                return "touch", m
            if late[m] > near[m] and (m == 0 or abs(late[m - 1]) < near[m] / 3):
                return "pair", m
    took, lasts = (events[n][0] - events[n - 1][0] for events in (found, true))
    if true[n][1] == IMPACT:
        return "threshold", n
    if took < 1e-3 * lasts:
        return "start", n
    if found[n][2] == REST:
        return "sunk", n
    return ("drift" if IMPACT in (true[n][2], found[n][2]) else "threshold"), n


def difference(true: Found, found: Found, events: list[dict[str, Any]], point: Point) -> dict[str, Any]:
    """Return the first difference of a wrong answer: its period, its states, its cause, and the measured numbers.

    distance : from the event to the nearest other zero; for the cause `threshold` to the time at which |H| = 1
    error : |error| of the time of the event before; for the cause `threshold` of the event; for the cause `drift` the
        largest of all events before
    took : duration of the state before the event, as reported
    """
    n = next(i for i, (a, b) in enumerate(zip(true, found, strict=False)) if compare([a], [b], PERIODS)[0] is None)
    near = [float(e["nearest_other_zero"] or TWO_PI) for e in events]
    near[0] = float(true[1][0] - true[0][0])  # the nearest other zero is the start itself
    name, m = cause(true, found, near, n)
    tau, distance = float(true[m][0]), near[m]
    late = [abs(float(mp.mpf(b[0]) - a[0])) for a, b in zip(true[: m + 1], found, strict=False)]
    error = max(late[:m], default=0.0) if name == "drift" else late[m - 1] if m else 0.0
    if name == "threshold":
        error = late[m]
        distance = abs(abs(force(point, tau)) - 1.0) / abs(force_rate(point, tau))
    return {
        "period": tau / TWO_PI,
        "true": " → ".join(STATES[state] for state in true[m][1:]),
        "reported": " → ".join(STATES[state] for state in found[m][1:]),
        "reported_tau": float(found[m][0]),
        "cause": name,
        "xi": float(events[m]["xi"]),
        "distance": distance,
        "error": error,
        "took": float(found[m][0] - found[m - 1][0]) if m else float(found[m][0]),
    }


def row(method: Method, eps: float, value: float) -> dict[str, Any]:
    """Return the first difference of a method at a wrong setting, with the setting."""
    events, point = true_events(eps), Point(A, 0.1, eps, vd.ETA)
    with mp.workdps(40):
        true = [(mp.mpf(e["tau"]), STATES.index(e["before"]), STATES.index(e["after"])) for e in events]
        found = found_by(method.solver, eps, method.fixed | {method.setting: value})
        made = difference(true, found, events, point)
    if made["cause"] == "sunk":
        made["depth"] = depth(point, value, round(made["reported_tau"] / value) - 1)
    return {"eps": eps, "method": method.name, "setting": method.setting, "value": value} | made


def main() -> None:
    options = arguments(__doc__)
    wrong: dict[tuple[float, str], list[float]] = {}
    for p in json.loads((RESULTS / "accuracy_speed.json").read_text(encoding="utf-8"))["points"]:
        if not p["right"]:
            wrong.setdefault((p["eps"], p["method"]), []).append(p["value"])
    rows = []
    for eps in EPS:
        for method in methods(eps):
            for value in wrong.get((eps, method.name), [])[: 1 if options.quick else None]:
                rows.append(row(method, eps, value))
                say(f"{rows[-1]}")
    write("first_difference", {"A": A, "periods": PERIODS, "rows": rows}, None, options.output)


if __name__ == "__main__":
    main()
