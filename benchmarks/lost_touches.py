"""Predict which share of the touches beside a grazing is lost beyond the limit k₂, then measure it.

A disturbance beyond k₂ does not remove each touch. It removes those at which the force has such a phase that the lowest
point of the slide rises by its depth or more. From the end of the last rest on, nothing of the past remains, so the
touches do not depend on each other, and the share lost is that of the phases: `rises` of grazing.py, compared with the
depth. The phases are those of the motion from rest, one a cycle of n periods, in whole beats of the force against the
cycle. The ends of the rests are exact there, because the force also decides when a slide begins. There is no fit: ε is
given as a multiple of the *predicted* k₂.

Measured is the share of cycles without an impact near the time of the touch. A disturbed motion may be some periods
behind the undisturbed one, because either is a solution. Its shift is that of the n possible ones at which most of the
*other* impacts of the orbit occur at their times with at least half of their speed; if they do not in nearly all
cycles, the motion does not repeat the orbit any more. The touches take no part in this choice. The prediction is
computed for each shift.

    python -m benchmarks.lost_touches --predict     # predict and print (seconds)
    python -m benchmarks.lost_touches               # predict, measure, write lost_touches.json, draw, fill in the table
    python -m benchmarks.lost_touches --draw        # draw the stored results, fill in the table

The grazings are those in grazing.json.
"""

import json
import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

import vibrodrive as vd
from benchmarks.common import MARKERS, RESULTS, TWO_PI, environment, figure, parser, say, write
from benchmarks.grazing import NEAR, PAGE, Slides, limit_at_distance, phases_of_touches, rises, slides_to_touch, spread
from benchmarks.tables import ROOT, show, table
from vibrodrive import State

PICTURE = ROOT / "docs" / "lost_touches.png"
RATIOS = (1.0, 1.02, 1.05, 1.2, 1.5, 2.0)  # of ε to the predicted k₂
DISTANCES = (1e-4, 1e-3)
ETAS = (vd.ETA, 37 * math.sqrt(2), 100.9)  # at the last the force has only a few phases
TOUCHES = 2000
TRANSIENT = 1000
WINDOW = 0.5  # largest distance in time from the lowest point at which an impact is the touch
CLOSE, WANTED = 0.02, (1.02, 1.05, 1.2, 1.5)  # a prediction is close if it differs by less, at each of these ratios
OPEN: dict[str, Any] = {"linestyle": "none", "markersize": 3.5, "markerfacecolor": "none", "markeredgewidth": 0.6}
IN_STEP = 0.98  # least share of cycles with all other impacts in a motion that still repeats the orbit


class Cycle(NamedTuple):
    """An undisturbed cycle of n periods: times from the beginning of a period, and that period of the motion from rest.

    release : end of the last rest before the touch.
    rest : length of this rest.
    touch : time of the lowest point of the slide that touches.
    energy : share of the energy of all impacts of the cycle that the touch has.
    others : times and speeds of all other impacts.
    """

    period: int
    first: int
    release: float
    rest: float
    touch: float
    energy: float
    others: list[tuple[float, float]]


def whole_beats(eta: float, period: int, least: int = TOUCHES) -> int:
    """Return a number of touches, `least` or more, in which the phase of the force makes nearly whole turns."""
    step = abs(eta * period - round(eta * period))
    return round(math.ceil(least * step) / step) if step > 1 / least else least


def cycle_of(slides: Slides) -> Cycle:
    """Return the cycle of the undisturbed orbit, with times after a transient."""
    n = slides.period
    first = TRANSIENT + (slides.first - TRANSIENT) % n
    switches = vd.simulate(slides.A, B=slides.B, transient=slides.first, periods=8 * n).switches
    impacts, release = _impacts(switches), slides.times[0]
    tau, speed = impacts["tau"] - TWO_PI * slides.first, impacts["speed"]
    touch = slides.times[-1]
    near = np.abs(tau - touch) < math.pi * n
    least = np.abs(tau[near] - touch).argmin()
    others = np.delete(np.column_stack([tau[near], speed[near]]), least, axis=0)
    energy = float(speed[near][least] ** 2 / (speed[near] ** 2).sum())
    began = _times(switches[switches["after"] == State.REST]) - TWO_PI * slides.first
    rest = float(release - began[began < release].max())
    return Cycle(n, first, release, rest, touch, energy, [(float(t), float(v)) for t, v in others])


def _times(switches: np.ndarray) -> np.ndarray:
    return np.asarray(TWO_PI * switches["period"] + switches["phase"])


def _impacts(switches: np.ndarray) -> np.ndarray:
    found = switches[switches["after"] == State.IMPACT]
    impacts = np.empty(len(found), dtype=[("tau", float), ("speed", float)])
    impacts["tau"], impacts["speed"] = _times(found), -found["dxi"]
    return impacts


class Loss(NamedTuple):
    """Shares of the cycles of a motion: without the touch, with all other impacts, with the rest; and its shift."""

    measured: float
    in_step: float
    rested: float
    shift: int


def measured_loss(switches: np.ndarray, cycle: Cycle, touches: int) -> Loss:
    """Return the shares measured in a motion, at the shift at which most of the other impacts are in step.

    switches : those of a motion, from cycle.first to the end of the last cycle and of one more.
    """
    impacts, releases = _impacts(switches), _times(switches[switches["before"] == State.REST])
    found = []
    for shift in range(cycle.period):
        began = TWO_PI * (cycle.first + shift + cycle.period * np.arange(touches))
        others = [_occur(impacts["tau"][impacts["speed"] > 0.5 * v], began + t) for t, v in cycle.others]
        in_step = float(np.logical_and.reduce(others).mean()) if others else 1.0
        lost = 1.0 - float(_occur(impacts["tau"], began + cycle.touch).mean())
        found.append(Loss(lost, in_step, float(_occur(releases, began + cycle.release).mean()), shift))
    return max(found, key=lambda one: one.in_step)


def _occur(tau: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return for each of the times whether one of the ascending tau lies in the window around it."""
    before, after = (np.searchsorted(tau, times + side * WINDOW) for side in (-1, 1))
    return np.asarray(after > before)


def predicted_losses(slides: Slides, eta: float, V: float, first: int, touches: int) -> list[float]:
    """Return the share of touches that a force of velocity V removes, for each shift of the motion in periods."""
    numbers = np.arange(touches)
    shifts = [phases_of_touches(slides, eta, numbers, first + shift) for shift in range(slides.period)]
    return [float(np.mean(rises(slides, eta, V, phases) >= slides.depth)) for phases in shifts]


def predict() -> list[dict[str, Any]]:
    """Return the predicted limit, and shares by shift, at each grazing, distance and η."""
    rows = []
    for at in json.loads((RESULTS / "grazing.json").read_text(encoding="utf-8"))["grazings"]:
        A, B, n, side = at["A"], at["B"], at["n"], at["side"]
        there, impacts = slides_to_touch(A + side * NEAR, B, n)
        for distance in DISTANCES:
            row: dict[str, Any] = {"B": B, "A": A, "n": n, "side": side, "distance": distance}
            try:
                slides, count = slides_to_touch(A + side * distance, B, n, there.states)
            except LookupError:
                count = 0
            if count != impacts:
                rows += [row | {"eta": eta, "V": None} for eta in ETAS]  # another orbit
                continue
            cycle = cycle_of(slides)
            for eta in ETAS:
                V, touches = limit_at_distance(slides, eta), whole_beats(eta, n)
                one = row | {
                    "eta": eta,
                    "V": V,
                    "touches": touches,
                    "energy": cycle.energy,
                    "rest": cycle.rest,
                    "cycle": cycle,
                }
                if V:
                    one["by_shift"] = [predicted_losses(slides, eta, V * x, cycle.first, touches) for x in RATIOS]
                    lost = one["by_shift"][RATIOS.index(1.05)][0]
                    say(f"B = {B:g}, A_g = {A:.5f} {side * distance:+g}, η = {eta:.6g}: {lost:.3f} lost at 1.05 k2")
                rows.append(one)
    return rows


def measure(rows: list[dict[str, Any]]) -> None:
    """Add the measured shares, and the predicted ones of the shift that each motion has."""
    for row in rows:
        if not row["V"]:
            continue
        cycle, n, eta = row.pop("cycle"), row["n"], row["eta"]
        A = row["A"] + row["side"] * row["distance"]
        row |= {name: [] for name in Loss._fields}
        for x in RATIOS:
            length = {"transient": TRANSIENT, "periods": n * (row["touches"] + 5)}
            motion = vd.simulate(A, B=row["B"], eps=x * row["V"] / (eta * A), eta=eta, **length)
            one = measured_loss(motion.switches, cycle, row["touches"])
            for name, value in one._asdict().items():
                row[name].append(value)
        row["predicted"] = [shares[s] for shares, s in zip(row["by_shift"], row["shift"], strict=True)]
        say(f"B = {row['B']:g}, A = {A:.6f}, η = {eta:.6g}: {row['measured']}, predicted {row['predicted']}")


def largest(rows: Iterable[dict[str, Any]], ratios: Iterable[float] = WANTED) -> float:
    """Return the difference measured − predicted of largest size over rows and multiples of the predicted k₂."""
    at = [RATIOS.index(x) for x in ratios]
    return max((r["measured"][i] - r["predicted"][i] for r in rows for i in at), key=abs)


def markdown(rows: list[dict[str, Any]]) -> str:
    """Return the table: measured share at 1.05 k₂, and the largest difference from the prediction up to 1.5 k₂."""
    head = ["B", "A_g", "n", "impact for"]
    head += [f"η = {eta:.6g}, at {distance:g}" for eta in ETAS for distance in DISTANCES]
    body = []
    for first in rows[:: len(ETAS) * len(DISTANCES)]:
        here = [r for r in rows if (r["A"], r["B"]) == (first["A"], first["B"])]
        cells = []
        for eta in ETAS:
            for r in (r for r in here if r["eta"] == eta):
                lost = f"{r['measured'][RATIOS.index(1.05)]:.3f} ({signed([r])})" if r["V"] else "–"
                cells.append(lost)
        side = "A < A_g" if first["side"] < 0 else "A > A_g"
        body.append([f"{first['B']:g}", f"{first['A']:.5f}", str(first["n"]), side, *cells])
    known = [r for r in rows if r["V"]]
    irrational, rational = [r for r in known if r["eta"] != ETAS[-1]], [r for r in known if r["eta"] == ETAS[-1]]
    two = [r for r in irrational if r["n"] == 2]
    misses = [
        f"{r['A']:.5f} at {r['distance']:g}, η = {r['eta']:.6g} ({signed([r])}; "
        f"a rest of {r['rest']:.2f}, in {100 * min(r['rested'][: len(WANTED) + 1]):.0f} % of the cycles)"
        for r in known
        if abs(largest([r])) > CLOSE
    ]
    at_105 = {d: [r["measured"][RATIOS.index(1.05)] for r in two if r["distance"] == d] for d in DISTANCES}
    words = (
        f"Largest difference from 1.02 to 1.5 k₂ at the two irrational η: {abs(largest(two)):.3f} for n = 2, and at "
        f"{close(irrational)} of {len(irrational)} rows of all n within {CLOSE:g}; at η = {ETAS[-1]:g} "
        f"{close(rational)} of {len(rational)}. At 2 k₂: {abs(largest(two, [2.0])):.3f} for n = 2. At the predicted k₂ "
        f"itself at most {max(r['measured'][0] - r['predicted'][0] for r in two):.3f} more are lost for n = 2. Not "
        f"within {CLOSE:g}: {'; '.join(misses)}.\n\n"
        f"At 1.05 k₂ with n = 2, irrational η, {', '.join(f'{spread(at_105[d])} at {d:g}' for d in DISTANCES)} "
        f"are lost. In {sum(min(r['in_step']) >= IN_STEP for r in known)} of {len(known)} rows all other impacts "
        f"remain in {100 * IN_STEP:.0f} % of the cycles or more at each ε. For n = 2 the touch has at most "
        f"{100 * max(r['energy'] for r in two):.2g} % of the energy of the impacts."
    )
    return f"{table(head, body)}\n\n{words}"


def signed(rows: list[dict[str, Any]]) -> str:
    return f"{round(largest(rows), 3) + 0.0:+.3f}"


def close(rows: list[dict[str, Any]]) -> int:
    """Return the number of rows whose predictions are CLOSE from 1.02 to 1.5 k₂."""
    return sum(abs(largest([r])) <= CLOSE for r in rows)


def draw(rows: list[dict[str, Any]]) -> Any:
    """Return the figure: shares lost over ε/k₂, and measured over predicted shares."""
    fig, ((left, middle, right),) = figure(7.4, 2.9, columns=3)
    near, far = ([r for r in rows if r["n"] == 2 and r["eta"] == vd.ETA and r["distance"] == d] for d in DISTANCES)
    ratios = np.linspace(1.0, 2.0, 201)
    left.plot(ratios, np.arccos(1 / ratios) / math.pi, color="0.6", label=r"arccos$(k_2/\varepsilon)/\pi$")
    for i, r in enumerate([near[-1], *far]):
        at = rf"$A_g$ = {r['A']:.4f}, $|A - A_g|$ = {r['distance']:g}"
        left.plot(RATIOS, r["predicted"], color="black", linewidth=0.6)
        left.plot(RATIOS, r["measured"], label=at, marker=MARKERS[i], color="black", **OPEN)
    left.set_xlabel(r"$\varepsilon / k_2$, predicted $k_2$")
    left.set_ylabel("share of touches lost")
    left.set_title(r"$n$ = 2, $\eta$ = 100.995", fontsize=9)
    left.legend(fontsize=6, loc="upper left", handletextpad=0.1, labelspacing=0.2)
    kinds = {"$n$ = 2": (2, -1), "$n$ = 3": (3, -1), "$n$ = 4, $A < A_g$": (4, -1), "$n$ = 4, $A > A_g$": (4, 1)}
    for ax, etas in ((middle, ETAS[:-1]), (right, ETAS[-1:])):
        ax.plot([0, 1], [0, 1], color="0.6", linewidth=0.6)
        for marker, (label, kind) in zip(MARKERS, kinds.items(), strict=False):
            here = [r for r in rows if (r["n"], r["side"]) == kind and r["eta"] in etas and r["V"]]
            share = {key: [x for r in here for x in r[key]] for key in ("predicted", "measured")}
            ax.plot(share["predicted"], share["measured"], marker=marker, color="black", label=label, **OPEN)
        ax.set_xlabel("share predicted")
        ax.set_title(r"$\eta$ = " + ", ".join(f"{eta:.6g}" for eta in etas), fontsize=9)
        ax.set_aspect("equal")
    middle.set_ylabel("share measured")
    right.legend(fontsize=6, loc="lower right", handletextpad=0.1, labelspacing=0.2)
    return fig


def main() -> None:
    """Predict the shares, measure them, or read stored ones. Then draw the chart and write the table."""
    known = parser(__doc__, draws=True)
    known.add_argument("--predict", action="store_true", help="only predict, and print the share at 1.05 k₂")
    options = known.parse_args()
    path = options.output / "lost_touches.json"
    if not options.draw:
        rows = predict()
        if options.predict:
            return
        measure(rows)
        for row in rows:
            row.pop("by_shift", None)
        write("lost_touches", {"ratios": RATIOS, "grazings": rows, "environment": environment()}, None, options.output)
    rows = json.loads(path.read_text(encoding="utf-8"))["grazings"]
    show(PAGE, {"lost_touches": markdown(rows)}, PICTURE, draw(rows))


if __name__ == "__main__":
    main()
