"""CPU time of motions over the work that sizes the blocks of a file (`Settings.work` in model/names.py).

    python -m benchmarks.work

For each method and record, sweeps of 64 almost equal motions are timed on one thread for many values of A, B, ε and η.
A ratio of 1 means that a motion takes as many microseconds as its work. The largest ratio times BLOCK_WORK
(model/plan.py) is the longest time of a block. The median shows how much smaller than necessary most blocks are.
"""

import itertools
import statistics
import time

import numpy as np

from benchmarks.common import say
from vibrodrive.batch.sweep import compute
from vibrodrive.model.names import ETA
from vibrodrive.model.plan import make_plan

MOTIONS = 64
A = 0.5, 0.9, 1.1, 1.5, 2.2, 3.0, 3.055, 4.5, 30.0, 1e3
B = 0.0, 0.1, 0.5
DISTURBANCES = [
    (0.0, ETA), *((strength / eta**2, eta) for eta in (3.3, ETA, 1001.0) for strength in (1e-2, 0.1, 1.0, 3.0, 30.0))
]  # fmt: skip
"""Values of ε and η; the first factor of ε is ε η², the acceleration relative to that of the excitation."""
METHODS = ("certified", None), ("fixed", 1e-3), ("fixed", 0.1), ("muller", 1e-5), ("muller", 0.1)
RECORDS = "section", "summary", "error"


def ratio(A: float, **arguments: object) -> float:
    """Return the CPU time of a motion in microseconds over its work."""
    plan = make_plan({"A": np.linspace(A, 1.01 * A, MOTIONS), **arguments})
    compute(plan, 0, 1)
    began = time.process_time()
    compute(plan, 0, MOTIONS)
    return 1e6 * (time.process_time() - began) / MOTIONS / plan.point_work


def main() -> None:
    for (method, dtau), record in itertools.product(METHODS, RECORDS):
        for disturbed in (False, True):
            found = []
            for a, b, (eps, eta) in itertools.product(A, B, DISTURBANCES):
                if (eps > 0.0) == disturbed:
                    periods = max(2, int(4000 / eta)) if disturbed else 100
                    span = {"record": record, "transient": periods, "periods": periods}
                    one = ratio(a, B=b, eps=eps, eta=eta, method=method, dtau=dtau, **span)
                    found.append((one, a, b, eps, eta))
            largest, *where = max(found)
            median = statistics.median(one for one, *_ in found)
            at = ", ".join(f"{name} = {value:.4g}" for name, value in zip(("A", "B", "eps", "eta"), where, strict=True))
            say(f"{method} {dtau or ''} {record}: largest {largest:.2f} ({at}), median {median:.3f}")


if __name__ == "__main__":
    main()
