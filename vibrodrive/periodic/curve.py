"""One curve of bifurcations in the plane (A, B)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vibrodrive.kernels.release import onset
from vibrodrive.model.names import PARAMETERS
from vibrodrive.model.parameters import check, real_array
from vibrodrive.periodic.bifurcations import ONSET
from vibrodrive.periodic.conditions import Condition
from vibrodrive.periodic.continuation import STICK
from vibrodrive.periodic.search import counted
from vibrodrive.periodic.tracing import point_at


class Meeting(NamedTuple):
    """A point at which a curve meets another curve of the list that `curves` returns.

    A, B : parameters at the point.
    other : index of the other curve in this list.
    what : "end" if one of the two curves ends at the point, otherwise "crossing".
    """

    A: float
    B: float
    other: int
    what: str


@dataclass(frozen=True, eq=False, repr=False)
class Curve:
    """A bifurcation of one orbit over the plane (A, B).

    Attributes
    ----------
    kind : kind of the bifurcation, as in `Bifurcation`, for example "fold".
    period : period of the orbit in excitation periods.
    impacts : number of impacts in one period; an impact without speed does not count.
    word : states of the orbit, as text.
    side : for a border collision, the end of the window of the impact-phase map at which the impact is, "beginning" or
        "end"; otherwise "".
    A, B : points along the curve, each float64 (points,).
    ends : reasons why the curve ends at its first and at its last point. A reason is the name of a second condition
        that holds at this point, "edge" (the edge of the range), "level" (B = 0), "closed" (a closed curve), or "lost"
        (the curve could not be followed further).
    meets : points at which this curve meets other curves of the list that `curves` returns.
    condition, points : equations of the curve (conditions.py) and their solution at each point, float64 (points,
        unknowns). The onset has no condition.
    """

    kind: str
    period: int
    impacts: int
    word: str
    side: str
    A: np.ndarray
    B: np.ndarray
    ends: tuple[str, str]
    meets: tuple[Meeting, ...] = ()
    condition: Condition | None = field(default=None, repr=False)
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 0)), repr=False)

    def __repr__(self) -> str:
        orbit = f"orbit of period {self.period}, {counted(self.impacts)}"
        A, B = (f"{name} {values.min():.6g}…{values.max():.6g}" for name, values in (("A", self.A), ("B", self.B)))
        ends = " and ".join(self.ends)
        return f"<{self.kind}{self.side and f' ({self.side})'}: {orbit}; {A}, {B} ({len(self.A)} points); ends: {ends}>"

    def at(self, B: ArrayLike) -> np.ndarray:
        """Compute the values of A at which the curve passes a given B, in ascending order and without interpolation.

        Parameters
        ----------
        B : float or array of float
            tan α / μ, dimensionless.

        Returns
        -------
        float64 array
            For a number B: the values of A. There is no value if the curve does not reach B, and there are several
            values if the curve turns back.
            For an array of shape (…): an array (…, m), where m is the largest number of values at any B. Each row
            contains the values of A at one B, followed by NaN.

        Raises
        ------
        TypeError, ValueError
            if B is not a number or is out of range.
        """
        given = real_array("B", B, PARAMETERS["B"].allowed)
        found = [self._passes(check("B", b)) for b in given.reshape(-1).tolist()]
        if given.ndim == 0:
            return found[0]
        rows = np.full((len(found), max(map(len, found), default=0)), math.nan)
        for row, values in zip(rows, found, strict=True):
            row[: len(values)] = values
        return rows.reshape(*given.shape, rows.shape[1])

    def _passes(self, B: float) -> np.ndarray:
        """Return the values of A at which the curve passes B, ascending."""
        found = [a for k in range(len(self.B) - 1) if (a := self.within(k, B)) is not None]
        return np.unique(found)

    def within(self, k: int, B: float) -> float | None:
        """Return the A of the curve at B between its points k and k + 1; None if B is outside this part."""
        first, last = self.B[k], self.B[k + 1]
        if not min(first, last) <= B <= max(first, last):
            return None
        for i, end in ((k, first), (k + 1, last)):
            if end == B:
                return float(self.A[i]) if B > 0.0 or self.kind in (ONSET, STICK) else None
        if self.condition is None:
            return onset(B)
        if np.isnan(self.points[[k, k + 1]]).any():  # rounding prevents a solution so close to B = 0
            return None
        return point_at(self.condition, self.points[k], self.points[k + 1], B)
