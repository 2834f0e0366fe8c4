"""Claims of the paper, each computed from the configurations of this run and judged.

A claim is a function that looks at results and returns numbers with a verdict; nothing in it is known
beforehand, so another configuration gives other numbers and, where due, another verdict.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np

from vibrodrive.paper.session import NotApplicable, Session


class Verdict(StrEnum):
    REPRODUCED = "reproduced"
    CORRECTED = "reproduced with a correction"
    NOT = "not reproduced"


class Outcome(NamedTuple):
    """What came out: in words, in numbers, and the verdict."""

    text: str
    numbers: dict[str, Any]
    verdict: Verdict


@dataclass(frozen=True)
class Claim:
    """One thing the paper says. `figure` names what it is about (run.SUBJECTS): a drawing, or limits."""

    id: str
    figure: str
    says: str
    test: Callable[[Session], Outcome]


@dataclass(frozen=True)
class Judged:
    """A claim and what came out."""

    claim: Claim
    outcome: Outcome

    def record(self) -> dict[str, Any]:
        """As it is written to claims.json."""
        return {
            "id": self.claim.id,
            "figure": self.claim.figure,
            "paper": self.claim.says,
            "came_out": self.outcome.text,
            "numbers": {k: plain(v) for k, v in self.outcome.numbers.items()},
            "verdict": str(self.outcome.verdict),
        }


CLAIMS: list[Claim] = []


def claim(id: str, figure: str, says: str) -> Callable[[Callable[[Session], Outcome]], Callable[[Session], Outcome]]:
    """Register the function below as the test of a claim."""

    def register(test: Callable[[Session], Outcome]) -> Callable[[Session], Outcome]:
        CLAIMS.append(Claim(id, figure, says, test))
        return test

    return register


def judge(claim: Claim, session: Session) -> Judged:
    """Test a claim; a configuration on which it cannot be tested does not reproduce it."""
    try:
        return Judged(claim, claim.test(session))
    except NotApplicable as reason:
        return Judged(claim, Outcome(f"cannot be tested: {reason}", {}, Verdict.NOT))


def when(reproduced: bool | np.bool_, corrected: bool | np.bool_ = False) -> Verdict:
    """The verdict of two questions: as the paper says? If not, with a correction?"""
    if reproduced:
        return Verdict.REPRODUCED
    return Verdict.CORRECTED if corrected else Verdict.NOT


def listed(items: Iterable[Any]) -> str:
    """Values in a row, or “none”."""
    return ", ".join(f"{i:g}" if isinstance(i, float) else str(i) for i in items) or "none"


def plain(value: Any) -> Any:
    """A value as JSON can hold it: NumPy types become Python's, NaN and infinity null."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


READING = """\
figNN is Fig. NN of the paper, *An Example for the Orbital Stability of Permanently Disturbed Non-smooth Motions*
(1999), and the configuration of that name. *With a correction*: it holds in part, or with other numbers or reasons than
the paper's."""


def claims_table(judged: Sequence[Judged]) -> str:
    """The claims as a Markdown document."""
    counts = [f"{sum(j.outcome.verdict == v for j in judged)} {v}" for v in Verdict]
    lines = [
        "# The paper's claims, recomputed",
        "",
        f"{len(judged)} claims: {', '.join(counts)}. Written by `vibrodrive paper`.",
        "",
        READING,
        "",
        "| figure | the paper says | came out | verdict |",
        "|---|---|---|---|",
    ]
    for j in judged:
        cells = (j.claim.figure, j.claim.says, j.outcome.text, f"**{j.outcome.verdict}**")
        lines.append("| " + " | ".join(c.replace("|", r"\|") for c in cells) + " |")
    return "\n".join(lines) + "\n"
