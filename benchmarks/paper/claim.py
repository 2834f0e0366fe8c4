"""Claims of the paper, the functions that test them, and the page with the results.

The function of a claim computes numbers and a verdict from the motions of a Paper. It contains no expected result, so
other configurations give other numbers and possibly another verdict.
"""

from collections.abc import Callable, Iterable, Sequence
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from benchmarks.paper.motions import NotApplicable, Paper


class Verdict(StrEnum):
    REPRODUCED = "reproduced"
    CORRECTED = "reproduced with a correction"
    CONTRADICTED = "contradicted"
    NOT = "not computed"


class Outcome(NamedTuple):
    """Result of a claim: text, numbers and verdict."""

    text: str
    numbers: dict[str, Any]
    verdict: Verdict


class Claim(NamedTuple):
    """One statement of the paper. `figure` is the name of a drawing in FIGURES, or "limits"."""

    id: str
    figure: str
    says: str
    test: Callable[[Paper], Outcome]

    def judge(self, paper: Paper) -> Outcome:
        """Test the claim. If it cannot be tested, the verdict is "not computed"."""
        try:
            return self.test(paper)
        except NotApplicable as reason:
            return Outcome(f"not computed: {reason}", {}, Verdict.NOT)


CLAIMS: list[Claim] = []


def claim(figure: str, says: str) -> Callable[[Callable[[Paper], Outcome]], Callable[[Paper], Outcome]]:
    """Register the decorated function as the test of a claim. Its name, with hyphens, is the id of the claim."""

    def register(test: Callable[[Paper], Outcome]) -> Callable[[Paper], Outcome]:
        CLAIMS.append(Claim(test.__name__.replace("_", "-"), figure, says, test))
        return test

    return register


def when(reproduced: bool | np.bool_, corrected: bool | np.bool_ = False) -> Verdict:
    """Return the verdict: reproduced; otherwise, if `corrected`, reproduced with a correction; or contradicted."""
    if reproduced:
        return Verdict.REPRODUCED
    return Verdict.CORRECTED if corrected else Verdict.CONTRADICTED


def listed(items: Iterable[Any]) -> str:
    """Return values as text, separated by commas; “none” for no values."""
    return ", ".join(f"{i:g}" if isinstance(i, float) else str(i) for i in items) or "none"


def kept(answer: bool | None) -> str:
    return "kept" if answer else "lost"


HEAD = """\
# The paper's claims, recomputed

After this page you know which claims of the paper the program reproduces or contradicts, and with which numbers.

{counts}. In the root of a clone, `python -m benchmarks.paper` writes this page, claims.json with all numbers, and
Figs. 1 to 12. `--only fig07` computes one figure with its claims, `--only limits` the claims about limits.

figNN is Fig. NN of the paper, *An Example for the Orbital Stability of Permanently Disturbed Non-smooth Motions*
(1999), and the configuration of that name. *Reproduced with a correction* means that the claim holds in part, or with
numbers or reasons that differ from those of the paper. *Contradicted* means that a number or a statement of the paper
is wrong by more than another reading of it. *Not computed* claims are named, so that the list is complete. A claim is
judged over the sample of its figure, all its values of A and all its periods; a row that takes another says which.

Two rows rest on one hypothesis: that a zero is missing where Fig. 9b prints its step, 0.5. If it is, the claim about
Fig. 9b holds, and contradicts that about Fig. 10, whose step is then beyond the limit. If it is not, the paper sees in
Fig. 9b a limit near 0.5, to which 0.1 is “not yet critical”, and both claims fail together.

The results use these terms. A *main impact* has no faster impact within half an excitation period before or after it.
*The impacts are kept* if the main impacts of the disturbed motion follow each other in the order of the undisturbed
motion and after the same numbers of periods. *The order at the section is kept* if the section point of the undisturbed
motion that is nearest to the disturbed motion advances by one in every period. ρ is the largest distance between the
section points of the two motions. k₂ is the least disturbance at which the impacts, or the property that the text
names, are lost. k_u is the least disturbance at which all starts end in one motion. n is the period of the undisturbed
motion in excitation periods.

| figure | claim of the paper | result | verdict |
|---|---|---|---|"""


def page(judged: Sequence[tuple[Claim, Outcome]]) -> str:
    """Return the Markdown page with a row for each claim."""
    of_each = ", ".join(f"{v}: {sum(found.verdict is v for _, found in judged)}" for v in Verdict)
    cells = [(c.figure, c.says, found.text, f"**{found.verdict}**") for c, found in judged]
    rows = ["| " + " | ".join(cell.replace("|", r"\|") for cell in row) + " |" for row in cells]
    return "\n".join([HEAD.format(counts=f"Number of claims: {len(judged)} ({of_each})"), *rows, ""])
