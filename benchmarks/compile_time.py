"""Start-up: compilation on a new machine, loading in later processes, and the response of commands.

Each number is the CPU time of a separate process, or its peak memory. A "cold" process begins with an empty folder of
compiled kernels, a "warm" one with the folder that the cold one has left. A clone compiles its kernels; a wheel with
machine code is the same package with the result of `build_kernels.py`.
"""

import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import arguments, figure, say, write

PACKAGE = Path(__file__).parents[1] / "vibrodrive"

FIRST_SWEEP = "import vibrodrive as vd; vd.sweep(A=[1.5, 3.04], eps=[0.0, 2e-4], transient=1, periods=1)"
FIRST_SIMULATE = "import vibrodrive as vd; vd.simulate(A=3.04, transient=1, periods=1)"
WHOLE_API = (
    FIRST_SWEEP + "; vd.simulate(A=3.04, transient=1, periods=1);"
    "vd.sweep(A=[1.5], method='muller', dtau=1e-3, transient=1, periods=1);"
    "vd.sweep(A=[1.5], method='fixed', dtau=1e-3, transient=1, periods=1);"
    "vd.orbits(A=3.04, max_period=2)"
)
HELP = "import sys; sys.argv = ['vibrodrive', '--help']; from vibrodrive.cli import main; main()"

PROCESSES = {
    "vibrodrive --help": HELP,
    "first sweep, ε = 0 and 2e-4": FIRST_SWEEP,
    "first motion after it": FIRST_SIMULATE,
    "all methods, and orbits": WHOLE_API,
}


PEAK = """
import atexit, sys
def peak():
    with open("/proc/self/status") as lines:
        print(next(line.split()[1] for line in lines if line.startswith("VmHWM")), file=sys.stderr)
atexit.register(peak)
"""
"""Code that prints the peak memory of its process in KiB, of which `wait4` counts that of the parent, too."""


def used(code: str, package: Path, cache: Path) -> tuple[float, float]:
    """Return the CPU time in seconds and the peak memory in MiB of a process that runs `code` with this package."""
    process = subprocess.Popen(
        [sys.executable, "-c", PEAK + code], env={**os.environ, "NUMBA_CACHE_DIR": str(cache)}, cwd=package.parent,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    said = process.stderr.read() if process.stderr else ""
    _, status, found = os.wait4(process.pid, 0)
    process.returncode = status
    if status:
        raise RuntimeError(f"a process ended with status {status}: {said}")
    return found.ru_utime + found.ru_stime, int(said.split()[-1]) / 1024


def measure(quick: bool) -> dict[str, Any]:
    repeats = 1 if quick else 9
    found: dict[str, dict[str, float]] = {"CPU time, cold": {}, "CPU time, warm": {}, "peak memory": {}}
    with tempfile.TemporaryDirectory() as folder:
        wheel = shutil.copytree(
            PACKAGE, Path(folder) / "vibrodrive", ignore=shutil.ignore_patterns("*.so", "kernels.json", "__pycache__")
        )
        places = {"clone": PACKAGE}
        if (sys.platform, platform.machine()) == ("linux", "x86_64"):
            subprocess.run(
                [sys.executable, "-P", PACKAGE.parent / "build_kernels.py"], check=True,
                env=os.environ | {"PYTHONPATH": folder},
            )  # fmt: skip
            places["wheel"] = wheel
        for place, package in places.items():
            cache = Path(folder) / f"kernels of the {place}"
            for name, code in PROCESSES.items():
                cold, peak = used(code, package, cache)
                warm = float(np.median([used(code, package, cache)[0] for _ in range(repeats)]))
                for kind, value in zip(found, (cold, warm, peak), strict=True):
                    found[kind][f"{name}, {place}"] = value
                say(f"{name}, {place}: {cold:.3g} s, then {warm:.3g} s of CPU time, {peak:.0f} MiB")
    return {"found": found, "processes": list(PROCESSES), "places": list(places)}


def draw(data: dict[str, Any]):
    fig, axes = figure(6.3, 3.2)
    ax = axes[0, 0]
    names = list(reversed(data["processes"]))
    for place, colour in zip(data["places"], ("0.35", "0.8"), strict=False):
        shift = 0.2 if place == "clone" else -0.2
        cold = [data["found"]["CPU time, cold"][f"{name}, {place}"] for name in names]
        ax.barh(np.arange(len(names)) + shift, cold, 0.4, color=colour, label=place)
    ax.set_yticks(range(len(names)), names)
    ax.set_xscale("log")
    ax.set_xlabel("CPU time of the process without compiled kernels on disk (s)")
    ax.legend()
    return fig


def main() -> None:
    options = arguments(__doc__)
    data = measure(options.quick)
    write("compile_time", data, draw(data), options.output)


if __name__ == "__main__":
    main()
