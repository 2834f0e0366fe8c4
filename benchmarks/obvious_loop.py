"""The obvious way to find a switch on a grid: a compiled loop that visits every grid point."""

import numpy as np

import vibrodrive as vd
from benchmarks.switches.loop import Event, event_loop
from benchmarks.switches.model import DOWN, STICK, TWO_PI, UP, Point, constants, force, gap, jit, velocity


@jit
def locate(point, setting, state, t0, xi, dxi, end):
    """Return τ of the first grid point at which the state has ended, True at an impact, and ξ."""
    sign = 1.0 if state == UP else -1.0
    k, tau, s = round(t0 / setting[0]), t0, constants(point, sign, t0, xi, dxi)
    while tau <= end:
        k += 1
        tau = k * setting[0]
        h = force(point, tau)
        v, x = velocity(point, s, tau), gap(point, s, tau)
        if state in (UP, DOWN):
            landed = state == DOWN and x < 0.0
            if landed or sign * v < 0.0:
                return tau, landed, x
        elif h > 1.0 or (state == STICK and h < -1.0):
            return tau, False, xi
    return tau, False, xi


events = event_loop(locate, compiled=True)


def sweep(A: np.ndarray, dtau: float, *, periods: int, B: float = 0.1, eps: float = 0.0) -> list[list[Event]]:
    """Return the switches of the motion from rest at each A."""
    return [events((0.0, 0.0, 0.0, TWO_PI * periods), Point(a, B, eps, vd.ETA), step=dtau) for a in A]
