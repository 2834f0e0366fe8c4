"""Comparison with general solvers: the same motion by terminal events of scipy and of heyoka, if installed.

Each slide is one call of the solver, which stops at its event. A sticking or a rest ends where H, a function of time,
reaches a bound. A scan and bisection find this instant. With a disturbance such solvers miss some
switches of long motions, at any tolerance. In PERIODS periods of these scenes no switch is missed.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any

from vibrodrive.batch.trajectory import simulate
from vibrodrive.model.names import ETA, PARAMETERS
from vibrodrive.model.states import State
from vibrodrive.validation.check import Finding

SCENES: tuple[dict[str, Any], ...] = (
    {"A": 1.5, "B": 0.1},
    {"A": 3.04, "B": 0.1},
    {"A": 3.3, "B": 0.4},
    {"A": 2.6, "B": 0.1, "eps": 0.01, "eta": 7.3},
    {"A": 3.04, "B": 0.1, "eps": 5e-5, "eta": ETA},
)

PERIODS = 20

TWO_PI = 2.0 * math.pi

SCIPY_WITHIN = 1e-9  # bound for scipy: the error of DOP853 at the tolerances below is about 1e-11 over 20 periods
HEYOKA_WITHIN = 1e-11  # bound for heyoka: the error of its Taylor series is about 1e-13 over 20 periods


UP, DOWN, STICK, REST, IMPACT = (
    int(state) for state in State
)  # plain integers, because they are compared at each switch

End = tuple[float, float, bool]  # end of a slide: τ, ξ, and True for an impact

Slide = Callable[[int, float, float], End]
"""Function of (UP or DOWN, τ, ξ) at the start of a slide, where ξ' = 0. It returns the end of the slide."""

Wait = Callable[[int, float], float]
"""Function of (state, τ at its start), where the state is STICK or REST. It returns τ at the end of the state."""

Switch = tuple[float, int, int, float]  # a switch: τ, state before, state after, ξ


def follow(slide: Slide, wait: Wait, force: Callable[[float], float]) -> Iterator[Switch]:
    """Yield the switches of a motion that starts from rest, until a state has no end (τ = inf).

    `slide` computes the end of a slide, `wait` the end of a sticking or a rest, and `force` H at τ.
    """
    state, tau, xi = REST, 0.0, 0.0
    while True:
        impact = False
        if state < STICK:
            tau, xi, impact = slide(state, tau, xi)
        elif state != IMPACT:
            tau = wait(state, tau)
        if tau == math.inf:
            return
        h = force(tau)
        if impact:
            after = IMPACT
        elif state == STICK or state == REST:
            after = UP if h > 0.0 else DOWN
        elif h > 1.0:
            after = UP
        elif state == IMPACT:
            after = REST
        else:
            after = DOWN if h < -1.0 else STICK
        yield tau, state, after, xi
        state = after


def scanned(H: Callable[[float], float], eta: float) -> Wait:
    """Return the function for the end of STICK or REST.

    REST ends at the first zero of H - 1, and STICK at the first zero of H - 1 or H + 1. The function returns inf if it
    finds no end within two periods.
    """
    step = 0.02 / max(1.0, eta)

    def within(state: int, tau: float) -> bool:
        return H(tau) < 1.0 and (state == REST or H(tau) > -1.0)

    def wait(state: int, tau: float) -> float:
        ahead = next((k for k in range(1, math.ceil(2.0 * TWO_PI / step)) if not within(state, tau + k * step)), None)
        if ahead is None:
            return math.inf
        low, high = tau + (ahead - 1) * step, tau + ahead * step
        while low < (middle := 0.5 * (low + high)) < high:
            low, high = (middle, high) if within(state, middle) else (low, middle)
        return high

    return wait


def scipy_events() -> list[Finding]:
    """Return a finding for each scene: the largest difference of a switching time from `scipy.integrate.solve_ivp`."""
    return _side_by_side(_scipy_slide, SCIPY_WITHIN)


def heyoka_events() -> list[Finding]:
    """Return a finding for each scene: the largest difference of a switching time from `heyoka.taylor_adaptive`."""
    return _side_by_side(_heyoka_slide, HEYOKA_WITHIN)


def _side_by_side(solver: Callable[..., Slide], within: float) -> list[Finding]:
    found = []
    for scene in SCENES:
        theirs = _switches(**scene, slide=solver(**scene))
        ours = simulate(**scene, transient=0, periods=PERIODS).switches
        apart = math.inf  # this value remains if states or numbers of switches differ
        if [row[1:3] for row in theirs] == list(zip(ours["before"], ours["after"], strict=True)):
            tau = TWO_PI * ours["period"] + ours["phase"]
            apart = max(abs(row[0] - t) for row, t in zip(theirs, tau.tolist(), strict=True))
        label = ", ".join(f"{PARAMETERS[name].symbol} = {value:g}" for name, value in scene.items())
        found.append(Finding(f"{label}: difference in τ", apart, within))
    return found


def _force(A: float, B: float, eps: float, eta: float, sin: Callable[[Any], Any], tau: Any) -> Any:
    """Return H(τ), computed with the sine function of a solver."""
    slow = A * sin(tau) - B
    return slow + A * eps * eta**2 * sin(eta * tau) if eps else slow


def _switches(A: float, B: float, slide: Slide, eps: float = 0.0, eta: float = ETA) -> list[Switch]:
    """Return all switches of PERIODS periods from rest."""

    def H(tau: float) -> float:
        return _force(A, B, eps, eta, math.sin, tau)

    switches = follow(slide, scanned(H, eta if eps else 1.0), H)
    return list(itertools.takewhile(lambda row: row[0] <= TWO_PI * PERIODS, switches))


def stopping(component: int, direction: float) -> Any:
    """Return a terminal event of scipy: component 0 (ξ) or 1 (ξ') crosses zero in `direction`."""

    def event(_tau: float, y: Any) -> float:
        return y[component]

    marked: Any = event
    marked.terminal, marked.direction = True, direction
    return marked


def _scipy_slide(A: float, B: float, eps: float = 0.0, eta: float = ETA) -> Slide:
    from scipy.integrate import solve_ivp

    events = {UP: [stopping(1, -1.0)], DOWN: [stopping(1, 1.0), stopping(0, -1.0)]}

    def slide(state: int, tau: float, xi: float) -> End:
        friction = -1.0 if state == UP else 1.0
        found = solve_ivp(
            lambda t, y: (y[1], _force(A, B, eps, eta, math.sin, t) + friction),
            (tau, tau + 2.0 * TWO_PI),
            (xi, 0.0),
            method="DOP853",
            events=events[state],
            rtol=1e-12,
            atol=1e-13,
            first_step=1e-4,  # a longer first step passes over a short slide
        )
        impact = state == DOWN and len(found.t_events[1]) > 0
        return float(found.t[-1]), 0.0 if impact else float(found.y[0, -1]), impact

    return slide


def _heyoka_slide(A: float, B: float, eps: float = 0.0, eta: float = ETA) -> Slide:
    import heyoka as hy

    xi, dxi = hy.make_vars("xi", "dxi")
    force = _force(A, B, eps, eta, hy.sin, hy.time)
    back_up = hy.t_event(dxi, direction=hy.event_direction.negative)
    back_down = hy.t_event(dxi, direction=hy.event_direction.positive)
    ground = hy.t_event(xi, direction=hy.event_direction.negative)
    solvers = {
        state: hy.taylor_adaptive([(xi, dxi), (dxi, force + friction)], [0.0, 0.0], t_events=events)
        for state, friction, events in ((UP, -1.0, [back_up]), (DOWN, 1.0, [back_down, ground]))
    }

    def slide(state: int, tau: float, xi: float) -> End:
        solver = solvers[state]
        solver.time = tau
        solver.state[:] = xi, 1e-16 if state == UP else -1e-16  # from a start at 0 the solver may miss the next zero
        solver.reset_cooldowns()
        outcome = solver.propagate_until(tau + 2.0 * TWO_PI)[0]
        impact = state == DOWN and int(outcome) == -2  # -2: the second terminal event
        return solver.time, 0.0 if impact else float(solver.state[0]), impact

    return slide
