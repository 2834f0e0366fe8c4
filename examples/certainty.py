"""How far off a certified motion can be, and how far off it is.

    python -m examples.certainty   # in the root of a clone

writes docs/certainty.md and docs/certainty.png: bounds of errors beside the errors, found in 50 digits, along four
motions and over scenes drawn from all bands. `--scenes N` draws N of them, `--workers N` in so many processes,
`--docs DIR` writes to another folder.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vibrodrive.figures.style import explain, look, new, save, styled
from vibrodrive.validation.certainty import MOST, Held, draw, hold, table

DOCS = Path(__file__).parent.parent / "docs"

SEED = 17

MOTIONS: dict[str, dict[str, Any]] = {
    "stable: A = 3.04": {"A": 3.04, "periods": 200},
    "marginal: A = 3.0574, next to a period doubling": {"A": 3.0574, "periods": 200},
    "chattering: A = 1.9, B = 0.2, ε = 2e-5, η = 431.7": {"A": 1.9, "B": 0.2, "eps": 2e-5, "eta": 431.7, "periods": 4},
    "chaotic: A = 12": {"A": 12.0, "periods": 230},
}
"""What the figure shows, from rest."""

PAGE = """# What a motion is off by

Written by `python -m examples.certainty --scenes {number}`.

`simulate` follows a motion in double precision. Every switch is found from the state that the one before has left, and
inherits what that state is off by. [`certainty.py`](../vibrodrive/kernels/certainty.py) carries a bound of it along:
`Trajectory.error` for the section points, `switch_errors` for the switches, and `certain_until`, the period from which
on a decision may be wrong. `sweep(…, record="error")` keeps the largest bound of each motion.

![Error and bound along four motions](certainty.png)

*Error of the instant of each switch, found in 50 digits, and its bound. At A = 12 the bound ends with the last switch
that is certain; some switches later the computed motion takes another turn than the true one, with no margin small.*

## What is bounded

A state begins at the computed instant $\\hat{{\\tau_0}}$, and in truth at $\\tau_0$. Sliding is
$\\xi'' = H(\\tau) - s$, eq. (1), and in *absolute* time the right side is the same for both: they differ by a straight
line. With $E$ and $X$
for the differences of ξ' and ξ at $\\hat{{\\tau_0}}$, either motion continued there by its closed form,

```math
\\Delta\\xi' = E, \\qquad \\Delta\\xi = X + E\\,h .
```

To this comes what the closed form rounds at $h$.

**A start from rest** that is off by $|\\tau_0 - \\hat{{\\tau_0}}| \\le \\delta$, with $\\xi'' = a_0$ at
$\\hat{{\\tau_0}}$ and $|H'| \\le M$ near by, has

```math
|E| \\le |a_0|\\,\\delta + \\tfrac{{1}}{{2}} M\\delta^2, \\qquad
|\\Delta X| \\le \\tfrac{{1}}{{2}} |a_0|\\,\\delta^2 + \\tfrac{{1}}{{6}} M\\delta^3 .
```

**A slide ends by ξ' = 0** where the computed ξ' vanishes, to its rounding, and $a_1 = H - s$. The true ξ' is at most
$E_1 = |E| + \\text{{rounding}}$ there, so it has a zero no further away than

```math
\\delta_1 = \\frac{{2E_1}}{{|a_1| + \\sqrt{{a_1^2 - 2ME_1}}}} ;
```

for $a_1^2 \\le 2ME_1$ there may be none. **An impact** is the same with ξ in the place of ξ', with $|\\xi'|$ less its
error in that of $|a_1|$, and with a bound of $|\\xi''|$ in that of $M$. It leaves ξ = ξ' = 0: only the error of its
instant goes on. **A wait** ends where H = ±1, whatever was before: at ε = 0 at a known arcsine, good to its last bits;
at ε > 0 at a zero of H, off by the rounding of H over |H'|. After a rest nothing is left of any error before it.

**Signs.** If only absolute values were added up, stable motions would seem to lose digits: what one late start does to
ξ and to ξ' cancels in part at the next impact. What comes of the instant of the last impact is therefore carried with
its sign: $E = e\\,u + E'$ and $X = x\\,u + X'$ with one unknown $|u| \\le 1$. At a reversal $e$ becomes $a_0\\,e/a_1$,
which is the derivative of the map from impact to impact. So the bound shrinks where a motion is stable, and grows where
it is not, as its errors do.

**Decisions.** The zero found is the first of the true ξ', too, if no dip on the way came closer to 0 than twice $E_1$.
A reversal is in the air if ξ there is above its bound. H decides as computed if its distance from ±1 is above
$M\\delta_1$ and the rounding of H. Otherwise the motion is `TOO_CLOSE`, `certain_until` is the period in which the
state began that met the decision, and all errors from there on are infinite, to the end of the record: a rest that
follows a wrong turn is exact, but another motion's.

**A section point** has the errors of its state at that time. Within δ of a switch it may belong to the state on the
other side, and the jump of ξ' is added: that is |ξ'| itself at an impact.

## What is assumed

- Arithmetic is that of IEEE 754, with fused products where the code says so
  ([`branchless.py`](../vibrodrive/jit/branchless.py)).
- Sine and cosine are off by less than 1.4e-16 ([`trig.py`](../vibrodrive/jit/trig.py)), and a closed form by less than
  eight units in the last place of its terms, added up in size ([`margins.py`](../vibrodrive/kernels/margins.py):
  `gap_rounding`, `velocity_rounding`).
- The search passes over no zero, and has seen from close by every dip that is less than 2E₁ deep
  ([`first_zero.py`](../vibrodrive/kernels/first_zero.py)).
- The bounds themselves are computed in double precision, rounded to nearest. The eight units leave room for that.

This is a proof by hand, held against 50 digits below; it is not interval arithmetic. With Muller's method the value of
the switching function where it stops takes the place of rounding, so the bounds hold what `tol` does; that the grid has
missed no zero is assumed. A fixed grid has no bounds: its lateness is the disturbance under study.

In a sweep without `record="error"` the status OK says of each switch that it is right from the state it starts from,
as computed. With it each motion is followed by itself to the end of its record; without it many are followed side by
side, and what repeats is copied. On one thread that is six times as fast with a disturbance (A from 2 to 3.25,
ε = 2e-4, 200 periods) and fifty times at ε = 0 (300 periods). `simulate` takes a sixth to a quarter longer for bounds.

## Against 50 digits

Scenes drawn from all bands (seed {seed}), up to {most} switches each, compared number by number: instants, ξ and ξ' of
switches, ξ and ξ' of section points. The last columns are about each scene's largest bound over its largest error.

{table}

`vibrodrive validate --only bounds` draws others.
"""


def held(drawn: tuple[str, dict[str, Any]]) -> tuple[str, Held]:
    """One scene beside the reference, in a process of its own."""
    name, scene = drawn
    return name, hold(scene)


@styled
def figure(motions: dict[str, Held]) -> Figure:
    """Error and bound of the instant of each switch over time, a panel for each motion."""
    fig, axes = new(2, 2, height=5.0, sharey=True)
    for ax, (title, beside) in zip(axes.flat, motions.items(), strict=True):
        rows, pairs = beside.motion.switches, [p for p in beside.pairs if p.what == "tau of a switch"]
        time = rows["period"] + rows["phase"] / (2.0 * np.pi)
        at = time[[p.number for p in pairs]]
        ax.semilogy(at, [p.bound for p in pairs], color=look().other, lw=0.8, label="bound")
        ax.semilogy(at, [max(p.error, 1e-19) for p in pairs], ".", color=look().main, ms=2, label="error")
        ax.set_title(title, fontsize=9)
        ax.set_ylim(1e-18, 1e-1)
    for ax in axes[-1]:
        ax.set_xlabel("excitation period")
    for ax in axes[:, 0]:
        ax.set_ylabel("error of τ at a switch")
    explain(fig)
    return fig


def beside_reference(scenes: Sequence[tuple[str, dict[str, Any]]], workers: int) -> dict[str, list[Held]]:
    """Scenes by band, each beside the reference."""
    found: dict[str, list[Held]] = {}
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for name, one in pool.map(held, scenes, chunksize=12):
            found.setdefault(name, []).append(one)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder to write to")
    parser.add_argument("--scenes", type=int, default=2040, help="scenes that are drawn")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    options = parser.parse_args()
    shown = {title: hold(scene, most=1600) for title, scene in MOTIONS.items()}
    save(figure(shown), options.docs / "certainty.png", dpi=140)
    found = beside_reference(draw(SEED, options.scenes), options.workers)
    page = PAGE.format(number=options.scenes, seed=SEED, most=MOST, table="\n".join(table(found)))
    (options.docs / "certainty.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
