"""The bifurcations of periodic orbits as curves in the plane (A, B).

A search at each of several values of B finds the bifurcations over A (bifurcations.py). Each bifurcation satisfies a
condition, for example |H| = 1 at the end of a slide (recognition.py). If no known curve passes through the bifurcation,
the curve on which this condition holds is followed through the plane in both directions (tracing.py). If a curve ends
inside the range, a second condition holds at its end, and other curves begin there. So further searches follow at
values of B slightly below and slightly above this end, until these searches find no new curve.

A curve may cross the range of A completely between two neighbouring values B1 < B2 of B. On every curve known so far A
grows with B, but less than in proportion. So if a curve has the value A at B2, it has at least the value A · B1/B2 at
B1. The search at B1 therefore begins at the lower end of the range of A times B1/B2. Afterwards the curves are cut at
the lower end of the range.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from vibrodrive.kernels.release import onset
from vibrodrive.model.kinds import above
from vibrodrive.model.parameters import check_count
from vibrodrive.periodic.bifurcations import ONSET, Bifurcation, bifurcations, check_range
from vibrodrive.periodic.continuation import BORDER_COLLISION, scale_of
from vibrodrive.periodic.curve import Curve
from vibrodrive.periodic.meetings import with_meetings
from vibrodrive.periodic.recognition import recognise
from vibrodrive.periodic.search import LEVEL, check_period
from vibrodrive.periodic.tracing import EDGE, Box, cut, trace

NUM = 17  # default number of values of B at which bifurcations are searched for
MOST_NUM = 10_000
BESIDE = 1e-4  # distance in B of further searches from the end of a curve, as a share of the range of B
ON_CURVE = 1e-9  # largest distance in A of a bifurcation from the curve that it belongs to, in units of `scale_of`
ONSET_POINTS = 65  # number of points of the onset, the straight line A = 1 + B

TOWARDS_LEVEL = (1.0 / 64.0, 1.0 / 16.0, 1.0 / 4.0)
"""Additional values of B, as shares of the first step in B, if the range begins on the level (B = 0). Near B = 0 curves
converge to the point A = LEVEL_POINT, some of them like √B, so closer values of B are necessary."""

LEVEL_POINT = math.sqrt(1.0 + 0.25 * math.pi**2)
"""Value of A at which the only orbit of B = 0 changes. This orbit touches the obstacle without speed. Its slide up ends
in a sticking up to this A, and in a reversal without sticking at a larger A (flight.py)."""

LEVEL_END = "level"  # reason for the end of a curve at A = LEVEL_POINT, B = 0


def curves(
    A: tuple[float, float] = (1.0, 4.0), B: tuple[float, float] = (0.0, 1.0), max_period: int = 2, *, num: int = NUM
) -> list[Curve]:
    """Compute the bifurcations of all orbits of up to `max_period` periods as curves in the plane (A, B).

    The search finds a curve if the curve passes one of `num` values of B, or if the curve begins at the end of a curve
    already found. Curves are followed down to B = 1e-7 A. At a smaller B orbits cannot be distinguished because of
    rounding (see `orbits`). If the range begins at B = 0, the curves that lead to the point A = √(1 + π²/4), B = 0 are
    extended to this point. At this point the only orbit of B = 0, which touches the obstacle without speed, changes.

    Parameters
    ----------
    A : two floats
        range of the excitation amplitude, dimensionless, the smaller value first.
    B : two floats
        range of tan α / μ, dimensionless, the smaller value first.
    max_period : int
        longest period in excitation periods, 1 to 100.
    num : int
        number of evenly spaced values of B at which bifurcations are searched for, 2 to 10 000.

    Returns
    -------
    list of Curve
        in the order of the value of A at the last point of each curve.
        `kind` is the kind of the bifurcation.
        `period`, `impacts` and `word` describe the orbit; `period` is in excitation periods.
        `A` and `B` are the points of the curve, each float64 (points,).
        `ends` gives the reasons why the curve ends at its first and at its last point.
        `meets` lists the points at which the curve meets other curves of the list.
        `at(B)` computes the values of A at any B.

    Warns
    -----
    UserWarning
        if a search finds a bifurcation but no curve through it (docs/orbits.md).

    Raises
    ------
    TypeError, ValueError
        if an argument is not a number or is out of range, or if there are too many orbits (see `bifurcations`).

    Examples
    --------
    The period doubling of the motion of one period at B = 0.1:

    >>> import vibrodrive as vd
    >>> found = vd.curves(A=(2.5, 2.7), B=(0.09, 0.11), max_period=1, num=2)
    >>> [(curve.kind, curve.at(0.1).round(10).tolist()) for curve in found]
    [('border', [2.5227119407]), ('period doubling', [2.6040806377])]
    """
    low, high = check_range("A", A)
    start, stop = check_range("B", B)
    limit = check_period("max_period", max_period)
    count = check_count("num", num, 2, MOST_NUM)
    least = max(start, LEVEL * high)  # closer to the level no orbit can be followed
    if not least < stop or high <= onset(least):
        return _onset_line((low, high), (start, stop))
    found = _Collection(Box((min(1.0, low), high), (least, stop)), low, limit)
    values = np.linspace(least, stop, count)
    if least < TOWARDS_LEVEL[0] * values[1]:
        values = np.insert(values, 1, np.multiply(TOWARDS_LEVEL, values[1]))
    with above("the progress of a call")("curves", lambda: f"{len(found.curves)} curves"):
        found.collect(values.tolist())
    whole = [_to_level(curve, least) for curve in found.curves] if start == 0.0 else found.curves
    inside = [piece for curve in whole for piece in _cut(curve, low)]
    ordered = sorted([*_onset_line((low, high), (start, stop)), *inside], key=lambda c: (c.A[-1], -c.B[-1]))
    return with_meetings(ordered)


def _onset_line(A: tuple[float, float], B: tuple[float, float]) -> list[Curve]:
    """Return the part of the straight line A = 1 + B inside the range, as a list of no curve or one curve."""
    start, stop = max(B[0], A[0] - 1.0), min(B[1], A[1] - 1.0)
    if not start < stop:
        return []
    along = np.linspace(start, stop, ONSET_POINTS)
    return [Curve(ONSET, 1, 1, "REST", "", onset(along), along, (EDGE, EDGE))]


class _Collection:
    """Search for curves in the range `box`, and the curves found so far, except the onset.

    `low` is the lower end of the range of A that the caller gave, and `limit` the longest period.
    """

    def __init__(self, box: Box, low: float, limit: int) -> None:
        self.box, self.low, self.limit = box, low, limit
        self.curves: list[Curve] = []

    def collect(self, values: list[float]) -> None:
        """Follow all bifurcations at these values of B, and then all bifurcations near the ends of found curves."""
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
            # ends of several curves at the same point differ by rounding
            values = []
            for b in beside:
                if not any(abs(b - other) < 0.1 * near for other in (*searched, *values)):
                    values.append(b)

    def search(self, B: float, low: float) -> None:
        """Follow the bifurcations at one B, for A >= low, through which no known curve passes."""
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
        """Trace the curve through a bifurcation. Warns and returns None if no condition belongs to the bifurcation."""
        recognised = recognise(found)
        if recognised is None:
            where = f"the {found.kind} at A = {found.A!r}, B = {found.B!r}"
            warnings.warn(f"no curve found through {where}: this bifurcation is left out", stacklevel=5)
            return None
        condition, seed = recognised
        points, ends = trace(condition, seed, self.box)
        side = ""
        if condition.kind == BORDER_COLLISION:
            side = "beginning" if math.cos(seed[condition.critical]) > 0.0 else "end"
        about = condition.kind, condition.period, condition.impacts, condition.word, side
        return Curve(*about, points[:, -2], points[:, -1], ends, condition=condition, points=points)


def _to_level(curve: Curve, least: float) -> Curve:
    """Extend a curve to the point A = √(1 + π²/4), B = 0, if the curve tends to this point as B falls.

    The distance in A of a curve from the point is proportional to B or to √B. So if B falls to a quarter, the distance
    falls to a quarter or to a half. This is tested from 4 `least` to `least`, the smallest B to which curves are
    followed.
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
    """Yield the parts of a curve on which A >= low."""
    assert curve.condition is not None
    for points, ends in cut(curve.condition, curve.points, curve.ends, low):
        yield replace(curve, A=points[:, -2], B=points[:, -1], points=points, ends=ends)
