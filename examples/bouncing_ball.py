"""Compare the limit B → ∞ with the completely inelastic bouncing ball of Mehta and Luck (1990).

    python -m examples.bouncing_ball   # in the root of a clone

writes docs/bouncing_ball.md and docs/bouncing_ball.png. Both show over B the errors of five laws of the ball, which are
compared with the orbit with one impact per period. `--docs DIR` writes both files to another folder.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from vibrodrive.figures.looks import INK
from vibrodrive.figures.style import new, save, styled
from vibrodrive.validation.bouncing_ball import Approach, approach, table

DOCS = Path(__file__).parent.parent / "docs"

MARKS = "os^vD"

PAGE = """# The inelastic bouncing ball

After this page you know how well the program agrees with published laws. For B → ∞ the model becomes the
completely inelastic bouncing ball, whose laws are known in closed form. `python -m examples.bouncing_ball`
writes this page.

On a steeper or smoother incline the effect of friction is smaller. In units of friction, gravity along the
incline is B = tan α / μ, and the largest acceleration of the excitation is A. For large B the mass becomes a
ball that falls onto a vibrating table and does not rebound: the completely inelastic bouncing ball of Mehta and
Luck (Phys. Rev. Lett. 65, 393, 1990). Its only parameter is Γ = A/B, the ratio of the largest acceleration of the
table to the acceleration of gravity along the incline. These laws are known:

- Up to Γ = √(1 + π²) the ball rests after each impact. At larger Γ the downward acceleration of the table exceeds
  gravity at the impact, so the ball leaves the table again immediately.
- For Γ between √(1 + π²) and √(4 + π²), the orbit with one impact per period is stable. Its multiplier is
  1 − √(Γ² − π²): 0 where the rest vanishes, −1 where the period doubles.
- The impacts are at the phase arccos(π/Γ) of the excitation sin τ, with the speed |ξ'| = 2πB. In SI units this
  is g sin α times the period of the excitation: the speed after a free fall of one period along the incline.

The ratio of friction to gravity is 1/B, so for finite B the errors of these laws are about a constant times 1/B.
This constant is the first-order term, known in closed form except for the time of the reversal
([vibrodrive/validation/bouncing_ball.py](../vibrodrive/validation/bouncing_ball.py) derives it). The last column of
the second table shows the error that remains after this term. It is of the order 1/B² until, at B = 1e7 to 1e8,
only rounding remains.

{table}

The verdict is "holds" if the slope of log(error) over log(B) is −1 within 0.01, and (value − law) · B at the
largest B equals the first-order term within a relative difference of 1e-5. Γ is from `bifurcations`; phase, speed
and multiplier are from `orbits`. At every B in the table the error of the law is larger than rounding. Larger
powers of ten are not possible, because A = ΓB must not exceed 1e9. At B = 10 the laws do not apply at Γ = 3.5: the
rest vanishes at a Γ that is larger by 0.26, so the mass still rests.

![Relative error of the five laws over B](bouncing_ball.png)

*Marks: relative difference between each law and the result of the program. Lines: the derived first-order term
in 1/B, with slope −1.*
"""


@styled
def figure(found: Sequence[Approach]) -> Figure:
    """Draw the relative error of each law over B. For each law a line of slope -1 shows the derived first-order
    term."""
    fig, axes = new(height=4.2)
    ax = axes[0, 0]
    for a, mark in zip(sorted(found, key=lambda a: -a.error[0]), MARKS, strict=True):
        ends = a.B[[0, -1]]
        ax.loglog(ends, np.abs(a.law.factor / a.law.limit) / ends, color=INK, lw=0.6)
        ax.loglog(a.B, a.error, mark, mfc="white", mec=INK, ms=6, label=f"{a.law.quantity}: {a.law.formula}")
    ax.set_xlabel("$B$ (gravity along the incline over friction)")
    ax.set_ylabel("relative error at $B$ of the law for the limit $B → ∞$")
    ax.legend(title="law of the inelastic bouncing ball, $Γ = A/B$", loc="upper right", alignment="left")
    ax.text(0.03, 0.06, "lines: first order in $1/B$, derived", transform=ax.transAxes, fontsize=9)
    return fig


def main() -> None:
    parser = argparse.ArgumentParser(description="Write the page and the figure of the inelastic bouncing ball.")
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder to write to")
    folder = parser.parse_args().docs
    found = approach()
    (folder / "bouncing_ball.md").write_text(PAGE.format(table="\n".join(table(found))))
    save(figure(found), folder / "bouncing_ball.png", dpi=140)


if __name__ == "__main__":
    main()
