"""Limits in ε over 1500 and over 20 000 periods, and for all times, starts and phases of the disturbance.

`k2` is the first loss of one motion from one start, hence an upper bound of the limit for all times and starts;
`k2_always` is a lower bound (vibrodrive/stability/always.py). Motions of 20 000 periods from random starts in its
intervals check the lower bound, and the same search with more samples shows how much the samples matter.

    python -m benchmarks.for_all_times           # measure, write for_all_times.json, draw, fill in the tables
    python -m benchmarks.for_all_times --draw    # draw the stored results, fill in the tables
"""

import json
from typing import Any
from unittest.mock import patch

import numpy as np

import vibrodrive as vd
from benchmarks.common import TWO_PI, environment, figure, parser, say, write
from benchmarks.tables import ROOT, number, show, table
from vibrodrive.stability import always
from vibrodrive.stability.main_impacts import follow_cycle
from vibrodrive.stability.structure import reference_orbit

PAGE, PICTURE = ROOT / "benchmarks" / "LIMITS.md", ROOT / "docs" / "for_all_times.png"
B = 0.1
OVER_A = np.linspace(1.15, 3.25, 29)
SHORT, LONG = 1500, 20_000
STARTS = 6  # motions at each A that check the lower bound
MORE = always.Samples(48, 768, 1.005)  # twice as many phases of the impact and of the disturbance
APART = 0.95  # the table contains limits whose ratio is below this


def measure() -> dict[str, Any]:
    """Return the limits over A, None where the motion has no period, and the checks of the lower bound."""
    sweeps = {}
    for periods in (SHORT, LONG):
        sweeps[periods] = vd.sweep(A=OVER_A, B=B, record="limit", transient=1000, periods=periods)
        say(f"limits over {periods} periods: measured")
    short, rows = sweeps[SHORT], []
    for at, A in enumerate(OVER_A.tolist()):
        if not short.orbit_period[at] > 0:
            continue
        k = vd.limit(A, B=B, transient=0, periods=256)
        if k.always is None or k.k2_always == 0.0:
            continue
        row = {"A": A, "n": k.n, "m": len(k.always.starts), "short": short.k2[at], "long": sweeps[LONG].k2[at]}
        row |= {"always": k.k2_always, "starts": k.always.starts, "how": k.always.how, "more": with_more_samples(A)}
        rows.append(row | {"kept": kept(A, k.always)})
        say(f"A = {A:.3f}: {row['always'] / row['short']:.3f} of k2, {rows[-1]['kept']} of {STARTS} motions kept")
    return {"rows": rows, "periods": [SHORT, LONG], "starts": STARTS}


def kept(A: float, found: always.Always) -> int:
    """Return how many motions of LONG periods from random starts in the intervals keep the structure at `found.k2`."""
    rng = np.random.default_rng(round(1e6 * A))
    low, high = np.array(found.starts)[rng.integers(len(found.starts), size=STARTS)].T
    tau0 = (low + (high - low) * rng.random(STARTS)) % TWO_PI + TWO_PI * rng.integers(1000, size=STARTS)
    base = reference_orbit(vd.simulate(A, B=B, transient=20_000, periods=256))
    assert base is not None
    assert base.cycle is not None
    motions = (vd.simulate(A, B=B, eps=found.k2, tau0=start, transient=0, periods=LONG) for start in tau0.tolist())
    return sum(follow_cycle(base.cycle, motion.impacts, LONG) is not None for motion in motions)


def with_more_samples(A: float) -> float:
    """Return the limit for all times from more samples."""
    with patch.object(always, "FINE", (MORE,)):
        return vd.limit(A, B=B, transient=0, periods=256).k2_always


def markdown(data: dict[str, Any]) -> dict[str, str]:
    """Return the table of limits that differ, and a sentence about all of them."""
    rows = data["rows"]
    share = np.array([(row["always"] / row["short"], row["long"] / row["short"]) for row in rows])
    more = np.array([row["more"] / row["always"] for row in rows]) - 1.0
    simple = np.array([row["n"] == 1 for row in rows])
    apart = [
        [f"{row['A']:.3g}", str(row["n"]), number(row["short"]), f"{long:.3f}", f"{ever:.3f}", row["how"]]
        for row, (ever, long) in zip(rows, share, strict=True)
        if min(ever, long) < APART
    ]
    text = (
        f"At {len(rows)} values of A from {rows[0]['A']:g} to {rows[-1]['A']:g} the limit for all times is "
        f"{share[simple, 0].min():.3f} to {share[simple, 0].max():.3f} of `k2` where n = 1 and "
        f"{share[~simple, 0].min():.3f} to {share[~simple, 0].max():.3f} where n ≥ 2. "
        f"{sum(row['kept'] for row in rows)} of {data['starts'] * len(rows)} motions of {data['periods'][1]} periods "
        f"from starts in its intervals keep the structure at it. Twice as many phases of both kinds change it by "
        f"{100 * more.min():+.1f} to {100 * more.max():+.1f} %."
    )
    head = ["A", "n", "k₂, 1500 periods", "20 000 periods, share", "for all times, share", "lost above it"]
    return {"for_all_times": table(head, apart), "for_all_times_check": text}


def draw(data: dict[str, Any]) -> Any:
    """Return the figure: the three limits over A, and their ratios."""
    rows = data["rows"]
    A, short, long, ever = (np.array([row[name] for row in rows]) for name in ("A", "short", "long", "always"))
    fig, axes = figure(6.4, 5.2, rows=2)
    above, below = axes[:, 0]
    shown = ((short, "o", "white", "k2: one start, 1500 periods"), (long, "x", "black", "the same, 20 000 periods"))
    for values, mark, face, label in (*shown, (ever, "v", "black", "k2_always: all times, starts and phases")):
        above.plot(A, values, mark, mfc=face, mec="black", ms=4, label=label)
        if values is not short:
            below.plot(A, values / short, mark, mfc=face, mec="black", ms=4)
    below.axhline(1.0, color="0.6", lw=0.6, zorder=0)
    above.set(yscale="log", ylabel=r"disturbance $\varepsilon$ at the limit")
    below.set(xlabel="$A$", ylabel="share of k2", ylim=(0.0, 1.1))
    above.legend(loc="lower left")
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
