"""Holding a certified trajectory against the 50-digit reference, and its switches against their own equations."""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np

import vibrodrive as vd
from tests.support.reference import DOWN, IMPACT, REST, STICK, UP, Oscillator, Reference, Slide, mp, reference

ROUNDING = 2.0**-49  # eight units in the last place, as the kernels allow themselves


class Agreement(NamedTuple):
    """`same`: how many switches agree in their states, from the first on; `late`: largest error of their times."""

    exact: Reference
    ours: vd.Trajectory
    same: int
    late: float
    most: int

    @property
    def agrees(self) -> bool:
        """Whether every switch of the reference is there and, where it went to the end, no other."""
        whole = len(self.exact.switches) < self.most
        return self.same == len(self.exact.switches) and (not whole or len(self.ours.switches) == self.same)


def follow(scene: dict[str, float], most: int = 24, periods: int = 60, **settings: Any) -> Agreement:
    """Both motions over `most` switches or `periods` periods, whichever is less."""
    exact = reference(**scene, periods=periods, max_switches=most)
    if len(exact.switches) == most:
        span = float(exact.switches[-1].tau) - scene.get("tau0", 0.0)
        periods = min(periods, int(span / (2 * math.pi)) + 2)
    ours = vd.simulate(**scene, transient=0, periods=periods, **settings)
    same, late = 0, 0.0
    for s, row in zip(exact.switches, ours.switches, strict=False):
        if (s.before, s.after) != (row["before"], row["after"]):
            break
        same += 1
        turns = int(row["period"]) - s.period
        late = max(late, abs(float(2 * mp.pi * turns + (mp.mpf(float(row["phase"])) - s.phase))))
    return Agreement(exact, ours, same, late, most)


def flagged(trajectory: vd.Trajectory) -> bool:
    return trajectory.status in (vd.Status.TOO_CLOSE, vd.Status.BUDGET)


def check_decisions(scene: dict[str, float], most: int = 24, periods: int = 60) -> Agreement:
    """The states agree, or the trajectory says that a decision was too close to call."""
    found = follow(scene, most, periods)
    assert found.agrees or flagged(found.ours), (scene, found.same, found.ours.status, found.ours.margin)
    check_above_obstacle(found.ours)
    return found


def check_above_obstacle(trajectory: vd.Trajectory) -> None:
    """ξ >= 0 at every switch, in the section, and (where it is cheap to look) between."""
    assert (trajectory.switches["xi"] >= 0).all()
    section = trajectory.section[:, 0]
    assert (section[np.isfinite(section)] >= 0).all()
    if len(section) <= 20:
        xi = trajectory.sample(64).xi
        xi = xi[np.isfinite(xi)]
        assert (xi >= -ROUNDING * (1 + np.abs(xi).max(initial=0.0))).all()


class Segment(NamedTuple):
    """A state between two switches as the trajectory has it: how it began, and how long it lasted (50 digits)."""

    state: int
    xi: float
    dxi: float
    tau: Any
    h: Any
    after: int


def segments(trajectory: vd.Trajectory) -> list[Segment]:
    """The motion from the start on, which must have been recorded (transient = 0)."""
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


def oscillator(trajectory: vd.Trajectory) -> Oscillator:
    a = trajectory.arguments
    return Oscillator(a["A"], a["B"], a["eps"], a["eta"])


def slide(model: Oscillator, s: Segment) -> Slide:
    return Slide(mp.mpf(s.xi), mp.mpf(s.dxi), 1 if s.state == UP else -1, model.B, model.waves(s.tau))


def residual(model: Oscillator, s: Segment) -> tuple[float, float]:
    """The switching function that ended a segment, evaluated in 50 digits there, and what rounding allows it.

    A recorded phase is good to 2**-51 at best, at either end; the rest is the rounding of the terms, once more
    for every two periods, after which a long slide is continued from a fresh start.
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
        return xi, ROUNDING * fresh * path + tick * (abs(dxi) + speed)
    return dxi, ROUNDING * (speed + force * h) + tick * force


def switching_functions(trajectory: vd.Trajectory, count: int = 200) -> list[tuple[Segment, np.ndarray, float]]:
    """For each segment the valid switching functions (positive while it lasts) at `count` instants inside, in doubles.

    Returns (segment, values (functions, count), rounding).
    """
    model = oscillator(trajectory)
    A, B, eps, eta = (trajectory.arguments[k] for k in ("A", "B", "eps", "eta"))
    AF = A * eps * eta**2
    out = []
    for s in segments(trajectory):
        h = np.linspace(0, float(s.h), count + 2)[1:-1]
        phi, theta = float(mp.fmod(s.tau, 2 * mp.pi)), float(mp.fmod(model.eta * s.tau, 2 * mp.pi))
        if s.state in (STICK, REST):
            H = A * np.sin(phi + h) + AF * np.sin(theta + eta * h) - B
            values = np.stack([1 - H, 1 + H] if s.state == STICK else [1 - H])
            noise = 64 * ROUNDING * (1 + A + AF * (1 + eta * float(s.h)) + B)
        else:
            sign = 1 if s.state == UP else -1
            fast = A * eps
            v = s.dxi - (B + sign) * h - A * (np.cos(phi + h) - np.cos(phi))
            v -= fast * eta * (np.cos(theta + eta * h) - np.cos(theta))
            slope = s.dxi + A * math.cos(phi) + fast * eta * math.cos(theta)
            x = s.xi + slope * h - (B + sign) * h**2 / 2 - A * (np.sin(phi + h) - math.sin(phi))
            x -= fast * (np.sin(theta + eta * h) - math.sin(theta))
            values = np.stack([v] if s.state == UP else [-v, x])
            terms = s.xi + (1 + float(s.h)) * (abs(slope) + A + fast * eta + (1 + B) * (1 + float(s.h)))
            noise = 64 * ROUNDING * terms * (1 + 1e-2 * eta * float(s.h))
        out.append((s, values, noise))
    return out


ALLOWED = {
    (UP, DOWN), (UP, STICK), (DOWN, IMPACT), (DOWN, UP), (DOWN, STICK),
    (STICK, UP), (STICK, DOWN), (REST, UP), (IMPACT, UP), (IMPACT, REST),
}  # fmt: skip
"""Fig. 2: every pair of a state and its successor."""


def check_order(trajectory: vd.Trajectory) -> None:
    """Every switch is one of Fig. 2's and begins in the state the last one ended in."""
    rows = trajectory.switches
    for row in rows:
        assert (row["before"], row["after"]) in ALLOWED
    for a, b in itertools.pairwise(rows):
        assert a["after"] == b["before"]
        assert (a["period"], a["phase"]) <= (b["period"], b["phase"])
