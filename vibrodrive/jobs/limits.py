"""Limits over A, B or η, from a configuration into a file, filled limit by limit, resumed where it stopped."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias

import h5py
import numpy as np

from vibrodrive.errors import ConfigError
from vibrodrive.model.config import Config
from vibrodrive.model.parameters import bad
from vibrodrive.model.plan import Plan
from vibrodrive.stability.limit import AXES, Limit
from vibrodrive.stability.limits import (
    K1,
    K2,
    KU,
    QUANTITIES,
    Limits,
    check_quantity,
    each_of,
    undisturbed_diagram,
)
from vibrodrive.stability.starts import StartLimit
from vibrodrive.stability.unique_motion import UniqueLimit
from vibrodrive.store.limits import DONE, create, refuse_another, write_limit, writing

Found: TypeAlias = Limit | StartLimit | UniqueLimit

Each: TypeAlias = Callable[[dict[str, Any], str, str], Iterator[tuple[int, Found]]]
"""The limits of one disturbance and path at some values of the axes."""


def run_limits(
    config: Config,
    out: str | Path,
    progress: Callable[[int, int], None] | None = None,
    *,
    quantity: str = K2,
    criterion: str | None = None,
    threads: int | None = None,
    overwrite: bool = False,
) -> Path:
    """Compute the limits over the axes of a configuration into a file; go on with one that is there.

    Parameters
    ----------
    config : Config
        its axes must be one or two of A, B and eta. The other parameters, transient, periods (1000 and 1500 unless
        given), the start, the section and tol are those of every motion; eps, if given, disturbs those whose limit in
        Δτ is sought.
    out : path
    progress : callable, optional
        called with (limits known, of how many).
    quantity : "k2", "k1" or "ku"
        see `vd.limit`, `vd.start_limit` (over one axis, A or B) and `vd.unique_limit`.
    criterion : str, optional
        of k2, see `vd.limit`.
    overwrite : bool
        begin anew, in the place of a result file that is there.

    Raises
    ------
    ConfigError
        if the axes are others.
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
    names = list(plan.axes)
    if not 1 <= len(names) <= 2 or not set(names) <= set(AXES):
        raise ConfigError(bad("axes", ", ".join(names) or "none", "one or two of A, B and eta"))
    if quantity == K1 and len(names) > 1:
        raise ConfigError(bad("axes", ", ".join(names), f"one, for {K1}"))
    judged = check_quantity(quantity, criterion)
    common = {k: v for k, v in config.arguments.items() if k not in (*names, "method", "dtau", "scan")}

    def each(arguments: dict[str, Any], disturbance: str, method: str) -> Iterator[tuple[int, Found]]:
        return each_of(quantity, arguments | common, disturbance, method, judged, threads)

    each(dict(plan.axes), *QUANTITIES[quantity].curves[0])  # refuses before a file is made
    path = Path(out)
    if overwrite or not path.exists():
        create(path, config, plan.axes, judged, quantity)
    say = progress or (lambda done, total: None)
    with writing(path) as file:
        refuse_another(file, path, config, judged, quantity)
        if "section_dxi" in file and not np.isfinite(file["section_dxi"][...]).any():
            file["section_dxi"][...] = undisturbed_diagram(common, file["A_fine"][...], threads)
            file.flush()
        known = int((file["status"][...] == DONE).sum())
        total = file["status"].size
        for c, at, found in _missing_limits(file, plan, QUANTITIES[quantity].curves, each):
            write_limit(file, c, at, found)
            known += 1
            say(known, total)
    return path


def _missing_limits(
    file: h5py.File, plan: Plan, curves: Sequence[tuple[str, str]], each: Each
) -> Iterator[tuple[int, tuple[int, ...], Found]]:
    """(curve, index of the point, limit) of all that a file does not have yet, as they are found."""
    names = list(plan.axes)
    for c, (disturbance, method) in enumerate(curves):
        # where ε = 0, the limits in Δτ know nothing of η: one search answers for all of its values
        free = disturbance == "dtau" and plan.scalars["eps"] == 0.0 and "eta" in names
        along = names.index("eta") if free else None
        for box in boxes(file["status"][c] != DONE):
            sought = [where[:1] if k == along else where for k, where in enumerate(box)]
            values = {name: plan.axes[name][where] for name, where in zip(names, sought, strict=True)}
            for i, found in each(values, disturbance, method):
                index = np.unravel_index(i, tuple(map(len, sought)))
                place = [where[[k]] for where, k in zip(sought, index, strict=True)]
                if along is not None:
                    place[along] = box[along]
                for at in product(*(where.tolist() for where in place)):
                    if along is not None and not isinstance(found, StartLimit):
                        found = replace(found, eta=float(plan.axes["eta"][at[along]]))
                    yield c, at, found


def boxes(missing: np.ndarray) -> Iterator[tuple[np.ndarray, ...]]:
    """The True of a bool array of one or two axes as products of indices along each axis: rows alike are one box."""
    if missing.ndim == 1:
        if missing.any():
            yield (np.flatnonzero(missing),)
        return
    rows, kind = np.unique(missing, axis=0, return_inverse=True)
    for k, row in enumerate(rows):
        if row.any():
            yield np.flatnonzero(kind.reshape(-1) == k), np.flatnonzero(row)


def table(found: Limits) -> str:
    """A line for each point: its place on the axes, n, and the limits: k2 or ku, and the velocity amplitude V in ε; k1.

    A limit in Δτ is a velocity as it stands (of switches on the grid; after Muller's method they are not late by Δτ).
    For a scene in SI units V stands there in mm/s, too. "-" is what is not known; "<" marks an upper bound.
    """
    k, values = found.quantity, found.values
    kept = found.numbers["several_below" if k == KU else "kept_below"]
    below = (kept == 0.0) & (values > 0.0) & np.isfinite(values)  # lost at the smallest value tried
    if k == K1:
        heads, columns = [*found.axes, "n", *(f"k1({name})" for name, _ in found.curves)], list(values)
        bounds = list(below)
        meaning = "k1: how far this coordinate of the start may be off; inf where every start ends on one solution"
    else:
        V = found.numbers["velocity"]
        heads = [*found.axes, "n", f"{k}(eps)", "V(eps)", "V(fixed)", f"{k}(muller)"]
        columns = [values[0], V[0], V[1], values[2]]
        bounds = [below[0], below[0], below[1], below[2]]
        meaning = f"V is the velocity amplitude: {k}(eps) eta A, and {k}(dtau) for switches on the grid (fixed)"
        if found.mm_s is not None:
            heads += ["eps, mm/s", "fixed, mm/s"]
            columns += [found.mm_s * V[0], found.mm_s * V[1]]
            bounds += [below[0], below[1]]
    lines = ["  ".join(f"{head:>12}" for head in heads)]
    n = found.n.max(axis=0)
    for at in np.ndindex(n.shape):
        place = [f"{ticks[i]:.6g}" for ticks, i in zip(found.axes.values(), at, strict=True)]
        numbers = [_number(column[at], bound[at]) for column, bound in zip(columns, bounds, strict=True)]
        cells = [*place, str(n[at]) if n[at] else "-", *numbers]
        lines.append("  ".join(f"{cell:>12}" for cell in cells))
    lines.append(meaning)
    return "\n".join(lines)


def _number(value: float, bound: bool) -> str:
    return "-" if np.isnan(value) else f"{'<' if bound else ''}{value:.4g}"
