"""Ratio of the speeds of two checkouts. Named cases are timed alternately, on one thread.

    python -m benchmarks.paired ../before . --repeats 15 disturbed muller

One process runs the code of each checkout. It compiles the kernels once and runs until the end. The two processes run
each case alternately, so that other load on the machine affects both checkouts equally. Times are CPU times of the
process. The output for each case contains two ratios of times, second checkout over first checkout. The first ratio is
that of the shortest times. The second ratio is the median, with quartiles, of the ratios of successive runs. If 1 is
between the quartiles, the difference of the two checkouts is not significant: use more repeats or a less busy machine.
A change that does not concern speed may cost 2 %.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

CASES = {
    "undisturbed": "vd.sweep(A=np.linspace(3.0525, 3.06, 128), transient=500, periods=100, threads=1)",
    "recurrent": "vd.sweep(A=np.linspace(3, 3.25, 2048), transient=500, periods=500, threads=1)",
    "disturbed": "vd.sweep(A=np.linspace(3, 3.06, 128), eps=2e-4, transient=50, periods=50, threads=1)",
    "muller": "vd.sweep(A=np.linspace(3, 3.125, 256), method='muller', dtau=1e-5, tol=1e-7,"
    " transient=500, periods=50, threads=1)",
    "fixed": "vd.sweep(A=np.linspace(3, 3.06, 128), eps=2e-4, method='fixed', dtau=0.1,"
    " transient=50, periods=50, threads=1)",
    "single": "[vd.simulate(A=a, transient=200, periods=50) for a in np.linspace(3, 3.06, 64)]",
    "orbits": "vd.orbits(A=3.04, max_period=3)",
}
"""Timed cases as Python code. In the first case no motion returns to an earlier state, in the second case most do."""

WORKER = """
import sys, time
import numpy as np
import vibrodrive as vd
for line in sys.stdin:
    case = compile(line, "case", "eval")
    began = time.process_time()
    eval(case)
    print(time.process_time() - began, flush=True)
"""


class Checkout:
    """A process that imports vibrodrive from a folder and times cases."""

    def __init__(self, folder: Path) -> None:
        if not (folder / "vibrodrive" / "__init__.py").is_file():
            raise SystemExit(f"{folder}: not a checkout of vibrodrive")
        self._process = subprocess.Popen(
            [sys.executable, "-c", WORKER],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(folder.resolve())},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def seconds(self, case: str) -> float:
        """Return the CPU time of one run."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(case + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise SystemExit("a checkout could not run this case; the traceback of the error is above")
        return float(answer)

    def close(self) -> None:
        self._process.communicate()


def compare(first: Checkout, second: Checkout, case: str, repeats: int) -> str:
    """Return the line of output for a case. Every second pair of runs is in the opposite order."""
    first.seconds(case), second.seconds(case)  # not timed: compiles or loads the kernels
    one, other = [], []
    for k in range(repeats):
        if k % 2 == 0:
            one.append(first.seconds(case))
            other.append(second.seconds(case))
        else:
            other.append(second.seconds(case))
            one.append(first.seconds(case))
    ratios = [b / a for a, b in zip(one, other, strict=True)]
    low, median, high = statistics.quantiles(ratios, n=4)
    times = f"{1e3 * min(one):.2f} and {1e3 * min(other):.2f} ms"
    return f"{min(other) / min(one):9.3f}  {median:6.3f}  {low:.3f} to {high:.3f}  {times}"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("first", type=Path, help="folder of the checkout with speed 1")
    parser.add_argument("second", type=Path, help="folder of the other checkout")
    parser.add_argument("cases", nargs="*", metavar="case", help=f"out of {', '.join(CASES)}; default: all")
    parser.add_argument("--repeats", type=int, default=15, help="pairs of runs for each case; default 15")
    options = parser.parse_args()
    unknown = set(options.cases) - set(CASES)
    if unknown or options.repeats < 2:
        parser.error(f"no such case: {', '.join(sorted(unknown))}" if unknown else "--repeats: at least 2")
    began = time.monotonic()
    checkouts = Checkout(options.first), Checkout(options.second)
    print(f"{'case':12}  {'of mins':>9}  median  quartiles        shortest", flush=True)
    for name in options.cases or CASES:
        print(f"{name:12}  {compare(*checkouts, CASES[name], options.repeats)}", flush=True)
    for checkout in checkouts:
        checkout.close()
    print(f"{time.monotonic() - began:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
