"""One certified trajectory at a time, with sine and cosine of libm: the reference for the gain by batching.

The first zero of g is found by steps that cannot jump over it: if g > 0 and |g''| ≤ M ahead, there is no zero before
the positive root s of g + g's − Ms²/2. For ε > 0 the fast term determines the bound M. A second step follows from the
split g = slow + fast with |fast| ≤ a: it is computed in the same way for `slow − a`, with the small M of the slow term.
The longer of the two steps is taken. At ε = 0 the ends of sticking and resting are arcsines. Time is stored as a number
of periods and phases. Sines and cosines at a switch are used again in the next state, and the section at ε = 0 needs no
sine.
"""

from __future__ import annotations

import math

import numpy as np

from benchmarks.peers.model import BUDGET, DOWN, IMPACT, REST, STICK, UP, jit
from benchmarks.peers.record import Case, Run, run_kernel

NAME = "certified, one at a time (libm)"
TWO_PI = 2.0 * math.pi
CLOSE = 1e-15  # largest distance of the zero after the last step
SHORT = 1e-13  # least step: near a tangency the steps converge linearly, without end


@jit
def safe_step(g, slope, bound):
    """Return the positive root s of g + slope s − bound s²/2, g ≥ 0."""
    root = math.sqrt(slope * slope + 2.0 * bound * g)
    if slope < 0.0:
        return 2.0 * g / (root - slope)
    return (slope + root) / bound


@jit
def slide(A, B, eps, eta, sign, flat, phi, theta, xi, dxi, s0, c0, fs0, fc0):
    """Compute a slide from a switch at phase phi (fast phase theta) to the end of UP (sign = 1) or DOWN (−1).

    s0, c0, fs0, fc0 are the sines and cosines at the switch; `flat` means that ξ'' = 0 at the switch. Returns (h,
    impact?, ξ, sin, cos of the slow and of the fast phase at the end, evaluations).
    """
    fast = A * eps * eta
    m_slow = A
    m = A + fast * eta * eta
    v0 = dxi + A * c0 + fast * fc0
    x0 = xi + A * s0 + A * eps * fs0
    pull = B + sign
    g = sign * dxi
    if flat:
        # g starts on a double zero: g ≥ g''s²/2 − M₃s³/6 is positive up to s = 3 g''/M₃
        s = 2.0 * sign * (A * c0 + fast * eta * eta * fc0) / (A + fast * eta**3)
    else:
        s = safe_step(max(g, 0.0), sign * (A * s0 + fast * eta * fs0 - B) - 1.0, m)
    s = max(s, SHORT)
    h = 0.0
    before = 0.0
    last = False
    fsn, fcs = 0.0, 1.0
    n = 0
    while True:
        before = h
        h += s
        n += 1
        sn, cs = math.sin(phi + h), math.cos(phi + h)
        v = v0 - pull * h - A * cs
        force = A * sn - B
        if eps > 0.0:
            fsn, fcs = math.sin(theta + eta * h), math.cos(theta + eta * h)
            v -= fast * fcs
            force += fast * eta * fsn
        if sign < 0.0:
            x = x0 + (v0 - 0.5 * pull * h) * h - A * sn - A * eps * fsn
            if x <= 0.0:
                break
        g = sign * v
        if last or g <= 0.0:
            x = x0 + (v0 - 0.5 * pull * h) * h - A * sn - A * eps * fsn
            return h, False, x, sn, cs, fsn, fcs, n
        slope = sign * force - 1.0
        s = safe_step(g, slope, m)
        if eps > 0.0:
            slow = g + sign * fast * fcs - fast
            if slow > 0.0:
                s = max(s, safe_step(slow, sign * (A * sn - B) - 1.0, m_slow))
        last = slope < 0.0 and m * s * s <= -CLOSE * slope
        if not last:
            s = max(s, SHORT)
    # ξ decreases in (before, h], so its zero is unique: Newton's method within the bracket
    low, high = before, h
    for _ in range(60):
        if x > 0.0:
            low = h
        else:
            high = h
        new = h - x / v if v < 0.0 else 0.5 * (low + high)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        step = abs(new - h)
        h = new
        n += 1
        sn, cs = math.sin(phi + h), math.cos(phi + h)
        if eps > 0.0:
            fsn, fcs = math.sin(theta + eta * h), math.cos(theta + eta * h)
        v = v0 - pull * h - A * cs - fast * fcs
        x = x0 + (v0 - 0.5 * pull * h) * h - A * sn - A * eps * fsn
        # Newton's next error is about ξ''/(2ξ') step²
        if step * step * m <= CLOSE * abs(v) or high - low <= CLOSE:
            break
    return h, True, 0.0, sn, cs, fsn, fcs, n


@jit
def wait(A, B, eps, eta, sticking, phi, theta, s0, c0, fs0, fc0, longest):
    """Compute the end of STICK or REST after a switch, ε > 0: H reaches 1 (or −1, sticking). Returns as `slide`."""
    fast = A * eps * eta * eta
    m_slow = A
    m = A + fast * eta * eta
    sn, cs, fsn, fcs = s0, c0, fs0, fc0
    h = 0.0
    last = False
    n = 0
    while True:
        force = A * sn - B + fast * fsn
        rate = A * cs + fast * eta * fcs
        up = 1.0 - force
        down = 1.0 + force
        if last or up <= 0.0 or (sticking and down <= 0.0) or h > longest:
            return h, sn, cs, fsn, fcs, n
        s = safe_step(up, -rate, m)
        slow = 1.0 - (A * sn - B) - fast
        if slow > 0.0:
            s = max(s, safe_step(slow, -A * cs, m_slow))
        if sticking:
            t = safe_step(down, rate, m)
            slow = 1.0 + (A * sn - B) - fast
            if slow > 0.0:
                t = max(t, safe_step(slow, A * cs, m_slow))
            if t < s:
                s, rate = t, -rate
        last = rate > 0.0 and m * s * s <= CLOSE * rate
        h += s if last else max(s, SHORT)
        n += 1
        sn, cs = math.sin(phi + h), math.cos(phi + h)
        fsn, fcs = math.sin(theta + eta * h), math.cos(theta + eta * h)


@jit
def kernel(A, B, eps, eta, phi_s, transient, periods, section, period, phase, before, after):
    total = transient + periods
    first = phi_s if phi_s > 0.0 else TWO_PI
    section_sin, section_cos = math.sin(phi_s), math.cos(phi_s)
    fast = A * eps * eta

    # ε = 0: H = 1 rising at asin((1 + B)/A), H = −1 falling at π + asin((1 − B)/A)
    lifts = A >= 1.0 + B
    drops = abs(1.0 - B) <= A
    lift = math.asin((1.0 + B) / A) if lifts else 0.0
    drop = math.pi + math.asin((1.0 - B) / A) if drops else 0.0
    lift_sin, lift_cos = math.sin(lift), math.cos(lift)
    drop_sin, drop_cos = math.sin(drop), math.cos(drop)

    count = 0
    evaluations = 0
    used = 0
    crossed = 0
    whole = 0
    state = REST
    phi, theta = 0.0, 0.0
    xi = 0.0
    flat = False
    sn, cs, fsn, fcs = 0.0, 1.0, 0.0, 1.0
    while True:
        impact = False
        xi1 = xi
        s1, c1, fs1, fc1 = sn, cs, fsn, fcs
        sliding = state in (UP, DOWN)
        sign = 1.0 if state == UP else -1.0
        h = 0.0
        if sliding:
            h, impact, xi1, s1, c1, fs1, fc1, n = slide(
                A, B, eps, eta, sign, flat, phi, theta, xi, 0.0, sn, cs, fsn, fcs
            )
            evaluations += n
        elif state != IMPACT:
            longest = TWO_PI * (total - whole) - phi
            if eps > 0.0:
                h, s1, c1, fs1, fc1, n = wait(A, B, eps, eta, state == STICK, phi, theta, sn, cs, fsn, fcs, longest)
                evaluations += n
            else:
                h = 2.0 * longest + TWO_PI
                if lifts:
                    h = lift - phi if lift >= phi else lift - phi + TWO_PI
                    s1, c1 = lift_sin, lift_cos
                if state == STICK and drops:
                    d = drop - phi if drop >= phi else drop - phi + TWO_PI
                    if d < h:
                        h = d
                        s1, c1 = drop_sin, drop_cos
        # section instants up to the switch
        while crossed < total:
            at = (crossed - whole) * TWO_PI + (first - phi)
            if at > h:
                break
            k = crossed - transient
            crossed += 1
            if k >= 0:
                section[k, 0] = xi
                section[k, 1] = 0.0
                if sliding:
                    v0 = A * cs + fast * fcs
                    x = xi + (v0 - 0.5 * (B + sign) * at) * at - A * (section_sin - sn)
                    v = v0 - (B + sign) * at - A * section_cos
                    if eps > 0.0:
                        x -= A * eps * (math.sin(theta + eta * at) - fsn)
                        v -= fast * math.cos(theta + eta * at)
                    section[k, 0] = x
                    section[k, 1] = v
        # the switch
        phi1 = phi + h
        whole1 = whole
        if phi1 >= TWO_PI:
            turns = math.floor(phi1 / TWO_PI)
            phi1 -= TWO_PI * turns
            whole1 += int(turns)
            used = 0
        used += 1
        if whole1 >= total or used > BUDGET:
            return count, evaluations, min(whole1, total)
        force = A * s1 - B + fast * eta * fs1
        flat = False
        if state == IMPACT:
            nxt = UP if force > 1.0 else REST
        elif impact:
            nxt = IMPACT
        elif sliding:
            nxt = STICK
            if sign > 0.0 and force < -1.0:
                nxt = DOWN
            elif sign < 0.0 and force > 1.0:
                nxt = UP
        else:
            nxt = UP if force > 0.0 else DOWN
            flat = True
        if whole1 >= transient:
            if count < len(phase):
                period[count] = whole1
                phase[count] = phi1
                before[count] = state
                after[count] = nxt
            count += 1
        if eps > 0.0:
            theta = (theta + eta * h) % TWO_PI
        state, phi, whole, xi = nxt, phi1, whole1, xi1
        sn, cs, fsn, fcs = s1, c1, fs1, fc1


@jit
def sweep(points, eta, transient, periods, section):
    """Compute the rows (A, B, ε) of `points` in turn; section float64 (points, periods, 2)."""
    none = np.empty(0, np.int64)
    nothing = np.empty(0)
    empty = np.empty(0, np.int8)
    evaluations = 0
    for i in range(len(points)):
        A, B, eps = points[i]
        _, n, _ = kernel(A, B, eps, eta, 0.0, transient, periods, section[i], none, nothing, empty, empty)
        evaluations += n
    return evaluations


def run(case: Case, repeats: int = 3) -> Run:
    """Run the case, every switch certified to 1e-15."""
    return run_kernel(NAME, case, kernel, (), repeats=repeats)
