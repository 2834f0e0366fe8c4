"""`vibrodrive limits CONFIG`: a table, a file and a figure of limits over A, B or η. A partial file is resumed."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any

import h5py
import numpy as np

from vibrodrive.errors import ConfigError
from vibrodrive.figures.limits import limits_figure
from vibrodrive.jobs.runner import Recipe, Work
from vibrodrive.model.config import Config
from vibrodrive.model.parameters import bad_axes
from vibrodrive.model.plan import Plan
from vibrodrive.stability.limit import AXES, Limit, each_limit
from vibrodrive.stability.limits import K2, QUANTITIES, Limits, check_quantity, undisturbed_diagram
from vibrodrive.store.limits import DONE, create, own_settings, refuse_another, write_limit, writing


def check(config: Config, plan: Plan) -> dict[str, Any]:
    """Return the settings of the command (`own_settings`). Raises an error for invalid axes and arguments.

    The axes must be one or two of A, B and eta.
    """
    names = list(plan.axes)
    if not 1 <= len(names) <= 2 or not set(names) <= set(AXES):
        raise ConfigError(bad_axes(names, "one or two of A, B and eta"))
    quantity, criterion = _judged(config)
    each_limit(plan.axes | _common(config, plan), *QUANTITIES[quantity].curves[0], criterion)
    return own_settings(config, criterion)


def make(work: Work) -> bool:
    """Compute the limits that are missing in a file, and write each limit as soon as it is found.

    The axes are those of the configuration. The other parameters of the configuration apply to all motions: transient
    (default 1000), periods (default 1500), the start, the section and tol. If `eps` is given, the motions of the search
    for limits in Δτ are also disturbed by this ε.
    """
    config, plan = work.config, work.plan
    quantity, criterion = _judged(config)
    if not work.resume:
        create(work.path, config, plan.axes, criterion, quantity)
    with writing(work.path) as file:
        refuse_another(file, work.path, config, criterion, quantity)
        if "section_dxi" in file and not np.isfinite(file["section_dxi"][...]).any():
            file["section_dxi"][...] = undisturbed_diagram(_common(config, plan), file["A_fine"][...], work.threads)
            file.flush()
        before = known = int((file["status"][...] == DONE).sum())
        total = file["status"].size
        for c, at, found in _missing_limits(file, work, quantity, criterion):
            write_limit(file, c, at, found)
            known += 1
            work.progress(known, total)
    return known > before


def _judged(config: Config) -> tuple[str, str]:
    """Return (quantity, criterion) of a configuration."""
    quantity = config.limits.get("quantity", K2)
    return quantity, check_quantity(quantity, config.limits.get("criterion"))


def _common(config: Config, plan: Plan) -> dict[str, Any]:
    return {k: v for k, v in config.arguments.items() if k not in (*plan.axes, "method", "dtau", "scan")}


def _missing_limits(
    file: h5py.File, work: Work, quantity: str, criterion: str
) -> Iterator[tuple[int, tuple[int, ...], Limit]]:
    """Yield (curve, index of the point, limit) for each limit that is missing in a file."""
    plan, common = work.plan, _common(work.config, work.plan)
    names = list(plan.axes)
    for c, (disturbance, method) in enumerate(QUANTITIES[quantity].curves):
        # at ε = 0 the limits in Δτ do not depend on η, so one search is enough for all η
        free = disturbance == "dtau" and plan.scalars["eps"] == 0.0 and "eta" in names
        along = names.index("eta") if free else None
        for box in boxes(file["status"][c] != DONE):
            sought = [where[:1] if k == along else where for k, where in enumerate(box)]
            values = {name: plan.axes[name][where] for name, where in zip(names, sought, strict=True)}
            for i, found in each_limit(values | common, disturbance, method, criterion, work.threads):
                index = np.unravel_index(i, tuple(map(len, sought)))
                place = [where[[k]] for where, k in zip(sought, index, strict=True)]
                if along is not None:
                    place[along] = box[along]
                for at in product(*(where.tolist() for where in place)):
                    if along is not None:
                        found = replace(found, eta=float(plan.axes["eta"][at[along]]))
                    yield c, at, found


def boxes(missing: np.ndarray) -> Iterator[tuple[np.ndarray, ...]]:
    """Yield disjoint sets that together contain exactly the True entries of a bool array with one or two axes.

    A set is given by one array of indices for each axis. It contains all combinations of these indices.
    """
    if missing.ndim == 1:
        if missing.any():
            yield (np.flatnonzero(missing),)
        return
    rows, kind = np.unique(missing, axis=0, return_inverse=True)
    for k, row in enumerate(rows):
        if row.any():
            yield np.flatnonzero(kind.reshape(-1) == k), np.flatnonzero(row)


def table(found: Limits) -> str:
    """Return a table as text: a head, a line for each point, and a line that explains the limits.

    The line of a point contains the values of the axes, the period n of the undisturbed orbit, and the limits k2 with
    their velocity amplitudes V. With Muller's method a limit in Δτ has no V, because switches are not late by Δτ. With
    a scene in SI units the line also contains V in mm/s. "-" means unknown; "<" marks an upper bound.
    """
    k, values, V = found.quantity, found.values, found.numbers["velocity"]
    below = (found.numbers["kept_below"] == 0.0) & np.isfinite(values)  # below the smallest value tried
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
    return "\n".join([*lines, meaning])


def _number(value: float, bound: bool) -> str:
    return "-" if np.isnan(value) else f"{'<' if bound else ''}{value:.4g}"


RECIPE = Recipe(check, make, lambda found, threads: [limits_figure(found)], table, Limits.facts, partial=True)
