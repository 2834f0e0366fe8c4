"""`vibrodrive failures CONFIG`: a file and a figure of a failure map.

The map shows over two axes how many switches a grid method misses, finds late or follows by a wrong state. A line shows
the limits at which the structure of the motion, the repeated pattern of its impacts, is lost.
"""

from itertools import count
from typing import Any

import numpy as np

from vibrodrive.errors import ConfigError
from vibrodrive.figures.failures import failures_figure
from vibrodrive.jobs.runner import Recipe, Work
from vibrodrive.model.config import Config
from vibrodrive.model.names import PARAMETERS
from vibrodrive.model.parameters import bad, bad_axes
from vibrodrive.model.plan import Plan
from vibrodrive.stability.failures import JUDGED, KINDS, METHODS, failures_of_methods
from vibrodrive.stability.limit import PERIODS, each_limit
from vibrodrive.store.failures import SECOND, FailureMap, lay_out
from vibrodrive.store.file import new_file


def check(config: Config, plan: Plan) -> dict[str, Any]:
    """Return {"periods": recorded periods of each motion of the search for limits}.

    Raises ConfigError for axes other than A and dtau, or A and eps, for an axis with fewer than two values or values
    that do not ascend, for an axis dtau or eps that begins at 0, and for axes A and eps without a value of dtau.
    """
    names = list(plan.axes)
    if len(names) != 2 or names[0] != "A" or names[1] not in SECOND:
        raise ConfigError(bad_axes(names, "A and dtau, or A and eps"))
    for name, values in plan.axes.items():
        if len(values) < 2 or (np.diff(values) <= 0).any():
            raise ConfigError(bad(name, values.tolist(), "at least two values in ascending order"))
    other = names[1]
    if plan.axes[other][0] == 0.0:
        raise ConfigError(bad(other, 0.0, "> 0, because this axis of the map is logarithmic"))
    if np.isnan(plan.scalars["dtau"]) and other == "eps":
        needed = f"{PARAMETERS['dtau'].allowed}, the grid step of the methods fixed and muller"
        raise ConfigError(f"dtau is missing: must be given if the axes are A and eps, {needed}")
    return {"periods": config.arguments.get("periods", PERIODS)}


def make(work: Work) -> bool:
    """Judge the switches of each motion, find the limits of each method, and write both at the end."""
    config, plan = work.config, work.plan
    shape = (len(METHODS), *plan.shape)
    total, done = len(METHODS) * (plan.n_points + plan.shape[0]), count(1)
    common = {k: v for k, v in config.arguments.items() if k not in (*plan.axes, "method", "scan")}
    with new_file(work.path, seal=True) as file:
        lay_out(file, config)
        counts = {kind: np.zeros(shape, np.int64) for kind in ("judged", *KINDS)}
        for m, at, found in failures_of_methods(plan, JUDGED, work.threads):
            i, j = divmod(at, shape[-1])
            for kind, value in found._asdict().items():
                counts[kind][m, i, j] = value
            work.progress(next(done), total)
            if j == shape[-1] - 1:
                for kind, array in counts.items():
                    file[kind][m, i] = array[m, i]
                file.flush()
        for m, method in enumerate(METHODS):
            limits = each_limit({"A": plan.axes["A"], **common}, list(plan.axes)[1], method, threads=work.threads)
            for i, limit in limits:
                file["limit"][m, i] = limit.k2
                work.progress(next(done), total)
    return True


RECIPE = Recipe(
    check, make, lambda found, threads: [failures_figure(found)], lambda found: "", FailureMap.facts
)  # fmt: skip
