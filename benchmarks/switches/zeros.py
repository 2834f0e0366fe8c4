"""All zeros of g(h) = c0 + c1 h + c2 h² + Σ a sin(w h + phase) in (0, end], with a proof that there are no others.

The interval is divided into windows. For a window of half width r around m, Taylor's formula at m, with bounds of the
third and fourth derivative, proves one of three properties. If it proves none, the window is halved.

* g has no zero (`clear` first tries double precision with an allowance for rounding, then full precision);
* g is monotone, so the signs at its ends determine the number of zeros;
* g is convex or concave, so the signs at its ends and at its one extremum determine the number of zeros.

If g has a zero at h = 0, the search begins after this zero. If g = … = g⁽ⁿ⁻¹⁾ = 0 at h = 0, g has no other zero as long
as g⁽ⁿ⁾ does not change its sign.
"""

import math
from typing import Any, NamedTuple

from tests.exact.reference import mp, polish

ROUNDING = 64 * 2.0**-52  # allowance for rounding in double precision, as a share of the sum of |terms|
ABOVE = 1 + 2.0**-40  # factor that covers the rounding error of a bound in double precision


class Zero(NamedTuple):
    """A zero, g' at this zero, and its multiplicity: 1 or 2."""

    at: Any
    slope: Any
    multiplicity: int


class Function:
    """g with bounds of its derivatives. `waves` are (a, w, phase), slow waves first; h is in (0, `span`]."""

    def __init__(self, c: tuple[Any, Any, Any], waves: list[tuple[Any, Any, Any]], span: Any) -> None:
        self.c = tuple(mp.mpf(x) for x in c)
        self.waves = [(mp.mpf(a), mp.mpf(w), mp.fmod(mp.mpf(phase), 2 * mp.pi)) for a, w, phase in waves if a]
        self.end = mp.mpf(span)
        self.doubles = [(float(a), float(w), float(phase)) for a, w, phase in self.waves]
        self.poly = tuple(float(x) for x in self.c)
        sizes = [(abs(a), abs(w)) for a, w, _ in self.doubles]
        self.amplitudes = [sum(a for a, _ in sizes[i:]) * ABOVE for i in range(len(sizes) + 1)]
        self.bounds = [float(sum(a * w**n for a, w in sizes)) * ABOVE for n in range(5)]
        self.bounds[2] += 2 * abs(self.poly[2]) * ABOVE
        self.omega = max([1.0, *(w for _, w in sizes)])
        terms = (abs(self.c[0]), abs(self.c[1]) * self.end, abs(self.c[2]) * self.end**2, self.bounds[0])
        self.tiny = mp.mpf(10) ** (12 - mp.dps) * max(terms)

    def at(self, h: Any) -> list[Any]:
        """Return g, g', g'', g''' in full precision."""
        c0, c1, c2 = self.c
        g = [c0 + (c1 + c2 * h) * h, c1 + 2 * c2 * h, 2 * c2, mp.zero]
        for a, w, phase in self.waves:
            cos, sin = mp.cos_sin(phase + w * h)
            turn = (sin, cos, -sin, -cos)
            for n in range(4):
                g[n] += a * turn[n]
                a *= w
        return g

    def clear(self, m: float, r: float) -> bool:
        """Return True if double precision proves that there is no zero in |h - m| <= r. Waves are added one by one,
        slow waves first. Waves that are not yet added are bounded by their amplitude."""
        r = r * ABOVE + abs(m) * ROUNDING
        c0, c1, c2 = self.poly
        g, dg, ddg, third = c0 + (c1 + c2 * m) * m, c1 + 2 * c2 * m, 2 * c2, 0.0
        size = abs(c0) + (abs(c1) + abs(c2 * m)) * abs(m) + (abs(c1) + abs(c2 * m) + abs(c2) * r) * r
        for i, rest in enumerate(self.amplitudes):
            if abs(g) > (abs(dg) + (abs(ddg) / 2 + third * r / 6) * r) * r + rest + ROUNDING * size:
                return True
            if i < len(self.doubles):
                a, w, phase = self.doubles[i]
                x = phase + w * m
                sin, cos = math.sin(x), math.cos(x)
                g, dg, ddg, third = g + a * sin, dg + a * w * cos, ddg - a * w * w * sin, third + abs(a * w**3)
                size += abs(a) * (1 + abs(x)) * (1 + w * r + (w * r) ** 2)
        return False

    def beginning(self) -> Any:
        """Return the start of the search: 0 or, if g(0) = 0, the end of an interval without another zero."""
        for n, value in enumerate(self.at(mp.zero)):
            if abs(value) > self.tiny * mp.mpf(self.omega) ** n:
                if n == 0:
                    return mp.zero
                bound = self.bounds[n + 1]
                return min(self.end, abs(value) / bound / 2) if bound else self.end
        raise ArithmeticError("a zero of order four at the start")

    def zeros(self, most: int | None = None) -> list[Zero]:
        """Return all zeros in (0, end] in order, or only the first `most`.

        Raises ArithmeticError at a triple zero, a zero at h = `end`, or a zero of order four at h = 0.
        """
        found: list[Zero] = []
        left, width = self.beginning(), mp.mpf(1 / self.omega)
        while left < self.end and (most is None or len(found) < most):
            right = min(left + width, self.end)
            inside = self.look(left, right)
            if inside is None:
                width = (right - left) / 2
                if width < self.tiny:
                    raise ArithmeticError(f"a triple zero, or one at the end: {mp.nstr(left, 9)}")
                continue
            found += inside
            left, width = right, 2 * width
        return found if most is None else found[:most]

    def look(self, left: Any, right: Any) -> list[Zero] | None:
        """Return the zeros in a window, or None if their number is not proved."""
        m, r = (left + right) / 2, (right - left) / 2
        if self.clear(float(m), float(r)):
            return []
        g, dg, ddg, dddg = self.at(m)
        third, fourth = self.bounds[3], self.bounds[4]
        if abs(g) > (abs(dg) + (abs(ddg) / 2 + third * r / 6) * r) * r + self.tiny:
            return []
        low, high = self.at(left), self.at(right)
        if abs(high[0]) <= self.tiny:  # there is a zero at the end of the window: use another window
            return None
        crosses = (low[0] > 0) != (high[0] > 0)
        monotone = abs(dg) > (abs(ddg) + third * r / 2) * r + self.tiny * self.omega
        curved = abs(ddg) > (abs(dddg) + fourth * r / 2) * r + self.tiny * self.omega**2
        if monotone or (curved and (low[1] > 0) == (high[1] > 0)):
            return [self.between(left, right, low[0])] if crosses else []
        if not curved:
            return None
        top = 1 if ddg < 0 else -1
        extremum = polish(
            lambda h: [top * x for x in self.at(h)[1:3]],
            lambda h: top * self.double_value(h, 1),
            left,
            right,
        )
        bottom = self.at(extremum)[0]
        if abs(bottom) <= self.tiny:
            return [Zero(extremum, mp.zero, 2)]
        parts = [(left, extremum, low[0], bottom), (extremum, right, bottom, high[0])]
        return [self.between(a, b, begin) for a, b, begin, end in parts if (begin > 0) != (end > 0)]

    def between(self, left: Any, right: Any, value: Any) -> Zero:
        """Return the only zero in (left, right). g has the sign of `value` at `left`."""
        sign = 1 if value > 0 else -1
        h = polish(lambda h: [sign * x for x in self.at(h)[:2]], lambda h: sign * self.double_value(h, 0), left, right)
        return Zero(h, self.at(h)[1], 1)

    def double_value(self, h: float, n: int) -> float:
        """Return g, or g' if n = 1, in double precision. It is used for the first digits of a zero."""
        c0, c1, c2 = self.poly
        if n:
            return c1 + 2 * c2 * h + sum(a * w * math.cos(phase + w * h) for a, w, phase in self.doubles)
        return c0 + (c1 + c2 * h) * h + sum(a * math.sin(phase + w * h) for a, w, phase in self.doubles)
