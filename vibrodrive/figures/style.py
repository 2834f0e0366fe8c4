"""One look for every figure: the paper's symbols, black ink, nothing that needs colour to be read.

No pyplot: a Figure is an object that is returned, drawn headless (Agg) and saved by the caller.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from vibrodrive.model.parameters import bad
from vibrodrive.model.physical import SCENE_AXES
from vibrodrive.store.draft import drafted

INK = "black"
GREY = "0.55"
GREYS = LinearSegmentedColormap.from_list("ink", ["white", "black"])
"""Amount of ink, 0 to 1."""

LINES = ("-", "--", ":", "-.")
"""Line styles distinguish curves; grey tones only support them."""

WIDTH = 6.3
"""Width of a figure in inches: the text block of an A4 page."""

FORMATS = (".png", ".pdf", ".svg")

STYLE: dict[str, Any] = {
    "font.family": "STIXGeneral",  # comes with matplotlib: the same figure on every machine
    "mathtext.fontset": "stix",
    "font.size": 10.0,
    "axes.titlesize": 10.0,
    "axes.labelsize": 11.0,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "legend.fontsize": 9.0,
    "legend.frameon": False,
    "axes.linewidth": 0.6,
    "lines.linewidth": 0.8,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.top": True,
    "ytick.right": True,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "axes.prop_cycle": cycler(color=[INK]),
    "figure.constrained_layout.use": True,
    "figure.dpi": 100,
    "savefig.dpi": 250,
    "pdf.fonttype": 42,
    "svg.hashsalt": "vibrodrive",  # element names by content: the same figure is the same file
    "agg.path.chunksize": 20000,
}

SYMBOLS = {
    "A": "A",
    "B": "B",
    "eps": r"\varepsilon",
    "eta": r"\eta",
    "dtau": r"\Delta\tau",
    "tol": r"\mathrm{tol}",
    "xi0": r"\xi_0",
    "dxi0": r"\xi\mathrm{′}_0",
    "tau0": r"\tau_0",
    "section_phase": r"\varphi_s",
    "a0": "a_0",
    "omega0": r"\Omega_0",
    "mu": r"\mu",
    "alpha": r"\alpha",
    "mass": "m",
    "xi": r"\xi",
    "dxi": r"\xi\mathrm{′}",
    "tau": r"\tau",
}
"""The paper's symbol (as mathtext) for every parameter and quantity."""

UNITS = {name: quantity.shown for name, quantity in SCENE_AXES.items() if quantity.shown}
"""Of what is not dimensionless."""

_F = TypeVar("_F", bound=Callable[..., Any])


def styled(function: _F) -> _F:
    """Run a drawing function under STYLE and leave the caller's settings as they were."""

    @functools.wraps(function)
    def wrapper(*args: Any, **kwargs: Any) -> Any:
        with mpl.rc_context(STYLE):  # type: ignore[arg-type]
            return function(*args, **kwargs)

    return wrapper  # type: ignore[return-value]


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


def equation(name: str, value: float) -> str:
    """“ε = 2·10⁻⁴” as mathtext."""
    if name not in SYMBOLS:
        return f"{name} = ${number(value)}$"
    unit, value = UNITS.get(name, ""), float(as_shown(name, value))
    return f"${SYMBOLS[name]} = {number(value)}$" + (unit if unit == "°" else f" {unit}".rstrip())


def as_shown(name: str, values: Any) -> Any:
    """Values of a parameter, number or array, in the unit that figures show."""
    return values * SCENE_AXES[name].scale if name in SCENE_AXES else values


@styled
def new(rows: int = 1, cols: int = 1, *, height: float, width: float = WIDTH, **options: Any):
    """A Figure and its axes as an object array (rows, cols); `height` and `width` in inches."""
    fig = Figure(figsize=(width, height))
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


def note(ax: Axes, text: str) -> None:
    """What holds for the whole panel, small, at its upper right."""
    ax.set_title(text, loc="right", fontsize=8, color="0.35")


def periods_ticks(ax: Axes, low: float, high: float) -> None:
    """A τ axis from `low` to `high` counted in excitation periods 2π, from the first one shown."""
    first = math.floor(low / (2 * math.pi) + 1e-9)
    count = max(1, round((high - low) / (2 * math.pi)))
    step = max(1, math.ceil(count / 13))
    shown = np.arange(0, count + 1, step)
    ax.set_xticks((first + shown) * 2 * math.pi, [str(k) for k in shown])
    ax.set_xlim(low, high)
    start = rf" - {first}" if first else ""
    ax.set_xlabel(rf"$\tau/2\pi{start}$")


@styled
def save(fig: Figure, path: str | Path, dpi: int | None = None) -> Path:
    """Write a figure; the format follows the ending. The same figure gives the same bytes.

    It is there whole or not at all: whoever looks at it meanwhile sees the old one or the new one.
    `dpi` is the resolution of what is made of pixels, 250 unless given.

    Raises
    ------
    ValueError
        if the ending is none of FORMATS.
    OSError
        naming the figure, if the system refuses.
    """
    path = Path(path)
    if path.suffix.lower() not in FORMATS:
        raise ValueError(bad("figure", str(path), "a file name ending in " + ", ".join(FORMATS)))
    undated = {".png": {}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    resolution = STYLE["savefig.dpi"] if dpi is None else dpi
    try:
        with drafted(path) as draft:
            fig.savefig(draft, format=path.suffix[1:].lower(), dpi=resolution, metadata=undated[path.suffix.lower()])
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None
    return path
