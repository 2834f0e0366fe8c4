"""Assertions that a certified motion agrees with the 50-digit reference, and with the model."""

import itertools
import math

import numpy as np

import vibrodrive as vd
from vibrodrive.validation.agreement import ROUNDING, Agreement, Segment, flagged, follow, oscillator, segments
from vibrodrive.validation.reference import DOWN, IMPACT, REST, STICK, UP, mp


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
