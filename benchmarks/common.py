"""Functions shared by the benchmarks: timing in pairs, switches of the 50-digit reference, JSON and PNG.

Speeds are compared as ratios measured in one run. Each repetition runs all programs (the contestants) one after the
other. Every second repetition uses the opposite order. The result is the median of the ratios over all repetitions.
Compilation is not timed.
"""

import argparse
import gc
import importlib.metadata
import json
import math
import os
import platform
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from numba.core.registry import cpu_target

import vibrodrive as vd
from vibrodrive import ETA
from vibrodrive.cli.plain import plain

TWO_PI = 2.0 * math.pi
RESULTS = Path(__file__).parent / "results"

STYLE: dict[Any, Any] = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 10,
    "axes.linewidth": 0.6,
    "lines.linewidth": 0.9,
    "lines.markersize": 4.5,
    "legend.frameon": False,
    "legend.fontsize": 8,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "figure.constrained_layout.use": True,
    "savefig.dpi": 160,
}
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*", "h", "d")
DASHES = ("-", "--", ":", "-.")


# -- running a benchmark -----------------------------------------------------------------------------------


def parser(doc: str | None, draws: bool = False) -> argparse.ArgumentParser:
    """Return the parser of a benchmark with -o, the directory of the results, and, if it `draws`, with --draw."""
    found = argparse.ArgumentParser(description=(doc or "").split("\n")[0])
    found.add_argument("-o", "--output", type=Path, default=RESULTS, help="directory of the JSON and PNG")
    if draws:
        found.add_argument("--draw", action="store_true", help="measure nothing, draw the stored results")
    return found


def arguments(doc: str | None) -> argparse.Namespace:
    """Parse the options of a benchmark: the directory of the results, and --quick for a short trial run."""
    options = parser(doc)
    options.add_argument("--quick", action="store_true", help="few and short measurements, as a trial")
    return options.parse_args()


def say(text: str) -> None:
    """Print progress to stderr."""
    print(text, file=sys.stderr, flush=True)


def vectors() -> str:
    """Return the vector instructions that the kernels use, by name if these are AVX-512 (eight doubles) or AVX2 (four).

    With NUMBA_CPU_NAME=x86-64-v3 and NUMBA_CPU_FEATURES=+avx2,+fma in the environment these are AVX2 on any machine.
    """
    features = cpu_target.target_context.codegen().magic_tuple()[2]
    known = {"+avx512dq": "AVX-512", "+avx2": "AVX2"}
    return next((name for feature, name in known.items() if feature in features), platform.machine())


def environment() -> dict[str, Any]:
    """Return the conditions of the measurements: date, processor, its vector instructions, and versions."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text(encoding="utf-8").splitlines()
        names = [line.split(":", 1)[1].strip() for line in lines if "model name" in line]
        model = names[0] if names else model
    versions = dict.fromkeys(("vibrodrive", "numpy", "numba", "scipy", "heyoka", "diffrax", "scikit-sundae", "mpmath"))
    for package in versions:
        with suppress(importlib.metadata.PackageNotFoundError):
            versions[package] = importlib.metadata.version(package)
    return {
        "measured": date.today().isoformat(),
        "processor": model,
        "vectors": vectors(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "versions": versions,
    }


def write(name: str, data: Mapping[str, Any], figure: Any, directory: Path) -> None:
    """Write `name`.json into `directory`, and `name`.png if there is a figure."""
    directory.mkdir(parents=True, exist_ok=True)
    text = json.dumps(plain({"environment": environment(), **data}), indent=1, allow_nan=False)
    (directory / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    say(f"{name}: written to {name}.json")
    if figure is not None:
        figure.savefig(directory / f"{name}.png")
        plt.close(figure)
        say(f"{name}: drawn to {name}.png")


# -- timing ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Timing:
    """CPU times and wall times of one contestant in seconds, with one value for each repetition."""

    cpu: np.ndarray
    wall: np.ndarray

    @property
    def seconds(self) -> float:
        """Median CPU time."""
        return float(np.median(self.cpu))

    @property
    def wall_seconds(self) -> float:
        """Median wall time."""
        return float(np.median(self.wall))


def paired(contestants: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, Timing]:
    """Time all contestants one after the other, `repeats` times. Before the first repetition each contestant is called
    once without timing."""
    for work in contestants.values():
        work()
    names = list(contestants)
    spent: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for k in range(repeats):
        for name in names if k % 2 == 0 else reversed(names):
            gc.collect()
            cpu, wall = time.process_time(), time.perf_counter()
            contestants[name]()
            spent[name].append((time.process_time() - cpu, time.perf_counter() - wall))
    return {name: Timing(*np.array(rows).T) for name, rows in spent.items()}


def ratio(slow: Timing, fast: Timing, per_slow: float = 1.0, per_fast: float = 1.0, wall: bool = False) -> float:
    """Return the median over the repetitions of (time of `slow` per unit)/(time of `fast` per unit). `per_slow` and
    `per_fast` are the numbers of units of work, such as periods."""
    a, b = (slow.wall, fast.wall) if wall else (slow.cpu, fast.cpu)
    return float(np.median((a / per_slow) / (b / per_fast)))


# -- reference ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Truth:
    """Switches of one trajectory from rest, with 50 digits. `phase` is an array of mpmath numbers."""

    period: np.ndarray
    phase: np.ndarray
    kinds: list[tuple[int, int]]


@cache
def truth(A: float, eps: float, periods: int, B: float = 0.1, eta: float = ETA) -> Truth:
    """Return the switches of the first `periods` periods from rest."""
    from tests.exact import reference as digits50  # needs mpmath, which only some benchmarks need

    switches = digits50.reference(A, B, eps, eta, periods=periods).switches
    return Truth(
        np.array([s.period for s in switches], dtype=np.int64),
        np.array([s.phase for s in switches], dtype=object),
        [(int(s.before), int(s.after)) for s in switches],
    )


Found = list[tuple[Any, int, int]]  # for each switch: τ, state before, state after
CLOSE = 1.0  # two switches correspond if their states are equal and their τ differ by at most this (rad)


def found_switches(period: Iterable[int], phase: Iterable[Any], kinds: Iterable[tuple[int, int]]) -> Found:
    """Return switches with each τ as a sum in 40 digits, so that the phase loses no digit."""
    from tests.exact.reference import mp

    with mp.workdps(40):
        times = [2 * mp.pi * int(k) + mp.mpf(p) for k, p in zip(period, phase, strict=True)]
    return [(tau, *kind) for tau, kind in zip(times, kinds, strict=True)]


def true_switches(*arguments: Any) -> Found:
    """Return the switches of the 50-digit reference, for the arguments of `truth`."""
    true = truth(*arguments)
    return found_switches(true.period, true.phase, true.kinds)


def simulated(**arguments: Any) -> Found:
    """Return the switches of `vd.simulate`."""
    s = vd.simulate(**arguments).switches
    return found_switches(s["period"], s["phase"].tolist(), zip(s["before"].tolist(), s["after"].tolist(), strict=True))


def compare(true: Found, found: Found, periods: int) -> tuple[float | None, float]:
    """Return the largest error of a τ (None if a switch is wrong), and the number of periods without a difference."""
    pairs = [(abs(b[0] - a[0]), a[1:] == b[1:]) for a, b in zip(true, found, strict=False)]
    first = next((i for i, (error, same) in enumerate(pairs) if error > CLOSE or not same), len(pairs))
    if first == len(true) == len(found):
        return float(max(error for error, _ in pairs)), periods
    until = min(float(s[first][0]) for s in (true, found) if first < len(s)) / TWO_PI
    return None, until


# -- pictures ----------------------------------------------------------------------------------------------


def figure(width: float = 6.3, height: float = 4.0, columns: int = 1, rows: int = 1) -> tuple[Any, np.ndarray]:
    """Return a figure in the style of all benchmarks, and its axes (rows, columns)."""
    plt.rcParams.update(STYLE)
    return plt.subplots(rows, columns, figsize=(width, height), squeeze=False)


def look(k: int, of_ours: bool) -> dict[str, Any]:
    """Return the line style and the marker of curve k. Curves differ without colour: those of vibrodrive are black with
    filled markers, all others are grey with open markers."""
    return {
        "marker": MARKERS[k % len(MARKERS)],
        "linestyle": DASHES[k % len(DASHES)],
        "color": "black" if of_ours else "0.45",
        "markerfacecolor": "black" if of_ours else "white",
    }
