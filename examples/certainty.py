"""Compare the error bounds of certified motions with their true errors.

    python -m examples.certainty   # in the root of a clone

writes docs/certainty.md and docs/certainty.png. Both compare error bounds with true errors, which come from a reference
with 50 digits. The figure shows four motions. The page compares random scenes from the bands of
`vibrodrive.validation.certainty`. A scene contains the parameters and the start of a motion. A band is a set of ranges
of these numbers. `--scenes N` sets the number of scenes, `--workers N` the number of processes, `--docs DIR` the output
folder.
"""

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
"""Titles of the panels of the figure, and the arguments of their motions, which start from rest."""

PAGE = """# Error bounds of a motion

After this page you know the meaning and the proof of the error bounds of a motion, and how much larger these
bounds are than the true errors. `python -m examples.certainty --scenes {number}` writes this page.

`simulate` computes a motion in double precision. It computes each switch from the computed state after the
previous switch. So the error of each switch depends on the errors of all earlier switches.
[`certainty.py`](../vibrodrive/kernels/certainty.py) computes a bound of this error from switch to switch. A
`Trajectory` has three results: `error` contains the bounds for the section points, `switch_errors` contains the
bounds for the switches, and `certain_until` is the period from which on the choice of a next state may be
wrong. A sweep with `record="error"` stores the largest bound of each motion.

![Error and bound along four motions](certainty.png)

*Each dot is the error of the instant of a switch, compared with a computation with 50 digits. The curves are
the bounds of these errors. At A = 12 the curve ends with the last certain switch. Some switches later the state
of the computed motion differs from the state of the true motion. The
[margins](glossary.md#motion-and-switches) do not show this error: each margin is much larger than the rounding
error at its decision.*

## The bounds

Let $\\hat{{\\tau_0}}$ be the computed instant at which a state begins, and $\\tau_0$ the true instant. The
equation of a slide is $\\xi'' = H(\\tau) - s$, eq. (1), with $s = 1$ for a slide up and $s = -1$ for a slide
down. In *absolute* time $\\tau$ the right side is the same for the computed and the true motion. So the
difference between the true and the computed ξ is a linear function of time. Let $E$ and $X$ be the differences
of ξ' and of ξ at $\\hat{{\\tau_0}}$. (If the true slide begins later than $\\hat{{\\tau_0}}$, its closed form
is continued back to this instant.) Then, at a time $h$ after $\\hat{{\\tau_0}}$,

```math
\\Delta\\xi' = E, \\qquad \\Delta\\xi = X + E\\,h .
```

The bounds also include the rounding error of the closed form at $h$.

**A slide begins with ξ' = 0**, except possibly the first slide of a motion. Let $\\delta$ be a bound of the
error of the instant of this beginning, $|\\tau_0 - \\hat{{\\tau_0}}| \\le \\delta$. Let $a_0$ be $\\xi''$ at
$\\hat{{\\tau_0}}$, and let $|H'| \\le M$ between $\\tau_0$ and $\\hat{{\\tau_0}}$. Then

```math
|E| \\le |a_0|\\,\\delta + \\tfrac{{1}}{{2}} M\\delta^2, \\qquad
|\\Delta X| \\le \\tfrac{{1}}{{2}} |a_0|\\,\\delta^2 + \\tfrac{{1}}{{6}} M\\delta^3 .
```

$\\Delta X$ is the part of $X$ that the error of the instant causes.

**The start of a motion** is exact: the bits of τ₀ that the phase cannot hold are stored in another variable.
ξ'' at the start has the rounding error of H. If H rounds to ±1, this rounding error may reverse the direction
of the motion. Let $r$ be this rounding error. A reversal is possible only if |ξ'₀| is at most of the order
$r^2/|H'|$, which is about 1e-29. The status of a motion with such a start is `TOO_CLOSE`. A denormal gap or
velocity (below 2.3e-308) has fewer bits than other numbers. The bounds include the resulting error, which is
less than 1e-300.

**A slide ends with ξ' = 0** at an instant at which the computed ξ' is 0 within its rounding error. Let $a_1 = H
- s$ at this instant, and let $|H'| \\le M$ near this instant. The modulus of the true ξ' at this instant is at
most $E_1 = |E| + \\text{{rounding}}$. So the true ξ' has a zero within a distance of

```math
\\delta_1 = \\frac{{2E_1}}{{|a_1| + \\sqrt{{a_1^2 - 2ME_1}}}} .
```

For $a_1^2 \\le 2ME_1$ the true ξ' may have no zero nearby, and the motion is `TOO_CLOSE`. **An impact** has the
same bound with three replacements: ξ instead of ξ', $|\\xi'|$ minus its error instead of $|a_1|$, and a bound
of $|\\xi''|$ instead of $M$. After an impact ξ = ξ' = 0 exactly, so only the error of the instant of the impact
remains. **Sticking** ends where H = ±1, and **a rest** ends where H = 1. The time of such an end does not depend
on the errors of the earlier motion. For ε = 0 this time is an arcsine, accurate to its last bits. For ε > 0 it
is a zero of H − 1 or H + 1, and its error is the rounding error of H divided by |H'|. After a rest no earlier error
remains. After sticking only the error of ξ remains.

**Signs.** Bounds that use only absolute values would grow even along stable motions. The reason is that the
effects of a late start on ξ and on ξ' partly cancel at the next impact. Therefore the bounds keep the sign of
one effect, the effect of the error of the last impact's instant. For this purpose the errors are divided into
two parts: $E = e\\,u + E'$ and $X = x\\,u + X'$. The parts $e\\,u$ and $x\\,u$ are the effect of the error of
this instant. The numbers $e$ and $x$ are computed with their signs. The number $u$ is unknown, with $|u| \\le 1$,
but it is the same in both equations. $E'$ and $X'$ are the effects of all other errors (the prime is not a
derivative here), and only bounds of their absolute values are used. If ξ'' is $a_1$ just before a reversal and
$a_0$ just after it, $e$ becomes $a_0\\,e/a_1$ at this reversal. The derivative of the impact-phase map
([glossary](glossary.md#orbits-and-bifurcations)) contains the same factor. So the bounds shrink along a stable
motion and grow along an unstable motion, like the true errors.

**Decisions.** The computed zero of ξ' approximates the first zero of the true ξ' if |ξ'| has no earlier minimum
below $2E_1$. If the computed ξ at this zero exceeds its error bound, the mass is not at the obstacle, so there
is no impact. The computed next state is right if the distance of H from ±1 exceeds $M\\delta_1$ plus the rounding
error of H. If one of these conditions fails, the motion is `TOO_CLOSE`, and `certain_until` is the period in
which the state before this decision began. After the beginning of this state all error bounds are infinite to
the end of the record, also after a later rest. The end of this rest may be accurate, but the true motion may
have no rest there.

**A section point** has the error bounds of ξ and ξ' at its time. Suppose that the time between the point and a
switch is less than the error bound of the instant of this switch. Then the true motion may be in the state on
the other side of the switch. The bounds of the point then include the largest difference that this other state
can cause within this time. At an impact this difference of ξ' is about the impact speed |ξ'|.

## Assumptions

- The arithmetic is that of IEEE 754, with fused multiply-add where the code requests it
  ([`branchless.py`](../vibrodrive/jit/branchless.py)).
- The error of sine and cosine is less than 1.4e-16 ([`trig.py`](../vibrodrive/jit/trig.py)). The error of
  a closed form is less than eight units in the last place of the sum of the magnitudes of its terms
  ([`margins.py`](../vibrodrive/kernels/margins.py): `gap_rounding`, `velocity_rounding`).
- The search for the first zero does not miss a zero. The search evaluates the switching function near every
  minimum below $2E_1$ ([`first_zero.py`](../vibrodrive/kernels/first_zero.py)).
- The bounds are computed in double precision, rounded to nearest, so they have rounding errors, too. The eight
  units above are large enough to include these rounding errors.

The bounds are proved by hand, and are not computed in interval arithmetic. The comparison with 50 digits below
tests the bounds. With Muller's method the iteration ends at a value of the switching function that is not
exactly 0. This value is added to the rounding error, so the bounds depend on `tol`. With this method the bounds
are valid only if the grid missed no zero. The method `fixed` has no bounds: each of its switches is late by up
to Δτ, and this delay is the disturbance under study.

In a sweep without `record="error"` the status OK certifies each switch as if the computed state after the
previous switch were exact. Such a sweep computes many motions in one batch. If a motion repeats, the sweep
copies its periods. With `record="error"` a sweep computes each motion separately, and copies nothing. On one
thread the sweep without `record="error"` is six times as fast with a disturbance (A from 2 to 3.25, ε = 2e-4,
200 periods) and fifty times as fast at ε = 0 (300 periods). `simulate` always computes the bounds, except with
the method `fixed`. This increases its time by a sixth to a quarter.

## Comparison with 50 digits

A scene is a motion with its parameters and its start. Each row of the table gives the results for one set of
ranges of parameters and starts. The scenes are drawn at random from these ranges (seed {seed}). For up to 100
switches of each motion, the instant, ξ and ξ' are compared with the reference. ξ and ξ' of each section point
are compared, too. A scene becomes uncertain if its `certain_until` is finite. For each motion the largest bound
is divided by the largest error. The last two columns give the median and the 90 % quantile of this ratio.

{table}

`vibrodrive validate --only bounds` repeats this comparison with fewer and other random motions.
"""


def held(drawn: tuple[str, dict[str, Any]]) -> tuple[str, Held]:
    """Compare a scene, given as (name of its band, arguments), with the reference. Return the name and the result."""
    name, scene = drawn
    return name, hold(scene)


@styled
def figure(motions: dict[str, Held]) -> Figure:
    """Draw the error of the instant of each switch, and its bound, over time, in one panel for each motion."""
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


def compare_with_reference(scenes: Sequence[tuple[str, dict[str, Any]]], workers: int) -> dict[str, list[Held]]:
    """Compare each scene with the reference in separate processes. Return a list of results for each band."""
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
    found = compare_with_reference(draw(SEED, options.scenes), options.workers)
    page = PAGE.format(number=options.scenes, seed=SEED, most=MOST, table="\n".join(table(found)))
    (options.docs / "certainty.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
