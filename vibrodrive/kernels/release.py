"""Whether and where static friction gives way at ε = 0: the phases at which H = A sin τ - B rises to 1 and falls to -1.

The one place of these formulas: the engine waits for these phases, and the impact-phase map of orbits begins its
slides there. Both come without cancellation however close A is to 1 + B or to |1 - B|.
"""

from __future__ import annotations

import math

from numba.extending import register_jitable

from vibrodrive.jit.compile import inline
from vibrodrive.jit.trig import PI, PI_LOW, arcsine


@register_jitable
def onset(b):
    """The A above which a mass at rest at the obstacle is moved: the peak A - B of H reaches 1."""
    return 1.0 + b


@register_jitable
def moves(a, b):
    """Whether a mass at rest at the obstacle is ever moved. Plain Python may call this without compiling it."""
    return a > onset(b)


@inline
def release_up(a, b):
    """(φ_up, A cos φ_up): where H rises to 1; A > 1 + B."""
    room = a - 1.0 - b
    return arcsine((1.0 + b) / a, room / a), math.sqrt(room * (a + (1.0 + b)))


@inline
def release_down(a, b):
    """(φ_down, A cos φ_down): where H falls to -1; A > |1 - B|."""
    below = abs(1.0 - b)
    angle = arcsine(below / a, (a - below) / a)
    return (PI + angle if b <= 1.0 else PI - angle) + PI_LOW, -math.sqrt((a - below) * (a + below))
