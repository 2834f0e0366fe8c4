"""Colours of a map.

One table contains the colours of all classes or all shades of a quantity. Periods, statuses and gaps (the numbers of
periods between main impacts) have classes. Points outside the scale have separate colours: motions that rest, motions
without a value of the quantity, and values beyond the ends of the scale. Points that are not computed have no colour.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from matplotlib.colors import LogNorm, Normalize, to_rgba

from vibrodrive.figures.ink import SAME, range_around
from vibrodrive.figures.looks import LOOKS, Look
from vibrodrive.model.choices import LONGEST, Status
from vibrodrive.model.described import counted
from vibrodrive.model.quantities import CODES, CYCLES, MARGIN, PERIODS, SIGNED, STATUS, STATUSES, STRUCTURE, Quantity
from vibrodrive.model.statuses import as_status

APART = "white"  # colour of motions at rest, and of 0 on a logarithmic scale; lighter than all classes and shades
SHADES = 512  # number of shades of a scale
SCALED = 0.005, 0.995
"""Quantiles of the values between which nearly all lie. They are ends of a scale if the few others would hide these."""

MANY = 1000  # smallest number of values for SCALED; with fewer values all of them are on the scale
DECADES = 2.0  # a positive quantity that spans more decades has a logarithmic scale
LEAST = 1e-9
"""Smallest lower end of a logarithmic scale, as a share of the largest value. Smaller values have the colour for values
below the scale. An example is the energy of an impact that exists only because of rounding."""

SHOWN = (Status.OK, Status.NEVER_LEAVES, Status.TOO_CLOSE, Status.BUDGET)  # in the order of `Look.statuses`
RESTS = "rests"  # name of the motions that rest permanently


class Painted(NamedTuple):
    """Colours of the cells of a map."""

    cells: np.ma.MaskedArray  # indices of `colours`, masked where nothing is computed
    colours: np.ndarray  # red, green, blue and opacity, 0 to 1, of each colour: float64 (n, 4)
    labels: tuple[str, ...]  # names of the classes, in the order of the first colours; () for a continuous quantity
    norm: Normalize  # scale of the first SHADES colours, or of the numbers of the classes
    apart: tuple[tuple[str, str], ...]  # (name, colour) of each group of points outside the scale, the last colours
    extend: str = "neither"  # ends of the scale beyond which there are values: "neither", "min", "max" or "both"

    @property
    def counts(self) -> np.ndarray:
        """Number of points of each colour: int64 (n,)."""
        return np.bincount(self.cells.compressed(), minlength=len(self.colours))

    @property
    def first_apart(self) -> int:
        """Index of the colour of the first group of points outside the scale."""
        return len(self.colours) - len(self.apart)

    @property
    def blank(self) -> str:
        """Legend entry for the hatched points, "" if there are none."""
        hatched = [name for name, colour in self.apart if colour == "none"]
        return " or ".join([*hatched, *([Status.NOT_COMPUTED.words] if np.ma.is_masked(self.cells) else [])])

    def phrases(self) -> list[str]:
        """Return the number of points in each group outside the scale, except those that their status counts."""
        groups = zip(self.apart, self.counts[self.first_apart :].tolist(), strict=True)
        named = ((name.partition(":")[0], count) for (name, _), count in groups if name != RESTS)
        return [f"{name} at {counted(count, 'point')}" for name, count in named]


def paint(
    row: Quantity, values: np.ndarray, status: np.ndarray, limits: tuple[float, float] | None, look: Look | None = None
) -> Painted:
    """Return the colours of all points, by default those for the screen.

    `limits` is the range of the shades; by default it contains nearly all values (SCALED).
    """
    look = look or LOOKS["screen"]
    done, rests = status != Status.NOT_COMPUTED, status == Status.NEVER_LEAVES
    lacking, extend = row.lacking, "neither"
    if row.classes:
        kind, labels, colours = _CLASSIFY[row.shown](values, done, row, look)
        norm = Normalize(-0.5, len(labels) - 0.5)
        apart: list[tuple[str, str]] = []
        if row is not STATUS and rests.any():  # the period of a motion at rest is 1, but its colour is another one
            apart.append((RESTS, APART))
            kind = np.where(rests, len(colours), kind)
            colours = [*colours, APART]
    else:
        values, rests = np.where(done, values, np.nan), rests & (row is not MARGIN)
        kind, norm, shades, apart, extend = _shade(row, values, rests, limits, look)
        labels, colours = [], [*shades, *look.beyond, *(colour for _, colour in apart)]
    none = done & (kind < 0)
    if none.any():
        if row is STATUS:  # those of few motions share a colour
            statuses = map(as_status, np.unique(values[none]).tolist())
            lacking = " or ".join(s.words if isinstance(s, Status) else s for s in statuses)
        apart.append((lacking, look.lacking))
        kind = np.where(none, len(colours), kind)
        colours = [*colours, look.lacking]
    table = np.array([to_rgba(c) for c in colours])
    return Painted(np.ma.masked_array(kind, ~done), table, tuple(labels), norm, tuple(apart), extend)


Classes = tuple[np.ndarray, list[str], list[Any]]
"""Class of each point (-1 without a class), names of the classes, and colours of the classes."""


def _periods(values: np.ndarray, done: np.ndarray, row: Quantity, look: Look) -> Classes:
    colours = look.classes
    most = len(colours) - 2
    kind = np.where(values < 1, np.where(values == 0, most + 1, -1), np.minimum(values - 1, most))
    return kind, [*map(str, range(1, most + 1)), f"{most + 1} to {LONGEST}", f"none up to {LONGEST}"], list(colours)


def _cycles(values: np.ndarray, done: np.ndarray, row: Quantity, look: Look) -> Classes:
    """Return the classes: one for each of the most frequent values, one for all other values, and one for 0.

    The most frequent value has the first class. `row.names` gives the name of the class of a value.
    """
    cycles, counts = np.unique(values[done & (values > 0)], return_counts=True)
    *frequent, other, none = look.classes
    order = np.argsort(-counts, kind="stable")[: len(frequent)]
    shown = cycles[order]
    place = np.full(len(cycles), len(shown))
    place[order] = np.arange(len(shown))
    labels, colours = [row.names(v) if row.names else str(v) for v in shown.tolist()], frequent[: len(shown)]
    if len(cycles) > len(shown):
        labels.append("other")
        colours.append(other)
    kind = np.full(values.shape, -1)
    positive = values > 0
    kind[positive & done] = place[np.searchsorted(cycles, values[positive & done])]
    kind[values == 0] = len(labels)
    return kind, [*labels, "none"], [*colours, none]


def _statuses(values: np.ndarray, done: np.ndarray, row: Quantity, look: Look) -> Classes:
    kind = np.full(values.shape, -1)
    for k, status in enumerate(SHOWN):
        kind[values == status] = k
    return kind, [s.words for s in SHOWN], list(look.statuses)


def _codes(values: np.ndarray, done: np.ndarray, row: Quantity, look: Look) -> Classes:
    meanings = [code.meaning for code in row.codes or ()]
    return values.astype(int), meanings, list(look.classes[: len(meanings)])


def _structure(values: np.ndarray, done: np.ndarray, row: Quantity, look: Look) -> Classes:
    return np.where(values < 0, -1, 1 - values), ["kept", "lost"], list(look.kept)


_CLASSIFY = {PERIODS: _periods, CYCLES: _cycles, CODES: _codes, STATUSES: _statuses, STRUCTURE: _structure}


def _shade(
    row: Quantity, values: np.ndarray, rests: np.ndarray, limits: tuple[float, float] | None, look: Look
) -> tuple[np.ndarray, Normalize, np.ndarray, list[tuple[str, str]], str]:
    """Return (number of the shade of each point, scale, shades of the scale, `Painted.apart`, `Painted.extend`).

    The numbers are 0 to SHADES - 1 on the scale, SHADES below the scale, SHADES + 1 above it, SHADES + 2 for a point
    with the colour in `Painted.apart`, and -1 for a point without a value.
    """
    finite = values[np.isfinite(values) & ~rests]
    finite = finite if finite.size else np.array([0.0, 1.0])
    shades, outside = look.shades, rests
    if row.shown == SIGNED:
        shades = look.signed
        most = _ends(np.abs(finite))[1] or 1.0
        norm = Normalize(*(limits or (-most, most)))
    else:
        norm = _scale(finite, limits)
    name = RESTS
    for value, words in row.special:  # a search for a limit says nothing of rests
        name, outside = words, (outside & (value < 0.0)) | (values == value)
    if isinstance(norm, LogNorm) and (finite == 0).any():
        name, outside = f"{RESTS}, or 0" if rests.any() else "0", rests | (values == 0)
    below, above = (np.isfinite(values) & ~outside & beyond for beyond in (values < norm.vmin, values > norm.vmax))
    inside = np.isfinite(values) & ~outside & ~below & ~above
    kind = np.full(values.shape, -1)
    kind[inside] = np.minimum(np.asarray(norm(values[inside]), float) * SHADES, SHADES - 1).astype(int)
    kind[below], kind[above], kind[outside] = SHADES, SHADES + 1, SHADES + 2
    extend = (("neither", "max"), ("min", "both"))[int(below.any())][int(above.any())]
    apart = [(name, APART)] if outside.any() else []
    return kind, norm, shades(np.linspace(0, 1, SHADES)), apart, extend


def _quantiles(values: np.ndarray) -> list[float]:
    """Return the least value, the ends of the range of nearly all values, and the largest value."""
    return np.quantile(values, (0.0, *(SCALED if values.size >= MANY else (0.0, 1.0)), 1.0)).tolist()


def _ends(values: np.ndarray, logarithmic: bool = False) -> tuple[float, float]:
    """Return the least and the largest value or, where the few values beyond the range of nearly all would hide these,
    the end of this range: if they take up more of a scale than these or, if it is logarithmic, more than DECADES."""
    low, first, last, high = _quantiles(values)
    along, room = (math.log10, DECADES) if logarithmic else (float, last - first)
    hides = max(room, 0.0 if logarithmic else SAME * max(abs(low), abs(high)))  # what is no rounding
    below, above = (room > 0.0 and along(b) - along(a) > hides for a, b in ((low, first), (last, high)))
    return first if below else low, last if above else high


def _scale(finite: np.ndarray, limits: tuple[float, float] | None) -> Normalize:
    """Return a scale with the ends `limits` or, if they are None, with the ends of `_ends`.

    The scale is logarithmic if both ends, or nearly all values, are positive and span more than DECADES decades.
    """
    positive = np.maximum(finite[finite > 0], LEAST * finite.max())  # on a logarithmic scale 0 has a separate colour
    nearly_all = _quantiles(positive)[1:3] if positive.size and _quantiles(finite)[1] >= 0 else (0.0, 1.0)
    low, high = limits or nearly_all
    if low > 0 and math.log10(high / low) > DECADES:
        return LogNorm(*(limits or _ends(positive, logarithmic=True)))
    return Normalize(*(limits or range_around(*_ends(finite))))
