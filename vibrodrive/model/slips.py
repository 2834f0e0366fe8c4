"""Warnings of allowed but unlikely arguments: degrees for radians, per cent for shares, A and B swapped, …

`unlikely` applies to every plan. `slip`, a part of it, applies to limits, orbits and scenes, because a sweep without a
scene may have any A and B. In Python a warning names the line of the caller; a command prints the same sentences.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Mapping
from typing import Any

from vibrodrive.model.names import PARAMETERS, SCENE, TURN

LARGE = 100.0  # warning if A exceeds both LARGE and LARGE·B: no vibratory driver has such an excitation

GIVE_A_AND_B = ("a0", "omega0", "frequency", "mu", "alpha")
NOTHING: Mapping[str, Any] = {}

UNITS = "a0 in m, omega0 in rad/s, frequency in Hz, alpha in degrees"


def slip(points: Iterable[tuple[float, float, float, float]], known: Mapping[str, Any] = NOTHING) -> list[str]:
    """Return a sentence for each likely mistake that all points (A, B, eps, eta) share. It names the quantities of the
    scene, if any, among the values `known` by name."""
    given = list(points)
    A, B, _, _ = given[0]
    scene = ", ".join(f"{name} = {_span(known[name])}" for name in GIVE_A_AND_B if name in known)
    of, wrong = (f" of {scene}", "is the scene") if scene else ("", "are A and B swapped, or is a scene")
    said = []
    if all(A * (1.0 + eps * eta**2) <= 1.0 + B for A, B, eps, eta in given):
        said.append(
            f"A = {A:g}, B = {B:g}{of}: the mass cannot leave the obstacle, because A (1 + ε η²) <= 1 + B "
            f"({wrong} not in SI units: {UNITS}?)"
        )
    if all(A > LARGE and A > LARGE * B for A, B, _, _ in given):
        said.append(f"A = {A:g}, B = {B:g}{of}: A is usually below {LARGE:g} (is a scene not in SI units: {UNITS}?)")
    return said


def in_radians(alpha: float) -> list[str]:
    """Return a sentence if the largest angle of an incline is probably in radians."""
    if 0.0 < alpha < (SCENE["alpha"].axis or (0.0,))[0]:
        return [
            f"alpha = {alpha:g}: an angle is in degrees (is it in radians, for {alpha * 360.0 / TURN:.3g} degrees?)"
        ]
    return []


def names_scene(written: Mapping[str, Any], plan: Any) -> bool:
    """Return whether a call gives a quantity of a scene itself. A `Scene` has judged its own when it was made."""
    return any(written.get(name) is not None or name in plan.together for name in SCENE)


def unlikely(plan: Any, of_scene: bool = False) -> list[str]:
    """Return a sentence for each likely mistake in the values of a Plan.

    `of_scene` states whether A and B, or the quantities of a scene that give them, are judged by `slip`.
    """
    import numpy as np

    said = []
    for name, axis in plan.axes.items():
        rising = np.sort(axis)
        if len(axis) > 1 and (rising[1:] == rising[:-1]).any():  # `unique` alone takes 5 % of a short sweep
            values, counts = np.unique(axis, return_counts=True)
            said.append(f"{name} = {values[counts.argmax()]:g}: this value is more than once on the axis")
        if len(axis) == 3 and _is_range(*axis.tolist()):
            ends = ", ".join(f"{value:g}" for value in axis)
            meant = f"numpy.linspace({ends}) or, in a configuration, {{start, stop, num}}"
            said.append(f"{name} = {ends}: these are three values (is a range meant, {meant}?)")
    given: dict[str, Any] = {**plan.scalars, **plan.varied}
    (eps, most), (slowest, eta) = _ends(given["eps"]), _ends(given["eta"])
    if of_scene:
        said += slip(plan.ends(), given) + in_radians(_ends(given.get("alpha", 0.0))[1])
    elif given.keys() >= {"A", "B"} and _ends(given["xi0"]) == _ends(given["dxi0"]) == (0.0, 0.0):
        A, (B, _) = _ends(given["A"])[1], _ends(given["B"])
        if 0.0 < A <= (PARAMETERS["B"].slider or (0.0, 0.0))[1] and B > 1.0 + A:
            said += slip([(A, B, most, eta)])
    phase, (_, step) = max(_ends(given["section_phase"]), key=abs), _ends(given["dtau"])
    if abs(phase) > 2.0 * TURN:
        said.append(f"section_phase = {phase:g}: a phase is in radians, usually below 2π (is it in degrees?)")
    start = max(_ends(given["tau0"]), key=abs)
    if 2.0 * TURN < abs(start) <= 360.0 and start % 15.0 == 0.0:  # other times are the ends of motions
        said.append(f"tau0 = {start:g}: a time τ is in radians of the excitation (is it in degrees?)")
    if step > TURN:
        said.append(f"dtau = {step:g}: the step of the grid is longer than the excitation period, 2π")
    if eps > 1.0:
        said.append(f"eps = {eps:g}: ε is a share of the excitation (is it in per cent?)")
    if most == 0.0 and slowest < eta and not plan.seeks:
        said.append(
            f"eta = {_span(given['eta'])}: no motion depends on it, because eps is 0 everywhere (is eps forgotten?)"
        )
    return said


def _ends(values: Any) -> tuple[float, float]:
    """Return the smallest and the largest of the values of a parameter, fast if there is one."""
    return (values, values) if isinstance(values, float | int) else (values.min(), values.max())


def _span(values: Any) -> str:
    """Return the values of a parameter in words, such as "3" or "3 to 5"."""
    return " to ".join(dict.fromkeys(f"{end:g}" for end in _ends(values)))


def _is_range(start: float, stop: float, num: float) -> bool:
    """Return True if three values are probably meant as the ends and the number of values, and not as decades."""
    decades = 0 < start * num <= 2 * stop**2
    return start < stop and num >= 20 and num == round(num) and num - stop > 20 * (stop - start) and not decades


class OfScene(float):
    """The A of a scene, with the B of this scene, so that a forgotten B is noticed."""

    __slots__ = ("B",)
    B: float

    def __new__(cls, A: float, B: float) -> OfScene:
        self = super().__new__(cls, A)
        self.B = B
        return self

    def __getnewargs__(self) -> tuple[float, float]:  # type: ignore[override]
        return float(self), self.B


def forgotten(A: object, B: object) -> list[str]:
    """Return a sentence if A is that of a scene and B, which has its default value, is not."""
    if isinstance(A, OfScene) and isinstance(B, float) and PARAMETERS["B"].default == B != A.B:
        return [f"B = {B:g}: A is that of a scene with B = {A.B:.6g} (is B = scene.B forgotten?)"]
    return []


def warn(said: Iterable[str]) -> None:
    """Issue one warning with all sentences, if there are any, at the line outside this package that led to it."""
    if not (text := "; ".join(said)):
        return
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "vibrodrive":
        frame, level = frame.f_back, level + 1
    warnings.warn(text, UserWarning, stacklevel=level)
