"""The three methods of the package: `vd.simulate` for events, and its kernels at level 0.

The answer ends before the first switching decision that the package reports as uncertain. If no decision is certain,
the case is refused.
"""

import vibrodrive as vd
from benchmarks.switches.kernel_zeros import find
from benchmarks.switches.model import TWO_PI

NAME, PACKAGE = "vibrodrive", "vibrodrive"
STEPS = (0.1, 0.03, 0.01, 0.003, 0.001, 3e-4, 1e-4, 1e-5)
SETTINGS = [
    {"method": "certified"},
    *({"method": "muller", "dtau": dtau, "tol": tol} for dtau in STEPS for tol in (1e-7, 1e-12)),
    *({"method": "fixed", "dtau": dtau} for dtau in (*STEPS, 1e-6, 1e-7, 1e-8)),
]


def events(start, point, method, **grid):
    """Return the switches by one of the methods, with its grid step and its tolerance."""
    xi0, dxi0, tau0, end = start
    disturbed = {"eps": point.eps, "eta": point.eta} if point.eps else {}
    initial = {"xi0": xi0, "dxi0": dxi0, "tau0": tau0, "transient": 0, "periods": round((end - tau0) / TWO_PI)}
    motion = vd.simulate(point.A, B=point.B, method=method, **disturbed, **initial, **grid)
    s = motion.switches
    if motion.status == vd.Status.TOO_CLOSE:
        s = s[~(s["period"] >= motion.certain_until)]  # NaN for the method fixed, which has no error bounds
        if not len(s):
            raise ArithmeticError(motion.status.advice)
    tau = TWO_PI * s["period"] + s["phase"]
    return list(zip(tau.tolist(), s["before"].tolist(), s["after"].tolist(), strict=True))


def zeros(function, T, method, dtau=1.0, tol=1e-7):
    """Return the zeros of `function` in (0, T] by one of the methods."""
    return find(function, T, vd.Method[method.upper()], dtau, tol)
