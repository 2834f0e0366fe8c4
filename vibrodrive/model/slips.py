"""Warnings of arguments that are allowed, and that nobody means: degrees for radians, per cent for shares, …

Nothing that somebody may mean has a warning. `unlikely` applies to every plan; `slip`, a part of it, also to orbits and
scenes. In Python a warning names the line of the caller; a command prints the same sentences.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from vibrodrive.model.names import PARAMETERS, SCENE, TURN
from vibrodrive.model.variables import POINT

GIVE_A_AND_B = ("a0", "omega0", "frequency", "mu", "alpha")
NOTHING: Mapping[str, Any] = {}

LARGEST_B = (PARAMETERS["B"].slider or (0.0, 0.0))[1]  # of usual machines

UNITS = "a0 in m, omega0 in rad/s, frequency in Hz, alpha in degrees"


def slip(points: Sequence[tuple[float, float, float, float]], values: Mapping[str, Any] = NOTHING) -> list[str]:
    """Return a sentence if the mass stays at rest at all points (A, B, eps, eta) by a likely mistake: other units of a
    scene, if the `values` by name have its quantities, or else A and B swapped."""
    A, B, _, _ = points[0]
    scene = ", ".join(f"{name} = {_span(values[name])}" for name in GIVE_A_AND_B if name in values)
    swapped = all(0.0 < A <= LARGEST_B and B > 1.0 + A for A, B, _, _ in points)
    if not (scene or swapped) or any(A * (1.0 + eps * eta * eta) > 1.0 + B for A, B, eps, eta in points):
        return []
    of, wrong = (f" of {scene}", f"is the scene not in SI units: {UNITS}?") if scene else ("", "are A and B swapped?")
    return [f"A = {A:g}, B = {B:g}{of}: the mass cannot leave the obstacle, because A (1 + ε η²) <= 1 + B ({wrong})"]


def names_scene(written: Mapping[str, Any], plan: Any) -> bool:
    """Return whether a call gives a quantity of a scene itself. A `Scene` has judged its own when it was made."""
    together = POINT in plan.axes
    return any(written.get(name) is not None or (together and name in plan.together) for name in SCENE)


def unlikely(plan: Any, of_scene: bool = False) -> list[str]:
    """Return a sentence for each likely mistake in the values of a Plan.

    `of_scene` states whether A and B, or the quantities of a scene that give them, are judged by `slip`.
    """
    sentences = []
    for name, axis in plan.axes.items():
        import numpy as np

        rising = np.sort(axis)
        if len(axis) > 1 and (rising[1:] == rising[:-1]).any():  # `unique` alone takes 5 % of a short sweep
            values, counts = np.unique(axis, return_counts=True)
            sentences.append(f"{name} = {values[counts.argmax()]:g}: this value is more than once on the axis")
    low, high = _ends(plan)
    eps, most, slowest, eta = low["eps"], high["eps"], low["eta"], high["eta"]
    if of_scene:
        sentences += slip(plan.ends(), plan.values)
    elif low.keys() >= {"A", "B"} and low["xi0"] == low["dxi0"] == high["xi0"] == high["dxi0"] == 0.0:
        sentences += slip([(high["A"], low["B"], most, eta)])
    phase = max(low["section_phase"], high["section_phase"], key=abs)
    if abs(phase) > 2.0 * TURN:
        sentences.append(f"section_phase = {phase:g}: a phase is in radians, usually below 2π (is it in degrees?)")
    start = max(low["tau0"], high["tau0"], key=abs)
    if 2.0 * TURN < abs(start) <= 360.0 and start % 15.0 == 0.0:  # other times are the ends of motions
        sentences.append(f"tau0 = {start:g}: a time τ is in radians of the excitation (is it in degrees?)")
    if high["dtau"] > TURN:
        sentences.append(f"dtau = {high['dtau']:g}: the step of the grid is longer than the excitation period, 2π")
    if eps > 1.0:
        sentences.append(f"eps = {eps:g}: ε is a share of the excitation (is it in per cent?)")
    if most == 0.0 and slowest < eta and not plan.seeks:
        span = _span(plan.values["eta"])
        sentences.append(f"eta = {span}: no motion depends on it, because eps is 0 everywhere (is eps forgotten?)")
    return sentences


def _ends(plan: Any) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return the smallest and the largest of the values of each parameter of a Plan, fast without an axis."""
    varied = plan.varied.items() if plan.axes else ()
    return (
        plan.scalars | {name: values.min() for name, values in varied},
        plan.scalars | {name: values.max() for name, values in varied},
    )


def _span(values: Any) -> str:
    """Return the values of a parameter in words, such as "3" or "3 to 5"."""
    ends = (values,) if isinstance(values, float | int) else (values.min(), values.max())
    return " to ".join(dict.fromkeys(f"{end:g}" for end in ends))


def warn(sentences: Iterable[str]) -> None:
    """Issue one warning with all sentences, if there are any, at the line outside this package that led to it."""
    if not (text := "; ".join(sentences)):
        return
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "vibrodrive":
        frame, level = frame.f_back, level + 1
    warnings.warn(text, UserWarning, stacklevel=level)
