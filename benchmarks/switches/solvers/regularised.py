"""Hand-written Numba: smoothed friction, linear in the velocity up to v_s, and a spring with a dashpot as the obstacle.

The dashpot has critical damping, the least damping at which the spring does not return velocity to the mass. The force
of the dashpot may also be a pull. Without a pull, 13.5 % of the speed would remain after each impact for any stiffness
of the spring, so that the impact would not become plastic.

Steps are explicit (RK4) or implicit (backward Euler). Explicit steps are stable only if step <= v_s and step <= 1/√k.
Implicit steps are stable for any stiffness. Their equation is piecewise linear and is solved exactly.
"""

import math

from benchmarks.switches.loop import step_loop
from benchmarks.switches.model import DOWN, REST, STICK, UP, force, jit

NAME, PACKAGE = "regularised friction, penalty contact", None
SETTINGS = [
    {"step": step, "v_s": v_s, "k": k, "implicit": implicit}
    for implicit in (False, True)
    for step in (1e-2, 1e-3, 1e-4)
    for v_s in (1e-2, 1e-4, 1e-6)
    for k in (1e4, 1e8)
    if implicit or (step <= v_s and step <= k**-0.5)
]


@jit
def acceleration(setting, xi, dxi, level):
    """Return ξ'' for H = `level`."""
    _, v_s, k, _ = setting
    friction = max(-1.0, min(1.0, dxi / v_s))
    return level - friction - (k * xi + 2.0 * math.sqrt(k) * dxi if xi < 0.0 else 0.0)


@jit
def rk4(point, setting, xi, dxi, tau, level, ahead):
    """Return ξ, ξ' after a step of RK4. H is `level` before the step and `ahead` after the step."""
    h, middle = setting[0], force(point, tau + 0.5 * setting[0])
    a1 = acceleration(setting, xi, dxi, level)
    v2 = dxi + 0.5 * h * a1
    a2 = acceleration(setting, xi + 0.5 * h * dxi, v2, middle)
    v3 = dxi + 0.5 * h * a2
    a3 = acceleration(setting, xi + 0.5 * h * v2, v3, middle)
    v4 = dxi + h * a3
    a4 = acceleration(setting, xi + h * v3, v4, ahead)
    return xi + h / 6.0 * (dxi + 2.0 * (v2 + v3) + v4), dxi + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)


@jit
def next_velocity(h, v_s, stiff, b):
    """Return the v with stiff v + h clip(v/v_s) = b. `clip` limits its argument to [−1, 1]."""
    return b / (stiff + h / v_s) if abs(b) <= stiff * v_s + h else (b - math.copysign(h, b)) / stiff


@jit
def euler(setting, xi, dxi, ahead):
    """Return ξ, ξ' after a step of backward Euler. H is `ahead` after the step."""
    h, v_s, k, _ = setting
    v = next_velocity(h, v_s, 1.0, dxi + h * ahead)
    if xi < 0.0 or xi + h * v < 0.0:
        held = next_velocity(h, v_s, 1.0 + h * (k * h + 2.0 * math.sqrt(k)), dxi + h * (ahead - k * xi))
        if xi + h * held < 0.0:
            v = held
        elif xi + h * v < 0.0:
            v = -xi / h  # neither with nor without contact is consistent: the step ends at ξ = 0
    return xi + h * v, v


@jit
def classify(state, v_s, xi, dxi, level):
    """Return the state after a step. A mass with |ξ'| ≤ v_s sticks or rests if friction can hold it (|H| ≤ 1). After an
    impact the mass rests until it leaves the obstacle."""
    if state == REST:
        return UP if dxi > v_s and (level > 1.0 or xi > 0.0) else REST
    if xi > 0.0 and (dxi < -v_s or (dxi <= 0.0 and level < -1.0)):
        return DOWN
    if dxi > v_s or (dxi >= 0.0 and level > 1.0):
        return UP
    return (REST if xi <= 0.0 else STICK) if abs(dxi) <= v_s and abs(level) <= 1.0 else state


@jit
def advance(point, setting, state, xi, dxi, tau, level, ahead):
    """Return (ξ, ξ', state, True after an impact) after one step. `step_loop` (loop.py) explains the arguments."""
    xi, dxi = euler(setting, xi, dxi, ahead) if setting[3] else rk4(point, setting, xi, dxi, tau, level, ahead)
    if state == DOWN and xi <= 0.0:
        return xi, dxi, UP if ahead > 1.0 else REST, True
    return xi, dxi, classify(state, setting[1], xi, dxi, ahead), False


events = step_loop(advance)
