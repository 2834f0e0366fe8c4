"""Recompute the paper: draw its figures, and test its claims on the results.

    python -m benchmarks.paper   # in the root of a clone; two minutes

writes fig01.png … fig12.png, the same as .pdf, three further figures, claims.json with the numbers of all claims, and
README.md, the page with the claims, beside this file or, with `-o DIR`, into DIR. `--only NAME`, which can be repeated,
computes one figure with its claims, or the claims about limits (`limits`), and leaves README.md unchanged.
"""

import argparse
from pathlib import Path

from benchmarks.common import say, write
from benchmarks.paper import claims_grid, claims_limits, claims_physical, claims_switches, claims_undisturbed
from benchmarks.paper.claim import CLAIMS, Claim, Outcome, page
from benchmarks.paper.figures import FIGURES
from benchmarks.paper.motions import Paper
from vibrodrive.figures import sheet as sheets

WITH_CLAIMS = (claims_grid, claims_limits, claims_physical, claims_switches, claims_undisturbed)
"""Modules whose import registers the claims."""

SUBJECTS = (*FIGURES, "limits")
HERE = Path(__file__).parent


def judge(paper: Paper, names: list[str]) -> list[tuple[Claim, Outcome]]:
    """Test the claims about the named figures, in the order of SUBJECTS."""
    judged = []
    for claim in sorted((c for c in CLAIMS if c.figure in names), key=lambda c: SUBJECTS.index(c.figure)):
        say(f"claim {claim.id}")
        judged.append((claim, claim.judge(paper)))
    return judged


def draw(paper: Paper, names: list[str], folder: Path) -> None:
    """Draw the named figures into NAME.png and NAME.pdf."""
    for name in (n for n in names if n in FIGURES):
        say(f"{name}: {FIGURES[name].title}")
        with sheets.drawn_on(style="print") as sheet:
            figure = FIGURES[name].draw(paper, sheet)
        for ending in (".png", ".pdf"):
            sheets.save(figure, folder / f"{name}{ending}")


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description=__doc__.split("\n")[0])
    parser.add_argument("-o", "--output", type=Path, default=HERE, help="directory (default: this program's)")
    parser.add_argument("--only", choices=SUBJECTS, action="append", help="compute this only (repeatable)")
    options = parser.parse_args(arguments)
    names, paper, folder = options.only or list(SUBJECTS), Paper(), options.output
    folder.mkdir(parents=True, exist_ok=True)
    draw(paper, names, folder)
    judged = judge(paper, names)
    rows = [
        {
            "id": c.id,
            "figure": c.figure,
            "paper": c.says,
            "came_out": o.text,
            "numbers": o.numbers,
            "verdict": o.verdict,
        }
        for c, o in judged
    ]
    write("claims", {"claims": rows}, None, folder)
    if not options.only:
        (folder / "README.md").write_text(page(judged), encoding="utf-8")


if __name__ == "__main__":
    main()
