"""Itineraries of several flights, and the intervals of launch phases that share one.

An itinerary is the words of consecutive flights and, after each impact, how many windows have passed and
whether the mass rests before the next launch. Each of these decisions is monotone in ψ while the ones before
it stand (flight.py; composed flights are monotone, too). So the phases with one itinerary form an
interval, and equal itineraries at two phases mean the same itinerary between them: bisection wherever two
ends differ finds every boundary, to neighbouring floats, without any sampling. What can be missed is an
interval without a float in it.
"""

from __future__ import annotations

import numpy as np

from vibrodrive.jit.compile import jit
from vibrodrive.jit.slices import in_slices
from vibrodrive.kernels.release import release_up
from vibrodrive.periodic.flight import IMPACT, NO_WORD, REST, append, flight, window_end

FLYING, RESTS, LOST = 0, 1, 2  # after the last flight: launched at once, at rest, or given up

WINDOW = 6  # a letter of an itinerary beside the states: a window has passed

NOTHING = np.empty((0, 3))  # for flights whose slides are not recorded

DEPTH = 128  # halvings of an interval: down to neighbouring floats, wherever it lies

FEW = 64  # steps of the first slice: one may take milliseconds, where flights are long (B = 0)


@jit(_nrt=False)
def flights(psi, n, A, B, horizon, slides):
    """Up to n flights in a row, ended early by a rest or by the horizon (excitation periods in all).

    Returns
    -------
    itinerary : int
        the words of the flights and the places of their impacts.
    periods, phase : int, float
        the last impact; after a rest the launch out of it; from the period of the first launch.
    slope : float
        d(last impact time)/dψ; 0 after a rest.
    flown, fate : int, int
        number of flights, and FLYING, RESTS or LOST.
    first : int
        number of slides.
    """
    up, _ = release_up(A, B)
    end = window_end(up)
    itinerary = np.int64(NO_WORD)  # a literal would compile another specialisation
    periods = 0
    slope = 1.0
    first = 0
    for i in range(n):
        k, phase, _, rate, itinerary, count = flight(psi, A, B, horizon - periods, itinerary, slides[first:])
        if k < 0 or periods + k > horizon:
            return itinerary, periods, psi, slope, i + 1, LOST, first
        first += count
        slope *= rate
        psi = phase
        rests = phase <= up or phase >= end
        k += 1 if phase >= end else 0
        periods += k
        itinerary = append(itinerary, IMPACT + 1)
        for _ in range(k):
            itinerary = append(itinerary, WINDOW)
        if rests:
            return append(itinerary, REST + 1), periods, up, 0.0, i + 1, RESTS, first
    return itinerary, periods, psi, slope, n, FLYING, first


@jit(_nrt=False)
def split(low, high, n, A, B, horizon, steps, under_way, ends, stack, names, nothing):
    """Cut [low, high] into the intervals of one itinerary of n flights, as far as `steps` halvings go.

    `ends` float64 (rows, 2) receives the first and last float of each; `stack` float64 and `names` int64
    (DEPTH, 2) are memory to work in, `nothing` float64 (0, 3). `under_way` int64 (2,) are the pieces on the stack, -1
    at first, and the intervals found. Returns whether all are; if not, the next call goes on: with more rows, if all
    but one are full.
    """
    top, found = under_way[0], under_way[1]
    if top < 0:
        stack[0, 0] = low
        stack[0, 1] = high
        names[0, 0] = flights(low, n, A, B, horizon, nothing)[0]
        names[0, 1] = flights(high, n, A, B, horizon, nothing)[0]
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
        name = flights(middle, n, A, B, horizon, nothing)[0]
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
    """[first, last] float of each interval of [low, high] with one itinerary of n flights, ascending."""
    ends, stack, names = np.empty((64, 2)), np.empty((DEPTH, 2)), np.empty((DEPTH, 2), dtype=np.int64)
    under_way = np.array([-1, 0])

    def advance(steps: int) -> bool:
        nonlocal ends
        if under_way[1] >= len(ends) - 1:
            ends = np.concatenate([ends, np.empty((3 * len(ends), 2))])
        return split(low, high, n, A, B, horizon, steps, under_way, ends, stack, names, NOTHING)

    in_slices(advance, first=FEW)
    return ends[: under_way[1]].tolist()
