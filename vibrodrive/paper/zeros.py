"""Numbers of zeros of the switching functions in the steps at which a grid method fails (§5), at ε = 0."""

import math
from typing import NamedTuple

import numpy as np

from vibrodrive.model.plan import Plan, make_plan
from vibrodrive.model.states import State
from vibrodrive.stability.failures import JUDGED, KINDS, Comparison, compared

FRACTIONS = 400  # number of parts of a step in which the zeros of a switching function are counted

ZEROS = {
    "one": "one zero, which is found too late",
    "even": "an even number of zeros of one function",
    "both": "one zero of each of two functions",
    "odd": "an odd number of three zeros or more",
}
"""Names of the numbers of zeros of the switching functions in a step."""


class Failure(NamedTuple):
    """Failure at a switch: its kind (a name in KINDS), the zeros in the step (a name in ZEROS), A and Δτ."""

    kind: str
    zeros: str
    A: float
    dtau: float


def failures_by_zeros(plan: Plan, method: str) -> tuple[int, list[Failure]]:
    """Return the number of judged switches at all points of a plan over A and Δτ, and the failures of the method."""
    judged, failed = 0, []
    for index in range(plan.n_points):
        A, step = (float(plan.axes[name][i]) for name, i in zip(plan.axes, divmod(index, plan.shape[1]), strict=True))
        motion = make_plan(plan.arguments(index) | {"method": method, "dtau": step, "periods": JUDGED})
        comparison = compared(motion)
        judged += len(comparison.behind)
        for kind in KINDS:
            for k in np.flatnonzero(comparison.of(kind)).tolist():
                counts = zeros_of_step(motion, comparison, k)
                failed.append(Failure(kind, name_of_zeros(counts), A, step))
    return judged, failed


def name_of_zeros(counts: list[int]) -> str:
    """Return the name in ZEROS of the numbers of zeros of the switching functions in a step."""
    if any(n and n % 2 == 0 for n in counts):
        return "even"
    if max(counts) > 1:
        return "odd"
    return "both" if sum(counts) > 1 else "one"


def zeros_of_step(motion: Plan, comparison: Comparison, k: int) -> list[int]:
    """Return the number of zeros of each switching function of eq. (8) in one step, as a list.

    The step is that of the grid of the motion which contains the certified switch of entry k of the comparison. The
    result is [0] if no certified switch follows. A slide is continued beyond its end by the closed form of eqs. (4) and
    (5) at ε = 0.
    """
    A, B, step = (motion.scalars[name] for name in ("A", "B", "dtau"))
    state, start, end = comparison.start["after"][k], comparison.tau[k], comparison.certified[k]
    if end == np.inf:
        return [0]
    steps = max(1, math.ceil((end - start) / step - 1e-9))
    first = 1 if steps == 1 else 0  # leaves out the zero at the beginning of the state
    tau = start + step * (steps - 1 + np.arange(first, FRACTIONS + 1) / FRACTIONS)
    if state in (State.REST, State.STICK):
        force = A * np.sin(tau) - B
        tests = [force - 1.0, force + 1.0][: 1 if state == State.REST else 2]
    else:
        drag, since = B + (1.0 if state == State.UP else -1.0), tau - start
        speed = A * (np.cos(start) - np.cos(tau)) - drag * since
        fall = A * (np.sin(tau) - np.sin(start) - np.cos(start) * since) + 0.5 * drag * since**2
        tests = [speed, comparison.xi[k] - fall][: 1 if state == State.UP else 2]
    return [int(np.count_nonzero(np.diff(np.signbit(values)))) for values in tests]
