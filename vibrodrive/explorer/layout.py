"""Page of the explorer: template, figures, and the data sources through which page and server exchange data."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bokeh.core.templates import get_env
from bokeh.document import Document
from bokeh.events import DoubleTap
from bokeh.models import ColumnDataSource, CustomJS, CustomJSTicker, CustomJSTickFormatter, HoverTool, Range1d, Span
from bokeh.plotting import figure

from vibrodrive.explorer.controls import EXPONENTS, GROUPS, symbol
from vibrodrive.explorer.starts import ABOUT, STARTS
from vibrodrive.explorer.view import OF_MAPS, RANGES, View
from vibrodrive.model.bifurcations import BIFURCATIONS
from vibrodrive.model.choices import ACTS_ON
from vibrodrive.model.drawing import DIAGRAM_QUANTITIES
from vibrodrive.model.states import LASTING

HERE = Path(__file__).parent

NAMES = [state.name.lower() for state in LASTING]
CURVES = [*zip(("#0072B2", "#D55E00", "#009E73", "#666666"), NAMES, strict=True), ("#bbbbbb", "sin τ (scaled)")]
"""Colours and names of the curves of a motion: one for each state of LASTING, the last for the excitation."""
LOOKS = {"stable orbit": ("#0072B2", 1.5, "solid"), "unstable orbit": ("#D55E00", 1.2, "dashed")} | {
    kind: (b.colour, 2.0, "solid") for kind, b in BIFURCATIONS.items()
}
"""Colour, width and dashes of exact curves."""
ODD = "#CC3311"  # colour of ticks at columns whose status is not OK
KINDS = {
    "png": "picture (PNG)",
    "pdf": "figure for print (PDF)",
    "svg": "figure for drawing programs (SVG)",
    "toml": "configuration (TOML)",
    "py": "lines of Python",
    "link": "link to this view",
    "h5": "data (HDF5)",
    "csv": "selected motion (CSV)",
}
OPENED = ("Parameters", "Method")  # groups of controls that are open at first
PLAYED = ("eps", "dtau")  # sliders with a button that moves them


@dataclass
class Page:
    """Data that the server changes: the curves of the selected motion, and exact curves and bifurcations (marks)."""

    motion: ColumnDataSource
    lines: ColumnDataSource
    marks: ColumnDataSource


SCRIPTS = "picture.js", "browser.js", "reading.js", "mechanism.js"
LOADING = "loading the kernels; the first run of a version compiles them, which takes some minutes"
NO_CURVES: dict[str, Any] = {name: [] for name in ("x", "y", "A", "kind", "period", "colour", "width", "dash")}
NO_MOTION: dict[str, Any] = {name: [] for name in ("time", "xi", "dxi", "colour")}


def build(document: Document, view: View, token: str) -> Page:
    """Add to a document the models for a view, and the scripts that connect these models in the browser.

    `token` is a part of the address of the page (server.py).
    """
    # the second diagram has separate ranges: with common ranges it would be laid out after each move, even if it is
    # hidden
    (x_range, y_range), (x2, y2) = ((Range1d(view.low, view.high), Range1d(-1.0, 1.0)) for _ in range(2))
    one, two = _diagram("first", x_range, y_range), _diagram("second", x2, y2)
    lines, marks, motion = (ColumnDataSource(nothing) for nothing in (NO_CURVES, NO_CURVES, NO_MOTION))
    curves = one.multi_line("x", "y", source=lines, color="colour", line_width="width", line_dash="dash")
    points = one.scatter("x", "y", source=marks, size=8, fill_color="white", line_color="colour", line_width=1.5)
    tips = [("", "@kind, period @period"), ("A", "@A")]
    one.add_tools(
        HoverTool(renderers=[points], tooltips=tips, attachment="above"),
        HoverTool(renderers=[curves], tooltips=tips[:1], attachment="below"),
    )
    phase = _curve("phase", motion, "xi", "dxi", tools="pan,wheel_zoom", y_axis_label="ξ′", x_axis_label="ξ")
    time = _curve("time", motion, "time", "xi", tools="xpan,xwheel_zoom", x_axis_label="τ/2π", y_axis_label="ξ")
    moment = Span(dimension="height", line_color="#888888", line_width=1)  # the line in the time series
    time.add_layout(moment)
    args: dict[str, Any] = {
        "x_range": x_range, "y_range": y_range, "exponents": list(EXPONENTS),
        "second": two, "moment": moment, "token": token, "about": ABOUT,
        "small": [phase, time], "x2": x2, "y2": y2, "first": one,
        "starts": [start._asdict() for start in STARTS], "motion": motion, "colours": [colour for colour, _ in CURVES],
        "names": NAMES,
        "acts": {name: [m.name.lower() for m in methods] for name, methods in ACTS_ON.items()},
        "symbols": {name: symbol(name) for name in (*RANGES, *DIAGRAM_QUANTITIES, *OF_MAPS)},
        "in_si": {name: symbol(name, si=True) for name in (*DIAGRAM_QUANTITIES, *OF_MAPS)},
    }  # fmt: skip
    script = "\n".join((HERE / name).read_text() for name in SCRIPTS)
    document.js_on_event("document_ready", CustomJS(args=args, code=script))
    for shown in (one, two, x_range, y_range, x2, y2):
        shown.syncable = False  # not synchronised one by one, because the page sends the complete view in one message
    document.title = "vibrodrive explore"
    document.config.notify_connection_status = False  # browser.js reports a lost connection
    document.template = get_env().from_string((HERE / "page.html.jinja").read_text())
    document.template_variables.update(
        groups=GROUPS, opened=OPENED, starts=STARTS, played=PLAYED, kinds=KINDS, loading=LOADING,
        style=(HERE / "page.css").read_text(),
    )  # fmt: skip
    for root in (one, two, phase, time):
        document.add_root(root)
    return Page(motion, lines, marks)


def _diagram(name: str, x_range: Range1d, y_range: Range1d) -> Any:
    """Return an empty diagram. browser.js sets the scales of its axes."""
    p = figure(
        name=name, sizing_mode="stretch_both", x_range=x_range, y_range=y_range, tools="pan,wheel_zoom,box_zoom",
        active_drag="pan", active_scroll="wheel_zoom", toolbar_location="above", lod_interval=0, min_border_left=70,
        min_border_right=20, background_fill_color=None, border_fill_color=None,
    )  # fmt: skip
    p.toolbar.logo = None
    p.grid.visible = False  # a visible grid is drawn again with every picture, which takes time
    p.grid.grid_line_alpha = 0.6
    numbers, ticks = ((HERE / name).read_text() for name in ("numbers.js", "ticks.js"))
    minor, scale = ticks.replace("MOST = 8", "MOST = 40"), {"scale": "linear"}
    for axis in p.axis:
        axis.formatter = CustomJSTickFormatter(args=scale, code=numbers)
        axis.ticker = CustomJSTicker(args=scale, major_code=ticks, minor_code=minor)
    return p


def _curve(name: str, motion: ColumnDataSource, x: str, y: str, **options: Any) -> Any:
    """Return a small figure of two columns of a motion."""
    p = figure(name=name, sizing_mode="stretch_both", toolbar_location=None, **options)
    p.toolbar.active_scroll = p.tools[1]
    p.js_on_event(DoubleTap, CustomJS(args={"p": p}, code="p.reset.emit()"))
    p.yaxis.major_label_orientation = "vertical"  # constant width, so that the page is not laid out again
    p.axis.minor_tick_line_color = None
    p.center.clear()  # grids would take a tenth of the time until the curves appear
    p.multi_line(x, y, source=motion, color="colour", line_width=1.5)
    return p


def key_of_lines(entries: Iterable[tuple[str, str]], sign: str = "━━") -> str:
    """Return the key to lines or to other signs, each with its colour and its name, as HTML."""
    entry = "<span class='entry'><span class='colours' style='color:{}'>{}</span> {}</span>"
    return " ".join(entry.format(colour, sign, name) for colour, name in entries)
