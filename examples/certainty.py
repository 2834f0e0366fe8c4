"""Compare the error bounds of certified motions with their errors.

    python -m examples.certainty   # in the root of a clone

writes docs/certainty.md and docs/certainty.png: error bounds and errors, from a reference with 50 digits, along four
motions and for random scenes from all bands. `--scenes N` sets the number of scenes, `--workers N` the number of
processes, `--docs DIR` the output folder.
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
"""Motions of the figure, from rest."""

PAGE = """# Error bounds of a motion

After this page you know the meaning and the proof of the error bounds of a motion, and their ratio to the
true errors. `python -m examples.certainty --scenes {number}` writes this page.

`simulate` follows a motion in double precision. It finds every switch from the state after the previous
switch, and so inherits the error of that state. [`certainty.py`](../vibrodrive/kernels/certainty.py)
propagates a bound of this error: `Trajectory.error` for the section points, `switch_errors` for the
switches, and `certain_until`, the period from which on a decision may be wrong.
`sweep(…, record="error")` keeps the largest bound of each motion.

![Error and bound along four motions](certainty.png)

*Error of the instant of each switch, from a computation with 50 digits, and its bound. At A = 12 the
bound ends with the last certain switch. Some switches later the computed motion takes another branch than
the true one, although no margin is small.*

## The bounds

A state begins at the computed instant $\\hat{{\\tau_0}}$; the true instant is $\\tau_0$. Sliding is
$\\xi'' = H(\\tau) - s$, eq. (1). In *absolute* time the right side is the same for both motions, so they
differ by a straight line. Let $E$ and $X$ be the differences of ξ' and ξ at $\\hat{{\\tau_0}}$, each motion
continued there by its closed form. Then

```math
\\Delta\\xi' = E, \\qquad \\Delta\\xi = X + E\\,h .
```

The rounding error of the closed form at $h$ is added.

**A start from rest** with an error of $|\\tau_0 - \\hat{{\\tau_0}}| \\le \\delta$, with $\\xi'' = a_0$ at
$\\hat{{\\tau_0}}$ and $|H'| \\le M$ nearby, has

```math
|E| \\le |a_0|\\,\\delta + \\tfrac{{1}}{{2}} M\\delta^2, \\qquad
|\\Delta X| \\le \\tfrac{{1}}{{2}} |a_0|\\,\\delta^2 + \\tfrac{{1}}{{6}} M\\delta^3 .
```

**The start of a motion** is exact: the bits of τ₀ that its phase cannot hold are stored separately. ξ''
there has the rounding error of H. Where H rounds to ±1, this error may reverse a velocity ξ'₀ of the
order of its square over |H'|, about 1e-29: such a start is TOO_CLOSE. A gap or velocity too small for all
bits of a double has an error of less than 1e-300, which is added.

**A slide ends with ξ' = 0** where the computed ξ' vanishes within its rounding error. Let $a_1 = H - s$
there. The true ξ' is at most $E_1 = |E| + \\text{{rounding}}$, so it has a zero within a distance of

```math
\\delta_1 = \\frac{{2E_1}}{{|a_1| + \\sqrt{{a_1^2 - 2ME_1}}}} ;
```

for $a_1^2 \\le 2ME_1$ there may be none. **An impact** has the same bound with ξ instead of ξ', with
$|\\xi'|$ minus its error instead of $|a_1|$, and with a bound of $|\\xi''|$ instead of $M$. It leaves ξ =
ξ' = 0: only the error of its instant remains. **A wait** ends where H = ±1, independent of the earlier
motion: at ε = 0 at a known arcsine, accurate to its last bits; at ε > 0 at a zero of H, with an error of
the rounding of H over |H'|. After a rest no earlier error remains.

**Signs.** With absolute values only, stable motions would seem to lose digits: the effects of one late
start on ξ and on ξ' cancel in part at the next impact. Therefore the effect of the instant of the last
impact has a sign: $E = e\\,u + E'$ and $X = x\\,u + X'$ with one unknown $|u| \\le 1$. At a reversal $e$
becomes $a_0\\,e/a_1$, which is the derivative of the map from impact to impact. So the bound shrinks where
a motion is stable, and grows where it is not, as the errors do.

**Decisions.** The zero found is also the first zero of the true ξ' if no earlier minimum came closer to 0
than twice $E_1$. A reversal is in the air if ξ exceeds its bound there. H decides as computed if its
distance from ±1 exceeds $M\\delta_1$ and the rounding of H. Otherwise the motion is `TOO_CLOSE`,
`certain_until` is the period in which the state before the decision began, and all errors from there to
the end of the record are infinite: a rest after a wrong decision is exact, but belongs to another motion.

**A section point** has the errors of its state at that time. Within δ of a switch it may belong to the
state on the other side. Then the jump of ξ' is added, which is |ξ'| itself at an impact.

## Assumptions

- Arithmetic is that of IEEE 754, with fused products where the code uses them
  ([`branchless.py`](../vibrodrive/jit/branchless.py)).
- The error of sine and cosine is less than 1.4e-16 ([`trig.py`](../vibrodrive/jit/trig.py)). The error of
  a closed form is less than eight units in the last place of the sum of the magnitudes of its terms
  ([`margins.py`](../vibrodrive/kernels/margins.py): `gap_rounding`, `velocity_rounding`).
- The search passes no zero, and it evaluates the function near every minimum below 2E₁
  ([`first_zero.py`](../vibrodrive/kernels/first_zero.py)).
- The bounds themselves are computed in double precision, rounded to nearest. The eight units leave room
  for that.

This is a proof by hand, compared with 50 digits below; it is not interval arithmetic. With Muller's
method the value of the switching function at the end of its iteration replaces the rounding error, so the
bounds depend on `tol`. They assume that the grid missed no zero. A fixed grid has no bounds: its lateness
is the disturbance under study.

In a sweep without `record="error"` the status OK certifies each switch for the computed state in which it
starts. With it the sweep follows each motion separately to the end of its record. Without it a batch
holds many motions, and repetitions are copied. On one thread the second is six times as fast with a
disturbance (A from 2 to 3.25, ε = 2e-4, 200 periods) and fifty times at ε = 0 (300 periods). With bounds
`simulate` takes a sixth to a quarter longer.

## Comparison with 50 digits

Random scenes from all bands (seed {seed}), up to {most} switches each, compared number by number: instants, ξ
and ξ' of switches, ξ and ξ' of section points. The last columns give the ratio of each scene's largest
bound to its largest error.

{table}

`vibrodrive validate --only bounds` compares other random scenes.
"""


def held(drawn: tuple[str, dict[str, Any]]) -> tuple[str, Held]:
    """Compare one scene with the reference, in a separate process."""
    name, scene = drawn
    return name, hold(scene)


@styled
def figure(motions: dict[str, Held]) -> Figure:
    """Draw error and bound of the instant of each switch over time, with a panel for each motion."""
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
    """Compare each scene with the reference; return the results by band."""
    found: dict[str, list[Held]] = {}
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for name, one in pool.map(held, scenes, chunksize=12):
            found.setdefault(name, []).append(one)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder to write to")
    parser.add_argument("--scenes", type=int, default=2040, help="number of random scenes")
    parser.add_argument("--workers", type=int, default=2, help="number of processes")
    options = parser.parse_args()
    shown = {title: hold(scene, most=1600) for title, scene in MOTIONS.items()}
    save(figure(shown), options.docs / "certainty.png", dpi=140)
    found = beside_reference(draw(SEED, options.scenes), options.workers)
    page = PAGE.format(number=options.scenes, seed=SEED, most=MOST, table="\n".join(table(found)))
    (options.docs / "certainty.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
