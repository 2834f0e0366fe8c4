"""Claims about the undisturbed motion (§4 of the paper)."""

from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.paper.claim import Outcome, claim, listed, when
from benchmarks.paper.motions import LAGS, PHASES, SETTLED, NotApplicable, Paper, loss_of_sticking
from vibrodrive import State, Status
from vibrodrive.stability.structure import deviation, period

LARGE = np.linspace(1.11, 12.0, 1090)  # values of A of the search for chaos, beyond those of the figures
LONG_RECORD = 20_000  # periods of its transients, and of its records
HIGHER = (3.1, 3.22)  # excitation amplitudes with subharmonics of order 4 and 3


@claim("fig03", "The bifurcation diagram resembles that of the logistic equation and shows a way into chaos.")
def route(paper: Paper) -> Outcome:
    results = paper.results("fig03")
    A, n = results.axes["A"], period(results.section)
    moving = (results.status != Status.NEVER_LEAVES) & (results.switches[:, State.IMPACT] > 0)
    starts = {k: _first(A, moving & (n == k)) for k in (1, 2, 4, 3)}
    beyond = moving & (starts[4] < A)
    higher = sorted({int(k) for k in n[beyond]} - {0, 2, 4, 3})
    irregular = float((n[beyond] == 0).mean()) if beyond.any() else np.nan
    doubling = bool(starts[1] < starts[2] < starts[4])
    text = (
        f"over {len(A)} values of A the mass moves above A = {starts[1]:.4g}; the period is 2 above {starts[2]:.4g} "
        f"and 4 above {starts[4]:.4g}; "
        f"windows of period {listed(higher)} follow, and the period is 3 above {starts[3]:.4g}; "
        f"{100 * irregular:.1f} % of the motions beyond the second doubling have no period up to {LAGS}"
    )
    numbers: dict[str, Any] = {f"period_{k}_from": v for k, v in starts.items()}
    numbers |= {"higher_periods": higher, "share_without_period": irregular}
    # the doublings agree with the logistic equation; windows of higher periods may replace some of the chaos, not all
    return Outcome(text, numbers, when(doubling and irregular > 0.5, doubling and irregular > 0.05))


@claim("fig03", "In reality, bifurcations up to chaos can exist (§3, for any A).")
def up_to_chaos(paper: Paper) -> Outcome:
    found = vd.sweep(
        A=LARGE, B=paper.results("fig03").scalars["B"], record="summary", transient=LONG_RECORD, periods=LONG_RECORD
    )
    exponent = np.asarray(found.lyapunov)
    chaotic = (exponent > 0) & (np.asarray(found.period) == 0)
    text = (
        f"after {LONG_RECORD} periods neighbouring motions diverge over the next {LONG_RECORD}, in which the mass "
        f"never rests, at {chaotic.sum()} of {len(LARGE)} values of A from {LARGE[0]:g} to {LARGE[-1]:g}"
    )
    if chaotic.any():
        text += (
            f", at {100 * chaotic[chaotic.argmax() :].mean():.0f} % of those from A = {LARGE[chaotic][0]:.4g} on, with "
            f"Lyapunov exponents of {exponent[chaotic].min():.2g} to {exponent[chaotic].max():.2g} per period"
        )
    return Outcome(text, {"from": _first(LARGE, chaotic), "share": chaotic.mean()}, when(chaotic.any()))


@claim(
    "fig03",
    "When A grows, the sticking where the mass turns disappears first; the resting after the impact disappears "
    "partly or completely when the solution has bifurcated.",
)
def interruptions(paper: Paper) -> Outcome:
    results = paper.results("fig03")
    A, switches = results.axes["A"], results.switches
    landed = switches[:, State.IMPACT]
    moving = landed > 0
    rest = np.where(moving, switches[:, State.REST] / np.maximum(landed, 1), np.nan)
    lost = loss_of_sticking(results)
    stick_gone = np.nan if lost is None else float(A[lost])
    rest_less = _first(A, moving & (rest < 0.99))
    bifurcated = moving & (period(results.section) > 1)
    partly = float((rest[bifurcated] < 0.99).mean()) if bifurcated.any() else np.nan
    text = (
        f"over {len(A)} values of A, sticking vanishes at A = {stick_gone:.4g}; from A = {rest_less:.4g} on a rest "
        f"does not follow every impact; in {100 * partly:.0f} % of the bifurcated solutions it follows some impacts "
        "only, or none"
    )
    numbers = {"stick_vanishes": stick_gone, "rest_fails_from": rest_less, "share_partly": partly}
    return Outcome(text, numbers, when(stick_gone < rest_less and partly > 0))


@claim("fig04", "At A = 3.04 two equal solutions of period 2×2π are shifted by 2π; the start selects one of them.")
def two_solutions(paper: Paper) -> Outcome:
    motions = paper.motions("fig04")
    base = paper.undisturbed("fig04")
    found = [deviation(base.points, m.section) for m in motions]
    shifts = [int(s) for _, s in found]
    rho = max(float(r) for r, _ in found)
    text = f"the starts lead to one orbit of period {base.n}, shifted by {listed(shifts)} × 2π, to within {rho:.1g}"
    settled = rho < SETTLED and base.n == 2
    return Outcome(text, {"n": base.n, "shifts": shifts, "rho": rho}, when(settled and len(set(shifts)) == 2))


@claim("fig04", "The shift by 2π is not visible in the bifurcation diagram and in phase curves.")
def invisible_shift(paper: Paper) -> Outcome:
    motions = paper.motions("fig04")
    base = paper.undisturbed("fig04")
    shifts = [int(deviation(base.points, m.section)[1]) for m in motions]
    if len(set(shifts)) < 2:
        raise NotApplicable("the motions are the same solution")
    values = [np.sort(m.section[-base.n :], axis=0) for m in motions]
    curves = [np.stack([s.xi, s.dxi], axis=1)[:-1] for s in (m.sample(PHASES) for m in motions)]
    whole = len(curves[0]) - base.n * PHASES
    moved = [np.roll(c, s * PHASES, axis=0)[base.n * PHASES :][:whole] for c, s in zip(curves, shifts, strict=True)]
    section, curve = (max(float(np.abs(v - of[0]).max()) for v in of) for of in (values, moved))
    apart = max(float(np.abs(c - curves[0]).max()) for c in curves)
    text = (
        f"the solutions are shifted by {listed(shifts)} × 2π; their values in a diagram differ by {section:.1g} and "
        f"their phase curves by {curve:.1g}; at equal times their states differ by up to {apart:.2g}"
    )
    equal = section < SETTLED and curve < SETTLED
    return Outcome(text, {"section": section, "curve": curve, "apart": apart}, when(equal and apart > 1e-3))


@claim("coexisting", "A subharmonic of order n means n stable solutions of one shape, full periods apart.")
def n_solutions(paper: Paper) -> Outcome:
    results = paper.results("coexisting")
    base = paper.undisturbed("coexisting", xi0=0.0, dxi0=0.0, tau0=0.0)
    rho, shift = deviation(base.points, results.section)
    shares = [float((shift == s).mean()) for s in range(base.n)]
    counted = {base.n: sum(share > 0 for share in shares)}
    for A in HIGHER:
        orbit = paper.undisturbed("coexisting", A=A, xi0=0.0, dxi0=0.0, tau0=0.0, transient=1000)
        starts = vd.sweep(A=A, xi0=np.linspace(0, 20, 201), transient=1000, periods=64)
        away, kind = deviation(orbit.points, starts.section)
        counted[orbit.n] = len(set(kind[away < SETTLED].tolist()))
    settled = float((rho < SETTLED).mean())
    text = (
        f"{100 * settled:.1f} % of {rho.size} starts reach the orbit; the shares of its solutions are "
        f"{', '.join(f'{100 * s:.0f} %' for s in shares)}; the number of solutions found is "
        f"{', '.join(f'{c} for n = {n}' for n, c in counted.items())}"
    )
    numbers = {"n": base.n, "shares": shares, "settled": settled, "solutions_by_n": [list(i) for i in counted.items()]}
    return Outcome(text, numbers, when(settled == 1 and all(n == c for n, c in counted.items())))


@claim(
    "fig05",
    "The undisturbed motion at A = 1.5 is interrupted twice a period: where the mass turns, and at the obstacle.",
)
def two_interruptions(paper: Paper) -> Outcome:
    base = paper.undisturbed("fig05")
    names = [[s.name for s in word] for word in base.word]
    both = all({"STICK", "REST"} <= set(word) for word in names) and base.n == 1
    return Outcome("the states of a period are " + "; ".join(" ".join(w) for w in names), {"word": names}, when(both))


@claim("fig06", "The undisturbed motion has two points in the Poincaré section.")
def two_points(paper: Paper) -> Outcome:
    undisturbed = paper.motions("fig06")[0]
    base = paper.undisturbed("fig06")
    n = period(undisturbed.section)
    points = [[float(v) for v in p] for p in base.points]
    text = f"the section has {n} points: " + ", ".join(f"({x:.7g}, {v:.7g})" for x, v in points)
    return Outcome(text, {"n": n, "points": points}, when(n == 2))


def _first(values: np.ndarray, where: np.ndarray) -> float:
    return float(values[where][0]) if where.any() else np.nan
