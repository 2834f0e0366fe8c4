"""Event loop of the peers with the closed form: find the next switch, pass section points, decide, record."""

from __future__ import annotations

import math

from benchmarks.peers.model import BUDGET, DOWN, IMPACT, REST, UP, constants, decide, force, gap, jit, velocity

TWO_PI = 2.0 * math.pi


def event_loop(locate):
    """Return a compiled kernel (see `run_kernel`) for one method of finding the end of a state.

    `locate(A, B, eps, eta, step, tol, state, t0, xi, c0, d0, end)` returns (τ of the switch, impact?, evaluations),
    with τ > end if the state does not end before `end`. After every switch ξ' = 0. After an impact also ξ = 0; after
    other switches ξ is unchanged. Time is a single number τ, which grows.
    """

    @jit
    def kernel(A, B, eps, eta, step, tol, phi_s, transient, periods, section, period, phase, before, after):
        total = transient + periods
        begin, end = TWO_PI * transient, TWO_PI * total
        first = phi_s if phi_s > 0.0 else TWO_PI
        crossed = 0
        count = 0
        evaluations = 0
        done = 0
        used = 0
        state, t0, xi = REST, 0.0, 0.0
        c0, d0 = constants(A, eps, eta, t0, xi, 0.0)
        while True:
            impact = False
            if state == IMPACT:
                tau = t0
            else:
                tau, impact, n = locate(A, B, eps, eta, step, tol, state, t0, xi, c0, d0, end)
                evaluations += n
            sliding = state in (UP, DOWN)
            sign = 1.0 if state == UP else -1.0
            while crossed < total and first + TWO_PI * crossed <= tau:
                at = first + TWO_PI * crossed
                k = crossed - transient
                crossed += 1
                if k >= 0:
                    section[k, 0] = gap(A, B, eps, eta, sign, t0, c0, d0, at) if sliding else xi
                    section[k, 1] = velocity(A, B, eps, eta, sign, t0, c0, at) if sliding else 0.0
            whole = math.floor(tau / TWO_PI)
            if whole > done:
                done, used = whole, 0
            used += 1
            if tau > end or used > BUDGET:
                return count, evaluations, min(done, total)
            nxt = decide(state, force(A, B, eps, eta, tau), impact)
            if tau > begin:
                if count < len(phase):
                    period[count] = whole
                    phase[count] = tau - TWO_PI * whole
                    before[count] = state
                    after[count] = nxt
                count += 1
            if nxt == IMPACT:
                xi = 0.0
            elif sliding:
                xi = gap(A, B, eps, eta, sign, t0, c0, d0, tau)
            state, t0 = nxt, tau
            c0, d0 = constants(A, eps, eta, t0, xi, 0.0)

    return kernel
