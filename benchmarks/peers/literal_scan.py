"""The obvious compiled loop: the complete closed form, with libm, at every point of the grid.

This is the computation of the paper in its simplest compiled form. `fixed` (§5) takes the first grid point after a sign
change as the switch. `muller` (§4) refines the zero in that grid interval by Muller's method.
"""

from __future__ import annotations

import math

from benchmarks.peers.event_loop import event_loop
from benchmarks.peers.model import DOWN, STICK, UP, force, gap, jit, velocity
from benchmarks.peers.record import Case, Run, run_kernel
from benchmarks.peers.scan_newton import function

NAME_FIXED = "literal scan: fixed"
NAME_MULLER = "literal scan: Muller"


@jit
def ended(state, xi, dxi, h):
    """Return True if the valid switching function has changed sign."""
    if state == UP:
        return dxi < 0.0
    if state == DOWN:
        return xi < 0.0 or dxi > 0.0
    return h > 1.0 or (state == STICK and h < -1.0)


@jit
def locate_fixed(A, B, eps, eta, step, tol, state, t0, xi, c0, d0, end):
    sign = 1.0 if state == UP else -1.0
    k = round(t0 / step)
    n = 0
    tau = t0
    while tau <= end:
        n += 1
        tau = (k + n) * step
        h = force(A, B, eps, eta, tau)
        v = velocity(A, B, eps, eta, sign, t0, c0, tau)
        x = gap(A, B, eps, eta, sign, t0, c0, d0, tau)
        if ended(state, x, v, h):
            return tau, state == DOWN and x < 0.0, n
    return tau, False, n


@jit
def muller(A, B, eps, eta, tol, which, t0, c0, d0, low, high):
    """Refine by Muller's method, from the ends and the middle of a bracket; it does not leave the bracket."""
    x0, x1, x2 = low, high, 0.5 * (low + high)
    f0 = function(A, B, eps, eta, which, t0, c0, d0, x0)
    f1 = function(A, B, eps, eta, which, t0, c0, d0, x1)
    n = 2
    for _ in range(100):
        f2 = function(A, B, eps, eta, which, t0, c0, d0, x2)
        n += 1
        if f2 > 0.0:
            low = x2
        else:
            high = x2
        new = 0.5 * (low + high)
        if x0 != x1 and x1 != x2 and x0 != x2:
            q = (f1 - f2) / (x1 - x2)
            curve = ((f0 - f2) / (x0 - x2) - q) / (x0 - x1)
            w = q + curve * (x2 - x1)
            root = w * w - 4.0 * f2 * curve
            if root >= 0.0:
                below = w + math.copysign(math.sqrt(root), w)
                if below != 0.0 and low <= x2 - 2.0 * f2 / below <= high:
                    new = x2 - 2.0 * f2 / below
        if abs(new - x2) < tol:
            return new, n
        x0, f0, x1, f1, x2 = x1, f1, x2, f2, new
    return x2, n


@jit
def locate_muller(A, B, eps, eta, step, tol, state, t0, xi, c0, d0, end):
    sign = 1.0 if state == UP else -1.0
    n = 0
    tau = t0
    while tau <= end:
        n += 1
        low, tau = tau, t0 + n * step
        h = force(A, B, eps, eta, tau)
        v = velocity(A, B, eps, eta, sign, t0, c0, tau)
        x = gap(A, B, eps, eta, sign, t0, c0, d0, tau)
        if ended(state, x, v, h):
            if state == UP:
                tau, m = muller(A, B, eps, eta, tol, 0, t0, c0, d0, low, tau)
            elif state == DOWN:
                m = 0
                if v > 0.0:
                    tau, m = muller(A, B, eps, eta, tol, 1, t0, c0, d0, low, tau)
                if x < 0.0 or gap(A, B, eps, eta, sign, t0, c0, d0, tau) < 0.0:
                    tau, j = muller(A, B, eps, eta, tol, 2, t0, c0, d0, low, tau)
                    return tau, True, n + m + j
            else:
                tau, m = muller(A, B, eps, eta, tol, 3 if h > 1.0 else 4, t0, c0, d0, low, tau)
            return tau, False, n + m
    return tau, False, n


kernel_fixed = event_loop(locate_fixed)
kernel_muller = event_loop(locate_muller)


def run_fixed(case: Case, step: float, repeats: int = 3) -> Run:
    """Run `fixed` on the grid kΔτ, with every point visited."""
    return run_kernel(NAME_FIXED, case, kernel_fixed, (step, 0.0), repeats=repeats, notes=(f"Δτ = {step:g}",))


def run_muller(case: Case, step: float, tol: float = 1e-7, repeats: int = 3) -> Run:
    """Scan h = jΔτ from each switch, with every point visited, then apply Muller's method to |step| < tol."""
    notes = (f"Δτ = {step:g}, tol = {tol:g}",)
    return run_kernel(NAME_MULLER, case, kernel_muller, (step, tol), repeats=repeats, notes=notes)
