"""Description of one motion in words, for `Trajectory.describe` and for a click in the explorer."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from vibrodrive.batch.sweep import compute
from vibrodrive.jit.slices import Halt
from vibrodrive.model.choices import Method, Status
from vibrodrive.model.physical import Scene
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import LONGEST, SUMMARY, period_words
from vibrodrive.model.states import states

LEAST = 4 * LONGEST
"""Least number of excitation periods from which the summary is computed. They suffice to find the longest period."""


def summary_of(plan: Plan, halt: Halt | None = None) -> dict[str, Any]:
    """Return the summary of the single motion of a plan: a dict of numbers by the names in model/records.py.

    Raises Halted if `halt` is called.
    """
    block = compute(replace(plan, record=(SUMMARY,)), 0, 1, 1, halt)
    return {name: values[0].item() for name, values in block.records.items()}


def described(status: Status, margin: float, plan: Plan, scene: Scene | None) -> str:
    """Return the text of `Trajectory.describe`."""
    a = plan.scalars
    long = replace(plan, settings=replace(plan.settings, periods=max(LEAST, plan.settings.periods)))
    place = ", ".join(f"{name} = {a[name]:g}" for name in ("A", "B", "eps") if name != "eps" or a[name])
    return "\n".join([place, *sentences(status, margin, summary_of(long), plan, scene)])


def sentences(
    status: Status, margin: float, found: Mapping[str, Any], plan: Plan, scene: Scene | None = None
) -> list[str]:
    """Return the lines of the description: status, margin, period, impacts, cycle of states, impact speeds.

    `found` is the result of `summary_of`. With a scene, times and speeds are in SI units.
    """
    advice = status.advice
    if status == Status.OK and plan.settings.method == Method.FIXED:
        step = plan.scalars["dtau"]
        advice = (
            f"grid of step Δτ = {step:.6g}: switches are late by up to one step; two switches in a step may be missed"
        )
    closest = f"margin {margin:.3g}: smallest distance of a decision from the opposite decision, in H, ξ or ξ'"
    said = [f"{status.name}: {advice}", "no decision" if math.isinf(margin) else closest]
    if status != Status.OK:
        return said
    period, impacts = found["period"], found["impacts"]
    cycle = period_words(period)
    if scene is not None and period > 0:
        cycle += f" ({1e3 * period / scene.frequency:.4g} ms)"
    if math.isnan(impacts):
        return [*said, f"{cycle}; the record is too short for means, which need two main impacts"]
    rate = "" if scene is None else f" ({impacts * scene.frequency:.4g} per second)"
    over = "" if period > 0 else ", a mean of the record"
    said.append(f"{cycle}; impacts per excitation period: {impacts:.4g}{rate}{over}")
    if found["sequence"] > 0:
        said.append(f"states: {' '.join(states(found['sequence']))} (Up, Down, Stick, Rest, Impact)")
    mean, most = found["impact_speed_mean"], found["impact_speed_max"]
    if scene is None:
        said.append(f"mean impact speed {mean:.6g}, largest {most:.6g}")
    else:
        said.append(f"mean impact speed {scene.velocity(mean):.4g} m/s, largest {scene.velocity(most):.4g} m/s")
    if math.isfinite(found["lyapunov"]):
        said.append(f"Lyapunov exponent {found['lyapunov']:.4g} per excitation period")
    return said
