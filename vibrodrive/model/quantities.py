"""Table of all quantities of results, one row for each of them.

Files, tables, figures, the explorer and the documentation take names, types, units, words and special values from this
table. A record (records.py) is a tuple of rows. No kernel imports this module: kernels know the columns of their
arrays, so an edit here recompiles nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from vibrodrive.model.choices import LONGEST, UNSEEN, Status
from vibrodrive.model.reasons import Beyond, How, Reason, Unproved
from vibrodrive.model.states import IN_WORDS, State, states

NUMBER, SIGNED = "number", "signed"
PERIODS, CYCLES, CODES, STATUSES, STRUCTURE = "periods", "cycles", "codes", "statuses", "structure"
"""How maps show a quantity: by shades of a scale, of a scale with 0 in its middle, or by one colour for each class."""

SHADED = (NUMBER, SIGNED)


class Quantity(NamedTuple):
    """Properties of an array of results.

    Attributes
    ----------
    name : name of the array in results.
    dtype : its type in files.
    fill : value at points that are not computed, and after the last main impact.
    meaning : one line for files and tables.
    unit : unit in files, in the notation of UDUNITS.
    scales : how it scales with a scene, a key of UNITS (physical.py); "" if it has no unit in SI.
    along : name of a dimension in addition to the axes of the sweep, or "".
    title : title of its pictures in the explorer; by default from its name.
    latin : words for it in SI in the explorer; by default its name.
    label : words for figures, with the mathtext of Matplotlib; by default `meaning` up to its first semicolon.
    shown : how maps show it: NUMBER, SIGNED, or one of the kinds of classes.
    special : values that are no numbers of a scale, such as −∞, each with words.
    lacking : words for computed points without a value.
    names : function that names a value of CYCLES.
    codes : meanings of the values of CODES.
    stored : name of its variable in files; by default `name`.
    source : name of the array that it is computed from; by default its own.
    """

    name: str
    dtype: str
    fill: Any
    meaning: str
    unit: str = "1"
    scales: str = ""
    along: str = ""
    label: str = ""
    shown: str = NUMBER
    special: tuple[tuple[float, str], ...] = ()
    lacking: str = "no such value"
    names: Callable[[int], str] | None = None
    codes: type[Reason] | None = None
    title: str = ""
    latin: str = ""
    stored: str = ""
    source: str = ""

    @property
    def itemsize(self) -> int:
        """Bytes of one value."""
        return int(self.dtype[2:])

    @property
    def variable(self) -> str:
        """Name of its variable in files and in an xarray.Dataset."""
        return self.stored or self.name

    @property
    def words(self) -> str:
        """Words for figures."""
        return self.label or self.meaning.split(";")[0].split(", 0:")[0]

    @property
    def classes(self) -> bool:
        """True if a map has one colour for each value, hence no range."""
        return self.shown not in SHADED


SCALES = ("length", "velocity", "time", "rate", "force", "momentum", "energy", "power")
"""Ways in which quantities scale with a scene, the keys of UNITS (physical.py)."""


def digits(number: int) -> str:
    """Return the digits of a number as text: 122 -> "1, 2, 2". Each digit is one gap."""
    return ", ".join(str(number))


def number(name: str, meaning: str, **fields: Any) -> Quantity:
    """Return the row of a real number for each point, NaN where it is not computed."""
    return Quantity(name, "<f8", math.nan, meaning, **fields)


SHORT = ((UNSEEN, "record too short"),)
UNLIMITED = ((math.inf, "no limit found"),)
RESTING = ((-math.inf, "−∞: the mass rests from time to time"),)
NO_PERIOD = "no periodic motion, or record too short"

SECTIONS = (
    number("xi", "gap ξ at the instants of the Poincaré section", scales="length", along="period",
           label=r"gap $\xi$", title="Gap ξ between mass and obstacle, once per shake", latin="gap x",
           stored="section_xi"),
    number("dxi", "velocity ξ' at the instants of the Poincaré section", scales="velocity", along="period",
           label=r"velocity $\xi\mathrm{′}$", title="Velocity ξ′ of the mass, once per shake",
           latin="velocity dx/dt", stored="section_dxi"),
)  # fmt: skip
"""Coordinates of the section points, the last dimension of the array `section`."""

LAST = (
    number("last_xi", "gap ξ at the last section", scales="length", label=r"$\xi$ at the last section",
           source="section"),
    number("last_dxi", "velocity ξ' at the last section", scales="velocity",
           label=r"$\xi\mathrm{′}$ at the last section", source="section"),
)  # fmt: skip
"""Coordinates of the last section point. A map over starts shows which of the coexisting motions each start reaches."""

MAIN_IMPACTS = (
    Quantity("impact_period", "<i8", -1, "number of completed excitation periods since τ = 0 at a main impact",
             along="impact"),
    number("impact_phase", "phase of the excitation at a main impact", unit="rad", along="impact",
           label=r"phase $\varphi$ of the main impacts",
           title="Phase of the shaking when the mass hits the obstacle"),
    number("impact_speed", "speed of a main impact", scales="velocity", along="impact",
           label=r"speed $|\xi\mathrm{′}|$ of the main impacts", title="Speed at which the mass hits the obstacle"),
    Quantity("impact_states", "<i4", -1, "states between the previous main impact and this one", along="impact"),
)  # fmt: skip
"""Quantities of the main impacts of a point. The impacts are in order of time, at most two per period."""

SUMMARIES = (
    Quantity(
        "period", "<i1", -1,
        f"period of the motion in excitation periods, 0: none up to {LONGEST}, {UNSEEN}: unknown, record too short",
        label="period of the motion", shown=PERIODS, special=SHORT, lacking="record too short", stored="motion_period",
    ),
    Quantity(
        "sequence", "<i8", -1, f"number that identifies the cycle of states, 0: no cycle, {UNSEEN}: unknown",
        label=f"cycle of states: {IN_WORDS}", shown=CYCLES, special=SHORT,
        lacking="record too short", names=states,
    ),
    Quantity(
        "gaps", "<i4", -1,
        f"periods between main impacts in a cycle in order of time, as digits, 0: none, {UNSEEN}: unknown",
        label="periods between main impacts", shown=CYCLES, special=SHORT, lacking="record too short", names=digits,
    ),
    number("impacts", "impacts per excitation period", scales="rate"),
    number("impact_speed_max", "largest impact speed", scales="velocity"),
    number("impact_speed_mean", "mean impact speed", scales="velocity"),
    number("xi_max", "largest gap ξ", scales="length"),
    number("dxi_min", "least velocity ξ'", scales="velocity"),
    number("dxi_max", "largest velocity ξ'", scales="velocity"),
    number("momentum", "momentum of the impacts, sum of |ξ'|, per excitation period", scales="momentum",
           label=r"momentum of the impacts $\sum|\xi\mathrm{′}|$ per period"),
    number("energy", "energy of the impacts, sum of ξ'²/2, per excitation period", scales="energy",
           label=r"energy of the impacts $\sum\xi\mathrm{′}^2/2$ per period"),
    number("friction_loss", "energy lost to friction per excitation period", scales="energy"),
    number("drive_work", "work of the excitation per excitation period", scales="energy"),
    number("lyapunov", "Lyapunov exponent per excitation period, at ε = 0; -inf: rests", scales="rate",
           label="Lyapunov exponent per period", shown=SIGNED, special=RESTING),
    number("share_up", "share of time sliding up"),
    number("share_down", "share of time sliding down"),
    number("share_stick", "share of time sticking in the air"),
    number("share_rest", "share of time resting at the obstacle"),
)  # fmt: skip
"""Quantities of a summary, in the order of the columns of kernels/summary.py."""

IMPACT_POWER = number("impact_power", "power of the impacts", scales="power", source="energy")
"""`energy` as a power in W, with the scene of the sweep."""

KEPT = Quantity(
    "kept", "<i1", -1, "1 if `gaps` equal those of the undisturbed motion, 0 if they differ",
    label="structure of the undisturbed motion", shown=STRUCTURE, lacking="no structure to compare", source="gaps",
)  # fmt: skip

ERRORS = (
    number("error_xi", "bound of the error of ξ at all points of the section, inf: none", scales="length"),
    number("error_dxi", "bound of the error of ξ' at all points of the section, inf: none", scales="velocity"),
    number("certain_until", "period from which on a decision may be wrong, inf: none"),
)
"""Error bounds. They are NaN with the method "fixed", and if the section was not computed to its end."""

_OF_LIMIT: dict[str, Any] = {"special": UNLIMITED, "lacking": NO_PERIOD}

LIMITS = (
    number("k2", "limit k2: smallest disturbance found at which the structure is lost; inf: none", **_OF_LIMIT),
    number(
        "last_kept",
        "largest value kept together with its lower neighbour, single ones above left out; 0: k2 is an upper bound",
        **_OF_LIMIT,
    ),
    number("share_kept", "share of the values tried between k2 and last_kept that are kept", lacking=NO_PERIOD),
    number("half_kept", "largest value kept at which at least half of the values around are kept", **_OF_LIMIT),
    Quantity("orbit_period", "<i1", -1, "period of the undisturbed orbit in excitation periods, 0: none",
             shown=PERIODS, lacking=NO_PERIOD),
    number("velocity", "k2 as a velocity amplitude: k2 eta A in eps, k2 in dtau", scales="velocity",
           label="limit $k_2$ as a velocity amplitude", **_OF_LIMIT),
    Quantity("how", "<i1", -1, "how the structure is lost at k2; -1: see status", shown=CODES, lacking=NO_PERIOD,
             codes=How),
)  # fmt: skip
"""The limit k₂ of each point (stability/limit.py)."""

IMPULSES = (
    number("velocity_any", "every disturbance whose impulse over any time stays below it keeps the structure for ever",
           scales="velocity", label="impulse that does no harm", lacking=NO_PERIOD),
    number("force_any", "every force below it keeps the structure for ever", scales="force",
           label="force that does no harm", lacking=NO_PERIOD),
    Quantity("any_how", "<i1", -1, "what is not proved beyond velocity_any, or at all; -1: see status", shown=CODES,
             lacking=NO_PERIOD, codes=Beyond),
)  # fmt: skip
"""What every disturbance may be at each point (stability/impulses.py)."""

ALWAYS = (
    number("k2_always", "ε up to which the structure is proved to be kept for all times, starts and phases",
           label="limit in $\\varepsilon$ for all times, proved", lacking=NO_PERIOD),
    number("starts_width", "least width of the intervals of phases of an impact from which it is kept", unit="rad",
           lacking=NO_PERIOD),
    Quantity("always_how", "<i1", -1, "why no larger k2_always is proved; -1: see status", shown=CODES,
             lacking=NO_PERIOD, codes=Unproved),
)  # fmt: skip
"""The limit for all times at each point (stability/always.py)."""

FAILURE_COUNTS = (
    Quantity("judged", "<i4", -1, "switches of a grid method compared with certified ones",
             label="switches compared with certified ones"),
    Quantity("missed", "<i4", -1, "switches that the method has passed over, for another transition",
             label="missed switches"),
    Quantity("late", "<i4", -1, "switches whose true zero the method has passed over, for a later one",
             label="late switches"),
    Quantity("wrong", "<i4", -1, "switches in time that lead to another state", label="wrong switches"),
)  # fmt: skip
"""Failures of a grid method at each point (stability/failures.py)."""

MARGIN = number("margin", "smallest distance of a decision from the opposite decision",
                label="distance of the closest decision")  # fmt: skip
SWITCHES = Quantity("switches", "<i8", -1, "switches into each state within the recorded periods", along="state")
STATUS = Quantity("status", "<i1", int(Status.NOT_COMPUTED), "result of the computation", label="status",
                  shown=STATUSES)  # fmt: skip

POINTS = (MARGIN, SWITCHES, STATUS)
"""Variables of the file of every sweep. The status of a block is written last, for readers while a sweep runs."""

OF_MOTION = (
    number("tau", "time τ", scales="time"),
    number("speed", "speed of an impact", scales="velocity"),
)
"""Further columns of the tables of a single motion."""

QUANTITIES = {
    q.name: q
    for q in (
        *SECTIONS, *LAST, *MAIN_IMPACTS, *SUMMARIES, IMPACT_POWER, KEPT, *ERRORS, *LIMITS, *IMPULSES, *ALWAYS,
        *FAILURE_COUNTS, *POINTS,
        *OF_MOTION,
    )
}  # fmt: skip
"""All quantities by name."""


def row_of(quantities: Iterable[Quantity], name: str) -> Quantity:
    """Return the row of a quantity: that of results, which may be a number of the user's own, or that of this table.

    A column without a row, such as a phase, is a number without a unit.
    """
    return next((q for q in quantities if q.name == name), None) or QUANTITIES.get(name) or number(name, name)


def values_of(results: Any, row: Quantity) -> Any:
    """Return the array of a quantity as recorded: ξ and ξ' are parts of the section, and a power is an energy."""
    import numpy as np

    if row in SECTIONS:
        return np.asarray(results.section)[..., SECTIONS.index(row)]
    return np.asarray(getattr(results, row.source or row.name))


def length_along(dimension: str, periods: int) -> tuple[int, ...]:
    """Return the length of the dimension `along` of a quantity for this number of recorded periods; () for ""."""
    if not dimension:  # nearly always
        return ()
    return {"period": (periods,), "impact": (2 * periods,), "state": (len(State),)}[dimension]


def period_words(period: int) -> str:
    """Return the period of a motion in words."""
    if period == UNSEEN:
        return "period unknown, because too few periods are recorded"
    return f"period {period}" if period > 0 else f"no period up to {LONGEST}"
