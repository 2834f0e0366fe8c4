"""What can be drawn of a sweep, from what it recorded: its kinds of figures and their quantities."""

from __future__ import annotations

from typing import Any

from vibrodrive.model.parameters import bad
from vibrodrive.model.records import SECTION, SUMMARIES, SUMMARY

BIFURCATION, POINCARE, MAP = "bifurcation", "poincare", "map"

KINDS = (BIFURCATION, POINCARE, MAP)
"""Of figures of a sweep."""

SECTION_QUANTITIES = ("dxi", "xi")
"""Of diagrams of the section."""

OF_SUMMARY = tuple(q.name for q in SUMMARIES)

OF_EVERY_SWEEP = ("status", "margin")

IMPACT_POWER = "impact_power"
"""`energy` in W, where a sweep has a scene with a mass."""

SCENE_OF_POWER = ("omega0", "mu", "alpha", "mass")
"""What must be known of a scene for a power: each an axis or one number."""

MAP_QUANTITIES = (*OF_SUMMARY, IMPACT_POWER, *OF_EVERY_SWEEP)
"""Of maps over two axes, and of lines over one."""


def choose_drawing(swept: Any, kind: str | None = None, quantity: str | None = None) -> tuple[str | None, str]:
    """The kind of figure and its quantity for a sweep, where either may be left open.

    A quantity of the summary asks for a map. Without any wish the section is drawn if there is one (kind None: the
    diagram that suits the axes), else a map of the period.

    Parameters
    ----------
    swept : Plan or Results
        its axes, scalars and record.
    kind, quantity : str, optional
        one of KINDS; one of SECTION_QUANTITIES for a diagram of the section, of MAP_QUANTITIES for a map.

    Raises
    ------
    ValueError
        for a kind or quantity that is unknown, or was not recorded; and for a map of one motion.
    """
    record = swept.record
    recorded = "this sweep recorded " + ", ".join(record)
    if kind not in (None, *KINDS):
        raise ValueError(bad("kind", kind, "one of " + ", ".join(KINDS)))
    if kind is None and (quantity in MAP_QUANTITIES or (quantity is None and SECTION not in record)):
        kind = MAP
    if kind != MAP:
        if SECTION not in record:
            raise ValueError(bad("kind", kind or BIFURCATION, f"{MAP}: {recorded}"))
        if quantity not in (None, *SECTION_QUANTITIES):
            allowed = "one of " + ", ".join(SECTION_QUANTITIES) + (f" for a diagram of kind {kind}" if kind else "")
            raise ValueError(bad("quantity", quantity, allowed))
        return kind, quantity or "dxi"
    if not swept.axes:
        raise ValueError(bad("kind", MAP, "left out for one motion: it has no axis"))
    quantity = quantity or "period"
    known = [*(OF_SUMMARY if SUMMARY in record else ()), *OF_EVERY_SWEEP]
    if quantity == IMPACT_POWER and SUMMARY in record:
        missing = [name for name in SCENE_OF_POWER if name not in swept.axes and name not in swept.scalars]
        if missing:
            allowed = f"energy: a power needs {', '.join(missing)} of a scene in SI units with an axis"
            raise ValueError(bad("quantity", quantity, allowed))
    elif quantity not in known:
        raise ValueError(bad("quantity", quantity, f"one of {', '.join(known)}: {recorded}"))
    return kind, quantity


def merge_wishes(wanted: dict[str, Any], now: dict[str, Any]) -> dict[str, Any]:
    """What a configuration wants drawn, and what is asked for now: of the former what does not contradict the latter.

    Its range is of its quantity, and goes with it.
    """
    kept = dict(wanted)
    merged = kept | now
    suits = MAP_QUANTITIES if merged.get("kind") == MAP else SECTION_QUANTITIES
    if "kind" in merged and merged.get("quantity", suits[0]) not in suits:
        kept.pop("kind" if "quantity" in now else "quantity", None)
    if (
        now.keys() - {"x", "y"}
        and "quantity" in (now | wanted)
        and (kept | now).get("quantity") != wanted.get("quantity")
    ):
        kept.pop("limits", None)
    return kept | now
