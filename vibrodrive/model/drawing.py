"""Kinds of figures of a sweep, and quantities that can be drawn, depending on the records of the sweep."""

import math
from numbers import Real
from typing import Any, Literal, get_args

from vibrodrive.model.parameters import bad
from vibrodrive.model.records import IMPACTS, SECTION, SUMMARIES, SUMMARY

BIFURCATION, POINCARE, MAP = "bifurcation", "poincare", "map"

FIGURE_KINDS = (BIFURCATION, POINCARE, MAP)

Style = Literal["screen", "print"]
"""Colours that are distinct for colour-blind readers, or the black and white of a journal."""

Width = Literal["double", "single"]  # width of a figure in columns of a page

STYLES: tuple[Style, ...] = get_args(Style)
WIDTHS: tuple[Width, ...] = get_args(Width)

FORMATS = (".png", ".pdf", ".svg")

SECTION_QUANTITIES = ("dxi", "xi")
IMPACT_QUANTITIES = ("impact_phase", "impact_speed")
DIAGRAM_QUANTITIES = (*SECTION_QUANTITIES, *IMPACT_QUANTITIES)
OF_SUMMARY = tuple(q.name for q in SUMMARIES)
OF_EVERY_SWEEP = ("status", "margin")
OF_SECTION = ("last_xi", "last_dxi")
"""ξ and ξ' at the last section point. A map over starts shows which of the coexisting motions each start reaches."""

IMPACT_POWER = "impact_power"  # power of the impacts in W, from `energy` and the scene of the sweep

STARTS = ("xi0", "dxi0", "tau0")  # coordinates of the start

KEPT = "kept"  # 1 if `gaps` equal those of the undisturbed motion, 0 if they differ, -1 if the undisturbed one has none

K2 = "k2"  # limit k₂: the smallest disturbance at which the structure is lost (docs/glossary.md)

SCENE_OF_POWER = ("omega0", "mu", "alpha", "mass")
"""Quantities of the scene that a power needs. Each quantity is an axis or one number."""

OF_CLASSES = ("period", "gaps", "sequence", "status", KEPT)
"""Quantities of maps with one colour for each value, hence without a range."""

MAP_QUANTITIES = (*OF_SUMMARY, KEPT, IMPACT_POWER, *OF_SECTION, *OF_EVERY_SWEEP)
"""Quantities of maps over two axes, and of lines over one axis."""


OPTIONS = {BIFURCATION: ("quantity", "x", "limits"), POINCARE: (), MAP: ("quantity", "x", "y", "limits")}
"""Arguments that have an effect on each kind of figure."""

SUITS = {BIFURCATION: DIAGRAM_QUANTITIES, POINCARE: (), MAP: MAP_QUANTITIES}
"""Quantities that each kind of figure can show."""


def check_limits(key: str, limits: Any) -> tuple[float, float]:
    """Return a range as two floats. Raises ValueError with one sentence."""
    try:
        low, high = limits
        if isinstance(low, Real) and isinstance(high, Real) and -math.inf < float(low) < float(high) < math.inf:
            return float(low), float(high)
    except (OverflowError, TypeError, ValueError):
        pass
    raise ValueError(bad(key, limits, "two numbers in ascending order"))


def check_range(key: str, limits: tuple[float, float] | None, quantity: str) -> None:
    """Refuse limits that are no range, or that belong to a quantity with one colour for each value. Raises ValueError
    with one sentence."""
    if limits is not None and quantity in OF_CLASSES:
        raise ValueError(bad(key, limits, f"left out, because the colours of {quantity} are classes without a range"))
    if limits is not None:
        check_limits(key, limits)


def choose_drawing(swept: Any, kind: str | None = None, quantity: str | None = None, **others: Any) -> tuple[str, str]:
    """Return (kind of figure, quantity) with which a sweep is drawn. The function chooses those that are None.

    A quantity of maps (MAP_QUANTITIES) or an ordinate `y` selects a map, a quantity of the impacts a bifurcation
    diagram. Otherwise the first of these conditions selects the kind. None of them counts values.

    * Without an axis: a Poincaré section.
    * Without a section: a map of the period or, if only impacts are recorded, a diagram of their phases.
    * If there are several axes, all of them coordinates of the start: a map of the last section point.
    * Otherwise: a bifurcation diagram.

    `swept` is a Plan or Results. `others` contains `x`, `y` and `limits`, which must have an effect on the figure.
    Raises ValueError for them, for an unknown or unrecorded quantity, and for one motion without a section.
    """
    if kind not in (None, *FIGURE_KINDS):
        raise ValueError(bad("kind", kind, "one of " + ", ".join(FIGURE_KINDS)))
    given = {name: value for name, value in {"quantity": quantity, **others}.items() if value is not None}
    if not swept.axes:
        for name, value in given.items():
            raise ValueError(bad(name, value, "left out for one motion, which has no axis"))
        if kind not in (None, POINCARE):
            raise ValueError(bad("kind", kind, f"{POINCARE} for one motion, which has no axis"))
    if kind is None:
        kind, quantity = _default(swept, quantity, others.get("y"))
    for name, value in given.items():
        if name not in OPTIONS[kind]:
            raise ValueError(bad(name, value, f"left out for a figure of kind {kind}"))
    return kind, _map_quantity(swept, quantity) if kind == MAP else _diagram_quantity(swept, kind, quantity)


def _default(swept: Any, quantity: str | None, y: str | None) -> tuple[str, str | None]:
    """Return the kind that follows from the axes, the record and the arguments, with the quantity."""
    record = swept.record
    if not swept.axes:
        return POINCARE, None
    if y is None and (quantity in IMPACT_QUANTITIES or (quantity is None and record == (IMPACTS,))):
        return BIFURCATION, quantity
    if y is not None or quantity in MAP_QUANTITIES or (quantity is None and SECTION not in record):
        return MAP, quantity
    if len(swept.axes) > 1 and all(name in STARTS for name in swept.axes) and quantity in (None, *SECTION_QUANTITIES):
        return MAP, f"last_{quantity or SECTION_QUANTITIES[0]}"
    return BIFURCATION, quantity


def _map_quantity(swept: Any, quantity: str | None) -> str:
    """Return the quantity of a map. Raises ValueError if the sweep has not recorded it."""
    record = swept.record
    recorded = "this sweep recorded " + ", ".join(record)
    known = [
        *((*OF_SUMMARY, KEPT) if SUMMARY in record else ()),
        *(OF_SECTION if SECTION in record else ()),
        *OF_EVERY_SWEEP,
    ]
    quantity = quantity or ("period" if SUMMARY in record else "last_dxi" if SECTION in record else "status")
    if quantity == IMPACT_POWER and SUMMARY in record:
        missing = [name for name in SCENE_OF_POWER if name not in swept.axes and name not in swept.scalars]
        if missing:
            needed = f"impact_power needs {', '.join(missing)} (give a scene in SI units, with one quantity as an axis)"
            raise ValueError(bad("quantity", quantity, f"energy, because {needed}"))
    elif quantity not in known:
        if quantity in (*OF_SUMMARY, KEPT, IMPACT_POWER) and SUMMARY not in record:
            recorded += f', and {quantity} needs record = "{SUMMARY}"'
        raise ValueError(bad("quantity", quantity, f"one of {', '.join(known)}, because {recorded}"))
    return quantity


def _diagram_quantity(swept: Any, kind: str, quantity: str | None) -> str:
    """Return the quantity of a figure that is not a map. Raises ValueError if the sweep has not recorded it."""
    record = swept.record
    recorded = "this sweep recorded " + ", ".join(record)
    impacts = IMPACT_QUANTITIES if IMPACTS in record and swept.axes else ()
    known = (*(SECTION_QUANTITIES if SECTION in record else ()), *(impacts if kind == BIFURCATION else ()))
    if not known and not swept.axes:
        raise ValueError(bad("record", ", ".join(record), f'extended by "{SECTION}" to draw one motion'))
    if not known:
        allowed = f"{MAP} or {BIFURCATION}" if impacts else MAP
        raise ValueError(bad("kind", kind, f"{allowed}, because {recorded}"))
    quantity = quantity or known[0]
    if quantity in IMPACT_QUANTITIES and not impacts:
        raise ValueError(
            bad("quantity", quantity, f'left out, because {recorded}, and {quantity} needs record = "{IMPACTS}"')
        )
    if quantity not in known:
        raise ValueError(bad("quantity", quantity, f"one of {', '.join(known)}, because {recorded}"))
    return quantity


def merge_options(wanted: dict[str, Any], now: dict[str, Any]) -> dict[str, Any]:
    """Return the drawing options of a configuration (`wanted`), replaced by the kind and quantity of the call (`now`).

    If the call gives a kind, or a quantity and thereby a kind, options of the configuration without effect on this kind
    are left out. A range that belongs to another quantity is left out, too.
    """
    kind = now.get("kind")
    if kind is None and "quantity" in now:
        kind = MAP if now["quantity"] in MAP_QUANTITIES else BIFURCATION
    kept = dict(wanted)
    if kind is not None:
        acting = {key: value for key, value in wanted.items() if key in OPTIONS[kind] or (key, value) == ("kind", kind)}
        kept = {key: value for key, value in acting.items() if key != "quantity" or value in SUITS[kind]}
    merged = kept | now
    if merged.get("quantity") != wanted.get("quantity"):
        merged.pop("limits", None)
    return merged
