"""Settings of Matplotlib for new figures, in two styles (looks.py) and two widths (in columns), and files of figures.

This module does not use pyplot. Each Figure is drawn without a display (Agg) and is not saved.
"""

from __future__ import annotations

import io
import os
import warnings
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import matplotlib as mpl
from cycler import cycler
from matplotlib.figure import Figure

from vibrodrive.figures.looks import LOOKS
from vibrodrive.figures.texts import plain
from vibrodrive.model.figure import FORMATS, Style, Width
from vibrodrive.model.parameters import bad
from vibrodrive.store.draft import drafted

ABOUT = {"png": ("Title", "Description"), "svg": ("Title", "Description"), "pdf": ("Title", "Subject")}
"""Metadata for the title and the description of a figure, by format."""

INCHES: dict[Width, float] = {
    "double": 6.85,
    "single": 3.31,
}  # 174 mm for two columns and 84 mm for one column of a journal
RESOLUTION = 250  # pixels per inch
LETTERS: dict[Width, tuple[float, float, float]] = {"double": (10.0, 11.0, 9.0), "single": (8.5, 9.0, 7.5)}
"""Sizes of letters in points: titles, symbols at the axes, numbers and legends."""

DEFAULTS: dict[Any, Any] = {n: value for n, value in mpl.rcParamsDefault.items() if not n.startswith("backend")}
"""Matplotlib's own settings. They replace those of the user's matplotlibrc, so that figures are equal for all users."""

WINDOWLESS = ("agg", "cairo", "pdf", "pgf", "ps", "svg", "template")
"""Backends of Matplotlib that only write files. Without a display it chooses agg, and `pyplot.show` is silent."""

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


def drawn_as(style: Style, width: Width) -> AbstractContextManager[None]:
    """Set the settings of a style and a width within a block, and otherwise Matplotlib's defaults."""
    title, label, small = LETTERS[width]
    sizes = dict.fromkeys(("font.size", "axes.titlesize", "legend.title_fontsize"), title)
    sizes |= dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), small)
    colours = {"axes.prop_cycle": cycler(color=[LOOKS[style].main])}
    return mpl.rc_context(DEFAULTS | COMMON | sizes | colours | {"axes.labelsize": label})


class ShownFigure(Figure):
    """Figure that a notebook displays as the value of a cell, like a figure of pyplot.

    Only `show` makes it a figure of pyplot, which otherwise would keep all figures in memory and display each of them
    again at the end of a cell.

    Matplotlib reads settings when a figure is made, but also when it is drawn (for ticks) and saved. So this figure
    keeps its style and width for all three.
    """

    def __init__(self, style: Style, width: Width, **options: Any) -> None:
        super().__init__(**options)
        self._drawn_as = style, width

    def draw(self, renderer: Any) -> None:
        with drawn_as(*self._drawn_as):
            super().draw(renderer)

    def savefig(self, fname: Any, *args: Any, **kwargs: Any) -> None:
        """Write the figure with a title and a description, unless its format has none."""
        name = fname if isinstance(fname, str | os.PathLike) else ""
        if keys := ABOUT.get(kwargs.get("format") or Path(name).suffix[1:].lower() or "png"):
            kwargs["metadata"] = dict(zip(keys, about(self), strict=True)) | (kwargs.get("metadata") or {})
        with drawn_as(*self._drawn_as):
            super().savefig(fname, *args, **kwargs)

    def show(self, warn: bool = True) -> None:
        """Open a window. A script waits until all windows are closed, as in `pyplot.show`; then pyplot forgets them.
        Warns, unless `warn` is False, if Matplotlib can open no window."""
        from matplotlib import pyplot

        if (backend := pyplot.get_backend()).lower() in WINDOWLESS:
            if warn:
                fault = f"the figure cannot be shown without a display (backend {backend})"
                advice = 'figure.savefig("figure.png") writes it to a file'
                warnings.warn(f"{fault}; {advice}", UserWarning, stacklevel=2)
            return
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


def about(fig: Figure) -> tuple[str, str]:
    """Return the quantities of a figure as its title, and the texts of its panels and key as its description."""
    bars = [ax for ax in fig.axes if ax.get_label() == "<colorbar>"]
    across = [ax.get_xlabel() for ax in fig.axes]
    up = [ax.get_ylabel() for ax in fig.axes if ax not in bars]
    axes = ([ax.get_ylabel() for ax in bars], [*across, *up]) if bars else (up, across)
    texts = [ax.get_title(loc) for ax in fig.axes for loc in ("left", "center", "right")]
    texts += [text.get_text() for legend in fig.legends for text in legend.get_texts()]
    title, text = ([" and ".join(filter(None, dict.fromkeys(map(plain, names)))) for names in axes], map(plain, texts))
    return " over ".join(filter(None, title)), "; ".join(filter(None, text))


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
    with drafted(path) as draft:
        fig.savefig(draft, format=ending[1:], dpi=dpi or RESOLUTION, metadata=undated[ending])
        if ending == ".svg":  # Matplotlib writes the title only
            text = f"</title>\n <desc>{escape(about(fig)[1])}</desc>".encode()
            draft.write_bytes(draft.read_bytes().replace(b"</title>", text, 1))
    return path
