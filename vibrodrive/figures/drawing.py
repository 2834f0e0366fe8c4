"""What a figure of a sweep shows: chosen from the axes and the records of the sweep, a configuration and a call."""

from collections.abc import Sequence
from typing import Any, NamedTuple, NoReturn

from vibrodrive.model.figure import (
    BANDS,
    BIFURCATION,
    DIAGRAM_QUANTITIES,
    DIMENSIONLESS,
    FIGURE_KINDS,
    LOOK,
    MAP,
    MAP_QUANTITIES,
    OF_EVERY_SWEEP,
    POINCARE,
    SI,
    check_limits,
)
from vibrodrive.model.parameters import bad, did_you_mean, placed
from vibrodrive.model.physical import has_units
from vibrodrive.model.quantities import IMPACT_POWER, QUANTITIES, Quantity
from vibrodrive.model.records import RECORDS, SECTION

STARTS = ("xi0", "dxi0", "tau0")  # coordinates of the start

OPTIONS = {
    BIFURCATION: ("quantity", "x", "limits", "cmap", "over"), POINCARE: (),
    MAP: ("quantity", "x", "y", "limits", "cmap", "over"), BANDS: (),
}  # fmt: skip
"""Arguments that have an effect on each kind of figure."""

SUITS = {BIFURCATION: DIAGRAM_QUANTITIES, POINCARE: (), MAP: MAP_QUANTITIES, BANDS: ()}
"""Quantities that each kind of figure can show."""


def check_range(key: str, limits: tuple[float, float] | None, row: Quantity) -> None:
    """Refuse limits that are no range, or that belong to a quantity with one colour for each value. Raises ValueError
    with one sentence."""
    if limits is not None and row.classes:
        _refuse(key, limits, f"left out, because the colours of {row.name} are classes without a range")
    if limits is not None:
        check_limits(key, limits)


def check_swept(swept: Any) -> None:
    """Refuse what is no sweep. Raises TypeError with one sentence."""
    if not hasattr(swept, "record"):
        raise TypeError(bad("results", swept, "the Results of a sweep, of which vd.load reads those of a file"))


class Drawing(NamedTuple):
    """What a figure of a sweep shows: its kind, the row of its quantity, the axes to the right ("" in sections) and
    upwards (None unless it is a map over two axes), and the range of the quantity."""

    kind: str
    row: Quantity
    x: str = ""
    y: str | None = None
    limits: tuple[float, float] | None = None


def choose_drawing(swept: Any, kind: str | None = None, quantity: str | None = None, **options: Any) -> Drawing:
    """Return what a figure of a sweep shows, with the kind, quantity and axes that are None as `Results.plot` says.

    No choice depends on the number of values.

    `swept` is a Plan or Results. `options` contains `x`, `y`, `limits`, `cmap` and `over`, which must have an effect on
    the figure. Raises ValueError for them, for an unknown or unrecorded quantity, and for one motion without a section.
    """
    arguments = {name: value for name, value in {"quantity": quantity, **options}.items() if value is not None}
    if kind not in (None, *FIGURE_KINDS):
        _refuse("kind", kind, "one of " + ", ".join(FIGURE_KINDS))
    if not swept.axes and kind not in (None, POINCARE):
        _refuse("kind", kind, f"{POINCARE} for one motion, which has no axis")
    free = kind is None and quantity is not None and options.get("y") is None  # then the quantity selects the kind
    if kind is None:
        kind, quantity = _default(swept, quantity, options.get("y"))
    for name, value in arguments.items():
        if name not in OPTIONS[kind]:
            why = f"a figure of kind {kind}" if swept.axes else "one motion, which has no axis"
            _refuse(name, value, f"left out for {why}")
    if kind == BANDS and not _has_bands(swept):
        _refuse("kind", BANDS, 'left out, because bands need record = "limit" over one axis')
    diagrams, maps = _diagrams(swept), [*_maps(swept), *OF_EVERY_SWEEP]
    sections = [name for name in diagrams if name in SECTION.diagrams]
    names = {BIFURCATION: diagrams, POINCARE: sections}.get(kind, maps)
    if not names and not swept.axes:
        _refuse("record", ", ".join(swept.record), f'extended by "{SECTION}" to draw one motion')
    if not names and not free:
        _refuse("kind", kind, f"{f'{MAP} or {BIFURCATION}' if diagrams else MAP}, because {_recorded(swept)}")
    name = _known(swept, names[0] if quantity is None else quantity, [*diagrams, *maps] if free else names)
    row = next(q for q in (*swept.quantities, *QUANTITIES.values()) if q.name == name)
    check_range("limits", options.get("limits"), row)
    x, y = _plane(swept, kind, options.get("x"), options.get("y"))
    if kind == MAP and y is None and "cmap" in arguments:
        _refuse("cmap", arguments["cmap"], "left out over one axis, where all points have one colour")
    return Drawing(kind, row, x, y, options.get("limits"))


def _default(swept: Any, quantity: str | None, y: str | None) -> tuple[str, str | None]:
    """Return the kind that follows from the axes, the record and the arguments, with the quantity."""
    if not swept.axes:
        return POINCARE, None
    if y is not None or quantity in (*MAP_QUANTITIES, *_maps(swept)):
        return MAP, quantity
    coordinates = SECTION.diagrams if SECTION in swept.record else ()
    starts = len(swept.axes) > 1 and all(name in STARTS for name in swept.axes)
    if starts and coordinates and quantity in (None, *coordinates):
        return MAP, f"last_{quantity or coordinates[0]}"
    if quantity is not None or coordinates:
        return BIFURCATION, quantity
    if _has_bands(swept):
        return BANDS, None
    return MAP if _maps(swept) or not _diagrams(swept) else BIFURCATION, None


def _plane(swept: Any, kind: str, x: str | None, y: str | None) -> tuple[str, str | None]:
    """Return the axes of a figure: for a diagram the longest one, for a map the two longest ones in their order."""
    if kind not in (BIFURCATION, MAP):
        return "", None
    names = list(swept.axes)
    for key, name in (("x", x), ("y", y)):
        if name is not None and name not in (allowed := names if kind == MAP else [*names, *swept.varied]):
            _refuse(key, name, "one of the axes " + ", ".join(dict.fromkeys(allowed)))
    if x is not None and x == y:
        _refuse("y", y, f"another axis than x = {x!r}")
    if y is not None and len(names) == 1:
        _refuse("y", y, "left out, because the sweep has one axis, and the ordinate is the quantity")
    free = sorted((n for n in names if n not in (x, y)), key=lambda n: -len(swept.axes[n]))
    if kind == BIFURCATION:
        return x or free[0], None
    needed = free[: min(2, len(names)) - (x is not None) - (y is not None)]
    in_order = iter([n for n in names if n in needed])
    return x or next(in_order), y or next(in_order, None)


def _has_bands(swept: Any) -> bool:
    return any(record.bands(len(swept.axes)) for record in swept.record)


def _diagrams(swept: Any) -> list[str]:
    """Return the quantities of diagrams that a sweep has recorded."""
    return [name for record in swept.record for name in record.diagrams]


def _maps(swept: Any) -> list[str]:
    """Return the quantities of maps that a sweep has recorded, apart from those of every sweep, the default first."""
    recorded = {q.name for q in swept.quantities} | {name for name, q in QUANTITIES.items() if q.source}
    if not has_units({**swept.scalars, **swept.varied}):
        recorded.discard(IMPACT_POWER.name)
    last = sorted(swept.record, key=lambda record: SECTION in (record,))  # a map of last points tells least
    return [name for record in last for name in record.maps if name in recorded]


def _known(swept: Any, quantity: str, names: Sequence[str]) -> str:
    """Return a quantity if it is one of the known ones. Raises ValueError, also with the record that it needs."""
    if quantity in names:
        return quantity
    of = next((record for record in RECORDS.values() if quantity in (*record.maps, *record.diagrams)), None)
    if of in swept.record and quantity == IMPACT_POWER.name:
        _refuse("quantity", quantity, f"energy, because {quantity} needs a scene in SI units")
    needs = "" if of is None or of in swept.record else f', and {quantity} needs record = "{of}"'
    similar = () if of else [*names, *DIAGRAM_QUANTITIES, *MAP_QUANTITIES]
    _refuse("quantity", quantity, f"one of {', '.join(names)}, because {_recorded(swept)}{needs}", similar)


def _recorded(swept: Any) -> str:
    return "this sweep recorded " + ", ".join(swept.record)


def _refuse(key: str, value: object, allowed: str, names: Sequence[str] = ()) -> NoReturn:
    """Raise ValueError with the sentence of `bad` and, if one of the `names` is similar to the value, this name."""
    raise ValueError(bad(key, value, allowed) + did_you_mean(value, names))


def choose_configured(swept: Any, figure: dict[str, Any], options: dict[str, Any]) -> tuple[Drawing, Any]:
    """Return what is drawn of a sweep, a Plan or Results, and the Results in its units: by [figure] of its
    configuration, and the options of a command.

    The section of one motion is drawn, whatever the configuration says of axes. Raises ValueError as `choose_drawing`
    does, with the place of the argument.
    """
    configured = {key: value for key, value in figure.items() if swept.axes and key not in LOOK}
    merged = merge_options(configured, options)
    if merged.get("units") == SI and not has_units({**swept.scalars, **swept.varied}):
        key = "--units" if "units" in options else "figure.units"
        _refuse(key, SI, "left out, because this sweep has no scene in SI units")
    if merged.pop("units", SI) == DIMENSIONLESS and hasattr(swept, "dimensionless"):
        swept = swept.dimensionless()
    with placed(lambda name: ("--" if name in options else "figure." if name in configured else "") + name):
        return choose_drawing(swept, **merged), swept


def merge_options(configured: dict[str, Any], options: dict[str, Any]) -> dict[str, Any]:
    """Return the drawing options of a configuration, replaced by the kind and quantity in the `options` of the call.

    If the call gives a kind, or a quantity and thereby a kind, options of the configuration without effect on this kind
    are left out. A range that belongs to another quantity or to other units is left out, too.
    """
    kind = options.get("kind")
    if kind is None and "quantity" in options:
        kind = MAP if options["quantity"] in MAP_QUANTITIES else BIFURCATION
    kept = dict(configured)
    if kind is not None:
        acts = (*OPTIONS[kind], "units")
        acting = {key: value for key, value in configured.items() if key in acts or (key, value) == ("kind", kind)}
        kept = {key: value for key, value in acting.items() if key != "quantity" or value in SUITS[kind]}
    merged = kept | options
    if merged.get("quantity") != configured.get("quantity") or merged.get("units", SI) != configured.get("units", SI):
        merged.pop("limits", None)
    return merged
