"""View: the complete state of a page as one value, which can be written as an address and as a configuration.

The picture of a view is computed from this configuration, which is parsed and checked like a file. Therefore the
complete picture equals, bit for bit, the sweep of the exported file, and the page gives the same error messages as the
program.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, make_dataclass, replace
from typing import Any
from urllib.parse import parse_qsl, urlencode

import numpy as np

from vibrodrive.figures import drawing
from vibrodrive.model import choices, config, figure, names, parameters, records
from vibrodrive.model.plan import Plan

DIAGRAM, MAP = "diagram", figure.MAP  # modes, with one and with two parameters
OF_MAPS = (*(q.name for q in (*records.SUMMARY.quantities, records.IMPACT_POWER)), *figure.OF_EVERY_SWEEP)
COMPARISONS = ALONE, DIFFERENCE = "alone", "difference"  # without the certified motions, or coloured by method
UNITLESS, SI = "dimensionless", "SI"
METHODS = tuple(m.name.lower() for m in choices.Method)
MOST_COLUMNS = 4000
MOST_CELLS = 1_000_000
COLUMNS, ROWS = 1000, 250  # numbers of columns and rows of a view without a page
PICTURE_ROWS = 360  # height in pixels of a diagram without a page
CELLS = 250_000  # largest number of cells of a map, if the number follows from the size of the page
LONGEST = 10**6  # largest `transient` and `periods`
RECORDED, RECORDED_DISTURBED = 4 * choices.LONGEST, 500
"""Recorded periods of a view that gives no number. The first suffice for the longest period, as the description of a
motion has them. With the η of the paper the phase of a disturbance advances by 1/202 of a turn in each period, so that
few dots would draw a moiré, which is no property of the motion."""
NOWHERE = math.nan  # default of `bottom` and `top`
PLACE = 0.3  # default place of the motion that is shown, as a share of the window
RANGES: dict[str, tuple[float, float, str]] = {name: row.axis for name, row in names.AXES.items() if row.axis}
SPAN, Y_SPAN = ("low", "high", "scale"), ("y_low", "y_high", "y_scale")  # fields with the defaults of RANGES, in order
ENDS = ("bottom", "top")  # range of the ordinate of a diagram, or of the colours of a map
MAY_LACK = (*ENDS, "at", "at_y", "columns", "rows", "periods")  # fields that may be empty
FIRST = {"A": 3.04, "dtau": 0.1, "section_phase": 0.5 * math.pi, "a0": 8e-4, "omega0": 150.0, "mu": 0.6, "alpha": 3.4}
FIRST |= {"mass": 250.0}
"""Values of the parameters and quantities of a page whose address is empty, if they differ from those of the table."""


def _number(key: str, value: object) -> float:
    try:
        found = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise ValueError(parameters.bad(key, value, "a number")) from None
    if not math.isfinite(found):
        raise ValueError(parameters.bad(key, value, "a finite number"))
    return found + 0.0


def _count(key: str, value: object, low: int, high: int) -> int:
    with suppress(TypeError, ValueError):
        value = int(found) if (found := float(value)).is_integer() else value  # type: ignore[arg-type]
    if isinstance(value, int) and low <= value <= high:
        return value
    raise ValueError(parameters.bad(key, value, f"an integer from {low} to {high}"))


def _choice(key: str, value: object, known: tuple[str, ...]) -> str:
    if value not in known:
        raise ValueError(parameters.bad(key, value, "one of " + ", ".join(known)))
    return str(value)


def _set(default: Any, read: Callable[..., Any], **allowed: Any) -> Any:
    return field(default=default, metadata={"read": functools.partial(read, **allowed)})


_ROWS = (names.PARAMETERS | names.SCENE).items()
_NUMBERS = [(name, float, _set(FIRST.get(name, row.default), _number)) for name, row in _ROWS if name != "frequency"]
_Numbers: Any = make_dataclass("_Numbers", _NUMBERS, frozen=True)


@dataclass(frozen=True)
class View(_Numbers):
    """Complete state of a page, which is all its settings. The fields are the keys of the address.

    The abscissa is the parameter x, with `columns` values (None: see `sized`) from `low` to `high`, by default those of
    RANGES. The ordinate of a diagram is `quantity`, from `bottom` to `top` (NaN: the range of the values). The ordinate
    of a map is the parameter y, with `rows` values from `y_low` to `y_high`. The colours of a map show `shade`.

    `at` is the x of the motion that the page shows, and `at_y` its y in a map. Every parameter and quantity of a scene
    in the table of names is a field, but `frequency`. If `scene` is "SI", the quantities determine B and, if A is not
    an axis, also A. "SI" is the default if one of them is an axis. `periods` None means a number that suits the
    picture.
    """

    mode: str = _set(DIAGRAM, _choice, known=(DIAGRAM, MAP))
    x: str = _set("A", _choice, known=tuple(RANGES))
    low: float = _set(RANGES["A"][0], _number)
    high: float = _set(RANGES["A"][1], _number)
    scale: str = _set(RANGES["A"][2], _choice, known=(names.LINEAR, names.LOG))
    columns: int | None = _set(None, _count, low=2, high=MOST_COLUMNS)
    quantity: str = _set("dxi", _choice, known=figure.DIAGRAM_QUANTITIES)
    bottom: float = _set(NOWHERE, _number)
    top: float = _set(NOWHERE, _number)
    y: str = _set("B", _choice, known=tuple(RANGES))
    y_low: float = _set(RANGES["B"][0], _number)
    y_high: float = _set(RANGES["B"][1], _number)
    y_scale: str = _set(RANGES["B"][2], _choice, known=(names.LINEAR, names.LOG))
    rows: int | None = _set(None, _count, low=2, high=MOST_COLUMNS)
    shade: str = _set("period", _choice, known=OF_MAPS)
    compare: str = _set(ALONE, _choice, known=COMPARISONS)
    at: float = _set(NOWHERE, _number)
    at_y: float = _set(NOWHERE, _number)
    method: str = _set("certified", _choice, known=METHODS)
    transient: int = _set(500, _count, low=0, high=LONGEST)
    periods: int | None = _set(None, _count, low=1, high=LONGEST)
    scene: str = _set(UNITLESS, _choice, known=(UNITLESS, SI))

    def __post_init__(self) -> None:
        for name, span in (("at", SPAN), ("at_y", Y_SPAN)):
            if math.isnan(getattr(self, name)):
                object.__setattr__(self, name, inside(*(getattr(self, key) for key in span)))

    @classmethod
    def read(cls, written: Mapping[str, object]) -> View:
        """Return the view with these fields. All other fields have their defaults. Numbers may be text. Raises
        ValueError."""
        known = {f.name: f for f in fields(cls)}
        values: dict[str, Any] = {}
        for key, value in written.items():
            if key not in known:
                raise ValueError(parameters.unknown("key of a view", key, known))
            if key in MAY_LACK and (value is None or value == ""):
                continue
            values[key] = known[key].metadata["read"](key, value)
        for axis, keys in (("x", SPAN), ("y", Y_SPAN)):
            if axis in values:
                values = dict(zip(keys, RANGES[values[axis]], strict=True)) | values
        view = cls(**values)
        if "scene" not in values:
            view = replace(view, scene=view._default_scene)
        view._check()
        return view

    def _check(self) -> None:
        """Reject a range that is empty or too large, and each value that the checks of a configuration reject."""
        for low, high in (("low", "high"), ("y_low", "y_high"), ("bottom", "top")):
            a, b = getattr(self, low), getattr(self, high)
            if math.isnan(a) != math.isnan(b):
                raise ValueError(parameters.bad(high, b, f"given together with {low}"))
            if a >= b:
                raise ValueError(parameters.bad(high, b, f"greater than {low} = {a!r}"))
        if self.mode == MAP:
            if self.x == self.y:
                raise ValueError(parameters.bad("y", self.y, f"another parameter than x = {self.x}"))
            drawing.check_range("bottom and top", self.limits, records.QUANTITIES[self.shade])
            columns, rows = self.grid
            if columns * rows > MOST_CELLS:
                raise ValueError(parameters.bad("rows", rows, f"<= {MOST_CELLS // columns} at {columns} columns"))
        plan = self.plan()
        self.motion_plan()
        if self.mode == MAP:
            drawing.choose_drawing(plan, MAP, self.shade)
            if self.shade == "lyapunov" and (self.disturbed or self.method != "certified"):
                allowed = "another quantity: only certified motions with ε = 0 have a Lyapunov exponent"
                raise ValueError(parameters.bad("shade", self.shade, allowed))

    @property
    def axes(self) -> tuple[str, ...]:
        """Parameters along the axes of the sweep."""
        return (self.x, self.y) if self.mode == MAP else (self.x,)

    @property
    def grid(self) -> tuple[int, int]:
        """Numbers of columns and, for a map, of rows."""
        return self.columns or COLUMNS, self.rows or ROWS

    def sized(self, width: int, height: int) -> View:
        """Return the view with numbers of columns and rows. A number that is not given follows from the size of the
        frame in pixels.

        A diagram has one column for each pixel. A map has at most CELLS square cells, each of a whole number of pixels.
        """
        cell = math.ceil(math.sqrt(width * height / CELLS)) if self.mode == MAP else 1
        columns, rows = (max(2, length // cell) for length in (width, height))
        return replace(self, columns=self.columns or columns, rows=self.rows or rows)

    @property
    def machine(self) -> tuple[str, ...]:
        """Quantities of the machine in SI units that are fields."""
        away = ("frequency", "omega0") if "frequency" in self.axes else ("frequency",)
        return tuple(name for name in names.SCENE if name not in away)

    @property
    def recorded(self) -> int:
        """Number of recorded periods."""
        return self.periods or (RECORDED_DISTURBED if self.disturbed else RECORDED)

    @property
    def disturbed(self) -> bool:
        return "eps" in self.axes or self.eps > 0.0

    @property
    def _default_scene(self) -> str:
        return SI if {*self.axes} & {*names.SCENE_AXES} else UNITLESS

    def address(self) -> str:
        """Return the query of the address: all fields that differ from their defaults."""
        defaults = {f.name: f.default for f in fields(self)}
        defaults |= dict(zip(SPAN, RANGES[self.x], strict=True)) | dict(zip(Y_SPAN, RANGES[self.y], strict=True))
        defaults |= {"scene": self._default_scene, "at": inside(self.low, self.high, self.scale)}
        defaults |= {"at_y": inside(self.y_low, self.y_high, self.y_scale)}
        values = ((name, getattr(self, name)) for name in defaults)
        chosen = {name: v for name, v in values if v is not None and v != defaults[name] and v == v}
        return urlencode({name: repr(v) if isinstance(v, float) else v for name, v in chosen.items()})

    def state(self) -> dict[str, Any]:
        """Return all fields for JSON, with None in place of NaN."""
        values = ((f.name, getattr(self, f.name)) for f in fields(self))
        return {name: None if isinstance(v, float) and math.isnan(v) else v for name, v in values}

    def plan(self) -> Plan:
        """Return the sweep of this view. Raises ValueError with a message of one line."""
        return config.parse(self.toml()).plan()

    def motion_plan(self) -> Plan:
        """Return the plan of the motion that the page shows. Raises ValueError with a message of one line."""
        values = dict(zip(self.axes, (self.at, self.at_y), strict=False))
        if "frequency" in values:
            values["omega0"] = names.TURN * values.pop("frequency")
        return config.parse(replace(self, **values)._toml({}, self.axes)).plan()  # type: ignore[arg-type]

    @property
    def limits(self) -> tuple[float, float] | None:
        """Range (bottom, top) of the ordinate or of the colours. None means the range of the computed values."""
        return None if math.isnan(self.top) else (self.bottom, self.top)

    @property
    def compared(self) -> bool:
        """True if the certified motions are also shown, for comparison."""
        return self.mode == DIAGRAM and self.compare != ALONE and self.method != "certified"

    def toml(self) -> str:
        """Return the configuration of this view for `vibrodrive sweep`. It contains every number, also the defaults."""
        columns, rows = self.grid
        over = {self.x: (self.low, self.high, columns, self.scale)}
        if self.mode == MAP:
            over[self.y] = (self.y_low, self.y_high, rows, self.y_scale)
        return self._toml(over, self.axes)

    def _toml(self, over: Mapping[str, tuple[float, float, int, str]], along: tuple[str, ...]) -> str:
        """Return a configuration with the axes `over`. `along` contains the axes, which replace values of a scene."""

        def numbers(keys: Iterable[str]) -> list[str]:
            return [f"{name} = {getattr(self, name)!r}" for name in keys if name not in over]

        model, scene = config.HOMES["model"], self.machine if self.scene == SI else ()
        if scene:
            scene = tuple(name for name in scene if name != "a0" or "A" not in along)
            scene += ("omega0",) if not over and "frequency" in along else ()
            given = ("B", "A") if {"a0"} & {*scene, *along} else ("B",)
            model = tuple(name for name in model if name not in given)
        method = choices.Method[self.method.upper()]
        used = [name for name, methods in choices.ACTS_ON.items() if method in methods]
        tables = {
            "model": numbers(model),
            "physical": numbers(scene),
            "sweep": [f'{name} = {{start = {low!r}, stop = {high!r}, num = {num}, scale = "{scale}"}}'
                      for name, (low, high, num, scale) in over.items()],
            "switching": [f'method = "{self.method}"', *numbers(used)],
            "run": [*numbers(["section_phase"]), f"transient = {self.transient}", f"periods = {self.recorded}",
                    f"record = {self.record}"],
            "figure": self._figure() if over else [],
        }  # fmt: skip
        lines = [line for name, table in tables.items() if table for line in ("", f"[{name}]", *table)]
        return "\n".join(['title = "A view of the explorer"', *lines, ""])

    @property
    def sectioned(self) -> bool:
        """True for a diagram of section points."""
        return self.mode == DIAGRAM and self.quantity in records.SECTION.diagrams

    @property
    def barred(self) -> bool:
        """True for a diagram that names the periods of its motions, the same as their descriptions."""
        certified = self.method == "certified" and not self.disturbed
        return self.sectioned and certified and self.recorded >= RECORDED

    @property
    def record(self) -> list[str]:
        names = (["section"] if self.sectioned else []) + (["summary"] if self.mode == MAP or self.barred else [])
        return names or ["impacts"]

    def _figure(self) -> list[str]:
        limits = [f"limits = [{self.bottom!r}, {self.top!r}]"] if self.limits else []
        if self.mode == MAP:
            return [f'kind = "{MAP}"', f'quantity = "{self.shade}"', f'x = "{self.x}"', f'y = "{self.y}"', *limits]
        lines = [f'kind = "{figure.BIFURCATION}"', f'quantity = "{self.quantity}"', f'x = "{self.x}"']
        return [*lines, *limits]


def inside(low: float, high: float, scale: str, place: float = PLACE) -> float:
    """Return a round number at about this share of a window."""
    at = low * (high / low) ** place if scale == names.LOG and low > 0.0 else low + place * (high - low)
    step = high - low if scale == names.LINEAR else at
    return min(max(round(at, 3 - math.floor(math.log10(step))) if 0.0 < step < math.inf else at, low), high)


def read_address(address: str) -> View:
    """Return the view of an address. Raises ValueError with a message of one line."""
    return View.read({key: value for key, value in parse_qsl(address.lstrip("?")) if key != "token"})


def view_of(settings: config.Config) -> View:
    """Return the view of a configuration. Raises ValueError for a configuration that the explorer cannot show.

    The abscissa is the x of the figure, or by default the longest axis. A sweep over two or more axes that records a
    summary becomes a map. The first value of every further axis is used.
    """
    plan = settings.plan()
    for name in plan.axes:
        if name not in RANGES:
            raise ValueError(parameters.bad("axis", name, "one of " + ", ".join(RANGES) + " in the explorer"))
    known = names.PARAMETERS | names.SCENE
    values: dict[str, Any] = {name: value for name, value in plan.scalars.items() if name in known}
    if {*plan.axes} & {*names.SCENE_AXES} or ("mu" in values and ("a0" in values or "A" in plan.axes)):
        values = {"mass": 1.0} | values | {"scene": SI}
        if "A" in values and "a0" not in {*values, *plan.axes}:
            allowed = "an axis, or left out (A then follows from a0), in the explorer"
            raise ValueError(parameters.bad("A", values["A"], allowed))
    values |= {name: float(axis[0]) for name, axis in plan.axes.items()}
    if "frequency" in values:
        values["omega0"] = names.TURN * values.pop("frequency")
    if math.isnan(values["dtau"]):
        del values["dtau"]
    s = plan.settings
    values |= {"method": choices.Method(s.method).name.lower(), "transient": s.transient, "periods": s.periods}
    along = sorted(plan.axes, key=lambda name: (name != settings.figure.get("x"), -len(plan.axes[name])))
    along = [name for name in along if len(plan.axes[name]) > 1]
    if along:
        values |= {"x": along[0]} | dict(zip(("low", "high", "columns", "scale"), _span(plan, along[0]), strict=True))
    if plan.summarised and len(along) > 1:
        y = settings.figure.get("y", along[1])
        values |= {"mode": MAP, "y": y} | dict(zip(("y_low", "y_high", "rows", "y_scale"), _span(plan, y), strict=True))
    quantity = settings.figure.get("quantity")
    shows = {"quantity": figure.DIAGRAM_QUANTITIES, "shade": OF_MAPS}
    values |= {key: quantity for key, known in shows.items() if quantity in known}
    return View.read(values)


def _span(plan: Plan, name: str) -> tuple[float, float, int, str]:
    """Return (least value, largest value, number of values, scale) of an axis."""
    axis = plan.axes[name]
    low, high, num = float(axis.min()), float(axis.max()), len(axis)
    geometric = low > 0 and np.allclose(axis, np.geomspace(axis[0], axis[-1], num), rtol=1e-12, atol=0.0)
    even = np.allclose(axis, np.linspace(axis[0], axis[-1], num), rtol=1e-12, atol=0.0)
    return low, high, num, names.LOG if geometric and not even else names.LINEAR


OF_ABSCISSA, OF_ORDINATE = (*SPAN, "at", *ENDS), (*Y_SPAN, "at_y")  # fields that return to their defaults with an axis


def adapted(state: Mapping[str, Any], changed: str) -> View:
    """Return the view after a change of the field `changed`, with defaults for all fields that depend on this field.
    Raises ValueError.

    A quantity of the machine as an axis selects SI units, and B as an axis dimensionless parameters. The other axis is
    replaced if it then cannot be an axis.
    """
    drop = {"x": OF_ABSCISSA, "y": OF_ORDINATE, "mode": ENDS, "quantity": ENDS, "shade": ENDS}
    known = {name: value for name, value in state.items() if name not in drop.get(changed, ())}
    if known.get(changed) in names.SCENE_AXES:
        known["scene"] = SI
    elif changed in ("x", "y") and known[changed] == "B":
        known["scene"] = UNITLESS
    strangers = ("B",) if known["scene"] == SI else names.SCENE_AXES
    for axis, other, keys in (("x", "y", OF_ABSCISSA), ("y", "x", OF_ORDINATE)):
        if known[axis] in strangers or (axis != changed and known["x"] == known["y"]):
            usual = ("A", "B") if known["scene"] != SI else ("mu",) if known[other] == "A" else ("a0", "omega0")
            known[axis] = next(name for name in usual if name != known[other])
            for key in keys:
                known.pop(key, None)
    for scale, low, high in (("scale", "low", "high"), ("y_scale", "y_low", "y_high")):
        if changed == scale and known[scale] == names.LOG and float(known[low]) <= 0.0 < float(known[high]):
            known[low] = float(known[high]) / 1000.0
    return View.read(known)
