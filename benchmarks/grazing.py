"""Predict the limits k₂ beside a grazing from the closed form of the orbit, then measure them.

At A_g a slide down just touches the obstacle. On one side of A_g the orbit has an impact there, whose depth, the
distance by which the lowest point of the slide would lie below the obstacle, is proportional to |A − A_g|. A
disturbance moves the lowest point in proportion to its velocity V. The structure is lost when this impact is: when the
disturbance raises the lowest point by the depth. So V = slope · |A − A_g|, and the law needs no fit:

* To first order each slide passes on a change of its beginning. A slide that begins later by δ, with the acceleration
  a, has lost the velocity a·δ. A slide whose velocity has changed by v ends later by −v / (acceleration at its end). A
  slide that begins after a rest or a sticking begins with the acceleration 0, so nothing of the past remains: the sum
  begins at the end of the last rest before the touch. An impact comes later by (change of ξ) / (impact speed), and
  there ξ is 0.
* ε: the force adds −V cos(ητ + θ) to the velocity. The phase θ is different in each period of the orbit, so the lowest
  point rises by up to V·|Z|, where Z is the complex amplitude of its change.
* Δτ: each switch is late by some r between 0 and Δτ, which changes from period to period. The lowest point rises by
  Σ K r, at most by Δτ times the sum of the positive K.
* A: the same sums with −cos τ in place of the force give the change of the depth with A.

*At the distance*: at larger V the end of a rest or a sticking is not linear. The mass slides off for good with the
velocity that it has gained since the least value of ∫(H ∓ 1)dτ, and the depth is that of the orbit at A itself. This
prediction contains no other quantity.

    python -m benchmarks.grazing --predict     # print the predictions (seconds)
    python -m benchmarks.grazing               # predict, measure, write grazing.json, draw, fill in the table (minutes)
    python -m benchmarks.grazing --eta         # measure only the limits at other η again
    python -m benchmarks.grazing --draw        # draw the stored results, fill in the tables
"""

import cmath
import json
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

import vibrodrive as vd
from benchmarks.common import TWO_PI, environment, figure, look, parser, say, write
from benchmarks.tables import ROOT, number, show, table
from vibrodrive import State

PAGE, PICTURE = ROOT / "benchmarks" / "LIMITS.md", ROOT / "docs" / "grazing.png"
INCLINES = (0.05, 0.1, 0.2, 0.4)
MAX_PERIOD, LARGEST_A = 4, 8.0
DISTANCES = np.geomspace(1e-5, 1e-2, 10)
ETAS = (0.618, 3.618, 30.618, 100.618, vd.ETA, 1009.618, 2.5, 5.5, 100 + 1 / 3, 100.5, 101.0)
OF_ETA = ((2, 2.689586854288132), (3, 3.202814239942078))  # n and A_g of the grazings at B = 0.1 for other η
BELOW = 1e-3  # distance from them
CLOSE = 0.05  # share by which a limit may differ from its prediction
NEAR = 1e-8  # distance from A_g at which slopes are computed
RECORD: dict[str, Any] = {"transient": 1000, "periods": 1500}
SIGN = {State.UP: 1.0, State.DOWN: -1.0}
STILL = (State.STICK, State.REST)
TOUCHES = np.arange(750)  # about as many touches as a recorded motion has, each at its phase of the force


class Slides(NamedTuple):
    """The part of an undisturbed orbit from the end of its last rest to the lowest point of the slide that touches.

    period : the orbit's period n.
    first : excitation period of the motion from rest from which the times are counted.
    times : beginnings of the states and, last, the time of the lowest point.
    states : the states that begin at these times, without a state for the lowest point.
    depth : distance of the lowest point below the obstacle, if the slide were not ended by the impact.
    """

    A: float
    B: float
    period: int
    first: int
    times: list[float]
    states: list[State]
    depth: float


def slides_to_touch(A: float, B: float, period: int, states: list[State] | None = None) -> tuple[Slides, int]:
    """Return the slides before the touch of the undisturbed orbit at A, and its number of impacts in a period.

    states : states of these slides; by default those before the slowest impact.

    Raises LookupError if the orbit has another period or no such slides.
    """
    motion = vd.simulate(A, B=B, transient=20_000, periods=6 * period)
    section, switches = motion.section, motion.switches
    if np.abs(section[period:] - section[:-period]).max() > 1e-7:
        raise LookupError(f"the orbit at A = {A:.6g} has another period")
    tau = TWO_PI * (switches["period"] - switches["period"][0]) + switches["phase"]
    impacts = np.flatnonzero((switches["after"] == State.IMPACT) & (tau > TWO_PI * 2 * period))
    impacts = impacts[tau[impacts] < tau[impacts[0]] + TWO_PI * period - 0.01]
    found = []
    for last in impacts[np.argsort(-switches["dxi"][impacts])].tolist():
        rests = np.flatnonzero(switches["before"][:last] == State.REST)
        rows = slice(int(rests[-1]) if len(rests) else 0, last)
        here = [State(s) for s in switches["after"][rows]]
        if len(rests) and states in (None, here):
            times = tau[rows].tolist()
            low, depth = _lowest_point(A, B, times[-1], switches["xi"][last - 1], tau[last])
            found.append(Slides(A, B, period, int(switches["period"][0]), [*times, low], here, depth))
            if states is None:
                break
    if not found:
        raise LookupError(f"the orbit at A = {A:.6g} has no such touch")
    return min(found, key=lambda one: abs(one.depth)), len(impacts)


def _lowest_point(A: float, B: float, began: float, xi: float, impact: float) -> tuple[float, float]:
    """Return (time, depth) of the lowest point at which a slide that begins at ξ would end without its impact."""
    low = float(impact)
    for _ in range(100):  # Newton's method for ξ' = 0 beyond the impact
        low -= (-(B - 1) * (low - began) - A * (math.cos(low) - math.cos(began))) / (A * math.sin(low) - B + 1)
    h = low - began
    lowest = xi + A * math.cos(began) * h - (B - 1) * h * h / 2 - A * (math.sin(low) - math.sin(began))
    return low, -float(lowest)


def rise(
    slides: Slides, velocity: Callable[[float], Any] = float, gap: Callable[[float], Any] = float, late: int = 0
) -> Any:
    """Return the first-order change of the lowest point under a force whose integrals are `velocity` and `gap`.

    late : index of a switch that comes later by 1; 0 for none.
    """
    A, B, times, states = slides.A, slides.B, slides.times, slides.states
    x, delay = 0.0, 0.0
    for k, state in enumerate(states):
        begin, end = times[k : k + 2]
        if state not in SIGN:
            continue
        released = k == 0 or states[k - 1] in STILL
        w = 0.0 if released else -(A * math.sin(begin) - B - SIGN[state]) * delay
        moved = x + w * (end - begin) + gap(end) - gap(begin) - velocity(begin) * (end - begin)
        gained = w + velocity(end) - velocity(begin)
        if k + 1 == len(states):
            break
        if states[k + 1] == State.IMPACT:
            speed = (B - 1) * (end - begin) + A * (math.cos(end) - math.cos(begin))
            x, delay = 0.0, moved / speed
        else:
            x, delay = moved, -gained / (A * math.sin(end) - B - SIGN[state])
        delay += late == k + 1
    return moved


def nothing(_: float) -> float:
    return 0.0


def kick(at: float) -> tuple[Callable[[float], float], Callable[[float], float]]:
    """Return the integrals of a force that adds the velocity 1 just after a time."""
    return lambda t: float(t > at), lambda t: max(t - at, 0.0)


def wave(slides: Slides, eta: float) -> complex:
    """Return Z: the lowest point rises by Re(V Z exp(iθ)) under the force of velocity −V cos(ητ + θ)."""
    return complex(rise(slides, lambda t: -cmath.exp(1j * eta * t), lambda t: 1j / eta * cmath.exp(1j * eta * t)))


def late_switches(slides: Slides) -> list[float]:
    """Return the rise of the lowest point for a delay of each switch after the first, per unit of delay."""
    return [rise(slides, nothing, nothing, late) for late in range(1, len(slides.states))]


def slopes(slides: Slides, eta: float) -> dict[str, Any]:
    """Return the predicted slopes of V over |A − A_g|, and the numbers from which they follow."""
    per_A = abs(rise(slides, lambda t: -math.cos(t), lambda t: -math.sin(t)))
    Z, K = abs(wave(slides, eta)), late_switches(slides)
    return {"depth_per_A": per_A, "Z": Z, "K": K, "eps": per_A / Z, "dtau": per_A / sum(k for k in K if k > 0)}


def phases_of_touches(
    slides: Slides, eta: float, touches: np.ndarray = TOUCHES, first: int | None = None
) -> np.ndarray:
    """Return the phase of the force for each touch: at the beginning of the period from which its times are counted.

    These are the phases that the force has in the motion from rest, at a rational η only some.

    touches : the numbers of the touches; 0 is the touch of `slides`, or of the period `first` if that is given.
    """
    began = slides.first if first is None else first
    return np.asarray(TWO_PI * (eta * (began + slides.period * touches) % 1.0))


def rises(slides: Slides, eta: float, V: float, phases: np.ndarray) -> np.ndarray:
    """Return the rise of the lowest point at each phase of the force, with ends of rest and sticking exact."""
    up = V * (wave(slides, eta) * np.exp(1j * phases)).real
    for k, state in enumerate(slides.states):
        if state in SIGN and (k == 0 or slides.states[k - 1] in STILL):
            at, sign = slides.times[k], SIGN[state]
            growth = abs(slides.A * math.cos(at))
            reach = max(math.sqrt(4 * V / growth), 2 * V * eta / growth)
            h = np.linspace(-reach, reach, 1001)
            gained = (sign * V * np.cos(eta * (at + h) + phases[:, None]) - growth * h * h / 2).max(axis=1)
            up = up + rise(slides, *kick(at)) * (sign * gained - V * np.cos(eta * at + phases))
    return np.asarray(up)


def limit_at_distance(slides: Slides, eta: float) -> float | None:
    """Return the V at which the largest of the `rises` over all touches equals the depth.

    The result is None if no V up to 32 times the linear limit raises the lowest point by the depth.
    """
    phases = phases_of_touches(slides, eta)

    def highest(V: float) -> float:
        return float(rises(slides, eta, V, phases).max())

    first = slides.depth / abs(wave(slides, eta))
    low, high = next(((0.5 * V, V) for V in first * 2.0 ** np.arange(6) if highest(V) >= slides.depth), (0.0, math.inf))
    if high == math.inf:
        return None
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if highest(middle) < slides.depth else (low, middle)
    return high


def grazings() -> list[dict[str, Any]]:
    """Return all grazings of stable orbits, with the side on which the orbit has the impact, and predicted limits."""
    found = []
    for B in INCLINES:
        for at in vd.bifurcations((1.05 + B, LARGEST_A), B, max_period=MAX_PERIOD):
            if at.kind != "grazing" or not (abs(at.multiplier_below) < 1 and abs(at.multiplier_above) < 1):
                continue
            n = at.orbit.period
            sides = {side: slides_to_touch(at.A + side * NEAR, B, n) for side in (-1, 1)}
            side = max(sides, key=lambda s: sides[s][1])
            slides, impacts = sides[side]
            row = {"B": B, "A": at.A, "n": n, "side": side, "impacts": impacts, **slopes(slides, vd.ETA), "points": []}
            for distance in DISTANCES:
                try:
                    there, count = slides_to_touch(at.A + side * distance, B, n, slides.states)
                except LookupError:
                    count = 0
                same = count == impacts
                predicted = limit_at_distance(there, vd.ETA) if same else None
                row["points"].append({"distance": distance, "predicted": predicted})
            found.append(row)
            say(f"B = {B:g}, A = {at.A:.6f}, n = {n}: V / |A - A_g| = {row['eps']:.4f} (eps), {row['dtau']:.4f} (dtau)")
    return found


def measure(rows: list[dict[str, Any]]) -> None:
    """Add the measured limits in ε and Δτ, as velocities, to the points of each grazing."""
    for row in rows:
        A = sorted(row["A"] + row["side"] * DISTANCES)
        for name in ("eps", "dtau"):
            way: dict[str, Any] = {"method": "fixed"} if name == "dtau" else {}
            found = vd.sweep(A=A, B=row["B"], record="limit", **RECORD, **way)
            order = range(len(A)) if row["side"] > 0 else reversed(range(len(A)))
            for point, at in zip(row["points"], order, strict=True):
                same = found.orbit_period[at] == row["n"]
                point[name] = float(found.velocity[at]) if same else None
        say(f"B = {row['B']:g}, A = {row['A']:.6f}: measured")


def over_eta() -> list[dict[str, Any]]:
    """Return predicted and measured limits in ε below two grazings at several η."""
    rows = []
    for n, A in OF_ETA:
        there, _ = slides_to_touch(A - BELOW, 0.1, n)
        predicted = [limit_at_distance(there, eta) for eta in ETAS]
        measured = [vd.limit(A - BELOW, eta=eta, **RECORD).velocity for eta in ETAS]
        rows.append({"A": A, "n": n, "eta": ETAS, "predicted": predicted, "measured": measured})
    return rows


def eta_table(rows: list[dict[str, Any]]) -> str:
    """Return the table of limits at other η: measured V over |A − A_g|, and measured over predicted in parentheses."""
    head = ["A_g", *(f"η = {eta:.6g}" for eta in ETAS)]
    body = [
        [
            f"{r['A']:.5f}",
            *(
                f"{number(m / BELOW)} ({f'{m / p:.2f}' if p else 'no limit'})"
                for m, p in zip(r["measured"], r["predicted"], strict=True)
            ),
        ]
        for r in rows
    ]
    return table(head, body)


def ratios(row: dict[str, Any], key: str, largest: float) -> list[float]:
    """Return measured limits over the predictions `key` up to a distance."""
    found = []
    for p in row["points"]:
        law = row[key] * p["distance"] if key in row else p["predicted"]
        measured = p["dtau" if key == "dtau" else "eps"]
        if p["distance"] <= largest * 1.001 and law and measured:
            found.append(measured / law)
    return found


def worst(row: dict[str, Any], key: str, largest: float) -> str:
    """Return the range of measured limits over the predictions `key` up to a distance, or a dash without a point."""
    found = ratios(row, key, largest)
    return f"{min(found):.2f} … {max(found):.2f}" if found else "–"


def spread(found: list[float]) -> str:
    """Return the least and the largest number of a list as text."""
    return f"{min(found):.2f} to {max(found):.2f}"


def near(rows: list[dict[str, Any]], key: str, largest: float) -> int:
    """Return at how many grazings all measured limits up to a distance are CLOSE to the predictions `key`."""
    return sum(all(abs(x - 1) <= CLOSE for x in ratios(row, key, largest)) for row in rows)


def markdown(rows: list[dict[str, Any]]) -> str:
    """Return the table: predicted slopes, and measured limits divided by the predictions."""
    head = ["B", "A_g", "n", "impact for", "slope in ε, predicted", "measured / predicted, up to 1e-4", "up to 1e-3"]
    head += ["at the distance, up to 1e-2", "slope in Δτ, predicted", "measured / predicted, up to 1e-3"]
    body = []
    for r in rows:
        first = [
            f"{r['B']:g}",
            f"{r['A']:.5f}",
            str(r["n"]),
            "A < A_g" if r["side"] < 0 else "A > A_g",
            number(r["eps"]),
        ]
        eps = [worst(r, "eps", 1e-4), worst(r, "eps", 1e-3), worst(r, "predicted", 1e-2)]
        body.append([*first, *eps, number(r["dtau"]), worst(r, "dtau", 1e-3)])
    straight, exact = ([near(rows, key, up_to) for up_to in (1e-4, 1e-3, 1e-2)] for key in ("eps", "predicted"))
    measured = [ratio for r in rows for ratio in ratios(r, "dtau", 1e-3)]
    near_by = [p for r in rows for p in r["points"] if p["distance"] <= 1.001e-3 and p["eps"] and p["dtau"]]
    rates, slope_rates = [p["dtau"] / p["eps"] for p in near_by], [r["dtau"] / r["eps"] for r in rows]
    words = (
        f"All limits in ε up to 1e-4, 1e-3 and 1e-2 are within {100 * CLOSE:.0f} % of the slope at {straight[0]}, "
        f"{straight[1]} and {straight[2]} of {len(rows)} grazings, and of the prediction at the distance at "
        f"{exact[0]}, {exact[1]} and {exact[2]}. Up to 1e-3 the limits in Δτ are {spread(measured)} of the slope, and "
        f"the exchange rate, k₂(Δτ)/(k₂(ε)ηA), is {spread(rates)}; that of the slopes is {spread(slope_rates)}."
    )
    return f"{table(head, body)}\n\n{words}"


def draw(rows: list[dict[str, Any]]) -> Any:
    """Return the figure: limits over the distance from a grazing, measured points and predicted lines."""
    fig, axes = figure(7.4, 4.6, columns=len(INCLINES), rows=2)
    for column, B in enumerate(INCLINES):
        for top, name in enumerate(("eps", "dtau")):
            ax = axes[top, column]
            for i, r in enumerate(one for one in rows if one["B"] == B):
                style = look(i, False) | {"linestyle": "none", "markersize": 3.5, "color": "black"}
                ax.loglog(DISTANCES, r[name] * DISTANCES, color="0.6", linewidth=0.6)
                known = [(p["distance"], p["predicted"]) for p in r["points"] if p["predicted"]]
                if name == "eps":
                    ax.loglog(*zip(*known, strict=True), color="black", linewidth=0.6)
                at = [(p["distance"], p[name]) for p in r["points"] if p[name]]
                side = "<" if r["side"] < 0 else ">"
                ax.loglog(*zip(*at, strict=True), label=f"$A {side} A_g$ = {r['A']:.4f}, $n$ = {r['n']}", **style)
            ax.set_xlim(7e-6, 1.5e-2)
            ax.set_ylim(7e-7, 2e-1)
            ax.tick_params(labelleft=column == 0, labelbottom=top == 1)
        axes[0, column].set_title(f"$B$ = {B:g}", fontsize=9)
        axes[1, column].set_xlabel("$|A - A_g|$")
        axes[0, column].legend(fontsize=6, loc="upper left", handletextpad=0.1, labelspacing=0.2)
    axes[0, 0].set_ylabel(r"$V = k_2(\varepsilon)\,\eta A$")
    axes[1, 0].set_ylabel(r"$V = k_2(\Delta\tau)$")
    return fig


def main() -> None:
    """Predict the limits, measure them, or read stored limits. Then draw the chart and write the table."""
    known = parser(__doc__, draws=True)
    known.add_argument("--predict", action="store_true", help="only predict, and print the slopes")
    known.add_argument("--eta", action="store_true", help="measure only the limits at other η again")
    options = known.parse_args()
    path = options.output / "grazing.json"
    data = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    if not options.draw:
        if not options.eta:
            rows = grazings()
            if options.predict:
                return
            measure(rows)
            data |= {**RECORD, "eta": vd.ETA, "grazings": rows}
        data["other_eta"] = over_eta()
        write("grazing", data | {"environment": environment()}, None, options.output)
        data = json.loads(path.read_text(encoding="utf-8"))
    rows, of_eta = data["grazings"], data["other_eta"]
    show(PAGE, {"grazing": markdown(rows), "grazing_eta": eta_table(of_eta)}, PICTURE, draw(rows))


if __name__ == "__main__":
    main()
