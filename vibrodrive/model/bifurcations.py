"""The kinds of bifurcations: how each is called in figures, and how it is drawn there and in the explorer."""

from __future__ import annotations

from typing import NamedTuple


class BifurcationKind(NamedTuple):
    """How one kind is drawn. Kinds differ in line and marker, so that they can be told apart without colour.

    Attributes
    ----------
    label : name in legends.
    marker : where it is a point, as Matplotlib names it.
    dashes, width : where it is a curve, as Matplotlib takes them (width in points).
    colour, ink : in the styles "screen" and "print".
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
"""By the name that results and files have for it, in the order of legends."""
