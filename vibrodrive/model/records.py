"""Records of a sweep for each motion: section, main impacts (kernels/record.py), summary and error bounds."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from vibrodrive.model.parameters import bad

SECTION, IMPACTS, SUMMARY, ERROR = "section", "impacts", "summary", "error"

RECORDS = (SECTION, IMPACTS, SUMMARY, ERROR)


class Quantity(NamedTuple):
    """Properties of an array of a record.

    `fill` is the value at points that are not computed, and after the last main impact. `along` is the name of a
    dimension in addition to the axes of the sweep, or "".
    """

    name: str
    dtype: str
    fill: Any
    unit: str
    meaning: str
    along: str = ""

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

OF_RECORD = {SUMMARY: SUMMARIES, IMPACTS: MAIN_IMPACTS, ERROR: ERRORS}


def period_words(period: int) -> str:
    """Return the period of a motion in words."""
    if period == UNSEEN:
        return f"period unknown, because the recorded switches span less than {LONGEST} periods"
    return f"period {period}" if period > 0 else f"no period up to {LONGEST}"


def check_record(record: object) -> tuple[str, ...]:
    """Return the names in `record`, which is one name or a list or tuple of names, in the order of RECORDS.

    Raises TypeError or ValueError.
    """
    names: Sequence[object] = [record] if isinstance(record, str) else record  # type: ignore[assignment]
    allowed = "one or several of " + ", ".join(RECORDS)
    if not isinstance(names, (list, tuple)) or any(not isinstance(name, str) for name in names):
        raise TypeError(bad("record", record, allowed))
    if not names or set(names) - set(RECORDS):
        raise ValueError(bad("record", record, allowed))
    if len(set(names)) < len(names):
        raise ValueError(bad("record", record, f"{allowed}, each of them once"))
    return tuple(name for name in RECORDS if name in names)


def quantities(record: tuple[str, ...]) -> tuple[Quantity, ...]:
    """Return the quantities of the given records, without the section, which is an array of its own."""
    return tuple(quantity for name, known in OF_RECORD.items() if name in record for quantity in known)


def point_bytes(record: tuple[str, ...], periods: int) -> int:
    """Return the number of bytes of one point in the given records."""
    size = 16 * periods if SECTION in record else 0
    return size + sum(q.itemsize * (2 * periods if q.along else 1) for q in quantities(record))
