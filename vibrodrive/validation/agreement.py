"""Comparison of a certified motion with the 50-digit reference, and of its switches with their equations."""

import math
from typing import Any, NamedTuple

from vibrodrive.batch.trajectory import Trajectory, simulate
from vibrodrive.model.choices import Status
from vibrodrive.validation.reference import IMPACT, REST, STICK, UP, Oscillator, Reference, Slide, mp, reference

ROUNDING = 2.0**-49  # eight times the spacing of floats at 1, as in the kernels


class Agreement(NamedTuple):
    """Comparison of a certified motion with the reference.

    exact : the reference.
    ours : the certified motion.
    same : number of switches before the first one whose states differ from those of the reference.
    late : largest error of the times of these switches, in τ.
    most : largest number of switches that the reference computes.
    """

    exact: Reference
    ours: Trajectory
    same: int
    late: float
    most: int

    @property
    def agrees(self) -> bool:
        """True if the motion has all switches of the reference and, if the reference is complete, no other switch."""
        whole = len(self.exact.switches) < self.most
        return self.same == len(self.exact.switches) and (not whole or len(self.ours.switches) == self.same)


def follow(scene: dict[str, Any], most: int = 24, periods: int = 60, **settings: Any) -> Agreement:
    """Compare a certified motion with the reference until `most` switches or `periods` periods are reached."""
    exact = reference(**scene, periods=periods, max_switches=most)
    if len(exact.switches) == most:
        span = float(exact.switches[-1].tau) - scene.get("tau0", 0.0)
        periods = min(periods, int(span / (2 * math.pi)) + 2)
    ours = simulate(**scene, transient=0, periods=periods, **settings)
    same, late = 0, 0.0
    for s, row in zip(exact.switches, ours.switches, strict=False):
        if (s.before, s.after) != (row["before"], row["after"]):
            break
        same += 1
        turns = int(row["period"]) - s.period
        late = max(late, abs(float(2 * mp.pi * turns + (mp.mpf(float(row["phase"])) - s.phase))))
    return Agreement(exact, ours, same, late, most)


def flagged(trajectory: Trajectory) -> bool:
    return trajectory.status in (Status.TOO_CLOSE, Status.BUDGET)


class Segment(NamedTuple):
    """State between two switches of a trajectory.

    xi, dxi, tau : ξ, ξ' and τ at its start.
    h : duration, with 50 digits.
    after : the next state.
    """

    state: int
    xi: float
    dxi: float
    tau: Any
    h: Any
    after: int


def segments(trajectory: Trajectory) -> list[Segment]:
    """Return the segments of a motion that is recorded from its start (transient = 0)."""
    a = trajectory.arguments
    xi, dxi, tau = a["xi0"], a["dxi0"], mp.mpf(a["tau0"])
    out: list[Segment] = []
    for row in trajectory.switches:
        then = 2 * mp.pi * int(row["period"]) + mp.mpf(float(row["phase"]))
        state = int(row["before"])
        if state != IMPACT:
            out.append(Segment(state, xi, dxi, tau, then - tau, int(row["after"])))
        tau, dxi = then, 0.0
        xi = 0.0 if IMPACT in (state, row["after"]) else float(row["xi"])
    return out


def oscillator(trajectory: Trajectory) -> Oscillator:
    a = trajectory.arguments
    return Oscillator(a["A"], a["B"], a["eps"], a["eta"])


def slide(model: Oscillator, s: Segment) -> Slide:
    return Slide(mp.mpf(s.xi), mp.mpf(s.dxi), 1 if s.state == UP else -1, model.B, model.waves(s.tau))


def residual(model: Oscillator, s: Segment) -> tuple[float, float]:
    """Return (switching function at the end of a segment, bound of its rounding error).

    The function is computed with the digits that the caller has set in mpmath. The recorded phases at both ends of the
    segment have errors of at least 2**-51. The kernels divide a long slide into parts of two periods, and each part
    adds the rounding of the terms.
    """
    A, AF = float(model.A), float(model.A * model.eps * model.eta**2)
    eta, h = float(model.eta), float(s.h)
    tick = 4 * 2.0**-51
    fresh = 1 + h / (4 * math.pi)
    force = 1 + A + AF + float(model.B)
    if s.state in (STICK, REST):
        g = float(model.H(s.tau + s.h)) - (1 if s.after == UP else -1)
        return g, ROUNDING * force + tick * (A + AF * eta)
    motion = slide(model, s)
    xi, dxi = (float(v) for v in motion.at(s.h))
    speed = A + AF / eta + abs(s.dxi) + (1 + float(model.B)) * h
    if s.after == IMPACT:
        path = s.xi + (speed + force * h) * (1 + h)
        return xi, ROUNDING * fresh * path + tick * (abs(dxi) + speed + 0.5 * force * tick)
    return dxi, ROUNDING * (speed + force * h) + tick * force
