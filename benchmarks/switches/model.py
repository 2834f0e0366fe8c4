"""The model of the paper, computed with sine and cosine of libm, for all solvers. Equation numbers are those of the
paper."""

import math
from typing import NamedTuple

from numba import njit

UP, DOWN, STICK, REST, IMPACT = range(5)
STATES = ("UP", "DOWN", "STICK", "REST", "IMPACT")
TWO_PI = 2.0 * math.pi

jit = njit(error_model="numpy", nogil=True)


class Point(NamedTuple):
    """Parameters of the oscillator, dimensionless."""

    A: float
    B: float
    eps: float
    eta: float


@jit
def force(point, tau):
    """Return H(τ), the adhesive force with the disturbance of eq. (9)."""
    slow = point.A * math.sin(tau) - point.B
    return slow + point.A * point.eps * point.eta**2 * math.sin(point.eta * tau) if point.eps > 0.0 else slow


@jit
def force_rate(point, tau):
    """Return H'(τ)."""
    slow = point.A * math.cos(tau)
    return slow + point.A * point.eps * point.eta**3 * math.cos(point.eta * tau) if point.eps > 0.0 else slow


@jit
def constants(point, sign, t0, xi, dxi):
    """Return (sign, t0, constant term of ξ', constant term of ξ) of a slide up (`sign` 1) or down (−1) from t0."""
    v, x = dxi + point.A * math.cos(t0), xi + point.A * math.sin(t0)
    if point.eps > 0.0:
        v += point.A * point.eps * point.eta * math.cos(point.eta * t0)
        x += point.A * point.eps * math.sin(point.eta * t0)
    return sign, t0, v, x


@jit
def velocity(point, slide, tau):
    """Return ξ' of eqs. (4), (5), (9) at τ. `slide` contains the `constants` of the slide."""
    sign, t0, v, _ = slide
    v -= (point.B + sign) * (tau - t0) + point.A * math.cos(tau)
    return v - point.A * point.eps * point.eta * math.cos(point.eta * tau) if point.eps > 0.0 else v


@jit
def gap(point, slide, tau):
    """Return ξ of eqs. (4), (5), (9) at τ. `slide` contains the `constants` of the slide."""
    sign, t0, v, x = slide
    x += (v - 0.5 * (point.B + sign) * (tau - t0)) * (tau - t0) - point.A * math.sin(tau)
    return x - point.A * point.eps * math.sin(point.eta * tau) if point.eps > 0.0 else x


@jit
def start(h, xi, dxi):
    """Return the first state of a motion that starts with ξ, ξ' and H = h."""
    if dxi != 0.0:
        return UP if dxi > 0.0 else DOWN
    if h > 1.0:
        return UP
    if xi <= 0.0:
        return REST
    return DOWN if h < -1.0 else STICK


@jit
def decide(before, h, impact):
    """Return the state that follows the state `before` (Fig. 2), which ends with H = h, at the obstacle if `impact`."""
    if before in (IMPACT, REST):
        return UP if h > 1.0 or before == REST else REST
    if before == STICK:
        return UP if h > 0.0 else DOWN
    if before == DOWN and impact:
        return IMPACT
    if h > 1.0:
        return UP
    return DOWN if h < -1.0 else STICK


def release(point, state, tau):
    """Return the first time from τ on at which, with ε = 0, STICK or REST ends: H rises to 1 or, in STICK, falls to −1.
    Return inf if there is none."""
    end = math.inf
    if point.A >= 1.0 + point.B:
        end = tau + (math.asin((1.0 + point.B) / point.A) - tau) % TWO_PI
    if state == STICK and abs(1.0 - point.B) <= point.A:
        end = min(end, tau + (math.pi + math.asin((1.0 - point.B) / point.A) - tau) % TWO_PI)
    return end
