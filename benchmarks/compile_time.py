"""Start-up times: compilation on a new machine, loading in later processes, and the response of commands.

Each time is the wall time of a separate process. A "cold" run begins with an empty cache directory. A "warm" run uses
the cache of the cold run.
"""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import arguments, figure, say, write

FIRST_SWEEP = "import vibrodrive as vd; vd.sweep(A=[1.5, 3.04], transient=1, periods=1)"
FIRST_SIMULATE = "import vibrodrive as vd; vd.simulate(A=3.04, transient=1, periods=1)"
WHOLE_API = (
    FIRST_SWEEP + "; vd.simulate(A=3.04, transient=1, periods=1);"
    "vd.sweep(A=[1.5], method='muller', dtau=1e-3, transient=1, periods=1);"
    "vd.sweep(A=[1.5], method='fixed', dtau=1e-3, transient=1, periods=1)"
)
HELP = "import sys; sys.argv = ['vibrodrive', '--help']; from vibrodrive.cli import main; main()"
PYTHON = "pass"


def seconds(code: str, cache: Path, repeats: int = 1) -> float:
    """Return the median wall time of a process that runs `code` with this cache directory."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    spent = []
    for _ in range(repeats):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], env=environment, check=True, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)  # fmt: skip
        spent.append(time.perf_counter() - start)
    return float(np.median(spent))


def measure(quick: bool) -> dict[str, Any]:
    repeats = 1 if quick else 5
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder)
        found["python, nothing else"] = seconds(PYTHON, cache, repeats)
        found["vibrodrive --help"] = seconds(HELP, cache, repeats)
        found["first sweep, cold"] = seconds(FIRST_SWEEP, cache)
        found["first sweep, warm"] = seconds(FIRST_SWEEP, cache, repeats)
        found["first trajectory after a sweep"] = seconds(FIRST_SIMULATE, cache)
        found["first trajectory, warm"] = seconds(FIRST_SIMULATE, cache, repeats)
        found["everything, after both"] = seconds(WHOLE_API, cache)
        found["everything, warm"] = seconds(WHOLE_API, cache, repeats)
        before = {p: p.stat().st_mtime_ns for p in cache.rglob("*") if p.is_file()}
        seconds(WHOLE_API, cache)
        after = {p: p.stat().st_mtime_ns for p in cache.rglob("*") if p.is_file()}
    for name, value in found.items():
        say(f"{name}: {value:.3g} s")
    return {"seconds": found, "files_written_later": sum(after[p] != before.get(p) for p in after)}


def draw(data: dict[str, Any]):
    fig, axes = figure(6.3, 3.2)
    ax = axes[0, 0]
    shown = {k: v for k, v in reversed(data["seconds"].items())}
    ax.barh(range(len(shown)), list(shown.values()), color="0.8", edgecolor="black", linewidth=0.6)
    ax.set_yticks(range(len(shown)), list(shown))
    ax.set_xscale("log")
    ax.set_xlabel("wall time of the process (s)")
    return fig


def main() -> None:
    options = arguments(__doc__)
    data = measure(options.quick)
    write("compile_time", data, draw(data), options.output)


if __name__ == "__main__":
    main()
