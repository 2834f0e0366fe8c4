"""Comparison of motions and their error bounds with the 50-digit reference, in random scenes of twelve kinds.

No error may be above its bound, and no switch marked as certain may have a wrong state.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

import vibrodrive as vd
from tests.exact.reference import Reference, mp, reference

Scene = dict[str, Any]

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


def hold(scene: Mapping[str, Any], most: int = MOST, **settings: Any) -> Held:
    """Compare a motion and its error bounds with the reference, from the start of the motion.

    Raises ArithmeticError if the reference finds a zero of order three.
    """
    exact = reference(**scene, max_switches=most)
    motion = vd.simulate(**scene, transient=0, budget=BUDGET, **settings)
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


def _thrown(draw: np.random.Generator) -> Scene:
    scene = {"tau0": draw.choice([-1.0, 1.0]) * 10.0 ** draw.uniform(-6.0, 1.0)} if draw.random() < 0.5 else {}
    scene |= {"xi0": draw.uniform(0.0, 5.0)} if draw.random() < 0.5 else {}
    return scene | ({"dxi0": 3.0 * draw.normal()} if draw.random() < 0.5 else {})


def _undisturbed(draw: np.random.Generator) -> Scene:
    scene = {"A": draw.uniform(1.05, 9.0), "B": draw.choice([0.0, 0.1, 0.5, draw.uniform(0.0, 1.5)]), "periods": 40}
    return scene | _thrown(draw)


def _onset(draw: np.random.Generator) -> Scene:
    b = draw.choice([0.0, 0.1, 0.6])
    return {"A": (1.0 + b) * (1.0 + 10.0 ** draw.uniform(-8.0, -1.0)), "B": b, "periods": 10}


def _any_disturbance(draw: np.random.Generator) -> Scene:
    eta = 10.0 ** draw.uniform(-0.5, 3.0)
    scene = {"A": draw.uniform(1.05, 9.0), "B": draw.choice([0.0, 0.1, 0.5, 1.3]), "eta": eta, "periods": 4}
    return scene | {"eps": 10.0 ** draw.uniform(-8.0, 0.5) / eta**2} | _thrown(draw)


def _slow(draw: np.random.Generator) -> Scene:
    scene = {"A": draw.uniform(1.05, 9.0), "eta": draw.uniform(0.05, 3.0), "eps": 10.0 ** draw.uniform(-6.0, 0.0)}
    return scene | {"periods": 30} | _thrown(draw)


def _ripple(draw: np.random.Generator) -> Scene:
    eta = 10.0 ** draw.uniform(2.0, 4.0)
    return {"A": draw.uniform(1.2, 6.0), "eta": eta, "eps": 10.0 ** draw.uniform(-1.0, 2.0) / eta**2, "periods": 1}


def _fast(draw: np.random.Generator) -> Scene:
    speed = 10.0 ** draw.uniform(1.0, 5.0)
    scene = {"A": draw.uniform(1.2, 6.0), "xi0": speed * draw.uniform(0.1, 12.0)}
    return scene | {"dxi0": -speed * draw.choice([1.0, 0.01]), "eps": draw.choice([0.0, 1e-4]), "periods": 8}


def _boundary(draw: np.random.Generator) -> Scene:
    a, b = draw.uniform(1.7, 9.0), draw.choice([0.0, 0.1, 0.6])
    off = draw.choice([0.0, 1e-12, -1e-10, 1e-6])
    scene = {"A": a, "B": b, "tau0": math.pi - math.asin((b + 1.0) / a) + off, "xi0": draw.choice([0.0, 1.0])}
    return scene | {"eps": draw.choice([0.0, 1e-9, 1e-6]), "periods": 5}


def _small_gap(draw: np.random.Generator) -> Scene:
    return {
        "A": draw.uniform(1.2, 9.0), "xi0": 10.0 ** draw.uniform(-60.0, 0.0), "tau0": draw.uniform(0.0, 7.0),
        "eta": 10.0 ** draw.uniform(0.0, 3.0), "eps": draw.choice([0.0, 1e-7]), "periods": 5,
    }  # fmt: skip


BANDS: dict[str, Callable[[np.random.Generator], Scene]] = {
    "start from rest, A up to 3.25": lambda draw: {"A": draw.uniform(1.12, 3.25), "periods": 60},
    "any start, ε = 0": _undisturbed,
    "long motion": lambda draw: {"A": draw.uniform(3.0, 9.0), "B": draw.choice([0.1, 0.6]), "periods": 120},
    "A up to 10⁶": lambda draw: {"A": 10.0 ** draw.uniform(1.0, 6.0), "B": draw.choice([0.0, 0.1, 0.6]), "periods": 10},
    "A close to the onset": _onset,
    "disturbed, η of the paper": lambda draw: {
        "A": draw.uniform(1.2, 9.0), "eps": 10.0 ** draw.uniform(-6.0, -2.5), "periods": 5,
    },
    "disturbed, any η": _any_disturbance,
    "slow disturbance": _slow,
    "fast disturbance, ε η² up to 100": _ripple,
    "fast impact": _fast,
    "start where H falls to 1": _boundary,
    "small gap": _small_gap,
}  # fmt: skip
"""Functions that draw a random scene, by the kind of scene."""


def draw(seed: int, number: int) -> list[tuple[str, Scene]]:
    """Return pairs (kind, arguments) of scenes with random section phases. All kinds occur in turn."""
    generator = np.random.default_rng(seed)
    bands = list(BANDS.items())
    scenes = []
    for k in range(number):
        name, drawn = bands[k % len(bands)]
        scene = {"B": 0.1, "eps": 0.0, "eta": vd.ETA} | drawn(generator)
        scene["section_phase"] = generator.choice([0.0, generator.uniform(0.0, 2.0 * math.pi)])
        scenes.append((name, {key: int(v) if key == "periods" else float(v) for key, v in scene.items()}))
    return scenes
