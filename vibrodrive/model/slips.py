"""Warnings of allowed but unlikely arguments. Likely mistakes are: A and B swapped, ε in per cent, a scene not in SI.

Only the arguments of limits and of orbits, and scenes, are checked. The parameters of a sweep without a scene may have
any values.
"""

import warnings
from collections.abc import Iterable

SMALL = 0.1  # largest ε that counts as a small disturbance
LARGE = 100.0  # warning if A exceeds both LARGE and LARGE·B: no vibratory driver has such an excitation

UNITS = "a0 in m, omega0 in rad/s, alpha in degrees"


def slip(points: Iterable[tuple[float, float, float, float]]) -> str:
    """Return a sentence for each likely mistake that all points (A, B, eps, eta) share, or "" if there is none."""
    given = list(points)
    A, B, eps, _ = given[0]
    said = []
    if all(A * (1.0 + eps * eta**2) <= 1.0 + B for A, B, eps, eta in given):
        said.append(
            f"A = {A:g}, B = {B:g}: the mass cannot leave the obstacle, because A (1 + ε η²) <= 1 + B "
            f"(are A and B swapped, or is a scene not in SI units: {UNITS}?)"
        )
    if all(eps > SMALL for _, _, eps, _ in given):
        said.append(f"eps = {eps:g}: ε is a share of the excitation, usually below {SMALL:g} (is it in per cent?)")
    if all(A > LARGE and A > LARGE * B for A, B, _, _ in given):
        said.append(f"A = {A:g}, B = {B:g}: A is usually below {LARGE:g} (is a scene not in SI units: {UNITS}?)")
    return "; ".join(said)


def warn_of_slip(points: Iterable[tuple[float, float, float, float]], depth: int = 2) -> None:
    """Warn of a likely mistake, if any; the warning names the line `depth` calls above the caller."""
    if said := slip(points):
        warnings.warn(said, UserWarning, stacklevel=depth + 1)
