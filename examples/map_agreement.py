"""The pixels of a map over A and B, held against the list of stable orbits.

    python -m examples.map_agreement   # in the root of a clone

writes docs/map_agreement.md. `--curves FILE` takes the curves from a file of `vibrodrive orbits`, `--sample N` judges N
pixels, `--docs DIR` writes to another folder.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from vibrodrive.model.config import read
from vibrodrive.periodic.curves import curves
from vibrodrive.store.curves import load_curves
from vibrodrive.validation.map_agreement import PATIENCE, PERIODS, TRANSIENT, compare_map, table

ROOT = Path(__file__).parent.parent

MAX_PERIOD = 3

PAGE = """# A map against the list of orbits

Written by `python -m examples.map_agreement --sample {sample}`.

The map is that of `configs/map_AB.toml` without its row B = 0: {num_A} × {num_B} motions from rest, of {transient}
and {periods} periods. The list is that of `orbits(A, B, {max_period})` at each pixel. A pixel agrees if its period, its
impacts a period and its largest impact speed (within 1e-4) are those of a stable orbit of the list; where the list has
none, if its motion has no period up to {max_period} either, or never leaves the obstacle. Pixels within one pixel of a
curve of `curves` (periods up to {max_period}) are left out. Of the others a sample with a fixed seed is judged, as each
takes a search of its own.

{table}

A disagreement is followed on: with {patience} periods of transient, and, if that does not settle it, from an impact
of the listed orbits. {verdict}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--docs", type=Path, default=ROOT / "docs", help="folder to write to")
    parser.add_argument("--curves", type=Path, help="file of curves over the ranges of the map")
    parser.add_argument("--sample", type=int, default=5000, help="pixels that are judged")
    options = parser.parse_args()
    plan = read(ROOT / "configs" / "map_AB.toml").plan()
    A, B = plan.axes["A"], plan.axes["B"][1:]
    ranges = [(float(v[0]), float(v[-1])) for v in (plan.axes["A"], plan.axes["B"])]
    found = load_curves(options.curves).curves if options.curves else curves(*ranges, MAX_PERIOD)
    agreement = compare_map(A, B, found, MAX_PERIOD, sample=options.sample)
    page = PAGE.format(
        sample=options.sample,
        num_A=len(A),
        num_B=len(B),
        max_period=MAX_PERIOD,
        table="\n".join(table(agreement)),
        patience=PATIENCE,
        transient=TRANSIENT,
        periods=PERIODS,
        verdict="99.9 % or more agree." if agreement.share >= 0.999 else "Fewer than 99.9 % agree.",
    )
    (options.docs / "map_agreement.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
