"""The motion that the page shows: its curve with the state of each piece, its description, and its limits k₂."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from vibrodrive.batch import describe, sweep, trajectory
from vibrodrive.explorer.view import SI, View
from vibrodrive.jit.slices import Halt
from vibrodrive.model import choices, records
from vibrodrive.model.plan import Plan, make_plan

SHOWN = 12  # largest number of excitation periods drawn; motions of the periods 1, 2, 3, 4 and 6 join at its ends
POINTS = 100  # points of a curve per excitation period
FAST = 8  # points per period of the disturbance; with fewer points its waves disappear or look like a slow wave
MOST_POINTS = 20_000  # most points of a curve; a curve with many points per period is drawn over fewer periods
OF_LIMIT = "A", "B", "eta", "xi0", "dxi0", "tau0"  # parameters on which a limit depends


def motion_at(plan: Plan, halt: Halt) -> trajectory.Trajectory:
    """Return the motion of a plan, equal to the result of `simulate` over up to SHOWN periods. Raises Halted."""
    few = replace(plan.settings, periods=min(SHOWN, plan.settings.periods))
    return trajectory.follow(replace(plan, settings=few), halt)


def undisturbed(plan: Plan) -> Plan:
    """Return the plan of the same motion without a disturbance, ε or Δτ, whose structure is compared."""
    settings = replace(plan.settings, method=choices.Method.CERTIFIED)
    return replace(plan, scalars={**plan.scalars, "eps": 0.0}, settings=settings)


def curve_of(motion: trajectory.Trajectory) -> dict[str, np.ndarray]:
    """Return time (periods since the transient), ξ and ξ' along a motion as float32, NaN where ξ' jumps; and the state
    (int8) between each point and the next."""
    from vibrodrive.figures.curves import curve  # imports Matplotlib: here, so that the page appears sooner

    a = motion.arguments
    drawn = curve(motion, max(POINTS, math.ceil(FAST * a["eta"])) if a["eps"] > 0.0 else POINTS)
    tau, xi, dxi = (getattr(drawn, name)[:MOST_POINTS] for name in ("tau", "xi", "dxi"))
    rows = motion.switches
    first = rows["before"][0] if len(rows) else motion.sample(1).state[0]
    ends, states = 2.0 * math.pi * rows["period"] + rows["phase"], np.concatenate([[first], rows["after"]])
    middles = 0.5 * (tau + np.append(tau[1:], tau[-1]))
    time = (tau - 2.0 * math.pi * a["transient"] - a["tau0"]) / (2.0 * math.pi)
    found = {name: array.astype(np.float32) for name, array in (("time", time), ("xi", xi), ("dxi", dxi))}
    return {**found, "state": states[np.searchsorted(ends, middles, "right")].astype(np.int8)}


def words(plan: Plan, view: View, halt: Halt) -> dict[str, Any]:
    """Return status, period and impacts of the record of a plan, and the lines that `simulate` describes it with."""
    record = sweep.compute(replace(plan, record=(records.ERROR,)), 0, 1, halt=halt)  # `simulate` bounds the error, too
    status, found = choices.Status(int(record.status[0])), describe.long_summary(plan, halt)
    lines = describe.sentences(status, float(record.margin[0]), found, plan)
    if view.scene == SI:
        lines.insert(0, f"A = {plan.scalars['A']:.6g}, B = {plan.scalars['B']:.6g}")
    phase = plan.scalars["tau0"] % (2.0 * math.pi)
    hits = f"{found['impacts']:.3g} impacts per shake" if found["impacts"] >= 0.0 else ""
    return {"status": status.name, "period": found["period"], "hits": hits, "phase": phase, "details": lines}


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
