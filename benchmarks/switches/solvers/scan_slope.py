"""Hand-written Numba: as scan + Newton, but each step is divided where g′ changes its sign.

So a pair of zeros within a step is found, as long as g has one extremum in the step. A slide from rest begins with
g = 0, and g rises there, although the computed g′ may be 0 or, by rounding, less.
"""

from functools import partial

from benchmarks.switches import sums
from benchmarks.switches.loop import event_loop
from benchmarks.switches.model import DOWN, STICK, UP, constants, gap, jit
from benchmarks.switches.solvers.scan_newton import newton, newton_in, slope, value

NAME, PACKAGE = "scan of g and g′", None
SETTINGS = [{"step": step} for step in (0.1, 0.03, 0.01, 0.003, 0.001, 3e-4, 1e-4)]


@jit
def extremum(slope, function, low, high):
    """Return the point at which `slope` changes its sign between low and high, by bisection."""
    rises = slope(*function, high) > 0.0
    while low < 0.5 * (low + high) < high:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (slope(*function, middle) > 0.0) == rises else (middle, high)
    return high


@jit
def first_zero(which, point, s, low, high, from_rest):
    """Return the first zero of a switching function in a step, or a time after the step. It is positive before."""
    function = which, point, s
    rises, rises_then = from_rest or slope(which, point, s, low) >= 0.0, slope(which, point, s, high) > 0.0
    if rises != rises_then:
        middle = extremum(slope, function, low, high)
        if value(which, point, s, middle) <= 0.0:
            return newton(value, slope, function, low, middle)
        low = middle
    return newton(value, slope, function, low, high) if value(which, point, s, high) <= 0.0 else 2.0 * high - low + 1.0


@jit
def locate(point, setting, state, t0, xi, dxi, end):
    low, k = t0, 0
    first = 0 if state in (UP, DOWN) else 2
    s = constants(point, 1.0 if state == UP else -1.0, t0, xi, dxi)
    while low <= end:
        k += 1
        high = t0 + k * setting[0]
        at = first_zero(first, point, s, low, high, k == 1 and first == 0 and dxi == 0.0)
        if state == STICK:
            at = min(at, first_zero(3, point, s, low, high, False))
        until = min(at, high)
        if state == DOWN and value(1, point, s, until) <= 0.0:  # ξ decreases up to the reversal
            return newton(value, slope, (1, point, s), low, until), True, 0.0
        if at <= high:
            return at, False, xi if first == 2 else gap(point, s, at)
        low = high
    return low, False, xi


events = event_loop(locate, compiled=True)


@jit
def search(f, T, step, low, high, departure):
    """Fill `low` and `high` with intervals in (0, T] in which g is monotone and changes its sign. Return their number.

    The intervals are the steps of a grid, divided at the extremum of g if g′ has another sign at the other end.
    `departure` is the sign of g just after 0.
    """
    count, k, at, sign = 0, 0, 0.0, departure
    while at < T and count < len(low):
        k += 1
        end = min(k * step, T)
        while at < end and count < len(low):
            to = end
            from_zero = at == 0.0 and sums.value(f, 0.0) == 0.0
            if (departure if from_zero else sums.slope(f, at)) * sums.slope(f, end) < 0.0:
                to = extremum(sums.slope, (f,), at, end)
            g = sums.value(f, to)
            if g * sign <= 0.0:
                low[count], high[count] = at, to
                count += 1
            if g != 0.0:
                sign = 1.0 if g > 0.0 else -1.0
            at = to
    return count


def zeros(function, T, step):
    """Return the zeros of `function` in (0, T] on a grid of the step `step`."""
    departure = sums.departure(function)
    return newton_in(function, sums.brackets(function, T, step, partial(search, departure=departure)))
