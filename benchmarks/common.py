"""Functions shared by the benchmarks: timing in pairs, errors relative to the 50-digit reference, JSON and PNG.

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
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import date
from difflib import SequenceMatcher
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from vibrodrive.model.plain import plain

TWO_PI = 2.0 * math.pi
FAR = 0.5 * math.pi  # two switches correspond if their states are equal and their τ differ by at most this
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


def arguments(doc: str) -> argparse.Namespace:
    """Parse the options of a benchmark: the directory of the results, and --quick for a short trial run."""
    parser = argparse.ArgumentParser(description=doc.split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=RESULTS, help="directory of the JSON and PNG")
    parser.add_argument("--quick", action="store_true", help="few and short measurements, as a trial")
    return parser.parse_args()


def say(text: str) -> None:
    """Print progress to stderr."""
    print(text, file=sys.stderr, flush=True)


def environment() -> dict[str, Any]:
    """Return the conditions of the measurements: date, processor and versions."""
    model = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        names = [line.split(":", 1)[1].strip() for line in cpuinfo.read_text().splitlines() if "model name" in line]
        model = names[0] if names else model
    versions = dict.fromkeys(("vibrodrive", "numpy", "numba", "scipy", "heyoka", "diffrax", "scikit-sundae", "mpmath"))
    for package in versions:
        with suppress(importlib.metadata.PackageNotFoundError):
            versions[package] = importlib.metadata.version(package)
    return {
        "measured": date.today().isoformat(),
        "processor": model,
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


# -- errors ------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Truth:
    """50-digit reference of one trajectory from rest. Phases and section points are arrays of mpmath numbers."""

    period: np.ndarray
    phase: np.ndarray
    kinds: list[tuple[int, int]]
    section: np.ndarray


@cache
def truth(A: float, eps: float, periods: int, section_phase: float = 0.0) -> Truth:
    """Return switches and section points of the first `periods` periods from rest."""
    from tests.exact import reference as digits50  # needs mpmath, which only some benchmarks need

    r = digits50.reference(A, 0.1, eps, periods=periods, section_phase=section_phase)
    return Truth(
        np.array([s.period for s in r.switches], dtype=np.int64),
        np.array([s.phase for s in r.switches], dtype=object),
        [(int(s.before), int(s.after)) for s in r.switches],
        np.array(r.section, dtype=object),
    )


@dataclass(frozen=True)
class SwitchError:
    """Errors of switches: the largest difference in τ of two switches that correspond, and the number `wrong` of
    missed, invented or different switches. `of` is the number of true switches."""

    largest: float
    wrong: int
    of: int


def switch_error(true: Truth, period: np.ndarray, phase: np.ndarray, before: Any, after: Any) -> SwitchError:
    """Compare switches with the reference. The two sequences are aligned by the states before and after each switch, so
    that a missed pair does not affect other switches."""
    kinds = [(int(b), int(a)) for b, a in zip(before, after, strict=True)]
    if kinds == true.kinds:
        pairs = [(i, i) for i in range(len(kinds))]
    else:
        matcher = SequenceMatcher(None, true.kinds, kinds, autojunk=False)
        pairs = [(m.a + i, m.b + i) for m in matcher.get_matching_blocks() for i in range(m.size)]
    late = []
    for i, j in pairs:
        # subtract period numbers, which are small integers, and phases separately, so that no digit is lost
        apart = float(float(phase[j]) - true.phase[i])
        late.append(abs(apart + TWO_PI * (int(period[j]) - int(true.period[i]))))
    near = [x for x in late if x <= FAR]
    wrong = len(true.kinds) + len(kinds) - 2 * len(near)
    return SwitchError(max(near, default=math.nan), wrong, len(true.kinds))


@cache
def orbit(A: float, n: int, section_phase: float, settle: int = 1200) -> np.ndarray:
    """Return the section points p_0 … p_{n−1} of the undisturbed stable n-periodic orbit, float64 (n, 2)."""
    points = np.array(truth(A, 0.0, settle, section_phase).section[-2 * n :], dtype=float)
    if np.abs(points[n:] - points[:n]).max() > 1e-13:
        raise ValueError(f"A = {A}: not {n}-periodic after {settle} periods")
    return points[n:]


def rho(section: np.ndarray, points: np.ndarray) -> float:
    """Return ρ = max_k |x_k − p_(k+s mod n)| of the section points x_k and the n points p of an orbit, with the best
    shift s. Return NaN if a section point is missing."""
    n = len(points)
    k = np.arange(len(section))
    return min(float(np.hypot(*(section - points[(k + s) % n]).T).max()) for s in range(n))


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
