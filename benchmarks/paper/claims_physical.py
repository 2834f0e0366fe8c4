"""Claims about physical disturbances (§4 of the paper)."""

import functools
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.paper.claim import Outcome, claim, kept, listed, when
from benchmarks.paper.limits import band_of_motions
from benchmarks.paper.motions import (
    PAPERS,
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
STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
DRAWN = 1e-3  # largest error of a section point that Fig. 7 hides


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
    counts = [sum(map(len, answers.values())) for answers in (landed, survive)]
    text = (
        f"at ε = {disturbed.scalars['eps']:g} and {counts[0]} values of A the impacts are kept in {100 * low:.0f} % of "
        f"the solutions with a period up to 3, and in {100 * high:.0f} % of those with a longer period "
        f"({shares(landed)}); at {counts[1]} values of A the order at the drawn section is kept in {100 * seen[0]:.0f} "
        f"% and {100 * seen[1]:.0f} % of these two groups ({shares(survive)})"
    )
    by_period = [[m, float(np.mean(answers))] for m, answers in survive.items()]
    numbers = {"low": low, "high": high, "at_section": seen, "by_period_at_section": by_period}
    return Outcome(text, numbers, when(low > 0.5 > high, low > high))


@claim("fig07", "The disturbed solutions need a step Δτ = 1e-5, with switching times iterated to 1e-7.")
def precision(paper: Paper) -> Outcome:
    at, status, right = _on_grids(paper)
    wrong = (~right).sum(axis=1)
    enough = max((step for k, step in enumerate(STEPS) if not wrong[k:].any()), default=np.nan)
    counts = [f"{n} at Δτ = {step:g}" for n, step in zip(wrong, STEPS, strict=True)]
    failed = {}
    for step in dict.fromkeys((enough, PAPERS["dtau"])):
        found = vd.sweep(**at, **PAPERS | {"dtau": step}, record="failures")
        failures = found.missed + found.late + found.wrong
        failed[step] = [int(failures.sum()), int(found.judged.sum()), int((failures > 0).sum())]
    text = (
        f"of {len(status)} disturbed motions over {at['periods']} periods, transients included, a section point is off "
        f"by more than {DRAWN:g} in {', '.join(counts)}; the number of missed, late or wrong switches is "
    ) + " and ".join(f"{n} of {of} at {step:g}" for step, (n, of, _) in failed.items())
    numbers = {"dtau": STEPS, "wrong": wrong, "enough": enough, "switches": [[d, *n] for d, n in failed.items()]}
    return Outcome(text, numbers, when(enough <= PAPERS["dtau"], enough <= READING * PAPERS["dtau"]))


@claim("fig07", "The choice of Δτ is merely heuristic: it is not known beforehand how many zeros a step contains.")
def heuristic(paper: Paper) -> Outcome:
    _, status, right = _on_grids(paper)
    safe = np.logical_and.accumulate(right[::-1])[::-1]  # right at this step and at all smaller ones
    largest = np.where(safe.any(axis=0), np.array(STEPS)[safe.argmax(axis=0)], 0.0)
    groups = {step: int((largest == step).sum()) for step in (*STEPS, 0.0) if step in largest}
    pairs = np.sort(np.stack([largest[1:], largest[:-1]]), axis=0)
    apart = float((pairs[1] / pairs[0]).max())
    proved = int((status == vd.Status.OK).sum())
    text = (
        f"the largest step from which on Muller's method is right is "
        f"{', '.join(f'{step:g} in {n}' for step, n in groups.items())} of the {len(status)} disturbed motions, and "
        f"differs by up to a factor of {apart:.0f} between neighbouring values of A; the certified method has no step: "
        f"bounds of the derivatives prove how many zeros an interval contains, and leave nothing open in {proved} of "
        "these motions"
    )
    guessed = len(groups) > 1
    numbers = {"largest_right": [*groups.items()], "neighbours": apart, "proved": proved}
    return Outcome(text, numbers, when(guessed and proved < len(status), guessed))


@functools.cache
def _on_grids(paper: Paper) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    """Compute the disturbed motions of Fig. 7, with certified switches and with Muller's method at each of STEPS.

    Returns (arguments of the sweeps, certified status (n,), right (steps, n)). A motion is right if no section point is
    off by more than DRAWN, at the phase of the figure and at 0, the transient included. A rest ends at a given time, so
    that errors do not grow.
    """
    results = paper.results("fig07")
    s = results.settings
    at: dict[str, Any] = {"A": results.axes["A"], "B": results.scalars["B"], "eps": float(results.axes["eps"].max())}
    at |= {"transient": 0, "periods": s.transient + s.periods}
    off = np.zeros((len(STEPS), len(at["A"])))
    for phase in (0.0, results.scalars["section_phase"]):
        exact = vd.sweep(**at, section_phase=phase)
        for row, step in zip(off, STEPS, strict=True):
            section = vd.sweep(**at, section_phase=phase, **PAPERS | {"dtau": step}).section
            np.maximum(row, np.abs(section - exact.section).max(axis=(1, 2)), out=row)
    return at, np.asarray(exact.status), off <= DRAWN


def _two(motions: list[vd.Trajectory]) -> list[vd.Trajectory]:
    if len(motions) != 2:
        raise NotApplicable("two motions are needed: an undisturbed motion and a disturbed motion")
    return motions


def _smallest_distance(points: np.ndarray) -> float:
    """Return the smallest distance between two points of an orbit."""
    return min((float(np.linalg.norm(p - q)) for i, p in enumerate(points) for q in points[:i]), default=np.inf)
