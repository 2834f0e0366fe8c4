"""The motion that the page shows: its curve with the state of each piece, its description, and its limits k₂."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

import vibrodrive as vd
from vibrodrive.batch import describe, sweep, trajectory
from vibrodrive.explorer.view import DIAGRAM, SI, View
from vibrodrive.jit.slices import Halt
from vibrodrive.model import choices, physical, records
from vibrodrive.model.plan import Plan, make_plan

SHOWN = 12  # largest number of excitation periods drawn; motions of the periods 1, 2, 3, 4 and 6 join at its ends
POINTS = 100  # points of a curve per excitation period
FAST = 8  # points per period of the disturbance; with fewer points its waves disappear or look like a slow wave
MOST_POINTS = 20_000  # most points of a curve; a curve with many points per period is drawn over fewer periods
TURN = 2.0 * math.pi
OF_LIMIT = "A", "B", "eta", "xi0", "dxi0", "tau0"  # parameters on which a limit depends


def motion_at(plan: Plan, halt: Halt, most: int = MOST_POINTS) -> trajectory.Trajectory:
    """Return the motion of a plan, equal to the result of `simulate`, over up to SHOWN periods, or over fewer if its
    curve would have more points than `most`. Raises Halted."""
    few = max(1, min(SHOWN, plan.settings.periods, most // _density(plan.scalars)))
    return trajectory.follow(replace(plan, settings=replace(plan.settings, periods=few)), halt)


def _density(known: Mapping[str, Any]) -> int:
    """Return the number of points of a curve per excitation period."""
    return max(POINTS, math.ceil(FAST * known["eta"])) if known["eps"] > 0.0 else POINTS


def undisturbed(plan: Plan) -> Plan:
    """Return the plan of the same motion without a disturbance, ε or Δτ, whose structure is compared."""
    settings = replace(plan.settings, method=choices.Method.CERTIFIED)
    return replace(plan, scalars={**plan.scalars, "eps": 0.0}, settings=settings)


def curve_of(motion: trajectory.Trajectory) -> dict[str, np.ndarray]:
    """Return time (periods since the transient), ξ and ξ' along a motion as float32, NaN where ξ' jumps; and the state
    (int8) between each point and the next."""
    from vibrodrive.figures.curves import curve  # imports Matplotlib: here, so that the page appears sooner

    a = motion.arguments
    drawn = curve(motion, min(MOST_POINTS, _density(a)))
    tau, xi, dxi = drawn.tau, drawn.xi, drawn.dxi
    rows = motion.switches
    first = rows["before"][0] if len(rows) else motion.sample(1).state[0]
    ends, states = TURN * rows["period"] + rows["phase"], np.concatenate([[first], rows["after"]])
    middles = 0.5 * (tau + np.append(tau[1:], tau[-1]))
    time = tau / TURN - _start(motion)
    found = {name: array.astype(np.float32) for name, array in (("time", time), ("xi", xi), ("dxi", dxi))}
    return {**found, "state": states[np.searchsorted(ends, middles, "right")].astype(np.int8)}


def _start(motion: trajectory.Trajectory) -> float:
    """Return the time at which the record of a motion begins, in excitation periods."""
    return motion.arguments["transient"] + float(motion.arguments["tau0"]) / TURN


def beats_of(motion: trajectory.Trajectory, plan: Plan, view: View) -> dict[str, np.ndarray]:
    """Return times (periods since the transient) and speeds of all impacts of a motion, and the ordinates of its dots
    in the diagram of a view with the time of the impact that makes each, as float32: the last one before it, because
    after an impact the mass is at rest, whatever was before."""

    def times(rows: np.ndarray) -> np.ndarray:
        return rows["period"] + rows["phase"] / TURN - _start(motion)

    hits, row = motion.switches[motion.switches["after"] == vd.State.IMPACT], records.QUANTITIES[view.quantity]
    when, dots = times(motion.impacts), motion.impacts["speed"][:0]
    if view.sectioned:
        first = view.section_phase / TURN - _start(motion)
        when = first - math.ceil(first) + 1.0 + np.arange(len(motion.section))
        dots = motion.section[:, [one.name for one in records.SECTION.quantities].index(row.name)]
    elif view.mode == DIAGRAM:
        dots = motion.impacts[row.name.removeprefix("impact_")]
    made = times(hits)[np.searchsorted(times(hits), when, "right") - 1] if len(hits) else when[:0]
    found = {"hit_time": times(hits), "hit_speed": -hits["dxi"], "dot_time": made[: len(dots)]}
    found["dot"] = physical.measure(row, plan.scalars).of(dots)
    return {name: array.astype(np.float32) for name, array in found.items()}


def words(plan: Plan, view: View, halt: Halt) -> dict[str, Any]:
    """Return status, period and impacts of the record of a plan, and the lines that `simulate` describes it with."""
    record = sweep.compute(replace(plan, record=(records.ERROR,)), 0, 1, halt=halt)  # `simulate` bounds the error, too
    status, found = choices.Status(int(record.status[0])), describe.long_summary(plan, halt)
    lines = describe.sentences(status, float(record.margin[0]), found, plan)
    if view.scene == SI:
        lines.insert(0, f"A = {plan.scalars['A']:.6g}, B = {plan.scalars['B']:.6g}")
    phase = plan.scalars["tau0"] % TURN
    hits = f"{found['impacts']:.3g} impacts per shake" if found["impacts"] >= 0.0 else ""
    return {"status": status.name, "period": found["period"], "hits": hits, "phase": phase, "details": lines}


def shown_motion(
    view: View, limits: Mapping[str, Any], halt: Halt, most: int = MOST_POINTS
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the description of the motion of a view, with those of its limits that are known, and its curves and
    impacts. Raises Halted."""
    plan = view.motion_plan()
    orbit, motion = undisturbed(plan), motion_at(plan, halt, most)
    arrays = curve_of(motion) | beats_of(motion, plan, view)
    if orbit != plan:
        arrays |= {f"orbit_{name}": array for name, array in curve_of(motion_at(orbit, halt)).items()}
    known = {name: limits.get(str(of)) for name, of in limit_plans(plan).items()}
    return words(plan, view, halt) | {"limits": known}, arrays


def limit_plans(plan: Plan) -> dict[str, Plan]:
    """Return the plans of the limits k₂ of a motion by name: in ε and, with a grid method, in Δτ."""
    of = {name: plan.scalars[name] for name in OF_LIMIT}
    plans = {"eps": make_plan(of | {"record": records.LIMIT})}
    method = choices.Method(plan.settings.method)
    if method in choices.ACTS_ON["dtau"]:
        plans["dtau"] = make_plan(of | {"record": records.LIMIT, "method": method, "eps": plan.scalars["eps"]})
    return plans


def limit_at(plan: Plan, halt: Halt) -> dict[str, Any]:
    """Return k2, last_kept, and how the structure is lost, or why there is no limit. Raises Halted."""
    from vibrodrive.stability import per_point

    blocks: list[Any] = []
    per_point.compute_wave(plan, [(0, 0, 1)], 1, halt, blocks.append)
    (block,) = blocks
    found = {name: values[0].item() for name, values in block.records.items()}
    status = choices.Status(int(block.status[0]))
    why = records.How(found["how"]).meaning if status == choices.Status.OK else status.advice
    # as JavaScript writes them, because JSON has no infinity
    numbers = {name: repr(found[name]).replace("inf", "Infinity") for name in ("k2", "last_kept")}
    return {**numbers, "period": found["orbit_period"], "how": why}
