"""scipy.optimize.brentq in the intervals of a grid in which g changes its sign (level 0 only)."""

from scipy.optimize import brentq

from benchmarks.switches.sums import brackets, value

NAME, PACKAGE = "scipy brentq on a grid", "scipy"
SETTINGS = [{"step": step} for step in (0.1, 0.03, 0.01, 0.003, 0.001, 3e-4, 1e-4)]


def zeros(function, T, step):
    """Return the zeros of `function` in (0, T] by a grid of this step."""
    g = value.py_func
    return [
        high if g(function, high) == 0.0 else brentq(lambda tau: g(function, tau), low, high, xtol=1e-15, rtol=1e-15)
        for low, high in brackets(function, T, step)
    ]
