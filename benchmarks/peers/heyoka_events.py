"""heyoka: adaptive Taylor integration with terminal events, in its fastest form for this model.

One `propagate_until` a slide, restarted at each switch with ξ' = ±1e-16 and events filtered by direction:
from ξ' exactly 0 the next zero of the same step is silently lost, and a lift-off with ξ' = ξ'' = 0 triggers
its own event for ever. At ε = 0 sticking and resting end at arcsines; for ε > 0 an event on H = ±1 ends them.
The SIMD batch integrator is no faster here.
"""

from __future__ import annotations

import math

from benchmarks.peers.model import BUDGET, DOWN, IMPACT, REST, STICK, UP
from benchmarks.peers.record import TWO_PI, Case, Recorder, Run, Unavailable, cpu_seconds
from benchmarks.peers.scipy_ivp import decide

try:
    import heyoka as hy
except ImportError:
    hy = None

NAME = "heyoka terminal events"
NUDGE = 1e-16


class Integrators:
    """The compiled Taylor integrators: up, down, and (ε > 0) two that watch H. Parameters: A, B (ε, η)."""

    def __init__(self, disturbed: bool, tol: float) -> None:
        xi, dxi, level = hy.make_vars("xi", "dxi", "level")
        a, b, eps, eta = (hy.par[k] for k in range(4))
        falling, rising = hy.event_direction.negative, hy.event_direction.positive
        pars = [0.0] * (4 if disturbed else 2)
        force = a * hy.sin(hy.time) - b
        rate = a * hy.cos(hy.time)
        if disturbed:
            force += a * eps * eta**2 * hy.sin(eta * hy.time)
            rate += a * eps * eta**3 * hy.cos(eta * hy.time)

        def slide(sign, events):
            system = [(xi, dxi), (dxi, force - sign)]
            return hy.taylor_adaptive(system, [0.0, 0.0], pars=pars, tol=tol, t_events=events)

        back_up = hy.t_event(dxi, direction=falling)
        back_down = hy.t_event(dxi, direction=rising)
        ground = hy.t_event(xi, direction=falling)
        self.by_state = {UP: slide(1.0, [back_up]), DOWN: slide(-1.0, [back_down, ground])}
        self.slides = dict(self.by_state)
        if disturbed:
            up = hy.t_event(level - 1.0, direction=rising)
            down = hy.t_event(level + 1.0, direction=falling)
            for state, events in ((REST, [up]), (STICK, [up, down])):
                system = [(level, rate)]
                self.by_state[state] = hy.taylor_adaptive(system, [0.0], pars=pars, tol=tol, t_events=events)

    def set(self, case: Case) -> None:
        for integrator in self.by_state.values():
            integrator.pars[:] = (case.A, case.B, case.eps, case.eta)[: len(integrator.pars)]


def solve(case: Case, integrators: Integrators) -> tuple[Recorder, int]:
    """The trajectory: what was recorded, completed periods. Few calls: Python's share is a third."""
    out = Recorder(case)
    A, B, eps, eta = case.A, case.B, case.eps, case.eta
    fast = A * eps * eta * eta
    sin = math.sin
    integrators.set(case)
    stopped = hy.taylor_outcome.time_limit
    by_state = integrators.by_state
    state_of = {s: i.state for s, i in by_state.items()}  # live views
    lift = math.asin((1.0 + B) / A) if A >= 1.0 + B else math.nan
    drop = math.pi + math.asin((1.0 - B) / A) if abs(1.0 - B) <= A else math.nan
    begin, end_of_run = out.begin, out.end
    section_time = out.section_time

    state, tau, xi = REST, 0.0, 0.0
    force = -B
    used, next_period = 0, TWO_PI
    while True:
        impact = False
        if state == IMPACT:
            end = tau
        elif state in (UP, DOWN):
            ta = by_state[state]
            y = state_of[state]
            ta.time = tau
            y[0] = xi
            y[1] = NUDGE if state == UP else -NUDGE
            ta.reset_cooldowns()
            while True:
                outcome = ta.propagate_until(section_time)[0]
                if outcome != stopped:
                    break
                out.point(y[0], y[1])
                if section_time >= end_of_run:
                    return out, case.total
                section_time = out.section_time
            end = ta.time
            impact = state == DOWN and int(outcome) == -2
            xi = 0.0 if impact else y[0]
        else:
            if eps > 0.0:
                ta = by_state[state]
                ta.time = tau
                state_of[state][0] = force
                ta.reset_cooldowns()
                outcome = ta.propagate_until(end_of_run + 1.0)[0]
                end = math.inf if outcome == stopped else ta.time
            else:
                end = math.inf if lift != lift else tau + (lift - tau) % TWO_PI
                if state == STICK and drop == drop:
                    end = min(end, tau + (drop - tau) % TWO_PI)
            while section_time <= end and section_time <= end_of_run:
                out.point(xi, 0.0)
                section_time = out.section_time
        if end > end_of_run:
            return out, case.total
        used += 1
        if end >= next_period:
            used, next_period = 0, (math.floor(end / TWO_PI) + 1.0) * TWO_PI
        if used > BUDGET:
            return out, int(end / TWO_PI)
        force = A * sin(end) - B
        if eps > 0.0:
            force += fast * sin(eta * end)
        following = decide(state, force, impact)
        if end > begin:
            out.rows.append((end, state, following))
        state, tau = following, end


def run(case: Case, tol: float = 2.2e-16, repeats: int = 3) -> Run:
    """The case at Taylor tolerance `tol`. Raises Unavailable without heyoka."""
    if hy is None:
        raise Unavailable("heyoka is not installed")
    integrators = Integrators(case.eps > 0.0, tol)
    out, done = solve(case, integrators)
    seconds = cpu_seconds(lambda: solve(case, integrators), repeats)
    notes: tuple[str, ...] = (f"tol = {tol:g}",)
    if done < case.total:
        notes = (*notes, f"gave up after {done} of {case.total} periods: too many switches")
    return out.run(NAME, seconds / max(done, 1), None, notes)
