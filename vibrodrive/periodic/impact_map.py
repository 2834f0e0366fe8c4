"""The impact-phase map: at ε = 0 the motion after an ideally plastic impact depends only on the phase of the impact.

So the motion is a map of the circle, phase of an impact ↦ phase of the next impact. The map is constant over the phases
at which a rest follows the impact. The other phases form the window φ_up < φ < π - φ_up, in which H > 1. In the window
the map falls on every branch between two breakpoints, the phases at which the map is not smooth. The derivative of the
map is continuous at a phase at which a sticking appears or vanishes. The derivative is also continuous, and 0, at φ_up.
The map jumps at π - φ_up and at each launch phase of a flight that grazes the obstacle.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from vibrodrive.jit.slices import in_slices
from vibrodrive.jit.trig import HALF_PI, PI
from vibrodrive.kernels.release import moves
from vibrodrive.model.keywords import Machine, takes
from vibrodrive.model.parameters import bad, check, real_array
from vibrodrive.model.plan import plan_motion
from vibrodrive.model.states import State
from vibrodrive.periodic.flight import FROM_STICK, NO_WORD, flight, impacts, launch_after, launch_window
from vibrodrive.periodic.itineraries import FEW, cells_of

HORIZON = 10_000  # longest flight that is computed, in excitation periods; for a small B flights may be longer

LANDINGS = 100
"""Longest duration, in excitation periods, of flights whose breakpoints are listed by default. Each possible number of
periods gives one breakpoint, and in total there are about 0.1/B breakpoints."""

LARGEST_PHASE = 1e12  # a larger double has too few digits for the phase within a period
PHASES = f"a number between {-LARGEST_PHASE:g} and {LARGEST_PHASE:g}, or an array of such numbers"

SLIDES_NAMED = 16  # number of slides in the word of a flight that never lands


def states(psi: float, A: float, B: float) -> list[State]:
    """Return the states of the flight with a launch at `psi`, from UP to IMPACT.

    For a flight that never lands, return the states of its first SLIDES_NAMED slides.
    """
    slides = np.empty((SLIDES_NAMED, 3))
    k, *_, count = flight(psi, A, B, HORIZON, NO_WORD, slides)
    if k >= 0 and count > SLIDES_NAMED:
        slides = np.empty((count, 3))
        flight(psi, A, B, HORIZON, NO_WORD, slides)
    word: list[State] = []
    falling = True
    for tau, _, begun in slides[:count].tolist():
        if begun == FROM_STICK:
            word.append(State.STICK)
            falling = tau > 0.5 * PI
        else:
            falling = not falling
        word.append(State.DOWN if falling else State.UP)
    return [*word, State.IMPACT] if k >= 0 else word


def spell(word: list[State]) -> str:
    """Return a word as text, such as "REST UP STICK DOWN IMPACT"."""
    return " ".join(s.name for s in word)


@dataclass(frozen=True, eq=False)
class Impacts:
    """The next impact after each impact at a phase in `start`. All arrays have the shape of `start`.

    phase : phase of the next impact, in [0, 2π) rad; NaN if there is no next impact.
    periods : number of excitation periods from one impact to the next, floor(τ_next / 2π) - floor(τ / 2π); -1 if there
        is no next impact.
    speed : dimensionless speed |ξ'| of the next impact.
    derivative : exact derivative d phase / d start, from the closed form. It is 0 if a rest follows the impact.
    word : states from one impact to the next, as text.
    """

    start: np.ndarray
    phase: np.ndarray
    periods: np.ndarray
    speed: np.ndarray
    derivative: np.ndarray
    code: np.ndarray = field(repr=False)
    A: float = field(repr=False)
    B: float = field(repr=False)

    @functools.cached_property
    def word(self) -> np.ndarray:
        _, first, inverse = np.unique(self.code, return_index=True, return_inverse=True)
        texts = [_word_from(phi, self.A, self.B) for phi in np.ravel(self.start)[first]]
        return np.array(texts)[inverse].reshape(np.shape(self.start))


def _word_from(phi: float, A: float, B: float) -> str:
    if not moves(A, B):
        return State.REST.name
    psi, rests = launch_after(phi, A, B)
    return spell([State.REST] * int(rests) + states(psi, A, B))


class ImpactMap:
    """The map from the phase φ of an impact to the next impact, for one A and B.

    window : both ends of the window. After an impact between these two phases the mass leaves the obstacle without a
        rest. For A <= 1 + B the mass never leaves the obstacle, and the two phases are equal.
    breakpoints : the phases at which the map is not smooth, ascending, including both ends of the window. Breakpoints
        of flights of more than LANDINGS excitation periods are left out.
    kinds : the kind of each breakpoint. "rest": the rest after the impact appears or vanishes. "grazing": the flight
        just touches the obstacle, and the map jumps. "stick": a sticking during the flight appears or vanishes.
    words : the states of the flights between each two neighbouring breakpoints, as text.
    """

    def __init__(self, A: float, B: float = 0.1) -> None:
        self.A = check("A", A)
        self.B = check("B", B)
        self.moves = moves(self.A, self.B)
        nothing = HALF_PI, HALF_PI, math.nan
        up, end, touching = launch_window(self.A, self.B) if self.moves else nothing
        self.window: tuple[float, float] = up, end
        self.touching: float = touching  # for B = 0 the launch phase of the flight that touches without speed

    def __call__(self, phi: ArrayLike) -> Impacts:
        """Return the next impact after each impact at a phase in `phi` (rad), a number or an array of any shape.

        Raises
        ------
        TypeError, ValueError
            if a phase is not a number, is NaN, or is not between -1e12 and 1e12.
        """
        start = real_array("phi", phi, PHASES)
        if start.size and not (start.min() >= -LARGEST_PHASE and start.max() <= LARGEST_PHASE):  # true for NaN, too
            raise ValueError(bad("phi", start[~(abs(start) <= LARGEST_PHASE)][0].item(), PHASES))
        flat = np.ascontiguousarray(start).reshape(-1)
        n = flat.size
        motions, counts = np.full((n, 3), np.nan), np.tile([-1, 0], (n, 1))
        if self.moves:
            done = 0

            def advance(steps: int) -> bool:
                nonlocal done
                part = slice(done, done + steps)
                impacts(flat[part], self.A, self.B, HORIZON, motions[part], counts[part])
                done += steps
                return done >= n

            in_slices(advance, first=FEW)
        columns = np.ascontiguousarray(motions.T), np.ascontiguousarray(counts.T)
        (phase, speed, slope), (periods, code) = (array.reshape(-1, *start.shape) for array in columns)
        return Impacts(start, phase, periods, speed, slope, code, self.A, self.B)

    def __repr__(self) -> str:
        return f"ImpactMap(A={self.A!r}, B={self.B!r})"

    @functools.cached_property
    def _pieces(self) -> tuple[np.ndarray, tuple[str, ...], tuple[str, ...]]:
        return self.pieces(LANDINGS)

    def pieces(self, horizon: int) -> tuple[np.ndarray, tuple[str, ...], tuple[str, ...]]:
        """Return the attributes (breakpoints, kinds, words) for flights of up to `horizon` excitation periods."""
        if not self.moves:
            return np.empty(0), (), ()
        up, end = self.window
        low, high = math.nextafter(up, end), math.nextafter(end, up)
        cells = cells_of((low, high), 1, self.A, self.B, horizon)[1:, :2].tolist()
        phases, kinds, words = [up], ["rest"], [_word_from(low, self.A, self.B)]
        for (_, last), (first, _) in itertools.pairwise(cells):
            before, after = (states(psi, self.A, self.B) for psi in (last, first))
            if before != after:  # otherwise only the period of the impact differs, and the map is smooth
                phases.append(first)
                kinds.append(kind_of_change(before, after))
                words.append(spell(after))
        return np.array([*phases, end]), (*kinds, "rest"), tuple(words)

    @property
    def breakpoints(self) -> np.ndarray:
        return self._pieces[0]

    @property
    def kinds(self) -> tuple[str, ...]:
        return self._pieces[1]

    @property
    def words(self) -> tuple[str, ...]:
        """One word for each interval between two breakpoints."""
        return self._pieces[2]


def kind_of_change(before: list[State], after: list[State]) -> str:
    """Return the reason why the words of two neighbouring flights differ.

    The reason is "grazing" if one flight lands where the other flight continues, and "stick" otherwise.
    """
    first, second = next((a, b) for a, b in zip(before, after, strict=False) if a != b)
    return "grazing" if State.IMPACT in (first, second) else "stick"


@takes(Machine[float])
def impact_map(
    written: Mapping[str, Any],
    /,
    A: float | None = None,
    B: float = 0.1,
    **quantities: Unpack[Machine[float]],
) -> ImpactMap:
    """Return the impact-phase map at ε = 0, which maps the phase of an impact to the phase of the next impact.

    Parameters
    ----------
    A : float
        excitation amplitude, dimensionless. Required without a scene.
    B : float
        tan α / μ, dimensionless.
    **parameters

    Returns
    -------
    ImpactMap
        a function whose argument is a phase in rad, or an array of phases of any shape. Its result has the following
        arrays of the same shape.
        `phase` is the phase of the next impact in rad.
        `periods` is the number of excitation periods from one impact to the next.
        `speed` is the dimensionless speed of the next impact.
        `derivative` is the derivative of the map.
        `word` gives the states from one impact to the next as text.

    Raises
    ------
    TypeError, ValueError
        if A or B is not a real number, or is NaN, infinite or negative.

    Examples
    --------
    After an impact at phase 0 the mass rests first. After an impact at phase 1 the mass leaves immediately:

    >>> import vibrodrive as vd
    >>> following = vd.impact_map(3.04)([0.0, 1.0])
    >>> following.phase.round(4), following.periods
    (array([0.5184, 0.2512]), array([2, 1]))
    >>> list(map(str, following.word))
    ['REST UP DOWN UP DOWN IMPACT', 'UP DOWN IMPACT']
    """
    plan = plan_motion(written)
    return ImpactMap(plan.scalars["A"], plan.scalars["B"])
