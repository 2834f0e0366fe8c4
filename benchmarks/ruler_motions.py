"""Main impacts of motions under disturbances that are not part of `vd.limit`, one at a time, at ε = 0.

`stepped`: Moreau-Jean time-stepping, as in benchmarks/switches. `creeping`: smoothed friction, linear in the velocity
up to v_s, and a rigid obstacle. `sprung`: Coulomb friction, and as the obstacle a spring of the stiffness k = w², with
critical damping.

The last two laws are piecewise linear. So each piece of a motion has a closed form, and its end is a bracketed zero. A
numerical integration would be a disturbance itself, larger than that of a small v_s or 1/√k. The three functions write
the main impacts from the time `start` to the time `end` into `impacts`, as rows (τ, speed).
"""

import math

from benchmarks.switches.model import STICK, TWO_PI, constants, force, gap, jit, velocity
from benchmarks.switches.solvers.moreau_jean import advance

FAST = 40.0  # number of time constants after which the exponential of a piece has decayed
FINE, COARSE = 0.2, 0.01  # steps of the scan for the end of a piece: FINE time constants during the decay, then COARSE
PIECES = 400  # largest mean number of pieces in a period


@jit
def note(impacts, count, tau, speed, start):
    """Write an impact (τ, speed) after `start` if it is a main impact. Return the number of main impacts.

    An impact is a main impact if no faster impact occurs within half a period, as in vibrodrive/kernels/record.py.
    """
    if tau <= start or count == len(impacts):
        return count
    if count > 0 and tau - impacts[count - 1, 0] <= math.pi:
        if speed <= impacts[count - 1, 1]:
            return count
        count -= 1
    impacts[count, 0], impacts[count, 1] = tau, speed
    return count + 1


@jit
def stepped(point, h, start, end, impacts):
    """Compute a motion from rest with Moreau-Jean steps h. Return the number of main impacts."""
    xi, dxi, state, count, k, tau = 0.0, 0.0, STICK, 0, 0, 0.0
    level = force(point, 0.0)
    while tau < end:
        k += 1
        ahead = force(point, k * h)
        speed = -dxi
        xi, dxi, state, landed = advance(point, (h,), state, xi, dxi, tau, level, ahead)
        tau, level = k * h, ahead
        if landed:
            count = note(impacts, count, tau, speed, start)
    return count


@jit
def creep(point, v_s, t0, xi, dxi, tau):
    """Return ξ, ξ' at τ if |ξ'| <= v_s since t0: ξ'' = H − ξ'/v_s."""
    share = point.A * v_s / (1.0 + v_s * v_s)
    v0 = share * (math.sin(t0) - v_s * math.cos(t0)) - point.B * v_s
    v = share * (math.sin(tau) - v_s * math.cos(tau)) - point.B * v_s
    decay = -math.expm1((t0 - tau) / v_s)
    x = share * (math.cos(t0) - math.cos(tau) + v_s * (math.sin(t0) - math.sin(tau))) - point.B * v_s * (tau - t0)
    return xi + x + (dxi - v0) * v_s * decay, v + (dxi - v0) * (1.0 - decay)


@jit
def slide(point, sign, t0, xi, dxi, tau):
    """Return ξ, ξ' at τ of a slide without contact since t0."""
    fixed = constants(point, sign, t0, xi, dxi)
    return gap(point, fixed, tau), velocity(point, fixed, tau)


@jit
def held(point, sign, w, t0, xi, dxi, tau):
    """Return ξ, ξ' at τ of a slide in contact with the spring since t0: ξ'' = H − sign − w² ξ − 2 w ξ'."""
    share, part = point.A / (w * w + 1.0) ** 2, w * w - 1.0
    offset = -(point.B + sign) / (w * w)
    c = xi - offset - share * (part * math.sin(t0) - 2.0 * w * math.cos(t0))
    d = dxi - share * (part * math.cos(t0) + 2.0 * w * math.sin(t0)) + w * c
    h = tau - t0
    fading = math.exp(-w * h)
    x = offset + share * (part * math.sin(tau) - 2.0 * w * math.cos(tau)) + (c + d * h) * fading
    v = share * (part * math.cos(tau) + 2.0 * w * math.sin(tau)) + (d - w * c - w * d * h) * fading
    return x, v


@jit
def creep_piece(point, v_s, mode, t0, xi, dxi, tau):
    """Return ξ, ξ' at τ in a piece of `creeping`, which explains the modes, and True if the piece has ended."""
    if mode == 2:
        return 0.0, 0.0, force(point, tau) > 0.0
    if mode == 0:
        x, v = creep(point, v_s, t0, xi, dxi, tau)
        return x, v, abs(v) > v_s or (x < 0.0 and v < 0.0)
    x, v = slide(point, float(mode), t0, xi, dxi, tau)
    return x, v, v * mode < v_s or (x < 0.0 and v < 0.0)


@jit
def sprung_piece(point, w, mode, t0, xi, dxi, tau):
    """Return ξ, ξ' at τ in a piece of `sprung`, which explains the modes, and True if the piece has ended."""
    closed = xi < 0.0
    if mode == 0:
        level = force(point, tau) - (w * w * xi if closed else 0.0)
        return xi, 0.0, abs(level) > 1.0
    if closed:
        x, v = held(point, float(mode), w, t0, xi, dxi, tau)
        return x, v, v * mode < 0.0 or x >= 0.0
    x, v = slide(point, float(mode), t0, xi, dxi, tau)
    return x, v, v * mode < 0.0 or x < 0.0


@jit
def end_of_piece(piece, point, value, brief, begin, end):
    """Return τ, ξ, ξ' just after the end of a piece, or τ > `end` if the piece has not ended.

    `begin` is (mode, τ, ξ, ξ') at the start of the piece. `value` is v_s or w. `brief` is the time constant of the
    piece, or 0 if there is none.
    """
    _, t0, x, v = begin
    low = t0
    while low <= end:
        step = min(COARSE, FINE * brief) if low - t0 < FAST * brief else COARSE
        high = low + step
        x, v, ended = piece(point, value, *begin, high)
        if ended:
            while high - low > 1e-15 + 4e-16 * high:
                middle = 0.5 * (low + high)
                if middle in (low, high):
                    break
                at, speed, ended = piece(point, value, *begin, middle)
                if ended:
                    high, x, v = middle, at, speed
                else:
                    low = middle
            return high, x, v
        low = high
    return low, x, v


@jit
def creeping(point, v_s, start, end, impacts):
    """Compute a motion from rest with friction smoothed over v_s.

    Return the number of main impacts, or -1 after too many pieces.

    The modes of the pieces are 1 and -1 (sliding), 0 (creeping), and 2 (at rest at the obstacle, until H rises to 0).
    """
    mode, tau, xi, dxi, count = 2, 0.0, 0.0, 0.0, 0
    for _ in range(int(end * PIECES / TWO_PI)):
        tau, xi, dxi = end_of_piece(creep_piece, point, v_s, v_s if mode == 0 else 0.0, (mode, tau, xi, dxi), end)
        if tau > end:
            return count
        if xi < 0.0 and dxi < 0.0:
            count = note(impacts, count, tau, -dxi, start)
            xi, dxi = 0.0, 0.0
            mode = 0 if force(point, tau) > 0.0 else 2
        elif mode == 0:
            mode = 1 if dxi > 0.0 else -1
        else:
            mode = 0
    return -1


@jit
def sprung(point, w, start, end, impacts):
    """Compute a motion from rest over a spring k = w². Return the number of main impacts, or -1 after too many pieces.

    The modes of the pieces are 1 and -1 (sliding) and 0 (held by friction). For ξ < 0 the mass is in contact with the
    spring.
    """
    mode, tau, xi, dxi, count = 0, 0.0, 0.0, 0.0, 0
    for _ in range(int(end * PIECES / TWO_PI)):
        brief = 1.0 / w if xi < 0.0 and mode != 0 else 0.0
        tau, at, v = end_of_piece(sprung_piece, point, w, brief, (mode, tau, xi, dxi), end)
        if tau > end:
            return count
        if mode != 0 and v * mode >= 0.0:  # ξ passes 0, the surface of the obstacle
            if at < 0.0:
                count = note(impacts, count, tau, -v, start)
            xi, dxi = (min(at, -5e-324) if mode < 0 else 0.0), v
            continue
        xi, dxi = at, 0.0
        level = force(point, tau) - (w * w * xi if xi < 0.0 else 0.0)
        mode = 1 if level > 1.0 else -1 if level < -1.0 else 0
    return -1
