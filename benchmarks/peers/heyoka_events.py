"""heyoka: adaptive Taylor integration with terminal events, in its fastest form for this model.

Each slide is one `propagate_until`, restarted at each switch with ξ' = ±1e-16 and with events filtered by direction.
From ξ' = 0 exactly, the next zero in the same step would be lost without notice, and a lift-off with ξ' = ξ'' = 0 would
trigger its own event again and again. At ε = 0 the ends of sticking and resting are arcsines; for ε > 0 events on
H = ±1 end these states. heyoka's SIMD batch integrator is no faster here.
"""

from __future__ import annotations

import math

from benchmarks.peers.record import Case, Recorder, Run, Unavailable
from vibrodrive.validation.peers import DOWN, REST, STICK, UP, End, follow, release

try:
    import heyoka as hy
except ImportError:
    hy = None

NAME = "heyoka terminal events"
NUDGE = 1e-16


class Integrators:
    """Compiled Taylor integrators: up, down, for ε > 0 two with events on H. Parameters: A, B, for ε > 0 also ε, η."""

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
        if disturbed:
            up = hy.t_event(level - 1.0, direction=rising)
            down = hy.t_event(level + 1.0, direction=falling)
            for state, events in ((REST, [up]), (STICK, [up, down])):
                system = [(level, rate)]
                self.by_state[state] = hy.taylor_adaptive(system, [0.0], pars=pars, tol=tol, t_events=events)

    def solve(self, case: Case) -> tuple[Recorder, int]:
        """Return the recorder and the number of completed periods. Calls are few: Python takes a third of the time."""
        out = Recorder(case)
        A, B, fast, eta, sin = case.A, case.B, case.A * case.eps * case.eta * case.eta, case.eta, math.sin
        for integrator in self.by_state.values():
            integrator.pars[:] = (A, B, case.eps, eta)[: len(integrator.pars)]
        stopped = hy.taylor_outcome.time_limit
        state_of = {s: i.state for s, i in self.by_state.items()}  # live views

        def force(tau: float) -> float:
            return A * sin(tau) - B + (fast * sin(eta * tau) if fast else 0.0)

        def slide(state: int, tau: float, xi: float) -> End:
            ta, y = self.by_state[state], state_of[state]
            ta.time, y[0], y[1] = tau, xi, NUDGE if state == UP else -NUDGE
            ta.reset_cooldowns()
            while (outcome := ta.propagate_until(out.section_time)[0]) == stopped:
                at = out.section_time
                out.point(y[0], y[1])
                if at >= out.end:
                    return math.inf, 0.0, False
            impact = state == DOWN and int(outcome) == -2
            return ta.time, 0.0 if impact else y[0], impact

        def wait(state: int, tau: float) -> float:
            ta = self.by_state[state]
            ta.time = tau
            state_of[state][0] = force(tau)
            ta.reset_cooldowns()
            return math.inf if ta.propagate_until(out.end + 1.0)[0] == stopped else ta.time

        return out, out.follow(follow(slide, wait if fast else release(A, B), force))


def run(case: Case, tol: float = 2.2e-16, repeats: int = 3) -> Run:
    """Run the case at Taylor tolerance `tol`. Raises Unavailable without heyoka."""
    if hy is None:
        raise Unavailable("heyoka is not installed")
    integrators = Integrators(case.eps > 0.0, tol)
    out, _ = integrators.solve(case)
    return out.run(NAME, lambda: integrators.solve(case)[1], None, repeats, f"tol = {tol:g}")
