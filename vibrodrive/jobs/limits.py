"""Limits over an A axis, from a configuration into a file, filled limit by limit, resumed where it stopped."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from vibrodrive.batch.sweep import sweep
from vibrodrive.model.config import Config, ConfigError
from vibrodrive.model.parameters import bad
from vibrodrive.stability.limit import limits
from vibrodrive.store.limits import CURVES, DONE, SHOWN, create, refuse_another, write_limit, writing


def run_limits(
    config: Config,
    out: str | Path,
    progress: Callable[[int, int], None] | None = None,
    *,
    criterion: str = "impacts",
    threads: int | None = None,
    overwrite: bool = False,
) -> Path:
    """Compute the limits over the A axis of a configuration into a file; go on with one that is there.

    Parameters
    ----------
    config : Config
        its one axis must be A. B, eta, transient, periods (1000 and 1500 unless given), the start, the
        section and tol are those of every motion; eps, if given, disturbs those whose limit in Δτ is sought.
    out : path
    progress : callable, optional
        called with (limits known, of how many).
    criterion : str
        see `limits.limit`.
    overwrite : bool
        begin anew, in the place of a result file that is there.

    Raises
    ------
    ConfigError
        if the axes are others than A.
    Different
        if the file was made from another configuration.
    NoResult
        if there is something else than a result file, and it is to be replaced.
    Busy
        if another process is writing the file.
    TypeError, ValueError, OSError
        as `limits.limits` and the system do.
    """
    plan = config.plan()
    if list(plan.axes) != ["A"]:
        raise ConfigError(bad("axes", ", ".join(plan.axes) or "none", "A alone: limits are sought over A"))
    A = plan.axes["A"]
    common = {k: v for k, v in config.arguments.items() if k not in ("A", "method", "dtau", "scan")}
    limits(A[:1], criterion=criterion, threads=threads, **common)  # refuses before a file is made
    path = Path(out)
    if overwrite or not path.exists():
        create(path, config, A, criterion)
    say = progress or (lambda done, total: None)
    with writing(path) as file:
        refuse_another(file, path, config, criterion)
        if not np.isfinite(file["section_dxi"][...]).any():
            undisturbed = common | {"A": file["A_fine"][...], "eps": 0.0, "periods": SHOWN, "threads": threads}
            file["section_dxi"][...] = sweep(**undisturbed).section[..., 1]
            file.flush()
        known = int((file["status"][...] == DONE).sum())
        total = file["status"].size
        for c, (disturbance, method) in enumerate(CURVES):
            missing = np.flatnonzero(file["status"][c] != DONE)
            if not len(missing):
                continue
            for i, found in limits(A[missing], disturbance, method, criterion, threads=threads, **common):
                write_limit(file, c, int(missing[i]), found)
                known += 1
                say(known, total)
    return path
