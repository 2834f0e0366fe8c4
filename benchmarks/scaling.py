"""Scaling of a sweep: time over the number of points, periods and threads and over 1/Δτ; memory over the number of
points.

A straight line of slope 1 means that the time is proportional. The grid methods skip grid points, so their time should
not depend on 1/Δτ. Memory is the peak of a separate process. This process runs the command line, which writes each
block of points to a file as soon as the block is complete.
"""

import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks import obvious_loop
from benchmarks.common import arguments, figure, look, paired, say, write

RANGE = (3.0, 3.25)
CONFIG = """\
[sweep]
A = {{ start = 3.0, stop = 3.25, num = {points} }}

[run]
transient = 0
periods = {periods}
"""

CHILD = """\
import resource, sys
from pathlib import Path
from vibrodrive.cli import main
try:
    main()
except SystemExit as stop:
    if stop.code:
        raise
status = Path("/proc/self/status")
if status.exists():
    lines = status.read_text(encoding="utf-8").splitlines()
    peak = next(float(line.split()[1]) / 1024 for line in lines if "VmHWM" in line)
else:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
print(peak)
"""


def seconds(runs: dict[Any, dict[str, Any]], repeats: int, wall: bool = False) -> dict[str, float]:
    """Return the median CPU time of each sweep in seconds, or the wall time if `wall`. The sweeps are timed
    alternately."""
    times = paired({str(k): partial(vd.sweep, **run) for k, run in runs.items()}, repeats)
    return {k: t.wall_seconds if wall else t.seconds for k, t in times.items()}


def over_points(quick: bool, repeats: int) -> dict[str, float]:
    counts = (1, 10, 100, 1000) if quick else (1, 3, 10, 30, 100, 300, 1000, 3000, 10_000, 30_000)
    return seconds(
        {n: {"A": np.linspace(*RANGE, n), "transient": 0, "periods": 100, "threads": 1} for n in counts}, repeats
    )


def over_periods(quick: bool, repeats: int) -> dict[str, float]:
    counts = (10, 100, 1000) if quick else (1, 10, 100, 1000, 10_000)
    return seconds(
        {p: {"A": np.linspace(*RANGE, 128), "transient": p - 1, "periods": 1, "threads": 1} for p in counts}, repeats
    )


def over_grid(quick: bool, repeats: int) -> dict[str, dict[str, float]]:
    """Return the CPU time per period in seconds at each Δτ, for both grid methods, for certified switching and for the
    obvious loop, which visits every grid point."""
    found: dict[str, dict[str, float]] = {}
    steps = (1e-1, 1e-2, 1e-3) if quick else (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
    for method in ("fixed", "muller"):
        run = {"A": np.linspace(*RANGE, 64), "method": method, "transient": 0, "periods": 200, "threads": 1}
        spent = seconds({dtau: {**run, "dtau": dtau} for dtau in steps}, repeats)
        found[method] = {str(d): spent[str(d)] / (64 * 200) for d in steps}
        say(f"over 1/Δτ: {method}")
    # Δτ = 1e-6 has six million points a period
    periods = {dtau: max(1, min(200, round(200 * dtau / 1e-3))) for dtau in steps}
    A = np.linspace(*RANGE, 4)
    loops = {str(dtau): partial(obvious_loop.sweep, A, dtau, periods=n) for dtau, n in periods.items()}
    found["obvious loop"] = {
        str(d): t.seconds / (4 * n) for (d, n), t in zip(periods.items(), paired(loops, repeats).values(), strict=True)
    }
    say("over 1/Δτ: obvious loop")
    certified = {"A": np.linspace(*RANGE, 64), "transient": 0, "periods": 200, "threads": 1}
    once = seconds({"certified": certified}, repeats)["certified"] / (64 * 200)
    found["certified"] = {str(d): once for d in steps}
    return found


def over_threads(quick: bool, repeats: int) -> dict[str, float]:
    run = {
        "A": np.linspace(*RANGE, 100 if quick else 1000), "eps": [0.0, 1e-4, 2e-4],
        "transient": 0, "periods": 100,
    }  # fmt: skip
    counts = range(1, (os.cpu_count() or 1) + 1)
    return seconds({n: {**run, "threads": n} for n in counts}, repeats, wall=True)


def peak_memory(points: int, periods: int) -> float:
    """Return the peak resident memory in MiB of `vibrodrive sweep` over `points` points, in a separate process."""
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder, "memory.toml")
        config.write_text(CONFIG.format(points=points, periods=periods), encoding="utf-8")
        # the process reports its peak itself, because the value for its parent includes memory of the parent
        command = [
            sys.executable, "-c", CHILD, "sweep", str(config), "-o", str(Path(folder, "memory.h5")),
            "--threads", "1",
        ]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    return float(done.stdout.split()[-1])


def memory(quick: bool) -> dict[str, float]:
    counts = (500, 2000) if quick else (2000, 6000, 20_000, 60_000)
    peak_memory(8, 1)  # compile first: compilation would increase the memory of the first measurement
    return {str(n): peak_memory(n, 250) for n in counts}


def draw(data: dict[str, Any]):
    fig, axes = figure(8.0, 7.6, columns=2, rows=3)
    plain = {"marker": "o", "color": "black"}

    def curve(ax, values: dict[str, float], xlabel: str, ylabel: str, **style: Any) -> None:
        ax.plot([float(k) for k in values], list(values.values()), **style)
        ax.set_xlabel(xlabel)
        ax.set_ylabel(ylabel)

    a, b, c, d, e, free = axes.flat
    curve(a, data["points"], "points", "CPU time (s)", **plain)
    curve(b, data["periods"], "periods a point", "CPU time (s)", **plain)
    for ax in (a, b, c):
        ax.set_xscale("log")
        ax.set_yscale("log")
    for k, (name, values) in enumerate(data["grid"].items()):
        inverse = {str(1.0 / float(s)): v for s, v in values.items()}
        curve(c, inverse, r"$1/\Delta\tau$", "CPU time a period (s)", label=name, **look(k, name != "obvious loop"))
    handles, labels = c.get_legend_handles_labels()
    free.set_axis_off()
    free.legend(handles, labels, loc="center left", title=r"over $1/\Delta\tau$")
    one = data["threads"]["1"]
    curve(d, {n: one / t for n, t in data["threads"].items()}, "threads", "speed-up (wall time)", **plain)
    d.plot([1, len(data["threads"])], [1, len(data["threads"])], ":", color="0.45")
    d.set_xticks(range(1, len(data["threads"]) + 1))
    curve(e, data["memory_mib"], "points", "peak memory (MiB)", **plain)
    e.set_ylim(0, 1.2 * max(data["memory_mib"].values()))
    return fig


def main() -> None:
    options = arguments(__doc__)
    repeats = 1 if options.quick else 5
    data: dict[str, Any] = {}
    measures = {"points": over_points, "periods": over_periods, "grid": over_grid, "threads": over_threads}
    for name, measured in measures.items():
        data[name] = measured(options.quick, repeats)
        say(f"{name}: done")
    data["memory_mib"] = memory(options.quick)
    write("scaling", data, draw(data), options.output)


if __name__ == "__main__":
    main()
