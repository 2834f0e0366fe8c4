"""Functions of level 0: g(τ) = c0 + c1 τ + c2 τ² + a sin(τ + α) + b sin(ητ + β)."""

import math
from typing import NamedTuple

import numpy as np

from benchmarks.switches.model import jit


class Sum(NamedTuple):
    """Coefficients of ±g, with the names of a case. `sign` is 1 or −1."""

    c0: float
    c1: float
    c2: float
    a: float
    alpha: float
    b: float
    eta: float
    beta: float
    sign: float = 1.0


@jit
def value(f, tau):
    """Return ±g(τ)."""
    slow = f.c0 + (f.c1 + f.c2 * tau) * tau + f.a * math.sin(tau + f.alpha)
    return f.sign * (slow + f.b * math.sin(f.eta * tau + f.beta))


@jit
def slope(f, tau):
    """Return ±g'(τ)."""
    slow = f.c1 + 2.0 * f.c2 * tau + f.a * math.cos(tau + f.alpha)
    return f.sign * (slow + f.b * f.eta * math.cos(f.eta * tau + f.beta))


@jit
def bracket(f, T, step, low, high):
    """Fill `low` and `high` with the grid intervals in (0, T] in which g changes its sign. Return the number of
    intervals."""
    count, k, at, sign = 0, 0, 0.0, 0.0
    while at < T and count < len(low):
        k += 1
        ahead = min(k * step, T)
        g = value(f, ahead)
        if g * sign < 0.0 or (g == 0.0 and sign != 0.0):
            low[count], high[count] = at, ahead
            count += 1
        if g != 0.0:
            sign = 1.0 if g > 0.0 else -1.0
        at = ahead
    return count


def brackets(f, T, step, search=bracket, most=100_000):
    """Return the intervals (low, high) of a grid in which g changes its sign, as found by `search`."""
    low, high = np.empty(most), np.empty(most)
    count = search(f, T, step, low, high)
    return list(zip(low[:count].tolist(), high[:count].tolist(), strict=True))


def departure(f):
    """Return the sign of g just after τ = 0: the sign of g(0) or, if g(0) = 0, of the first nonzero derivative."""
    bend = f.sign * (2.0 * f.c2 - f.a * math.sin(f.alpha) - f.b * f.eta**2 * math.sin(f.beta))
    turn = -f.sign * (f.a * math.cos(f.alpha) + f.b * f.eta**3 * math.cos(f.beta))
    return math.copysign(1.0, next((g for g in (value(f, 0.0), slope(f, 0.0), bend, turn) if g != 0.0), 1.0))
