"""Claims of the paper and the functions that test them.

The function of a claim computes numbers and a verdict from the configurations of a run. It contains no expected result,
so other configurations give other numbers and possibly another verdict.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from vibrodrive.paper.session import Session
from vibrodrive.verdicts import Judged, NotApplicable, counts, table


class Verdict(StrEnum):
    REPRODUCED = "reproduced"
    CORRECTED = "reproduced with a correction"
    NOT = "not reproduced"


class Outcome(NamedTuple):
    """Result of a claim: text, numbers and verdict."""

    text: str
    numbers: dict[str, Any]
    verdict: Verdict


Test = Callable[[Session], Outcome]


@dataclass(frozen=True)
class Claim:
    """One statement of the paper. `figure` is a name in run.SUBJECTS: the name of a drawing, or "limits"."""

    id: str
    figure: str
    says: str
    test: Test


CLAIMS: list[Claim] = []


def claim(figure: str, says: str) -> Callable[[Test], Test]:
    """Register the decorated function as the test of a claim. Its name, with hyphens, is the id of the claim."""

    def register(test: Test) -> Test:
        CLAIMS.append(Claim(test.__name__.replace("_", "-"), figure, says, test))
        return test

    return register


def judge(claim: Claim, session: Session) -> Judged:
    """Test a claim. If the configuration does not allow a test, the verdict is "not reproduced"."""
    try:
        found = claim.test(session)
    except NotApplicable as reason:
        found = Outcome(f"cannot be tested: {reason}", {}, Verdict.NOT)
    record = {"figure": claim.figure, "paper": claim.says, "came_out": found.text, "numbers": found.numbers}
    rows = [[claim.figure, claim.says, found.text, f"**{found.verdict}**"]]
    return Judged(claim.id, claim.says, found.verdict, found.text, record, rows)


def when(reproduced: bool | np.bool_, corrected: bool | np.bool_ = False) -> Verdict:
    """Return the verdict: reproduced; otherwise, if `corrected`, reproduced with a correction; or not reproduced."""
    if reproduced:
        return Verdict.REPRODUCED
    return Verdict.CORRECTED if corrected else Verdict.NOT


def listed(items: Iterable[Any]) -> str:
    """Return values as text, separated by commas; “none” for no values."""
    return ", ".join(f"{i:g}" if isinstance(i, float) else str(i) for i in items) or "none"


READING = """\
figNN is Fig. NN of the paper, *An Example for the Orbital Stability of Permanently Disturbed Non-smooth Motions*
(1999), and the configuration of that name. *Reproduced with a correction* means that the claim holds in part, or with
numbers or reasons that differ from those of the paper.

The results use these terms. A *main impact* has no faster impact within half an excitation period before or after it.
*The impacts are kept* if the main impacts of the disturbed motion follow each other in the order of the undisturbed
motion and after the same numbers of periods. *The order at the section is kept* if the section point of the undisturbed
motion that is nearest to the disturbed motion advances by one in every period. ρ is the largest distance between the
section points of the two motions. k₂ is the least disturbance at which the impacts, or the property that the text
names, are lost. k_u is the least disturbance at which all starts end in one motion. n is the period of the undisturbed
motion in excitation periods."""


def claims_page(judged: Sequence[Judged]) -> list[str]:
    """Return the lines of claims.md."""
    return [
        "# The paper's claims, recomputed",
        "",
        "After this page you know which claims of the paper the program reproduces, and with which numbers.",
        "",
        f"{counts(judged, 'claims', Verdict)}. Written by `vibrodrive paper`.",
        "",
        READING,
        "",
        *table(["figure", "claim of the paper", "result", "verdict"], judged),
    ]
