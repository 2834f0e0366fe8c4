"""Choices that kernels take as integers: method of the search, visit of the grid, status of a trajectory.

This module imports no other module of the package. An edit here recompiles every kernel, unlike one in `parameters`.
"""

from __future__ import annotations

from enum import IntEnum


class Named(IntEnum):
    """A choice that prints as its name: "OK", not 0."""

    def __str__(self) -> str:
        return self.name


class Method(Named):
    """Method that finds the end of a state. `simulate` takes a member, or its name in lower case.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> [method.name.lower() for method in vd.Method]
    ['fixed', 'muller', 'certified']
    """

    FIXED = 0  # §5: the first grid point after the sign change is the switching time
    MULLER = 1  # §4: scan for the sign change, then Muller's method
    CERTIFIED = 2  # the first zero, guaranteed


class Scan(Named):
    """Visit of the grid by `fixed` and `muller`. Both choices give bitwise equal results.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> grid = {"method": "fixed", "dtau": 0.01, "transient": 0, "periods": 5}
    >>> skip, literal = (vd.simulate(1.5, **grid, scan=scan) for scan in vd.Scan)
    >>> bool((skip.section == literal.section).all())
    True
    """

    SKIP = 0  # skip grid points at which a sign change is proved impossible
    LITERAL = 1  # visit every grid point


class Status(Named):
    """Result of a trajectory: OK, or the reason why not. `advice` says what to do.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> motion = vd.simulate(A=0.5, transient=0, periods=1)
    >>> print(motion.status)
    NEVER_LEAVES
    >>> motion.status.advice.split(":")[0]
    'the mass comes to rest and the excitation is too weak to move it again'
    """

    OK = 0
    TOO_CLOSE = 1
    BUDGET = 2
    NEVER_LEAVES = 3
    NOT_COMPUTED = -1

    @property
    def advice(self) -> str:
        """One sentence with the result and the remedy."""
        return _ADVICE[self]


_ADVICE = {
    Status.OK: "every switch was located and decided, from the state that it starts from",
    Status.TOO_CLOSE: "a decision was closer than rounding, or what it has grown to, can tell: the motion before it "
    "stands, after it the other branch is as good; move a parameter slightly to see both",
    Status.BUDGET: "the switch budget of one period is spent (chatter): what follows is not computed; "
    "raise `budget` if so many switches are meant",
    Status.NEVER_LEAVES: "the mass comes to rest and the excitation is too weak to move it again: "
    "the section is constant; this is an answer, not a fault",
    Status.NOT_COMPUTED: "not computed yet: resume the sweep",
}
