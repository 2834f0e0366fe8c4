"""What a check comes to: numbers, each with its bound, and one verdict."""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple


class Verdict(StrEnum):
    HOLDS = "holds"
    FAILS = "fails"
    NOT_DONE = "not done"


class NotDone(Exception):
    """Why a check cannot be done on this machine."""


class Finding(NamedTuple):
    """A number that is to be at most its bound (NaN is not), or a text that is to be equal to it."""

    what: str
    number: float | str
    bound: float | str

    @property
    def holds(self) -> bool:
        if isinstance(self.number, str) or isinstance(self.bound, str):
            return self.number == self.bound
        return self.number <= self.bound

    def record(self) -> dict[str, Any]:
        """As it is written to validation.json, which knows no infinity: null there."""
        number = self.number if isinstance(self.number, str) or math.isfinite(self.number) else None
        return {"what": self.what, "number": number, "bound": self.bound, "holds": self.holds}


@dataclass(frozen=True)
class Check:
    """A function of this package that returns findings, by the name of its module and its own.

    The module is imported when the check is done: `needs` names the packages, not among those vibrodrive depends on,
    without which that is impossible. A check that is `drawn` takes the seed of what it draws.
    """

    id: str
    title: str
    module: str
    function: str
    needs: tuple[str, ...] = ()
    drawn: bool = False


@dataclass(frozen=True)
class Judged:
    """A check and what came out; `note` says why it was not done, or what broke off."""

    check: Check
    findings: Sequence[Finding]
    verdict: Verdict
    note: str = ""

    def record(self) -> dict[str, Any]:
        """As it is written to validation.json."""
        return {
            "id": self.check.id,
            "title": self.check.title,
            "verdict": str(self.verdict),
            "note": self.note,
            "findings": [f.record() for f in self.findings],
        }


def judge(check: Check, seed: int) -> Judged:
    """Do a check. One that breaks off fails, and one whose package is missing is not done: neither stops the others."""
    try:
        function = getattr(importlib.import_module(f"vibrodrive.validation.{check.module}"), check.function)
        findings = function(seed) if check.drawn else function()
    except NotDone as why:
        return Judged(check, (), Verdict.NOT_DONE, str(why))
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package in check.needs:
            return Judged(check, (), Verdict.NOT_DONE, f"needs {package}")
        return _broken(check, error)
    except Exception as error:
        return _broken(check, error)
    holds = bool(findings) and all(f.holds for f in findings)
    return Judged(check, findings, Verdict.HOLDS if holds else Verdict.FAILS)


def _broken(check: Check, error: Exception) -> Judged:
    return Judged(check, (), Verdict.FAILS, f"broke off: {type(error).__name__}: {' '.join(str(error).split())}")
