"""Both disturbances in one unit: how large a velocity they add to the motion.

A disturbance ε sin ητ of the excitation is a velocity of amplitude εηA. A switch found late by Δτ is one of the order
Δτ, as accelerations are of the order 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def as_velocity(disturbance: str, value: ArrayLike, A: ArrayLike, eta: ArrayLike) -> np.ndarray:
    """The velocity amplitude V of values of ε (`disturbance` "eps": V = εηA) or of Δτ ("dtau": V = Δτ), else NaN.

    Everything is dimensionless; arrays are broadcast. `Scene.velocity` turns V into m/s. An error of the start acts
    once and has no amplitude.

    Examples
    --------
    >>> from vibrodrive.stability.velocity import as_velocity
    >>> as_velocity("eps", [1e-4, 2e-4], A=3.0, eta=100.0).round(9).tolist()
    [0.03, 0.06]
    >>> as_velocity("dtau", 0.05, A=3.0, eta=100.0).tolist()
    0.05
    """
    unit = np.multiply(A, eta) if disturbance == "eps" else np.ones(np.broadcast(A, eta).shape)
    return np.asarray(value, dtype=np.float64) * (unit if disturbance in ("eps", "dtau") else np.nan)
