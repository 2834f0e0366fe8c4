"""Error over computing time for a scene of one's own, as for the paper's motion in accuracy_speed.py, which calls this.

    python -m benchmarks.accuracy_speed --set A=2.4 --set B=0.2 --set eps=1e-4 --set eta=80
    python -m benchmarks.accuracy_speed configs/driver.toml --set eps=0     # a configuration, without its axes

Measured are the three methods of the program and the two hand-written scans, which a plain installation has, and the
other programs of the extra `bench` that are installed. The true switches are those of the reference of 50 digits, which
needs mpmath (extra `test`).
"""

import importlib
import math
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt

import vibrodrive as vd
from benchmarks.common import Found, compare, figure, look, paired, say, simulated, true_switches, write
from benchmarks.switches import solvers
from benchmarks.switches.model import STATES
from benchmarks.switches.run import timed
from vibrodrive.model import config

PERIODS = 200
STEPS = [float(f"{10.0 ** (-k / 2):.3g}") for k in range(1, 11)]
TOLERANCES = [10.0**-k for k in range(4, 14, 2)]
SOLVERS: list[tuple[str, str, str, list[float], dict[str, Any]]] = [
    ("scan + Newton", "scan_newton", "step", STEPS, {}),
    ("scan of g and g′", "scan_slope", "step", STEPS, {}),
    ("heyoka", "heyoka_events", "tol", TOLERANCES, {}),
    ("scipy DOP853", "scipy_ivp", "rtol", TOLERANCES, {"method": "DOP853"}),
    ("CVODE", "cvode", "rtol", TOLERANCES, {}),
]


def scene(path: Path | None, overrides: Sequence[str]) -> dict[str, Any]:
    """Return A, B, ε and η of a configuration, with keys replaced. An axis is replaced by its first value."""
    read = config.read(path, overrides) if path else config.parse("", overrides)
    scalars = read.plan().arguments(0)
    return {name: float(scalars[name]) for name in ("A", "B", "eps", "eta")}


def points(at: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the measurement of each method at each setting, with the CPU time per period."""
    true = true_switches(at["A"], at["eps"], PERIODS, at["B"], at["eta"])

    def point(name: str, setting: str, value: float | None, found: Found, seconds: float) -> dict[str, Any]:
        error, until = compare(true, found, PERIODS)
        say(f"{name:20} {value or '':<9}  {error or math.nan:.1e}  {seconds / PERIODS:.1e} s  right for {until:.4g}")
        kept = {"error": error, "until": until, "right": error is not None, "seconds": seconds / PERIODS}
        return {"method": name, "setting": setting, "value": value, **kept}

    for method in ("certified", "muller", "fixed"):
        for step in [None] if method == "certified" else STEPS:
            arguments: dict[str, Any] = {**at, "method": method, "dtau": step, "transient": 0, "periods": PERIODS}
            spent = paired({"": partial(vd.simulate, **arguments)}, 3)[""].seconds
            yield point(method, "dtau" if step else "", step, simulated(**arguments), spent)
    x = {**at, "xi0": 0.0, "dxi0": 0.0, "tau0": 0.0}
    for name, solver, setting, grid, fixed in SOLVERS:
        try:
            module = importlib.import_module(f"{solvers.__name__}.{solver}")
        except ImportError as missing:
            say(f"{name} is left out: {missing}")
            continue
        for value in grid:
            given: Any
            timed(module, 2, x | {"periods": 2.0}, fixed | {setting: value}, 0.0)  # compiles
            given, spent = timed(module, 3, x | {"periods": float(PERIODS)}, fixed | {setting: value}, 0.0)
            events = [] if isinstance(given, str) else given["events"]
            found = [(tau, STATES.index(before), STATES.index(after)) for tau, before, after in events]
            yield point(name, setting, value, found, spent)


def draw(at: dict[str, float], found: list[dict[str, Any]]) -> Any:
    """Draw error over cost. Settings with a wrong switch are above the line, because they have no error."""
    fig, axes = figure(6.3, 4.4)
    ax = axes[0, 0]
    for k, name in enumerate(dict.fromkeys(p["method"] for p in found)):
        here = [p for p in found if p["method"] == name]
        style = look(k, name in ("certified", "muller", "fixed"))
        right = [(p["seconds"], p["error"]) for p in here if p["right"]]
        wrong = [(p["seconds"], 30.0 * 3.0**k) for p in here if not p["right"]]
        ax.loglog(*zip(*right or [(math.nan, math.nan)], strict=True), label=name, **style)
        ax.loglog(*zip(*wrong or [(math.nan, math.nan)], strict=True), **style | {"linestyle": "none"})
    ax.axhline(10.0, color="0.6", linewidth=0.6)
    ax.set(xlabel="CPU time per period of motion (s)", ylabel=r"largest error of a switch, in $\tau$")
    fig.legend(loc="outside right upper", title="above the line:\na switch is wrong", title_fontsize=8)
    ax.set_title(", ".join(f"{name} = {value:.6g}" for name, value in at.items()), fontsize=9)
    return fig


def measure(path: Path | None, overrides: Sequence[str], folder: Path) -> None:
    """Measure a scene, and write own_scene.json and own_scene.png."""
    at = scene(path, overrides)
    found = list(points(at))
    write("own_scene", {"scene": at, "periods": PERIODS, "points": found}, draw(at, found), folder)
    plt.close("all")
