"""Equations of a bifurcation of one orbit for A, B and the times of its slides. They are smooth at the bifurcation.

A search (search.py, continuation.py) decides at the end of each slide whether the mass reverses, sticks, rests or
leaves the obstacle. At a bifurcation one of these decisions changes. Here the sequence of slides is prescribed, so
there are no decisions. The unknowns are A, B and the times t_1 … t_S at which the S slides end. Each slide begins at
the end of the previous slide or, after sticking or a rest, when H is 1 or -1. A slide ends with ξ' = 0, or with ξ = 0
if it ends at the obstacle. One more equation is the condition of the bifurcation:

* *border*: H = 1 at an impact, which is then the last impact before a rest,
* *grazing*: ξ = 0 and ξ' = 0 at the end of a slide down,
* *stick*: |H| = 1 at the end of a slide,
* *period doubling*: the multiplier is -1; *fold*: the multiplier is +1. (The multiplier is the derivative of the
  impact-phase map over all impacts of one period.)

So S + 1 equations hold along a curve in the space of S + 2 unknowns. A real motion has this sequence of slides as long
as every other decision has the result that the sequence requires. For each of these decisions there is a *margin*, a
number that is positive as long as the decision does not change, and zero where the decision changes.

Derivatives are exact (complex step), because every term is analytic in the unknowns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vibrodrive.jit.trig import TWO_PI
from vibrodrive.model.states import State
from vibrodrive.periodic.continuation import BORDER_COLLISION, DOUBLING, GRAZING, STICK
from vibrodrive.periodic.flight import FROM_STICK
from vibrodrive.periodic.impact_map import spell

TINY = 1e-40  # imaginary step of a derivative; its square is below the rounding error of 1, so the derivative is exact
SERIES = tuple(range(1, 12))  # indices of the terms of the series in `lags`; the next term is below 1e-22 of the first
CONVERGED = 1e-13  # relative size of a Newton step at which rounding prevents smaller steps
MOST_STEPS = 12  # largest number of Newton steps; from a prediction close to the curve three or four suffice


class Slide(NamedTuple):
    """One slide of a prescribed motion.

    falls : True for a slide down.
    begun : kind of beginning: FROM_GROUND (directly after an impact), FROM_STICK (after sticking or a rest) or
        FROM_REVERSAL.
    turns : index of the period in which the sticking or rest that precedes the slide ends. The first launch is in
        period 0. If no sticking or rest precedes the slide, `turns` is 0.
    lands : True if the slide ends at the obstacle.
    """

    falls: bool
    begun: int
    turns: int
    lands: bool


class Margin(NamedTuple):
    """Number `value` that is positive as long as a prescribed motion exists; `what` names the reason why it is zero.

    The reason is the kind of a second bifurcation, or the edge of the range of A and B (tracing.py).
    """

    what: str
    value: float


@dataclass(frozen=True)
class Condition:
    """One bifurcation of one prescribed motion.

    kind, period : kind of the bifurcation; period of the orbit in excitation periods.
    slides : slides of one period, in order; if there is a rest, the first slide follows the rest.
    rests : True if the orbit contains a rest.
    critical : index of the slide at whose end the border, grazing or stick occurs; -1 for a period doubling or fold.
    doubled : True if both halves of the period have the same states, as after a period doubling. If their launch phases
        become equal, the orbit coincides with an orbit of half the period.

    The methods with an argument u of shape (m, S + 2) compute m points. Each row of u is t_1 … t_S, A, B.
    """

    kind: str
    slides: tuple[Slide, ...]
    period: int
    rests: bool
    critical: int
    doubled: bool = False

    @property
    def word(self) -> str:
        """States of one period, as text, including a sticking of no duration."""
        word = [State.REST] * self.rests
        for s in self.slides:
            word += [State.STICK] * (s.begun == FROM_STICK and word != [State.REST])
            word += [State.DOWN if s.falls else State.UP] + [State.IMPACT] * s.lands
        if self.rests and not self.slides[-1].lands:
            word.append(State.IMPACT)
        return spell(word)

    @property
    def impacts(self) -> int:
        return max(1, sum(s.lands for s in self.slides))

    def starts(self, u: np.ndarray) -> np.ndarray:
        """Return the times at which the slides begin, (m, S)."""
        A, B = u[:, -2], u[:, -1]
        up, down = np.arcsin((1.0 + B) / A), math.pi + np.arcsin((1.0 - B) / A)
        begins = []
        for i, s in enumerate(self.slides):
            if s.begun == FROM_STICK:
                begins.append((down if s.falls else up) + TWO_PI * s.turns)
            else:
                begins.append(u[:, i - 1] if i else u[:, -3] - TWO_PI * self.period)
        return np.stack(begins, axis=1)

    def motion(self, u: np.ndarray) -> Motion:
        """Compute the slides at each of the m points."""
        A, B = u[:, -2:-1], u[:, -1:]
        begin, end = self.starts(u), u[:, :-2]
        sigma = np.array([-1.0 if s.falls else 1.0 for s in self.slides])
        released = np.array([s.begun == FROM_STICK for s in self.slides])
        p = A * np.cos(begin)
        q = np.where(released, B + sigma, A * np.sin(begin))
        a0 = np.where(released, 0.0, q - B - sigma)
        h = end - begin
        versed, lag, double = lags(h)
        velocity = p * versed - q * lag + a0 * h
        rise = p * lag - q * double + 0.5 * a0 * h * h
        force = A * np.sin(end) - B
        gap = np.empty_like(rise)
        below = np.zeros_like(rise[:, 0])
        for i, s in enumerate(self.slides):
            below = below + rise[:, i]
            gap[:, i] = below
            if s.lands:
                below = np.zeros_like(below)
        return Motion(begin, h, a0, sigma, velocity, gap, force)

    def equations(self, u: np.ndarray) -> np.ndarray:
        """Return the residuals of the S + 1 equations, (m, S + 1). They are 0 on the curve."""
        found = self.motion(u)
        lands = np.array([s.lands for s in self.slides])
        rows = np.where(lands, found.gap, found.velocity)
        return np.concatenate([rows, self.condition(found)[:, None]], axis=1)

    def condition(self, found: Motion) -> np.ndarray:
        """Return the quantity that is zero at the bifurcation, (m,)."""
        if self.kind == GRAZING:
            return found.gap[:, self.critical]
        if self.kind == BORDER_COLLISION:
            return found.force[:, self.critical] - 1.0
        if self.kind == STICK:
            return found.force[:, self.critical] + found.sigma[self.critical]
        moments, speeds = self.multiplier(found)
        return moments + speeds if self.kind == DOUBLING else moments - speeds

    def multiplier(self, found: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Return (numerator, denominator), each (m,), of the derivative of the map over one period.

        They are separate because the quotient is infinite at an impact without speed (a grazing). The docstring of
        `flight` in flight.py derives the derivative for one flight.
        """
        above, below = np.ones_like(found.h[:, 0]), np.ones_like(found.h[:, 0])
        delay = moment = np.zeros_like(above)
        for i, s in enumerate(self.slides):
            if s.begun == FROM_STICK:
                delay = np.zeros_like(above)
            elif i == 0 or self.slides[i - 1].lands:
                delay, moment = np.ones_like(above), np.zeros_like(above)
            else:
                delay = delay * found.a0[:, i - 1] / (found.force[:, i - 1] - found.sigma[i - 1])
            moment = moment + delay * found.a0[:, i] * found.h[:, i]
            if s.lands:
                above, below = above * moment, below * found.velocity[:, i]
        return above, below

    def linearised(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (residuals, derivatives) of the equations at u, (S + 2,), with shapes (S + 1,) and (S + 1, S + 2)."""
        n = len(u)
        values = self.equations(u + 1j * TINY * np.eye(n + 1, n))
        return values[-1].real, values[:-1].imag.T / TINY

    @np.errstate(invalid="ignore")
    def margins(self, u: np.ndarray) -> list[Margin]:
        """Return the margins at u, except that of the condition itself. They are NaN if the motion does not exist."""
        found = self.motion(u[None, :])
        h, velocity, gap, force = (row[0].tolist() for row in (found.h, found.velocity, found.gap, found.force))
        A, B = u[-2:].tolist()
        margins = [Margin("onset", A - 1.0 - B)]
        last = len(self.slides) - 1
        for i, s in enumerate(self.slides):
            margins.append(Margin(STICK, h[i]))
            here = self.critical == i
            ends = i == last and self.rests
            if s.lands:
                margins.append(Margin(GRAZING, -velocity[i]))
                if not (here and self.kind == BORDER_COLLISION):
                    margins.append(Margin(BORDER_COLLISION, 1.0 - force[i] if ends else force[i] - 1.0))
                continue
            if s.falls and not (here and self.kind == GRAZING):
                margins.append(Margin(GRAZING, gap[i]))
            if here and self.kind == STICK:
                continue
            if ends:
                margins.append(Margin(BORDER_COLLISION, 1.0 - force[i]))
                continue
            side = force[i] if s.falls else -force[i]  # above 1 the direction reverses, below 1 the mass sticks
            sticks = self.slides[(i + 1) % (last + 1)].begun == FROM_STICK
            margins.append(Margin(STICK, 1.0 - side if sticks else side - 1.0))
        if self.doubled:
            half = len(self.slides) // 2  # the first half begins at the smaller of the two launch phases
            margins.append(Margin(DOUBLING, float(u[half - 1] + 0.5 * TWO_PI * self.period - u[last])))
        return margins


class Motion(NamedTuple):
    """The S slides of m prescribed motions.

    begin, h, a0 : time of the beginning, duration, and acceleration at the beginning, each (m, S).
    sigma : direction of the slide, 1 up and -1 down, (S,).
    velocity, gap, force : velocity ξ', gap ξ and force H at the end, each (m, S).
    """

    begin: np.ndarray
    h: np.ndarray
    a0: np.ndarray
    sigma: np.ndarray
    velocity: np.ndarray
    gap: np.ndarray
    force: np.ndarray


def lags(h: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (1 - cos h, h - sin h, h²/2 - 1 + cos h), without cancellation for small h."""
    small = np.abs(h) < 1.0
    y = -(np.where(small, h, 0.0) ** 2)
    odd = even = np.zeros_like(h)
    for k in reversed(SERIES):
        odd = (1.0 + odd) * y / ((2 * k + 2) * (2 * k + 3))
        even = (1.0 + even) * y / ((2 * k + 3) * (2 * k + 4))
    versed = 2.0 * np.sin(0.5 * h) ** 2
    lag = np.where(small, -y * h / 6.0 * (1.0 + odd), h - np.sin(h))
    double = np.where(small, y * y / 24.0 * (1.0 + even), 0.5 * h * h - versed)
    return versed, lag, double


def newton(condition: Condition, u: np.ndarray, row: np.ndarray, value: float) -> np.ndarray | None:
    """Return the point of the curve near u at which row · u = value, by Newton's method; None if it is not found."""
    rate = math.inf
    for _ in range(MOST_STEPS):
        if not u[-2] > 1.0 + u[-1]:
            return None
        residual, slopes = condition.linearised(u)
        matrix = np.vstack([slopes, row])
        try:
            step = np.linalg.solve(matrix, np.append(residual, row @ u - value))
        except np.linalg.LinAlgError:
            return None
        u = u - step
        size = float(np.max(np.abs(step)))
        if not size < 1.0:
            return None
        if size < CONVERGED * max(1.0, float(np.max(np.abs(u)))) or (size < 1e-9 and size >= 0.5 * rate):
            return u
        rate = size
    return u if rate < 1e-9 else None
