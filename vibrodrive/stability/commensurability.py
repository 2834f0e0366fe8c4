"""Explain the period 6×2π of Fig. 12: a grid Δτ nearly repeats after q excitation periods if p·Δτ ≈ q·2π.

After a plastic impact the motion depends only on the instant of the impact. With the method "fixed" this instant is a
grid point, so a disturbed motion is a sequence of phases kΔτ mod 2π. The motion can nearly repeat after q periods only
if the grid nearly repeats after q periods. The best such q are the numerators of the convergents q/p of the continued
fraction of Δτ/2π.
"""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from vibrodrive.model.parameters import check, check_count

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
    check_count("longest", longest, 1)
    step = Fraction(check("dtau", dtau))
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
    section = np.asarray(section, dtype=np.float64)
    return np.array([np.median(np.abs(section[m:] - section[:-m]).max(axis=1)) for m in range(1, longest + 1)])
