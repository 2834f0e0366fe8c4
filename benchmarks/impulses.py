"""Every disturbance: how sharp the proved impulse V is, and how it compares with the limit k₂ of a sine.

A simulator that shares no code with the package (tests/support/blows.py) attacks V at drawn machines: with main impacts
that are late and early in turn, with touches half a period after an impact, and with parts of such disturbances
replaced at random. The result is the smallest share of V at which one of them destroys the structure.

    python -m benchmarks.impulses           # measure, write impulses.json, fill in the table of LIMITS.md
    python -m benchmarks.impulses --draw    # fill in the table from the stored results
"""

import json
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.common import environment, parser, say, write
from benchmarks.tables import ROOT, number, table, write_into
from tests.support.blows import attack, main_impacts, strike
from vibrodrive.model.reasons import Beyond
from vibrodrive.stability.impulses import find_tolerated
from vibrodrive.stability.main_impacts import ImpactCycle, follow_cycle
from vibrodrive.stability.structure import reference_orbit

PAGE = ROOT / "benchmarks" / "LIMITS.md"
MACHINES = 24  # drawn machines
SHARES = (0.97, 0.99, 1.02, 1.05, 1.1, 1.15, 1.3, 2.0)  # of V
RUNS = 30  # disturbances for each of them
LEAST = 0.01  # V below which steps would have to be too small
OVER_A = np.linspace(1.15, 3.25, 43)


def over_A(A: np.ndarray, B: float = 0.1, eta: float = vd.ETA) -> np.ndarray:
    """Return A, the period of the orbit, V, and the impulse 2 A η k₂ of the sine at its limit, where both are known."""
    sine = vd.sweep(A=A, B=B, eta=eta, record="limit", transient=1000, periods=1500)
    every = vd.sweep(A=A, B=B, record="impulses").velocity_any
    rows = np.array([A, sine.orbit_period, every, 2.0 * sine.velocity]).T
    return rows[(rows[:, 2] > 0.0) & np.isfinite(rows[:, 3])]


def measure() -> dict[str, Any]:
    """Return the smallest shares lost at drawn machines, and the ratios of V to limits k₂ over A."""
    rng = np.random.default_rng(66)
    machines: list[dict[str, Any]] = []
    while len(machines) < MACHINES:
        B = float(rng.uniform(0.02, 0.9)) if len(machines) % 2 else 0.1
        A = float(rng.uniform(1.05 + B, 3.3 + 3.0 * B))
        base = reference_orbit(vd.simulate(A, B=B, transient=20_000, periods=256))
        if base is None or base.cycle is None:
            continue
        found = find_tolerated(A, B, base.cycle)
        if not found.velocity > LEAST:
            continue
        lost = attacked(A, B, found.velocity, base.cycle, found.beyond == Beyond.DRIFT)
        n, m = base.cycle.n, len(base.cycle.gaps)
        machines.append(
            {"A": A, "B": B, "n": n, "m": m, "V": found.velocity, "beyond": found.beyond.name, "lost": lost}
        )
        say(f"{machines[-1]}")
    return {"machines": machines, "shares": SHARES, "runs": RUNS, "sine": over_A(OVER_A).tolist()}


def attacked(A: float, B: float, V: float, cycle: ImpactCycle, slow: bool) -> list[int]:
    """Return how many disturbances destroy the structure at each share of V. A drift to the loss may be `slow`."""
    periods, steps = 10 * cycle.n * (4 if slow else 1), int(np.clip(60.0 / V, 1200, 6000))
    blows = attack([share * V for share in SHARES], 0.0, cycle, RUNS, np.random.default_rng(round(1e6 * A)))
    found = strike(A, B, float(cycle.phase[0]), periods, blows, steps)
    lost = [follow_cycle(cycle, main_impacts(one), periods) is None for one in found]
    return np.reshape(lost, (len(SHARES), RUNS)).sum(axis=1).tolist()


def smallest(data: dict[str, Any], lost: list[int]) -> float:
    """Return the smallest share of V at which a disturbance destroys the structure, inf if none does."""
    return next((share for share, count in zip(data["shares"], lost, strict=True) if count), float("inf"))


def markdown(data: dict[str, Any]) -> dict[str, str]:
    """Return the table of the machines, and a sentence about all of them."""
    machines = sorted(data["machines"], key=lambda one: (one["n"], one["B"], one["A"]))
    shares = [smallest(data, one["lost"]) for one in machines]
    rows = [
        [f"{one['A']:.4g}", f"{one['B']:.3g}", str(one["n"]), str(one["m"]), number(one["V"]),
         f"{share:g}".replace("inf", "none"), Beyond[one["beyond"]].meaning]
        for one, share in zip(machines, shares, strict=True)
    ]  # fmt: skip
    below = [sum(one["lost"][at] for one in machines) for at, share in enumerate(data["shares"]) if share < 1.0]
    near, far = (sum(share <= most for share in shares) for most in (1.05, 1.15))
    A, _, V, impulse = np.array(data["sine"]).T
    ratio = V / impulse
    text = (
        f"{sum(below)} of {len(below) * data['runs'] * len(machines)} disturbances below V destroy the structure. At "
        f"{near} of {len(machines)} machines one of {data['runs']} does at up to 1.05 V, and at {far} at up to 1.15 V. "
        f"At {len(A)} values of A from {A[0]:g} to {A[-1]:g}, B = 0.1, V is {ratio.min():.2g} to {ratio.max():.2g} of "
        f"the impulse of the sine at its k₂, η = 101, with the median {np.median(ratio):.2g}."
    )
    head = ["A", "B", "n", "main impacts", "V", "smallest share lost", "not proved beyond V"]
    return {"impulses": table(head, rows), "impulses_check": text}


def main() -> None:
    """Measure, or read stored results. Then write the table."""
    options = parser(__doc__, draws=True).parse_args()
    if not options.draw:
        write("impulses", measure() | {"environment": environment()}, None, options.output)
    data = json.loads((options.output / "impulses.json").read_text(encoding="utf-8"))
    write_into(PAGE, markdown(data))


if __name__ == "__main__":
    main()
