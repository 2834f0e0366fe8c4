"""Chart of the README: error of the switching times over the cost of a period, for each method.

The data are those measured by `work_precision`, read from its JSON file. An existing picture of the same data is not
drawn again.
A setting that missed or invented a switch is drawn in a separate band at its cost: the error of its other switches
would be misleading.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.common import RESULTS, arguments, figure, say

PICTURE = Path(__file__).parents[1] / "docs" / "accuracy_speed.png"

A, UNDISTURBED, DISTURBED = 3.04, 0.0, 2e-4
PAPER = "Δτ = 1e-05, tol = 1e-07"
LEAST = 1e-16
WRONG, CEILING = 25.0, 1.5e3
"""Ordinate of the settings that miss or invent switches, and upper limit of the axis: above every meaningful error."""


class Curve(NamedTuple):
    """A family of `work_precision`, its colour (distinct in grey, too), its mark, and its label.

    at: position of the label, in (seconds, error), in the undisturbed and in the disturbed panel.
    """

    family: str
    colour: str
    mark: str
    label: str
    at: tuple[tuple[float, float], tuple[float, float]]


CURVES = (
    Curve("fixed, literal", "#d55e00", "s", "fixed Δτ", ((2.2e-5, 1.5e-3), (1.2e-4, 8e-3))),
    Curve("Muller, literal", "#7a6000", "D", "Muller-refined", ((1.3e-5, 5e-14), (2.5e-6, 2.5e-5))),
    Curve("hand-written Numba: scan + Newton", "#009e73", "^", "scan + Newton,\nhand-written",
          ((1.9e-7, 5e-16), (3.6e-6, 1.2e-14))),
    Curve("heyoka terminal events", "#8f4a86", "v", "heyoka", ((9.5e-6, 2e-9), (2.8e-4, 2e-7))),
    Curve("scipy solve_ivp", "#333333", "o", "scipy", ((1.2e-4, 1e-8), (9e-3, 1e-7))),
    Curve("certified, batched", "#0072b2", "*", "certified sweep:\neach switch\nguaranteed",
          ((2.3e-8, 3e-12), (1.5e-7, 4e-9))),
)  # fmt: skip


def points_of(data: dict[str, Any], eps: float, family: str) -> list[dict[str, Any]]:
    """Return the settings of a family in one panel, in the order of measurement."""
    return [p for p in data["points"] if (p["A"], p["eps"], p["family"]) == (A, eps, family)]


def draw_curve(ax: Any, curve: Curve, points: list[dict[str, Any]], at: tuple[float, float]) -> None:
    """Draw a method: its name, a line through the settings that find every switch, and crosses for other settings."""
    right = [p for p in points if not p["wrong"] and p["error"] is not None]
    x = [p["seconds"] for p in right]
    y = [max(p["error"], LEAST) for p in right]
    size = 15 if curve.mark == "*" else 5
    ax.plot(x, y, "-", marker=curve.mark, color=curve.colour, markersize=size, lw=1.3)
    wrong = [p["seconds"] for p in points if p["wrong"]]
    ax.plot(wrong, [WRONG] * len(wrong), "x", color=curve.colour, markersize=6, mew=1.4)
    ax.text(*at, curve.label, color=curve.colour, fontsize=9, va="center")
    for p in points:
        if p["setting"] == PAPER and not p["wrong"]:
            ax.plot([p["seconds"]], [p["error"]], "o", mfc="none", mec=curve.colour, markersize=12, mew=1.1)
            ax.annotate(
                "the paper's setting", (p["seconds"], p["error"]), (9, -13), textcoords="offset points",
                color=curve.colour, fontsize=8,
            )  # fmt: skip


def draw(data: dict[str, Any]) -> Any:
    """Draw both panels: without and with the disturbance of the paper."""
    fig, axes = figure(7.2, 3.9, columns=2)
    for column, (ax, eps) in enumerate(zip(axes[0], (UNDISTURBED, DISTURBED), strict=True)):
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.axhspan(8.0, CEILING, color="0.92", lw=0)
        for curve in CURVES:
            draw_curve(ax, curve, points_of(data, eps, curve.family), curve.at[column])
        ax.set_ylim(LEAST / 6, CEILING)
        ax.set_yticks([1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0])
        ax.set_xlim(1.5e-8, 2e-2) if eps == UNDISTURBED else ax.set_xlim(1e-7, 0.3)
        ax.text(0.02, 0.985, "× misses or invents switches", transform=ax.transAxes, fontsize=8, va="top", color="0.3")
        ax.set_title("undisturbed" if eps == UNDISTURBED else f"with a fast disturbance, $\\varepsilon = {eps:g}$")
        ax.set_xlabel("CPU time per period of motion (s)")
    axes[0, 0].set_ylabel("largest error of a switching time (rad)")
    fig.suptitle(f"Finding the switches of 20 periods from rest, $A = {A:g}$: error against cost", fontsize=10)
    return fig


def main() -> None:
    options = arguments(__doc__)
    source = options.output / "work_precision.json"
    picture = PICTURE if options.output == RESULTS else options.output / PICTURE.name
    data = json.loads(source.read_text(encoding="utf-8"))
    shown = hashlib.sha256(json.dumps(data["points"]).encode()).hexdigest()
    measured = data["environment"].get("measured", "on an unknown date")
    say(f"{source.name}: measured {measured}; `python -m benchmarks.work_precision` measures again")
    if picture.exists() and shown.encode() in picture.read_bytes():
        say(f"accuracy_speed: {picture.name} already shows these data (delete it to draw it again)")
        return
    draw(data).savefig(picture, metadata={"Source": shown})
    say(f"accuracy_speed: {source.name} drawn to {picture.name}")


if __name__ == "__main__":
    main()
