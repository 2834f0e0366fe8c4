"""Hand-written Numba without the closed form: RK4 with fixed step, sign checks, bisection of the last step."""

from __future__ import annotations

import math

from benchmarks.peers.model import BUDGET, DOWN, IMPACT, REST, STICK, UP, decide, force, jit
from benchmarks.peers.record import Case, Run, run_kernel

NAME = "hand-written Numba: RK4 + bisection"
STEP = 0.01
TWO_PI = 2.0 * math.pi


@jit
def rk4(A, B, eps, eta, sign, tau, xi, dxi, f0, h):
    """Take one step of ξ'' = H(τ) − sign from τ, where H = f0. Return ξ, ξ', H at τ + h."""
    fm = force(A, B, eps, eta, tau + 0.5 * h)
    f1 = force(A, B, eps, eta, tau + h)
    # the acceleration depends on time only, so the two middle stages have the same slope
    k1 = dxi
    k2 = dxi + 0.5 * h * (f0 - sign)
    k3 = dxi + 0.5 * h * (fm - sign)
    k4 = dxi + h * (fm - sign)
    xi1 = xi + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    dxi1 = dxi + h / 6.0 * (f0 + 4.0 * fm + f1 - 6.0 * sign)
    return xi1, dxi1, f1


@jit
def ended(state, xi, dxi, h):
    if state == UP:
        return dxi <= 0.0
    if state == DOWN:
        return xi <= 0.0 or dxi >= 0.0
    return h >= 1.0 or (state == STICK and h <= -1.0)


@jit
def kernel(A, B, eps, eta, step, phi_s, transient, periods, section, period, phase, before, after):
    total = transient + periods
    begin, end = TWO_PI * transient, TWO_PI * total
    first = phi_s if phi_s > 0.0 else TWO_PI
    crossed = 0
    count = 0
    evaluations = 0
    done = 0
    used = 0
    state, tau, xi, dxi = REST, 0.0, 0.0, 0.0
    f0 = force(A, B, eps, eta, tau)
    while True:
        sliding = state in (UP, DOWN)
        sign = 1.0 if state == UP else -1.0
        switched = state == IMPACT
        h = 0.0
        xi1, dxi1, f1 = xi, dxi, f0
        if not switched:
            h = step
            if sliding:
                xi1, dxi1, f1 = rk4(A, B, eps, eta, sign, tau, xi, dxi, f0, h)
                evaluations += 2
            else:
                f1 = force(A, B, eps, eta, tau + h)
                evaluations += 1
            switched = ended(state, xi1, dxi1, f1)
            if switched:
                low = 0.0
                while h - low > 1e-13:
                    middle = 0.5 * (low + h)
                    x, v, f = xi, dxi, f0
                    if sliding:
                        x, v, f = rk4(A, B, eps, eta, sign, tau, xi, dxi, f0, middle)
                        evaluations += 2
                    else:
                        f = force(A, B, eps, eta, tau + middle)
                        evaluations += 1
                    if ended(state, x, v, f):
                        h, xi1, dxi1, f1 = middle, x, v, f
                    else:
                        low = middle
        while crossed < total and first + TWO_PI * crossed <= tau + h:
            k = crossed - transient
            at = first + TWO_PI * crossed - tau
            crossed += 1
            if k >= 0:
                x, v = xi, dxi
                if sliding:
                    x, v, _ = rk4(A, B, eps, eta, sign, tau, xi, dxi, f0, at)
                section[k, 0], section[k, 1] = x, v
        tau += h
        xi, dxi, f0 = xi1, dxi1, f1
        whole = math.floor(tau / TWO_PI)
        if whole > done:
            done, used = whole, 0
        used += 1 if switched else 0
        if tau > end or used > BUDGET:
            return count, evaluations, min(done, total)
        if switched:
            nxt = decide(state, f0, xi <= 0.0)
            if tau > begin:
                if count < len(phase):
                    period[count] = whole
                    phase[count] = tau - TWO_PI * whole
                    before[count] = state
                    after[count] = nxt
                count += 1
            dxi = 0.0
            if nxt == IMPACT:
                xi = 0.0
            state = nxt


def run(case: Case, step: float = STEP, repeats: int = 3) -> Run:
    """Run the case with RK4 steps of `step`."""
    return run_kernel(NAME, case, kernel, (step,), repeats=repeats, notes=(f"Δτ = {step:g}",))
