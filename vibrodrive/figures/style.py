"""Parts common to all figures: two styles (looks.py), two widths (one or two columns), names, notes and legends.

A function decorated with `styled` takes `style` and `width`. By default these are the values of the enclosing
`drawn_as` block, or "screen" and "double" outside such a block. This module does not use pyplot. Each Figure is drawn
without a display (Agg) and is not saved.
"""

from __future__ import annotations

import functools
import inspect
import io
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, Literal, TypeVar

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextToPath

from vibrodrive.figures.looks import LOOKS, Look
from vibrodrive.model.drawing import FORMATS, STYLES, WIDTHS, Style, Width
from vibrodrive.model.names import NAMES, SCENE_AXES
from vibrodrive.model.parameters import bad
from vibrodrive.store.draft import drafted

INCHES: dict[Width, float] = {
    "double": 6.85,
    "single": 3.31,
}  # 174 mm for two columns and 84 mm for one column of a journal
RESOLUTION = 250  # pixels per inch
LEGEND_LINE, BETWEEN = 2.8, 1.2  # in units of the letter size
MARGIN = 0.8  # width in inches of the labels beside the axes
GAP = 40.0  # least distance in points between the name of a panel and its note
NOTE = 0.8  # size of a note relative to titles
LETTERS: dict[Width, tuple[float, float, float]] = {"double": (10.0, 11.0, 9.0), "single": (8.5, 9.0, 7.5)}
"""Sizes of letters in points: titles, symbols at the axes, numbers and legends."""

PHASES = ("section_phase", "tau0")
PARTS = (1, 2, 3, 4, 6)  # possible denominators of phases that are written as fractions of π

DEFAULTS: dict[Any, Any] = {n: value for n, value in mpl.rcParamsDefault.items() if not n.startswith("backend")}
"""Matplotlib's own settings. They replace those of the user's matplotlibrc, so that figures are equal for all users."""

COMMON: dict[str, Any] = {
    "font.family": ["STIXGeneral"],  # Matplotlib contains this font, so that figures are equal on all machines
    "mathtext.fontset": "stix",
    "legend.frameon": False,
    "legend.handlelength": LEGEND_LINE,
    "legend.columnspacing": BETWEEN,
    "axes.linewidth": 0.6,
    "lines.linewidth": 0.8,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "hatch.linewidth": 0.5,
    "figure.constrained_layout.use": True,
    "figure.dpi": 100,
    "savefig.dpi": RESOLUTION,
    "pdf.fonttype": 42,  # embed fonts as TrueType, because journals refuse the default, Type 3
    "svg.fonttype": "path",  # letters are outlines, so that the fonts need not be installed
    "svg.hashsalt": "vibrodrive",  # element names depend on the content only, so that equal figures give equal files
    "agg.path.chunksize": 20000,
}

SYMBOLS = {name: row.mathtext for name, row in NAMES.items() if row.mathtext}
UNITS = {name: row.shown for name, row in NAMES.items() if row.shown}

_F = TypeVar("_F", bound=Callable[..., Any])
_CHOSEN: ContextVar[tuple[Style, Width]] = ContextVar("chosen", default=("screen", "double"))
_GIVEN_AXES: ContextVar[Any] = ContextVar("given axes", default=None)


def in_drawings() -> float:
    """Return the size of the letters in a drawing, in points."""
    return 6.2 if narrow() else 9.5


def defaults_and(settings: Mapping[str, Any]) -> AbstractContextManager[None]:
    """Set Matplotlib's defaults and then `settings` within a block, without any setting of the user."""
    return mpl.rc_context(DEFAULTS | dict(settings))


@contextmanager
def drawn_as(style: Style | None = None, width: Width | None = None) -> Iterator[None]:
    """Set the style and the width of all figures drawn within the block. None keeps the current style or width.

    Raises ValueError for an unknown style or width.
    """
    if style is not None and style not in STYLES:
        raise ValueError(bad("style", style, "one of " + ", ".join(STYLES)))
    if width is not None and width not in WIDTHS:
        raise ValueError(bad("width", width, "one of " + ", ".join(WIDTHS)))
    before = _CHOSEN.get()
    style, width = style or before[0], width or before[1]
    title, label, small = LETTERS[width]
    sizes = dict.fromkeys(("font.size", "axes.titlesize", "legend.title_fontsize"), title)
    sizes |= dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), small)
    colours = {"axes.prop_cycle": cycler(color=[LOOKS[style].main])}
    token = _CHOSEN.set((style, width))
    try:
        with defaults_and(COMMON | sizes | colours | {"axes.labelsize": label}):
            yield
    finally:
        _CHOSEN.reset(token)


def styled(function: _F) -> _F:
    """Decorate a drawing function: it runs within `drawn_as(style, width)`, and `new` returns the axes of `ax`."""
    parameter = inspect.signature(function).parameters.get("ax")
    takes_axes = parameter is not None and parameter.kind is parameter.KEYWORD_ONLY

    @functools.wraps(function)
    def wrapper(*args: Any, style: Style | None = None, width: Width | None = None, **kwargs: Any) -> Any:
        given = kwargs.pop("ax", None) if takes_axes else None
        token = _GIVEN_AXES.set(_GIVEN_AXES.get() if given is None else given)
        try:
            with drawn_as(style, width):
                return function(*args, **kwargs)
        finally:
            _GIVEN_AXES.reset(token)

    if takes_axes and function.__doc__:
        wrapper.__doc__ = with_shared(function.__doc__)
    return wrapper  # type: ignore[return-value]


SHARED_PARAMETERS = """\
ax : Axes or sequence of Axes, optional
    Matplotlib axes to draw into, one for each panel; by default those of a new figure.
style : "screen" or "print", optional
    "screen" has colours that colour-blind readers can distinguish; "print" is black and white, for a journal. The
    default is "screen".
width : "double" or "single", optional
    width of a new figure. "double" is two columns of a page, at most 174 mm; "single" is one column, 84 mm. The default
    is "double"."""

SHARED_RETURNS = """\
Returns
-------
Figure
    Matplotlib figure. A notebook displays it, and its method `savefig` writes it to a file. With `ax`, it is the figure
    of these axes."""

SHARED_RAISES = """\
ValueError
    if the style or the width is unknown, or if `ax` does not have one Axes for each panel."""

HEADING = re.compile(r"\n\n(?=[A-Z]\w+\n-+\n)")


def with_shared(text: str) -> str:
    """Add SHARED_PARAMETERS, SHARED_RETURNS and SHARED_RAISES to a NumPy docstring that has the section Parameters."""
    head, *sections = HEADING.split(inspect.cleandoc(text))
    named = {section.partition("\n")[0]: section for section in sections}
    if "Parameters" not in named:
        return text
    parameters, raises = named.pop("Parameters"), named.pop("Raises", "Raises\n------")
    shared = [f"{parameters}\n{SHARED_PARAMETERS}", SHARED_RETURNS, f"{raises}\n{SHARED_RAISES}"]
    return "\n\n".join([head, *shared, *named.values()]) + "\n"


def look() -> Look:
    """Return the current colours."""
    return LOOKS[_CHOSEN.get()[0]]


def narrow() -> bool:
    """Return True if the figure is for one column. Then panels are below each other instead of side by side."""
    return _CHOSEN.get()[1] == "single"


def symbol(name: str) -> str:
    """Return the axis label of a parameter or quantity; a name without a symbol is unchanged."""
    return f"${SYMBOLS[name]}$" if name in SYMBOLS else name


def number(value: float) -> str:
    """Return a value as mathtext without dollars: 0.1, 3.04, 2·10⁻⁴."""
    text = f"{value:.6g}"
    if "e" not in text and (value == 0 or abs(value) >= 1e-2):
        return text
    mantissa, exponent = f"{value:.5e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".")
    power = rf"10^{{{int(exponent)}}}"
    if mantissa in ("1", "-1"):
        return mantissa[:-1] + power
    return rf"{mantissa}\cdot{power}"


def phase(value: float) -> str:
    """Return a phase as mathtext without dollars: π/2, 3π/4, 0, 2."""
    for part in PARTS:
        count = round(value * part / math.pi)
        if count and value == count * math.pi / part:
            times = {1: "", -1: "-"}.get(count, str(count))
            return rf"{times}\pi" + (f"/{part}" if part > 1 else "")
    return number(value)


def equation(name: str, value: float) -> str:
    """Return an equation such as “ε = 2·10⁻⁴” as mathtext."""
    if name not in SYMBOLS:
        return f"{name} = ${number(value)}$"
    unit, value = UNITS.get(name, ""), float(as_shown(name, value))
    written = phase(value) if name in PHASES else number(value)
    return f"${SYMBOLS[name]} = {written}$" + (unit if unit == "°" else f" {unit}".rstrip())


def as_shown(name: str, values: Any) -> Any:
    """Return values of a parameter, number or array, in the unit used in figures."""
    return values * NAMES[name].scale if name in SCENE_AXES else values


class ShownFigure(Figure):
    """Figure that a notebook displays as the value of a cell, like a figure of pyplot.

    Matplotlib reads settings when a figure is made, but also when it is drawn (for ticks) and saved. So this figure
    keeps its style and width for all three.
    """

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._chosen = _CHOSEN.get()

    def draw(self, renderer: Any) -> None:
        with drawn_as(*self._chosen):
            super().draw(renderer)

    def savefig(self, *args: Any, **kwargs: Any) -> None:
        with drawn_as(*self._chosen):
            super().savefig(*args, **kwargs)

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """Return the image at twice the resolution, and the size in pixels at which to display it."""
        width, height = (round(inches * self.dpi) for inches in self.get_size_inches())
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=2 * self.dpi)
        return buffer.getvalue(), {"width": width, "height": height}


def given_axes() -> list[Axes]:
    """Return the axes given as `ax` to the drawing function, or [] for a new figure."""
    given = _GIVEN_AXES.get()
    return [] if given is None else list(np.array(given, dtype=object).reshape(-1))


def new(rows: int = 1, cols: int = 1, *, height: float, width: float = INCHES["double"], **options: Any):
    """Return a Figure and its axes as an object array (rows, cols).

    `height` and `width` are in inches, for a figure of two columns. A figure of one column is narrower, and its height
    is multiplied by the root of the ratio of the widths, a compromise between equal shape and equal height. If `ax` is
    given to the drawing function, these axes and their Figure are returned. Raises ValueError if `ax` does not contain
    one Axes for each panel.
    """
    if _GIVEN_AXES.get() is not None:
        given = given_axes()
        if len(given) != rows * cols or not all(isinstance(one, Axes) for one in given):
            allowed = "one Axes" if rows * cols == 1 else f"{rows * cols} Axes, one for each panel"
            raise ValueError(bad("ax", _GIVEN_AXES.get(), allowed))
        return given[0].figure, np.array(given, dtype=object).reshape(rows, cols)
    inches = min(width, INCHES[_CHOSEN.get()[1]])
    with drawn_as():
        fig = ShownFigure(figsize=(inches, height * math.sqrt(inches / width)))
        axes = fig.subplots(rows, cols, squeeze=False, **options)
    return fig, axes


def name_axes(ax: Axes, x: str | None, y: str | None) -> None:
    """Label the axes with the symbols of two quantities, with their units (None: no change)."""
    if x is not None:
        ax.set_xlabel(symbol(x) + (f" in {UNITS[x]}" if x in UNITS else ""))
    if y in UNITS:
        ax.set_ylabel(f"{symbol(y)} in {UNITS[y]}")
    elif y is not None:
        ax.set_ylabel(symbol(y), rotation=0, labelpad=9, va="center")


def letter(ax: Axes, index: int, text: str = "") -> None:
    """Write a), b), … and `text` at the upper left of a panel."""
    name = f"{chr(ord('a') + index)})"
    ax.set_title(f"{name} {text}".rstrip(), loc="left")


def note(ax: Axes, text: str | Sequence[str], above: bool = False, *, side: Literal["left", "right"] = "right") -> None:
    """Write a note in small letters at the upper right of a panel.

    If note and name of the panel do not fit into one line, or if `above`, the note is above the name. A sequence of
    phrases is wrapped between the phrases. `side` is "left" for a panel with a colour bar and without a name.
    """
    title, _, _ = LETTERS[_CHOSEN.get()[1]]
    size = NOTE * title
    cell = ax.get_subplotspec()
    inches = ax.figure.figure.get_figwidth()
    room = 72 * (inches * ax.get_position().width if given_axes() else inches - MARGIN)
    if not isinstance(text, str):
        text = wrapped(text, room, size)
    alone = cell is None or cell.get_gridspec().ncols == 1
    name = ax.get_title(loc="left")
    line = text.rsplit("\n", 1)[-1]
    if text and (above or (name and not (alone and extent(name, title) + extent(line, size) < room - GAP))):
        text += "\n"
    ax.set_title(text, loc=side, fontsize=size, color="0.35")


def extent(text: str, size: float) -> float:
    """Return the width of one line of text, which may contain mathtext, in points."""
    letters = FontProperties(family=COMMON["font.family"], math_fontfamily=COMMON["mathtext.fontset"], size=size)
    return TextToPath().get_text_width_height_descent(text, letters, ismath="$" in text)[0]


def wrapped(parts: Sequence[str], room: float, size: float) -> str:
    """Join parts of a sentence with commas, in lines of at most `room` points."""
    lines = [""]
    for part in filter(None, parts):
        longer = f"{lines[-1]}, {part}" if lines[-1] else part
        if lines[-1] and extent(longer + ",", size) > room:
            lines[-1] += ","
            lines.append(part)
        else:
            lines[-1] = longer
    return "\n".join(lines)


def explain(fig: Figure, more: Sequence[Artist] = ()) -> None:
    """Draw a legend of all labels, each once, and of the entries `more`.

    The legend is below a new figure, or in the last of the axes given as `ax`.
    """
    named: dict[str, Artist] = {}
    for ax in given_axes() or fig.axes:
        named |= dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    named |= {str(handle.get_label()): handle for handle in more}
    if not named:
        return
    if given_axes():
        light = {"frameon": True, "framealpha": 0.8, "edgecolor": "none"}  # "best" ignores images
        given_axes()[-1].legend(list(named.values()), list(named), loc="best", **light)
        return
    columns = _columns(list(named), 72 * fig.get_figwidth())
    fig.legend(list(named.values()), list(named), loc="outside lower center", ncols=columns, borderpad=0.2)


def _columns(names: Sequence[str], room: float) -> int:
    """Return the largest number of legend columns that fit into a width of `room` points, with no empty column."""
    _, _, size = LETTERS[_CHOSEN.get()[1]]
    # the drawn text is slightly wider than the measured text
    widths = np.array([1.03 * extent(name, size) + (LEGEND_LINE + 0.8) * size for name in names])
    for columns in range(len(names), 1, -1):
        rows = -(-len(names) // columns)
        wide = [part.max() for part in np.array_split(widths, columns)]  # the same split as in Matplotlib
        fits = sum(wide) + (columns - 1) * BETWEEN * size + size <= room
        if fits and -(-len(names) // rows) == columns:
            return columns
    return 1


def save(fig: Figure, path: str | Path, dpi: int | None = None) -> Path:
    """Write a figure as .png, .pdf or .svg, by the ending of `path`. Equal figures give equal bytes.

    An older file is replaced only when the new file is complete. Raises ValueError for any other ending, and OSError
    with the path if the system refuses to write.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise ValueError(bad("figure", str(path), "a file name ending in " + ", ".join(FORMATS)))
    undated = {".png": {}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    try:
        with drafted(path) as draft:
            fig.savefig(draft, format=ending[1:], dpi=dpi or RESOLUTION, metadata=undated[ending])
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None
    return path
