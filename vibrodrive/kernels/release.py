"""Release from static friction at ε = 0: the phases at which H = A sin τ - B rises to 1 and falls to -1.

Sticking and resting end at these phases, and the slides of the impact-phase map (periodic/impact_map.py) begin there.
Both phases are computed without cancellation, even if A is very close to 1 + B or to |1 - B|.
"""

import math

from vibrodrive.jit.compile import formula, inline
from vibrodrive.jit.trig import PI, PI_LOW, arcsine
from vibrodrive.kernels.codes import STICK


@formula
def onset(b):
    """Return 1 + B. If A is larger, the peak A - B of H exceeds 1, and a mass at rest at the obstacle leaves it."""
    return 1.0 + b


@formula
def moves(a, b):
    """Return whether a mass at rest at the obstacle will leave it. Python code may call this without the JIT."""
    return a > onset(b)


@inline
def can_end(state, reach, b):
    """Return whether H can reach 1 or, if `state` is STICK, also -1: the wait `state` then ends.

    `reach` is the largest |H + B|.
    """
    return (reach > 1.0 + b) | ((state == STICK) & (reach > abs(1.0 - b)))


@inline
def release_up(a, b):
    """Return (φ, A cos φ) for the phase φ at which H rises to 1. Requires A > 1 + B."""
    room = a - 1.0 - b
    return arcsine((1.0 + b) / a, room / a), math.sqrt(room * (a + (1.0 + b)))


@inline
def release_down(a, b):
    """Return (φ, A cos φ) for the phase φ at which H falls to -1. Requires A > |1 - B|."""
    below = abs(1.0 - b)
    angle = arcsine(below / a, (a - below) / a)
    return (PI + angle if b <= 1.0 else PI - angle) + PI_LOW, -math.sqrt((a - below) * (a + below))
