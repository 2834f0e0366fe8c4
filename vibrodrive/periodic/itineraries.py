"""Itineraries of several flights, and the intervals of launch phases with the same itinerary.

Terms (for flight, launch and window see flight.py):

* a *letter* is one state (UP, DOWN, STICK, REST, IMPACT), or the mark WINDOW_PASSED,
* the *word* of a flight is the sequence of its states, stored as a number with one digit for each letter
  (flight.LETTERS, flight.WORDS),
* the *itinerary* of a launch phase ψ is the sequence of the words of its flights. After each impact the itinerary also
  contains one mark for each window that has passed, and REST if the mass rests before the next launch,
* a *cell* is an interval of launch phases with the same itinerary.

Each decision in an itinerary changes at most once as ψ grows, as long as the earlier decisions are unchanged. flight.py
proves this for one flight. The same is true for several flights in a row, because a composition of monotone maps is
monotone. So the phases with one itinerary form an interval: if two phases have the same itinerary, all phases between
them have this itinerary, too. Therefore bisection between any two phases with different itineraries finds every
boundary, to neighbouring floats, without sampling. Bisection can miss only an interval that contains no float.
"""

from typing import NamedTuple

import numpy as np

from vibrodrive.jit.compile import array, jit
from vibrodrive.jit.slices import in_slices
from vibrodrive.kernels.codes import IMPACT, REST
from vibrodrive.kernels.release import release_up
from vibrodrive.periodic.flight import NO_WORD, append, flight, window_end

FLYING, RESTS, LOST = 0, 1, 2  # after the last flight: launch without a rest; rest; no impact found

WINDOW_PASSED = 6  # additional letter of an itinerary: a window has passed

NO_SLIDES = np.empty((0, 3))  # argument for flights whose slides are not recorded

DEPTH = 128  # number of rows of the stack of pieces, enough to halve any interval down to neighbouring floats


class Pieces(NamedTuple):
    """Work arrays of `split`.

    stack : ends of the pieces that are not searched yet, (DEPTH, 2).
    names : itineraries at these ends, (DEPTH, 2).
    no_slides : an empty array (0, 3), for flights whose slides are not recorded.
    """

    stack: np.ndarray
    names: np.ndarray
    no_slides: np.ndarray


FEW = 64  # number of steps of the first slice (jit/slices.py); for long flights (B = 0) a step may take milliseconds


@jit(like=(0.0, 0, 0.0, 0.0, 0, NO_SLIDES), _nrt=False)
def flights(psi, n, A, B, horizon, slides):
    """Compute n flights in a row, or fewer if the mass rests or if the flights exceed `horizon` excitation periods.

    Return (itinerary, periods, phase, slope, flown, fate, count):

    itinerary : the itinerary as a number
    periods, phase : time of the last impact, or of the launch after a rest: 2π·periods + phase from the beginning of
        the period of the first launch
    slope : d(time of the last impact)/dψ, 0 after a rest
    flown : number of flights computed
    fate : FLYING, RESTS or LOST
    count : number of slides of these flights
    """
    up, _ = release_up(A, B)
    end = window_end(up)
    itinerary = np.int64(NO_WORD)  # for a literal, `flight` would be compiled again
    periods = 0
    slope = 1.0
    count = 0
    for i in range(n):
        k, phase, _, rate, itinerary, more = flight(psi, A, B, horizon - periods, itinerary, slides[count:])
        if k < 0 or periods + k > horizon:
            return itinerary, periods, psi, slope, i + 1, LOST, count
        count += more
        slope *= rate
        psi = phase
        rests = phase <= up or phase >= end
        k += 1 if phase >= end else 0
        periods += k
        itinerary = append(itinerary, IMPACT + 1)
        for _ in range(k):
            itinerary = append(itinerary, WINDOW_PASSED)
        if rests:
            return append(itinerary, REST + 1), periods, up, 0.0, i + 1, RESTS, count
    return itinerary, periods, psi, slope, n, FLYING, count


_EXAMPLE = (0.0, 0.0), 0, 0.0, 0.0, 0, 0, array(1, np.int64), array(2), Pieces(array(2), array(2, np.int64), NO_SLIDES)


@jit(like=_EXAMPLE, _nrt=False)
def split(whole, n, A, B, horizon, steps, under_way, ends, pieces):
    """Divide the interval `whole` = (low, high) into cells of n flights.

    One call halves at most `steps` pieces. Return True if the search is complete. Otherwise the next call continues the
    search. `ends`, float64 (rows, 2), receives the first and the last float of each cell. `under_way`, int64 (2,),
    contains the number of pieces on the stack (-1 before the first call) and the number of cells found. If only one row
    of `ends` is free, the caller must enlarge `ends` before the next call.
    """
    low, high = whole
    stack, names, no_slides = pieces
    top, found = under_way[0], under_way[1]
    if top < 0:
        stack[0, 0] = low
        stack[0, 1] = high
        names[0, 0] = flights(low, n, A, B, horizon, no_slides)[0]
        names[0, 1] = flights(high, n, A, B, horizon, no_slides)[0]
        top = 1
        ends[0, 0] = low
    for _ in range(steps):
        if top == 0 or found >= len(ends) - 1:
            break
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        left, right = names[top, 0], names[top, 1]
        if left == right:
            continue
        middle = 0.5 * (a + b)
        if middle <= a or middle >= b:
            ends[found, 1] = a
            found += 1
            ends[found, 0] = b
            continue
        name = flights(middle, n, A, B, horizon, no_slides)[0]
        stack[top, 0] = middle
        stack[top, 1] = b
        names[top, 0] = name
        names[top, 1] = right
        stack[top + 1, 0] = a
        stack[top + 1, 1] = middle
        names[top + 1, 0] = left
        names[top + 1, 1] = name
        top += 2
    if top == 0:
        ends[found, 1] = high
        found += 1
        top = -1
    under_way[0], under_way[1] = top, found
    return top < 0


def intervals(low: float, high: float, n: int, A: float, B: float, horizon: int) -> list[list[float]]:
    """Return the first and the last float of each cell of n flights in [low, high]: lists [first, last], ascending."""
    ends, pieces = np.empty((64, 2)), Pieces(np.empty((DEPTH, 2)), np.empty((DEPTH, 2), dtype=np.int64), NO_SLIDES)
    under_way = np.array([-1, 0])

    def advance(steps: int) -> bool:
        nonlocal ends
        if under_way[1] >= len(ends) - 1:
            ends = np.concatenate([ends, np.empty((3 * len(ends), 2))])
        return split((low, high), n, A, B, horizon, steps, under_way, ends, pieces)

    in_slices(advance, first=FEW)
    return ends[: under_way[1]].tolist()
