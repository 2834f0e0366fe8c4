"""Hand-written Numba without the closed form: RK4 with fixed steps, a check of signs, and bisection of the last
step."""

import numpy as np

from benchmarks.switches.loop import event_loop
from benchmarks.switches.model import DOWN, STICK, UP, force, jit
from benchmarks.switches.sums import slope, value

NAME, PACKAGE = "RK4 + bisection", None
SETTINGS = [{"step": step} for step in (0.1, 0.03, 0.01, 0.003, 0.001, 3e-4, 1e-4)]


@jit
def rk4(point, sign, tau, xi, dxi, h):
    """Return ξ, ξ' after one step of ξ'' = H(τ) − sign."""
    f0, fm, f1 = force(point, tau) - sign, force(point, tau + 0.5 * h) - sign, force(point, tau + h) - sign
    # the acceleration depends on time only, so the two middle stages have the same slope
    return xi + h * dxi + h * h / 6.0 * (f0 + 2.0 * fm), dxi + h / 6.0 * (f0 + 4.0 * fm + f1)


@jit
def step_of(point, state, tau, xi, dxi, h):
    """Return (True if the state ends within a step of length h, ξ, ξ' after this step)."""
    if state in (UP, DOWN):
        xi, dxi = rk4(point, 1.0 if state == UP else -1.0, tau, xi, dxi, h)
        return (dxi <= 0.0 if state == UP else xi <= 0.0 or dxi >= 0.0), xi, dxi
    level = force(point, tau + h)
    return level >= 1.0 or (state == STICK and level <= -1.0), xi, dxi


@jit
def locate(point, setting, state, tau, xi, dxi, end):
    while tau <= end:
        ended, x, v = step_of(point, state, tau, xi, dxi, setting[0])
        if ended:
            low, high = 0.0, setting[0]
            while high - low > 1e-13:
                middle = 0.5 * (low + high)
                ended, _, _ = step_of(point, state, tau, xi, dxi, middle)
                low, high = (low, middle) if ended else (middle, high)
            _, x, v = step_of(point, state, tau, xi, dxi, high)
            return tau + high, state == DOWN and x <= 0.0, x
        tau, xi, dxi = tau + setting[0], x, v
    return tau, False, xi


events = event_loop(locate, compiled=True)


@jit
def integrate(f, T, step, found):
    """Fill `found` with the zeros of g, and return their number. g is computed by integration of g' from g(0)."""
    count, k, g, tau = 0, 0, value(f, 0.0), 0.0
    while tau < T and count < len(found):
        k += 1
        h = min(k * step, T) - tau
        ahead = g + h / 6.0 * (slope(f, tau) + 4.0 * slope(f, tau + 0.5 * h) + slope(f, tau + h))
        if g * ahead < 0.0 or (ahead == 0.0 and g != 0.0):
            low, high = 0.0, h
            while high - low > 1e-13:
                middle = 0.5 * (low + high)
                at = g + middle / 6.0 * (slope(f, tau) + 4.0 * slope(f, tau + 0.5 * middle) + slope(f, tau + middle))
                low, high = (middle, high) if g * at > 0.0 else (low, middle)
            found[count] = tau + high
            count += 1
        g, tau = ahead, min(k * step, T)
    return count


def zeros(function, T, step):
    """Return the zeros of `function` in (0, T] by integration with this step."""
    found = np.empty(100_000)
    return found[: integrate(function, T, step, found)].tolist()
