"""The five states of Fig. 2, and the sequences of them that a motion has."""

from __future__ import annotations

from vibrodrive.model.choices import Named


class State(Named):
    """The five states of Fig. 2: sliding up, sliding down, sticking in the air, resting at the obstacle, impact.

    Examples
    --------
    >>> import vibrodrive as vd
    >>> print(vd.State(2))
    STICK
    >>> int(vd.State.IMPACT)
    4
    """

    UP = 0
    DOWN = 1
    STICK = 2
    REST = 3
    IMPACT = 4


IN_WORDS = ", ".join(state.name.capitalize() for state in State)

PLAIN_STATES = 12
"""Largest number of states of a sequence that is shown as letters; a longer sequence is shown as its number."""


def states(number: int) -> str:
    """Return the letters of the states that the number of a sequence encodes (53 -> "UDI").

    For a long sequence return the number as text.
    """
    found: list[int] = []
    left = number
    while left and len(found) <= PLAIN_STATES:
        left, state = divmod(left, 6)
        found.append(state - 1)
    if left or -1 in found:
        return str(number)
    return "".join(State(s).name[0] for s in found[::-1])
