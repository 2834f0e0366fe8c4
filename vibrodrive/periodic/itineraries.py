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

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from vibrodrive.jit.compile import array, inline, jit, part
from vibrodrive.jit.slices import in_slices
from vibrodrive.kernels.codes import IMPACT, REST
from vibrodrive.kernels.release import release_up
from vibrodrive.periodic.flight import NO_WORD, append, flight, window_end

FLYING, RESTS, LOST = 0, 1, 2  # after the last flight: launch without a rest; rest; no impact found
OTHER = 3  # not one of the itineraries that are looked for

WINDOW_PASSED = 6  # additional letter of an itinerary: a window has passed

NO_SLIDES = np.empty((0, 3))  # argument for flights whose slides are not recorded

DEPTH = 128  # number of rows of the stack of pieces, enough to halve any interval down to neighbouring floats


FEW = 64  # number of steps of the first slice (jit/slices.py); for long flights (B = 0) a step may take milliseconds
SHORT = 10_000  # the same for `split`, times the periods of the longest flights


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


LOW, HIGH, FLOWN, PERIODS, FATE = range(5)
"""Columns of cells, float64 (cells, 5): first and last launch phase, number of flights, number of excitation periods of
these flights, and fate. Rows are ordered by the number of flights and by the launch phase."""

PIECE = np.dtype((np.record, [("low", "f8"), ("high", "f8"), ("left", "i8"), ("right", "i8")]))  # with attributes
"""A piece of a cell that is not searched yet: its ends, and the itineraries at its ends"""


@inline
def put(stack, row, low, high, left, right):
    """Write a piece to a row of the stack."""
    stack[row].low, stack[row].high, stack[row].left, stack[row].right = low, high, left, right


@part
def close(high, row, n, A, B, horizon, only, cells):
    """End the cell of n flights in this row at the launch phase `high`. Return the next row."""
    itinerary, periods, _, _, _, fate, _ = flights(cells[row, LOW], n, A, B, horizon, cells[:0])
    cells[row, HIGH], cells[row, FLOWN], cells[row, PERIODS] = high, n, periods
    cells[row, FATE] = fate if len(only) == 0 or itinerary == only[n - 1] else OTHER
    return row + 1


_EXAMPLE = 0, 0.0, 0.0, 0, array(1, np.int64), 0, (0, 0, 0), array(2), array(1, PIECE)


@jit(like=_EXAMPLE, _nrt=False)
def split(most, A, B, horizon, only, steps, under_way, cells, stack):
    """Divide the first of the `cells` into cells of one flight, these into cells of two, and so on to `most` flights.

    One call takes at most `steps` steps: it begins a cell, or halves a piece. Only FLYING cells are divided. If `only`,
    int64 (most,), is not empty, cells whose itineraries of the first 1, 2, … flights are not those in `only` become
    OTHER. `stack` has DEPTH rows. `under_way` contains the number of pieces on the stack, the number of cells found,
    and the row of the cell that is divided: 0, 1, -1 before the first call. Return the same for the next call. The
    search is complete if the row is the number of cells. If only one row of `cells` is free, the caller must enlarge
    them before the next call.
    """
    no_slides = cells[:0]
    top, found, whole = under_way
    for _ in range(steps):
        if found >= len(cells) - 1 or whole == found:
            break
        if top == 0:
            whole += 1
            if whole < found and cells[whole, FATE] == FLYING and cells[whole, FLOWN] < most:
                a, b, n = cells[whole, LOW], cells[whole, HIGH], int(cells[whole, FLOWN]) + 1
                put(
                    stack,
                    0,
                    a,
                    b,
                    flights(a, n, A, B, horizon, no_slides)[0],
                    flights(b, n, A, B, horizon, no_slides)[0],
                )
                top = 1
                cells[found, LOW] = a
            continue
        top -= 1
        n = int(cells[whole, FLOWN]) + 1
        a, b, left, right = stack[top].low, stack[top].high, stack[top].left, stack[top].right
        middle = 0.5 * (a + b)
        if left != right and a < middle < b:
            name = flights(middle, n, A, B, horizon, no_slides)[0]
            put(stack, top, middle, b, name, right)
            put(stack, top + 1, a, middle, left, name)
            top += 2
            continue
        if left != right:
            found = close(a, found, n, A, B, horizon, only, cells)
            cells[found, LOW] = b
        if top == 0:
            found = close(cells[whole, HIGH], found, n, A, B, horizon, only, cells)
    return top, found, whole


def cells_of(
    whole: tuple[float, float],
    most: int,
    A: float,
    B: float,
    horizon: int,
    only: Sequence[int] = (),
    limit: float = math.inf,
) -> np.ndarray:
    """Return the cells of 1 to `most` flights in the interval `whole` of launch phases, after a row for `whole`.

    If `only` is given, those cells are OTHER whose itineraries of the first 1, 2, … flights are not those in `only`.
    The search ends early if more than `limit` cells are FLYING.
    """
    cells, stack, wanted = np.zeros((64, 5)), np.empty(DEPTH, PIECE), np.array(only, np.int64)
    cells[0, :2] = whole
    under_way = 0, 1, -1

    def advance(steps: int) -> bool:
        nonlocal cells, under_way
        if under_way[1] >= len(cells) - 1:
            cells = enlarged(cells)
        _, found, row = under_way = split(most, A, B, horizon, wanted, steps, under_way, cells, stack)
        return row == found or flying(cells[:found]) > limit

    in_slices(advance, first=SHORT // horizon)
    return cells[: under_way[1]]


def flying(cells: np.ndarray) -> int:
    """Return the number of FLYING cells of one flight or more."""
    return int(np.count_nonzero(cells[1:, FATE] == FLYING))


def enlarged(rows: np.ndarray) -> np.ndarray:
    """Return an array of four times the length that begins with the same rows."""
    return np.resize(rows, (4 * len(rows), rows.shape[1]))
