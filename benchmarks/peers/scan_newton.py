"""Usual program written by hand with Numba: closed form, scan for the sign change, Newton's method in the bracket."""

from __future__ import annotations

import math

from benchmarks.peers.event_loop import event_loop
from benchmarks.peers.model import DOWN, STICK, UP, force, gap, jit, velocity
from benchmarks.peers.record import Case, Run, run_kernel

NAME = "hand-written Numba: scan + Newton"
STEP = 0.3
STEP_DISTURBED = 3e-4  # much longer steps miss the closest pair of zeros at A = 3.04, ε = 2e-4


@jit
def function(A, B, eps, eta, which, t0, c0, d0, tau):
    """Return switching function number `which`, positive while the state lasts.

    `which` = 0: ξ' (sliding up), 1: −ξ' (sliding down), 2: ξ, 3: 1 − H, 4: 1 + H
    """
    if which == 0:
        return velocity(A, B, eps, eta, 1.0, t0, c0, tau)
    if which == 1:
        return -velocity(A, B, eps, eta, -1.0, t0, c0, tau)
    if which == 2:
        return gap(A, B, eps, eta, -1.0, t0, c0, d0, tau)
    if which == 3:
        return 1.0 - force(A, B, eps, eta, tau)
    return 1.0 + force(A, B, eps, eta, tau)


@jit
def slope(A, B, eps, eta, which, t0, c0, tau):
    """Return the derivative of `function` with respect to τ."""
    if which == 0:
        return force(A, B, eps, eta, tau) - 1.0
    if which == 1:
        return -force(A, B, eps, eta, tau) - 1.0
    if which == 2:
        return velocity(A, B, eps, eta, -1.0, t0, c0, tau)
    d = A * (math.cos(tau) + eps * eta**3 * math.cos(eta * tau)) if eps > 0.0 else A * math.cos(tau)
    return -d if which == 3 else d


@jit
def newton(A, B, eps, eta, which, t0, c0, d0, low, high):
    """Find the zero by Newton's method, with bisection if a step would leave the bracket."""
    n = 0
    tau = 0.5 * (low + high)
    for _ in range(60):
        g = function(A, B, eps, eta, which, t0, c0, d0, tau)
        n += 1
        if g > 0.0:
            low = tau
        else:
            high = tau
        new = 0.5 * (low + high)
        d = slope(A, B, eps, eta, which, t0, c0, tau)
        n += 1
        if d < 0.0 and low <= tau - g / d <= high:
            new = tau - g / d
        if abs(new - tau) <= 1e-14 + 4e-16 * tau:
            return new, n
        tau = new
    return tau, n


@jit
def locate(A, B, eps, eta, step, tol, state, t0, xi, c0, d0, end):
    n = 0
    j = 0
    low = t0
    while low <= end:
        j += 1
        high = t0 + j * step
        if state == UP:
            n += 1
            if function(A, B, eps, eta, 0, t0, c0, d0, high) <= 0.0:
                tau, m = newton(A, B, eps, eta, 0, t0, c0, d0, low, high)
                return tau, False, n + m
        elif state == DOWN:
            n += 2
            back = function(A, B, eps, eta, 1, t0, c0, d0, high) <= 0.0
            if back or function(A, B, eps, eta, 2, t0, c0, d0, high) <= 0.0:
                if back:
                    high, m = newton(A, B, eps, eta, 1, t0, c0, d0, low, high)
                    n += m + 1
                if not back or function(A, B, eps, eta, 2, t0, c0, d0, high) <= 0.0:
                    tau, m = newton(A, B, eps, eta, 2, t0, c0, d0, low, high)
                    return tau, True, n + m
                return high, False, n
        else:
            n += 1
            h = force(A, B, eps, eta, high)
            if h >= 1.0 or (state == STICK and h <= -1.0):
                tau, m = newton(A, B, eps, eta, 3 if h >= 1.0 else 4, t0, c0, d0, low, high)
                return tau, False, n + m
        low = high
    return low, False, n


kernel = event_loop(locate)


def run(case: Case, step: float | None = None, repeats: int = 3) -> Run:
    """Run the case with scan step Δτ = `step`. The default is 0.3, or 3e-4 for ε > 0: long, but no switch is missed."""
    if step is None:
        step = STEP_DISTURBED if case.eps > 0.0 else STEP
    return run_kernel(NAME, case, kernel, (step, 0.0), repeats=repeats, notes=(f"Δτ = {step:g}",))
