"""Release from static friction at ε = 0: the phases at which H = A sin τ - B rises to 1 and falls to -1.

The engine ends waits at these phases, and the impact-phase map begins its slides there. Both phases are computed
without cancellation, however close A is to 1 + B or to |1 - B|.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable

from vibrodrive.jit.compile import inline
from vibrodrive.jit.trig import PI, PI_LOW, arcsine
from vibrodrive.kernels.codes import STICK


@register_jitable
def onset(b):
    """Return the A above which a mass at rest at the obstacle moves: the peak A - B of H reaches 1."""
    return 1.0 + b


@register_jitable
def moves(a, b):
    """Return whether a mass at rest at the obstacle will move. Plain Python may call this without compiling it."""
    return a > onset(b)


@inline
def can_end(state, reach, b):
    """Return whether H can reach a boundary of the wait `state`; H + B never exceeds `reach` in size."""
    return (reach > 1.0 + b) | ((state == STICK) & (reach > abs(1.0 - b)))


@inline
def release_up(a, b):
    """Return (φ_up, A cos φ_up) at which H rises to 1; requires A > 1 + B."""
    room = a - 1.0 - b
    return arcsine((1.0 + b) / a, room / a), math.sqrt(room * (a + (1.0 + b)))


@inline
def release_down(a, b):
    """Return (φ_down, A cos φ_down) at which H falls to -1; requires A > |1 - B|."""
    below = abs(1.0 - b)
    angle = arcsine(below / a, (a - below) / a)
    return (PI + angle if b <= 1.0 else PI - angle) + PI_LOW, -math.sqrt((a - below) * (a + below))
