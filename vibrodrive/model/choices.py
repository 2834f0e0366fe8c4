"""Choices that kernels take as integers: method of the search, status of a trajectory.

This module imports no other module of the package. An edit of this module recompiles every kernel.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Literal, TypeAlias

LONGEST = 64
"""Longest period of a motion that is searched for, in excitation periods."""

UNSEEN = -2
"""Value of `period`, `sequence` and `gaps` if the record is too short to show whether the motion repeats.

A period is found if the recorded switches span it. That there is none is known if they span LONGEST periods. Without a
period, `gaps` needs the cycle of gaps twice.
"""


class Named(IntEnum):
    """A choice that prints as its name, "OK", not 0, and equals it, in upper or lower case. As a key of a dict or a
    member of a set it is its number, because equal keys need equal hashes. `Status("OK")` is a member, as `Status(0)`.
    """

    @classmethod
    def _missing_(cls, value: object) -> Named:
        if isinstance(value, str) and value.upper() in cls.__members__:
            return cls[value.upper()]
        raise ValueError(f"{cls.__name__.lower()} = {value!r}: must be one of {', '.join(cls.__members__)}")

    def __str__(self) -> str:
        return self.name

    def __eq__(self, other: object) -> bool:
        return self.name == other.upper() if isinstance(other, str) else int.__eq__(self, other)

    def __ne__(self, other: object) -> bool:
        return self.name != other.upper() if isinstance(other, str) else int.__ne__(self, other)

    __hash__ = int.__hash__


class Method(Named):
    """Method that finds the end of a state. `simulate` accepts a member, or its name in lower case.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> [method.name.lower() for method in vd.Method]
    ['fixed', 'muller', 'certified']
    """

    FIXED = 0  # §5: the first grid point after the sign change is the switching time
    MULLER = 1  # §4: scan for the sign change, then Muller's method
    CERTIFIED = 2  # the first zero, guaranteed


MethodLike: TypeAlias = Method | Literal["certified", "muller", "fixed"]

ACTS_ON = {"dtau": (Method.FIXED, Method.MULLER), "tol": (Method.MULLER,)}
"""Methods that use `dtau` or `tol`. A method that does not use `dtau` has no grid."""

IN_LANES = (Method.FIXED, Method.MULLER, Method.CERTIFIED)
"""Methods for which kernels/engine.py advances many motions together. With any other method kernels/single.py computes
the motions one by one."""


def used_by(name: str) -> str:
    """Return the names of the methods that use `dtau` or `tol`, for messages."""
    return " and ".join(method.name.lower() for method in ACTS_ON[name])


class Status(Named):
    """Result of the computation of a trajectory: OK, or a problem. `advice` names the action to take.

    A member equals its name and its number, but in a set, a dict, `np.isin` or xarray it is the number only: write the
    member there, `vd.Status.OK`, or take the name, as in `motion.status.name in {"OK"}`. The names of an array are
    `Results.status.astype(str)`; a DataFrame has them.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> motion = vd.simulate(A=0.5, transient=0, periods=1)
    >>> print(motion.status)
    NEVER_LEAVES
    >>> motion.status == "NEVER_LEAVES" == vd.Status("never_leaves")
    True
    >>> motion.status.advice.split(":")[0]
    'the mass comes to rest and the excitation is too weak to move it again'
    """

    OK = 0
    TOO_CLOSE = 1
    BUDGET = 2
    NEVER_LEAVES = 3
    NO_ORBIT = 4
    TOO_SHORT = 5
    RAISED = 6
    NOT_COMPUTED = -1

    @property
    def advice(self) -> str:
        """One sentence with the result and the action to take."""
        return _ADVICE[self]

    @property
    def words(self) -> str:
        """The status of a motion in the words of figures and pages."""
        return _WORDS[self]


_WORDS = {
    Status.OK: "ok",
    Status.TOO_CLOSE: "too close to a decision",
    Status.BUDGET: "out of budget",
    Status.NEVER_LEAVES: "at rest permanently",
    Status.NO_ORBIT: "no periodic motion",
    Status.TOO_SHORT: "record too short",
    Status.RAISED: "function raised an exception",
    Status.NOT_COMPUTED: "not computed",
}

_ADVICE = {
    Status.OK: "computed to the end; with the method certified every switch was located and decided with a guarantee: "
    'in `simulate` and with the record "error" for the exact motion, else relative to the computed state before it',
    Status.TOO_CLOSE: "the margin of a decision is smaller than its possible error (rounding that has grown along the "
    "motion): the motion is valid before this decision; after it, the other possible motion is equally valid; change a "
    "parameter slightly to see both",
    Status.BUDGET: "one period needs more than `budget` switches (a long search counts as several switches): the rest "
    "of the motion is not computed; raise `budget` if so many switches are expected",
    Status.NEVER_LEAVES: "the mass comes to rest and the excitation is too weak to move it again: "
    "the section is constant; this is a valid result, not an error",
    Status.NO_ORBIT: "the undisturbed motion does not repeat within 64 periods, so it has no structure to lose; raise "
    "`transient` if it has not settled yet",
    Status.TOO_SHORT: "the record is shorter than four periods of the undisturbed orbit, too short to compare its "
    "structure: raise `periods`",
    Status.RAISED: "the function of the record raised an exception at this point: its numbers are NaN",
    Status.NOT_COMPUTED: "not computed yet: resume the sweep",
}
