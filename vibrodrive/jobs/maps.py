"""Undisturbed motions for a map of a sweep."""

import numpy as np

from vibrodrive.batch.block import gather
from vibrodrive.jobs.progress import under_way
from vibrodrive.model.choices import Method
from vibrodrive.model.names import Settings
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import SUMMARY
from vibrodrive.model.results import Results
from vibrodrive.model.variables import constants

NONE = {"eps": 0.0, "dtau": np.nan}  # values without a disturbance


def undisturbed_gaps(results: Results) -> np.ndarray:
    """Return the gaps (numbers of periods between main impacts) of the undisturbed motion at each point.

    The result is int64 (axes…), of length 1 along the axes eps and dtau, with one digit for each gap of a cycle, as in
    a summary. An entry is 0 if the gaps do not repeat. The motions start as in the sweep. They are as long as in
    `limits`, because near a bifurcation a motion settles slowly.
    """
    from vibrodrive.batch.sweep import run_blocks
    from vibrodrive.stability.structure import SETTLING, WATCHED

    s = results.settings
    settings = Settings(int(Method.CERTIFIED), max(SETTLING, s.transient), WATCHED, s.budget)
    plan = Plan({**results.plan.variables, **constants(NONE)}, settings, record=(SUMMARY,))
    with under_way("undisturbed motions"):
        gaps = gather(plan, run_blocks(plan)).gaps.astype(np.int64)
    return gaps.reshape([len(values) if name in plan.axes else 1 for name, values in results.axes.items()])
