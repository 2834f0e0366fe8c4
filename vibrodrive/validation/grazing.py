"""Check of slides whose lowest point, without the obstacle, would be just above or just below the obstacle."""

from typing import Any

from vibrodrive.batch.trajectory import simulate
from vibrodrive.model.choices import Status
from vibrodrive.model.states import State
from vibrodrive.validation.agreement import ROUNDING
from vibrodrive.validation.check import Finding
from vibrodrive.validation.reference import mp, reference

LADDER = [sign * 10.0**-k for k in range(3, 16) for sign in (1, -1)] + [0.0]
"""Heights of the lowest point: ±1e-3 … ±1e-15 and 0."""

THROWS: dict[str, dict[str, float]] = {
    "undisturbed": {"A": 3.04, "dxi0": -2.0, "tau0": 2.5},
    "steep": {"A": 2.2, "B": 0.6, "dxi0": -0.7, "tau0": 3.0},
    "level": {"A": 1.7, "B": 0.0, "dxi0": -3.1, "tau0": -40.0},
    "disturbed": {"A": 3.04, "eps": 2e-4, "dxi0": -1.5, "tau0": 2.2},
    "slow disturbance": {"A": 2.6, "eps": 0.01, "eta": 7.3, "dxi0": -2.5, "tau0": 1.0},
    "fast disturbance": {"A": 1.9, "B": 0.2, "eps": 2e-5, "eta": 431.7, "dxi0": -1.0, "tau0": 2.9},
    "from great height": {"A": 4.5, "B": 0.9, "dxi0": -20.0, "tau0": 0.3},
}
"""Starts of slides down, by name. A slide ends in the air if its initial gap is large enough."""


def lowest(scene: dict[str, Any], height: float) -> Any:
    """Return ξ at the first reversal of a slide down minus ξ at its start, in 50 digits."""
    first = reference(**scene, xi0=height, periods=100, max_switches=1).switches[0]
    if first.before != State.DOWN or first.after == State.IMPACT:
        raise ValueError(f"{scene} from {height:g}: no slide down that turns in the air")
    return first.xi - mp.mpf(height)


def grazing_ladder() -> list[Finding]:
    """Return two findings: wrong decisions without the status TOO_CLOSE, and TOO_CLOSE where rounding is negligible."""
    wrong = timid = 0
    for scene in THROWS.values():
        drop = lowest(scene, 1e6)
        for wanted in LADDER:
            height = float(mp.mpf(wanted) - drop)
            depth = float(mp.mpf(height) + drop)  # the height is rounded to a double
            arguments: dict[str, Any] = {**scene, "xi0": height}
            motion = simulate(**arguments, transient=0, periods=30)
            close = motion.status == Status.TOO_CLOSE
            impact = motion.switches[0]["after"] == State.IMPACT
            wrong += impact != (depth <= 0) and not close
            terms = height + (abs(scene["dxi0"]) + 8) * 8
            timid += close and abs(depth) > 100 * ROUNDING * terms and motion.margin >= 0.9 * abs(depth)
    rungs = len(THROWS) * len(LADDER)
    return [
        Finding(f"wrong decisions that the status does not report ({rungs} flights)", int(wrong), 0),
        Finding("flights with the status TOO_CLOSE although rounding is at most 1 % of the height", int(timid), 0),
    ]
