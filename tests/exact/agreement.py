"""Comparison of a certified motion with the 50-digit reference, and of its switches with their equations."""

import functools
import itertools
import math
from typing import Any, NamedTuple

import numpy as np
import pytest

import vibrodrive as vd
from tests.exact.reference import DOWN, IMPACT, REST, SCENES, STICK, UP, Reference, mp, reference

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
    most : largest number of switches that the reference computes.
    """

    exact: Reference
    ours: vd.Trajectory
    same: int
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
    words = [(s.before, s.after) for s in exact.switches], ours.switches[["before", "after"]].tolist()
    equal = [one == other for one, other in zip(*words, strict=False)]
    return Agreement(exact, ours, equal.index(False) if False in equal else len(equal), most)


def flagged(trajectory: vd.Trajectory) -> bool:
    return trajectory.status in (vd.Status.TOO_CLOSE, vd.Status.BUDGET)


# Error bounds

MOST = 100  # largest number of switches of a scene that the reference computes
BUDGET = 3000  # largest number of switches in a period; scenes with chatter need many

BELOW_REFERENCE = 1e-30
"""Possible error of the reference. It is added to each bound, because some gaps are as small as 1e-100."""


class Pair(NamedTuple):
    """Error and error bound of the quantity `what`, at the switch or section point with the index `number`."""

    what: str
    number: int
    error: float
    bound: float


class Held(NamedTuple):
    """Comparison of a motion with the reference.

    pairs : all numbers of the motion with a finite error bound.
    others : above 0 if a switch that is marked as certain has other states than in the reference, or if the motion is
        certain up to its end but has another number of switches.
    """

    motion: vd.Trajectory
    pairs: list[Pair]
    others: int

    @property
    def broken(self) -> list[Pair]:
        """Numbers whose error exceeds the bound."""
        return [p for p in self.pairs if not p.error <= p.bound + BELOW_REFERENCE]

    @property
    def looseness(self) -> float:
        """Ratio of the largest bound to the largest error; NaN if no error is above 0."""
        error, bound = (max((getattr(p, name) for p in self.pairs), default=0.0) for name in ("error", "bound"))
        return bound / error if error > 0.0 else math.nan


def hold(scene: dict[str, Any], most: int = MOST, **method: Any) -> Held:
    """Compare a motion and its error bounds with the reference, from the start of the motion.

    Raises ArithmeticError if the reference finds a zero of order three.
    """
    exact = reference(**scene, max_switches=most)
    motion = vd.simulate(**scene, transient=0, budget=BUDGET, **method)
    return compare(motion, exact, most)


def compare(motion: vd.Trajectory, exact: Reference, most: int = MOST) -> Held:
    """Compare a motion that is recorded from its start with the reference. The reference may end earlier."""
    pairs: list[Pair] = []
    others = 0
    for n, (row, bound, s) in enumerate(zip(motion.switches, motion.switch_errors, exact.switches, strict=False)):
        if not math.isfinite(bound["tau"]):
            break
        if (row["before"], row["after"]) != (s.before, s.after):
            others += 1
            break
        turns = 2 * mp.pi * (int(row["period"]) - s.period)
        late = turns + (mp.mpf(float(row["phase"])) - s.phase)
        found = ("tau", late), ("xi", mp.mpf(float(row["xi"])) - s.xi), ("dxi", mp.mpf(float(row["dxi"])) - s.dxi)
        pairs += [Pair(f"{name} of a switch", n, float(abs(error)), float(bound[name])) for name, error in found]
    if math.isinf(motion.certain_until) and len(exact.switches) < most:
        others += len(motion.switches) != len(exact.switches)
    for n, (point, bounds, there) in enumerate(zip(motion.section, motion.error, exact.section, strict=False)):
        for name, ours, bound, true in zip(("xi", "dxi"), point, bounds, there, strict=True):
            if math.isfinite(bound):
                pairs.append(Pair(f"{name} of the section", n, float(abs(mp.mpf(float(ours)) - true)), float(bound)))
    return Held(motion, pairs, others)


# Grazing

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


def same(swept: vd.Results, index: Any, alone: vd.Trajectory) -> bool:
    """Return True if a point of a sweep has the bits of a single motion, and its status.

    A sweep considers each switch separately. A single motion is also TOO_CLOSE if errors of earlier switches may have
    changed a decision.
    """
    status, counts = swept.status[index], np.bincount(alone.switches["after"], minlength=5)
    inherited = alone.status == vd.Status.TOO_CLOSE and math.isfinite(alone.certain_until)
    return (
        np.array_equal(alone.section, swept.section[index], equal_nan=True)
        and np.array_equal(counts, swept.switches[index])
        and alone.margin == swept.margin[index]
        and (alone.status == status or (inherited and status in (vd.Status.OK, vd.Status.NEVER_LEAVES)))
    )
