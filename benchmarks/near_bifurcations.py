"""Limits of both disturbances over the distance from each bifurcation, and the beat of η against an integer.

The exchange rate is k₂(Δτ) / V, with V = k₂(ε)ηA. It is measured on both sides of each bifurcation, over the logarithm
of the distance, for the paper's η = 100.995 and for η = 100.618.

Just above a period doubling the two impacts of the orbit are almost equal and alternate. A force whose η is close to an
integer m meets each period in almost the same phase, so it shifts all periods alike, slowly, with the period 1/|η − m|
of the beat. It moves the motion across the doubling and back. While the motion is below the doubling, the alternation
decays: in a beat its logarithm swings by ± |M| V / (2π |η − m|), where |M| V is the change of the logarithm of the
multiplier under a force of a fixed phase. |M| is computed here from the closed form of the orbit of one period. If the
alternation decays below the other changes of the impacts, the two impacts change their order.

    python -m benchmarks.near_bifurcations           # measure, write near_bifurcations.json, draw, fill in the table
    python -m benchmarks.near_bifurcations --only eta    # measure only this again, keep the other results
    python -m benchmarks.near_bifurcations --draw    # draw the stored results, fill in the tables
"""

import json
import math
from collections.abc import Callable
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.common import TWO_PI, environment, figure, parser, say, write
from benchmarks.tables import ROOT, number, show, table

PAGE, PICTURE = ROOT / "benchmarks" / "LIMITS.md", ROOT / "docs" / "near_bifurcations.png"
B, RANGE, MAX_PERIOD = 0.1, (2.5, 3.25), 4
DISTANCES = np.geomspace(1e-5, 1e-2, 7)
AWAY = 100.618
"""A frequency ratio whose distance from the integers is near the golden ratio, so that there is no slow beat."""

RECORD: dict[str, Any] = {"B": B, "record": "limit", "transient": 1000, "periods": 1500}
WAYS: dict[str, dict[str, Any]] = {"eps": {}, "eps_away": {"eta": AWAY}, "dtau": {"method": "fixed"}}
ABOVE = 1e-3  # distance above the first doubling at which the beat is studied
BEATS = np.array([0.001, 0.002, 0.00495, 0.01, 0.02, 0.05, 0.1, 0.2, 0.382])  # distances of η below 101
ETAS = (3.618, 10.618, 30.618, AWAY, 302.618, 1009.618, vd.ETA, 101.0)
A_OVER_ETA = (2.4, 2.605, 2.8, 3.04, 3.1, 3.25)
VELOCITIES = np.geomspace(1e-5, 0.06, 36)


HALVES = (100.25, 100.35, 100.4, 100.45, 100.495, 100.5, 100.505, 100.55, 100.65, 300.495, 1009.495)
ABOVE_HALVES = (1e-4, 1e-3, 3e-3)  # distances above the first doubling at which these η are tried

PARTS = ("beat", "halves", "eta", "bifurcations")


def around(bifurcation: Any) -> dict[str, Any]:
    """Return the limits on both sides of a bifurcation as velocities, None where the motion has no period."""
    sides = []
    for side in (-1, 1):
        A = np.sort(bifurcation.A + side * DISTANCES)
        found = {name: vd.sweep(A=A, **RECORD, **way) for name, way in WAYS.items()}
        order = slice(None, None, side)
        V = {name: [v if math.isfinite(v) else None for v in r.velocity[order].tolist()] for name, r in found.items()}
        sides.append({"side": side, "n": found["eps"].orbit_period[order].tolist(), **V})
    say(f"{bifurcation.kind} at A = {bifurcation.A:.6f}: measured")
    return {"kind": bifurcation.kind, "A": bifurcation.A, "sides": sides}


# -- the beat ----------------------------------------------------------------------------------------------


def multiplier(A: float, V: float, theta: float, eta: int) -> float:
    """Return the multiplier of the orbit of one period without sticking, under a force whose η is an integer.

    The velocity of the force is −V cos(ητ + θ), the same in each period.
    """

    def next_impact(phase: float) -> float:
        at, x = phase, 0.0
        for sign in (1.0, -1.0):
            began, base = at, A * math.cos(at) + V * math.cos(eta * at + theta)
            level = x + A * math.sin(at) + V / eta * math.sin(eta * at + theta)
            at += math.pi
            for _ in range(50):  # Newton's method: for ξ' = 0 at the end of the slide up, for ξ = 0 at the impact
                h, fast = at - began, eta * at + theta
                xi = level + base * h - (B + sign) * h * h / 2 - A * math.sin(at) - V / eta * math.sin(fast)
                dxi = base - (B + sign) * h - A * math.cos(at) - V * math.cos(fast)
                at -= dxi / (A * math.sin(at) - B - sign + V * eta * math.sin(fast)) if sign > 0.0 else xi / dxi
            x = xi
        return at - TWO_PI

    phase, h = float(vd.orbits(A, B, max_period=1)[0].phases[0]), 1e-5
    for _ in range(30):
        slope = (next_impact(phase + h) - next_impact(phase - h)) / (2 * h)
        phase -= (next_impact(phase) - phase) / (slope - 1.0)
    return slope


def swing(A: float, eta: int, V: float = 1e-6) -> float:
    """Return |M|: the amplitude, over the phase of the force, of d ln |multiplier| / dV."""
    phases = np.arange(8) * TWO_PI / 8
    logs = np.array([math.log(-multiplier(A, V, theta, eta)) for theta in phases])
    return float(abs((logs * np.exp(1j * phases)).mean()) * 2 / V)


def beat(doubling: float) -> dict[str, Any]:
    """Return limits over the distance of η from 101, and the V at which the paper's η keeps the structure."""
    A = doubling + ABOVE
    r = vd.sweep(A=[A], eta=np.sort(101 - BEATS), **RECORD)
    base = vd.sweep(A=[A], eps=VELOCITIES / (vd.ETA * A), B=B, record=kept_of(A), transient=1000, periods=1500)
    return {"A": A, "M": swing(A, 101), "away": (101 - r.axes["eta"]).tolist(), "velocity": r.velocity[0].tolist(),
            "order": (r.how[0] == 1).tolist(), "V": VELOCITIES.tolist(), "kept": base.kept[0].tolist(),
            "flips": base.flips[0].tolist(), "rests": base.rests[0].tolist()}  # fmt: skip


def halves(doubling: float) -> dict[str, Any]:
    """Return limits around half-integers η, at which the force alternates from period to period as the impacts do."""
    r = vd.sweep(A=[doubling + above for above in ABOVE_HALVES], eta=HALVES, **RECORD)
    return {"above": ABOVE_HALVES, "eta": HALVES, "velocity": r.velocity.tolist()}


def over_eta() -> dict[str, Any]:
    """Return limits over η, away from integers and at the paper's η, and the limits in Δτ."""
    r = vd.sweep(A=A_OVER_ETA, eta=sorted(ETAS), **RECORD)
    late = vd.sweep(A=A_OVER_ETA, **RECORD, method="fixed")
    return {"A": A_OVER_ETA, "eta": sorted(ETAS), "velocity": r.velocity.tolist(), "dtau": late.k2.tolist()}


def kept_of(A: float) -> Any:
    """Return the function of a motion: structure kept, changes of the order of the impacts, rests in a period."""
    from vibrodrive.stability.structure import keeps, reference_orbit

    base = reference_orbit(vd.simulate(A, B=B, transient=20_000, periods=256))
    assert base is not None

    def numbers(motion: vd.Trajectory) -> dict[str, float]:
        phase = motion.impacts["phase"]
        alternation = np.diff(phase) * (-1.0) ** np.arange(len(phase) - 1)
        rests = np.count_nonzero(motion.switches["after"] == vd.State.REST) / len(motion.section)
        flips = int(np.count_nonzero(np.diff(np.sign(alternation))))
        return {"kept": int(keeps(base, motion.section, motion.impacts)), "flips": flips, "rests": rests}

    return numbers


# -- showing -----------------------------------------------------------------------------------------------


def rates(side: dict[str, Any], name: str) -> np.ndarray:
    """Return k₂(Δτ) / V on one side of a bifurcation, over DISTANCES."""
    dtau, V = (np.array(side[key], dtype=float) for key in ("dtau", name))
    return dtau / V


def spread(values: np.ndarray) -> str:
    known = values[np.isfinite(values)]
    return "no period" if not len(known) else f"{number(known.min())} … {number(known.max())}"


def markdown(data: dict[str, Any]) -> dict[str, str]:
    """Return the tables by name: rates beside each bifurcation, limits over the beat, and limits over η."""
    head = ["bifurcation", "A_c", "side", "n", "V, η = 100.995", f"V, η = {AWAY}", "k₂(Δτ)", "rate, η = 100.995"]
    head += [f"rate, η = {AWAY}"]
    rows = []
    for b in data["bifurcations"]:
        for s in b["sides"]:
            n = "/".join(dict.fromkeys(str(k) for k in s["n"] if k))
            V = [spread(np.array(s[name], dtype=float)) for name in WAYS]
            side = "below" if s["side"] < 0 else "above"
            rows.append(
                [b["kind"], f"{b['A']:.5f}", side, n, *V, spread(rates(s, "eps")), spread(rates(s, "eps_away"))]
            )
    of_beat = data["beat"]
    lines = [
        [
            f"{away:.3g}",
            f"{1 / away:.0f}",
            number(V),
            number(of_beat["M"] * V / (TWO_PI * away)),
            "order" if o else "gaps",
        ]
        for away, V, o in zip(of_beat["away"], of_beat["velocity"], of_beat["order"], strict=True)
    ]
    swing_head = ["101 − η", "beat, periods", "V = k₂(ε)ηA", "swing \\|M\\|V/(2π(101 − η))", "lost"]
    of_eta = data["eta"]
    order = sorted(range(len(ETAS)), key=lambda k: (of_eta["eta"][k] % 1 == 0 or of_eta["eta"][k] == vd.ETA, k))
    eta_rows = [
        [f"{A:g}", *(number(V[k]) for k in order), number(dtau)]
        for A, V, dtau in zip(of_eta["A"], of_eta["velocity"], of_eta["dtau"], strict=True)
    ]
    half_rows = [
        [f"{above:g}", *map(number, V)]
        for above, V in zip(data["halves"]["above"], data["halves"]["velocity"], strict=True)
    ]
    return {
        "near_bifurcations": table(head, rows),
        "beat": table(swing_head, lines[::-1]),
        "halves": table(["A − A_c", *(f"η = {eta:g}" for eta in data["halves"]["eta"])], half_rows),
        "over_eta": table(["A", *(f"η = {of_eta['eta'][k]:.6g}" for k in order), "k₂(Δτ)"], eta_rows),
    }


def draw(data: dict[str, Any]) -> Any:
    """Return the figure: exchange rate over log |A − A_c|, below and above each bifurcation."""
    count = len(data["bifurcations"])
    fig, axes = figure(7.4, 6.4, columns=3, rows=math.ceil(count / 3))
    places = np.log10(DISTANCES) + 5.5
    for ax, b in zip(axes.flat, data["bifurcations"], strict=False):
        for s in b["sides"]:
            for name, face, label in (("eps", "black", "η = 100.995"), ("eps_away", "white", f"η = {AWAY}")):
                style = {"color": "black" if name == "eps" else "0.5", "mfc": face, "ms": 3.5}
                ax.plot(s["side"] * places, rates(s, name), "o-", label=label if s["side"] < 0 else None, **style)
        ax.axhspan(0.5, 2.0, color="0.92", zorder=0)
        ax.axvline(0.0, color="0.6", linewidth=0.6)
        ax.set(yscale="log", ylim=(5e-3, 5e2), xlim=(-4, 4))
        ticks = [-3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5]
        ax.set_xticks(ticks, [f"{'−' if t < 0 else '+'}$10^{{{abs(t) - 5.5:.0f}}}$" for t in ticks], fontsize=6)
        ax.set_title(f"{b['kind']}, $A_c$ = {b['A']:.5f}", fontsize=8)
    for ax in axes.flat[count:]:
        ax.set_visible(False)
    for ax in axes[:, 0]:
        ax.set_ylabel(r"$k_2(\Delta\tau)\,/\,k_2(\varepsilon)\eta A$", fontsize=8)
    axes.flat[0].legend(fontsize=6, loc="upper left")
    fig.supxlabel("$A - A_c$", fontsize=9)
    return fig


def main() -> None:
    """Measure the limits, or read stored limits. Then draw the chart and write the table."""
    known = parser(__doc__, draws=True)
    known.add_argument("--only", nargs="+", choices=PARTS, default=PARTS, help="parts to measure")
    options = known.parse_args()
    path = options.output / "near_bifurcations.json"
    data = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    if not options.draw:
        found = vd.bifurcations(RANGE, B, max_period=MAX_PERIOD)
        doubling = next(one.A for one in found if one.kind == "period doubling")
        measure: dict[str, Callable[[], Any]] = {
            "beat": lambda: beat(doubling),
            "halves": lambda: halves(doubling),
            "eta": over_eta,
        }
        measure["bifurcations"] = lambda: list(map(around, found))
        data |= {name: measure[name]() for name in options.only}
        write("near_bifurcations", data | {"distances": DISTANCES, "environment": environment()}, None, options.output)
        data = json.loads(path.read_text(encoding="utf-8"))
    show(PAGE, markdown(data), PICTURE, draw(data))


if __name__ == "__main__":
    main()
