"""Motion at a point of a diagram: its curves, coloured by state, and its description."""

from __future__ import annotations

import functools
import html
import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from vibrodrive.batch.describe import sentences, summary_of
from vibrodrive.batch.trajectory import Trajectory, follow
from vibrodrive.explorer.controls import symbol
from vibrodrive.explorer.view import SI, View
from vibrodrive.jit.slices import Halt
from vibrodrive.model.plan import Plan
from vibrodrive.model.states import LASTING

SHOWN = 12  # largest number of excitation periods drawn
POINTS = 100  # points of a curve per excitation period
FAST = 8  # points per period of the disturbance; with fewer points its waves disappear or look like a slow wave
MOST_POINTS = 20_000  # most points of a curve; a curve with many points per period is drawn over fewer periods


class Motion(NamedTuple):
    """Motion at `x`, with its plan and its summary, whose names are those of vibrodrive/model/records.py."""

    x: float
    plan: Plan
    trajectory: Trajectory
    summary: dict[str, Any]


def nearest(view: View) -> tuple[float, Plan]:
    """Return the x of the column nearest to `view.at`, and the plan of the motion of that column."""
    plan = view.plan()
    across = plan.axes[view.x]  # a diagram has only this axis
    column = int(np.argmin(np.abs(across - view.at)))
    return float(across[column]), plan.single(column)


def motion_at(view: View, halt: Halt) -> Motion:
    """Return the motion at `view.at`, equal to the result of `simulate` over up to SHOWN periods. Raises Halted."""
    x, whole = nearest(view)
    few = replace(whole, settings=replace(whole.settings, periods=min(SHOWN, view.periods)))
    trajectory = follow(few, halt)
    return Motion(x, whole, trajectory, summary_of(whole, halt))


def lines(trajectory: Trajectory) -> dict[str, list[np.ndarray]]:
    """Return time (periods since the transient), ξ and ξ' of the curve of each state of LASTING, with NaN outside it.

    One more curve contains sin τ in place of ξ, scaled to the lowest third of the range of ξ.
    """
    from vibrodrive.figures.curves import curve  # imports Matplotlib; imported here so that the page appears sooner

    drawn = curve(trajectory, _density(trajectory))
    if len(drawn.tau) > MOST_POINTS:
        drawn = drawn._replace(**{name: getattr(drawn, name)[:MOST_POINTS] for name in ("tau", "xi", "dxi")})
    ends, states = _switches(trajectory)
    # a point at a switch belongs to both states, so that the curves join
    before, after = (states[np.searchsorted(ends, drawn.tau, side)] for side in ("left", "right"))
    here = [(before == state) | (after == state) for state in LASTING]
    known = drawn.xi[np.isfinite(drawn.xi)]
    low, high = (known.min(), known.max()) if known.size else (0.0, 0.0)
    drive = low + (1.0 + np.sin(drawn.tau)) / 6.0 * (high - low or 1.0)
    return {
        "time": [_time(trajectory, drawn.tau)] * (len(LASTING) + 1),
        "xi": [*(np.where(there, drawn.xi, np.nan) for there in here), drive],
        "dxi": [*(np.where(there, drawn.dxi, np.nan) for there in here), np.full(len(drive), np.nan)],
    }


def forces(trajectory: Trajectory) -> dict[str, np.ndarray]:
    """Return for the drawing: ξ, the force H and sin τ over time; the times at which states begin; these states.

    Times are those of `lines`. A state is its index in LASTING, or -1 for an impact.
    """
    sample = trajectory.sample(_density(trajectory))
    ends, states = _switches(trajectory)
    return {
        "time": _time(trajectory, sample.tau)[:MOST_POINTS],
        "xi": sample.xi[:MOST_POINTS],
        "H": sample.H[:MOST_POINTS],
        "sine": np.sin(sample.tau)[:MOST_POINTS],
        "begins": np.concatenate([[0.0], _time(trajectory, ends)]),
        "states": np.array([LASTING.index(state) if state in LASTING else -1 for state in states]),
    }


def _density(trajectory: Trajectory) -> int:
    """Return the number of points per excitation period."""
    a = trajectory.arguments
    return max(POINTS, math.ceil(FAST * a["eta"])) if a["eps"] > 0.0 else POINTS


def _switches(trajectory: Trajectory) -> tuple[np.ndarray, np.ndarray]:
    """Return (instants τ of the switches, states before the first switch and after each switch)."""
    rows = trajectory.switches
    first = rows["before"][0] if len(rows) else trajectory.sample(1).state[0]
    return 2.0 * math.pi * rows["period"] + rows["phase"], np.concatenate([[first], rows["after"]])


def _time(trajectory: Trajectory, tau: np.ndarray) -> np.ndarray:
    """Return instants τ as excitation periods since the transient."""
    a = trajectory.arguments
    return (tau - 2.0 * math.pi * a["transient"] - a["tau0"]) / (2.0 * math.pi)


@functools.cache
def warm() -> None:
    """Load or compile the kernels of a motion and its curves."""
    lines(motion_at(View.read({"columns": 200, "at": View().low}), Halt()).trajectory)


def words(motion: Motion, view: View) -> list[str]:
    """Return the description of a motion, as lines of HTML."""
    t = motion.trajectory
    said = [f"<b>{symbol(view.x)} = {motion.x!r}</b>"]
    if view.scene == SI:
        said.append(f"A = {t.arguments['A']:.6g}, B = {t.arguments['B']:.6g}")
    status, *rest = sentences(t.status, t.margin, motion.summary, motion.plan)
    status = status.replace(t.status.name, t.status.name.replace("_", " "), 1)
    return said + [html.escape(line) for line in (status, *rest)]
