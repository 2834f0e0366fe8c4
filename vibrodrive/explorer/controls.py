"""Controls of the page, with labels and explanations: one for each field of a view (view.py) that is not a range."""

from __future__ import annotations

from typing import NamedTuple

from vibrodrive.explorer.view import ALONE, BESIDE, DIAGRAM, DIFFERENCE, METHODS, OF_MAPS, RANGES, SI, UNITLESS, View
from vibrodrive.model.drawing import DIAGRAM_QUANTITIES, MAP
from vibrodrive.model.names import LINEAR, LOG, NAMES, SCENE
from vibrodrive.model.physical import UNIT_OF, UNITS
from vibrodrive.model.plan import Plan

EXPONENTS = ("dtau",)  # sliders over the decimal logarithm of their value
SLIDER_STEPS = 400  # number of steps of a slider over the range of an axis


class Control(NamedTuple):
    """Control of one field. `options` contains (value, text on the page) for each choice; `slider` the ends and step of
    a slider. If `only` is not "", the control is shown only for this mode or scene of the view."""

    name: str
    label: str
    hint: str
    options: tuple[tuple[str, str], ...] = ()
    slider: tuple[float, float, float] | None = None
    only: str = ""


def unit(name: str) -> str:
    """Return the unit of a parameter on the page. This is always an SI unit, also if figures use mm."""
    row = NAMES[name]
    return row.unit if row.scale != 1.0 else row.shown


def symbol(name: str, with_unit: bool = True, si: bool = False) -> str:
    """Return the symbol of the paper and the unit of a parameter or quantity, or if `si` words and the unit in SI."""
    if si and name in UNIT_OF:
        of = UNITS[UNIT_OF[name]]
        words = {"xi": "gap x", "dxi": "velocity dx/dt"}.get(name, name.replace("_", " "))
        return f"{words} ({of.si if of.scale != 1.0 else of.shown or '1/s'})"
    if name not in NAMES:
        return {"impact_phase": "impact phase (rad)", "impact_speed": "impact speed"}.get(name, name.replace("_", " "))
    written = NAMES[name].symbol.replace("_s", "ₛ")
    return f"{written} ({unit(name)})" if with_unit and unit(name) else written


def part_shown(view: View, plan: Plan) -> str:
    """Describe the part of a sweep that a view shows: the quantity, its axes, and the values of the other axes."""
    shown = symbol(view.shade if view.mode == MAP else view.quantity, si=view.scene == SI)
    rest = {name: axis for name, axis in plan.axes.items() if name not in view.axes and len(axis) > 1}
    others = [f"{symbol(name)} = {axis[0]:.6g}, the first of {len(axis)} values" for name, axis in rest.items()]
    return ", ".join([f"{shown} over {' and '.join(map(symbol, view.axes))}", *others])


def _number(name: str, only: str = "") -> Control:
    """Return the control of a parameter. If the table NAMES contains no slider, the slider covers the range of the
    axis in this table."""
    row = NAMES[name]
    slider = row.slider
    if slider is None and row.axis and row.axis[2] == LINEAR:
        low, high, _ = row.axis
        slider = low, high, (high - low) / SLIDER_STEPS
    return Control(
        name, symbol(name), f"{row.meaning[0].upper()}{row.meaning[1:]}.".replace("_s", "ₛ"), slider=slider, only=only
    )


def _choice(name: str, label: str, hint: str, options: dict[str, str], only: str = "") -> Control:
    return Control(name, label, hint, tuple(options.items()), only=only)


_SCALES = {LINEAR: "linear", LOG: "logarithmic"}
_PARAMETERS = {name: symbol(name) for name in RANGES}

GROUPS: dict[str, tuple[Control, ...]] = {
    "Picture": (
        _choice("mode", "Picture", "A diagram shows many values over one parameter. A map shows one value over two "
                "parameters.",
                {DIAGRAM: "diagram", MAP: "map"}),
        _choice("quantity", "Upwards", "The quantity on the vertical axis: one dot for each section point or impact.",
                {q: symbol(q) if q not in ("xi", "dxi") else f"{symbol(q)} at the section"
                 for q in DIAGRAM_QUANTITIES}, DIAGRAM),
        _choice("shade", "Colour", "The quantity shown by the colours of the map.",
                {q: q.replace("_", " ") for q in OF_MAPS}, MAP),
        _choice("x", "Across", "The parameter along the horizontal axis.", _PARAMETERS),
        _choice("scale", "Axis across", "Equal steps, or equal ratios, along the horizontal axis.", _SCALES),
        _choice("y", "Upwards", "The parameter along the vertical axis of the map.", _PARAMETERS, MAP),
        _choice("y_scale", "Axis upwards", "Equal steps, or equal ratios, along the vertical axis.", _SCALES, MAP),
    ),
    "Parameters": (
        _choice("scene", "Given as", "Enter A and B, or the quantities of a machine in SI units, which give A and B.",
                {UNITLESS: "A and B", SI: "SI units"}),
        _number("A", UNITLESS), _number("B", UNITLESS), *(_number(name, SI) for name in SCENE if name != "frequency"),
        _number("eps"), _number("eta"),
    ),
    "Method": (
        _choice("method", "Switches found by", "Certified: the proved first zero. Muller: the paper's iteration on a "
                "grid. Fixed: the next grid point.", {m: m for m in METHODS}),
        _number("dtau"), _number("tol"),
        _choice("compare", "Certified motions", "Also show the certified motions, or the difference between the two "
                "methods.",
                {ALONE: "not shown", BESIDE: "below", DIFFERENCE: "as a difference"}, DIAGRAM),
    ),
    "Run": (
        _number("section_phase"), _number("transient"), _number("periods"),
        Control("orbits", "Exact orbits up to period", "Draw the periodic orbits of the undisturbed motion up to this "
                "period, and their bifurcations. 0 means none."),
        Control("columns", "Motions across", "Number of motions in a row, 2 to 4000. If empty, one for each pixel."),
        Control("rows", "Motions upwards", "Number of motions in a column, 2 to 4000. If empty, the number follows "
                "from the size of the page.", only=MAP),
    ),
    "Start": (_number("xi0"), _number("dxi0"), _number("tau0")),
}  # fmt: skip
"""All controls, in the order of the page. The first group is above the picture, the other groups are beside it."""
