"""Hand-written Numba: Moreau-Jean time-stepping, θ = 1/2, which finds no switch but steps over it.

Friction is an impulse of at most h in a step, opposed to the velocity at the step's end: soft thresholding. Where half
a step at the present velocity closes the gap, the velocity at the step's end may not be negative: a plastic impact.
The gap itself is never corrected, so that the mass comes to rest below the obstacle by up to a step's way, as in codes
for contact.
"""

from benchmarks.switches.loop import step_loop
from benchmarks.switches.model import DOWN, jit, start

NAME, PACKAGE = "Moreau-Jean", None
SETTINGS = [{"step": step} for step in (0.03, 0.01, 0.003, 0.001, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)]


@jit
def advance(point, setting, state, xi, dxi, tau, level, ahead):
    """Return ξ, ξ', the state, and whether the mass has landed, after one step."""
    h = setting[0]
    closed = xi + 0.5 * h * dxi <= 0.0
    free = dxi + 0.5 * h * (level + ahead)
    v = free - h if free > h else free + h if free < -h else 0.0
    if closed:
        v = max(v, 0.0)
    # v = 0 is not sticking if friction cannot hold the mass: at a reversal v is often 0 for one step
    next_state = start(ahead, 0.0 if closed else 1.0, v)
    return xi + 0.5 * h * (dxi + v), v, next_state, closed and state == DOWN


events = step_loop(advance)
