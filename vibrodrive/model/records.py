"""Records of a sweep: what it keeps of each point.

Four records are taken of one motion: section, main impacts (kernels/record.py), summary and error bounds. The records
`limit` and `failures` are numbers that need several motions a point, and a function of a motion is a record, too
(stability/per_point.py computes them). A new record of the second sort is a tuple of quantities here and a function
there.
"""

import math
from collections.abc import Sequence
from enum import IntEnum
from typing import Any, NamedTuple

from vibrodrive.model.own import Own
from vibrodrive.model.parameters import bad, did_you_mean

SECTION, IMPACTS, SUMMARY, ERROR = "section", "impacts", "summary", "error"
LIMIT, FAILURES = "limit", "failures"

PER_POINT = (LIMIT, FAILURES)
"""Records that stability/per_point.py computes. Each of them excludes all others."""

RECORDS = (SECTION, IMPACTS, SUMMARY, ERROR, *PER_POINT)


class How(IntEnum):
    """How a motion loses the structure of the undisturbed orbit at k₂. Files contain the numbers."""

    KEPT = 0
    ORDER = 1
    GAPS = 2
    GAPS_IN_ANOTHER_ORDER = 3
    FEWER_IMPACTS = 4
    BUDGET = 5

    @property
    def meaning(self) -> str:
        return {
            How.KEPT: "no value tried is lost, so k2 is inf",
            How.ORDER: "the main impacts come in another order",
            How.GAPS: "other numbers of periods between the main impacts",
            How.GAPS_IN_ANOTHER_ORDER: "the numbers of periods between the main impacts in another order",
            How.FEWER_IMPACTS: "fewer main impacts, at the same numbers of periods",
            How.BUDGET: "the motion exceeds the budget",
        }[self]


class Quantity(NamedTuple):
    """Properties of an array of a record.

    `fill` is the value at points that are not computed, and after the last main impact. `along` is the name of a
    dimension in addition to the axes of the sweep, or "". `codes` are the meanings of the values of a code.
    """

    name: str
    dtype: str
    fill: Any
    unit: str
    meaning: str
    along: str = ""
    codes: type[How] | None = None

    @property
    def itemsize(self) -> int:
        """Bytes of one value."""
        return int(self.dtype[2:])


LONGEST = 64
"""Longest period of a motion that is searched for, in excitation periods."""

UNSEEN = -2
"""Value of `period`, `sequence` and `gaps` if the record is too short to show whether the motion repeats.

`period` and `sequence` need recorded switches over LONGEST periods, `gaps` needs each cycle of gaps twice.
"""

SUMMARIES = (
    Quantity(
        "period",
        "<i1",
        -1,
        "1",
        "period of the motion in excitation periods, 0: none up to 64, -2: unknown, record too short",
    ),
    Quantity("sequence", "<i8", -1, "1", "number that identifies the cycle of states, 0: no cycle, -2: unknown"),
    Quantity("gaps", "<i4", -1, "1", "periods between main impacts in one cycle, as digits, 0: no cycle, -2: unknown"),
    Quantity("impacts", "<f8", math.nan, "1", "impacts per excitation period"),
    Quantity("impact_speed_max", "<f8", math.nan, "1", "largest impact speed"),
    Quantity("impact_speed_mean", "<f8", math.nan, "1", "mean impact speed"),
    Quantity("xi_max", "<f8", math.nan, "1", "largest gap ξ"),
    Quantity("dxi_min", "<f8", math.nan, "1", "least velocity ξ'"),
    Quantity("dxi_max", "<f8", math.nan, "1", "largest velocity ξ'"),
    Quantity("momentum", "<f8", math.nan, "1", "momentum of the impacts, sum of |ξ'|, per excitation period"),
    Quantity("energy", "<f8", math.nan, "1", "energy of the impacts, sum of ξ'²/2, per excitation period"),
    Quantity("friction_loss", "<f8", math.nan, "1", "energy lost to friction per excitation period"),
    Quantity("drive_work", "<f8", math.nan, "1", "work of the excitation per excitation period"),
    Quantity("lyapunov", "<f8", math.nan, "1", "Lyapunov exponent per excitation period, at ε = 0; -inf: rests"),
    Quantity("share_up", "<f8", math.nan, "1", "share of time sliding up"),
    Quantity("share_down", "<f8", math.nan, "1", "share of time sliding down"),
    Quantity("share_stick", "<f8", math.nan, "1", "share of time sticking in the air"),
    Quantity("share_rest", "<f8", math.nan, "1", "share of time resting at the obstacle"),
)
"""Quantities of a summary, in the order of the columns of kernels/summary.py."""

MAIN_IMPACTS = (
    Quantity(
        "impact_period", "<i8", -1, "1", "number of completed excitation periods since τ = 0 at a main impact", "impact"
    ),
    Quantity("impact_phase", "<f8", math.nan, "rad", "phase of the excitation at a main impact", "impact"),
    Quantity("impact_speed", "<f8", math.nan, "1", "speed of a main impact", "impact"),
    Quantity("impact_states", "<i4", -1, "1", "states between the previous main impact and this one", "impact"),
)
"""Quantities of the main impacts of a point. The impacts are in order of time, at most two per period."""

ERRORS = (
    Quantity("error_xi", "<f8", math.nan, "1", "bound of the error of ξ at all points of the section, inf: none"),
    Quantity("error_dxi", "<f8", math.nan, "1", "bound of the error of ξ' at all points of the section, inf: none"),
    Quantity("certain_until", "<f8", math.nan, "1", "period from which on a decision may be wrong, inf: none"),
)
"""Error bounds. They are NaN with the method "fixed", and if the section was not computed to its end."""

LIMITS = (
    Quantity(
        "k2", "<f8", math.nan, "1", "limit k2: smallest disturbance found at which the structure is lost; inf: none"
    ),
    Quantity(
        "last_kept",
        "<f8",
        math.nan,
        "1",
        "largest value kept together with its lower neighbour, single ones above left out; 0: k2 is an upper bound",
    ),
    Quantity("share_kept", "<f8", math.nan, "1", "share of the values tried between k2 and last_kept that are kept"),
    Quantity(
        "half_kept", "<f8", math.nan, "1", "largest value kept at which at least half of the values around are kept"
    ),
    Quantity("orbit_period", "<i1", -1, "1", "period of the undisturbed orbit in excitation periods, 0: none"),
    Quantity("velocity", "<f8", math.nan, "1", "k2 as a velocity amplitude: k2 eta A in eps, k2 in dtau"),
    Quantity("how", "<i1", -1, "1", "how the structure is lost at k2; -1: see status", codes=How),
)
"""The limit k₂ of each point (stability/limit.py)."""

FAILURE_COUNTS = (
    Quantity("judged", "<i4", -1, "1", "switches of a grid method compared with certified ones"),
    Quantity("missed", "<i4", -1, "1", "switches that the method has passed over, for another transition"),
    Quantity("late", "<i4", -1, "1", "switches whose true zero the method has passed over, for a later one"),
    Quantity("wrong", "<i4", -1, "1", "switches in time that lead to another state"),
)
"""Failures of a grid method at each point (stability/failures.py)."""

OF_RECORD = {
    SUMMARY: SUMMARIES, IMPACTS: MAIN_IMPACTS, ERROR: ERRORS, LIMIT: LIMITS, FAILURES: FAILURE_COUNTS,
}  # fmt: skip

IN_FILES = (
    *(q.name for known in OF_RECORD.values() for q in known), "motion_period", "section_xi", "section_dxi", "status",
    "margin", "switches", "checksum", "point", "impact", "state", "impact_power", "last_xi", "last_dxi", "kept",
)  # fmt: skip
"""Names of variables and dimensions of files, and of quantities of figures."""

PERIODS = {LIMIT: 1500}
"""Recorded periods of the records for which the common default (names.py) is too short."""


def period_words(period: int) -> str:
    """Return the period of a motion in words."""
    if period == UNSEEN:
        return f"period unknown, because the recorded switches span less than {LONGEST} periods"
    return f"period {period}" if period > 0 else f"no period up to {LONGEST}"


def check_record(record: object) -> tuple[str, ...]:
    """Return the records in the order of RECORDS, and then the functions of a motion as `Own`.

    `record` is one name or function, or a list or tuple of them. Raises TypeError or ValueError.
    """
    given: Sequence[Any] = record if isinstance(record, (list, tuple)) else [record]
    allowed = "one or several of " + ", ".join(RECORDS) + ", or functions of a motion"
    if any(not isinstance(one, str) and not callable(one) for one in given):
        raise TypeError(bad("record", record, allowed))
    named = [one for one in given if _is_name(one)]
    own = [one if isinstance(one, Own) else Own.from_function(one) for one in given if not _is_name(one)]
    wrong = [name for name in named if name not in RECORDS]
    if wrong or not given:
        name = str(*wrong[:1])
        hint = f"; write {name.split(',')}" if "," in name else did_you_mean(name, RECORDS)
        raise ValueError(bad("record", record, allowed) + hint)
    for f in own:
        if f in RECORDS:
            raise ValueError(bad("record", f"the function {f}", "a function that has not the name of a record"))
    if len({*named, *own}) < len(given):
        raise ValueError(bad("record", record, f"{allowed}, each of them once"))
    for one in PER_POINT:
        if one in named and len(given) > 1:
            raise ValueError(bad("record", record, f'"{one}" alone, because it is computed from motions of its own'))
    return (*(name for name in RECORDS if name in named), *own)


def _is_name(one: object) -> bool:
    return isinstance(one, str) and not isinstance(one, Own)


def several_motions(record: tuple[str, ...]) -> bool:
    """Return True if stability/per_point.py computes a record, and False if one motion a point gives all of them."""
    return any(name in PER_POINT or isinstance(name, Own) for name in record)


def quantities(record: tuple[str, ...]) -> tuple[Quantity, ...]:
    """Return the quantities of the given records, without the section, which is an array of its own."""
    known = [quantity for name, known in OF_RECORD.items() if name in record for quantity in known]
    own = [
        Quantity(number, "<f8", math.nan, "1", number if number == one else f"{number} of the function {one}")
        for one in record
        if isinstance(one, Own)
        for number in one.numbers
    ]
    return (*known, *own)


def point_bytes(record: tuple[str, ...], periods: int) -> int:
    """Return the number of bytes of one point in the given records."""
    size = 16 * periods if SECTION in record else 0
    return size + sum(q.itemsize * (2 * periods if q.along else 1) for q in quantities(record))
