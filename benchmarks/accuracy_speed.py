"""Error over computing time of each method, at every setting, for a motion of 200 periods.

`python -m benchmarks.accuracy_speed` measures, `python -m benchmarks.draw` draws the chart of the README. The motion
starts from rest at A = 3.04, undisturbed (ε = 0) and with the paper's disturbance (ε = 2e-4). If a setting finds every
switch, its error is the largest error of a switching time. If a setting misses a switch, or reports a switch that does
not exist, no error is defined. Then the number of periods up to the first difference is stored instead.

With `--set KEY=VALUE` or a configuration it measures and draws that motion instead (own_scene.py).
"""

import argparse
import importlib
import itertools
import json
import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import vibrodrive as vd
from benchmarks import own_scene
from benchmarks.common import RESULTS, Found, compare, paired, say, simulated, true_switches, write
from benchmarks.switches import solvers
from benchmarks.switches.model import STATES
from benchmarks.switches.run import timed

A, EPS, PERIODS = 3.04, (0.0, 2e-4), 200
LANES = 1024  # number of motions of the sweep in `sweep_seconds`


def decades(largest: int, smallest: int, each: int = 2) -> list[float]:
    """Return numbers from 10^largest to 10^smallest, with `each` numbers in a decade."""
    exponents = np.arange(largest, smallest - 0.5 / each, -1 / each)
    return [float(f"{10.0**k:.3g}") for k in exponents]


TOLERANCES = decades(-4, -13, 1)


class Method(NamedTuple):
    """A solver of the set of switches (benchmarks/switches), or the package if `solver` is None.

    `setting` is the name of the parameter that is varied, and `grid` contains its values. `fixed` contains the
    values of all others.
    """

    name: str
    solver: str | None
    setting: str
    grid: list[float]
    fixed: dict[str, Any]


def methods(eps: float) -> Iterator[Method]:
    """Yield all methods. Of the two adaptive methods of scipy, yield the better one at this ε."""
    yield Method("Muller on a grid", None, "dtau", decades(-1, -6), {"method": "muller", "tol": 1e-7})
    yield Method("fixed Δτ", None, "dtau", decades(-1, -6), {"method": "fixed"})
    yield Method("scan + Newton", "scan_newton", "step", decades(0, -4, 4), {})
    yield Method("scan of g and g′", "scan_slope", "step", decades(0, -4, 4), {})
    yield Method("RK4 + bisection", "rk4_bisection", "step", decades(-1, -4), {})
    yield Method("heyoka", "heyoka_events", "tol", [*TOLERANCES, *decades(-14, -15, 1)], {})
    best = "LSODA" if eps else "DOP853"
    yield Method(f"scipy {best}", "scipy_ivp", "rtol", TOLERANCES, {"method": best})
    yield Method("CVODE", "cvode", "rtol", TOLERANCES, {})
    yield Method("diffrax Dopri8", "diffrax_events", "rtol", TOLERANCES, {"method": "Dopri8"})
    yield Method("time-stepping", "moreau_jean", "step", decades(-1, -6), {})


def measure_package(eps: float, repeats: int, settings: dict[str, Any]) -> tuple[Found, float]:
    """Return the switches of one motion, and its CPU time in seconds."""
    motion = {"A": A, "eps": eps, "transient": 0, "periods": PERIODS} | settings
    return simulated(**motion), paired({"": lambda: vd.simulate(**motion)}, repeats)[""].seconds


def measure_solver(eps: float, module: Any, setting: dict[str, Any]) -> tuple[Found, float]:
    """Return the switches of one motion by a solver of the set, and its CPU time in seconds. If the solver fails, the
    list of switches is empty."""
    x = {"A": A, "B": 0.1, "eps": eps, "eta": vd.ETA, "xi0": 0.0, "dxi0": 0.0, "tau0": 0.0}
    timed(module, 2, x | {"periods": 2.0}, setting, 0.0)  # not timed: compiles the solver
    given, seconds = timed(module, 3, x | {"periods": float(PERIODS)}, setting, 0.0)
    if isinstance(given, str):
        say(f"{module.NAME}, {setting}: {given}")
        return [], seconds
    return [(tau, STATES.index(before), STATES.index(after)) for tau, before, after in given["events"]], seconds


def sweep_seconds(eps: float, repeats: int) -> float:
    """Return the CPU time in seconds per motion of a certified sweep over almost equal A, on one thread."""
    near = A + 1e-9 * np.arange(LANES)
    run: dict[str, Any] = {"A": near, "eps": eps, "transient": 0, "periods": PERIODS, "threads": 1}
    return paired({"": lambda: vd.sweep(**run)}, repeats)[""].seconds / LANES


def points(eps: float, quick: bool, only: str | None = None) -> Iterator[dict[str, Any]]:
    """Yield the measurement of each method, or `only` of one, at each setting."""
    true, repeats = true_switches(A, eps, PERIODS), 1 if quick else 5

    def point(name: str, setting: str, value: float | None, found: Found, seconds: float) -> dict[str, Any]:
        error, until = compare(true, found, PERIODS)
        per_period = seconds / PERIODS
        shown = f"{error or math.nan:.1e}  {per_period:.1e} s  right for {until:.4g} periods"
        say(f"ε = {eps:g}  {name:20} {value or '':<9}  {shown}")
        kept = {
            "error": error,
            "until": until,
            "right": until == PERIODS,
            "found": len(found),
            "true": len(true),
            "seconds": per_period,
        }
        return {"eps": eps, "method": name, "setting": setting, "value": value, **kept}

    if only is None:
        found, seconds = measure_package(eps, repeats, {"method": "certified"})
        yield point("certified", "", None, found, seconds)
        yield point("certified sweep", "", None, found, sweep_seconds(eps, repeats))
    for method in (m for m in methods(eps) if only in (None, m.name)):
        measure: Callable[[dict[str, Any]], tuple[Found, float]] = partial(measure_package, eps, repeats)
        if method.solver:
            try:
                module = importlib.import_module(f"{solvers.__name__}.{method.solver}")
            except ImportError as error:
                say(f"{method.name} is left out: {error}")
                continue
            measure = partial(measure_solver, eps, module)
        for value in itertools.islice(method.grid, 0, None, 4 if quick else 1):
            yield point(method.name, method.setting, value, *measure(method.fixed | {method.setting: value}))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("config", type=Path, nargs="?", help="a configuration; it or --set selects another motion")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="A, B, eps or eta")
    parser.add_argument("-o", "--output", type=Path, help="directory of the JSON, for another motion also of the PNG")
    parser.add_argument("--quick", action="store_true", help="few and short measurements, as a trial")
    parser.add_argument("--only", metavar="METHOD", help="measure only this method again, keep the other results")
    options = parser.parse_args()
    if options.config or options.set:
        own_scene.measure(options.config, options.set, options.output or Path())
        return
    path = (options.output or RESULTS) / "accuracy_speed.json"
    stored: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if options.only else {}
    found = [p for p in stored.get("points", []) if p["method"] != options.only]
    found += [p for eps in EPS for p in points(eps, options.quick, options.only)]
    write("accuracy_speed", stored | {"A": A, "periods": PERIODS, "points": found}, None, options.output or RESULTS)


if __name__ == "__main__":
    main()
