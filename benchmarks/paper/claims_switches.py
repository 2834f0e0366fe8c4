"""Claims about single switches on a grid (§3 and §5 of the paper)."""

from collections import Counter
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.paper.claim import Outcome, claim, when
from benchmarks.paper.grids import METHODS, OVER_A, OVER_DTAU, ZEROS, failures_by_zeros
from benchmarks.paper.motions import LONG, PAPERS, NotApplicable, Paper, without_grid
from vibrodrive import State

FALL: dict[str, Any] = {"A": 3.04, "dxi0": -2.0, "tau0": 2.5, "transient": 0, "periods": 4}
"""Start of a slide down that ends above the obstacle if its initial gap is large enough."""

HIGH = 30.0
CLOSENESS = tuple(10.0**-k for k in range(1, 14))


@claim("fig08", "At Δτ = 0.7 several switching points are skipped, in equal intervals.")
def skipped(paper: Paper) -> Outcome:
    arguments = paper.points("fig08", 2)[1]
    motion = vd.simulate(**(arguments | {"periods": LONG}))
    exact = vd.simulate(**without_grid(arguments))
    usual, entered = (np.bincount(m.switches["after"], minlength=len(State)) for m in (exact, motion))
    lost = usual * LONG / len(exact.section) - entered
    most = State(int(lost.argmax()))
    periods = np.unique(motion.switches["period"][motion.switches["after"] == most])
    without = np.setdiff1d(np.arange(motion.switches["period"][0], motion.switches["period"][-1] + 1), periods)
    apart = Counter(np.diff(without).tolist())
    intervals = ", ".join(f"{d} ({n} times)" for d, n in sorted(apart.items()))
    text = (
        f"at Δτ = {arguments['dtau']:g}, {len(without)} of {LONG} periods contain no {most.name}, and other states "
        f"are skipped {np.delete(lost, most).max():.0f} times; the next such period follows after {intervals} periods"
    )
    numbers = {"state": most.name, "without": len(without), "intervals": sorted(apart.items())}
    some = len(without) > 1
    return Outcome(text, numbers, when(some and len(apart) == 1, some and max(apart) < 3 * min(apart)))


@claim(
    "fig08",
    "If a step contains an even number of zeros, the switching point is not found; with an odd number, a wrong "
    "switching point is found.",
)
def zeros_in_step(paper: Paper) -> Outcome:
    rows, numbers = [], {}
    unseen: Counter[str] = Counter()
    wrong: Counter[str] = Counter()
    for method in METHODS:
        judged, failed = failures_by_zeros(method)
        passed = Counter(f.zeros for f in failed if f.kind != "wrong")
        steps = {z: [f.dtau for f in failed if f.kind == "wrong" and f.zeros == z] for z in ZEROS}
        count = {zeros: len(dtau) for zeros, dtau in steps.items()}
        least = {zeros: f"{len(dtau)} (at Δτ ≥ {min(dtau):.2g})" if dtau else "0" for zeros, dtau in steps.items()}
        rows.append(
            f"of {judged} switches with the method {method}, {passed.total()} are not found, and {passed['even']} of "
            f"these have an even number of zeros in the step; {sum(count.values())} are found in time but lead to the "
            "wrong next state"
        )
        if any(count.values()):
            rows[-1] += (
                f", and of these {least['odd']} have an odd number of three zeros or more, {least['even']} have an "
                f"even number, {least['one']} have one zero that is found too late for the right decision, and "
                f"{least['both']} have one zero of each of two switching functions"
            )
        numbers[method] = {"judged": judged} | Counter(f"{f.kind}, {f.zeros}" for f in failed)
        unseen.update(passed)
        wrong.update(count)
    text = (
        f"switches are compared at {len(OVER_A) * len(OVER_DTAU)} pairs of A and Δτ with ε = 0 and Δτ up to "
        f"{OVER_DTAU[-1]:g}; {'; '.join(rows)}"
    )
    told = unseen.total() == unseen["even"] > 0
    return Outcome(text, numbers, when(told and wrong.total() == wrong["odd"] > 0, told))


@claim("fig09", "A wrong localisation disturbs the state at all switching points, by instantaneous jumps of ξ and ξ'.")
def disturbed_switches(paper: Paper) -> Outcome:
    arguments = paper.points("fig09")
    rows, numbers, jumping = [], {}, []
    muller = f"Muller's method at Δτ = {PAPERS['dtau']:g} and tol = {PAPERS['tol']:g}"
    for name, at in [(f"Δτ = {a['dtau']:g}", a) for a in arguments] + [(muller, arguments[0] | PAPERS)]:
        switches = vd.simulate(**at).switches
        before, after = switches["before"], switches["after"]
        turned = (before <= State.DOWN) & (after != State.IMPACT)
        speed, depth = np.abs(switches["dxi"][turned]), np.abs(switches["xi"][after == State.IMPACT])
        if not len(speed) or not len(depth):
            raise NotApplicable("the motion has no impacts, or no slide ends with ξ' = 0")
        jumping.append((np.count_nonzero(speed) + np.count_nonzero(depth)) / np.count_nonzero(before != State.IMPACT))
        numbers[name] = {"dxi": [np.median(speed), speed.max()], "xi": [np.median(depth), depth.max()]}
        rows.append(
            f"with {name}, ξ' jumps by {np.median(speed):.2g} ({speed.max():.2g}) where a slide turns or stops, "
            f"ξ jumps by {np.median(depth):.2g} ({depth.max():.2g}) at impacts, and "
            f"{100 * jumping[-1]:.0f} % of the switches have a jump"
        )
    text = f"{'; '.join(rows)}; where a stick or rest ends late, nothing jumps; each jump is a median (largest value)"
    return Outcome(text, numbers | {"jumping": jumping}, when(min(jumping) == 1.0, min(jumping[:-1]) > 0.5))


@claim("fig02", "Two coinciding zeros are a problem, as when the mass touches the obstacle without an impact.")
def touching(paper: Paper) -> Outcome:
    drop = HIGH - float(vd.simulate(**FALL, xi0=HIGH).switches[0]["xi"])
    ways: dict[str, dict[str, Any]] = {"certified": {}, "Muller (the paper's setting)": PAPERS}
    ways |= {f"fixed Δτ = {step:g}": {"method": "fixed", "dtau": step} for step in (1e-3, 0.1)}
    right = {}
    for name, way in ways.items():
        close = [d for d in CLOSENESS if all(_lands(drop - s * d, way) == (s > 0) for s in (1, -1))]
        right[name] = close[-1] if close == list(CLOSENESS[: len(close)]) and close else np.inf
    text = (
        f"at A = {FALL['A']:g} the decision is right if the lowest point of the slide is above or below the obstacle "
        "by at least "
    )
    text += f"{', '.join(f'{d:.0e} with {n}' for n, d in right.items())}; the least distance tried is {CLOSENESS[-1]:g}"
    return Outcome(text, right, when(max(right.values()) > CLOSENESS[-1]))


def _lands(height: float, way: dict[str, Any]) -> bool:
    """Return True if the first switch of a motion with this initial gap is an impact. `way` gives the method."""
    return bool(vd.simulate(**FALL, xi0=height, **way).switches[0]["after"] == State.IMPACT)
