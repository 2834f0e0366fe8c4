"""Grids Δτ: after how many periods they nearly repeat (Fig. 12), and the zeros in a step at which a method fails (§5).

After a plastic impact the motion depends only on the instant of the impact. With the method "fixed" this instant is a
grid point, so a disturbed motion is a sequence of phases kΔτ mod 2π. It can nearly repeat after q excitation periods
only if the grid nearly repeats after q periods, p·Δτ ≈ q·2π. The best such q are the numerators of the convergents q/p
of the continued fraction of Δτ/2π.
"""

import functools
import itertools
import math
from fractions import Fraction
from typing import Any, Literal, NamedTuple

import numpy as np

from vibrodrive import State, Trajectory, simulate
from vibrodrive.stability.failures import compared

TWO_PI = Fraction("6.28318530717958647692528676655900576839433879875021")


class Convergent(NamedTuple):
    """A number of grid steps that is nearly a number of excitation periods: `steps`·Δτ = `periods`·2π + `miss`."""

    steps: int
    periods: int
    miss: float


def convergents(dtau: float, longest: int = 1000) -> list[Convergent]:
    """Return the convergents p·Δτ ≈ q·2π of the continued fraction with 1 <= q <= `longest`, in order of growing p.

    No number of periods smaller than q is closer to a whole number of grid steps.
    """
    step = Fraction(dtau)
    rest = step / TWO_PI
    q, q_before, p, p_before = 1, 0, 0, 1
    found: list[Convergent] = []
    while True:
        whole = math.floor(rest)
        q, q_before = whole * q + q_before, q
        p, p_before = whole * p + p_before, p
        if q > longest:
            return found
        if q > 0:
            found.append(Convergent(p, q, float(p * step - q * TWO_PI)))
        if rest == whole:
            return found
        rest = 1 / (rest - whole)


def closing(dtau: float, longest: int) -> np.ndarray:
    """Return the distance of m·2π from the nearest grid point, m = 1 … `longest`: float64 (longest,).

    If this distance is small for an m, `returning` should be small for this m, too.
    """
    m = np.arange(1, longest + 1)
    return np.abs(m * (2 * math.pi) - dtau * np.rint(m * (2 * math.pi) / dtau))


def returning(section: np.ndarray, longest: int) -> np.ndarray:
    """Return the distance between a motion and the same motion m periods later, m = 1 … `longest`: float64 (longest,).

    `section` is float64 (periods, 2) with more than `longest` periods. The distance is the median over time of the
    larger of the differences of ξ and ξ'. So single transients within the record do not change it.
    """
    return np.array([np.median(np.abs(section[m:] - section[:-m]).max(axis=1)) for m in range(1, longest + 1)])


# Zeros in a step

METHODS = ("fixed", "muller")
KINDS = ("missed", "late", "wrong")  # failures of a method (docs/step.md)
JUDGED: dict[str, Any] = {"B": 0.1, "transient": 200, "periods": 10}  # motions whose switches are judged
OVER_A, OVER_DTAU = (tuple(axis.tolist()) for axis in (np.linspace(1.2, 3.25, 40), np.geomspace(1e-3, 2.0, 40)))
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


@functools.cache
def failures_by_zeros(
    method: Literal["fixed", "muller"], over_A: tuple[float, ...] = OVER_A, over_dtau: tuple[float, ...] = OVER_DTAU
) -> tuple[int, list[Failure]]:
    """Return the number of judged switches of the undisturbed motions at all pairs of A and Δτ, and the failures."""
    judged, failed = 0, []
    for A, step in itertools.product(over_A, over_dtau):
        motion = simulate(A=A, method=method, dtau=step, **JUDGED)
        comparison = compared(motion)
        judged += len(comparison.behind)
        for kind in KINDS:
            for k in np.flatnonzero(comparison.of(kind)).tolist():
                failed.append(Failure(kind, name_of_zeros(zeros_of_step(motion, comparison, k)), A, step))
    return judged, failed


def name_of_zeros(counts: list[int]) -> str:
    """Return the name in ZEROS of the numbers of zeros of the switching functions in a step."""
    if any(n and n % 2 == 0 for n in counts):
        return "even"
    if max(counts) > 1:
        return "odd"
    return "both" if sum(counts) > 1 else "one"


def zeros_of_step(motion: Trajectory, comparison: Any, k: int) -> list[int]:
    """Return the number of zeros of each switching function of eq. (8) in one step, as a list.

    The step is that of the grid of the motion which contains the certified switch of entry k of the comparison. The
    result is [0] if no certified switch follows. A slide is continued beyond its end by the closed form of eqs. (4) and
    (5) at ε = 0.
    """
    A, B, step = (motion.arguments[name] for name in ("A", "B", "dtau"))
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
