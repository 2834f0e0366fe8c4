"""Records of a sweep: what it keeps of each point, one object for each record (record.py, own.py for functions).

Kernels write section, main impacts, summary and error bounds (batch/records.py). The record `failures` is taken from
each motion, `limit` from a search with several motions a point, and `impulses` and `always` from the undisturbed orbit
(stability/per_point.py).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from vibrodrive.model import quantities as rows
from vibrodrive.model.above import above
from vibrodrive.model.choices import Method, used_by
from vibrodrive.model.own import Own
from vibrodrive.model.parameters import bad, did_you_mean
from vibrodrive.model.quantities import (  # noqa: F401  the explorer's names
    IMPACT_POWER,
    KEPT,
    QUANTITIES,
    How,
    Quantity,
    values_of,
)  # fmt: skip
from vibrodrive.model.record import BLOCK_POINTS_SEVERAL, BLOCK_POINTS_SMALL, OfMotion, Record


class _Section(Record):
    quantities = rows.SECTIONS
    diagrams = ("dxi", "xi")
    maps = ("last_dxi", "last_xi")


class _Impacts(Record):
    quantities = rows.MAIN_IMPACTS
    diagrams = ("impact_phase", "impact_speed")


class _Summary(Record):
    quantities = rows.SUMMARIES
    summarised = True
    block_points = BLOCK_POINTS_SMALL

    @property
    def maps(self) -> tuple[str, ...]:
        return (*super().maps, KEPT.name, IMPACT_POWER.name)


class _ErrorBounds(Record):
    quantities = rows.ERRORS
    bounded = True
    maps = ()


class _Limit(Record):
    quantities = rows.LIMITS
    periods = 1500
    alone, per_point, seeks = True, True, True
    block_points = BLOCK_POINTS_SEVERAL
    wave = "blocks of limits"

    def bands(self, axes: int) -> bool:
        return axes == 1

    def text(self, sought: str = "") -> str:
        return f"{self} in {sought}"

    def refuse(self, plan: Any) -> None:
        varied, eps = plan.varied, plan.written("eps")
        if plan.sought == "eps" and eps != 0.0:
            raise ValueError(bad("eps", eps, "left out, because its limit is computed"))
        idle = {"section_phase": "limits do not depend on the section"}
        if plan.sought == "dtau" and eps == 0.0:
            idle["eta"] = "limits in dtau do not depend on eta if eps is 0"
        for name in idle.keys() & varied.keys():
            raise ValueError(bad(name, varied[name].tolist(), f"one number, because {idle[name]}"))


class _Impulses(Record):
    quantities = rows.IMPULSES
    alone, per_point = True, True
    wave = "blocks of impulses"
    idle: tuple[str, ...] = ("eps", "eta", "section_phase")
    why = "every disturbance is considered"

    def refuse(self, plan: Any) -> None:
        if plan.settings.method != Method.CERTIFIED:
            raise ValueError(bad("method", plan.settings.method_name, f'certified with record = "{self}"'))
        for name in self.idle:
            value = plan.written(name)
            if name in plan.varied or (name == "eps" and value != 0.0):
                allowed = "left out" if name == "eps" else "one number"
                raise ValueError(bad(name, value, f"{allowed}, because {self.why}"))


class _Always(_Impulses):
    quantities = rows.ALWAYS
    seeks = True
    wave = "blocks of proofs"
    block_points = 1  # a point may take a minute
    idle = ("eps", "section_phase")
    why = "every ε and every section is considered"


class _Failures(OfMotion):
    quantities = rows.FAILURE_COUNTS
    alone = True

    @property
    def maps(self) -> tuple[str, ...]:
        judged, *failures = super().maps  # `judged` says nothing of failures
        return (*failures, judged)

    def refuse(self, plan: Any) -> None:
        if plan.settings.method == Method.CERTIFIED:
            allowed = f'{used_by("dtau").replace(" and ", " or ")} with record = "{self}"'
            raise ValueError(bad("method", plan.settings.method_name, allowed))

    def numbers(self, motion: Any) -> Mapping[str, float]:
        return above("the failures of a motion")(motion)._asdict()


SECTION, IMPACTS, SUMMARY, ERROR = _Section("section"), _Impacts("impacts"), _Summary("summary"), _ErrorBounds("error")
LIMIT, IMPULSES, ALWAYS = _Limit("limit"), _Impulses("impulses"), _Always("always")
FAILURES = _Failures("failures")

RECORDS: dict[str, Record] = {
    record: record for record in (SECTION, IMPACTS, SUMMARY, ERROR, LIMIT, IMPULSES, ALWAYS, FAILURES)
}
"""All records by name, apart from functions, in the order in which results and files have them."""

Records = tuple[Record, ...]


def check_record(record: object) -> Records:
    """Return the records in the order of RECORDS, and then the functions of a motion as `Own`.

    `record` is one name or function, or a list or tuple of them. Raises TypeError or ValueError.
    """
    items: Sequence[Any] = record if isinstance(record, (list, tuple)) else [record]
    allowed = "one or several of " + ", ".join(RECORDS) + ", or functions of a motion"
    if any(not isinstance(item, str) and not callable(item) for item in items):
        raise TypeError(bad("record", record, allowed))
    named = [item for item in items if isinstance(item, str) and not isinstance(item, Own)]
    wrong = [name for name in named if name not in RECORDS]
    if wrong or not items:
        name = str(*wrong[:1])
        hint = f"; write {name.split(',')}" if "," in name else did_you_mean(name, RECORDS)
        raise ValueError(bad("record", record, allowed) + hint)
    own = [item if isinstance(item, Own) else Own.from_function(item) for item in items if item not in named]
    for f in own:
        if f in RECORDS:
            raise ValueError(bad("record", f"the function {f}", "a function that has not the name of a record"))
    if len({*own}) < len(own):
        different = "functions of different names (that of a lambda is 'function')"
        raise ValueError(bad("record", ", ".join(own), different))
    if len({*named, *own}) < len(items):
        raise ValueError(bad("record", record, f"{allowed}, each of them once"))
    ordered = [entry for entry in RECORDS.values() if entry in named]
    for name in ordered:
        if name.alone and len(items) > 1:
            raise ValueError(bad("record", record, f'"{name}" alone, because it is computed from motions of its own'))
    return (*ordered, *own)


def functions(records: Iterable[Record]) -> list[Own]:
    """Return the functions of the user among records."""
    return [record for record in records if isinstance(record, Own)]


def how_repeated(records: Records) -> str:
    """Return what must be repeated to continue a file. Only a call has functions."""
    if not functions(records):
        return "the sweep"
    names = [
        f'vd.own({record}, version="{record.version}")' if isinstance(record, Own) else f'"{record}"'
        for record in records
    ]
    argument = names[0] if len(names) == 1 else f"[{', '.join(names)}]"
    return f"the call in Python, vd.sweep(…, record={argument}, path=…),"


def quantities(records: Records) -> tuple[Quantity, ...]:
    """Return the quantities of the given records, without the section, which is an array of its own."""
    return tuple(q for record in records for q in record.quantities if q.along != "period")


TAKEN = {
    *QUANTITIES, *(q.variable for q in QUANTITIES.values()), *RECORDS, "point", "impact", "state", "digests",
}  # fmt: skip
"""Names that a number of a function cannot have, because files and figures use them."""
