"""Claims about physical disturbances (§4 of the paper)."""

from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.paper.claim import Outcome, claim, kept, listed, when
from benchmarks.paper.limits import KINDS, band_of_motions, limits
from benchmarks.paper.motions import (
    NotApplicable,
    Paper,
    kept_by_period,
    low_and_high,
    order_and_gaps,
    shares,
    structures,
    widths,
)
from vibrodrive.stability.structure import compare_structure, order, period

READING = 10.0  # a step may be larger than the paper's by this factor before the paper's number is contradicted


@claim("fig05", "ε = 5e-4 keeps the structure at A = 1.5: the states follow each other as without disturbance.")
def structure_kept(paper: Paper) -> Outcome:
    undisturbed, disturbed = _two(paper.motions("fig05"))
    found = compare_structure(paper.undisturbed("fig05"), disturbed)
    rows = [len(m.switches) / len(m.section) for m in (undisturbed, disturbed)]
    # an impact begins and ends at the same time, so it counts as one switching time
    rates = [
        row * float(np.mean(m.switches["before"] != vd.State.IMPACT))
        for row, m in zip(rows, (undisturbed, disturbed), strict=True)
    ]
    text = (
        f"the main impacts are {kept(found.impacts)}; a period has {rates[1]:.0f} switching times with the disturbance "
        f"and {rates[0]:.0f} without it (an impact counts once; `switches` has two rows for it, {rows[1]:.1f} and "
        f"{rows[0]:.0f} in all), and the sequence of states is {'the same' if found.word else 'another one'}"
    )
    numbers = {"impacts": found.impacts, "word": found.word, "switches_per_period": rates, "rows_per_period": rows}
    coarse = bool(found.impacts)
    return Outcome(text, numbers, when(coarse and bool(found.word), coarse))


@claim("fig05", "Periods differ from one another: the phase curve becomes a broad band.")
def broad_band(paper: Paper) -> Outcome:
    motions = _two(paper.motions("fig05"))
    spread = [[float(w.max()) for w in widths(motion)] for motion in motions]
    speed = [float(motion.impacts["speed"].max(initial=0.0)) for motion in motions]
    text = (
        f"at the same phase ξ varies by up to {spread[1][0]:.2g} and ξ' by up to {spread[1][1]:.2g} "
        f"({spread[0][0]:.1g} and {spread[0][1]:.1g} without disturbance); the largest impact speed grows from "
        f"{speed[0]:.3g} to {speed[1]:.3g}"
    )
    broad = all(wide > 1e-3 + 100 * narrow for narrow, wide in zip(*spread, strict=True))
    return Outcome(text, {"spread_calm": spread[0], "spread": spread[1], "fastest_impact": speed}, when(broad))


@claim("fig06", "ε = 0.5e-4 keeps the course of the motion and changes its amplitudes slightly.")
def small_epsilon(paper: Paper) -> Outcome:
    found = compare_structure(paper.undisturbed("fig06"), paper.motions("fig06")[1])
    apart = _smallest_distance(paper.undisturbed("fig06").points)
    text = (
        f"the impacts are {kept(found.impacts)} and the order at the section is {kept(found.order)}; "
        f"ρ = {found.rho:.3g}, and the distance between the two section points is {apart:.3g}"
    )
    slight = bool(found.impacts and found.order) and found.rho < 0.25 * apart
    return Outcome(text, {"rho": found.rho, "apart": apart}, when(slight))


@claim("fig06", "With growing ε the points spread up to a limit; beyond it other structures appear, a cloud of points.")
def limit_epsilon(paper: Paper) -> Outcome:
    motions = paper.motions("fig06")
    base, at = paper.undisturbed("fig06"), motions[0].arguments
    point = {name: at[name] for name in ("A", "B", "eta", "section_phase", "transient", "periods")}
    k, seen = vd.limit(**point), band_of_motions("eps", order_and_gaps(base), **point)
    found = [compare_structure(base, m) for m in motions]
    eps = [m.arguments["eps"] for m in motions]
    rho = [f.rho for f in found]
    same = [bool(f.impacts) for f in found]
    sides = [listed(e for e, g in zip(eps, same, strict=True) if g is side) for side in (True, False)]
    text = (
        f"k₂ = {k.k2:.4g} for the impacts, whose distances in periods change ({k.how}), and {seen.lost:.4g} for the "
        f"order at the drawn section; the impacts are kept at ε = {sides[0]} and lost at ε = {sides[1]}; for these ε, "
        f"ρ = {', '.join(f'{r:.2g}' for r in rho)}"
    )
    fits = all(g == (e < k.k2) for e, g in zip(eps, same, strict=True)) and rho == sorted(rho)
    numbers = {"k2": k.k2, "k2_at_section": seen.lost, "eps": eps, "kept": same, "rho": rho}
    return Outcome(text, numbers, when(fits and not all(same)))


@claim(
    "fig07",
    "ε = 2e-4 turns stable solutions into bands; low orders survive, high orders and bifurcation points do not.",
)
def bands(paper: Paper) -> Outcome:
    results = paper.results("fig07")
    if set(results.axes) != {"A", "eps"} or 0.0 not in results.axes["eps"]:
        raise NotApplicable("this claim needs the axes A and eps, with 0 among the values of eps")
    undisturbed, disturbed = (results.select(eps=e) for e in (0.0, results.axes["eps"].max()))
    n = period(undisturbed.section)
    survive = kept_by_period(
        (m, order(undisturbed.section[k, -m:], disturbed.section[k])) for k, m in enumerate(n) if m > 0
    )
    seen = low_and_high(survive)
    landed = kept_by_period((f.n, f.impacts) for f in structures(paper, "fig07", eps=disturbed.scalars["eps"]))
    low, high = low_and_high(landed)
    text = (
        f"at ε = {disturbed.scalars['eps']:g} the impacts are kept in {100 * low:.0f} % of the solutions with a period "
        f"up to 3, and in {100 * high:.0f} % of the solutions with a longer period ({shares(landed)}); the order at "
        f"the drawn section is kept in {100 * seen[0]:.0f} % and {100 * seen[1]:.0f} % of the solutions of these two "
        f"groups ({shares(survive)})"
    )
    by_period = [[m, float(np.mean(answers))] for m, answers in survive.items()]
    numbers = {"low": low, "high": high, "at_section": seen, "by_period_at_section": by_period}
    return Outcome(text, numbers, when(low > 0.5 > high, low > high))


@claim("fig07", "The disturbed solutions need a step Δτ = 1e-5, with switching times iterated to 1e-7.")
def precision(paper: Paper) -> Outcome:
    results = paper.results("fig07")
    A = np.linspace(results.axes["A"][0], results.axes["A"][-1], 12)
    eps = float(results.axes["eps"].max())
    # 40 periods are long enough to miss pairs of zeros, and so short that rounding errors do not reach the bound 1e-3
    span: dict[str, Any] = {"B": results.scalars["B"], "transient": 0, "periods": 40, "eps": eps}
    exact = vd.sweep(A=A, **span).section
    steps = [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5]
    right = []
    for step in steps:
        section = vd.sweep(A=A, **span, method="muller", dtau=step).section
        right.append(float((np.abs(section - exact).max(axis=(1, 2)) < 1e-3).mean()))
    enough = max((d for d, share in zip(steps, right, strict=True) if share == 1), default=np.nan)
    text = "the share of motions that are correct over 40 periods is " + ", ".join(
        f"{100 * share:.0f} % at Δτ = {d:g}" for d, share in zip(steps, right, strict=True)
    )
    numbers = {"dtau": steps, "right": right, "enough": enough}
    return Outcome(text, numbers, when(enough <= 1e-5, enough <= READING * 1e-5))


@claim("fig07", "The more often a solution has bifurcated, the more sensitive it is to both kinds of disturbance.")
def sensitivity(paper: Paper) -> Outcome:
    A = [2.5, 3.04, 3.1, 3.17]
    found = {kind: limits(kind, A=A, B=paper.results("fig07").scalars["B"]) for kind in KINDS.values()}
    n = [one.n for one in found["eps"]]
    k2 = {kind: [one.k2 for one in each] for kind, each in found.items()}
    text = "; ".join(
        f"k₂(ε) = {k2['eps'][i]:.2g} and k₂(Δτ) = {k2['dtau'][i]:.2g} for n = {n[i]} (A = {a})" for i, a in enumerate(A)
    )
    falling = all(v == sorted(v, reverse=True) for v in k2.values()) and n == sorted(n)
    return Outcome(text, {"A": A, "n": n, "k2_eps": k2["eps"], "k2_dtau": k2["dtau"]}, when(falling))


def _two(motions: list[vd.Trajectory]) -> list[vd.Trajectory]:
    if len(motions) != 2:
        raise NotApplicable("two motions are needed: an undisturbed motion and a disturbed motion")
    return motions


def _smallest_distance(points: np.ndarray) -> float:
    """Return the smallest distance between two points of an orbit."""
    return min((float(np.linalg.norm(p - q)) for i, p in enumerate(points) for q in points[:i]), default=np.inf)
