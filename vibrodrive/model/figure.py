"""Kinds, styles and quantities of figures, which calls and configurations name, and what all functions of figures
share: the description of common arguments, and the refusal of wrong ones."""

import inspect
import math
from collections.abc import Callable
from numbers import Real
from typing import Any, Literal, TypeVar, cast, get_args

from vibrodrive.model.parameters import bad, with_sentences
from vibrodrive.model.records import RECORDS

_F = TypeVar("_F", bound=Callable[..., Any])

BIFURCATION, POINCARE, MAP, BANDS = "bifurcation", "poincare", "map", "bands"

FIGURE_KINDS = (BIFURCATION, POINCARE, MAP, BANDS)

Style = Literal["screen", "print"]
"""Colours that are distinct for colour-blind readers, or the black and white of a journal."""

Width = Literal["double", "single"]  # width of a figure in columns of a page

STYLES: tuple[Style, ...] = get_args(Style)
WIDTHS: tuple[Width, ...] = get_args(Width)

FIGURE_UNITS = SI, DIMENSIONLESS = "SI", "dimensionless"  # units of quantities in figures of a scene

LOOK = ("style", "width")  # keys of [figure] for any figure

FORMATS = (".png", ".pdf", ".svg")

OF_EVERY_SWEEP = ("status", "margin")

DIAGRAM_QUANTITIES = tuple(name for record in RECORDS.values() for name in record.diagrams)
MAP_QUANTITIES = (*(name for record in RECORDS.values() for name in record.maps), *OF_EVERY_SWEEP)
"""Quantities of maps over two axes, and of lines over one axis. The numbers of a function of the user are others."""

CURVES = {"phase": ("xi", "dxi"), "time": ("tau", "xi"), "velocity": ("tau", "dxi"), "section": ("xi", "dxi")}
"""Curves of a motion, each with its quantities to the right and upwards."""


def check_curves(key: str, curves: Any) -> Any:
    """Return names of curves. Raises ValueError with one sentence."""
    names = [] if isinstance(curves, str | dict) or not hasattr(curves, "__iter__") else [*curves]
    if not names or any(name not in [*CURVES] for name in names):
        raise ValueError(bad(key, curves, "a list of one or more of " + ", ".join(CURVES)))
    return curves


def check_limits(key: str, limits: Any) -> tuple[float, float]:
    """Return a range as two floats. Raises ValueError with one sentence."""
    try:
        low, high = limits
        if isinstance(low, Real) and isinstance(high, Real) and -math.inf < float(low) < float(high) < math.inf:
            return float(low), float(high)
    except (OverflowError, TypeError, ValueError):
        pass
    raise ValueError(bad(key, limits, "two numbers in ascending order"))


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


def documented(function: _F) -> _F:
    """Add SHARED_PARAMETERS, SHARED_RETURNS and SHARED_RAISES to the docstring of a drawing function, and refuse wrong
    arguments in a sentence."""
    described, heading, examples = (inspect.getdoc(function) or "").partition("\n\nExamples\n")
    parameters, _, raises = described.partition("\n\nRaises\n------\n")
    raises = "\n".join(["Raises\n------", *filter(None, [raises]), SHARED_RAISES])
    function.__doc__ = f"{parameters}\n{SHARED_PARAMETERS}\n\n{SHARED_RETURNS}\n\n{raises}{heading}{examples}"
    return cast(_F, with_sentences(function))
