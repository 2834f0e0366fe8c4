"""The failure map from a configuration into a file: switches judged over two axes, and limits beside them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from vibrodrive.errors import ConfigError
from vibrodrive.model.config import Config
from vibrodrive.model.parameters import bad
from vibrodrive.stability.failures import KINDS, METHODS, failures_of_methods
from vibrodrive.stability.limit import each_limit
from vibrodrive.store.failures import SECOND, lay_out
from vibrodrive.store.file import made_already, new_file

JUDGED = 10
"""Excitation periods of each motion whose switches are judged."""


def run_failures(
    config: Config,
    out: str | Path,
    progress: Callable[[int, int], None] | None = None,
    *,
    threads: int | None = None,
    overwrite: bool = False,
) -> Path:
    """Compute the failure map of a configuration with the axes A and dtau, or A and eps, into a new file.

    Nothing is done if it is there already: an unfinished one cannot be, as it gets its name at the end.
    With `overwrite` a result file of that name is replaced.

    Raises
    ------
    ConfigError
        if the axes are others, have one value, or do not ascend.
    Different
        if the file there was made from another configuration.
    NoResult
        if there is something else of that name.
    OSError
        if the system refuses.
    """
    plan = config.plan()
    names = list(plan.axes)
    if len(names) != 2 or names[0] != "A" or names[1] not in SECOND:
        raise ConfigError(bad("axes", ", ".join(names) or "none", "A and dtau, or A and eps"))
    for name, values in plan.axes.items():
        if len(values) < 2 or (np.diff(values) <= 0).any():
            raise ConfigError(bad(name, values.tolist(), "at least two values, ascending, for a map"))
    other = names[1]
    if plan.axes[other][0] == 0.0:
        raise ConfigError(bad(other, 0.0, "> 0: this axis of the map is logarithmic"))
    if np.isnan(plan.scalars["dtau"]) and other == "eps":
        raise ConfigError("dtau is missing: both methods need a grid step")
    say = progress or (lambda done, total: None)
    shape = (len(METHODS), *plan.shape)
    total = len(METHODS) * (plan.n_points + plan.shape[0])
    done = 0
    common = {k: v for k, v in config.arguments.items() if k not in (*names, "method", "scan")}
    path = Path(out)
    if not overwrite and made_already(path, "failures", plan, given=config.arguments):
        return path
    with new_file(path, seal=True) as file:
        lay_out(file, plan.axes, shape, config)
        counts = {kind: np.zeros(shape, np.int64) for kind in ("judged", *KINDS)}
        for m, at, found in failures_of_methods(plan, JUDGED, threads):
            i, j = divmod(at, shape[-1])
            for kind, value in found._asdict().items():
                counts[kind][m, i, j] = value
            done += 1
            say(done, total)
            if j == shape[-1] - 1:
                for kind, array in counts.items():
                    file[kind][m, i] = array[m, i]
                file.flush()
        for m, method in enumerate(METHODS):
            for i, limit in each_limit({"A": plan.axes["A"], **common}, other, method, threads=threads):
                file["limit"][m, i] = limit.k2
                done += 1
                say(done, total)
    return path
