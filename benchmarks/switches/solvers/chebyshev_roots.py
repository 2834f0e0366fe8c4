"""NumPy's Chebyshev series: roots of interpolants on intervals that are halved until the last coefficients are small.

Level 0 only. If the coefficients prove that an interval has no zero, no eigenvalue problem is solved.
"""

import numpy as np
from numpy.polynomial import Chebyshev

NAME, PACKAGE = "NumPy Chebyshev roots", "numpy"
SETTINGS = [{"tol": float(f"1e-{k}")} for k in range(4, 16, 2)]
DEGREE, WIDEST, NARROWEST = 32, 8.0, 1e-9


def values(f, tau):
    """Return g at an array of times."""
    slow = f.c0 + (f.c1 + f.c2 * tau) * tau + f.a * np.sin(tau + f.alpha)
    return slow + f.b * np.sin(f.eta * tau + f.beta)


def zeros(function, T, tol):
    """Return the zeros of `function` in (0, T]. The last coefficients of an interpolant are less than `tol` times the
    largest."""
    found: list[float] = []
    left, width = 0.0, WIDEST
    while left < T:
        right = min(left + width, T)
        series = Chebyshev.interpolate(lambda tau: values(function, tau), DEGREE, [left, right])
        size = np.abs(series.coef)
        if size[-3:].max() > tol * size.max() and width > NARROWEST:
            width = 0.5 * (right - left)
            continue
        if size[0] <= size[1:].sum():
            roots = series.roots()
            found += sorted(z for z in roots[np.isreal(roots)].real.tolist() if left < z <= right)
        left, width = right, min(2.0 * width, WIDEST)
    return found
