"""Hand-written Numba: closed form, a scan for the change of sign, Newton's method inside the bracket."""

from benchmarks.switches import sums
from benchmarks.switches.loop import event_loop
from benchmarks.switches.model import DOWN, STICK, UP, constants, force, force_rate, gap, jit, velocity

NAME, PACKAGE = "scan + Newton", None
SETTINGS = [{"step": step} for step in (0.1, 0.03, 0.01, 0.003, 0.001, 3e-4, 1e-4)]


@jit
def value(which, point, s, tau):
    """Return ±ξ', ξ, 1 − H or 1 + H for `which` = 0 to 3. This switching function is positive before the state ends."""
    if which == 0:
        return s[0] * velocity(point, s, tau)
    if which == 1:
        return gap(point, s, tau)
    return 1.0 - force(point, tau) if which == 2 else 1.0 + force(point, tau)


@jit
def slope(which, point, s, tau):
    """Return the derivative of `value` with respect to τ."""
    if which == 0:
        return s[0] * force(point, tau) - 1.0
    if which == 1:
        return velocity(point, s, tau)
    return -force_rate(point, tau) if which == 2 else force_rate(point, tau)


@jit
def newton(value, slope, function, low, high):
    """Return the zero in a bracket with value(low) > 0, by Newton's method. If an iterate leaves the bracket,
    bisect."""
    tau = 0.5 * (low + high)
    for _ in range(60):
        g = value(*function, tau)
        low, high = (tau, high) if g > 0.0 else (low, tau)
        d = slope(*function, tau)
        new = tau - g / d if d != 0.0 else low - 1.0
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - tau) <= 1e-14 + 4e-16 * abs(tau):
            return new
        tau = new
    return tau


@jit
def locate(point, setting, state, t0, xi, dxi, end):
    low, k = t0, 0
    first = 0 if state in (UP, DOWN) else 2
    s = constants(point, 1.0 if state == UP else -1.0, t0, xi, dxi)
    while low <= end:
        k += 1
        high = t0 + k * setting[0]
        ended = value(first, point, s, high) <= 0.0
        if ended:
            high = newton(value, slope, (first, point, s), low, high)
        if state == DOWN and value(1, point, s, high) <= 0.0:
            return newton(value, slope, (1, point, s), low, high), True, 0.0
        if ended:
            return high, False, xi if first == 2 else gap(point, s, high)
        if state == STICK and value(3, point, s, high) <= 0.0:
            return newton(value, slope, (3, point, s), low, high), False, xi
        low = high
    return low, False, xi


events = event_loop(locate, compiled=True)


def zeros(function, T, step):
    """Return the zeros of `function` in (0, T] with changes of sign on a grid of the step `step`."""
    return newton_in(function, sums.brackets(function, T, step))


def newton_in(function, intervals):
    """Return the zeros of `function` in intervals (low, high) at whose ends it has different signs."""
    found = []
    for low, high in intervals:
        falls = sums.value(function, low) > 0.0 or sums.value(function, high) < 0.0
        positive = function._replace(sign=1.0 if falls else -1.0)  # ±g > 0 at `low`, as `newton` requires
        found.append(newton(sums.value, sums.slope, (positive,), low, high))
    return found
