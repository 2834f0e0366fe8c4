"""What a record answers for: its quantities, its blocks, how it is computed, described, drawn and resumed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

from vibrodrive.model.quantities import Quantity, length_along

BLOCK_POINTS, BLOCK_POINTS_SMALL, BLOCK_POINTS_SEVERAL = 1024, 8192, 32
"""Largest number of points of a block: usually, if only a summary is recorded, and if a point needs a motion of its own
or several."""


class Record(str):
    """A record of a sweep. As a string it is its name.

    Attributes
    ----------
    quantities : rows of its arrays (quantities.py).
    periods : default number of recorded periods; None for the common default (names.py).
    alone : True if it excludes all others, because it is computed from motions of its own.
    bounded, summarised : True if each motion has error bounds, or a summary, which take time.
    per_point : False if kernels write it, so that motions are computed together.
    seeks : True if it searches for a disturbance: ε or, with a grid method without a step, Δτ (`Plan.sought`).
    block_points : largest number of points of a block.
    wave : key in above.py of the function that computes several blocks point by point.
    diagrams, maps : names of the quantities that diagrams and maps can show; the first ones are their defaults.
    rows : units and labels of numbers that a user has named (own.py).
    """

    quantities: tuple[Quantity, ...] = ()
    periods: ClassVar[int | None] = None
    alone: ClassVar[bool] = False
    bounded: ClassVar[bool] = False
    summarised: ClassVar[bool] = False
    per_point: ClassVar[bool] = False
    seeks: ClassVar[bool] = False
    block_points: ClassVar[int] = BLOCK_POINTS
    wave: ClassVar[str] = "blocks of points"
    diagrams: ClassVar[tuple[str, ...]] = ()
    rows: Mapping[str, tuple[str, str, str]] = {}

    @property
    def maps(self) -> tuple[str, ...]:
        return tuple(q.name for q in self.quantities if not q.along)

    def bands(self, axes: int) -> bool:
        """Return True if a sweep over this number of axes is drawn as bands of a limit."""
        return False

    def point_bytes(self, periods: int) -> int:
        """Return the number of bytes of one point."""
        fixed, of_period = self._bytes
        return fixed + of_period * periods

    @cached_property
    def _bytes(self) -> tuple[int, int]:
        """Bytes of one point, and in addition for each recorded period."""
        sizes = [sum(q.itemsize * math.prod(length_along(q.along, n)) for q in self.quantities) for n in (0, 1)]
        return sizes[0], sizes[1] - sizes[0]

    def refuse(self, plan: Any) -> None:
        """Raise ValueError for what has no meaning for this record."""

    # a file contains the text of each record, which decides whether it is resumed

    def text(self, sought: str = "") -> str:
        """Return the record in words, as an attribute of a file has it; `sought` is that of the plan."""
        return str(self)

    @property
    def outline(self) -> str:
        """The record in the plan of a file, from which `read` makes it again."""
        return str(self)


class OfMotion(Record):
    """Record of numbers of each motion, which are taken from its trajectory."""

    per_point = True
    block_points = BLOCK_POINTS_SEVERAL

    def numbers(self, motion: Any) -> Mapping[str, float] | Exception:
        """Return the numbers of a motion by name, or the exception that the user's function raised."""
        raise NotImplementedError
