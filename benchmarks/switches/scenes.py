"""Levels 2 and 3: motions of 20 and 200 periods. A scene (the parameters and the start of a motion) is from the paper,
from the reference (tests/exact), or random."""

from collections.abc import Callable

from benchmarks.switches import motions
from benchmarks.switches.draw import Draw
from benchmarks.switches.motions import Inputs, inputs
from tests.exact.reference import SCENES, reference, with_digits

Drawn = tuple[Inputs, list[str], str]  # the fields inputs, tags and why of a case
FEWEST, MOST = 20, 60  # least and largest number of events in 20 periods of a random scene; MOST limits its file

PAPER = ((1.5, 0.0), (2.2, 0.0), (2.65, 0.0), (3.04, 0.0), (3.15, 0.0), (3.04, 5e-5), (3.04, 2e-4), (3.15, 2e-4))
KNOWN = ("level plane", "steep", "slides by itself", "barely holds", "slow disturbance", "thrown", "late start")


def paper(draw: Draw, i: int) -> Drawn:
    """Return a scene with an amplitude and a disturbance of the paper, from rest."""
    A, eps = PAPER[i]
    return inputs(A=A, eps=eps), [], f"The paper's motion at A = {A}, from rest."


def known(draw: Draw, i: int) -> Drawn:
    """Return a scene of the reference."""
    scene = SCENES[KNOWN[i]] | {"periods": 20}
    return inputs(**scene), [], f"A motion that the paper does not have: {KNOWN[i]}."


def hard_spot(draw: Draw, i: int) -> Drawn:
    """Return the scene of the paper's motion at A = 3.04 with ε = 2e-4."""
    why = "In period 92 two zeros of ξ' are 7.25e-4 apart. A method that misses them is wrong from this period on."
    return inputs(A=3.04, eps=2e-4, periods=200), ["paper"], why


def drawn(periods: int, scene: Callable[[Draw], Inputs], why: str) -> Callable[[Draw, int], Drawn]:
    """Return a function that calls `scene` until it returns a scene with FEWEST to MOST switches in 20 periods. The
    function returns this scene with `periods` periods."""

    def make(draw: Draw, i: int) -> Drawn:
        while True:
            x = scene(draw)
            values = {name: x[name] for name in motions.NAMES[:-1]}
            with with_digits(20):
                count = len(reference(**values, periods=20, max_switches=MOST + 1).switches)
            if FEWEST <= count <= MOST:
                return x | {"periods": float(periods)}, [], why

    return make


def undisturbed(draw: Draw) -> Inputs:
    """Return a scene with ε = 0."""
    return inputs(A=draw.uniform(1.3, 3.4, 3))


def disturbed(draw: Draw) -> Inputs:
    """Return a scene with the paper's η."""
    return inputs(A=draw.uniform(1.6, 3.4, 3), eps=draw.choice([2e-5, 5e-5, 1e-4, 2e-4, 3e-4]))


def slow(draw: Draw) -> Inputs:
    """Return a scene with a disturbance of low frequency."""
    eta = draw.uniform(0.3, 12.0, 2)
    return inputs(A=draw.uniform(1.6, 3.2, 3), eta=eta, eps=round(draw.uniform(0.05, 0.6) / (1 + eta**2), 5))


def incline(draw: Draw) -> Inputs:
    """Return a scene on another incline, from another start."""
    eta = draw.uniform(20.0, 200.0, 2)
    eps = draw.choice([0.0, round(draw.uniform(0.2, 1.5) / eta**2, 7)])
    start = {"xi0": draw.uniform(0.2, 4.0, 2), "dxi0": draw.uniform(-1.5, 1.5, 2), "tau0": draw.uniform(-9.0, 9.0, 2)}
    return inputs(A=draw.uniform(1.6, 3.6, 3), B=draw.uniform(0.0, 0.7, 3), eta=eta, eps=eps, **start)


def families(periods: int, counts: tuple[int, int, int, int]) -> dict[str, tuple[int, Callable[[Draw, int], Drawn]]]:
    """Return for each of the four families of random scenes the number of cases and the function that draws case i."""
    kinds = {
        "undisturbed": (undisturbed, "A is random, and there is no disturbance."),
        "disturbed": (disturbed, "A and ε are random, and η is that of the paper."),
        "slow disturbance": (slow, "The disturbance is random and has a low frequency."),
        "another incline": (incline, "Incline and start are random, with or without a fast disturbance."),
    }
    return {
        name: (count, drawn(periods, scene, why))
        for (name, (scene, why)), count in zip(kinds.items(), counts, strict=True)
    }


LEVEL2 = {"paper": (len(PAPER), paper), "known": (len(KNOWN), known), **families(20, (2, 2, 2, 3))}
LEVEL3 = {"hard spot": (1, hard_spot), **families(200, (5, 6, 4, 5))}
