"""Limits in ε over 1500 and over 20 000 periods, for all times, starts and phases, and for every disturbance.

`k2` is the first loss of one motion from one start, hence an upper bound of the limit for all times and starts;
`k2_always` is a lower bound, which is proved (vibrodrive/stability/always.py). `velocity_any` / (2Aη) is the ε up to
which a sine is one of the disturbances that are all allowed. Motions of 20 000 periods attack the second number: from
random starts in its intervals, after random numbers of periods, at it and at random smaller ε.

    python -m benchmarks.for_all_times           # measure, write for_all_times.json, draw, fill in the tables
    python -m benchmarks.for_all_times --draw    # draw the stored results, fill in the tables
"""

import json
from time import process_time
from typing import Any

import numpy as np

import vibrodrive as vd
from benchmarks.common import TWO_PI, environment, figure, parser, say, write
from benchmarks.tables import ROOT, number, show, table
from vibrodrive.stability.always import Always
from vibrodrive.stability.main_impacts import ImpactCycle, follow_cycle

PAGE, PICTURE = ROOT / "benchmarks" / "LIMITS.md", ROOT / "docs" / "for_all_times.png"
B = 0.1
OVER_A = np.array([1.2, 1.5, 1.9, 2.3, 2.55, 2.62, 2.7, 2.75, 2.85, 2.95, 3.04, 3.1, 3.25])
SHORT, LONG = 1500, 20_000
STARTS = 6  # motions at each A that attack the proved number, one half at it, one half at smaller amplitudes
APART = 0.97  # the table contains limits whose share of the first loss is below this


def measure() -> dict[str, Any]:
    """Return the limits over A where the motion has main impacts, and the attacks on the proved ones."""
    sweeps = {}
    for periods in (SHORT, LONG):
        sweeps[periods] = vd.sweep(A=OVER_A, B=B, record="limit", transient=1000, periods=periods)
        say(f"limits over {periods} periods: measured")
    rows = []
    for at, A in enumerate(OVER_A.tolist()):
        k, began = vd.limit(A, B=B, transient=0, periods=256), process_time()
        if k.always is None or k.cycle is None:
            continue
        row = {"A": A, "n": k.n, "m": len(k.cycle.gaps)} | {
            name: sweeps[periods].k2[at] for name, periods in (("short", SHORT), ("long", LONG))
        }
        row |= {"always": k.k2_always, "starts": k.always.starts, "how": k.always.how}
        row |= {"seconds": process_time() - began, "any": k.velocity_any / (2.0 * A * k.eta)}
        rows.append(row | {"kept": attacked(A, k.always, k.cycle)})
        say(f"A = {A:.3f}: {share(rows[-1]):.3f} of the first loss, {row['seconds']:.0f} s, {rows[-1]['kept']} kept")
    return {"rows": rows, "periods": [SHORT, LONG], "starts": STARTS}


def share(row: dict[str, Any]) -> float:
    """Return the share of the first loss, over 1500 or 20 000 periods, that is proved to be kept for all times."""
    return float(row["always"] / min(row["short"], row["long"]))


def attacked(A: float, found: Always, cycle: ImpactCycle) -> int:
    """Return how many of STARTS motions of LONG periods from the intervals keep the structure."""
    if not found.starts:
        return 0
    rng = np.random.default_rng(round(1e6 * A))
    low, high = np.array(found.starts)[rng.integers(len(found.starts), size=STARTS)].T
    tau0 = (low + (high - low) * rng.random(STARTS)) % TWO_PI + TWO_PI * rng.integers(1000, size=STARTS)
    eps = found.k2 * np.where(np.arange(STARTS) % 2, rng.random(STARTS), 1.0)
    kept = 0
    for start, value in zip(tau0.tolist(), eps.tolist(), strict=True):
        motion = vd.simulate(A, B=B, eps=value, tau0=start, transient=0, periods=LONG)
        kept += follow_cycle(cycle, motion.impacts, LONG) is not None
    return kept


def markdown(data: dict[str, Any]) -> dict[str, str]:
    """Return the table of limits that differ, and a sentence about all of them."""
    rows = data["rows"]
    proved = [row for row in rows if row["starts"]]
    shares = {n: [share(row) for row in proved if (row["n"] == 1) == (n == 1)] for n in (1, 2)}
    apart = [
        [f"{row['A']:.3g}", str(row["n"]), str(row["m"]), number(row["short"]), f"{row['long'] / row['short']:.3f}",
         f"{share(row):.3f}" if row["starts"] else "–", f"{row['seconds']:.0f}", row["how"]]
        for row in rows
        if not row["starts"] or share(row) < APART
    ]  # fmt: skip
    text = (
        f"At {len(proved)} of {len(rows)} values of A from {rows[0]['A']:g} to {rows[-1]['A']:g} a limit for all times "
        f"is proved. It is {min(shares[1]):.3f} to {max(shares[1]):.3f} of the first loss where n = 1, and "
        f"{min(shares[2]):.3f} to {max(shares[2]):.3f} where n ≥ 2, median {np.median(shares[2]):.3f}. The proofs take "
        f"{min(row['seconds'] for row in proved):.0f} to {max(row['seconds'] for row in proved):.0f} s each on one "
        f"core. {sum(row['kept'] for row in proved)} of {data['starts'] * len(proved)} motions of {data['periods'][1]} "
        f"periods from starts in the intervals keep the structure, one half of them at the proved amplitude, the "
        f"others at random smaller ones."
    )
    head = [
        "A",
        "n",
        "m",
        "k₂, 1500 periods",
        "20 000 periods, share",
        "proved, share of the first loss",
        "s",
        "beyond it",
    ]
    return {"for_all_times": table(head, apart), "for_all_times_check": text}


def draw(data: dict[str, Any]) -> Any:
    """Return the figure: the four limits over A, and their ratios."""
    rows = data["rows"]
    A, short, long, ever, every = (
        np.array([row[name] for row in rows]) for name in ("A", "short", "long", "always", "any")
    )
    fig, axes = figure(6.4, 5.2, rows=2)
    above, below = axes[:, 0]
    for values, mark, face, label in (
        (short, "o", "white", "k2: one start, 1500 periods"),
        (long, "x", "black", "the same, 20 000 periods"),
        (ever, "v", "black", "k2_always: for ever, all starts and phases, proved"),
        (every, "_", "black", "every disturbance: velocity_any / (2 A η), proved"),
    ):
        above.plot(A, values, mark, mfc=face, mec="black", ms=4, label=label)
        if values is not short:
            below.plot(A, values / short, mark, mfc=face, mec="black", ms=4)
    below.axhline(1.0, color="0.6", lw=0.6, zorder=0)
    above.set(yscale="log", ylabel=r"disturbance $\varepsilon$ at the limit")
    below.set(xlabel="$A$", ylabel="share of k2", ylim=(0.0, 1.1))
    above.legend(loc="lower left", fontsize=7)
    above.set_title("structure kept for ever below the triangles, lost at the circles", fontsize=9)
    return fig


def main() -> None:
    """Measure the limits, or read stored limits. Then draw the chart and write the tables."""
    options = parser(__doc__, draws=True).parse_args()
    if not options.draw:
        write("for_all_times", measure() | {"environment": environment()}, None, options.output)
    data = json.loads((options.output / "for_all_times.json").read_text(encoding="utf-8"))
    show(PAGE, markdown(data), PICTURE, draw(data))


if __name__ == "__main__":
    main()
