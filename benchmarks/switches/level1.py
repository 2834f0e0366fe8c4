"""Level 1, one segment: draw (choose at random) a state, and compute the first event that ends this state.

A function for each family draws its case i. In the docstrings k is an integer that increases with i.
"""

from collections.abc import Callable
from typing import Any

from benchmarks.switches import motions
from benchmarks.switches.draw import Draw
from benchmarks.switches.motions import Inputs, inputs
from benchmarks.switches.zeros import Function
from tests.exact.reference import Oscillator, Slide, mp

Drawn = tuple[Inputs, list[str], str]  # the fields inputs, tags and why of a case


def scene(draw: Draw, disturbed: bool) -> Inputs:
    """Return a scene (the parameters and the start of a motion) similar to those of the paper."""
    eps = draw.choice([5e-5, 1e-4, 2e-4]) if disturbed else 0.0
    return inputs(A=draw.uniform(1.5, 3.3, 3), eps=eps, tau0=draw.uniform(0.0, 6.28))


def oscillator(x: Inputs) -> Oscillator:
    """Return the oscillator of these inputs, and set the precision to motions.DIGITS digits."""
    mp.dps = motions.DIGITS
    return Oscillator(x["A"], x["B"], x["eps"], x["eta"])


def plain(draw: Draw, i: int) -> Drawn:
    """Draw a slide up that ends without any difficulty."""
    x = scene(draw, i % 2 == 1) | {"xi0": draw.uniform(0.5, 3.0), "dxi0": draw.uniform(0.5, 2.0)}
    return x, [], "A slide up ends where ξ' falls to zero."


def impact_or_reversal(draw: Draw, i: int) -> Drawn:
    """Draw a slide down near the obstacle."""
    x = scene(draw, i % 2 == 1) | {"xi0": draw.uniform(0.1, 1.5), "dxi0": -draw.uniform(0.1, 1.5)}
    return x, [], "A slide down ends at the obstacle, or earlier if ξ' rises to zero."


def grazing(draw: Draw, i: int) -> Drawn:
    """Draw a slide down that reverses 10⁻ᵏ before the obstacle, or would reverse 10⁻ᵏ behind it without the
    obstacle."""
    k = 1 + i // 2
    draw = Draw(1, 102, k)
    miss = mp.mpf(10) ** -k
    while True:
        x = scene(draw, k % 2 == 1) | {"dxi0": -draw.uniform(0.3, 1.5)}
        model = oscillator(x)
        slide = Slide(mp.zero, mp.mpf(x["dxi0"]), -1, model.B, model.waves(mp.mpf(x["tau0"])))
        lowest = slide.at(slide.reversal(mp.inf))[0]
        if -lowest > 2 * miss:  # the start is above the obstacle
            break
    if i % 2 == 0:
        x["xi0"] = float(-lowest + miss)
        return x, ["miss"], f"The slide stops 1e-{k} before the obstacle: no impact."
    x["xi0"] = float(-lowest - miss)
    return x, ["hit"], f"The slide would stop 1e-{k} behind the obstacle: there is a slow impact."


def both_sides(draw: Draw, i: int) -> Drawn:
    """Draw sticking that ends at H = 1 or H = -1."""
    while True:
        x = inputs(A=draw.uniform(1.2, 2.5, 3), B=draw.uniform(0.0, 0.3), xi0=1.0, tau0=draw.uniform(-0.4, 3.5))
        x["eta"] = draw.uniform(5.0, 150.0, 2)
        x["eps"] = float(mp.nstr(draw.uniform(0.2, 1.5) / mp.mpf(x["eta"]) ** 2, 5))
        if abs(oscillator(x).H(mp.mpf(x["tau0"]))) < 0.95:
            return x, [], "Sticking ends at H = 1 or at H = -1; a step may contain both."


def short_slide(draw: Draw, i: int) -> Drawn:
    """Draw a start from rest with H = 1 + 10⁻ᵏ. H increases if i is odd, and decreases otherwise."""
    k = 2 + i
    x = inputs(A=draw.uniform(1.3, 3.0, 3), xi0=draw.choice([0.0, 1.0]))
    model = oscillator(x)
    angle = mp.asin((1 + model.B + mp.mpf(10) ** -k) / model.A)
    if i % 2:
        x["tau0"] = float(angle)
        return x, ["long"], f"The slide begins with ξ' = 0 and H = 1 + 1e-{k}: its end is not the zero at its start."
    x["tau0"] = float(mp.pi - angle)
    return x, ["short"], f"H decreases, and is 1 + 1e-{k} at the start: the duration of the slide is of this order."


def dip(draw: Draw, i: int) -> Drawn:
    """Draw a slide up with a minimum of ξ' at ±10⁻ᵏ, caused by the ripple."""
    k = (2, 3, 5, 7, 9, 11)[i // 2]
    draw = Draw(1, 105, k)
    while True:
        x = inputs(A=draw.uniform(1.8, 3.2, 3), tau0=draw.uniform(0.0, 2.5), xi0=1.0, eta=draw.uniform(8.0, 120.0, 2))
        x["eps"] = float(mp.nstr(draw.uniform(0.5, 3.0) / mp.mpf(x["eta"]) ** 2, 5))
        model = oscillator(x)
        waves = model.waves(mp.mpf(x["tau0"]))
        slide = Slide(mp.zero, mp.zero, 1, model.B, waves)
        force = Function((-(1 + model.B), 0, 0), waves, 4)  # ξ''
        lows: list[Any] = []  # minima of ξ' that are lower than all earlier minima
        for z in force.zeros():
            speed = slide.at(z.at)[1]
            if z.slope > 0 and speed < min(lows, default=mp.zero):
                lows.append(speed)
        if lows:
            break
    miss = mp.mpf(10) ** -k
    sign = 1 if i % 2 == 0 else -1
    x["dxi0"] = float(-lows[0] + sign * miss)
    if sign > 0:
        return x, ["above"], f"A minimum of the ripple has ξ' = 1e-{k}: the slide continues."
    return x, ["below"], f"A minimum of the ripple has ξ' = -1e-{k}: the slide ends before it."


def late_start(draw: Draw, i: int) -> Drawn:
    """Draw a segment that starts at τ of 10² to 10⁸."""
    k = (2, 3, 4, 5, 6, 7, 8, 6)[i]
    x = scene(draw, i % 2 == 1) | {"xi0": draw.uniform(0.3, 2.0), "dxi0": draw.uniform(0.3, 1.5) * draw.choice([1, -1])}
    x["tau0"] = round(draw.uniform(1.0, 9.0, 8) * float(f"1e{k}"), 2) * (-1 if i == 7 else 1)
    return x, [f"1e{k}"], f"τ is about 1e{k}: few digits remain after the decimal point."


FAMILIES: dict[str, tuple[int, Callable[[Draw, int], Drawn]]] = {
    "plain": (6, plain),
    "impact or reversal": (10, impact_or_reversal),
    "grazing": (30, grazing),
    "both sides of friction": (10, both_sides),
    "short slide": (10, short_slide),
    "dip": (12, dip),
    "late start": (8, late_start),
}
"""For each family, the number of cases and the function that draws case i."""
