"""The model with sine and cosine of libm, for the hand-written peers. Equation numbers are those of the paper."""

from __future__ import annotations

import math

from numba import njit

UP, DOWN, STICK, REST, IMPACT = 0, 1, 2, 3, 4
BUDGET = 20_000  # switches allowed in one period; with more a peer stops

jit = njit(error_model="numpy", nogil=True)


@jit
def force(A, B, eps, eta, tau):
    """Return H(τ), the adhesive force with the disturbance of eq. (9)."""
    h = A * math.sin(tau) - B
    if eps > 0.0:
        h += A * eps * eta * eta * math.sin(eta * tau)
    return h


@jit
def velocity(A, B, eps, eta, sign, t0, c0, tau):
    """Return ξ' of eqs. (4), (5), (9) at τ for a slide in direction `sign` since t0; c0 from `constants`."""
    v = c0 - (B + sign) * (tau - t0) - A * math.cos(tau)
    if eps > 0.0:
        v -= A * eps * eta * math.cos(eta * tau)
    return v


@jit
def gap(A, B, eps, eta, sign, t0, c0, d0, tau):
    """Return ξ of eqs. (4), (5), (9) at τ."""
    h = tau - t0
    x = d0 + c0 * h - 0.5 * (B + sign) * h * h - A * math.sin(tau)
    if eps > 0.0:
        x -= A * eps * math.sin(eta * tau)
    return x


@jit
def constants(A, eps, eta, t0, xi, dxi):
    """Return the two constants of integration of a slide that starts at t0 with ξ, ξ'."""
    c0 = dxi + A * math.cos(t0)
    d0 = xi + A * math.sin(t0)
    if eps > 0.0:
        c0 += A * eps * eta * math.cos(eta * t0)
        d0 += A * eps * math.sin(eta * t0)
    return c0, d0


@jit
def decide(before, h, impact):
    """Return the state after `before`, which ended at an instant with H = h (Fig. 2)."""
    if before in (IMPACT, REST):
        return UP if h > 1.0 or before == REST else REST
    if before == STICK:
        return UP if h > 0.0 else DOWN
    if before == DOWN and impact:
        return IMPACT
    if h > 1.0:
        return UP
    return DOWN if h < -1.0 else STICK
