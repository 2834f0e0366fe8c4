"""Points at which two curves of bifurcations meet: one curve ends on the other curve, or the curves cross."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from vibrodrive.periodic.continuation import bisect, scale_of
from vibrodrive.periodic.curve import Curve, Meeting
from vibrodrive.periodic.tracing import EDGE

# largest distance in A and in B of two curves at a common point, in units of `scale_of`; if the curves only touch, the
# error of this point is about the square root of a rounding error
SAME_POINT = 1e-7
TOUCHING = 1e-12  # largest distance in A of two curves that coincide within rounding, in units of `scale_of`


def with_meetings(found: list[Curve]) -> list[Curve]:
    """Return the curves of a list, each with the points at which it meets other curves of the list."""
    meets: list[list[Meeting]] = [[] for _ in found]
    for (i, one), (j, other) in itertools.combinations(enumerate(found), 2):
        for A, B, what in _meetings(one, other):
            meets[i].append(Meeting(A, B, j, what))
            meets[j].append(Meeting(A, B, i, what))
    return [replace(curve, meets=tuple(m)) for curve, m in zip(found, meets, strict=True)]


def _meetings(one: Curve, other: Curve) -> Iterator[tuple[float, float, str]]:
    """Yield (A, B, "end" or "crossing") for every common point of two curves."""
    known: list[tuple[float, float]] = []

    def new(A: float, B: float) -> bool:
        near = SAME_POINT * scale_of(A)
        if any(abs(A - a) < near and abs(B - b) < near for a, b in known):
            return False
        known.append((A, B))
        return True

    for curve, beside in ((one, other), (other, one)):
        for i, why in zip((0, -1), curve.ends, strict=True):
            A, B = float(curve.A[i]), float(curve.B[i])
            if why != EDGE and _passes(beside, A, B) and new(A, B):
                yield A, B, "end"
    for A, B in _crossings(one, other):
        if new(A, B):
            yield A, B, "crossing"


def _passes(curve: Curve, A: float, B: float) -> bool:
    """Return True if a curve passes through a point or ends there."""
    near = SAME_POINT * scale_of(A)
    if any(abs(curve.A[i] - A) < near and abs(curve.B[i] - B) < near for i in (0, -1)):
        return True
    return any(abs(a - A) < near for a in curve.at(B).tolist())


def meeting_points(found: Sequence[Curve]) -> list[tuple[float, float, list[int]]]:
    """Return (A, B, indices of the curves in the list) for every point at which two or more curves meet."""
    points: list[tuple[float, float, set[int]]] = []
    for i, curve in enumerate(found):
        for m in curve.meets:
            near = SAME_POINT * scale_of(m.A)
            same = (at for A, B, at in points if abs(A - m.A) < near and abs(B - m.B) < near)
            at = next(same, None)
            if at is None:
                at = set()
                points.append((m.A, m.B, at))
            at |= {i, m.other}
    return [(A, B, sorted(at)) for A, B, at in points]


def _crossings(one: Curve, other: Curve) -> Iterator[tuple[float, float]]:
    """Yield the points at which two curves cross."""
    for k, j in zip(*np.nonzero(_overlap(one, other)), strict=True):
        low = max(min(one.B[k : k + 2]), min(other.B[j : j + 2]))
        high = min(max(one.B[k : k + 2]), max(other.B[j : j + 2]))
        if not low < high:
            continue

        def apart(B: float, k: int = k, j: int = j) -> float:
            a, b = one.within(k, B), other.within(j, B)
            return math.nan if a is None or b is None else a - b

        first, last = apart(low), apart(high)
        # a fold that ends on a border differs from this border only by rounding near its end
        if not first * last < 0.0 or min(abs(first), abs(last)) < TOUCHING * scale_of(one.A[k]):
            continue
        B = _zero(apart, low, high, first)
        A = one.within(k, B)
        if A is not None:
            yield A, B


def _overlap(one: Curve, other: Curve) -> np.ndarray:
    """Return True, in a bool array (steps of `one`, steps of `other`), for each pair of steps that may cross.

    A step connects two neighbouring points. Two steps may cross if their bounding boxes, enlarged by 10 %, overlap.
    """

    def spans(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        low, high = np.minimum(values[:-1], values[1:]), np.maximum(values[:-1], values[1:])
        return low - 0.1 * (high - low), high + 0.1 * (high - low)

    (a_low, a_high), (b_low, b_high) = spans(one.A), spans(one.B)
    (c_low, c_high), (d_low, d_high) = spans(other.A), spans(other.B)
    in_A = (a_low[:, None] <= c_high) & (c_low <= a_high[:, None])
    return in_A & (b_low[:, None] <= d_high) & (d_low <= b_high[:, None])


def _zero(f: Callable[[float], float], low: float, high: float, first: float) -> float:
    """Return the B between `low` and `high` at which f changes its sign; `first` is f(low)."""
    return bisect(lambda b: (f(b) > 0.0) == (first > 0.0), low, high)[0]
