"""The bifurcations of periodic orbits as curves in the plane (A, B).

At several values of B the bifurcations over A are found (bifurcations.py). Each satisfies a condition (recognition.py),
which is followed through the plane in both directions (tracing.py), unless an earlier curve passes through the
bifurcation. If a curve ends inside the range, a second condition holds at its end and other curves begin there. So
bifurcations are also searched for close to this B on both sides, until there is no new curve.

A curve may cross the range of A completely between two neighbouring values of B. On every curve known so far A grows
with B, but less than in proportion. So a curve that passes A at the larger value of B is not below A times the ratio
smaller B / larger B at the smaller value. The search at the smaller value therefore begins at the lower end of the
range times this ratio, and the curves are cut at the lower end of the range afterwards.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from vibrodrive.kernels.release import onset
from vibrodrive.model.kinds import above
from vibrodrive.model.names import PARAMETERS
from vibrodrive.model.parameters import check, check_count, real_array
from vibrodrive.periodic.bifurcations import ONSET, Bifurcation, bifurcations, check_range
from vibrodrive.periodic.conditions import Condition
from vibrodrive.periodic.continuation import BORDER_COLLISION, STICK, scale_of
from vibrodrive.periodic.meetings import Meeting, with_meetings
from vibrodrive.periodic.recognition import recognise
from vibrodrive.periodic.search import LEVEL, check_period, counted
from vibrodrive.periodic.tracing import EDGE, Box, cut, point_at, trace

NUM = 17  # default number of values of B at which bifurcations are searched for
MOST_NUM = 10_000
BESIDE = 1e-4  # distance of extra values of B from the end of a curve, in widths of the range
ON_CURVE = 1e-9  # largest distance in A, times `scale_of`, of a bifurcation from the curve that it belongs to
ONSET_POINTS = 65  # points of the straight line A = 1 + B

TOWARDS_LEVEL = (1.0 / 64.0, 1.0 / 16.0, 1.0 / 4.0)
"""Additional values of B, as shares of the first step in B, if the range begins at the level (B = 0): all curves except
the onset converge there like √B."""

LEVEL_POINT = math.sqrt(1.0 + 0.25 * math.pi**2)  # A from which the touching orbit of B = 0 reverses without sticking
LEVEL_END = "level"  # name of the end of a curve at that point


@dataclass(frozen=True, eq=False, repr=False)
class Curve:
    """A bifurcation of one orbit over the plane (A, B).

    Attributes
    ----------
    kind : kind as in `Bifurcation`.
    period, impacts : period of the orbit in excitation periods, and number of impacts in it; a touching is no impact.
    word : states of the orbit, as text.
    side : for a border, the end of the window at which the impact is, "beginning" or "end"; otherwise "".
    A, B : points along the curve, float64 (points,).
    ends : reason for the end at the first and the last point: the name of a second condition that holds there, "edge"
        (of the range), "level" (at B = 0), "closed", or "lost" (the curve could not be followed further).
    meets : points at which it meets other curves of the list.
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
        """Compute, without interpolation, the values of A at which the curve passes a value of B, ascending.

        Parameters
        ----------
        B : float or array of float
            incline over friction.

        Returns
        -------
        float64 array
            for a number the values of A: none if the curve does not reach B, several if it turns back. For an array
            its shape and one more axis, as long as the largest number of values at any B, padded with NaN.

        Raises
        ------
        TypeError, ValueError
            if B is no number or out of range.
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
        """Return the A of the curve at B between its points k and k + 1; None if B is not between their values."""
        first, last = self.B[k], self.B[k + 1]
        if not min(first, last) <= B <= max(first, last):
            return None
        for i, end in ((k, first), (k + 1, last)):
            if end == B:
                return float(self.A[i]) if B > 0.0 or self.kind in (ONSET, STICK) else None
        if self.condition is None:
            return onset(B)
        if np.isnan(self.points[[k, k + 1]]).any():  # rounding does not separate the orbits so close to the level
            return None
        return point_at(self.condition, self.points[k], self.points[k + 1], B)


def curves(
    A: tuple[float, float] = (1.0, 4.0), B: tuple[float, float] = (0.0, 1.0), max_period: int = 2, *, num: int = NUM
) -> list[Curve]:
    """Compute the bifurcations of all orbits of up to `max_period` periods as curves in the plane (A, B).

    A curve is found if it passes one of `num` values of B, or if it begins at the end of a curve that is found. Curves
    are followed down to B = 1e-7 A; below, rounding does not separate the orbits (see `orbits`). If the range begins at
    B = 0, the curves that lead to the point A = √(1 + π²/4), at which the touching orbit changes, are extended to it.

    Parameters
    ----------
    A, B : two floats
        ranges of the excitation amplitude and of the incline over friction, dimensionless, the smaller value first.
    max_period : int
        longest period in excitation periods, 1 to 100.
    num : int
        number of evenly spaced values of B at which bifurcations are searched for, 2 to 10 000.

    Returns
    -------
    list of Curve
        ordered by the A at their ends: each with kind, period, impacts, word, A and B (points,), ends, meets, and a
        method `at` that computes A at any B.

    Warns
    -----
    UserWarning
        for a bifurcation through which no curve was found (docs/orbits.md).

    Raises
    ------
    TypeError, ValueError
        if an argument is no number or out of range, or if there are too many orbits (see `bifurcations`).

    Examples
    --------
    Period doubling of the motion of one period, on an incline of B = 0.1:

    >>> import vibrodrive as vd
    >>> found = vd.curves(A=(2.5, 2.7), B=(0.09, 0.11), max_period=1, num=2)
    >>> [(curve.kind, curve.at(0.1).round(10).tolist()) for curve in found]
    [('border', [2.5227119407]), ('period doubling', [2.6040806377])]
    """
    low, high = check_range("A", A)
    start, stop = check_range("B", B)
    limit = check_period("max_period", max_period)
    count = check_count("num", num, 2, MOST_NUM)
    least = max(start, LEVEL * high)  # no orbits can be followed on the level
    if not least < stop or high <= onset(least):
        return _onset_alone((low, high), (start, stop))
    found = _Collection(Box((min(1.0, low), high), (least, stop)), low, limit)
    values = np.linspace(least, stop, count)
    if least < TOWARDS_LEVEL[0] * values[1]:
        values = np.insert(values, 1, np.multiply(TOWARDS_LEVEL, values[1]))
    with above("a line while it lasts")("curves", lambda: f"{len(found.curves)} curves"):
        found.collect(values.tolist())
    whole = [_to_level(curve, least) for curve in found.curves] if start == 0.0 else found.curves
    inside = [piece for curve in whole for piece in _cut(curve, low)]
    ordered = sorted([*_onset_alone((low, high), (start, stop)), *inside], key=lambda c: (c.A[-1], -c.B[-1]))
    return with_meetings(ordered)


def _onset_alone(A: tuple[float, float], B: tuple[float, float]) -> list[Curve]:
    """Return the part of the straight line A = 1 + B that is inside the range."""
    start, stop = max(B[0], A[0] - 1.0), min(B[1], A[1] - 1.0)
    if not start < stop:
        return []
    along = np.linspace(start, stop, ONSET_POINTS)
    return [Curve(ONSET, 1, 1, "REST", "", onset(along), along, (EDGE, EDGE))]


class _Collection:
    """Collection of the curves found so far, except the onset."""

    def __init__(self, box: Box, low: float, limit: int) -> None:
        self.box, self.low, self.limit = box, low, limit
        self.curves: list[Curve] = []

    def collect(self, values: list[float]) -> None:
        """Follow every bifurcation at these values of B and close to the ends of the curves."""
        searched: set[float] = set()
        low, high = self.box.B
        near = BESIDE * (high - low)
        grid = np.array(values)
        while values:
            for value in values:
                above = grid[grid > value].min(initial=high)
                self.search(value, max(self.box.A[0], self.low * value / above))
            searched.update(values)
            ends = [float(c.B[i]) for c in self.curves for i, why in zip((0, -1), c.ends, strict=True) if why != EDGE]
            beside = [b for end in ends for b in (end - near, end + near) if low < b < high]
            # the ends of several curves at one point differ by rounding
            values = []
            for b in beside:
                if not any(abs(b - other) < 0.1 * near for other in (*searched, *values)):
                    values.append(b)

    def search(self, B: float, low: float) -> None:
        """Follow the bifurcations at one B, from A = low on, that are not part of a curve yet."""
        passed = [(curve.kind, a) for curve in self.curves for a in curve.at(B).tolist()]
        for found in bifurcations((low, self.box.A[1]), B, self.limit):
            near = ON_CURVE * scale_of(found.A)
            if found.kind == ONSET or any(kind == found.kind and abs(a - found.A) < near for kind, a in passed):
                continue
            curve = self.follow(found)
            if curve is not None:
                self.curves.append(curve)
                passed += [(curve.kind, a) for a in curve.at(B).tolist()]

    def follow(self, found: Bifurcation) -> Curve | None:
        """Trace the curve through a bifurcation. Warns and returns None if there is none."""
        recognised = recognise(found)
        if recognised is None:
            warnings.warn(f"no curve found through the {found.kind} at A = {found.A!r}, B = {found.B!r}", stacklevel=5)
            return None
        condition, seed = recognised
        points, ends = trace(condition, seed, self.box)
        side = ""
        if condition.kind == BORDER_COLLISION:
            side = "beginning" if math.cos(seed[condition.critical]) > 0.0 else "end"
        about = condition.kind, condition.period, condition.impacts, condition.word, side
        return Curve(*about, points[:, -2], points[:, -1], ends, condition=condition, points=points)


def _to_level(curve: Curve, least: float) -> Curve:
    """Extend a curve to the point A = √(1 + π²/4), B = 0, if it tends to this point as B falls to `least`.

    At this point an orbit that touches without speed begins to reverse without sticking (flight.py). The distance of a
    curve from this point is proportional to B or to √B: if B falls to a quarter, it falls to between a quarter and a
    half.
    """
    assert curve.condition is not None
    first = min((0, -1), key=lambda i: curve.B[i])
    further = curve.at(4.0 * least)
    if curve.B[first] != least or not len(further):
        return curve
    near, far = curve.A[first] - LEVEL_POINT, float(further[0]) - LEVEL_POINT
    if not 0.2 < near / far < 0.6:
        return curve
    end = np.append(np.full(curve.points.shape[1] - 2, math.nan), (LEVEL_POINT, 0.0))
    points = np.insert(curve.points, 0 if first == 0 else len(curve.points), end, axis=0)
    ends = (LEVEL_END, curve.ends[1]) if first == 0 else (curve.ends[0], LEVEL_END)
    return replace(curve, A=points[:, -2], B=points[:, -1], points=points, ends=ends)


def _cut(curve: Curve, low: float) -> Iterator[Curve]:
    """Yield the parts of a curve at and above the value `low` of A."""
    assert curve.condition is not None
    for points, ends in cut(curve.condition, curve.points, curve.ends, low):
        yield replace(curve, A=points[:, -2], B=points[:, -1], points=points, ends=ends)
