"""Independent 50-digit event-driven reference of the oscillator. It imports nothing from vibrodrive.

Between switches mpmath evaluates the closed forms (4), (5), (9) from the last switch. The search for the first zero
of a switching function g divides the time ahead into windows and *proves* the number of zeros in each window. The proof
does not rely on changes of sign:

* If |g''| <= M on [a, b], g is above its chord minus M (b - a)²/8. If this lower bound is positive, g has no zero.
* The same kind of bound for g' or g'' proves that g is monotone, convex or concave on the window. Then the values at
  the ends, or the value at the only minimum, determine the number of zeros.

A window is first evaluated in double precision with a large allowance for rounding. If this does not determine the
number of zeros, the window is evaluated in full precision. For a slide that starts with ξ' = 0, g has a zero at the
start. After STICK and REST this zero is double. A Taylor bound proves g > 0 on a first interval, and the search begins
at the end of this interval.

A switch takes about 0.3 ms without a disturbance and 1 ms with a disturbance, so references are computed when they are
needed and are not stored.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from mpmath import MPContext

UP, DOWN, STICK, REST, IMPACT = range(5)
ETA = 10.0 * math.sqrt(102.0)

_digits = 50  # correct digits of τ after the point

mp = MPContext()  # a separate context, so that its precision affects no other code

ROUNDING = 64 * 2.0**-52  # allowance for rounding in double precision, relative to the sum of absolute terms
SMALL = 1e-6  # windows shorter than this, in radians of the highest frequency, are evaluated in full precision
LONG = 2e4 * math.pi  # longest search for the next reversal of a disturbed flight at B = 1


class Switch(NamedTuple):
    """One switch: its time τ = 2π·period + phase, the states before and after it, ξ and ξ' before it, and H.

    `margin` is the distance of the decision from the opposite decision; inf for a switch without a decision.
    """

    tau: Any
    period: int
    phase: Any
    before: int
    after: int
    xi: Any
    dxi: Any
    H: Any
    margin: Any


class Reference(NamedTuple):
    """All switches after τ0, the section points (ξ, ξ'), and the smallest margin of the start and all switches."""

    switches: list[Switch]
    section: list[tuple[Any, Any]]
    margin: Any


class Point(NamedTuple):
    """g, g', g'' (`g`, `dg`, `ddg`) at h, with allowances for their rounding (`pad`, `dpad`, `ddpad`).

    `line` is g without its oscillating terms, and `slow` is g without the second of these terms.
    """

    h: Any
    line: Any
    slow: Any
    g: Any
    dg: Any
    ddg: Any
    pad: Any
    dpad: Any
    ddpad: Any


def polish(exact: Callable, double: Callable, low: Any, high: Any) -> Any:
    """Return the only zero of f in (low, high), where f(low) > 0.

    `exact(h)` gives f and f' in full precision, and `double(h)` gives f in double precision.
    """
    a, b = float(low), float(high)
    for _ in range(45):
        middle = 0.5 * (a + b)
        if double(middle) > 0:
            a = middle
        else:
            b = middle
    low, high = mp.mpf(low), mp.mpf(high)
    h = min(max(mp.mpf(0.5 * (a + b)), low), high)
    enough = mp.mpf(10) ** (12 - mp.dps)
    last = high - low
    while True:
        f, df = exact(h)
        if f > 0:
            low = h
        else:
            high = h
        better = h - f / df if df else high + 1
        # Newton's method inside the bracket; bisection if the bracket shrinks too slowly
        if not low <= better <= high or abs(better - h) > 0.75 * last:
            better = (low + high) / 2
        last = abs(better - h)
        if last < enough:
            return better
        h = better


class Switching:
    """g(h) = p0 + p1 h + sign E⁽ᵏ⁾(τ_i + h), with E = A sin τ + A ε η² sin ητ. For k < 0, E⁽ᵏ⁾ is an integral.

    `waves` contains the amplitude, the frequency and the phase at τ_i of each term of E.
    """

    def __init__(self, p0: Any, p1: Any, sign: int, k: int, waves: list[tuple[Any, Any, Any]]) -> None:
        self.p0, self.p1, self.k = p0, p1, k
        self.waves = [(sign * a * w**k, w, angle) for a, w, angle in waves]
        self.doubles = [(float(a), float(w), float(angle)) for a, w, angle in self.waves]
        self.line = (float(p0), float(p1))
        sizes = [(abs(a) * (1 + ROUNDING), w) for a, w, _ in self.doubles]
        self.m0, self.m2, self.m3, self.m4 = (sum(a * w**n for a, w in sizes) for n in (0, 2, 3, 4))
        self.fast = sum(a for a, _ in sizes[1:])
        self.slow2 = sum(a * w**2 for a, w in sizes[:1])
        self.omega = max([1.0, *(w for _, w in sizes)])
        self.tiny = mp.mpf(10) ** (10 - mp.dps) * (1 + abs(p0) + self.m0)

    def exact(self, h: Any) -> tuple[Any, Any, Any]:
        """Return (g, g', g'') in full precision."""
        g, dg, ddg = self.p0 + self.p1 * h, self.p1, mp.zero
        for a, w, angle in self.waves:
            cos, sin = mp.cos_sin(angle + w * h)
            turn = (sin, cos, -sin, -cos)
            g += a * turn[self.k % 4]
            dg += a * w * turn[(self.k + 1) % 4]
            ddg += a * w * w * turn[(self.k + 2) % 4]
        return g, dg, ddg

    def full(self, h: Any) -> Point:
        """Return g, g', g'' in full precision with their allowances; `line` and `slow` equal g."""
        h = mp.mpf(h)
        g, dg, ddg = self.exact(h)
        return Point(h, g, g, g, dg, ddg, self.tiny, self.tiny * self.omega, self.tiny * self.omega**2)

    def double(self, h: float) -> Point:
        """Return g, g', g'' in double precision, with allowances for the rounding of doubles."""
        line, slope = self.line[0] + self.line[1] * h, self.line[1]
        g, dg, ddg, slow = line, slope, 0.0, line
        pad, dpad, ddpad = abs(self.line[0]) + abs(slope) * h, abs(slope), 0.0
        for i, (a, w, angle) in enumerate(self.doubles):
            x = angle + w * h
            sin, cos = math.sin(x), math.cos(x)
            turn = (sin, cos, -sin, -cos)
            g += a * turn[self.k % 4]
            dg += a * w * turn[(self.k + 1) % 4]
            ddg += a * w * w * turn[(self.k + 2) % 4]
            size = abs(a) * (1.0 + abs(x))
            pad, dpad, ddpad = pad + size, dpad + size * w, ddpad + size * w * w
            if i == 0:
                slow = g
        return Point(h, line, slow, g, dg, ddg, pad * ROUNDING, dpad * ROUNDING, ddpad * ROUNDING)

    def judge(self, a: Point, b: Point) -> str:
        """Classify the zeros of g in (a, b] for g(a) > 0.

        The result is "clear" for no zero, "zero" for one zero, "minimum" for one minimum with none, one or two zeros,
        and "unknown" if these bounds do not determine the number of zeros.
        """
        w8 = (b.h - a.h) ** 2 / 8
        pad, dpad, ddpad = max(a.pad, b.pad), max(a.dpad, b.dpad), max(a.ddpad, b.ddpad)
        if (
            min(a.line, b.line) - self.m0 > pad
            or min(a.slow, b.slow) - self.slow2 * w8 - self.fast > pad
            or min(a.g, b.g) - self.m2 * w8 > pad
            or min(a.dg, b.dg) - self.m3 * w8 > dpad
        ):
            return "clear"
        falling = max(a.dg, b.dg) + self.m3 * w8 < -dpad
        concave = max(a.ddg, b.ddg) + self.m4 * w8 < -ddpad
        convex = min(a.ddg, b.ddg) - self.m4 * w8 > ddpad
        if b.g < -pad and (falling or concave or convex):
            return "zero"
        if b.g > pad and (falling or concave):
            return "clear"
        if b.g > pad and convex and a.dg < -dpad and b.dg > dpad:
            return "minimum"
        return "unknown"

    def beginning(self) -> float | None:
        """Return a time before which g > 0 is proved, or None if g is negative immediately after the start.

        If g = 0, g' = d, g'' = e at the start and |g'''| <= m, g is positive as long as d + e h/2 - m h²/6 is positive.
        """
        g, d, e = self.exact(mp.zero)
        if abs(g) > self.tiny:
            return 0.0 if g > 0 else None
        if abs(d) <= self.tiny * self.omega:  # H = ±1 at the end of STICK or REST, so d is 0
            d = mp.zero
        if d < 0 or (d == 0 and e <= 0):
            return None
        if not self.m3:
            return math.inf
        m = mp.mpf(self.m3)
        return float(3 / m * (e / 2 + mp.sqrt(e * e / 4 + 2 * d * m / 3))) * 0.999

    def first_zero(self, horizon: Any, may_touch: bool) -> Any:
        """Return the first h in [0, horizon] at which g falls to zero; None if there is none.

        If `may_touch`, a zero without a change of sign is ignored, because STICK and REST last as long as |H| <= 1.
        Otherwise such a zero counts, too. Raises ArithmeticError if g has a zero of order three or higher.
        """
        begin = self.beginning()
        if begin is None:
            return mp.zero
        if begin >= horizon:
            return None
        width = 0.5 / self.omega
        small, evaluate = False, self.double
        left = evaluate(begin)
        while left.h < horizon:
            if small != (width * self.omega < SMALL):
                small = not small
                evaluate = self.full if small else self.double
                left = evaluate(
                    left.h if small else math.nextafter(float(left.h), 0.0)
                )  # leaves no gap to the last window
            right = evaluate(left.h + width)
            verdict = self.judge(left, right)
            if verdict == "unknown":
                width = width / 2
                if width < self.tiny:
                    raise ArithmeticError(f"a triple zero at the time {mp.nstr(left.h, 9)} after the last switch")
                continue
            if verdict == "zero":
                return self.zero(left.h, right.h)
            if verdict == "minimum":
                bottom = self.bottom(left.h, right.h)
                g = self.exact(bottom)[0]
                if g < -self.tiny:
                    return self.zero(left.h, bottom)
                if g <= self.tiny and not may_touch:
                    return bottom
            left, width = right, width * 2
        return None

    def zero(self, low: Any, high: Any) -> Any:
        """Return the only zero of g in (low, high), where g decreases."""
        return polish(lambda h: self.exact(h)[:2], lambda h: self.double(h).g, low, high)

    def bottom(self, low: Any, high: Any) -> Any:
        """Return the only minimum of g in (low, high)."""

        def descent(h: Any) -> tuple[Any, Any]:
            _, dg, ddg = self.exact(h)
            return -dg, -ddg

        return polish(descent, lambda h: -self.double(h).dg, low, high)


class Slide:
    """Slide from (ξ, ξ') at τ_i by the closed forms (4), (5) in h = τ - τ_i; s is +1 (UP) or -1 (DOWN)."""

    def __init__(self, xi: Any, dxi: Any, s: int, B: Any, waves: list[tuple[Any, Any, Any]]) -> None:
        self.xi, self.waves, self.pull = xi, waves, B + s
        self.c = dxi + sum((a / w * mp.cos(angle) for a, w, angle in waves), mp.zero)
        self.d = sum((a / w**2 * mp.sin(angle) for a, w, angle in waves), mp.zero)
        self.speed = Switching(s * self.c, -s * self.pull, s, -1, waves)
        self.doubles = [(float(a / w**2), float(w), float(angle)) for a, w, angle in waves]

    def at(self, h: Any) -> tuple[Any, Any]:
        """Return (ξ, ξ') at the time h after the start."""
        xi, dxi = self.xi + self.d + (self.c - self.pull * h / 2) * h, self.c - self.pull * h
        for a, w, angle in self.waves:
            cos, sin = mp.cos_sin(angle + w * h)
            xi -= a / w**2 * sin
            dxi -= a / w * cos
        return xi, dxi

    def reversal(self, horizon: Any) -> Any:
        """Return the first zero of ξ', or None if there is none up to `horizon`."""
        return self.speed.first_zero(horizon, may_touch=False)

    def impact(self, before: Any) -> Any:
        """Return the zero of ξ, which decreases strictly on (0, before)."""
        if self.xi == 0:
            return mp.zero
        xi, c, pull = float(self.xi + self.d), float(self.c), float(self.pull)

        def double(h: float) -> float:
            waves = sum(a * math.sin(angle + w * h) for a, w, angle in self.doubles)
            return xi + (c - pull * h / 2) * h - waves

        return polish(self.at, double, 0, before)


class Oscillator:
    """Parameters of the model, converted exactly from doubles, and functions of τ only."""

    def __init__(self, A: float, B: float, eps: float, eta: float) -> None:
        self.A, self.B, self.eps, self.eta = (mp.mpf(x) for x in (A, B, eps, eta))
        terms = [(self.A, mp.one), (self.A * self.eps * self.eta**2, self.eta)]
        self.terms = [(a, w) for a, w in terms if a]
        self.highest = sum((a for a, _ in self.terms), mp.zero)
        self.tiny = mp.mpf(10) ** (12 - mp.dps) * (1 + self.B + self.highest)

    def waves(self, tau: Any) -> list[tuple[Any, Any, Any]]:
        return [(a, w, mp.fmod(w * tau, 2 * mp.pi)) for a, w in self.terms]

    def H(self, tau: Any) -> Any:
        """Return the adhesive force (2)."""
        return sum((a * mp.sin(angle) for a, w, angle in self.waves(tau)), -self.B)

    def decide(self, xi: Any, tau: Any) -> tuple[int, Any]:
        """Return (state after a switch with ξ' = 0, margin of this decision)."""
        H = self.H(tau)
        margin = abs(abs(H) - 1)
        if margin < self.tiny:  # at |H| = 1 the mass still sticks, but the sticking may end at this instant
            H, margin = mp.zero, mp.zero
        if H > 1:
            return UP, margin
        if xi == 0:
            return REST, margin
        return (DOWN if H < -1 else STICK), margin

    def release(self, state: int, tau: Any, horizon: Any) -> tuple[Any, int]:
        """Return (duration of STICK or REST, or None if it reaches `horizon`; next state)."""
        limits = [(UP, 1 + self.B, -1)]  # g = 1 - H
        if state == STICK:
            limits.append((DOWN, 1 - self.B, 1))  # g = 1 + H
        waves = self.waves(tau)
        best, after = None, state
        for then, level, sign in limits:
            if self.highest <= level:
                continue
            if len(waves) == 1:
                h = self.arcsine(waves[0][2], level, sign)
            else:
                g = Switching(level, mp.zero, sign, 0, waves)
                h = g.first_zero(horizon if best is None else best, may_touch=True)
            if h is not None and (best is None or h < best):
                best, after = h, then
        return best, after

    def arcsine(self, angle: Any, level: Any, sign: int) -> Any:
        """Return the time from `angle` until level + sign A sin falls to zero."""
        root = mp.asin(level / self.A)
        target = root if sign < 0 else mp.pi + root
        h = (target - angle) % (2 * mp.pi)
        return mp.zero if 2 * mp.pi - h < self.tiny else h

    def latest_reversal(self, slide: Slide, horizon: Any) -> Any:
        """Return a time after which a slide down cannot reverse; inf for B < 1, where every slide down reverses.

        For B > 1 the mean of ξ'' is negative. Without a disturbance, ξ' does not increase from one period to the next.
        With a disturbance and B equal or close to 1 there is no such bound, and the search ends after the time LONG.
        """
        if self.B < 1:
            return mp.inf
        if len(slide.waves) < 2:
            return 2 * mp.pi
        highest = slide.c + sum(a / w for a, w, _ in slide.waves)
        if highest < 0:
            return mp.zero
        latest = highest / (self.B - 1) if self.B > 1 else mp.inf
        return min(latest, max(horizon, mp.mpf(LONG)))

    def slide_down(self, slide: Slide, horizon: Any) -> tuple[Any, int, Any]:
        """Return (duration of DOWN, or None if it reaches `horizon`; next state; margin of the decision)."""
        reversal = slide.reversal(self.latest_reversal(slide, horizon))
        if reversal is None:
            if slide.at(horizon)[0] > 0:
                return None, DOWN, mp.inf
            return slide.impact(horizon), IMPACT, mp.inf
        lowest = slide.at(reversal)[0]
        if lowest > 0:
            return reversal, STICK, lowest
        return slide.impact(reversal), IMPACT, -lowest


@contextmanager
def with_digits(digits: int) -> Iterator[None]:
    """Give τ this number of correct digits in the references that are computed within the block."""
    global _digits
    before, _digits = _digits, digits
    try:
        yield
    finally:
        _digits = before


def reference(
    A: float,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = ETA,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    *,
    periods: int,
    section_phase: float = 0.0,
    max_switches: int | None = None,
) -> Reference:
    """Return all switches in (τ0, τ0 + 2π periods] with their margins, and all section points in this interval.

    All numbers have the type of mpmath. τ has 50 correct digits after the point, or the number that `with_digits` sets.
    The margin of a switch is

    * at a reversal of a slide down: ξ,
    * at an impact: |ξ| at the reversal that would follow without an obstacle; inf if no reversal would follow,
    * at a decision by H: ||H| - 1|.

    If two of these apply, the margin is the smaller value. The computation ends after `max_switches` switches, and the
    section is then shorter.

    A slide also ends at an instant at which ξ' touches zero. Then |H| = 1, and the slide continues immediately.
    The margin of this switch is 0.
    """
    span = 1 + abs(tau0) + 7 * periods
    mp.dps = _digits + 15 + math.ceil(math.log10(span * max(1.0, eta)))
    model = Oscillator(A, B, eps, eta)
    cycle = 2 * mp.pi
    tau, xi, dxi = mp.mpf(tau0), mp.mpf(xi0), mp.mpf(dxi0)
    end = tau + cycle * periods
    next_k = int(mp.floor((tau - section_phase) / cycle)) + 1
    switches: list[Switch] = []
    section: list[tuple[Any, Any]] = []

    def record(before: int, after: int, xi: Any, dxi: Any, margin: Any) -> None:
        period = int(mp.floor(tau / cycle))
        phase = tau - cycle * period
        switches.append(Switch(tau, period, phase, before, after, xi, dxi, model.H(tau), margin))

    margin = mp.inf
    if dxi:
        state = UP if dxi > 0 else DOWN
    else:
        state, margin = model.decide(xi, tau)
    start_margin = margin

    while max_switches is None or len(switches) < max_switches:
        horizon = end - tau
        slide = None
        margin = mp.inf
        if state in (STICK, REST):
            h, after = model.release(state, tau, horizon)
        else:
            slide = Slide(xi, dxi, 1 if state == UP else -1, model.B, model.waves(tau))
            if state == UP:
                h, after = slide.reversal(mp.inf), STICK
            else:
                h, after, margin = model.slide_down(slide, horizon)
        last = h is None or h > horizon
        until = end if last else tau + h
        while section_phase + cycle * next_k <= until:
            section.append(slide.at(section_phase + cycle * next_k - tau) if slide else (xi, mp.zero))
            next_k += 1
        if last:
            break

        held = slide is None
        tau = until
        if slide:
            xi, dxi = slide.at(h)
        if after == IMPACT:
            xi = mp.zero
            record(state, IMPACT, xi, dxi, margin)
            state = IMPACT
        if not held:
            after, margin_H = model.decide(xi, tau)
            margin = margin_H if state == IMPACT else min(margin, margin_H)
        record(state, after, xi, mp.zero, margin)
        state, dxi = after, mp.zero
    return Reference(switches, section, min([start_margin, *(s.margin for s in switches)]))


SCENES: dict[str, dict[str, Any]] = {
    # motions of the paper
    "one-periodic": {"A": 1.5, "periods": 1000},
    "two-periodic": {"A": 3.04, "periods": 1000},
    "disturbed": {"A": 3.04, "eps": 2e-4, "periods": 100},
    # other motions
    "level plane": {"A": 2.9, "B": 0.0, "xi0": 1.0, "periods": 60},
    "steep": {"A": 3.3, "B": 0.5, "periods": 60},
    "slides by itself": {"A": 3.0, "B": 1.3, "xi0": 4.0, "tau0": 1.0, "periods": 60},
    "barely holds": {"A": 2.5, "B": 1.0, "xi0": 2.0, "dxi0": 0.5, "periods": 60},
    "slow disturbance": {"A": 2.2, "eta": 0.37, "eps": 0.02, "periods": 40},
    "moderate disturbance": {"A": 2.6, "eta": 7.3, "eps": 0.01, "periods": 40},
    "fast disturbance": {"A": 1.9, "B": 0.2, "eta": 431.7, "eps": 2e-5, "periods": 10},
    "disturbed slide": {"A": 3.1, "B": 1.2, "eps": 1e-4, "xi0": 3.0, "periods": 10},
    "thrown": {"A": 2.7, "xi0": 3.0, "dxi0": -1.5, "tau0": 2.2, "periods": 60},
    "late start": {"A": 3.15, "xi0": 0.5, "dxi0": 2.0, "tau0": -1e4, "periods": 60},
}
"""Arguments of `reference` for comparisons. Each comparison takes at most a second."""
