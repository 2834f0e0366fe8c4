"""What all figures share: two looks (looks.py), two widths (one column of a page, or both), names, notes and legends.

A function that is `styled` takes `style` and `width`; what they leave open is what is in force around the call
(`drawn_as`), at the outermost "screen" and "double".

No pyplot: a Figure is an object that is returned, drawn headless (Agg) and saved by the caller.
"""

from __future__ import annotations

import functools
import inspect
import io
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
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
from matplotlib.ticker import MaxNLocator

from vibrodrive.figures.docstrings import with_shared
from vibrodrive.figures.looks import LOOKS, Look
from vibrodrive.model.drawing import FORMATS, STYLES, WIDTHS, Style, Width
from vibrodrive.model.names import NAMES, SCENE_AXES
from vibrodrive.model.parameters import bad
from vibrodrive.store.draft import drafted

INCHES: dict[Width, float] = {"double": 6.85, "single": 3.31}
"""174 and 84 mm: what the narrower of the usual journals print over two columns and over one."""

RESOLUTION = 250
"""Pixels per inch of what is made of pixels."""

LEGEND_LINE, BETWEEN = 2.8, 1.2  # widths of a letter

COMMON: dict[str, Any] = {
    "font.family": "STIXGeneral",  # comes with matplotlib: the same figure on every machine
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
    "pdf.fonttype": 42,  # the letters used are embedded as a TrueType font: journals refuse the default, Type 3
    "svg.fonttype": "path",  # letters as outlines: the same where the fonts are not installed
    "svg.hashsalt": "vibrodrive",  # element names by content: the same figure is the same file
    "agg.path.chunksize": 20000,
}

LETTERS: dict[Width, tuple[float, float, float]] = {"double": (10.0, 11.0, 9.0), "single": (8.5, 9.0, 7.5)}
"""Sizes in points: of titles, of the symbols at the axes, and of numbers and legends."""

NOTE = 0.8  # of the size of titles

SYMBOLS = {name: row.mathtext for name, row in NAMES.items() if row.mathtext}

UNITS = {name: row.shown for name, row in NAMES.items() if row.shown}

_F = TypeVar("_F", bound=Callable[..., Any])

_CHOSEN: ContextVar[tuple[Style, Width]] = ContextVar("chosen", default=("screen", "double"))


def in_drawings() -> float:
    """Size of the letters in a drawing, which are to fit what stands around them, in points."""
    return 6.2 if narrow() else 9.5


@contextmanager
def drawn_as(style: Style | None = None, width: Width | None = None) -> Iterator[None]:
    """Draw in this style and for this width until the block ends; None leaves what is in force.

    The caller's own settings of Matplotlib come back afterwards. Raises ValueError for an unknown style or width.
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
        with mpl.rc_context(COMMON | sizes | colours | {"axes.labelsize": label}):  # type: ignore[arg-type]
            yield
    finally:
        _CHOSEN.reset(token)


_GIVEN: ContextVar[Any] = ContextVar("given", default=None)
"""What a caller gave as `ax` to the function that is drawing: axes for its panels."""


def styled(function: _F) -> _F:
    """Run a drawing function as `drawn_as` its arguments `style` and `width`, into the axes of its argument `ax`.

    It need not look at any of them itself: `new` does. What they are its docstring need not say either.
    """
    parameter = inspect.signature(function).parameters.get("ax")
    takes_axes = parameter is not None and parameter.kind is parameter.KEYWORD_ONLY

    @functools.wraps(function)
    def wrapper(*args: Any, style: Style | None = None, width: Width | None = None, **kwargs: Any) -> Any:
        given = kwargs.pop("ax", None) if takes_axes else None
        token = _GIVEN.set(_GIVEN.get() if given is None else given)
        try:
            with drawn_as(style, width):
                return function(*args, **kwargs)
        finally:
            _GIVEN.reset(token)

    if takes_axes and function.__doc__:
        wrapper.__doc__ = with_shared(function.__doc__)
    return wrapper  # type: ignore[return-value]


def look() -> Look:
    """The colours in force."""
    return LOOKS[_CHOSEN.get()[0]]


def narrow() -> bool:
    """Whether the figure is for one column: panels then stand below each other rather than side by side."""
    return _CHOSEN.get()[1] == "single"


def in_given_axes() -> bool:
    """Whether the caller gave the axes to draw into: what is around them, a legend below, is not ours."""
    return _GIVEN.get() is not None


def symbol(name: str) -> str:
    """Axis label of a parameter or quantity; a name that is not in the paper is shown unchanged."""
    return f"${SYMBOLS[name]}$" if name in SYMBOLS else name


def number(value: float) -> str:
    """A value as mathtext without dollars: 0.1, 3.04, 2·10⁻⁴."""
    text = f"{value:.6g}"
    if "e" not in text and (value == 0 or abs(value) >= 1e-2):
        return text
    mantissa, exponent = f"{value:.5e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".")
    power = rf"10^{{{int(exponent)}}}"
    if mantissa in ("1", "-1"):
        return mantissa[:-1] + power
    return rf"{mantissa}\cdot{power}"


PHASES = ("section_phase", "tau0")

PARTS = (1, 2, 3, 4, 6)


def phase(value: float) -> str:
    """A phase as mathtext without dollars: π/2, 3π/4, 0, 2."""
    for part in PARTS:
        count = round(value * part / math.pi)
        if count and value == count * math.pi / part:
            times = {1: "", -1: "-"}.get(count, str(count))
            return rf"{times}\pi" + (f"/{part}" if part > 1 else "")
    return number(value)


def equation(name: str, value: float) -> str:
    """“ε = 2·10⁻⁴” as mathtext."""
    if name not in SYMBOLS:
        return f"{name} = ${number(value)}$"
    unit, value = UNITS.get(name, ""), float(as_shown(name, value))
    written = phase(value) if name in PHASES else number(value)
    return f"${SYMBOLS[name]} = {written}$" + (unit if unit == "°" else f" {unit}".rstrip())


def as_shown(name: str, values: Any) -> Any:
    """Values of a parameter, number or array, in the unit that figures show."""
    return values * NAMES[name].scale if name in SCENE_AXES else values


class ShownFigure(Figure):
    """A Figure that a notebook shows where it is the value of a cell, as those of pyplot are."""

    @styled
    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """The picture at twice the resolution, and the size in pixels that it is to have."""
        width, height = (round(inches * self.dpi) for inches in self.get_size_inches())
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=2 * self.dpi)
        return buffer.getvalue(), {"width": width, "height": height}


def given_axes() -> list[Axes]:
    """The axes that the caller gave to draw into; none if there is to be a new figure."""
    given = _GIVEN.get()
    return [] if given is None else list(np.array(given, dtype=object).reshape(-1))


def new(rows: int = 1, cols: int = 1, *, height: float, width: float = INCHES["double"], **options: Any):
    """A Figure and its axes as an object array (rows, cols); `height` and `width` in inches over two columns.

    For one column it is narrower, and lower by the root of that: half way between the same shape and the same height.
    In their place those axes that the caller gave, and their Figure. Raises ValueError unless there is one a panel.
    """
    if in_given_axes():
        given = given_axes()
        if len(given) != rows * cols or not all(isinstance(one, Axes) for one in given):
            allowed = "one Axes" if rows * cols == 1 else f"{rows * cols} Axes, one for each panel"
            raise ValueError(bad("ax", _GIVEN.get(), allowed))
        return given[0].figure, np.array(given, dtype=object).reshape(rows, cols)
    inches = min(width, INCHES[_CHOSEN.get()[1]])
    with drawn_as():
        fig = ShownFigure(figsize=(inches, height * math.sqrt(inches / width)))
        axes = fig.subplots(rows, cols, squeeze=False, **options)
    return fig, axes


def name_axes(ax: Axes, x: str | None, y: str | None) -> None:
    """Label the axes with the symbols of two quantities, with their units (None: leave as it is)."""
    if x is not None:
        ax.set_xlabel(symbol(x) + (f" in {UNITS[x]}" if x in UNITS else ""))
    if y in UNITS:
        ax.set_ylabel(f"{symbol(y)} in {UNITS[y]}")
    elif y is not None:
        ax.set_ylabel(symbol(y), rotation=0, labelpad=9, va="center")


def letter(ax: Axes, index: int, text: str = "") -> None:
    """Name a panel a), b), … at its upper left, with what distinguishes it."""
    name = f"{chr(ord('a') + index)})"
    ax.set_title(f"{name} {text}".rstrip(), loc="left")


def note(ax: Axes, text: str | Sequence[str], above: bool = False, *, side: Literal["left", "right"] = "right") -> None:
    """What holds for the whole panel, small, at its upper right; above its name where both do not fit, or if `above`.

    Of a sequence each part stays whole, and as many as fit share a line. `side` is "left" for a panel without a name
    and with a colour bar, above which the note ends.
    """
    title, _, _ = LETTERS[_CHOSEN.get()[1]]
    size = NOTE * title
    cell = ax.get_subplotspec()
    inches = ax.figure.figure.get_figwidth()
    room = 72 * (inches * ax.get_position().width if in_given_axes() else inches - MARGIN)
    if not isinstance(text, str):
        text = wrapped(text, room, size)
    alone = cell is None or cell.get_gridspec().ncols == 1
    name = ax.get_title(loc="left")
    line = text.rsplit("\n", 1)[-1]
    if text and (above or (name and not (alone and extent(name, title) + extent(line, size) < room - GAP))):
        text += "\n"
    ax.set_title(text, loc=side, fontsize=size, color="0.35")


MARGIN = 0.8  # inches beside the axes

GAP = 40.0  # points


def extent(text: str, size: float) -> float:
    """Width of one line of text, which may have mathtext in it, in points."""
    letters = FontProperties(family=COMMON["font.family"], math_fontfamily=COMMON["mathtext.fontset"], size=size)
    return TextToPath().get_text_width_height_descent(text, letters, ismath="$" in text)[0]


def wrapped(parts: Sequence[str], room: float, size: float) -> str:
    """Parts of a sentence, with commas between them, in lines of at most `room` points."""
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
    """A legend below a figure: what is labelled in any panel, each thing once, and `more`; in columns that fit.

    In axes that were given it stands in the last of them: what is below them is not ours.
    """
    named: dict[str, Artist] = {}
    for ax in given_axes() or fig.axes:
        named |= dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    named |= {str(handle.get_label()): handle for handle in more}
    if not named:
        return
    if in_given_axes():
        light = {"frameon": True, "framealpha": 0.8, "edgecolor": "none"}  # "best" does not look at images
        given_axes()[-1].legend(list(named.values()), list(named), loc="best", **light)
        return
    columns = _columns(list(named), 72 * fig.get_figwidth())
    fig.legend(list(named.values()), list(named), loc="outside lower center", ncols=columns, borderpad=0.2)


def _columns(names: Sequence[str], room: float) -> int:
    """The most columns of a legend that fit `room` points, without one more than its rows need."""
    _, _, size = LETTERS[_CHOSEN.get()[1]]
    widths = np.array(
        [1.03 * extent(name, size) + (LEGEND_LINE + 0.8) * size for name in names]
    )  # drawn a little wider
    for columns in range(len(names), 1, -1):
        rows = -(-len(names) // columns)
        wide = [part.max() for part in np.array_split(widths, columns)]  # split as Matplotlib does
        fits = sum(wide) + (columns - 1) * BETWEEN * size + size <= room
        if fits and -(-len(names) // rows) == columns:
            return columns
    return 1


def periods_ticks(ax: Axes, low: float, high: float) -> None:
    """A τ axis from `low` to `high` counted in excitation periods 2π, from the first one shown."""
    first = math.floor(low / (2 * math.pi) + 1e-9)
    count = max(1, round((high - low) / (2 * math.pi)))
    round_numbers = MaxNLocator(nbins=6 if narrow() else 12, steps=[1, 2, 5, 10], integer=True)
    shown = np.asarray(round_numbers.tick_values(0, count))
    shown = shown[(shown >= 0) & (shown <= count)]
    ax.set_xticks((first + shown) * 2 * math.pi, [f"{k:.0f}" for k in shown])
    ax.set_xlim(low, high)
    start = rf" - {first}" if first else ""
    ax.set_xlabel(rf"$\tau/2\pi{start}$")


@styled
def save(fig: Figure, path: str | Path, dpi: int | None = None) -> Path:
    """Write a figure; the format follows the ending. The same figure gives the same bytes.

    It is there whole or not at all: whoever looks at it meanwhile sees the old one or the new one.

    The path ends in .png, .pdf or .svg; `dpi` is the resolution of whatever is made of pixels. Raises ValueError for
    another ending, OSError naming the figure if the system refuses.
    """
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise ValueError(bad("figure", str(path), "a file name ending in " + ", ".join(FORMATS)))
    undated = {".png": {}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    resolution = RESOLUTION if dpi is None else dpi
    try:
        with drafted(path) as draft:
            fig.savefig(draft, format=path.suffix[1:].lower(), dpi=resolution, metadata=undated[path.suffix.lower()])
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None
    return path
