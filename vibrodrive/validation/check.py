"""Result of a check: numbers, each with its bound, and one verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from importlib.util import find_spec
from typing import NamedTuple

from vibrodrive.verdicts import Judged, NotApplicable


class Verdict(StrEnum):
    HOLDS = "holds"
    FAILS = "fails"
    NOT_DONE = "not done"


class Finding(NamedTuple):
    """A number with its upper bound, or a text with the text that it must equal. NaN exceeds every bound."""

    what: str
    number: float | str
    bound: float | str

    @property
    def holds(self) -> bool:
        if isinstance(self.number, str) or isinstance(self.bound, str):
            return self.number == self.bound
        return self.number <= self.bound


@dataclass(frozen=True)
class Check:
    """A check: a function that returns findings.

    `needs` names packages that the check requires although vibrodrive does not. If such a package is missing, the check
    is skipped. The function of a `drawn` check takes the seed of its random scenes as argument.
    """

    id: str
    title: str
    find: Callable[..., Sequence[Finding]]
    needs: tuple[str, ...] = ()
    drawn: bool = False


def judge(check: Check, seed: int) -> Judged:
    """Run a check. It fails if it raises an exception, and it is skipped if a package is missing."""
    findings: Sequence[Finding] = ()
    verdict, note = Verdict.NOT_DONE, ""
    try:
        if missing := [name for name in check.needs if find_spec(name) is None]:
            raise NotApplicable(f"needs {', '.join(missing)}")
        findings = check.find(seed) if check.drawn else check.find()
        verdict = Verdict.HOLDS if findings and all(f.holds for f in findings) else Verdict.FAILS
    except NotApplicable as why:
        note = str(why)
    except Exception as error:
        verdict, note = Verdict.FAILS, f"stopped with {type(error).__name__}: {' '.join(str(error).split())}"
    record = {"title": check.title, "note": note, "findings": [{**f._asdict(), "holds": f.holds} for f in findings]}
    rows = [[f"**{check.title}**", f"**{verdict}**{note and f': {note}'}", "", ""], *map(_row, findings)]
    return Judged(check.id, check.title, verdict, note, record, rows)


def _row(found: Finding) -> list[str]:
    holds = Verdict.HOLDS if found.holds else f"**{Verdict.FAILS}**"
    return [found.what, holds, *(v if isinstance(v, str) else f"{v:.3g}" for v in (found.number, found.bound))]
