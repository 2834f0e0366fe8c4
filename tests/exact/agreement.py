"""Comparison of a certified motion with the 50-digit reference, and of its switches with their equations."""

import functools
import itertools
import math
from typing import Any, NamedTuple

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.reference import (
    DOWN,
    IMPACT,
    REST,
    SCENES,
    STICK,
    UP,
    Oscillator,
    Reference,
    Slide,
    mp,
    reference,
)

ROUNDING = 2.0**-49  # eight times the spacing of floats at 1, as in the kernels


LONG = pytest.mark.slow("5 to 20 s each: hundreds of switches at 50 digits")

NAMES = [
    pytest.param(name, marks=[LONG] * (name in ("one-periodic", "two-periodic", "fast disturbance"))) for name in SCENES
]
"""Names of SCENES, as parameters of a test."""


@functools.cache
def scene(name: str) -> Reference:
    """Return the motion of one of SCENES by the reference, computed once in a test run."""
    return reference(**SCENES[name])


class Agreement(NamedTuple):
    """Comparison of a certified motion with the reference.

    exact : the reference.
    ours : the certified motion.
    same : number of switches before the first one whose states differ from those of the reference.
    late : largest error of the times of these switches, in τ.
    most : largest number of switches that the reference computes.
    """

    exact: Reference
    ours: vd.Trajectory
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


def segments(trajectory: vd.Trajectory) -> list[Segment]:
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


def oscillator(trajectory: vd.Trajectory) -> Oscillator:
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


LADDER = [sign * 10.0**-k for k in range(3, 16) for sign in (1, -1)] + [0.0]
"""Heights of the lowest point of a slide: ±1e-3 … ±1e-15 and 0."""


def lowest(scene: dict[str, Any], height: float = 1e6) -> Any:
    """Return ξ at the first reversal of a slide down minus ξ at its start, in 50 digits."""
    first = reference(**scene, xi0=height, periods=100, max_switches=1).switches[0]
    assert first.before == DOWN, f"{scene}: no slide down"
    assert first.after != IMPACT, f"{scene}: the slide ends at the obstacle"
    return first.xi - mp.mpf(height)


# Assertions


def check_decisions(scene: dict[str, float], most: int = 24, periods: int = 60) -> Agreement:
    """Return the comparison with the reference. Assert that the states agree or the status is TOO_CLOSE or BUDGET."""
    found = follow(scene, most, periods)
    assert found.agrees or flagged(found.ours), (scene, found.same, found.ours.status, found.ours.margin)
    check_above_obstacle(found.ours)
    return found


def check_above_obstacle(trajectory: vd.Trajectory) -> None:
    """Assert that ξ >= 0 at every switch and section point. In short records, check the motion between these, too."""
    assert (trajectory.switches["xi"] >= 0).all()
    section = trajectory.section[:, 0]
    assert (section[np.isfinite(section)] >= 0).all()
    if len(section) <= 20:
        xi = trajectory.sample(64).xi
        xi = xi[np.isfinite(xi)]
        assert (xi >= -ROUNDING * (1 + np.abs(xi).max(initial=0.0))).all()


def switching_functions(trajectory: vd.Trajectory, count: int = 200) -> list[tuple[Segment, np.ndarray, float]]:
    """Return (segment, values, bound) for each segment.

    values : the switching functions, which are positive during the segment, at `count` instants: (functions, count)
    bound : bound of the rounding errors of the values
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
"""Fig. 2: all pairs of a state and its successor."""


def check_order(trajectory: vd.Trajectory) -> None:
    """Assert that each switch is a transition of Fig. 2, and starts from the state after the previous switch."""
    rows = trajectory.switches
    for row in rows:
        assert (row["before"], row["after"]) in ALLOWED
    for a, b in itertools.pairwise(rows):
        assert a["after"] == b["before"]
        assert (a["period"], a["phase"]) <= (b["period"], b["phase"])


def same_status(alone: vd.Trajectory, swept: int) -> bool:
    """Return True if a single motion has the status that it has in a sweep.

    A sweep considers each switch separately. A single motion is also TOO_CLOSE if errors of earlier switches may have
    changed a decision.
    """
    inherited = alone.status == vd.Status.TOO_CLOSE and math.isfinite(alone.certain_until)
    return alone.status == swept or (inherited and swept in (vd.Status.OK, vd.Status.NEVER_LEAVES))
