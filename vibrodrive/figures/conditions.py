"""Texts of figures about their motions: the parameters that all of them share, and how they went."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from vibrodrive.figures.style import equation
from vibrodrive.model.choices import Method, Status

ALWAYS_SAID = ("A", "B", "a0", "omega0", "mu", "alpha", "mass", "eps")
STARTS = ("xi0", "dxi0", "tau0")
PANELS = 6  # of one figure, at most

STATUS_WORDS = {
    Status.TOO_CLOSE: "too close to a decision",
    Status.BUDGET: "out of budget",
    Status.NEVER_LEAVES: "rests for ever",
    Status.NOT_COMPUTED: "not computed",
}
_T = TypeVar("_T")


def conditions(known: Mapping[str, Any], apart: Collection[str] = (), *, section: bool = True) -> list[str]:
    """Conditions shared by all motions, as phrases, without those `apart`; the phase of the section if `section`.

    `known` has parameters, `method`, `transient` and `periods`: `arguments` of a trajectory, or `of_sweep`.
    """
    disturbed = "eps" in apart or known.get("eps", 0.0) > 0.0
    names = [*ALWAYS_SAID, *(["eta"] if disturbed else [])]
    said = [equation(n, known[n]) for n in names if n in known and n not in apart]
    if "method" in known:
        method = Method(known["method"])
        said.append(method.name.lower())
        if method != Method.CERTIFIED and "dtau" not in apart:
            said.append(equation("dtau", known["dtau"]))
    if "periods" in known:
        said.append(f"periods {known['transient'] + 1}–{known['transient'] + known['periods']}")
    last = [*(["section_phase"] if section else []), *STARTS]
    return said + [equation(n, known[n]) for n in last if n in known and n not in apart]


def of_sweep(results: Any) -> dict[str, Any]:
    """What all points of a sweep share: its scalars and settings."""
    return {**results.scalars, **vars(results.settings)}


def named(quantity: str, text: str) -> str:
    """A label of the limit k₂, or of k_u."""
    return text.replace("k_2", "k_u") if quantity == "ku" else text


def told(status: np.ndarray) -> list[str]:
    """How many points have a status other than OK: "3 of 100 points not computed", "2 rests for ever"."""
    counts = {name: int((status == s).sum()) for s, name in STATUS_WORDS.items()}
    found = [f"{name}: {count}" for name, count in counts.items() if count]
    return [f"of {status.size} points {found[0]}", *found[1:]] if found else []


def some(items: Sequence[_T]) -> list[_T]:
    """At most PANELS of them, evenly spaced, the first and the last among them."""
    if len(items) <= PANELS:
        return list(items)
    return [items[round(k)] for k in np.linspace(0, len(items) - 1, PANELS)]


def choice(shown: int, total: int, of: str) -> list[str]:
    """Says of panels or lines that they are a choice from more, if they are."""
    return [f"{shown} of {total} {of} shown"] if shown < total else []
