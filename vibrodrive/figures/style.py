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
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, Literal, TypeVar, cast

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.layout_engine import LayoutEngine

from vibrodrive.figures.given import LETTER, Given, Shows, fit_label, in_lines, label_share, length, named_in
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
MARGIN = 0.8  # width in inches of the labels beside the axes
BESIDE = 10  # width of a line in a legend and of the space around it, in letters
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
    "legend.handlelength": 2.8,
    "legend.columnspacing": 1.2,
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
WORDS = {"frequency": "Excitation frequency "}  # before a symbol that the paper does not have

_F = TypeVar("_F", bound=Callable[..., Any])
_CHOSEN: ContextVar[tuple[Style, Width]] = ContextVar("chosen", default=("screen", "double"))
_NOTES: ContextVar[bool] = ContextVar("notes", default=True)
_GIVEN: ContextVar[Given | None] = ContextVar("given axes", default=None)


def defaults_and(settings: Mapping[str, Any]) -> AbstractContextManager[None]:
    """Set Matplotlib's defaults and then `settings` within a block, without any setting of the user."""
    return mpl.rc_context(DEFAULTS | dict(settings))


@contextmanager
def drawn_as(style: Style | None = None, width: Width | None = None) -> Iterator[None]:
    """Set the style and the width of all figures drawn within the block. None keeps the current style or width.

    Raises ValueError for an unknown style or width.
    """
    _check(style, width)
    before = _CHOSEN.get()
    style, width = style or before[0], width or before[1]
    title, label, small = LETTERS[width]
    sizes = dict.fromkeys(("font.size", "axes.titlesize", "legend.title_fontsize"), title)
    sizes |= dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), small)
    colours = {"axes.prop_cycle": cycler(color=[LOOKS[style].main])}
    with _set(_CHOSEN, (style, width)), defaults_and(COMMON | sizes | colours | {"axes.labelsize": label}):
        yield


def _check(style: object, width: object) -> None:
    for key, value, known in (("style", style, STYLES), ("width", width, WIDTHS)):
        if value is not None and value not in known:
            raise ValueError(bad(key, value, "one of " + ", ".join(known)))


def styled(function: _F) -> _F:
    """Decorate a drawing function with the arguments `style`, `width`, `notes` and `ax`.

    A new figure is drawn within `drawn_as(style, width)`. With `ax`, `new` returns these axes, and the settings of the
    user stay in force.
    """

    @functools.wraps(function)
    def wrapper(
        *args: Any,
        ax: Any = None,
        style: Style | None = None,
        width: Width | None = None,
        notes: bool | None = None,
        **kwargs: Any,
    ) -> Any:
        _check(style, width)
        if notes not in (None, False, True):
            raise ValueError(bad("notes", notes, "True or False"))
        with ExitStack() as during:
            if ax is not None:
                if width is not None:
                    raise ValueError(bad("width", width, "left out with ax, because its figure has a width"))
                during.enter_context(_set(_GIVEN, Given(ax, style, bool(notes))))
            elif _GIVEN.get() is None:
                during.enter_context(_set(_NOTES, _NOTES.get() if notes is None else bool(notes)))
                during.enter_context(drawn_as(style, width))
            return function(*args, **kwargs)

    wrapper.__doc__ = with_shared(inspect.getdoc(function) or "")
    return wrapper  # type: ignore[return-value]


@contextmanager
def _set(variable: ContextVar[Any], value: Any) -> Iterator[None]:
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


SHARED_PARAMETERS = """\
ax : Axes or sequence of Axes, optional
    your Matplotlib axes, one for each panel; by default those of a new figure. They keep their style: the data have the
    next colour of their cycle, and nothing is written but missing labels and the colour bar of a map. A second result
    in the same axes has another colour, and a key then names the difference.
style : "screen" or "print", optional
    "screen" has colours that colour-blind readers can distinguish; "print" is black and white, for a journal. The
    default is "screen" or, with `ax`, the colours of the axes.
width : "double" or "single", optional
    width of a new figure, left out with `ax`. "double" is two columns of a page, at most 174 mm; "single" is one
    column, 84 mm. The default is "double".
notes : bool, optional
    True writes the settings of the motions, the names of the panels and a key, in `ax` as a legend. The default is True
    for a new figure, and False with `ax`."""

SHARED_RETURNS = """\
Returns
-------
Figure
    Matplotlib figure. A notebook displays it, its method `show` opens a window, and `savefig` writes it to a file. With
    `ax`, it is the figure of these axes."""

SHARED_RAISES = """\
ValueError
    if the style or the width is unknown, if `ax` does not have one Axes for each panel, or if these axes show other
    quantities or a result that would be hidden."""


def with_shared(text: str) -> str:
    """Add SHARED_PARAMETERS, SHARED_RETURNS and SHARED_RAISES to a docstring with the section Examples."""
    described, heading, examples = text.partition("\n\nExamples\n")
    parameters, _, raises = described.partition("\n\nRaises\n------\n")
    raises = "\n".join(["Raises\n------", *filter(None, [raises]), SHARED_RAISES])
    return f"{parameters}\n{SHARED_PARAMETERS}\n\n{SHARED_RETURNS}\n\n{raises}{heading}{examples}" if heading else text


def look() -> Look:
    """Return the current colours."""
    given = _GIVEN.get()
    return given.look if given else LOOKS[_CHOSEN.get()[0]]


def narrow() -> bool:
    """Return True if a new figure is for one column. Then panels are below each other instead of side by side."""
    return not given_axes() and _CHOSEN.get()[1] == "single"


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

    Only `show` makes it a figure of pyplot, which otherwise would keep all figures in memory and display each of them
    again at the end of a cell.

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

    def show(self, warn: bool = True) -> None:
        """Open a window. A script waits until all windows are closed, as in `pyplot.show`; then pyplot forgets them."""
        from matplotlib import pyplot

        size: Any = self.get_size_inches()
        if self.canvas.manager is None or not pyplot.fignum_exists(self.canvas.manager.num):
            pyplot.figure(FigureClass=lambda *_, **__: self)  # type: ignore[arg-type]
        pyplot.show()
        if not pyplot.isinteractive():
            pyplot.close(self)
            self.set_size_inches(size)  # a window changes it

    def _repr_png_(self) -> tuple[bytes, dict[str, int]]:
        """Return the image at twice the resolution, and the size in pixels at which to display it."""
        width, height = (round(inches * self.dpi) for inches in self.get_size_inches())
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=2 * self.dpi)
        return buffer.getvalue(), {"width": width, "height": height}


def given_axes() -> list[Axes]:
    """Return the axes given as `ax` to the drawing function, or [] for a new figure."""
    given = _GIVEN.get()
    return given.axes if given else []


def new(
    rows: int = 1,
    cols: int = 1,
    *,
    height: float,
    width: float = INCHES["double"],
    shows: Sequence[Shows] = (),
    said: Sequence[str] = (),
    **options: Any,
):
    """Return a Figure and its axes as an object array (rows, cols).

    `height` and `width` are in inches, for a figure of two columns. A figure of one column is narrower, and its height
    is multiplied by the root of the ratio of the widths, a compromise between equal shape and equal height.

    If `ax` is given to the drawing function, these axes and their Figure are returned. They may show several results if
    each panel has the same quantities `shows`; the phrases `said` then tell the results apart. Raises ValueError if
    `ax` does not contain one Axes for each panel, or if these show something else.
    """
    given = _GIVEN.get()
    if given is not None:
        for ax in given.axes:
            if isinstance(getattr(ax, "figure", None), ShownFigure):
                raise ValueError(bad("ax", ax, "Axes of a figure of yours, because this figure has its own style"))
        given.take(rows * cols, shows, said)
        return given.axes[0].figure, np.array(given.axes, dtype=object).reshape(rows, cols)
    inches = min(width, INCHES[_CHOSEN.get()[1]])
    with drawn_as():
        fig = ShownFigure(figsize=(inches, height * math.sqrt(inches / width)))
        axes = fig.subplots(rows, cols, squeeze=False, **options)
    return fig, axes


def name_axes(ax: Axes, x: str | None, y: str | None) -> None:
    """Label the axes with the symbols of two quantities, with their units (None: no change)."""
    across, up = (None if name is None else WORDS.get(name, "") + symbol(name) + _in_unit(name) for name in (x, y))
    label_axes(ax, across, up, upright=0.0 if y in UNITS else 9.0)


def _in_unit(name: str) -> str:
    return f" in {UNITS[name]}" if name in UNITS else ""


def label_axes(ax: Axes, x: str | None, y: str | None, upright: float = 0.0) -> None:
    """Label the outer axes of a grid of panels with texts (None: no change).

    In a new figure, which makes room for it, the text of the ordinate is upright at the distance `upright` in points,
    unless this is 0. The user's axes keep the labels that they have.
    """
    mine = not given_axes()
    turned: dict[str, Any] = {"rotation": 0, "labelpad": upright, "va": "center"} if upright and mine else {}
    if x is not None and _is_outer(ax.xaxis, "bottom", "top") and (mine or not ax.get_xlabel()):
        ax.set_xlabel(x)
    if y is not None and _is_outer(ax.yaxis, "left", "right") and (mine or not ax.get_ylabel()):
        ax.set_ylabel(y, **turned)
        fit_label(ax)


def _is_outer(axis: Axis, *sides: str) -> bool:
    """Return False for an axis without tick labels, as between panels that share it."""
    shown = axis.get_tick_params()
    return any(shown.get(f"label{side}", side in ("bottom", "left")) for side in sides)


def letter(ax: Axes, index: int | None, text: str = "", asked: bool = False) -> None:
    """Write a), b), … (nothing for None) and `text` at the upper left of a panel.

    In the user's axes `text` belongs to the notes. It is the title there if the user has `asked` for it.
    """
    given = _GIVEN.get()
    if given is not None and asked:
        ax.set_title(text)
    elif given is not None:
        given.said[ax] += [text] if text else []
    elif asked or _NOTES.get():
        ax.set_title(" ".join(filter(None, ("" if index is None else f"{chr(ord('a') + index)})", text))), loc="left")


def note(ax: Axes, text: str | Sequence[str], above: bool = False, *, side: Literal["left", "right"] = "right") -> None:
    """Write a note in small letters at the upper right of a panel.

    If note and name of the panel do not fit into one line, or if `above`, the note is above the name. A sequence of
    phrases is wrapped between the phrases. `side` is "left" for a panel with a colour bar and without a name. In the
    user's axes the phrases become the title of the legend, if he wants notes.
    """
    given = _GIVEN.get()
    if given is not None:
        given.said[ax] += [text] if isinstance(text, str) else text
        return
    if not _NOTES.get():
        return
    size = NOTE * LETTERS[_CHOSEN.get()[1]][0]
    room = int(72 * (ax.figure.figure.get_figwidth() - MARGIN) / (LETTER * size))
    text = text if isinstance(text, str) else in_lines(text, room)
    cell, name = ax.get_subplotspec(), ax.get_title(loc="left")
    alone = cell is None or cell.get_gridspec().ncols == 1
    fits = not name or (alone and length(name) / NOTE + length(text.rsplit("\n", 1)[-1]) + BESIDE < room)
    ax.set_title(text + "\n" if text and (above or not fits) else text, loc=side, fontsize=size, color="0.35")


def explain(fig: Figure, more: Sequence[Artist] = ()) -> None:
    """Draw a legend of all labels, each once, and of the entries `more`, below a new figure, and break what is too long
    for the height that remains; for axes of the user see `Given.explain`."""
    given = _GIVEN.get()
    if given is not None:
        given.explain(more)
        return
    named = named_in(fig.axes) | {str(handle.get_label()): handle for handle in more}
    if named and _NOTES.get():
        room = 72 * fig.get_figwidth() / (LETTER * LETTERS[_CHOSEN.get()[1]][2])
        columns = max(1, int(room / (BESIDE + max(map(length, named)))))
        fig.legend(list(named.values()), list(named), loc="outside lower center", ncols=columns, borderpad=0.2)
    if max(map(label_share, fig.axes)) > 0.4:  # notes and legend take up to about half of the height
        cast(LayoutEngine, fig.get_layout_engine()).execute(fig)
        for ax in fig.axes:
            fit_label(ax)


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
