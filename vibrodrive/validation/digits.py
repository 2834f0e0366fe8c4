"""Comparison of certified motions with the 50-digit reference, for fixed scenes and for random scenes."""

import math
from typing import Any

import numpy as np

from vibrodrive.batch.trajectory import simulate
from vibrodrive.model.names import ETA
from vibrodrive.validation.agreement import Agreement, flagged, follow, oscillator, residual, segments
from vibrodrive.validation.check import Finding
from vibrodrive.validation.reference import SCENES, mp

LATE = 1e-10
"""Bound of the error of a switching time. For a start from rest at A = 3.04, the error over 20 periods is below 1e-14
at ε = 0 and below 1e-11 at ε = 2e-4. Errors are larger in scenes of up to 1000 periods, with a large gap, or with a
start at τ = -1e4."""

LATE_IN = {"fast disturbance": 1e-8}
"""Bounds for scenes with about twenty short flights in a row. Each of these flights multiplies the error by 2 to 3."""

DRAWN = 60  # number of random scenes; they take about 15 s
SWITCHES = 16  # largest number of compared switches of a random scene

UNSURE = 1e-9
"""Least margin (see `reference`) at which a random scene must agree with the reference. A scene with a smaller margin
may differ from the reference if its status is TOO_CLOSE or BUDGET."""


def fixed_scenes() -> list[Finding]:
    """Return a finding for each scene: its largest error of a switching time, infinite if a state is wrong."""
    found = []
    for name, scene in SCENES.items():
        start = {key: value for key, value in scene.items() if key != "periods"}
        agreement = follow(start, most=10**9, periods=scene["periods"])
        described = ", ".join(f"{key} = {value:g}" for key, value in scene.items())
        late = agreement.late if agreement.agrees else math.inf
        found.append(Finding(f"{name} ({described}): error in τ", late, LATE_IN.get(name, LATE)))
    return found


def draw(seed: int, number: int = DRAWN) -> list[dict[str, float]]:
    """Return random scenes with B up to 1.3, initial gaps ξ up to 5 and initial velocities |ξ'| up to 4.

    η has the value of the paper, or a value from 0.3 to 200. Every second scene has a disturbance.
    """
    generator = np.random.default_rng(seed)

    def scene(disturbed: bool) -> dict[str, float]:
        drawn = {
            "A": generator.uniform(0.5, 5.0),
            "B": generator.uniform(0.0, 1.3),
            "eps": 10.0 ** generator.uniform(-6.0, -3.0) if disturbed else 0.0,
            "eta": generator.choice([ETA, 10.0 ** generator.uniform(-0.5, 2.3)]),
            "xi0": generator.choice([0.0, generator.uniform(0.0, 5.0)]),
            "dxi0": generator.choice([0.0, generator.uniform(-4.0, 4.0)]),
            "tau0": generator.uniform(0.0, 2.0 * math.pi),
        }
        return {name: float(value) for name, value in drawn.items()}

    return [scene(k % 2 == 1) for k in range(number)]


def drawn_scenes(seed: int) -> list[Finding]:
    """Compare the states of random scenes with the reference, and check each switch by its equation.

    The equation describes the motion from the previous computed switch, so this check does not depend on the growth of
    errors.
    """
    scenes = draw(seed)
    another = sum(_differs_clearly(follow(scene, most=SWITCHES, periods=12)) for scene in scenes)
    worst = max(_residual(scene) for scene in scenes)
    return [
        Finding(f"scenes with wrong states that the status does not report ({DRAWN} random, seed {seed})", another, 0),
        Finding("largest residual of a switching function, relative to the bound of its rounding", worst, 1.0),
    ]


def _differs_clearly(found: Agreement) -> bool:
    if found.agrees:
        return False
    margins = [float(s.margin) for s in found.exact.switches[: found.same + 1]]
    return not flagged(found.ours) or min([float(found.exact.margin), found.ours.margin, *margins]) > UNSURE


def _residual(scene: dict[str, Any]) -> float:
    motion = simulate(**scene, transient=0, periods=12)
    model, worst = oscillator(motion), 0.0
    mp.dps = 60
    for segment in segments(motion)[:SWITCHES]:
        value, allowed = residual(model, segment)
        worst = max(worst, abs(value) / allowed)
    return worst
