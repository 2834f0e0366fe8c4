"""Curves of solutions of a condition (conditions.py) in the plane (A, B): tangent predictor and Newton's method.

The steps follow the curve in the space of all unknowns (pseudo-arclength), so the curve may turn back in B or in A. The
curve ends where a margin vanishes, a number that is positive as long as the motion exists (conditions.py). The curve
also ends where it leaves the box, the range of A and B. The end is found as the zero of the margin, or of the distance
from the edge of the box, along the last step. Every point at which B turns back is found in the same way, as a zero of
the rate of B. So B is monotone between neighbouring points, and each value of B between two neighbouring points belongs
to exactly one point of the curve.
"""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from vibrodrive.periodic.conditions import Condition, Margin, newton

LONGEST = 1.0 / 48.0  # longest step; the unit of A and B is the width of the box, the unit of times is a radian
SHORTEST = 1e-9  # shortest step; a curve that needs a shorter step ends, at a vanishing margin or as "lost"
NEAR = LONGEST / 50.0  # a step across the end of a curve must be shorter than this
ROUNDING = 1e-10  # largest rounding error of a margin; only a margin below -ROUNDING counts as negative
FAR = 0.2  # largest error of a prediction, as a share of the step
MOST_POINTS = 20_000  # largest number of points of one curve

EDGE, LOST, CLOSED = "edge", "lost", "closed"
"""Reasons for the end of a curve, other than a vanishing margin. EDGE: the curve reaches the edge of the box. LOST: no
further solution is found. CLOSED: the curve has no end, because it is closed."""


class Box(NamedTuple):
    """Ranges of A and B."""

    A: tuple[float, float]
    B: tuple[float, float]

    def margins(self, u: np.ndarray) -> list[Margin]:
        A, B = u[-2:].tolist()
        inside = (A - self.A[0], self.A[1] - A, B - self.B[0], self.B[1] - B)
        return [Margin(EDGE, value) for value in inside]

    def snap_to_edge(self, u: np.ndarray) -> np.ndarray:
        """Return the point u. If u is within rounding of an edge, move it exactly onto this edge."""
        u = u.copy()
        for k, edges in ((-2, self.A), (-1, self.B)):
            for edge in edges:
                if abs(u[k] - edge) < ROUNDING:
                    u[k] = edge
        return u


def trace(condition: Condition, seed: np.ndarray, box: Box) -> tuple[np.ndarray, tuple[str, str]]:
    """Return (points, reasons) of the curve through the solution `seed`, which is inside the box.

    points : points of the curve, float64 (m, S + 2) for S slides
    reasons : the reasons why the curve ends at its first and at its last point
    """
    forward, last = _Walk(condition, box).follow(seed, 1.0)
    if last == CLOSED:
        return np.array(forward), (CLOSED, CLOSED)
    backward, first = _Walk(condition, box).follow(seed, -1.0)
    points = [*reversed(backward[1:]), *forward] if len(backward) > 1 else [backward[0], *forward[1:]]
    return np.array(points), (first, last)


class _Walk:
    """Computation of a curve in one direction from a given point."""

    def __init__(self, condition: Condition, box: Box) -> None:
        self.condition = condition
        self.box = box
        # the length of a step is measured in widths of the box for A and B, and in radians for times
        self.scale = np.ones(len(condition.slides) + 2)
        self.scale[-2:] = box.A[1] - box.A[0], box.B[1] - box.B[0]

    def margins(self, u: np.ndarray) -> list[Margin]:
        return self.condition.margins(u) + self.box.margins(u)

    def tangent(self, u: np.ndarray, along: np.ndarray | None) -> np.ndarray:
        """Return the unit tangent of the curve at u in scaled unknowns, in the direction of `along` if it is given."""
        _, slopes = self.condition.linearised(u)
        direction = np.linalg.svd(slopes * self.scale)[2][-1]
        if along is None:
            return direction if direction[-1] >= 0.0 else -direction
        return direction if direction @ along >= 0.0 else -direction

    def corrected(self, u: np.ndarray, tangent: np.ndarray) -> np.ndarray | None:
        """Return the point at which the curve crosses the plane through u normal to the tangent; None if not found."""
        row = tangent / self.scale
        return newton(self.condition, u, row, float(row @ u))

    def follow(self, seed: np.ndarray, sign: float) -> tuple[list[np.ndarray], str]:
        """Return (points, reason): the points from the seed on, and the reason for the end of the curve.

        `sign` is 1 or -1, the direction along the curve.
        """
        points = [seed]
        tangent = sign * self.tangent(seed, None)
        start, step = tangent, 0.25 * LONGEST
        while len(points) < MOST_POINTS:
            here = points[-1]
            ahead = here + step * tangent * self.scale
            there = self.corrected(ahead, tangent)
            if there is None or float(np.linalg.norm((there - ahead) / self.scale)) > FAR * step:
                step *= 0.5
                if step < SHORTEST:
                    return points, self.end_reason(here)
                continue
            turned = self.tangent(there, tangent)
            if min(m.value for m in self.margins(there)) <= 0.0:
                # a long step may pass several ends, and after the first end the equations have no meaning
                stop = self.first_end(here, there, tangent) if step < NEAR else None
                if stop is None:
                    step *= 0.25
                    if step < SHORTEST:
                        return points, self.end_reason(here)
                    continue
                end, why = stop
                if float(np.max(np.abs(end - here))) < ROUNDING:
                    points[-1] = end
                else:
                    self.add_turn(points, end, tangent, self.tangent(end, tangent))
                return points, why
            self.add_turn(points, there, tangent, turned)
            if len(points) > 4 and self.passes(seed, start, here, there):
                points[-1] = seed
                return points, CLOSED
            error = float(np.linalg.norm((there - ahead) / self.scale))
            tangent = turned
            step = min(LONGEST, step * (2.0 if error < 0.25 * FAR * step else 1.0))
        return points, LOST

    def end_reason(self, u: np.ndarray) -> str:
        """Return the reason for an end at u: the name of the margin that vanishes there, or LOST if none vanishes."""
        least = min(self.margins(u), key=lambda m: m.value)
        return least.what if least.value < ROUNDING else LOST

    def passes(self, seed: np.ndarray, start: np.ndarray, here: np.ndarray, there: np.ndarray) -> bool:
        """Return True if the seed is on the step from `here` to `there`."""
        before, behind = (float(start @ ((u - seed) / self.scale)) for u in (here, there))
        length = float(np.linalg.norm((there - here) / self.scale))
        return before < 0.0 <= behind and float(np.linalg.norm((there - seed) / self.scale)) <= length

    def add_turn(self, points: list[np.ndarray], there: np.ndarray, tangent: np.ndarray, turned: np.ndarray) -> None:
        """Add the point `there` to `points`. If B turns back before this point, add the turning point first.

        `tangent` is the tangent at the last point of `points`, and `turned` is the tangent at `there`.
        """
        here = points[-1]
        if tangent[-1] * turned[-1] < 0.0 and not np.array_equal(here, there):

            def rate(u: np.ndarray) -> float:
                return float(self.tangent(u, tangent)[-1])

            turn = self.zero(rate, here, there, tangent)
            if turn is not None and not any(np.array_equal(turn, u) for u in (here, there)):
                points.append(turn)
        points.append(there)

    def first_end(self, here: np.ndarray, there: np.ndarray, tangent: np.ndarray) -> tuple[np.ndarray, str] | None:
        """Return (point, name) for the first margin that vanishes along a step; None if no such point is found."""
        for k, margin in enumerate(self.margins(there)):
            if margin.value > 0.0:
                continue

            def value(u: np.ndarray, k: int = k) -> float:
                return self.margins(u)[k].value

            where = self.zero(value, here, there, tangent)
            if where is not None and margin.what == EDGE:
                where = self.box.snap_to_edge(where)
            if where is not None and min(m.value for m in self.margins(where)) > -ROUNDING:
                return where, margin.what
        return None

    def zero(
        self, f: Callable[[np.ndarray], float], here: np.ndarray, there: np.ndarray, tangent: np.ndarray
    ) -> np.ndarray | None:
        """Return the point of the curve between two points at which f changes its sign; None if f keeps its sign."""

        return zero_on(lambda share: self.corrected(here + share * (there - here), tangent), f)


def zero_on(at: Callable[[float], np.ndarray | None], f: Callable[[np.ndarray], float]) -> np.ndarray | None:
    """Return the point at(share), 0 <= share <= 1, at which f changes its sign; None if f keeps its sign.

    The zero is found by the Illinois method.
    """
    low, high = 0.0, 1.0
    first, last = at(low), at(high)
    if first is None or last is None:
        return None
    f_low, f_high = f(first), f(last)
    if f_low == 0.0 or not f_low * f_high <= 0.0:
        return first if f_low == 0.0 else None
    best, side = (first, 0) if abs(f_low) < abs(f_high) else (last, 0)
    share = math.inf
    for _ in range(80):
        share, before = high - f_high * (high - low) / (f_high - f_low), share
        if not low < share < high or abs(share - before) < 1e-15:
            break
        point = at(share)
        if point is None:
            return None
        value = f(point)
        best = point
        if value == 0.0 or math.isnan(value):
            break
        if (value > 0.0) == (f_high > 0.0):
            high, f_high = share, value
            f_low *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, f_low = share, value
            f_high *= 0.5 if side == -1 else 1.0
            side = -1
    return best


def point_at(condition: Condition, here: np.ndarray, there: np.ndarray, B: float) -> float | None:
    """Return the A of the curve at a given B between two neighbouring points; None if it is not found.

    If B hardly changes along the curve, Newton's method at a fixed B may converge to a distant point. In this case a
    search along the curve finds the point instead.
    """
    found = _solution_at(condition, here, there, -1, B)
    if found is not None and _is_between(found, here, there):
        return float(found[-2])
    across = there - here
    across = across / np.linalg.norm(across)

    def at(share: float) -> np.ndarray | None:
        u = here + share * (there - here)
        return newton(condition, u, across, float(across @ u))

    close = zero_on(at, lambda u: float(u[-1]) - B)
    return None if close is None else float(close[-2])


def _is_between(u: np.ndarray, here: np.ndarray, there: np.ndarray) -> bool:
    """Return True if the projection of u is on the step between two points, at most a quarter of the step away."""
    way = there - here
    length = float(np.linalg.norm(way))
    share = float((u - here) @ way) / length**2
    return 0.0 <= share <= 1.0 and float(np.linalg.norm(u - here - share * way)) < 0.25 * length


def cut(
    condition: Condition, points: np.ndarray, ends: tuple[str, str], low: float
) -> Iterator[tuple[np.ndarray, tuple[str, str]]]:
    """Yield (points, reasons) for each part of a curve on which A >= low; `reasons` are those for the two ends."""
    inside = points[:, -2] >= low
    part: list[np.ndarray] = []
    first = ends[0]
    for k, u in enumerate(points):
        if k and inside[k] != inside[k - 1]:
            edge = _solution_at(condition, points[k - 1], u, -2, low)
            if edge is not None:
                edge[-2] = low
                part.append(edge)
            if part and not inside[k]:
                yield np.array(part), (first, EDGE)
                part = []
            else:
                first = EDGE
        if inside[k]:
            part.append(u)
    if len(part) > 1:
        yield np.array(part), (first, ends[1])


def _solution_at(
    condition: Condition, here: np.ndarray, there: np.ndarray, place: int, value: float
) -> np.ndarray | None:
    """Return the solution for which the unknown at index `place` (A: -2, B: -1) has a given value; None if not found.

    The first guess is between the two points.
    """
    row = np.zeros(len(here))
    row[place] = 1.0
    guess = here + (value - here[place]) / (there[place] - here[place]) * (there - here)
    return newton(condition, guess, row, value)
