"""Draw the picture of docs/certified.md: a switching function, and the parabolas below it that lead to its first zero.

    python -m examples.parabola   # in the root of a clone

writes parabola.png. In this example, with a fast disturbance, the mass rests at the obstacle until H = 1, so the
switching function is g = 1 − H. The bounds and steps are implemented here independently of the kernels.
"""

import math
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

import vibrodrive as vd

A, B, EPS, ETA = 3.04, 0.1, 2e-5, vd.ETA


@dataclass(frozen=True)
class Step:
    """The parabola value + slope s + bend s²/2, with s = τ − start: a lower bound of g for 0 <= s <= length."""

    start: float
    length: float
    value: float
    slope: float
    bend: float

    def at(self, s: np.ndarray) -> np.ndarray:
        return self.value + self.slope * s + 0.5 * self.bend * s**2


def g(tau: np.ndarray | float, order: int = 0, slow: float = 1.0, fast: float = 1.0) -> np.ndarray:
    """Return g = 1 − H, or its derivative of this order. `slow` and `fast` are factors (1 or 0) of the parts of g."""
    constant = slow * (1.0 + B) if order == 0 else 0.0
    turn = 0.5 * math.pi * order
    own = slow * A * np.sin(np.asarray(tau) + turn)
    return constant - own - fast * A * EPS * ETA ** (2 + order) * np.sin(ETA * np.asarray(tau) + turn)


def below_all(start: float, reach: float) -> Step:
    """Return the parabola below g that follows from the bound of |g'''|. It ends at its root, or at s = `reach`."""
    m3 = A + A * EPS * ETA**5
    bend = float(g(start, 2)) - m3 * reach / 3.0
    return _until_root(start, reach, float(g(start)), float(g(start, 1)), bend)


def below_slow(start: float, reach: float) -> Step:
    """Return the parabola below the slow part of g minus the amplitude of the fast part. It ends at its root, or at
    s = `reach`."""
    bend = float(g(start, 2, fast=0.0)) - A * reach / 3.0
    value = float(g(start, fast=0.0)) - A * EPS * ETA**2
    return _until_root(start, reach, value, float(g(start, 1, fast=0.0)), bend)


def _until_root(start: float, reach: float, value: float, slope: float, bend: float) -> Step:
    roots = np.roots([0.5 * bend, slope, value])
    ahead = [r.real for r in roots if abs(r.imag) < 1e-12 and r.real > 0.0]
    return Step(start, min([reach, *ahead]) if value > 0.0 else 0.0, value, slope, bend)


def search(tau: float = 0.0, reach: float = 0.5, closest: float = 1e-9) -> list[Step]:
    """Return the steps from τ until the length of a step is at most `closest`.

    Each step is the longer of the steps of two parabolas, `below_all` and `below_slow`. The first parabola of
    `below_all` is at most as long as `reach`.
    """
    steps: list[Step] = []
    while not steps or steps[-1].length > closest:
        slow, own = below_slow(tau, 0.5), below_all(tau, reach)
        steps.append(max(slow, own, key=lambda step: step.length))
        reach = max(2.0 * own.length, 1e-6)
        tau += steps[-1].length
    return steps


def figure() -> Figure:
    """Draw the complete search in the upper panel, and the last steps in the lower panel."""
    steps = search()
    zero = steps[-1].start + steps[-1].length
    drawing = Figure(figsize=(7.2, 6.4), layout="constrained")
    windows = ((-0.004, zero + 0.09), (zero - 0.016, zero + 0.03))
    for axes, (low, high) in zip(drawing.subplots(2, 1), windows, strict=True):
        tau = np.linspace(low, high, 2000)
        axes.plot(tau, g(tau), "k-", label="g = 1 − H")
        axes.axhline(0.0, color="0.6", linewidth=0.8)
        for step in steps:
            s = np.linspace(0.0, step.length, 200)
            (line,) = axes.plot(step.start + s, step.at(s), color="#0072b2", linewidth=1.2)
            axes.plot(step.start, float(g(step.start)), "o", color="#0072b2", markersize=3.5)
        line.set_label("parabolas below it, with their starts")
        axes.plot(zero, 0.0, "s", color="#d55e00", label="first zero")
        axes.set_xlim(low, high)
        axes.set_ylabel("g")
    near = drawing.axes[1]
    near.set_ylim(-0.12, 0.5)
    near.set_xlabel("τ")
    grid = np.arange(0.0, zero + 0.09, 0.03)
    drawing.axes[0].plot(
        grid, g(grid), "x", color="0.4", label="a grid of Δτ = 0.03, with two zeros between its points"
    )
    drawing.legend(*drawing.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False)
    return drawing


def main() -> None:
    figure().savefig("parabola.png", dpi=110)


if __name__ == "__main__":
    main()
