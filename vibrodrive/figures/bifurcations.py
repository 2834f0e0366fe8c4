"""Kinds of bifurcations: label, marker, line and colour of each in figures and in the explorer.

docs/glossary.md explains the kinds.
"""

from typing import NamedTuple


class BifurcationKind(NamedTuple):
    """Label and style of one kind. Kinds differ in line and marker, so that they are distinct without colour.

    Attributes
    ----------
    label : name in legends.
    marker : Matplotlib marker of a point.
    dashes, width : Matplotlib line style and width (in points) of a curve.
    colour, ink : colours in the styles "screen" and "print".
    """

    label: str
    marker: str
    dashes: str | tuple[float, tuple[float, ...]]
    width: float
    colour: str
    ink: str = "#000000"


BIFURCATIONS: dict[str, BifurcationKind] = {
    "onset": BifurcationKind("onset", "s", "-", 1.8, "#737373", "#737373"),
    "period doubling": BifurcationKind("period doubling", "o", "-", 1.0, "#0072b2"),
    "fold": BifurcationKind("fold", "^", (0, (6, 2)), 1.0, "#d55e00"),
    "border": BifurcationKind("border collision", "D", (0, (5, 1.5, 1, 1.5)), 1.0, "#000000"),
    "grazing": BifurcationKind("grazing", "v", (0, (1.2, 1.2)), 1.3, "#009e73"),
    "stick": BifurcationKind("stick appears or vanishes", "|", (0, (2.5, 2.5)), 0.8, "#aa3377"),
}
"""Styles by the name of the kind in results and files, in the order of legends."""
