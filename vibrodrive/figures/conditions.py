"""Texts in figures about the motions shown: their common parameters, and their statuses."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from vibrodrive.figures.style import equation
from vibrodrive.model.choices import Method, Status
from vibrodrive.model.drawing import STARTS

ALWAYS_SAID = ("A", "B", "a0", "omega0", "frequency", "mu", "alpha", "mass", "eps")
PANELS = 6  # largest number of panels of one figure

COUNTED = (Status.TOO_CLOSE, Status.BUDGET, Status.NEVER_LEAVES, Status.NOT_COMPUTED)
"""Statuses whose points are counted in the note of a figure; figures of limits show where others are."""

_T = TypeVar("_T")


def conditions(known: Mapping[str, Any], apart: Collection[str] = (), *, section: bool = True) -> list[str]:
    """Return the conditions common to all motions as phrases, without the parameters in `apart`.

    `known` contains parameters, `method`, `transient` and `periods`, like the `arguments` of a trajectory or the result
    of `of_sweep`. If `section`, the phase of the section is included.
    """
    disturbed = "eps" in apart or known.get("eps", 0.0) > 0.0
    names = [*ALWAYS_SAID, *(["eta"] if disturbed else [])]
    said = [equation(n, known[n]) for n in names if n in known and n not in apart]
    if "method" in known:
        method = Method(known["method"])
        said.append(method.name.lower())
        if method != Method.CERTIFIED and "dtau" not in apart:
            said.append(equation("dtau", known["dtau"]))
    if {"transient", "periods"} <= known.keys():
        said.append(f"periods {known['transient'] + 1}–{known['transient'] + known['periods']}")
    last = [*(["section_phase"] if section else []), *STARTS]
    return said + [equation(n, known[n]) for n in last if n in known and n not in apart]


def of_sweep(results: Any) -> dict[str, Any]:
    """Return the scalars and settings of a sweep, which are common to all points."""
    return {**results.scalars, **vars(results.settings)}


def status_phrases(status: np.ndarray) -> list[str]:
    """Return the number of points of each status of COUNTED as phrases.

    For example: "not computed: 3 of 100 points", "out of budget: 2".
    """
    counts = {s.words: int((status == s).sum()) for s in COUNTED}
    found = [f"{name}: {count}" for name, count in counts.items() if count]
    return [f"{found[0]} of {status.size} points", *found[1:]] if found else []


def rest_phrases(dxi: np.ndarray, status: np.ndarray) -> list[str]:
    """Return the share of section points with ξ' = 0 as a phrase. `dxi` (…, n) or (…) has the status (…).

    Motions that rest permanently are not counted, because their status says so.
    """
    moving = dxi[status != Status.NEVER_LEAVES]
    known = np.count_nonzero(np.isfinite(moving))
    rests = np.count_nonzero(moving == 0.0)
    if not rests:
        return []
    all_of_them = "at rest at every section point (another section phase may show the motion)"
    return [all_of_them if rests == known else f"at rest at {100 * rests / known:.2g} % of the section points"]


def some(items: Sequence[_T]) -> list[_T]:
    """Return at most PANELS of the items, evenly spaced, with the first and the last."""
    if len(items) <= PANELS:
        return list(items)
    return [items[round(k)] for k in np.linspace(0, len(items) - 1, PANELS)]


def choice(shown: int, total: int, of: str) -> list[str]:
    """Return ["6 of 9 panels shown"] if some panels or lines are not shown, and [] if all are shown."""
    return [f"{shown} of {total} {of} shown"] if shown < total else []
