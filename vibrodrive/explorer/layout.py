"""Bokeh models of the page: figures, widgets, and the data sources that connect it to the server."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from bokeh import models
from bokeh.document import Document
from bokeh.events import DoubleTap, Tap
from bokeh.layouts import column, row
from bokeh.models import ColumnDataSource, CustomJS, CustomJSTickFormatter, Div, HoverTool, Range1d
from bokeh.plotting import figure

from vibrodrive.explorer.view import BESIDE, COMPARISONS, DIAGRAM, DIMENSIONLESS, METHODS, OF_MAPS, RANGES, SI, View
from vibrodrive.model.drawing import DIAGRAM_QUANTITIES, MAP
from vibrodrive.model.names import LINEAR, LOG, NAMES, SCENE
from vibrodrive.model.states import LASTING

HERE = Path(__file__).parent

CURVE_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#666666", "#bbbbbb")  # states of LASTING, then the excitation
SLIDERS = ("B", "eps", "eta", "section_phase", "dtau", "A", "transient", "periods")
EXPONENTS = ("dtau",)  # sliders of the decimal logarithm of their value
PLAIN_FIELDS = ("xi0", "dxi0", "tau0", "tol", "columns", "rows")
WIDE, TALL, LOW = 900, 440, 280
WORDS_TALL = 260  # fixed, since a height that follows the text would lay out the page again at each click


@dataclass
class Page:
    """Models that the server changes or observes.

    `frame` contains the image of the first diagram, `other` that of the second.
    """

    root: Any
    request: ColumnDataSource
    news: ColumnDataSource
    frame: ColumnDataSource
    other: ColumnDataSource
    motion: ColumnDataSource
    stable: ColumnDataSource
    unstable: ColumnDataSource
    marks: ColumnDataSource
    curves: ColumnDataSource
    figures: list[Any]


BLANK: dict[str, Any] = {name: [0] for name in ("head", "image", "palette", "x", "y", "dw", "dh")}
LOADING = "loading the kernels; the first run after an installation compiles them, which takes a few minutes"
HINT = "A click on a diagram shows the motion at that point. A click on a map shows the diagram at that point."
NO_LINES: dict[str, list[Any]] = {"x": [], "y": []}
NO_MARKS: dict[str, list[Any]] = {"x": [], "y": [], "kind": [], "A": [], "period": [], "colour": []}
NO_CURVES: dict[str, list[Any]] = {"x": [], "y": [], "kind": [], "period": [], "colour": []}
NO_MOTION: dict[str, Any] = {name: [] for name in ("time", "xi", "dxi", "colour")}


def build(document: Document, view: View, token: str) -> Page:
    """Build all models for a view, and the scripts that connect them in the browser."""
    frame, other = (ColumnDataSource(BLANK) for _ in range(2))
    request, news = ColumnDataSource({"message": [""]}), ColumnDataSource({"items": ["[]"]})
    # separate ranges for the second diagram: with shared ones Bokeh would lay it out at each move even while hidden
    (x_range, y_range), (x2, y2) = ((Range1d(view.low, view.high), Range1d(-1.0, 1.0)) for _ in range(2))
    inputs = _inputs(view)
    sliders = {name: _slider(name, view) for name in SLIDERS}
    format_x, format_y = _ticks(inputs["scale"], None), _ticks(inputs["y_scale"], inputs["mode"])
    one, two = (_diagram(x, y, format_x, format_y) for x, y in ((x_range, y_range), (x2, y2)))
    stable, unstable, marks, curves = (ColumnDataSource(d) for d in (NO_LINES, NO_LINES, NO_MARKS, NO_CURVES))
    lines = [
        one.multi_line("x", "y", source=stable, color="#0072B2", width=1.5),
        one.multi_line("x", "y", source=unstable, color="#D55E00", width=1.2, dash=[6, 3]),
        one.scatter("x", "y", source=marks, size=8, fill_color="white", line_color="colour", line_width=1.5),
    ]
    named = one.multi_line("x", "y", source=curves, color="colour", width=2)
    tips = [("", "@kind, period @period"), ("A", "@A")]
    one.add_tools(HoverTool(renderers=[lines[2]], tooltips=tips), HoverTool(renderers=[named], tooltips=tips[:1]))
    motion = ColumnDataSource(NO_MOTION)
    phase = _curve(motion, "xi", "dxi", 300, tools="pan,wheel_zoom,box_zoom,reset", y_axis_label="ξ′", x_axis_label="ξ")
    tools = "xpan,xwheel_zoom,box_zoom,reset"
    time = _curve(motion, "time", "xi", 600, tools=tools, x_axis_label="τ/2π", y_axis_label="ξ")
    notice = Div(text="", width=WIDE, height=18, styles={"color": "#b00020"})
    status, words = Div(text=LOADING, width=WIDE, height=36), Div(text=HINT, width=270, height=WORDS_TALL)
    labels = ("Back", "Reset", "Fit", "TOML", "PNG", "PDF")
    buttons = {label: models.Button(label=label, width=70, height=30) for label in labels}
    top = ("mode", "quantity", "shade", "x", "scale", "y", "y_scale", "method", "compare", "orbits")
    side = {n: row(sliders[n], inputs[n]) for n in SLIDERS}
    scene = [row(*(inputs[n] for n in names)) for names in (tuple(SCENE)[:3], tuple(SCENE)[3:])]
    only = {
        DIMENSIONLESS: [side["A"], side["B"]],
        SI: scene,
        "map": [inputs["shade"], inputs["y"], inputs["y_scale"], inputs["rows"], named],
        "diagram": [inputs["quantity"], inputs["compare"], *lines],
    }
    # the same visibility as the script sets, since each later change would lay out the page again
    for name, items in only.items():
        for item in items:
            item.visible = name in (view.mode, view.scene)
    two.visible = view.compared and view.compare == BESIDE
    for p in (one, two):
        p.height = LOW if two.visible else TALL
        p.xaxis.axis_label = symbol(view.x)
        p.yaxis.axis_label = symbol(view.y if view.mode == MAP else view.quantity)
    root = column(
        row(*(inputs[n] for n in top)),
        row(
            column(notice, one, two, status, _legend(), row(phase, time)),
            column(
                row(*list(buttons.values())[:3]),
                row(*list(buttons.values())[3:]),
                *side.values(),
                inputs["scene"],
                *scene,
                row(*(inputs[n] for n in PLAIN_FIELDS[:3])),
                row(*(inputs[n] for n in PLAIN_FIELDS[3:])),
                words,
            ),
        ),
    )
    axes = {"x": [p.xaxis[0] for p in (one, two)], "y": [p.yaxis[0] for p in (one, two)]}
    args = {
        "request": request, "news": news, "x_range": x_range, "y_range": y_range, "fields": inputs,
        "sliders": sliders, "exponents": list(EXPONENTS), "second": two, "only": only, "status": status,
        "notice": notice, "words": words, "token": token, "axes": axes,
        "x2": x2, "y2": y2, "first": one, "heights": [TALL, LOW], "frame": frame, "other": other,
    }  # fmt: skip
    _join(document, args, buttons)
    for shown in (one, two, x_range, y_range, x2, y2):
        shown.syncable = False  # the script sends complete views to the server instead
    root.tags = [request, news, frame, other]  # otherwise models used by scripts only are not part of the document
    document.title = "vibrodrive explore"
    document.add_root(root)
    return Page(root, request, news, frame, other, motion, stable, unstable, marks, curves, [one, two])


def _join(document: Document, args: dict[str, Any], buttons: dict[str, models.Button]) -> None:
    """Pass the models to the scripts, by the names used there, and connect every change to them."""
    script = "\n".join((HERE / name).read_text() for name in ("picture.js", "browser.js"))
    document.js_on_event("document_ready", CustomJS(args=args, code=script))
    document.js_on_event("connection_lost", _call("lost(true)"))
    document.js_on_event("client_reconnected", _call("lost(false)"))
    moved, entered, slid, tapped = map(_call, ("moved(cb_obj)", "enter(cb_obj)", "slide(cb_obj)", "tap(cb_obj)"))
    for axis in (args[name] for name in ("x_range", "y_range", "x2", "y2")):
        for end in ("start", "end"):
            axis.js_on_change(end, moved)
    for field in args["fields"].values():
        field.js_on_change("value", entered)
    for slider in args["sliders"].values():
        slider.js_on_change("value", slid)
    args["frame"].js_on_change("data", _call("painted()"))
    args["news"].js_on_change("data", _call("hear()"))
    for shown in (args["first"], args["second"]):
        for click in (Tap, DoubleTap):  # two quick clicks on neighbouring columns give a DoubleTap
            shown.js_on_event(click, tapped)
    buttons["Back"].js_on_click(CustomJS(code="history.back()"))
    buttons["Fit"].js_on_click(_call("fit_now()"))
    buttons["Reset"].js_on_click(_call("command({reset: true})"))
    for kind in ("TOML", "PNG", "PDF"):
        buttons[kind].js_on_click(_call(f"command({{file: '{kind.lower()}'}})"))


def symbol(name: str) -> str:
    """Return the symbol of the paper in Unicode, with the unit: SI units on the page, while figures may show mm."""
    if name not in NAMES:
        return name.replace("_", " ")
    row = NAMES[name]
    unit = row.unit if row.scale != 1.0 else row.shown
    return f"{row.symbol} ({unit})" if unit else row.symbol


def _call(call: str) -> CustomJS:
    """Return a callback that calls a function of browser.js, if that script has run."""
    return CustomJS(code=f"if (window.explorer) window.explorer.{call}")


def _ticks(scale: models.Select, mode: models.Select | None) -> CustomJSTickFormatter:
    return CustomJSTickFormatter(args={"scale": scale, "mode": mode}, code=(HERE / "ticks.js").read_text())


def _diagram(x_range: Range1d, y_range: Range1d, format_x: Any, format_y: Any) -> Any:
    p = figure(
        width=WIDE, height=TALL, x_range=x_range, y_range=y_range, tools="pan,wheel_zoom,box_zoom", active_drag="pan",
        active_scroll="wheel_zoom", toolbar_location="above", lod_interval=0, min_border_left=100, min_border_right=30,
        min_border_bottom=50, background_fill_color=None, border_fill_color=None,
    )  # fmt: skip
    p.toolbar.logo = None
    p.center.clear()  # no grid: it would be redrawn with every frame
    p.axis.minor_tick_line_color = None
    p.xaxis.formatter, p.yaxis.formatter = format_x, format_y
    p.xaxis.ticker.desired_num_ticks = 6
    return p


def _curve(motion: ColumnDataSource, x: str, y: str, width: int, **options: Any) -> Any:
    """Return a small figure of two columns of a motion."""
    p = figure(width=width, height=250, **options)
    p.toolbar.logo = None
    p.yaxis.major_label_orientation = "vertical"  # constant width, so that the page is not laid out again
    p.axis.minor_tick_line_color = None
    p.center.clear()  # no grids: they take a tenth of the time from a click to the curves
    p.multi_line(x, y, source=motion, color="colour", line_width=1.5)
    return p


def _legend() -> Div:
    """Return the legend of the curves of a motion."""
    names = [*(state.name.lower() for state in LASTING), "sin τ (scaled)"]
    lines = (f"<span style='color:{c}'>&#9473;&#9473;</span> {n}" for n, c in zip(names, CURVE_COLOURS, strict=True))
    return Div(text=" &emsp; ".join(lines), width=WIDE - 30, height=18, styles={"text-align": "right"})


def _inputs(view: View) -> dict[str, Any]:
    """Return a widget for every field of a view except the ranges."""
    parameters = [(name, symbol(name)) for name in RANGES]
    choices = {
        "mode": ("mode", [DIAGRAM, MAP], 95),
        "quantity": ("ordinate", [(q, symbol(q)) for q in DIAGRAM_QUANTITIES], 115),
        "shade": ("colour", list(OF_MAPS), 150),
        "x": ("abscissa", parameters, 105),
        "scale": ("axis", [LINEAR, LOG], 80),
        "y": ("ordinate", parameters, 105),
        "y_scale": ("axis", [LINEAR, LOG], 80),
        "method": ("switches by", list(METHODS), 105),
        "compare": ("certified too", list(COMPARISONS), 110),
        "scene": ("A and B", [(DIMENSIONLESS, "entered directly"), (SI, "from a scene (SI)")], 165),
    }
    state = view.state()
    found: dict[str, Any] = {
        name: models.Select(name=name, title=title, options=options, value=state[name], width=width)
        for name, (title, options, width) in choices.items()
    }
    for name in (*SLIDERS, *PLAIN_FIELDS, *SCENE, "orbits"):
        title = "" if name in SLIDERS else "exact orbits to period" if name == "orbits" else symbol(name)
        width = 100 if name in SLIDERS else 140 if name == "orbits" else 80
        found[name] = models.TextInput(
            name=name, title=title, value=repr(state[name]), width=width, disabled=name in view.axes
        )
    assert {*found} == {f.name for f in fields(View)} - {"low", "high", "bottom", "top", "y_low", "y_high", "at"}
    return found


def _slider(name: str, view: View) -> models.Slider:
    start, end, step = NAMES[name].slider or (0.0, 1.0, 0.1)
    value = float(getattr(view, name))
    value = math.log10(value) if name in EXPONENTS else value
    shown = "log Δτ" if name in EXPONENTS else symbol(name)
    shown_as: dict[str, Any] = {"title": shown, "width": 150, "show_value": False, "disabled": name in view.axes}
    return models.Slider(name=name, start=start, end=end, step=step, value=min(end, max(start, value)), **shown_as)
