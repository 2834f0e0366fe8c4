"""Level 0, first zero: draw (choose at random) the inputs of each family, and solve g(τ) = 0 on (0, T].

g(τ) = c0 + c1 τ + c2 τ² + a sin(τ + alpha) + b sin(eta τ + beta)

A function for each family draws its case i. In the docstrings k is an integer that increases with i.
"""

from collections.abc import Callable
from typing import Any

from benchmarks.switches.draw import Draw
from benchmarks.switches.zeros import Function, Zero
from tests.exact.reference import mp

NAMES = ("c0", "c1", "c2", "a", "alpha", "b", "eta", "beta", "T")
DIGITS = 90  # decimal digits of the arithmetic; zeros are stored with 30 digits

Inputs = dict[str, float]
Drawn = tuple[Inputs, list[str], str]  # the fields inputs, tags and why of a case


def function(x: Inputs, span: Any = None) -> Function:
    """Return g on (0, T], or on (0, span]."""
    waves = [(x["a"], 1.0, x["alpha"]), (x["b"], x["eta"], x["beta"])]
    return Function((x["c0"], x["c1"], x["c2"]), waves, x["T"] if span is None else span)


def solve(x: Inputs) -> list[Zero]:
    """Return all zeros in (0, T]."""
    mp.dps = DIGITS
    return function(x).zeros()


def inputs(**given: float) -> Inputs:
    """Return all inputs in their order. An input that is not given is 0, or 1 for eta."""
    return {name: float(given.get(name, 1.0 if name == "eta" else 0.0)) for name in NAMES}


def smooth(draw: Draw) -> Inputs:
    """Return inputs for which g has values of the order of 1 and changes over times of the order of 1."""
    low, high = draw.choice([(-0.5, -0.1), (0.1, 0.5)])
    return inputs(
        c0=draw.uniform(0.2, 3.0),
        c1=draw.uniform(low, high),
        c2=draw.uniform(-0.03, 0.03),
        a=draw.uniform(0.5, 2.0),
        alpha=draw.uniform(0.0, 6.28),
        b=draw.uniform(0.05, 0.4),
        eta=draw.uniform(1.3, 9.0),
        beta=draw.uniform(0.0, 6.28),
        T=draw.uniform(12.0, 25.0, 1),
    )


def tuned(draw: Draw, height: Callable[[Any], Any], make: Callable[[Draw], tuple[Inputs, float]]) -> tuple[Inputs, Any]:
    """Return inputs whose first approach to zero from above is a minimum of g, and the position of this minimum.

    `make` draws inputs and a position near a minimum. Then c0 is chosen so that the minimum has the height
    `height(g'')`, and is rounded to a double. Inputs with an earlier zero, or without a minimum near this position, are
    drawn again.
    """
    mp.dps = DIGITS
    for _ in range(2000):
        x, near = make(draw)
        g, h = function(x), mp.mpf(near)
        for _ in range(60):
            _, dg, ddg, _ = g.at(h)
            if ddg <= 0:
                break
            h -= dg / ddg
            if abs(dg) < mp.mpf(10) ** -60:
                break
        value, dg, ddg, _ = g.at(h)
        if ddg < 1e-2 or abs(dg) > mp.mpf(10) ** -50 or not 0 < h < x["T"]:
            continue
        depth = height(ddg)
        x["c0"] = float(x["c0"] - value + depth)
        before = h - 4 * mp.sqrt(abs(depth) / ddg) - mp.mpf(1e-6) / mp.mpf(x["eta"])
        if before <= 0 or x["c0"] == 0 or function(x).at(mp.zero)[0] < 0:
            continue
        if not function(x, before).zeros(1):
            return x, h
    raise ArithmeticError("no inputs found")


def smooth_place(draw: Draw) -> tuple[Inputs, float]:
    """Return smooth inputs and a position near which g may have a minimum."""
    return smooth(draw), draw.uniform(2.0, 9.0)


def plain(draw: Draw, i: int) -> Drawn:
    """Draw random functions whose zeros are far from each other, or that have no zero."""
    return smooth(draw), [], "Zeros are simple and far from each other: every method should be right."


def close_pair(draw: Draw, i: int) -> Drawn:
    """Draw functions with two zeros 10⁻ᵏ apart: in a smooth g, in a fast ripple, or soon after the start."""
    if i < 14:
        k = 1 + i // 2
        x, _ = tuned(draw, lambda ddg: -ddg * mp.mpf(10) ** (-2 * k) / 8, smooth_place)
        return x, ["smooth"], f"The first two zeros are about 1e-{k} apart; a step over both shows no change of sign."
    if i < 23:
        k = i - 12
        eta = draw.uniform(0.4, 0.9, 3) * float(f"1e{k}")

        def make(draw: Draw) -> tuple[Inputs, float]:
            c1 = -draw.uniform(0.1, 0.4)
            near = draw.uniform(1.0, 2.0)
            b = float(mp.nstr(mp.mpf(draw.uniform(2.0, 4.0)) * -c1 / eta, 8))
            phase = (-mp.pi / 2 - mp.mpf(eta) * near) % (2 * mp.pi)
            T = float(mp.nstr(near + 25 / mp.mpf(eta), 17))
            return inputs(c0=1.0, c1=c1, c2=0.01, a=0.05, alpha=1.0, b=b, eta=eta, beta=float(phase), T=T), near

        x, _ = tuned(draw, lambda ddg: -ddg * mp.mpf(10) ** (-2 * k) / 8, make)
        return x, ["ripple"], f"A ripple is below zero for about 1e-{k}, long before an obvious change of sign."
    k = i - 19
    place = mp.mpf(10) ** (2 - k) * draw.uniform(1.0, 5.0)
    distance = mp.mpf(10) ** -k
    c2, share = draw.uniform(0.5, 2.0), draw.uniform(0.1, 0.4)
    slope = -2 * c2 * place
    a = float(share * slope)
    x = inputs(c1=float(slope - a * mp.cos(place)), c2=c2, a=a, T=1.0)
    x["c0"] = float(-function(x).at(place)[0] - c2 * distance**2 / 4)
    return x, ["soon"], f"Two zeros are about 1e-{k} apart, and a few hundred times this distance after the start."


def near_miss(draw: Draw, i: int) -> Drawn:
    """Draw functions with a minimum of height ±10⁻ᵏ. For both signs g is the same except for c0."""
    k = 1 + i // 2
    sign = 1 if i % 2 == 0 else -1
    x, _ = tuned(Draw(0, 102, k), lambda ddg: sign * mp.mpf(10) ** -k, smooth_place)
    if sign > 0:
        return x, ["above"], f"A minimum is 1e-{k} above zero: there is no zero near it."
    return x, ["below"], f"A minimum is 1e-{k} below zero: there are two zeros near it."


def double_zero(draw: Draw, i: int) -> Drawn:
    """Draw functions with a minimum as close to zero as doubles allow. The last four have an exact double zero."""
    if i < 16:
        x, _ = tuned(draw, lambda ddg: mp.zero, smooth_place)
        return x, ["rounded"], "A minimum is zero within the rounding of c0: one ulp decides if zeros exist."
    place, c2 = ((1.0, 1.0), (2.5, 0.5), (0.75, -4.0), (6.0, -0.125))[i - 16]
    x = inputs(c0=c2 * place**2, c1=-2 * c2 * place, c2=c2, T=10.0)
    return x, ["exact"], "The parabola c2 (τ - r)² has an exact double zero; one ulp gives two zeros or none."


def start(draw: Draw, i: int) -> Drawn:
    """Draw functions with g(0) = 0 and the next zero at about 10⁻ᵏ. The second half has g'(0) = 0, too."""
    if i < 12:
        k = i // 2
        rise = draw.uniform(1.0, 3.0, 2) * float(f"1e-{k}") * (1 if i % 2 else -1)
        a, b, eta = draw.uniform(0.5, 2.0, 2), draw.uniform(0.05, 0.2, 3), draw.uniform(2.0, 7.0, 2)
        c2 = -draw.uniform(0.3, 0.9) if rise > 0 else draw.uniform(0.3, 0.9)
        c1 = float(mp.mpf(rise) - a - mp.mpf(b) * eta)
        x = inputs(c1=c1, c2=c2, a=a, b=b, eta=eta, T=draw.uniform(4.0, 9.0, 1))
        return x, ["simple"], f"g(0) = 0 does not count as a zero; {following(x)}."
    k = (i - 12) // 2
    a = draw.choice([0.5, 0.75, 1.25, 1.5, 2.0])
    c2 = float(mp.mpf(draw.uniform(0.1, 0.3, 3)) * a * mp.mpf(10) ** -k) * (1 if i % 2 else -1)
    x = inputs(c1=-a if c2 > 0 else a, c2=c2, a=a if c2 > 0 else -a, T=draw.uniform(4.0, 9.0, 1))
    return x, ["double"], f"g(0) = g'(0) = 0 does not count as a zero; {following(x)}."


def following(x: Inputs) -> str:
    """Return a clause about the first zero after the start."""
    zeros = solve(x)
    return f"the next zero is at {mp.nstr(zeros[0].at, 2)}" if zeros else "there is no other zero"


STEPS = ("0.3", "0.1", "0.03", "0.01", "0.003", "0.001")


def two_in_a_step(draw: Draw, i: int) -> Drawn:
    """Draw functions with two zeros within a step. There is no other zero, so a method that misses both finds none."""
    step = STEPS[i // 3]

    def make(draw: Draw) -> tuple[Inputs, float]:
        x, near = smooth_place(draw)
        return x | {"T": near + 2.0}, near

    x, h = tuned(draw, lambda ddg: -ddg * (mp.mpf(step) * draw.uniform(0.3, 0.9)) ** 2 / 8, make)
    x["T"] = round(float(h) + 0.8, 3)
    return x, ["even"], f"Two zeros are within a step of {step}: such a step shows no change of sign."


def three_in_a_step(draw: Draw, i: int) -> Drawn:
    """Draw functions with three zeros within a step. The sign changes over the step, but a method may miss the
    first."""
    mp.dps = DIGITS
    step = STEPS[i // 3]
    width = mp.mpf(step) * draw.uniform(0.4, 0.9)
    place, c1 = draw.uniform(1.0, 5.0), -draw.uniform(0.3, 1.5)
    eta = float(mp.nstr(4 / width, 6))
    a, alpha = draw.uniform(0.01, 0.05), draw.uniform(0.0, 6.28)
    b = float(mp.nstr(-c1 * width / 2 / mp.sin(2), 8))
    beta = float((-mp.mpf(eta) * place) % (2 * mp.pi))
    c2 = draw.uniform(-0.01, 0.01)
    x = inputs(c1=c1, c2=c2, a=a, alpha=alpha, b=b, eta=eta, beta=beta, T=round(place + 2.0, 3))
    x["c0"] = float(-function(x).at(mp.mpf(place))[0])
    return x, ["odd"], f"Three zeros are within a step of {step}: a bracket contains all three; the first counts."


PAPER_ETA = float.fromhex("0x1.93fae4461f60fp+6")  # 10 √102


def ending(x: Inputs, more: float, places: int) -> Inputs:
    """Return the inputs with T at the distance `more` after the first zero."""
    mp.dps = DIGITS
    first = function(x).zeros(1)[0].at
    return x | {"T": round(float(first) + more, places)}


def ripple(draw: Draw, i: int) -> Drawn:
    """Draw switching functions of a disturbed motion: ξ' with a small ripple if i is odd, else 1 - H with a large
    ripple."""
    mp.dps = DIGITS
    A, tau = mp.mpf(draw.uniform(1.5, 3.3, 3)), mp.mpf(draw.uniform(-0.4, 0.3))
    eta = draw.choice([PAPER_ETA, draw.uniform(30.0, 200.0, 2)])
    ratio = draw.uniform(0.02, 0.2) if i % 2 else draw.uniform(0.1, 2.0)
    x = inputs(a=float(-A), eta=eta, beta=draw.uniform(0.0, 6.28), T=20.0)
    if i % 2:
        rise = draw.uniform(0.02, 0.6) + ratio * A
        x |= {"c0": float(A * mp.cos(tau + 1) + rise), "c1": -1.1, "alpha": float(tau + 1 + mp.pi / 2)}
        x["b"] = float(-A * ratio)
        why = "The function is the velocity of a disturbed slide. Its ripple causes several zeros."
        return ending(x, 0.5, 2), ["velocity"], why
    level = 1.1 + ratio * A  # at first the force is below the friction
    x |= {"c0": float(level), "alpha": float(tau), "b": float(-A * ratio)}
    why = "The function is the force that ends a wait. Its large ripple causes many zeros."
    return ending(x, 0.2, 2), ["force"], why


def late(draw: Draw, i: int) -> Drawn:
    """Draw functions whose first zero is at about 10² to 10⁶, after a drift or in a beat of two nearly equal waves."""
    if i < 18:
        k = 2 + i // 4
        c1 = -draw.uniform(1.0, 4.0, 2) * float(f"1e-{k}")
        c0, a, b = draw.uniform(0.8, 2.0), draw.uniform(0.05, 0.3), draw.uniform(0.01, 0.05)
        x = inputs(c0=c0, c1=c1, a=a, alpha=draw.uniform(0.0, 6.28), b=b, eta=draw.uniform(2.0, 9.0))
        x["T"] = round(c0 / -c1 + 40.0, 1)
        return ending(x, 30.0, 1), ["drift"], "A slow drift leads to the first zero after a long time."
    k = 2 + (i - 18) // 3
    eta = 1.0 + draw.uniform(0.5, 2.0, 2) * float(f"1e-{k}")
    a, b = draw.uniform(0.5, 1.0), draw.uniform(0.5, 1.0)
    away = draw.uniform(2.8, 3.5)  # the waves begin in opposition, and are in phase half a beat later
    x = inputs(c0=(a + b) * 0.995, a=a, b=b, eta=round(eta, 7), beta=away, T=round(4.0 / (eta - 1.0), 1))
    why = "Two waves of nearly equal frequency reach zero only when they are in phase, late in a beat."
    return ending(x, 30.0, 1), ["beat"], why


def large_phases(draw: Draw, i: int) -> Drawn:
    """Draw functions with phases of 10² to 10⁹. The last two have 10¹² and 10¹⁵, where one ulp moves the zeros."""
    k = 2 + i // 2 if i < 16 else (12, 15)[i - 16]
    x = smooth(draw)
    size = float(f"1e{k}")
    x["alpha"] = round(draw.uniform(1.0, 9.0, 9) * size, 3) * draw.choice([1, -1])
    x["beta"] = round(draw.uniform(1.0, 9.0, 9) * size, 3) * draw.choice([1, -1])
    return x, [f"1e{k}"], f"Phases of about 1e{k}: τ + alpha loses digits if alpha is not reduced first."


FAMILIES: dict[str, tuple[int, Callable[[Draw, int], Drawn]]] = {
    "plain": (24, plain),
    "close pair": (34, close_pair),
    "near miss": (32, near_miss),
    "double zero": (20, double_zero),
    "zero at the start": (24, start),
    "two in a step": (18, two_in_a_step),
    "three in a step": (18, three_in_a_step),
    "ripple": (24, ripple),
    "late": (24, late),
    "large phases": (18, large_phases),
}
"""For each family, the number of cases and the function that draws case i."""
