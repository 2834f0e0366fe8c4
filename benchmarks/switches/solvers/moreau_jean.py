"""Hand-written Numba: Moreau-Jean time-stepping, which does not locate switches. With θ = 1/2 the force H and the
velocity in a step are the means of their values at its start and its end.

Friction is an impulse of at most h in a step, opposite to the velocity at the end of the step (soft thresholding). If
half a step at the present velocity closes the gap, there is a plastic impact: the velocity at the end of the step must
not be negative. The gap is never corrected. So the mass rests below the obstacle by up to the distance of one step, as
in other programs for contact.
"""

from benchmarks.switches.loop import step_loop
from benchmarks.switches.model import DOWN, jit, start

NAME, PACKAGE = "Moreau-Jean", None
SETTINGS = [{"step": step} for step in (0.03, 0.01, 0.003, 0.001, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6)]


@jit
def advance(point, setting, state, xi, dxi, tau, level, ahead):
    """Return (ξ, ξ', state, True after an impact) after one step. `step_loop` (loop.py) explains the arguments."""
    h = setting[0]
    closed = xi + 0.5 * h * dxi <= 0.0
    free = dxi + 0.5 * h * (level + ahead)
    v = free - h if free > h else free + h if free < -h else 0.0
    if closed:
        v = max(v, 0.0)
    # at a reversal v is often 0 for one step; this is sticking only if friction can hold the mass
    next_state = start(ahead, 0.0 if closed else 1.0, v)
    return xi + 0.5 * h * (dxi + v), v, next_state, closed and state == DOWN


events = step_loop(advance)
