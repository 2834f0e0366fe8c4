"""Draw all charts of measured data: `python -m benchmarks.draw` reads JSON files and writes pictures.

The data of each chart are measured by a separate command. If a chart already shows the stored data, it is not drawn
again.
"""

import argparse
import hashlib
import json
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks import passes
from benchmarks.common import RESULTS, figure, plt, say

DOCS = Path(__file__).parents[1] / "docs"

# -- the chart of the README ---------------------------------------------------------------------------------

FLOOR, CEILING = 1e-18, 3e8
BAND = 8.0  # marks of wrong settings are drawn above this ordinate, with a row for each method
ROW = 12.0  # ratio of the ordinates of successive rows


class Curve(NamedTuple):
    """A method, its label, its colour (also in grey different from the others), its mark, and its label's position.

    `at` contains the position of the label, (seconds, error), in the undisturbed and in the disturbed panel.
    """

    method: str
    label: str
    colour: str
    mark: str
    at: tuple[tuple[float, float], tuple[float, float]]


CURVES = (
    Curve("time-stepping", "time-stepping", "#d55e00", "s", ((1e-4, 0.1), (1.5e-7, 1e-2))),
    Curve("scan + Newton", "scan + Newton", "#009e73", "^", ((1.6e-8, 4e-11), (1.5e-4, 3e-13))),
    Curve("scan of g and g′", "scan of g and g′", "#cc79a7", "P", ((1.6e-5, 2e-14), (4.9e-4, 2.6e-9))),
    Curve("Muller on a grid", "Muller on a grid", "#7a6000", "D", ((4.5e-3, 1e-15), (1.5e-4, 2e-15))),
    Curve("heyoka", "heyoka", "#8f4a86", "v", ((3e-8, 1e-8), (5e-7, 1e-5))),
    Curve("scipy", "", "#333333", "o", ((3.3e-3, 1e-7), (5e-3, 3e-3))),
    Curve("certified", "certified: each\nswitch guaranteed", "#0072b2", "*", ((3e-8, 1.5e-17), (3e-8, 1e-10))),
)
PAPER = ("Muller on a grid", 1e-5)
PAPER_AT = ((6e-6, 3e-17), (4e-7, 2e-17))  # position of its label in both panels


def dated(fig: Any, data: dict[str, Any]) -> None:
    """Write the date of the measurement into the lower right corner of a figure."""
    fig.supxlabel(f"measured {data['measured']}", x=0.99, ha="right", fontsize=7, color="0.4")


def draw_curve(ax: Any, curve: Curve, row: float, points: list[dict[str, Any]], at: tuple[float, float]) -> None:
    """Draw one method: a line over its right settings, hollow marks at the ordinate `row` for wrong settings, and its
    name at the point `at` with the number of right settings."""
    x, y = [p["seconds"] for p in points], [p["error"] if p["right"] else row for p in points]
    line = [p["error"] if p["right"] else np.nan for p in points]  # a hollow mark has no error, so no line leads to it
    ax.plot(x, line, "-", color=curve.colour, lw=1.1, zorder=2)
    for right, face in ((True, curve.colour), (False, "white")):
        marks = [(a, b) for a, b, p in zip(x, y, points, strict=True) if p["right"] == right] or [(np.nan, np.nan)]
        size = 13 if curve.mark == "*" else 5
        ax.plot(*zip(*marks, strict=True), curve.mark, ms=size, mfc=face, mec=curve.colour, zorder=3)
    count = f"\n{sum(p['right'] for p in points)} of {len(points)} settings right"
    text = curve.label if curve.method == "certified" else (curve.label or points[0]["method"]) + count
    ax.text(*at, text, color=curve.colour, fontsize=8, va="center", linespacing=1.1)


def chart(data: dict[str, Any]) -> Any:
    """Draw error over computing time for 200 periods, undisturbed and disturbed."""
    fig, axes = figure(8.4, 4.8, columns=2)
    for column, (ax, eps) in enumerate(zip(axes[0], sorted({p["eps"] for p in data["points"]}), strict=True)):
        ax.set(xscale="log", yscale="log", xlabel="CPU time per period of motion (s)")
        ax.axhspan(BAND / 3, CEILING, color="0.93", lw=0)
        meaning = "hollow: a switch is missed or invented, so that no error is defined"
        ax.text(0.5, 0.985, meaning, transform=ax.transAxes, fontsize=8, va="top", ha="center")
        for k, curve in enumerate(CURVES):
            points = [p for p in data["points"] if p["eps"] == eps and p["method"].startswith(curve.method)]
            draw_curve(ax, curve, BAND * ROW**k, points, curve.at[column])
        for method, words, shift in (("certified", "one motion", 8), ("certified sweep", "in a sweep", -8)):
            star = next(p for p in data["points"] if (p["eps"], p["method"]) == (eps, method))
            offset = {"xytext": (shift, -15), "textcoords": "offset points", "ha": "center"}
            ax.annotate(words, (star["seconds"], star["error"]), color=CURVES[-1].colour, fontsize=8, **offset)
        paper = next(p for p in data["points"] if (p["eps"], p["method"], p["value"]) == (eps, *PAPER))
        at, colour = (paper["seconds"], paper["error"]), CURVES[2].colour
        ax.plot(*at, "o", mfc="none", mec=colour, ms=12, mew=1.1)
        words = f"the paper (1999): $\\Delta\\tau = 10^{{{np.log10(PAPER[1]):.0f}}}$"
        ax.text(*PAPER_AT[column], words, color=colour, fontsize=8, va="center")
        ax.set_title("undisturbed" if eps == 0 else f"with a fast disturbance, $\\varepsilon = {eps:g}$")
        ax.set_ylim(FLOOR, CEILING)
        ax.set_yticks([1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0])
        ax.set_xlim(1e-8, 1.0)
    axes[0, 0].set_ylabel("largest error of a switching time (rad)")
    title = f"All switches of {data['periods']} periods from rest, $A = {data['A']:g}$: error over cost"
    fig.suptitle(f"{title}\neach mark: one step or tolerance of a method", fontsize=10)
    dated(fig, data)
    return fig


# -- pass rate over difficulty -------------------------------------------------------------------------------

EDGES = [0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 15]  # ends of intervals of −log₁₀ of the distance of the closest two zeros
FAMILIES = ("close pair", "near miss", "two in a step", "three in a step")


def difficulty(data: dict[str, Any]) -> Any:
    """Draw for each method the pass rate over the distance of the closest zeros, at its best setting, and the range of
    all its settings. Draw the number of functions in each interval in a last panel."""
    shown = [m for m in passes.methods() if m.rates({"L0-plain-01"})]
    rows = -(-(len(shown) + 2) // 4)  # with a panel of counts and one of notes
    fig, axes = figure(8.4, 1.28 * rows, columns=4, rows=rows)
    middles = [0.5 * (a + b) for a, b in pairwise(EDGES)]
    for k, (ax, method) in enumerate(zip(axes.flat, shown, strict=False)):
        rates = passes.over_difficulty(method, EDGES, FAMILIES)
        bins = [(at, r) for at, r in zip(middles, rates, strict=True) if r]
        whole = [sum(row[i] for i in row if i.startswith("L0-")) for row in method.right]
        x, top = [10.0**-at for at, _ in bins], whole.index(max(whole))
        ax.fill_between(x, [min(r) for _, r in bins], [max(r) for _, r in bins], color="0.85", lw=0)
        ax.plot(
            x, [r[top] for _, r in bins], "o-", color="black" if "(ours)" in method.label else "#0072b2", ms=3, lw=1.3
        )
        ax.set(ylim=(-0.05, 1.08), yticks=[0, 0.5, 1])
        ax.set_title(method.label, fontsize=9)
        ax.set_yticklabels(["0", "50 %", "100 %"] if k % 4 == 0 else [])
    counts = [len(ids) for ids in passes.by_difficulty(EDGES, FAMILIES)]
    ends = [10.0**-edge for edge in EDGES]
    ax, *rest = axes.flat[len(shown) :]
    ax.stairs(counts[::-1], ends[::-1], fill=True, color="0.7")
    for at, count in zip(middles, counts, strict=True):
        ax.text(10.0**-at, count + 0.5, str(count), fontsize=7, ha="center")
    ax.set_title("number of functions", fontsize=9)
    ax.set(ylim=(0, 1.2 * max(counts)), yticks=[])
    for ax in axes.flat[: len(shown) + 1]:
        ax.set(xscale="log", xlim=(10.0**0.2, 10.0**-15.2), xticks=[1, 1e-4, 1e-8, 1e-12])
        ax.minorticks_off()
    for ax in rest:
        ax.set_axis_off()
    note = "Time-stepping and regularised\nmethods compute motions only,\nso they have no panel here."
    rest[0].text(0.0, 0.5, f"{note}\n\nmeasured {data['measured']}", fontsize=8, va="center", color="0.3")
    fig.suptitle("Functions whose first zero is found, over the distance of their closest two zeros", fontsize=11)
    fig.supxlabel("distance of the closest two zeros (smaller, and so harder, to the right)", fontsize=10)
    fig.supylabel("share of functions (line: best setting; grey: range over settings)", fontsize=10)
    return fig


# -- one small picture for each kind of failure ----------------------------------------------------------------

STYLES = {"line": "-", "dashes": "--", "dotted": ":"}
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#333333")


def failure(example: dict[str, Any]) -> Any:
    """Draw the curves of one example, with its title and the legend above them. Hollow marks show a reported event that
    is not the impact."""
    fig, axes = figure(3.5, 2.7)
    ax = axes[0, 0]
    for s, colour in zip(example["series"], COLOURS, strict=False):
        words = s["style"].split()
        line = next((STYLES[w] for w in words if w in STYLES), "none")
        mark = "x" if "cross" in words else "o" if {"dots", "rings"} & {*words} else "none"
        face = "white" if "rings" in words else colour
        ax.plot(
            s["x"],
            s["y"],
            ls=line,
            marker=mark,
            ms=7 if mark == "x" else 4,
            mew=1.4,
            mfc=face,
            color=colour,
            label=s["label"],
        )
        other = [k for k, state in enumerate(s.get("reported", [])) if state != "IMPACT"]
        ax.plot([s["x"][k] for k in other], [s["y"][k] for k in other], "o", ms=4, mew=1.4, mfc="white", mec=colour)
    xlabel, ylabel, xscale, yscale = example["axes"]
    ax.set(xlabel=xlabel, ylabel=ylabel, xscale=xscale, yscale=yscale)
    if xscale == "linear":
        ax.xaxis.set_major_locator(plt.MaxNLocator(4))
    if any(s["label"] in ("true zeros", "true zero", "obstacle") for s in example["series"]):
        ax.axhline(0.0, color="0.6", lw=0.6, zorder=0)
    size = {"fontsize": 8, "title_fontsize": 9, "handlelength": 1.8, "columnspacing": 1.0}
    fig.legend(loc="outside upper center", ncols=2 if len(example["series"]) > 3 else 3, title=example["title"], **size)
    return fig


# -- all charts ------------------------------------------------------------------------------------------------


class Chart(NamedTuple):
    """A picture, its stored data, the command that measures these data, and the function that draws the picture."""

    picture: Path
    load: Callable[[], dict[str, Any]]
    command: str
    draw: Callable[[dict[str, Any]], Any]


def stored(name: str) -> dict[str, Any]:
    """Return the measured data of a benchmark."""
    return json.loads((RESULTS / f"{name}.json").read_text(encoding="utf-8"))


def stored_dated(name: str) -> dict[str, Any]:
    """Return the measured data of a benchmark with their date, for a chart that shows this date."""
    data = stored(name)
    return data | {"measured": data["environment"]["measured"]}


def stored_rates() -> dict[str, Any]:
    """Return the results of all solvers at level 0 of the set of switches."""
    found = [result for result in passes.results() if result["level"] == 0]
    return {"environment": {"measured": passes.dates()}, "measured": passes.dates(), "solvers": found}


def charts() -> list[Chart]:
    """Return all charts."""
    found = [
        Chart(DOCS / "accuracy_speed.png", partial(stored_dated, "accuracy_speed"), "benchmarks.accuracy_speed", chart),
        Chart(DOCS / "difficulty.png", stored_rates, "benchmarks.switches.run", difficulty),
    ]
    failures = stored("failures")
    for name, example in failures["examples"].items():
        about = {"environment": failures["environment"], **example}
        found.append(Chart(DOCS / "failures" / f"{name}.png", partial(dict, about), "benchmarks.failures", failure))
    return found


def fingerprint(data: dict[str, Any]) -> str:
    """Return the hash of the data of a chart, which its picture contains."""
    return hashlib.sha256(json.dumps({k: v for k, v in data.items() if k != "environment"}).encode()).hexdigest()


def draw(chart: Chart, folder: Path | None = None) -> None:
    """Draw a chart if its picture does not yet show the same data. Print the date of the measurement."""
    data = chart.load()
    picture = folder / chart.picture.name if folder else chart.picture
    shown = fingerprint(data)
    say(f"{picture.name}: measured {data['environment']['measured']}; `python -m {chart.command}` measures again")
    if picture.exists() and shown.encode() in picture.read_bytes():
        say(f"{picture.name}: shows these data already (delete it to draw it again)")
        return
    picture.parent.mkdir(parents=True, exist_ok=True)
    fig = chart.draw(data)
    fig.savefig(picture, metadata={"Source": shown})
    plt.close(fig)
    say(f"{picture.name}: drawn")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, help="folder of the pictures, instead of docs")
    options = parser.parse_args()
    for chart in charts():
        draw(chart, options.output)


if __name__ == "__main__":
    main()
