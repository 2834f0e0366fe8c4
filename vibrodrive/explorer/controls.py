"""Words, views and controls of the page, and its HTML. Each field of a view (view.py) that is no range and no place has
a control."""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import vibrodrive as vd
from vibrodrive.explorer import view as views
from vibrodrive.explorer.view import DIAGRAM, MAP, OF_MAPS, RANGES, SI, UNITLESS, View, read_address
from vibrodrive.model import choices, figure, names, physical, records

QUANTITIES = records.QUANTITIES
MAIN, MORE = "main", "more"  # controls in view, and controls behind "More"

WORDS = {
    "A": ("how hard it is shaken", "Shake it harder"),
    "B": ("slope", "Tilt it more"),
    "eps": ("ripple", "Add more ripple"),
    "eta": ("frequency of the ripple", "Add a faster ripple"),
    "dtau": ("time step", "Take longer steps"),
    "tol": ("tolerance", "Tolerate more"),
    "xi0": ("gap at the start", "Start it farther away"),
    "dxi0": ("velocity at the start", "Start it faster"),
    "tau0": ("phase at the start", "Start it later"),
    "section_phase": ("moment of a shake", "Look at it later"),
    "transient": ("left out before", ""),
    "periods": ("drawn", ""),
    "a0": ("amplitude", "Shake it farther"),
    "omega0": ("angular frequency", "Shake it faster"),
    "frequency": ("frequency", "Shake it faster"),
    "mu": ("friction", "Add friction"),
    "alpha": ("incline", "Tilt it more"),
    "mass": ("", "Add mass"),
}
"""Parameters in the words of axes, and what more of them means."""

WORDS |= {name: (row.meaning, f"Increase {row.symbol}") for name, row in names.AXES.items() if name not in WORDS}


class Control(NamedTuple):
    """Control of one field. `options` contains (value, text on the page) for each choice; `slider` the ends and the
    spacing of a slider, where "zero" is a logarithmic slider that begins with 0. The page shows the value times
    `factor`. If `only` is not "", the control is shown only for this mode or scene of the view."""

    name: str
    label: str
    words: str
    hint: str
    place: str = MORE
    options: tuple[tuple[str, str], ...] = ()
    slider: tuple[float, float, str] | None = None
    factor: float = 1.0
    only: str = ""


def symbol(name: str, si: bool = False) -> str:
    """Return the symbol of the paper and the unit of a parameter or quantity, or if `si` words and the unit in SI."""
    if si and name in QUANTITIES and QUANTITIES[name].scales:
        of = physical.UNITS[QUANTITIES[name].scales]
        words = QUANTITIES[name].latin or name.replace("_", " ")
        return f"{words} ({of.si if of.scale != 1.0 else of.shown or '1/s'})"
    if name not in names.NAMES:
        unit = QUANTITIES[name].unit
        return name.replace("_", " ") + ("" if unit == "1" else f" ({unit})")
    return _letter(name) + (f" ({names.NAMES[name].shown})" if names.NAMES[name].shown else "")


def _letter(name: str) -> str:
    return names.NAMES[name].symbol.replace("_s", "ₛ")


def title_of(view: View) -> tuple[str, str]:
    """Return (what the axes of the picture show, conditions common to all its motions)."""
    shown = view.shade if view.mode == MAP else view.quantity
    named = symbol(shown, si=view.scene == SI)
    title = QUANTITIES[shown].title or named[0].upper() + named[1:]
    title += ", against " + " and ".join(f"{WORDS[name][0]} ({_letter(name)})" for name in view.axes)
    away = {"g"} if view.g == View.g else set()
    away |= {"a0"} if "A" in view.axes else set()  # A then replaces it
    given = [name for name in view.machine if name not in away] if view.scene == SI else ["A", "B"]
    given += ["eps"]
    given += ["eta"] if "eps" in view.axes or view.eps > 0.0 else []
    given += ["dtau"] if view.method != "certified" else []
    given += [name for name in names.OTHERS if getattr(view, name) != names.NAMES[name].default]
    given += ["section_phase"] if view.sectioned else []
    values = [
        ("seen at phase " if name == "section_phase" else "")
        + f"{_letter(name)} = {names.NAMES[name].scale * getattr(view, name):.6g} {names.NAMES[name].shown}"
        for name in given
        if name not in view.axes
    ]
    hertz = f" ({view.omega0 / names.TURN:.6g} Hz)"
    values = [value + hertz if value.startswith(_letter("omega0")) else value for value in values]
    periods = f"periods {view.transient + 1} to {view.transient + view.recorded}"
    return title, ", ".join([*(value.replace(" °", "°").rstrip() for value in values), view.method, periods])


def _number(name: str, place: str = MORE, only: str = "") -> Control:
    """Return the control of a parameter, with a slider if the table NAMES has a range for it."""
    row = names.NAMES[name]
    spacing = row.axis[2] if row.axis else names.LINEAR
    ends = row.slider or (row.axis[:2] if row.axis and spacing == names.LINEAR else None)
    slider = (*ends, "zero" if spacing == names.LOG and row.default == 0.0 else spacing) if ends else None
    hint = f"{row.meaning[0].upper()}{row.meaning[1:]}.".replace("_s", "ₛ")
    return Control(name, symbol(name), WORDS[name][0], hint, place, (), slider, row.scale, only)


def _choice(name: str, label: str, hint: str, options: dict[str, str], place: str = MORE, only: str = "") -> Control:
    return Control(name, label, "", hint, place, tuple(options.items()), only=only)


_SCALES = {names.LINEAR: "linear", names.LOG: "logarithmic"}
_PARAMETERS = {name: symbol(name) for name in RANGES}

CONTROLS = (
    _number("eps", MAIN),
    _choice("method", "Method", "How the ends of sliding and sticking are found. Certified: the first zero, proved. "
            "Muller: the paper's iteration on a grid. Fixed: the next point of a grid.",
            {m: m for m in reversed(views.METHODS)}, MAIN),
    _number("dtau", MAIN),
    _choice("compare", "Compared with certified", "Colour what the steps invent and what they miss.",
            {views.ALONE: "not", views.DIFFERENCE: "in colour"}, MAIN, DIAGRAM),
    _number("A", MAIN, UNITLESS), _number("B", MAIN, UNITLESS),
    *(_number(name, MAIN, SI) for name in ("a0", "omega0", "mu", "alpha", "mass")),
    _choice("mode", "Picture", "A diagram shows many values over one parameter, a map one value over two parameters.",
            {DIAGRAM: "diagram", MAP: "map"}),
    _choice("x", "Across", "The parameter along the horizontal axis.", _PARAMETERS),
    _choice("scale", "spaced", "Equal steps, or equal ratios, along the horizontal axis.", _SCALES),
    _choice("quantity", "Upwards", "One dot for each section point or impact.",
            {q: symbol(q) for q in figure.DIAGRAM_QUANTITIES}, only=DIAGRAM),
    _choice("y", "Upwards", "The parameter along the vertical axis of the map.", _PARAMETERS, only=MAP),
    _choice("y_scale", "spaced", "Equal steps, or equal ratios, along the vertical axis.", _SCALES, only=MAP),
    _choice("shade", "Colour", "The quantity that the colours of the map show.",
            {q: q.replace("_", " ") for q in OF_MAPS}, only=MAP),
    _number("eta"), _number("section_phase"), _number("transient"), _number("periods"),
    *(_number(name) for name in names.OTHERS),
)  # fmt: skip
"""All controls, in the order of the page."""


_SCENE = "A mass slides and sticks on a shaken incline, and hits an obstacle. Each "
_ONCE = (
    ", once per shake, darker where it is more often. Where the motion repeats with each shake, there is one dot; "
    "with every second, at most two; where it never repeats, often a band."
)
_HIT = ", darker where it is more often. Where the motion repeats, a column has few dots."
ABOUT = {
    "dxi": f"{_SCENE}column is one motion, each dot its velocity{_ONCE}",
    "xi": f"{_SCENE}column is one motion, each dot its gap to the obstacle{_ONCE}",
    "impact_phase": f"{_SCENE}column is one motion, each dot the phase of the shaking at one of its main impacts{_HIT}",
    "impact_speed": f"{_SCENE}column is one motion, each dot the speed of one of its main impacts{_HIT}",
    MAP: f"{_SCENE}point is one motion, its colour a number of it. Click a point to see it move.",
}
"""Text beside a picture, for each quantity of a diagram, and for maps."""


class Start(NamedTuple):
    """A view with the text that the page shows beside it, until another field changes than `moves`."""

    name: str
    text: str
    address: str
    moves: str = ""


STARTS = (
    Start("All of it: period doublings, again and again",
          "Shaken harder, the mass needs two shakes for a beat, then four, then it never repeats, until three shakes "
          "are a beat, and all begins anew. <em>Drag the blue knob</em> along the axis and watch the mass.",
          ""),
    Start("A ripple destroys the structure",
          "A fast ripple, ε, is added to the shaking. Press ▶ at ε: the lines fray, and in the sentence below the "
          "structure of the motion, the order of its impacts and the shakes between them, turns from kept to lost.",
          "low=3.0&high=3.25&at=3.04", "eps"),
    Start("A time step invents a diagram",
          "No ripple here: the ends of sliding and sticking are found with fixed steps Δτ. What the steps invent is "
          "orange, what they miss is blue. Move Δτ down until little colour is left.",
          "low=3.0&high=3.25&method=fixed&dtau=0.05&compare=difference&at=3.04", "dtau"),
    Start("Two points that grow into clouds",
          "One motion, shaken at A = 3.04, with more and more ripple to the right. Its two points become clouds. "
          "Drag the knob across the limit of its structure, which the paper gives as 1.7e-4.",
          "x=eps&low=0&high=3e-4&scale=linear&A=3.04&at=1e-4&periods=300"),
    Start("A window of period 5",
          "Inside the irregular band lie windows in which the motion repeats again, here with every fifth shake. "
          "Turn the wheel at an end of the window: further windows appear.",
          "low=3.155&high=3.178&at=3.165&transient=2000&periods=500"),
    Start("The last band before period 3",
          "Below A = 3.1893 the motion is irregular, above it has period 3. Drag the knob across the border, and "
          "compare the beats of the mass.",
          "low=3.186&high=3.192&at=3.191&transient=2000&periods=500"),
    Start("Map: the period, over shaking and slope",
          "Each colour is a period of the motion; black: none found in these periods. Click a point to see it move, "
          "and open the diagram through it.",
          "mode=map&x=A&y=B&low=1.0&high=4.0&y_low=0.0&y_high=0.5&at=3.04&at_y=0.1&periods=66"),
    Start("Map: the power of a pile driver",
          "A machine in SI units: the power of its impacts in W over frequency and amplitude. It has a ridge "
          "just below the values at which the mass begins to skip a shake. Change the friction μ: the ridge moves.",
          "mode=map&x=omega0&y=a0&low=80&high=200&y_low=3e-4&y_high=1.2e-3&at=150&at_y=8e-4&periods=64"
          "&shade=impact_power&bottom=0&top=25", "mu"),
)  # fmt: skip
"""Eight views, from the whole to details."""


@functools.cache
def known() -> dict[str, Any]:
    """Return what the scripts of the page know, as values for JSON."""
    allowed = {name: (row.low, min(row.high, 1e300)) for name, row in names.PARAMETERS.items()}
    allowed |= dict.fromkeys(names.SCENE, (1e-9, 1e9)) | {"alpha": (0.0, 89.9)}
    shown = (*RANGES, *figure.DIAGRAM_QUANTITIES, *OF_MAPS)
    return {
        "controls": [control._asdict() for control in CONTROLS],
        "allowed": allowed,
        "factor": {name: names.NAMES[name].scale for name in RANGES},
        "symbols": {name: symbol(name) for name in shown},
        "in_si": {name: symbol(name, si=True) for name in shown},
        "starts": [{**start._asdict(), "view": read_address(start.address).state()} for start in STARTS],
        "about": ABOUT,
        "questions": {name: f"{WORDS[name][1]}: when does it lose its beat?" for name in RANGES}
        | {name: f"Where is the {name.replace('_', ' ')} largest?" for name in OF_MAPS}
        | {name: "Where does it lose its beat?" for name in OF_MAPS if "f" not in QUANTITIES[name].dtype},
        "states": [state.name.lower() for state in vd.State],
        "steps": {m.name.lower(): m in choices.ACTS_ON["dtau"] for m in choices.Method},
    }


def build(
    view: View,
    refused: Mapping[str, str] | None = None,
    messages: Sequence[str] = (),
    places: Sequence[float] = (),
) -> str:
    """Return the HTML of the page, which contains its scripts and its style, with its first view, and the sentence of
    why it is not the view of the address, with the field that it is about. A saved page contains `messages` instead of
    a server: its picture, and its motions at `places`."""
    names = "page.html", "page.css", "page.js", "picture.js", "controls.js", "sound.js", "motion.js", "first.json"
    text, style, *scripts, first = ((Path(__file__).parent / name).read_text(encoding="utf-8") for name in names)
    own = {"view": view.state(), "address": view.address(), "places": places, **(refused or {})}
    own["stored"] = messages or (json.loads(first) if view == View() else [])
    values = json.dumps(known() | own).replace("</", "<\\/")
    for name, part in {"style": style, "known": values, "script": "\n".join(scripts)}.items():
        text = text.replace("{{ " + name + " }}", part)
    return text
