"""Additions to a map of a sweep: undisturbed motions, and limits or bifurcations of other files."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vibrodrive.errors import ConfigError
from vibrodrive.model.choices import Method
from vibrodrive.model.names import Settings
from vibrodrive.model.parameters import bad
from vibrodrive.model.plan import Plan
from vibrodrive.model.records import SUMMARY
from vibrodrive.model.results import Results

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
    axes = {name: values for name, values in results.axes.items() if name not in NONE}
    plan = Plan(axes, {**results.scalars, **NONE}, settings, record=(SUMMARY,))
    gaps = Results.collect(plan, run_blocks(plan)).gaps.astype(np.int64)
    return gaps.reshape([1 if name in NONE else len(values) for name, values in results.axes.items()])


def read_overlays(files: Sequence[Path]) -> list[Any]:
    """Read what `plot --over` draws, limits and tables of bifurcations. Raises ConfigError for other files."""
    from vibrodrive.jobs.orbits import read_bifurcations
    from vibrodrive.jobs.tables import ENDING
    from vibrodrive.store.load import load

    found: list[Any] = []
    for file in files:
        if file.suffix.lower() == ENDING:
            found += read_bifurcations(file)
            continue
        results = load(file)
        if not results.plan.seeks:
            raise ConfigError(
                bad("--over", str(file), 'a sweep with record = "limit", or a table of bifurcations (.csv)')
            )
        found.append(results)
    return found
