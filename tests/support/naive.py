"""The paper's two methods to find a switch, as plain and slow loops that import nothing of vibrodrive.

The loops evaluate the closed forms (4), (5), (9) from the last switch at every grid point, in doubles.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

UP, DOWN, STICK, REST, IMPACT = range(5)
ETA = 10.0 * math.sqrt(102.0)


class Switch(NamedTuple):
    """One switch, with its ξ and ξ'. The next state starts with ξ' = 0, and after an impact also with ξ = 0."""

    tau: float
    period: int
    phase: float
    before: int
    after: int
    xi: float
    dxi: float


class Naive(NamedTuple):
    """All switches after τ0, and the section points (ξ, ξ')."""

    switches: list[Switch]
    section: list[tuple[float, float]]


@dataclass(frozen=True)
class Model:
    """Parameters, and closed form of the motion that begins with (ξ_i, ξ'_i) at τ_i."""

    A: float
    B: float
    eps: float
    eta: float

    def H(self, tau: float) -> float:
        """Adhesive force (2) with the disturbance (9)."""
        return self.A * (math.sin(tau) + self.eps * self.eta**2 * math.sin(self.eta * tau)) - self.B

    def dxi(self, tau: float, state: int, tau_i: float, xi_i: float, dxi_i: float) -> float:
        if state in (STICK, REST):
            return 0.0
        s, h, A, eta = (1 if state == UP else -1), tau - tau_i, self.A, self.eta
        fast = A * self.eps * eta * (math.cos(eta * tau) - math.cos(eta * tau_i))
        return dxi_i - (self.B + s) * h - A * (math.cos(tau) - math.cos(tau_i)) - fast

    def xi(self, tau: float, state: int, tau_i: float, xi_i: float, dxi_i: float) -> float:
        if state in (STICK, REST):
            return xi_i
        s, h, A, eta = (1 if state == UP else -1), tau - tau_i, self.A, self.eta
        slope = dxi_i + A * math.cos(tau_i) + A * self.eps * eta * math.cos(eta * tau_i)
        fast = A * self.eps * (math.sin(eta * tau) - math.sin(eta * tau_i))
        return xi_i + slope * h - (self.B + s) * h * h / 2 - A * (math.sin(tau) - math.sin(tau_i)) - fast


def in_air(H: float) -> int:
    """Return the state after a slide that ends at ξ > 0. After a late switch UP may follow UP, or DOWN follow DOWN."""
    return UP if H > 1 else DOWN if H < -1 else STICK


def at_obstacle(H: float) -> int:
    """Return the state after ξ = ξ' = 0."""
    return UP if H > 1 else REST


def over(model: Model, state: int, tau: float, *since: float) -> str:
    """Return the switching function (8) that has changed its sign at τ, or "". If S1 and S2 both have, return S1."""
    if state == UP:
        return "S3" if model.dxi(tau, state, *since) < 0 else ""
    if state == DOWN:
        if model.xi(tau, state, *since) < 0:
            return "S1"
        return "S2" if model.dxi(tau, state, *since) > 0 else ""
    H = model.H(tau)
    if state == STICK:
        return "S4" if abs(H) > 1 else ""
    return "S5" if H > 1 else ""


def fixed(
    A: float,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = ETA,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    *,
    dtau: float,
    periods: int,
    section_phase: float = 0.0,
) -> Naive:
    """Compute a motion by §5: a switch is at the first point of the grid τ_k = τ0 + k Δτ after a change of sign."""
    model = Model(A, B, eps, eta)
    out = Recorder(model, tau0, periods, section_phase)
    state, tau_i, xi, dxi = out.start(xi0, dxi0)
    k = 0
    while True:
        k += 1
        tau = tau0 + k * dtau
        if tau > out.end:
            return out.close(state, tau_i, xi, dxi)
        ended = over(model, state, tau, tau_i, xi, dxi)
        if ended:
            state, tau_i, xi, dxi = out.switch(ended, tau, state, tau_i, xi, dxi)


def muller(
    A: float,
    B: float = 0.1,
    eps: float = 0.0,
    eta: float = ETA,
    xi0: float = 0.0,
    dxi0: float = 0.0,
    tau0: float = 0.0,
    *,
    dtau: float,
    tol: float = 1e-7,
    periods: int,
    section_phase: float = 0.0,
) -> Naive:
    """Compute a motion by §4: find the first change of sign at h = jΔτ after a switch, then use Muller's method."""
    model = Model(A, B, eps, eta)
    out = Recorder(model, tau0, periods, section_phase)
    state, tau_i, xi, dxi = out.start(xi0, dxi0)
    j = 0
    while True:
        j += 1
        if tau_i + (j - 1) * dtau > out.end:
            return out.close(state, tau_i, xi, dxi)
        ended = over(model, state, tau_i + j * dtau, tau_i, xi, dxi)
        if not ended:
            continue
        since = (state, tau_i, xi, dxi)
        high_side = model.H(tau_i + j * dtau) > 0

        def g(h: float, ended: str = ended, since: tuple = since, high_side: bool = high_side) -> float:
            tau = since[1] + h
            if ended == "S1":
                return model.xi(tau, *since)
            if ended in ("S2", "S3"):
                dxi = model.dxi(tau, *since)
                return dxi if ended == "S3" else -dxi
            return 1 - model.H(tau) if high_side else 1 + model.H(tau)

        tau = tau_i + muller_zero(g, (j - 1) * dtau, j * dtau, tol)
        if tau > out.end:
            return out.close(state, tau_i, xi, dxi)
        state, tau_i, xi, dxi = out.switch(ended, tau, state, tau_i, xi, dxi)
        j = 0


def muller_zero(g: Callable[[float], float], low: float, high: float, tol: float) -> float:
    """Return the zero of g by Muller's method (1956) in a bracket with g(low) >= 0 > g(high), until |step| < tol.

    The next point is a root of the parabola through the last three points. If this root is complex or outside the
    bracket, the next point is the midpoint of the bracket.
    """
    a, c = low, high
    x = [low, high, 0.5 * (low + high)]
    f = [g(p) for p in x]
    while True:
        if f[2] < 0:
            c = x[2]
        else:
            a = x[2]
        h1, h2 = x[1] - x[0], x[2] - x[1]
        new = math.nan
        if h1 and h2 and h1 + h2:
            d1, d2 = (f[1] - f[0]) / h1, (f[2] - f[1]) / h2
            curve = (d2 - d1) / (h1 + h2)
            slope = d2 + h2 * curve
            under = slope * slope - 4 * f[2] * curve
            if under >= 0:
                bottom = slope + math.copysign(math.sqrt(under), slope)
                new = x[2] - 2 * f[2] / bottom if bottom else x[2]
        if not a <= new <= c:
            new = 0.5 * (a + c)
        if abs(new - x[2]) < tol or c - a < tol:
            return new
        x, f = [x[1], x[2], new], [f[1], f[2], g(new)]


class Recorder:
    """Recorder of switches and section points, which starts each next state with ξ' = 0."""

    def __init__(self, model: Model, tau0: float, periods: int, section_phase: float) -> None:
        self.model, self.tau0 = model, tau0
        self.end = tau0 + 2 * math.pi * periods
        self.section_phase = section_phase
        first = math.floor((tau0 - section_phase) / (2 * math.pi)) + 1
        self.section_k = range(first, first + periods)
        self.switches: list[Switch] = []
        self.section: list[tuple[float, float]] = []

    def start(self, xi: float, dxi: float) -> tuple[int, float, float, float]:
        if dxi:
            state = UP if dxi > 0 else DOWN
        else:
            H = self.model.H(self.tau0)
            state = in_air(H) if xi > 0 else at_obstacle(H)
        return state, self.tau0, xi, dxi

    def pass_sections(self, until: float, *since: Any) -> None:
        """Record section points up to `until`, by the closed form, because section instants are not grid points."""
        while len(self.section) < len(self.section_k):
            tau = self.section_phase + 2 * math.pi * self.section_k[len(self.section)]
            if tau > until:
                return
            self.section.append((self.model.xi(tau, *since), self.model.dxi(tau, *since)))

    def switch(
        self, ended: str, tau: float, state: int, tau_i: float, xi_i: float, dxi_i: float
    ) -> tuple[int, float, float, float]:
        since = (state, tau_i, xi_i, dxi_i)
        self.pass_sections(tau, *since)
        H, xi, dxi = self.model.H(tau), self.model.xi(tau, *since), self.model.dxi(tau, *since)
        if ended == "S1":
            self.record(tau, DOWN, IMPACT, xi, dxi)
            xi = dxi = 0.0
            before, after = IMPACT, at_obstacle(H)
        elif ended in ("S2", "S3"):
            before, after = state, in_air(H)
        else:
            before, after = state, (UP if H > 0 else DOWN)
        self.record(tau, before, after, xi, dxi)
        return after, tau, xi, 0.0

    def record(self, tau: float, before: int, after: int, xi: float, dxi: float) -> None:
        period = math.floor(tau / (2 * math.pi))
        self.switches.append(Switch(tau, period, tau - 2 * math.pi * period, before, after, xi, dxi))

    def close(self, *since: Any) -> Naive:
        self.pass_sections(math.inf, *since)
        return Naive(self.switches, self.section)
