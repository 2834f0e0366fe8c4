"""Kinds of figures of a sweep, and quantities that can be drawn, depending on the records of the sweep."""

from typing import Any, Literal, get_args

from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import has_units
from vibrodrive.model.records import IMPACTS, SECTION, SUMMARIES, SUMMARY

BIFURCATION, POINCARE, MAP = "bifurcation", "poincare", "map"

FIGURE_KINDS = (BIFURCATION, POINCARE, MAP)

Style = Literal["screen", "print"]
"""Colours that are distinct for colour-blind readers, or the black and white of a journal."""

Width = Literal["double", "single"]  # width of a figure in columns of a page

STYLES: tuple[Style, ...] = get_args(Style)
WIDTHS: tuple[Width, ...] = get_args(Width)

FIGURE_UNITS = SI, DIMENSIONLESS = "SI", "dimensionless"  # units of quantities in figures of a scene

FORMATS = (".png", ".pdf", ".svg")

SECTION_QUANTITIES = ("dxi", "xi")
IMPACT_QUANTITIES = ("impact_phase", "impact_speed")
DIAGRAM_QUANTITIES = (*SECTION_QUANTITIES, *IMPACT_QUANTITIES)
OF_SUMMARY = tuple(q.name for q in SUMMARIES)
OF_EVERY_SWEEP = ("status", "margin")
OF_SECTION = ("last_xi", "last_dxi")
"""ξ and ξ' at the last section point. A map over starts shows which of the coexisting motions each start reaches."""

IMPACT_POWER = "impact_power"  # `energy` as a power in W, with the scene of the sweep

KEPT = "kept"  # 1 if `gaps` equal those of the undisturbed motion, 0 if they differ, -1 if the undisturbed one has none

K2 = "k2"  # limit k₂: the smallest disturbance at which the structure is lost (docs/glossary.md)

OF_CLASSES = ("period", "gaps", "sequence", "status", KEPT)
"""Quantities of maps with one colour for each value, hence without a range."""

MAP_QUANTITIES = (*OF_SUMMARY, KEPT, IMPACT_POWER, *OF_SECTION, *OF_EVERY_SWEEP)
"""Quantities of maps over two axes, and of lines over one axis."""


def check_range(key: str, limits: tuple[float, float] | None, quantity: str) -> None:
    """Refuse a range for a quantity with one colour for each value. Raises ValueError with one sentence."""
    if limits is not None and quantity in OF_CLASSES:
        raise ValueError(bad(key, limits, f"left out, because the colours of {quantity} are classes without a range"))


def choose_drawing(swept: Any, kind: str | None = None, quantity: str | None = None) -> tuple[str | None, str]:
    """Return (kind of figure, quantity) with which a sweep is drawn. The function chooses arguments that are None.

    A quantity of maps (MAP_QUANTITIES) selects a map, a quantity of the impacts a bifurcation diagram. If both
    arguments are None and the sweep has sections, the returned kind is None, too: the caller then chooses a diagram of
    the section that suits the axes. A sweep without sections is drawn as a map of the period or, if it has only
    impacts, as a diagram of their phases.

    `swept` is a Plan or Results. Raises ValueError for an unknown or unrecorded quantity, and for a map of one motion.
    """
    record = swept.record
    if kind not in (None, *FIGURE_KINDS):
        raise ValueError(bad("kind", kind, "one of " + ", ".join(FIGURE_KINDS)))
    if quantity is None and kind in (None, BIFURCATION) and record == (IMPACTS,):
        quantity = IMPACT_QUANTITIES[0]
    if kind is None and (quantity in MAP_QUANTITIES or (quantity is None and SECTION not in record)):
        kind = MAP
    if kind != MAP:
        return _choose_diagram(swept, kind, quantity)
    if not swept.axes:
        raise ValueError(bad("kind", MAP, "left out for one motion, which has no axis"))
    quantity = quantity or "period"
    known = [
        *((*OF_SUMMARY, KEPT) if SUMMARY in record else ()),
        *(OF_SECTION if SECTION in record else ()),
        *OF_EVERY_SWEEP,
    ]
    if quantity == IMPACT_POWER and SUMMARY in record:
        if not has_units({**swept.scalars, **swept.axes}):
            raise ValueError(bad("quantity", quantity, "energy, because impact_power needs a scene in SI units"))
    elif quantity not in known:
        recorded = "this sweep recorded " + ", ".join(record)
        if quantity in (*OF_SUMMARY, KEPT, IMPACT_POWER) and SUMMARY not in record:
            recorded += f', and {quantity} needs record = "{SUMMARY}"'
        raise ValueError(bad("quantity", quantity, f"one of {', '.join(known)}, because {recorded}"))
    return kind, quantity


def _choose_diagram(swept: Any, kind: str | None, quantity: str | None) -> tuple[str | None, str]:
    """Return the result of `choose_drawing` for a figure that is not a map."""
    record = swept.record
    recorded = "this sweep recorded " + ", ".join(record)
    if kind in (None, BIFURCATION) and quantity in IMPACT_QUANTITIES:
        if IMPACTS not in record or not swept.axes:
            needed = f'{recorded}, and {quantity} needs record = "{IMPACTS}"'
            told = needed if swept.axes else "this quantity is drawn over an axis, but one motion has no axis"
            raise ValueError(bad("quantity", quantity, f"left out, because {told}"))
        return BIFURCATION, str(quantity)
    if SECTION not in record:
        if IMPACTS in record and quantity is not None:
            raise ValueError(bad("quantity", quantity, f"one of {', '.join(IMPACT_QUANTITIES)}, because {recorded}"))
        allowed = f"{MAP} or {BIFURCATION}" if IMPACTS in record else MAP
        raise ValueError(bad("kind", kind or BIFURCATION, f"{allowed}, because {recorded}"))
    if quantity not in (None, *SECTION_QUANTITIES):
        allowed = "one of " + ", ".join(SECTION_QUANTITIES) + (f" for a diagram of kind {kind}" if kind else "")
        raise ValueError(bad("quantity", quantity, allowed))
    return kind, quantity or SECTION_QUANTITIES[0]


def merge_options(wanted: dict[str, Any], now: dict[str, Any]) -> dict[str, Any]:
    """Return the drawing options of a configuration (`wanted`), replaced by the options of the call (`now`).

    The range in the configuration belongs to the quantity and units in the configuration. If the call gives others,
    this range is left out. If a kind and a quantity do not suit each other, the one in the configuration is left out.
    """
    kept = dict(wanted)
    merged = kept | now
    suits = MAP_QUANTITIES if merged.get("kind") == MAP else DIAGRAM_QUANTITIES
    if "kind" in merged and merged.get("quantity", suits[0]) not in suits:
        kept.pop("kind" if "quantity" in now else "quantity", None)
    if (
        now.keys() - {"x", "y"}
        and "quantity" in (now | wanted)
        and (kept | now).get("quantity") != wanted.get("quantity")
    ) or now.get("units", SI) != wanted.get("units", SI):
        kept.pop("limits", None)
    return kept | now
